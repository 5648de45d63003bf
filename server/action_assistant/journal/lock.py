"""One process writes a journal: a lock beside its file, which no other user can take or keep from us."""

import os
from pathlib import Path
from typing import Final, NamedTuple

from action_assistant.errors import CannotStart
from action_assistant.private_files import opener
from action_assistant.system import posix

_LOCKS: Final = Path("/proc/locks")


class Holder(NamedTuple):
    """The process that holds a lock."""

    pid: int
    uid: int

    def __str__(self) -> str:
        return f"{self.pid} of {posix.user_name(self.uid)}"


def own(path: Path) -> int:
    """Lock the database file `path` for this process; return the descriptor of the lock, whose
    closing releases it. Raise CannotStart if another process holds the lock or the folder cannot be
    written.

    Earlier versions made lock files that other users could open and hold. Such a lock is replaced
    if a process of another user (not root) holds it, since that process cannot write our files.
    """
    lock = path.with_name(f"{path.name}.lock")
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        held = _taken(lock)
        if held is None and _is_a_strangers(_holder(lock), path):
            held = _taken_from_a_stranger(lock, path)
    except OSError as error:
        raise CannotStart(f"Cannot write to the folder {path.parent}: {error.strerror}.") from error
    if held is None:
        holder = _holder(lock)
        who = f" ({holder})" if holder is not None else ""
        raise CannotStart(f"The database {path} is in use by another process{who}.")
    return held


def holder(path: Path) -> Holder | None:
    """Return the process that has locked the database file `path`; None if no process is known to
    hold it. Linux shows it for visible processes."""
    return _holder(path.with_name(f"{path.name}.lock"))


def is_program(pid: int) -> bool:
    """Return whether the process `pid` runs this program, by its command line."""
    try:
        words = Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False
    return b"action_assistant" in words or b"action-assistant" in words


def _taken(lock: Path) -> int | None:
    """Return the descriptor of the lock; None if another process holds it."""
    while True:
        descriptor = opener(str(lock), os.O_RDWR | os.O_CREAT)
        if not posix.lock_file(descriptor):
            os.close(descriptor)
            return None
        try:
            if os.path.samestat(os.fstat(descriptor), lock.stat()):
                return descriptor
        except FileNotFoundError:
            pass  # put aside meanwhile: the one that counts is another
        os.close(descriptor)


def _taken_from_a_stranger(lock: Path, path: Path) -> int | None:
    """Replace the lock file of another user, and return the descriptor of the new lock; None if
    another process of this user was faster."""
    guard = opener(str(lock.with_name(f"{lock.name}.new")), os.O_RDWR | os.O_CREAT)
    try:
        posix.wait_for_lock(guard)
        if _is_a_strangers(_holder(lock), path):
            lock.unlink()
        return _taken(lock)
    finally:
        os.close(guard)


def _is_a_strangers(holder: Holder | None, path: Path) -> bool:
    if holder is None or holder.uid in {0, posix.user_id()}:
        return False
    return not path.exists() or path.stat().st_uid == posix.user_id()


def _user_of(pid: int) -> int:
    """Return the real user of the process `pid`, also of one that hides. Raise OSError, ValueError
    or IndexError if it cannot be read."""
    told = Path(f"/proc/{pid}/status").read_text()
    (uid,) = [line.split()[1] for line in told.splitlines() if line.startswith("Uid:")]
    return int(uid)


def _holder(lock: Path) -> Holder | None:
    """Return the process that holds a lock file, as Linux lists it in /proc/locks; None if no
    process is listed or the list cannot be read."""
    try:
        there = lock.stat()
        place = f"{os.major(there.st_dev):02x}:{os.minor(there.st_dev):02x}:{there.st_ino}"
        for line in _LOCKS.read_text().splitlines():
            fields = line.split()
            if fields[1] == "FLOCK" and place in fields:
                pid = int(fields[fields.index(place) - 1])
                return Holder(pid, _user_of(pid))
    except (OSError, ValueError, IndexError):
        return None
    return None
