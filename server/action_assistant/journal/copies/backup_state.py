"""Stores the state of the backups of a data folder in a small file in it.

Whoever makes or rehearses a backup writes it down; doctor, metrics and pages read it. Nothing here
fails a backup: what cannot be written down is logged.
"""

import logging
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.private_files import opener, replace_file
from action_assistant.system import posix

log: Final = logging.getLogger(__name__)

FILE: Final = "backups.json"
_LATE: Final = 3600.0  # seconds beyond the time of the next one, at least


class OffSite(msgspec.Struct, frozen=True):
    """The result of the command that takes a finished backup elsewhere. `why` is the reason of a
    failure."""

    seconds: float
    why: str | None = None


class BackupMade(msgspec.Struct, frozen=True, kw_only=True):
    """A finished backup. `at`: its begin, seconds since 1970. `events`: the number of each journal.
    `missing`: one sentence for each missing part. `proven`: the file was read back and verified.
    `off_site`: the outcome of the command that copies it elsewhere; None without a command."""

    at: float
    file: str
    bytes: int
    seconds: float
    version: str
    events: dict[str, int]
    missing: tuple[str, ...] = ()
    proven: bool = False
    off_site: OffSite | None = None


class BackupFailed(msgspec.Struct, frozen=True):
    """A backup that failed, after the last one that did not. `at`: seconds since 1970."""

    at: float
    why: str


class BackupRehearsed(msgspec.Struct, frozen=True, kw_only=True):
    """A trial restore of a backup. `made_at`: when the backup was made, None if that cannot be
    read. `why`: what is wrong with it, None if it is sound."""

    at: float
    file: str
    bytes: int
    seconds: float
    made_at: float | None = None
    why: str | None = None


class BackupSchedule(msgspec.Struct, frozen=True, kw_only=True):
    """A backup goes into the folder `into` every `every` seconds; `keep`: the retention rule;
    `next`: when the next one is due, seconds since 1970."""

    into: str
    every: float
    keep: str
    next: float


class BackupState(msgspec.Struct, frozen=True, kw_only=True):
    """The state of the backups of a data folder.

    `failed` is a failure since the last backup. `proven` is the last rehearsal that found a backup
    sound, `rehearsed` the last one. `schedule` is None when no regular backups are planned.
    """

    last: BackupMade | None = None
    failed: BackupFailed | None = None
    rehearsed: BackupRehearsed | None = None
    proven: BackupRehearsed | None = None
    schedule: BackupSchedule | None = None

    def is_late(self, now: float) -> bool:
        """Return whether a scheduled backup is late at the time `now` (seconds since 1970): the
        process that makes backups does not run, or fails."""
        if self.schedule is None:
            return False
        return now > self.schedule.next + max(_LATE, self.schedule.every / 4)


def backup_state(data: Path) -> BackupState | None:
    """Return the stored state of the backups of a data folder; None if it cannot be read, which
    does not mean that no backup exists."""
    try:
        return msgspec.json.decode((data / FILE).read_bytes(), type=BackupState)
    except FileNotFoundError:
        return BackupState()
    except (OSError, ValueError, RecursionError):  # no JSON, no text, or too deep
        return None


def note(data: Path, change: Callable[[BackupState], BackupState]) -> None:
    """Update the stored state of the backups of a data folder by `change`, under a lock. A failure
    is only logged."""
    path = data / FILE
    try:
        guard = opener(str(path.with_name(f"{FILE}.lock")), os.O_RDWR | os.O_CREAT)
        try:
            posix.wait_for_lock(guard)
            state = change(backup_state(data) or BackupState())
            content = msgspec.json.format(msgspec.json.encode(state))
            replace_file(path, content, part=path.with_name(f".{FILE}.part"))
        finally:
            os.close(guard)
    except OSError as error:
        log.warning("cannot write %s: %s", path, error.strerror)


def made(data: Path, backup: BackupMade) -> None:
    """Record a finished backup in the state of a data folder."""
    note(data, lambda state: msgspec.structs.replace(state, last=backup, failed=None))


def failed(data: Path, why: str) -> None:
    """Record that a backup of a data folder failed, and why."""
    said = BackupFailed(time.time(), why)
    note(data, lambda state: msgspec.structs.replace(state, failed=said))


def scheduled(data: Path, schedule: BackupSchedule) -> None:
    """Record when the next backup of a data folder is due."""
    note(data, lambda state: msgspec.structs.replace(state, schedule=schedule))


def rehearsed(data: Path, rehearsal: BackupRehearsed) -> None:
    """Record the outcome of a trial restore of a backup."""

    def change(state: BackupState) -> BackupState:
        proven = rehearsal if rehearsal.why is None else state.proven
        return msgspec.structs.replace(state, rehearsed=rehearsal, proven=proven)

    note(data, change)
