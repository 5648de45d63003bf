"""`serve` as a newcomer and as a mishap meet it: real processes, real signals."""

import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import psutil
import pytest

from action_assistant import supervisor
from action_assistant.interpreter import Interpreter
from action_assistant.supervisor import Child, EndSignal, Watchdog
from support.product import Product, running


def eventually(holds: Callable[[], bool], seconds: float = 20) -> None:
    """Wait until something holds."""
    deadline = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < deadline, "it never came to pass"
        time.sleep(0.05)


@pytest.mark.usefixtures("new_interpreters")
def test_both_processes_answer_and_end_together(tmp_path: Path) -> None:
    with running(tmp_path / "data") as product:
        family = psutil.Process(product.process("editor").ppid()).children()
        assert len(family) == 2
        assert "editor" not in " ".join(product.process("runner").cmdline()[1:])
        with product.editor() as editor:
            config = editor.get("/api/config").json()
        assert config["mode"] == "local"
        assert config["runner_url"] == product.runner_url
    assert not any(process.is_running() for process in family)


@pytest.mark.parametrize("name", ["editor", "runner"])
def test_a_process_that_dies_comes_back_and_the_other_stays(tmp_path: Path, name: str) -> None:
    with running(tmp_path / "data") as product:
        other = product.process("runner" if name == "editor" else "editor")
        first = product.process(name)
        first.kill()
        eventually(lambda: not first.is_running())
        product.wait_until_ready()
        assert product.process(name).pid != first.pid
        assert other.is_running()
        assert f"{name} died (SIGKILL)" in product.log.read_text()


def test_a_frozen_editor_is_started_anew_and_a_frozen_runner_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_WATCHDOG", "2")
    with running(tmp_path / "data") as product:
        editor, runner = product.process("editor"), product.process("runner")
        eventually(lambda: "ready at" in product.log.read_text(), 60)  # it is watched from then on
        editor.suspend()
        eventually(lambda: not editor.is_running(), 60)
        product.wait_until_ready()
        runner.suspend()
        eventually(lambda: "NO STOP MAY ARRIVE" in product.log.read_text(), 60)
        runner.resume()
        eventually(lambda: "runner answers again" in product.log.read_text(), 60)
        assert product.process("editor").pid != editor.pid
        assert product.process("runner").pid == runner.pid
        log = product.log.read_text()
        assert "editor has not answered for 2 s; ending it" in log
        assert "editor died (SIGKILL); starting it again" in log


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Lines that the supervisor writes."""
    lines: list[str] = []
    monkeypatch.setattr(supervisor, "say", lambda line, *_: lines.append(line))
    return lines


def watched(name: str) -> tuple[Child, Watchdog]:
    """A process that was started once, and what watches it."""
    child = Child(name, [], 1, Interpreter(path=Path(sys.executable), origin="this"), {})
    child.starts = 1
    return child, Watchdog(child, "http://127.0.0.1", None, 60)


def test_a_start_that_takes_hours_is_no_silence(said: list[str]) -> None:
    """Tables are changed before the first answer, also at a start in between."""
    child, watchdog = watched("editor")
    for _ in range(1_000):
        watchdog.note(1, answers=False, seconds=10)
    watchdog.note(1, answers=True, seconds=10)
    child.starts = 2
    for _ in range(1_000):
        watchdog.note(2, answers=False, seconds=10)
    assert said == []


@pytest.mark.parametrize(("name", "lines"), [("editor", 2), ("runner", 10)])
def test_silence_is_said_at_once_and_each_minute(name: str, lines: int, said: list[str]) -> None:
    _, watchdog = watched(name)
    watchdog.note(1, answers=True, seconds=10)
    for _ in range(60):
        watchdog.note(1, answers=False, seconds=10)
    assert len(said) == lines
    assert "not answered for 20 s" in said[0]


@pytest.mark.usefixtures("new_interpreters")
def test_children_do_not_outlive_a_killed_serve(tmp_path: Path) -> None:
    product = Product(tmp_path / "data")
    product.start()
    children = [product.process("editor"), product.process("runner")]
    product.kill_serve()
    eventually(lambda: not any(child.is_running() for child in children))


def test_graphs_from_before_kill_9_are_served_after_it(tmp_path: Path) -> None:
    product = Product(tmp_path / "data")
    product.start()
    with product.editor() as editor:
        made = editor.post("/api/graphs", json={"name": "patrol"}).json()
    product.kill()
    lost = product.cli("stop", "--all", "--data", str(product.data))
    assert lost.returncode == 2
    assert f"The last one, at {product.url}, was killed." in lost.stderr
    product.start()
    with product.editor() as editor:
        assert editor.get(f"/api/graphs/{made['id']}").json()["name"] == "patrol"
    assert product.cli("stop", "--all", "--data", str(product.data)).returncode == 0
    assert product.end() == 0


def test_a_taken_port_is_one_clear_sentence(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        product = Product(tmp_path)
        for command in ("serve", "editor", "runner"):
            answer = product.process_of(command, "--port", str(port), "--data", str(tmp_path))
            assert answer.returncode == 2
            assert answer.stderr.splitlines() == [
                f"action-assistant: Port {port} is taken on 127.0.0.1; choose another with --port."
            ]


def test_a_folder_that_cannot_be_written_is_one_clear_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    answer = Product(tmp_path).process_of(
        "serve", "--data", str(tmp_path / "file" / "data"), "--no-open"
    )
    assert answer.returncode == 2
    assert answer.stderr.startswith("action-assistant: Cannot write to the data folder")
    assert len(answer.stderr.splitlines()) == 1


def test_a_misspelt_setting_is_not_ignored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_TOKN", "x")
    answer = Product(tmp_path).process_of("serve", "--data", str(tmp_path))
    assert answer.returncode == 2
    assert "Unknown setting ACTION_ASSISTANT_TOKN" in answer.stderr


def test_the_network_is_not_let_in_by_accident(tmp_path: Path) -> None:
    answer = Product(tmp_path).process_of("serve", "--data", str(tmp_path), "--host", "0.0.0.0")
    assert answer.returncode == 2
    assert "ACTION_ASSISTANT_HOSTS" in answer.stderr


@pytest.fixture
def nobody_listens() -> Iterator[None]:
    """Signals of the tests are as they were, afterwards."""
    before = signal.getsignal(signal.SIGUSR1)
    yield
    sys.settrace(None)
    signal.signal(signal.SIGUSR1, before)


@pytest.mark.timeout(20)
@pytest.mark.usefixtures("nobody_listens")
def test_a_signal_to_end_is_heard_wherever_it_comes() -> None:
    """Before each line that waiting for it runs, also where a library holds a lock."""
    enough = EndSignal(signal.SIGUSR1)
    came = 0

    def everywhere(frame: FrameType, event: str, _: object) -> Any:
        nonlocal came
        if event == "line":
            came += 1
            signal.raise_signal(signal.SIGUSR1)
        return everywhere

    sys.settrace(everywhere)
    heard = [enough.within(0.01) for _ in range(3)]
    sys.settrace(None)
    assert came >= 3
    assert heard == [True, True, True]
