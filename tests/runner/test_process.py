"""The runner as a process: what it never loads, and what a kill leaves behind."""

import os
import signal
import socket
import sqlite3
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from runner.harness import order, sequence
from runner.process import BEARER, RunnerProcess, over, started

FORBIDDEN = ("pycrdt", "action_assistant.editor")


def test_the_runner_loads_neither_the_editor_nor_a_crdt() -> None:
    code = "import sys, action_assistant.runner.app; print('\\n'.join(sys.modules))"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert [name for name in loaded if name.startswith(FORBIDDEN)] == []
    assert "action_assistant.runner.execution.service" in loaded


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="needs /proc")
@pytest.mark.usefixtures("new_interpreters")
def test_a_runner_that_has_worked_has_no_crdt_in_its_memory(own_process: RunnerProcess) -> None:
    with own_process.client() as client:
        run = started(client, order(sequence(), script={"*": [{"after_s": 0.01}]}))
        assert over(client, run["id"])["state"] == "finished"
    assert "pycrdt" not in Path(f"/proc/{own_process.pid}/maps").read_text()


def test_its_arguments_never_say_editor(process: RunnerProcess) -> None:
    command = Path(f"/proc/{process.pid}/cmdline")
    if not command.exists():
        pytest.skip("needs /proc")
    arguments = command.read_bytes().replace(os.fsencode(process.data), b"")
    assert b"editor" not in arguments


def test_after_kill_9_a_run_is_told_truthfully(own_process: RunnerProcess) -> None:
    with own_process.client() as client:
        done = started(client, order(sequence(actions=1), script={"*": [{"after_s": 0.02}]}))
        before = over(client, done["id"])
        run = started(client, order(sequence(actions=3), script={"Work_1": [{"never": True}]}))
        while client.get(f"/api/runs/{run['id']}").json()["actions"]["Work_1"]["visits"] == []:
            time.sleep(0.05)
        time.sleep(0.2)
    own_process.kill()
    own_process.start()
    with own_process.client() as client:
        found = over(client, run["id"])
        assert found["state"] == "lost"
        assert found["actions"]["Work_0"]["visits"][0]["result"] == "true"
        assert found["actions"]["Work_1"]["visits"][0]["until"] is None
        assert client.get(f"/api/runs/{done['id']}").json() == before
        assert [each["state"] for each in client.get("/api/runs").json()] == ["lost", "finished"]
        assert started(client, order(sequence()))["number"] == 3


def test_a_stop_that_came_while_the_runner_stood_still_is_carried_out(
    process: RunnerProcess,
) -> None:
    """The runner stands still for longer than a connection may be silent, and two clients do not wait."""
    bearer = "".join(f"\r\n{name}: {value}" for name, value in BEARER.items())
    head = f"HTTP/1.1\r\nhost: 127.0.0.1:{process.port}{bearer}\r\ncontent-length: "
    with process.client() as client, ExitStack() as opened:
        stopped: list[tuple[socket.socket, bytes]] = []
        for rest in (b"0\r\n\r\n", b"0\r\n\r\n", b"2\r\n\r\n{}", b"9\r\n\r\n{"):
            run = started(client, order(sequence(), script={"*": [{"never": True}]}))["id"]
            wire = opened.enter_context(socket.create_connection(("127.0.0.1", process.port), 20))
            stopped.append((wire, f"POST /api/runs/{run}/stop {head}".encode() + rest))
        kept_alive, _, *impatient = (wire for wire, _ in stopped)
        kept_alive.sendall(f"GET /healthz {head}0\r\n\r\n".encode())
        assert kept_alive.recv(12) == b"HTTP/1.1 200"
        time.sleep(0.2)  # all are accepted
        os.kill(process.pid, signal.SIGSTOP)
        try:
            for wire, stop in stopped:
                wire.sendall(stop)
            for wire in impatient:
                wire.close()
            time.sleep(10.5)
        finally:
            os.kill(process.pid, signal.SIGCONT)
        for _, stop in stopped:
            assert over(client, stop.split(b"/")[3].decode())["state"] == "stopped"


def test_nobody_without_credentials_gets_in(process: RunnerProcess) -> None:
    with process.client() as client:
        del client.headers["authorization"]
        assert client.get("/api/runs").status_code == 401
        assert client.post("/api/stop").status_code == 401
        assert client.get("/healthz").status_code == 200


def test_a_database_of_a_newer_version_is_one_clear_sentence(own_process: RunnerProcess) -> None:
    own_process.end()
    with sqlite3.connect(own_process.data / "runner.db") as database:
        database.execute("UPDATE alembic_version SET version_num = 'runner_9999'")
    database.close()
    ended = subprocess.run(
        [
            *(sys.executable, "-m", "action_assistant", "runner"),
            *("--data", str(own_process.data), "--port", str(own_process.port)),
        ],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert ended.returncode == 2
    assert "newer version" in ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1
