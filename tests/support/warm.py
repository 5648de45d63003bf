"""Processes of the product for tests, forked from one that has loaded its modules.

To load them costs a process a second of a processor and more, and each product has three processes. What a
fork runs is what `python -m action_assistant` runs, from its first line on, with the arguments, the
environment and the files of the test. `make soak`, tests of the start itself (the fixture
`new_interpreters`) and tests that give variables to the interpreter start the real command.
"""

import atexit
import contextlib
import ctypes
import gc
import importlib
import inspect
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol

_MODULES: Final = (
    *("action_assistant.cli", "action_assistant.commands.processes", "action_assistant.supervisor"),
    *("action_assistant.editor.app", "action_assistant.editor.workers"),
    *("action_assistant.runner.app", "action_assistant.runner.workers"),
    *("action_assistant.system.served_addresses", "action_assistant.web.server.listen"),
    # What Litestar, uvicorn and multiprocessing load later than at their import.
    *("litestar._kwargs", "litestar.exceptions.responses", "litestar.plugins.attrs"),
    *("litestar.middleware._internal.exceptions", "multiprocessing.popen_forkserver", "uvloop"),
)
#: What an interpreter, its libraries or the loader read once, when they begin.
_READ_ONCE: Final = (
    "PYTHON",
    "LD_",
    "LC_",
    "LANG",
    "TZ",
    "FAKETIME",
    "MALLOC",
    "COVERAGE",
    "TMPDIR",
)
#: The variable under which every process is a new interpreter.
NEW_INTERPRETERS: Final = "TEST_NEW_INTERPRETERS"
_RUNNER_PYTHON: Final = "ACTION_ASSISTANT_RUNNER_PYTHON"
_MODULE: Final = ["-m", "action_assistant"]
_MESSAGE: Final = 1 << 20  # bytes
#: The room for the command line of a fork, which people and tests look for in the list of processes.
_ROOM: Final = "-" * 4000


class Process(Protocol):
    """The part of `subprocess.Popen` that tests use."""

    @property
    def pid(self) -> int: ...
    def poll(self) -> int | None: ...
    def wait(self, timeout: float | None = None) -> int: ...
    def send_signal(self, sig: int) -> None: ...
    def terminate(self) -> None: ...
    def kill(self) -> None: ...


def start(words: Sequence[str], environ: Mapping[str, str], log: Path) -> Process:
    """Start `python -m action_assistant` with `words` in a session of its own; what it writes is added to
    `log`."""
    with log.open("ab") as out:
        # A URL with a password makes `serve` begin anew, and leave its spares behind.
        if not _is_usual(environ) or "--database" in words:
            command = [sys.executable, *_MODULE, *words]
            return subprocess.Popen(
                command, env={**environ}, stdout=out, stderr=out, start_new_session=True
            )
        # The interpreter of `make ros` cannot be forked from this one. tests/ros, the browser and tests
        # of robots with `new_interpreters` take it.
        given = {_RUNNER_PYTHON: sys.executable, **environ}
        return _Fork(_forker(), words, given, out.fileno())


def _is_usual(environ: Mapping[str, str]) -> bool:
    """Return whether a process with this environment would be like one that the forker was."""
    if (
        sys.platform != "linux"
        or {"TEST_LONG", NEW_INTERPRETERS} & {*os.environ}
        or "AMENT_PREFIX_PATH" in environ
    ):
        return False
    if any(name.startswith("COVERAGE") for name in os.environ) or importlib.util.find_spec("rclpy"):
        return False
    return _read_once(environ) == _of_forker()


def _read_once(environ: Mapping[str, str]) -> dict[str, str]:
    return {name: value for name, value in environ.items() if name.startswith(_READ_ONCE)}


@cache
def _of_forker() -> dict[str, str]:
    return _read_once(os.environ)


@cache
def _forker() -> socket.socket:
    """Start the process of which all others are forks, and return the socket for what is asked of it."""
    ours, its = _pair()
    with its:
        process = subprocess.Popen(
            [sys.executable, "-P", __file__, str(its.fileno()), _ROOM],
            pass_fds=[its.fileno()],
            stdin=subprocess.DEVNULL,
            cwd="/",
        )

    def end() -> None:
        ours.close()
        process.wait()

    atexit.register(end)
    return ours


def _pair() -> tuple[socket.socket, socket.socket]:
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


