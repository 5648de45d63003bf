"""Limits that the system sets to a process, where it has such: POSIX does."""

import os
from pathlib import Path
from typing import Final

from action_assistant.system.posix import resource

_MOST: Final = 1 << 16  # descriptors that are asked for where there is no limit
_WINDOWS: Final = 512  # descriptors, where nobody says


def raise_descriptors() -> int:
    """Raise the limit of open files and connections of this process as far as allowed; return the
    new limit."""
    if resource is None:
        return _WINDOWS
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = _MOST if hard == resource.RLIM_INFINITY else hard
    if soft != resource.RLIM_INFINITY and soft < most:
        try:
            resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
        except (OSError, ValueError):  # macOS has another limit beside it
            return int(soft)
    return int(most if soft == resource.RLIM_INFINITY else max(soft, most))


def descriptors_allowed() -> int:
    """Return how many files and sockets this process could open at most."""
    if resource is None:
        return _WINDOWS
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    return int(_MOST if hard == resource.RLIM_INFINITY else hard)


def bound_memory(more: int) -> None:
    """Limit this process to `more` additional bytes of memory, if the system tells how many it has.
    Raise OSError or ValueError if the limit cannot be set."""
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
