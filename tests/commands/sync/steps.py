"""A round of `sync` in a process of its own that ends, or whose system call fails, at a given step."""

import errno
import os
import resource
import signal
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx

from action_assistant.commands.client import Server
from action_assistant.commands.sync.folder import Folder
from action_assistant.commands.sync.sync import SyncRound
from action_assistant.errors import CannotStart
from action_assistant.umrf.files.writing import ENDING

#: Calls that Python reports before it asks the system (docs.python.org, "Audit events table").
_CALLS = frozenset(
    {"open", "os.rename", "os.link", "os.remove", "os.chmod", "os.chown", "os.scandir"}
)


class Steps:
    """Counts what one process does to files and asks of the server, and does `at_last` before the step of
    this number."""

    def __init__(self, number: int, how: str) -> None:
        self._left = number
        self._how = how
        self.reached = False
        self.active = False

    def __call__(self, event: str, given: tuple[Any, ...]) -> None:
        """One step, as an audit hook."""
        if not self.active or event not in _CALLS:
            return
        if self._how == "half" and (event != "open" or not _is_written(given)):
            return
        self._left -= 1
        if self._left:
            return
        self.reached = True
        match self._how:
            case "kill":
                os.kill(os.getpid(), signal.SIGKILL)
            case "half":
                # The next write ends in the middle, and the process with it.
                signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
                resource.setrlimit(resource.RLIMIT_FSIZE, (40, 40))
            case "fail" if event not in {"os.chown", "os.scandir"}:
                raise OSError(errno.EIO, os.strerror(errno.EIO))


class SteppingServer(Server):
    """Each request is a step before it is sent, and one after it was answered."""

    def __init__(self, editor: httpx.Client, steps: Steps) -> None:
        super().__init__(editor, "")
        self._steps = steps

    def editor(self, method: str, path: str, **body: Any) -> httpx.Response:
        """Ask the editor."""
        self._steps("os.scandir", ())
        answer = super().editor(method, path, **body)
        self._steps("os.scandir", ())
        return answer


def round_until(
    number: int, how: str, folder: Path, url: Any, headers: Any, *, links: bool
) -> bool:
    """Run a round that comes to its end at a step; False where it has not so many."""
    child = os.fork()
    if child == 0:
        code = 70
        try:
            code = 0 if _child(Steps(number, how), folder, url, headers, links=links) else 1
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        assert os.WTERMSIG(status) in {signal.SIGKILL, signal.SIGXFSZ}
        return True
    assert os.WEXITSTATUS(status) in {0, 1}
    return os.WEXITSTATUS(status) == 0


def _child(steps: Steps, folder: Path, url: Any, headers: Any, *, links: bool) -> bool:
    if not links:
        os.link = no_link
    sys.addaudithook(steps)
    with httpx.Client(base_url=url, headers=headers, trust_env=False, timeout=20) as http:
        server = SteppingServer(http, steps)
        http.get("/api/config")  # what is loaded late is loaded by now
        steps.active = True
        with suppress(CannotStart):
            SyncRound(server, Folder(folder), lambda _: None).run()
        steps.active = False
    return steps.reached


def no_link(*_: Any, **__: Any) -> None:
    """Fail as `os.link` does without hard links: on FAT, and in folders that a virtual machine
    shares."""
    raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))


def _is_written(given: tuple[Any, ...]) -> bool:
    name, _, flags = given
    return str(name).endswith((ENDING, ".server")) and bool(flags & os.O_WRONLY)
