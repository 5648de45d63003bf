"""The process of one call, from within. Started by its path, isolated: it imports nothing of ours.

Two processes: the keeper waits, and when its lifeline ends, or the behaviour does, it kills whatever
descends from it, waits for all of that, and ends itself. The other one runs the behaviour.
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
_WRITTEN: Final = 1 << 30  # bytes of a file that it writes
_AGAIN_S: Final = 0.002


class PerformedAction:
    """What a behaviour sees of its action.

    `inputs`: values by flat name (`pose::x`), numbers as floats. `outputs`: set them by flat name; a
    name or a type that the action does not have ends it with an error.
    """

    def __init__(self, inputs: dict[str, Any], say: "_Saying") -> None:
        self.inputs = inputs
        self.outputs: dict[str, Any] = _Outputs(say)
        self._say = say
        self._changed = threading.Condition()
        self._stopped = self._paused = False

    @property
    def stopped(self) -> bool:
        """Whether the action was told to stop: five seconds later it is killed."""
        return self._stopped

    def sleep(self, seconds: float) -> bool:
        """Wait for so many seconds, in which a pause does not count. False, at once, when the action
        was told to stop; then return soon."""
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
        """Say something that the run keeps; of very many messages the first ones."""
        self._say(kind="message", text=str(text)[:10_000])

    def _told(self, command: str) -> None:
        with self._changed:
            self._stopped = self._stopped or command == "stop"
            self._paused = command == "pause" if command != "stop" else self._paused
            self._changed.notify_all()


class _Outputs(dict[str, Any]):
    """Values that are told as they are set."""

    def __init__(self, say: "_Saying") -> None:
        super().__init__()
        self._say = say

    def __setitem__(self, name: str, value: Any) -> None:
        self._say(kind="output", name=name, value=value)
        super().__setitem__(name, value)

    def update(self, *args: Any, **values: Any) -> None:
        """As of any dict."""
        for name, value in dict(*args, **values).items():
            self[name] = value


class _Saying:
    """Lines of JSON to whoever called."""

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._lock = threading.Lock()

    def __call__(self, **said: object) -> None:
        line = json.dumps(said, allow_nan=False)
        with self._lock:
            self._out.write(line + "\n")
            self._out.flush()


# --- the keeper -----------------------------------------------------------------------------------


def keep(lifeline: int) -> NoReturn:
    """Begin the behaviour, and see to its end. Exits as it does: its code, or 128 and the signal."""
    libc = ctypes.CDLL(None)
    libc.prctl(_SUBREAPER, 1)
    libc.prctl(_NO_NEW_PRIVILEGES, 1)
    keeper = os.getpid()
    child = os.fork()
    if child == 0:
        libc.prctl(_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != keeper:
            os._exit(1)
        os.setpgid(0, 0)
        os.close(lifeline)
        _live()
    with contextlib.suppress(OSError):  # it has ended already
        os.setpgid(child, child)
    with contextlib.suppress(OSError):  # nobody is there any more: then this is the end
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
    """Kill all that descends from here, until nothing is left; how the child has ended."""
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
    """What descends from here directly, and what its parents have left to us."""
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
        with contextlib.suppress(AttributeError, OSError, ValueError):  # it may have closed them
            printed.flush()
    say(kind="done", result=result, error=error)
    os._exit(0)


def _wired() -> tuple[TextIO, _Saying]:
    """What is said to us, and where we answer. Anything that is printed goes where errors go, so that
    it cannot be taken for an answer."""
    commands = os.fdopen(os.dup(0), "r", encoding="utf-8")
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    os.close(nothing)
    sys.stdout.reconfigure(line_buffering=True, errors="replace")  # type: ignore[union-attr]
    return commands, _Saying(out)


def _bounded() -> None:
    """What it may take. Others go first when processor or memory run short."""
    import resource  # of POSIX alone, as all of this is

    os.nice(_NICE)
    with contextlib.suppress(OSError):  # some containers have none: the kernel chooses by size then
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
    """What the behaviour makes of it: true or false, or what went wrong."""
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
    """An error in a line, with its place in the file."""
    places = [
        each.lineno for each in traceback.extract_tb(error.__traceback__) if each.filename == file
    ]
    if isinstance(error, SyntaxError):
        places = [error.lineno]
    what = "".join(traceback.format_exception_only(error)[-1:]).strip()
    return f"{what} ({file}, line {places[-1]})" if places else what


if __name__ == "__main__":
    keep(int(sys.argv[1]))
