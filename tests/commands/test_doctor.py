"""`doctor` on installations that are broken for real."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from action_assistant.interpreter import VARIABLE, rclpy_fits
from support.product import free_ports, running

BASE = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


def doctor(
    data: Path, *flags: str, **environment: str
) -> tuple[int, dict[str, list[dict[str, Any]]]]:
    """The exit code, and the findings by topic."""
    command = [sys.executable, "-m", "action_assistant", "doctor", "--json", "--data", str(data)]
    answer = subprocess.run(
        [*command, *flags],
        env={**os.environ, **BASE, **environment},
        capture_output=True,
        check=False,
        timeout=60,
    )
    found: dict[str, list[dict[str, Any]]] = {}
    for each in json.loads(answer.stdout):
        found.setdefault(each["topic"], []).append(each)
    return answer.returncode, found


def machine(data: Path, *flags: str, **more: str) -> tuple[int, dict[str, list[dict[str, Any]]]]:
    return doctor(data, "--only", "machine", *flags, **more)


def contents(folder: Path) -> dict[str, bytes]:
    """Its files; SQLite comes and goes with its own beside them."""
    files = (each for each in folder.iterdir() if each.is_file())
    return {
        each.name: each.read_bytes() for each in files if not each.name.endswith(("-wal", "-shm"))
    }


@pytest.mark.parametrize("flags", [(), ("--share", "--tls")])
def test_a_healthy_installation_that_runs_is_called_so(
    flags: tuple[str, ...], tmp_path: Path
) -> None:
    with running(tmp_path / "data", *flags) as product:
        code, found = machine(product.data, "--port", str(product.port))
    assert code == 0, found
    assert found["editor"][0]["what"] == f"It runs on port {product.port}."
    assert found["runs"][0]["verdict"] == found["data folder"][0]["verdict"] == "fine"
    before = contents(product.data)
    machine(product.data)
    assert contents(product.data) == before, "looking changes nothing"


def test_a_port_that_something_else_has_is_named(tmp_path: Path) -> None:
    with socket.socket() as other:
        port = free_ports()
        other.bind(("127.0.0.1", port))
        other.listen()
        code, found = machine(tmp_path, "--port", str(port))
    assert code == 1
    assert found["editor"][0]["verdict"] == "wrong"
    assert found["editor"][0]["what"].startswith(f"Port {port} is taken")
    assert found["runner"][0]["verdict"] == "fine"


def test_a_folder_and_databases_that_cannot_be_used_are_named(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "editor.db").write_bytes(b"no database at all" * 100)
    code, found = machine(tmp_path / "data")
    assert code == 1
    assert "file is not a database" in found["database"][0]["what"]
    (tmp_path / "file").write_text("in the way")
    code, found = machine(tmp_path / "file")
    assert code == 1
    assert found["data folder"][0]["what"].startswith("Cannot write to the data folder")


def test_a_postgres_that_does_not_answer_is_named_without_its_password(tmp_path: Path) -> None:
    port = free_ports()
    code, found = machine(
        tmp_path, "--database", f"postgresql://ann:secret@127.0.0.1:{port}/graphs"
    )
    assert code == 1
    assert found["database"][0]["verdict"] == "wrong"
    assert "secret" not in json.dumps(found)


@pytest.mark.skipif(rclpy_fits(), reason="this Python speaks ROS 2 by itself")
def test_a_missing_rclpy_matters_only_where_there_are_robots(tmp_path: Path) -> None:
    without = {VARIABLE: sys.executable}
    code, found = doctor(tmp_path, "--only", "ros", **without)
    assert (code, found["rclpy"][0]["verdict"]) == (0, "note")
    assert "rclpy is not there for this Python" in found["rclpy"][0]["what"]
    with running(tmp_path / "data") as product, product.runner() as runner:
        runner.post("/api/robots", json={"name": "ada"}).raise_for_status()
        code, found = doctor(product.data, "--only", "ros", **without)
    assert (code, found["rclpy"][0]["verdict"]) == (1, "wrong")


def test_an_environment_that_hinders_is_named(tmp_path: Path) -> None:
    _, found = doctor(tmp_path, "--only", "ros", ROS_VERSION="1", ROS_DOMAIN_ID="120")
    assert found["environment"][0]["what"] == "ROS 1 is sourced in this shell."
    notes = " ".join(each["what"] for each in found["domain"])
    assert "Domain 120 uses ports" in notes
    assert "only engines on this computer" in notes


def test_a_named_python_that_is_none_is_one_clear_sentence(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "action_assistant", "doctor", "--data", str(tmp_path)]
    answer = subprocess.run(
        command,
        env={**os.environ, VARIABLE: str(tmp_path / "nothing")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 2
    assert "is no program" in answer.stderr
    assert len(answer.stderr.splitlines()) == 1