class _Fork:
    """A fork that the forker made. The forker says its number, and how it ended."""

    def __init__(
        self, forker: socket.socket, words: Sequence[str], environ: Mapping[str, str], out: int
    ) -> None:
        self._told, its = _pair()
        with its:
            asked = json.dumps({"words": [*words], "environ": {**environ}}).encode()
            socket.send_fds(forker, [asked], [its.fileno(), out])
        self.pid: Final = int(self._told.recv(_MESSAGE))
        self._code: int | None = None

    def poll(self) -> int | None:
        """Return the exit code, or None if the process still runs."""
        if self._code is None and select.select([self._told], [], [], 0)[0]:
            self._code = int(self._told.recv(_MESSAGE))
            self._told.close()
        return self._code

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the end, and return the exit code."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while (code := self.poll()) is None:
            left = None if deadline is None else deadline - time.monotonic()
            if left is not None and left <= 0:
                raise subprocess.TimeoutExpired("action-assistant", timeout or 0.0)
            select.select([self._told], [], [], left)
        return code

    def send_signal(self, sig: int) -> None:
        """Send a signal, unless the process has ended."""
        if self.poll() is None:
            os.kill(self.pid, sig)

    def terminate(self) -> None:
        """Ask it to end."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """kill -9."""
        self.send_signal(signal.SIGKILL)

    def __del__(self) -> None:
        self._told.close()


# What follows runs in the forker and its forks.


def _serve(asked: socket.socket) -> Callable[[], None]:
    """Make the forks that are asked for until nobody is left who could ask. In a fork, return what it
    has to do."""
    waiting: dict[int, int] = {}
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    os.set_blocking(reading, False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    while True:
        ready, _, _ = select.select([asked, reading], [], [])
        if reading in ready:
            os.read(reading, _MESSAGE)
            for process, code in _ended(list(waiting)):
                _tell(waiting.pop(process), code)
        if asked in ready:
            text, files, _, _ = socket.recv_fds(asked, _MESSAGE, 2)
            if not text:
                return lambda: None
            process = os.fork()
            if process == 0:
                signal.set_wakeup_fd(-1)
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                asked.detach()  # the number of a file that is closed is soon another's
                os.setsid()
                os.dup2(files[1], 1)
                os.dup2(files[1], 2)
                order = json.loads(text)
                return _task(order["words"], order["environ"], ())
            os.close(files[1])
            os.write(files[0], str(process).encode())
            waiting[process] = files[0]


def _ended(processes: Sequence[int]) -> list[tuple[int, int]]:
    found = [(process, os.waitpid(process, os.WNOHANG)) for process in processes]
    return [
        (process, os.waitstatus_to_exitcode(status)) for process, (dead, status) in found if dead
    ]


def _tell(file: int, code: int) -> None:
    with contextlib.suppress(BrokenPipeError):  # the test is over
        os.write(file, str(code).encode())
    os.close(file)


def _task(words: list[str], environ: Mapping[str, str], kept: Sequence[int]) -> Callable[[], None]:
    """Make this fork what a new interpreter with these words, environment and files is before its first
    line, and return that line."""
    for name in os.listdir("/proc/self/fd"):  # noqa: PTH208 - numbers, no paths
        if int(name) > 2 and int(name) not in kept:
            with contextlib.suppress(OSError):  # the file of this list is closed
                os.close(int(name))
    os.environ.clear()
    os.environ.update(environ)
    sys.argv = ["action-assistant", *words]
    sys.orig_argv = [sys.executable, *_MODULE, *words]
    _rename(sys.orig_argv)
    if words[:1] == ["serve"]:
        _Popen.spares = [_Spare.made() for _ in range(2)]
        subprocess.Popen = _Popen  # type: ignore[misc]
    return _run


def _run() -> None:
    runpy.run_module("action_assistant", run_name="__main__", alter_sys=True)


def _rename(words: Sequence[str]) -> None:
    """Write a command line over that of this process."""
    fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
    begin, end = int(fields[45]), int(fields[46])
    text = b"".join(os.fsencode(word) + b"\0" for word in words)[: end - begin]
    ctypes.memmove(begin, text.ljust(end - begin, b"\0"), end - begin)


class _Spare(NamedTuple):
    """A fork that waits to become the editor or the runner. It is made before there are threads.
    `wire`: a socket to it."""

    pid: int
    wire: int

    @classmethod
    def made(cls) -> "_Spare":
        """Fork one. In the fork, raise `_Becomes`."""
        ours, its = (each.detach() for each in _pair())
        process = os.fork()
        if process == 0:
            os.close(ours)
            raise _Becomes(its)
        os.close(its)
        return cls(process, ours)


class _Becomes(BaseException):
    """Leads a spare out of what the process was about to do when it was forked."""

    def __init__(self, wire: int) -> None:
        super().__init__()
        self._wire = wire

    def task(self) -> Callable[[], None]:
        """Wait until it is said what to become, and return what has to be done then."""
        wire = socket.socket(fileno=self._wire)
        text, files, _, _ = socket.recv_fds(wire, _MESSAGE, 1)
        wire.detach()
        if not text:
            return lambda: None
        order = json.loads(text)
        os.dup2(files[0], order["kept"], inheritable=True)
        return _task(order["words"], order["environ"], [order["kept"]])


class _Popen(subprocess.Popen[Any]):
    """Gives the first start of the editor and of the runner to a spare, and all others to the system."""

    spares: list[_Spare]

    def _execute_child(self, *values: Any) -> None:
        real = super()._execute_child  # type: ignore[misc]
        given = inspect.signature(real).bind(*values).arguments
        words = [os.fspath(each) for each in given["args"]]
        of_ours = words[:3] == [sys.executable, *_MODULE] and words[3:4] in (["editor"], ["runner"])
        if not of_ours or not self.spares:
            real(*values)
            return
        pid, wire = self.spares.pop()
        (kept,) = given["pass_fds"]
        order = {"words": words[3:], "environ": {**given["env"]}, "kept": kept}
        with socket.socket(fileno=wire) as spare:
            socket.send_fds(spare, [json.dumps(order).encode()], [kept])
        os.close(given["p2cread"])
        self.pid = pid
        self._child_created = True


def _main() -> None:
    asked = socket.socket(fileno=int(sys.argv[1]))
    for name in _MODULES:
        importlib.import_module(name)
    gc.collect()
    gc.freeze()
    try:
        task = _serve(asked)
    except _Becomes as spare:
        task = spare.task()
    task()


if __name__ == "__main__":
    _main()
