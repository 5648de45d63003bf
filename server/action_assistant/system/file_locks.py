"""Locks on files, by which processes of this program keep out of each other's way. Of Linux and macOS:
elsewhere nothing that needs one starts."""

from action_assistant.errors import CannotStart
from action_assistant.system.posix import fcntl


def take(descriptor: int) -> bool:
    """Lock an open file until it is closed or the process ends; return False if another process has
    locked it. Raise CannotStart if the system has no such locks."""
    try:
        _locking(descriptor, wait=False)
    except OSError:
        return False
    return True


def wait_for(descriptor: int) -> None:
    """Lock an open file, waiting until nobody else holds its lock. Raise OSError or CannotStart if
    it cannot be locked."""
    _locking(descriptor, wait=True)


def _locking(descriptor: int, *, wait: bool) -> None:
    if fcntl is None:
        raise CannotStart(
            "This system has no file locks that this program knows, so it cannot keep a journal here: "
            "docs/installing.md says what works on Windows."
        )
    fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
