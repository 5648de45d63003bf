"""The runner's end of a call's process: starts it, writes commands to it, and ends it for certain."""

import logging
import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Final, Self

log: Final = logging.getLogger(__name__)

_PROGRAM: Final = Path(__file__).with_name("call_program.py")
_SUPERVISOR_S: Final = 1.0  # for the supervisor to end all its descendants
_AGAIN_S: Final = 0.05
_LONG_S: Final = 10.0  # after this an error is logged
#: The only environment variables that a behaviour gets. The last one says that a Python made by `make ros` was
#: restarted already to find its libraries.
_KNOWN: Final = (
    *("PATH", "HOME", "LANG", "LC_ALL", "TZ", "LD_LIBRARY_PATH"),
    "_ROS_WHEELS_BOOTSTRAP_COMPLETE",
)


class Supervisor:
    """A process that starts a behaviour and kills all its descendants when the behaviour ends, when
    `let_go` is called, or when the runner dies. Must be used on one thread."""

    def __init__(self) -> None:
        """Start the process. Raise OSError if the system cannot start it."""
        with ExitStack() as opened:
            ours, theirs = (opened.enter_context(each) for each in socket.socketpair())
            self._lifeline, lifeline = (opened.enter_context(each) for each in socket.socketpair())
            self._process = subprocess.Popen(
                [
                    sys.executable,
                    "-I",
                    "-P",
                    "-B",
                    str(_PROGRAM),
                    str(lifeline.fileno()),
                ],
                stdin=theirs.fileno(),
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                pass_fds=(lifeline.fileno(),),
                env={name: os.environ[name] for name in _KNOWN if name in os.environ},
                cwd="/",
                start_new_session=True,
            )
            assert self._process.stdout is not None
            assert self._process.stderr is not None
            theirs.close()
            lifeline.close()
            self._commands = ours
            self._opened = opened.pop_all()
        for each in (ours, self._lifeline):
            each.setblocking(False)
        self.said = self._process.stdout.fileno()
        self.printed = self._process.stderr.fileno()
        for number in (self.said, self.printed):
            os.set_blocking(number, False)
        self.end_sign = os.pidfd_open(self._process.pid)
        self._opened.callback(os.close, self.end_sign)
        self._opened.enter_context(self._process.stdout)
        self._opened.enter_context(self._process.stderr)
        self._child = 0
        self._let_go: float | None = None
        self._warned = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()

    @property
    def commands(self) -> int:
        """The descriptor that commands are written to, which never blocks."""
        return self._commands.fileno()

    def write(self, text: bytes) -> int:
        """Write commands to the behaviour without waiting; return how many bytes were accepted.
        After its end all bytes count as accepted."""
        try:
            return self._commands.send(text)
        except BlockingIOError:
            return 0
        except OSError:
            return len(text)  # the process has ended, and reads nothing more

    @property
    def patience(self) -> float | None:
        """The seconds after which `is_over` has to be called again even without output; None for
        never."""
        return None if self._let_go is None else _AGAIN_S

    def let_go(self) -> None:
        """Have the behaviour and all its descendants killed now."""
        if self._let_go is None:
            self._let_go = time.monotonic()
            with suppress(OSError):
                self._lifeline.shutdown(socket.SHUT_WR)

    def is_over(self) -> bool:
        """Return whether the process has ended; kill it when it takes too long to end its descendants."""
        if self._process.poll() is not None:
            return True
        waited = 0.0 if self._let_go is None else time.monotonic() - self._let_go
        if waited > _SUPERVISOR_S:
            self._kill_group()
            self._process.kill()
        if waited > _LONG_S and not self._warned:
            self._warned = True
            log.error("the process %d of a behaviour cannot be killed", self._process.pid)
        return False

    def ended(self) -> int:
        """Return how the behaviour's process ended, as its exit code or minus its signal, once
        every descendant has ended. Call it after `is_over` was true."""
        code: int = self._process.wait()
        if code >= 0:  # the supervisor has waited for all its descendants
            return code if code < 128 else 128 - code
        while self._kill_group():
            time.sleep(_AGAIN_S)
        return -signal.SIGKILL

    def _kill_group(self) -> bool:
        """Kill the process group of the behaviour; return whether it had any process."""
        with suppress(OSError, ValueError):
            self._child = self._child or int(self._lifeline.recv(32) or b"0")
        if not self._child:
            return False
        try:
            os.killpg(self._child, signal.SIGKILL)
        except ProcessLookupError:
            return False
        return True
