"""Processes of the product that are forked for tests are like those that people start."""

import os
import socket
from pathlib import Path

import psutil
import pytest

from support import warm
from support.product import Product, running

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/stat").exists() or "TEST_LONG" in os.environ,
    reason="takes long: `make soak ARGS=long`",
)


def test_a_fork_has_the_arguments_the_session_and_the_ends_of_a_new_process(tmp_path: Path) -> None:
    with running(tmp_path / "data") as product:
        editor, runner = product.process("editor"), product.process("runner")
        serve = psutil.Process(editor.ppid())
        assert serve.pid == runner.ppid()
        assert {*serve.children()} == {editor, runner}
        assert os.getsid(editor.pid) == os.getsid(runner.pid) == serve.pid
        assert serve.cmdline()[1:4] == ["-m", "action_assistant", "serve"]
        assert runner.cmdline()[1:4] == ["-m", "action_assistant", "runner"]
    assert not serve.is_running()
    assert "ready at" in product.log.read_text()


def test_a_fork_that_cannot_start_ends_with_the_code_of_the_command(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = str(other.getsockname()[1])
        words = ["runner", "--data", str(tmp_path / "data"), "--port", port]
        assert warm.start(words, os.environ, log).wait(60) == 2
    assert "is taken" in log.read_text()


def test_what_dies_later_is_started_by_a_new_interpreter(tmp_path: Path) -> None:
    with running(tmp_path / "data") as product:
        first = product.process("runner")
        maps = Path(f"/proc/{first.pid}/maps")
        assert "pycrdt" in maps.read_text()  # loaded by the process of which it is a fork
        first.kill()
        first.wait(20)
        product.wait_until_ready()
        again = product.process("runner")
        assert again.pid != first.pid
        assert "pycrdt" not in Path(f"/proc/{again.pid}/maps").read_text()


@pytest.mark.parametrize("name", ["TZ", warm.NEW_INTERPRETERS])
def test_what_an_interpreter_reads_once_takes_a_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setenv(name, "Europe/Tallinn")
    product = Product(tmp_path / "data")
    product.start()
    try:
        assert "pycrdt" not in Path(f"/proc/{product.process('runner').pid}/maps").read_text()
    finally:
        product.end()
