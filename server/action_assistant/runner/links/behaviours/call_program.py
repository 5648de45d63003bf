"""The program of one call: started by its path in isolated mode, so it imports nothing of this package.

It is two processes. One runs the behaviour. The other one, the supervisor, waits until the behaviour ends or its
lifeline (a socket to the runner) is closed; then it kills all its descendants, waits for them, and exits.
"""

import contextlib
import ctypes
import json
import linecache
import os
import select
import signal
import sys
import threading
import time
import traceback
from collections.abc import Iterable
from typing import Any, Final, NoReturn, TextIO

_PDEATHSIG: Final = 1
_SUBREAPER: Final = 36
_NO_NEW_PRIVILEGES: Final = 38
_NICE: Final = 10
_PROCESSOR_S: Final = 600
_MEMORY: Final = 512 << 20  # bytes of address space
_FILES: Final = 256
_WRITTEN: Final = 1 << 30  # bytes of a file that the behaviour writes
_AGAIN_S: Final = 0.002


class PerformedAction:
    """The argument of a behaviour's `run`: its action, with inputs, outputs and commands.

    `inputs` are values by flat name (`pose::x`), numbers as floats. `outputs` are set by flat name; a name
    or a type that the action does not have ends it with an error.
    """

    def __init__(self, inputs: dict[str, Any], say: "_Saying") -> None:
        self.inputs = inputs
        self.outputs: dict[str, Any] = _Outputs(say)
        self._say = say
        self._changed = threading.Condition()
        self._stopped = self._paused = False

    @property
    def stopped(self) -> bool:
        """True once the action was asked to stop; five seconds later it is killed."""
        return self._stopped

    def sleep(self, seconds: float) -> bool:
        """Wait for so many seconds, not counting a pause. Return True at the end, and False at once
        if the action is asked to stop; `run` should return soon then."""
        left = float(seconds)
        with self._changed:
            while not self._stopped and (self._paused or left > 0):
                began = time.monotonic()
                was_paused = self._paused
                self._changed.wait(None if was_paused else left)
                if not was_paused:
                    left -= time.monotonic() - began
            return not self._stopped

    def message(self, text: object) -> None:
        """Add a message (any object, as text of 10,000 characters at most) to the run, which keeps
        the first 20 of a call."""
        self._say(kind="message", text=str(text)[:10_000])

    def _told(self, command: str) -> None:
        with self._changed:
            self._stopped = self._stopped or command == "stop"
            self._paused = command == "pause" if command != "stop" else self._paused
            self._changed.notify_all()


class _Outputs(dict[str, Any]):
    """A dict of outputs that sends each value to the runner as it is set."""

    def __init__(self, say: "_Saying") -> None:
        super().__init__()
        self._say = say

    def __setitem__(self, name: str, value: Any) -> None:
        self._say(kind="output", name=name, value=value)
        super().__setitem__(name, value)

    def update(self, *args: Any, **values: Any) -> None:
        """Set several values, as `dict.update` does, and send each."""
        for name, value in dict(*args, **values).items():
            self[name] = value


class _Saying:
    """Writes lines of JSON to the runner; may be called on any thread."""

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._lock = threading.Lock()

    def __call__(self, **said: object) -> None:
        line = json.dumps(said, allow_nan=False)
        with self._lock:
            self._out.write(line + "\n")
            self._out.flush()


# --- the supervisor -----------------------------------------------------------------------------------


def supervise(lifeline: int) -> NoReturn:
    """Fork the behaviour, and wait until it ends or the pipe with the descriptor `lifeline` is
    closed, as the runner does when it ends; then kill all descendants. Exit with the code of the
    behaviour, or 128 plus the signal that ended it."""
    libc = ctypes.CDLL(None)
    libc.prctl(_SUBREAPER, 1)
    libc.prctl(_NO_NEW_PRIVILEGES, 1)
    supervisor = os.getpid()
    child = os.fork()
    if child == 0:
        libc.prctl(_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != supervisor:
            os._exit(1)
        os.setpgid(0, 0)
        os.close(lifeline)
        _live()
    with contextlib.suppress(OSError):  # the child has ended already
        os.setpgid(child, child)
    with contextlib.suppress(OSError):  # the runner is gone: then the poll below ends at once
        os.write(lifeline, b"%d\n" % child)
    nothing = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1, 2):
        os.dup2(nothing, number)
    waiting = select.poll()
    waiting.register(lifeline, select.POLLIN)
    waiting.register(os.pidfd_open(child), select.POLLIN)
    waiting.poll()
    os._exit(_end_all(child))


