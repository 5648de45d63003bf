"""Metrics of backups, such as the age of the last good one."""

import time
from collections.abc import Iterator
from datetime import UTC, datetime

import msgspec

from action_assistant.journal.copies.backup_state import BackupState
from action_assistant.web.monitoring.gauges import Family


class BackupsShown(msgspec.Struct, frozen=True, kw_only=True):
    """The last backup and what it lacks, the failure since then, the last restore rehearsal, and
    when the next backup is due. Fields are null where there was none."""

    made_at: datetime | None = None
    bytes: int | None = None
    seconds: float | None = None
    missing: tuple[str, ...] = ()
    off_site: str | None = None
    failed_at: datetime | None = None
    failed_why: str | None = None
    proven_at: datetime | None = None
    unsound: str | None = None
    next_at: datetime | None = None
    keep: str | None = None
    is_late: bool = False


def backups_shown(state: BackupState | None) -> BackupsShown | None:
    """Return the state of backups for people; None if it cannot be read, which does not mean that
    there are none."""
    if state is None:
        return None
    last, failed, schedule = state.last, state.failed, state.schedule
    return BackupsShown(
        made_at=_time(last.at if last else None),
        bytes=last.bytes if last else None,
        seconds=last.seconds if last else None,
        missing=last.missing if last else (),
        off_site=last.off_site.why if last and last.off_site else None,
        failed_at=_time(failed.at if failed else None),
        failed_why=failed.why if failed else None,
        proven_at=_time(state.proven.at if state.proven else None),
        unsound=state.rehearsed.why if state.rehearsed else None,
        next_at=_time(schedule.next if schedule else None),
        keep=schedule.keep if schedule else None,
        is_late=state.is_late(time.time()),
    )


def families(state: BackupState | None) -> Iterator[Family]:
    """Yield the metrics of backups; a metric whose event never happened is left out."""
    if state is None:
        return
    if (last := state.last) is not None:
        yield Family("backup_last_timestamp_seconds", "When the last backup was begun.", last.at)
        yield Family("backup_last_bytes", "Size of the last backup.", last.bytes)
        yield Family("backup_last_duration_seconds", "How long it took.", last.seconds)
        away = last.off_site is not None and last.off_site.why is not None
        yield Family("backup_off_site_failed", "1 if it could not be taken elsewhere.", away)
    if state.proven is not None:
        told = "When a backup was last restored for a trial, and sound."
        yield Family("backup_proven_timestamp_seconds", told, state.proven.at)
    if state.last is not None or state.failed is not None or state.schedule is not None:
        failed = state.failed is not None
        yield Family("backup_failed", "1 if the newest backup came to nothing.", failed)
    if state.schedule is not None:
        late = state.is_late(time.time())
        yield Family("backup_late", "1 if a backup should have been made by now.", late)


def _time(seconds: float | None) -> datetime | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)
