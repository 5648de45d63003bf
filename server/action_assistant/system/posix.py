"""Parts of a system that only POSIX has: modules of the standard library (None elsewhere), locks on
files, users, and limits of a process. Nobody else imports those modules, so that every module of ours
can be imported on Windows."""

import importlib
import os
import signal
from pathlib import Path
from typing import Any, Final

from action_assistant.errors import CannotStart

_MOST_DESCRIPTORS: Final = 1 << 16  # that are asked for where there is no limit
_WINDOWS_DESCRIPTORS: Final = 512  # where the system does not tell


def _module(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


fcntl: Final = _module("fcntl")
pwd: Final = _module("pwd")
resource: Final = _module("resource")


def lock_file(descriptor: int, *, shared: bool = False) -> bool:
    """Lock an open file until it is closed or the process ends; return False at once if another
    process has locked it. A `shared` lock gets along with others of its kind. Raise CannotStart if
    the system has no such locks."""
    try:
        _locking(descriptor, wait=False, shared=shared)
    except OSError:
        return False
    return True


def wait_for_lock(descriptor: int) -> None:
    """Lock an open file until it is closed, waiting while another process holds its lock. Raise
    OSError or CannotStart if it cannot be locked."""
    _locking(descriptor, wait=True)


def _locking(descriptor: int, *, wait: bool, shared: bool = False) -> None:
    if fcntl is None:
        raise CannotStart(
            "This system has no file locks that this program knows, so it cannot keep a journal here: "
            "docs/installing.md says what works on Windows."
        )
    kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
    fcntl.flock(descriptor, kind | (0 if wait else fcntl.LOCK_NB))


def user_id() -> int | None:
    """Return the id of the effective user; None on systems without user ids."""
    return os.geteuid() if hasattr(os, "geteuid") else None


def user_name(uid: int) -> str:
    """Return the name of the user with this id, for messages; `user <id>` if the computer knows
    none. Users of containers mostly have no name outside."""
    if pwd is not None:
        try:
            return str(pwd.getpwuid(uid).pw_name)
        except KeyError:
            pass
    return f"user {uid}"


def own_name() -> str:
    """Return the name of this process's user, for messages."""
    uid = user_id()
    return user_name(uid) if uid is not None else os.environ.get("USERNAME", "this user")


def user_exists(name: str) -> bool:
    """Return whether this computer has a user of this name."""
    if pwd is None:
        return False
    try:
        pwd.getpwnam(name)
    except KeyError:
        return False
    return True


def cause_of_end(code: int | None) -> str:
    """Return how a process ended, for messages. `code`: its exit code or minus its signal, None
    while it is still ending."""
    if code is None:
        return "it is still ending"
    return signal.Signals(-code).name if code < 0 else f"exit code {code}"


def raise_descriptors() -> int:
    """Raise the limit of open files and connections of this process as far as allowed; return the
    new limit."""
    if resource is None:
        return _WINDOWS_DESCRIPTORS
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = _MOST_DESCRIPTORS if hard == resource.RLIM_INFINITY else hard
    if soft != resource.RLIM_INFINITY and soft < most:
        try:
            resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
        except (OSError, ValueError):  # macOS has another limit beside it
            return int(soft)
    return int(most if soft == resource.RLIM_INFINITY else max(soft, most))


def descriptors_allowed() -> int:
    """Return how many files and sockets this process could open at most."""
    if resource is None:
        return _WINDOWS_DESCRIPTORS
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    return int(_MOST_DESCRIPTORS if hard == resource.RLIM_INFINITY else hard)


def bound_memory(more: int) -> None:
    """Limit this process to `more` bytes of memory beyond its present use. Do nothing on systems
    that do not tell the present use. Raise OSError or ValueError if the limit cannot be set."""
    mapped = _statm(0)
    if resource is not None and mapped:
        resource.setrlimit(resource.RLIMIT_AS, (mapped + more, mapped + more))


def memory_in_use() -> int:
    """Return the bytes of memory in use; 0 if unknown."""
    return _statm(1)


def _statm(field: int) -> int:
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[field])
    except OSError:  # macOS
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")