def _end_all(child: int) -> int:
    """Kill all descendants until none is left; return the exit code of the child, or 128 plus its signal."""
    status = 0
    _kill(-child)
    while True:
        for each in _children():
            _kill(each)
        try:
            pid, ended = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            code = os.waitstatus_to_exitcode(status)
            return code if code >= 0 else 128 - code
        if pid == child:
            status = ended
        if pid == 0:
            time.sleep(_AGAIN_S)


def _children() -> Iterable[int]:
    """Return the ids of the child processes, orphans of descendants included (this is their subreaper)."""
    listed = os.open(f"/proc/self/task/{os.getpid()}/children", os.O_RDONLY)
    with os.fdopen(listed, "rb") as children:
        return [int(each) for each in children.read().split()]


def _kill(process: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, signal.SIGKILL)


# --- the behaviour --------------------------------------------------------------------------------


def _live() -> NoReturn:
    commands, say = _wired()
    _bounded()
    order = json.loads(commands.readline() or "null")
    if order is None:
        os._exit(1)
    action = PerformedAction(order["inputs"], say)
    threading.Thread(target=_obey, args=(commands, action), daemon=True).start()
    result, error = _result(order["file"], order["source"], action)
    for printed in (sys.stdout, sys.stderr):
        with contextlib.suppress(
            AttributeError, OSError, ValueError
        ):  # the behaviour may have closed them
            printed.flush()
    say(kind="done", result=result, error=error)
    os._exit(0)


def _wired() -> tuple[TextIO, _Saying]:
    """Return the stream of commands and the writer of answers. `print` is redirected to stderr, so that printed
    text cannot be taken for an answer."""
    commands = os.fdopen(os.dup(0), "r", encoding="utf-8")
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    os.close(nothing)
    sys.stdout.reconfigure(line_buffering=True, errors="replace")  # type: ignore[union-attr]
    return commands, _Saying(out)


def _bounded() -> None:
    """Limit the processor time, memory, files and priority of the behaviour, so that other processes go first
    when processor or memory run short."""
    import resource  # exists on POSIX only, like this program

    os.nice(_NICE)
    with contextlib.suppress(OSError):  # some containers lack it
        score = os.open("/proc/self/oom_score_adj", os.O_WRONLY)
        os.write(score, b"1000")
        os.close(score)
    for kind, most in (
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_CPU, _PROCESSOR_S),
        (resource.RLIMIT_AS, _MEMORY),
        (resource.RLIMIT_NOFILE, _FILES),
        (resource.RLIMIT_FSIZE, _WRITTEN),
    ):
        _, hard = resource.getrlimit(kind)
        least = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (least, least))


def _obey(commands: TextIO, action: PerformedAction) -> None:
    for line in commands:
        action._told(json.loads(line)["kind"])  # noqa: SLF001 - not for behaviours


def _result(file: str, source: str, action: PerformedAction) -> tuple[bool, str | None]:
    """Run the behaviour, the Python text `source` of the file `file`, with `action` as its
    argument. Return its result and the error text, None without an error. The result is True unless
    it returned False."""
    linecache.cache[file] = (len(source), None, source.splitlines(keepends=True), file)
    try:
        known: dict[str, Any] = {"__name__": file.removesuffix(".py"), "__file__": file}
        exec(compile(source, file, "exec"), known)
        run = known.get("run")
        if not callable(run):
            return False, f"{file} has no function run(action)."
        result = run(action)
    except MemoryError:
        return False, f"MemoryError: it may have {_MEMORY >> 20} MB."
    except BaseException as error:  # noqa: BLE001 - whatever it raises is how the action ends
        return False, _told_of(error, file)
    if result is None or isinstance(result, bool):
        return result is not False, None
    return False, f"run returned {type(result).__name__}; True, False or None says how it ended."


def _told_of(error: BaseException, file: str) -> str:
    """Return one line of text that describes an error, with the line number in the behaviour's file
    if its traceback leads through that file."""
    places = [
        each.lineno for each in traceback.extract_tb(error.__traceback__) if each.filename == file
    ]
    if isinstance(error, SyntaxError):
        places = [error.lineno]
    what = "".join(traceback.format_exception_only(error)[-1:]).strip()
    return f"{what} ({file}, line {places[-1]})" if places else what


if __name__ == "__main__":
    supervise(int(sys.argv[1]))
