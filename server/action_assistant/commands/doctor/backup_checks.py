"""Backups: that there is one of what is worth it, and that those which are made regularly are made."""

import time
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Final

from action_assistant.commands.doctor.installation import Installation
from action_assistant.commands.doctor.recent_events import has_events, oldest_at
from action_assistant.errors import CannotStart
from action_assistant.journal.copies.backup_state import FILE, BackupState, backup_state
from action_assistant.journal.databases import database_of
from action_assistant.system.diagnostics import Diagnostic, fine, found

_WORTH_S: Final = 7 * 86_400.0  # seconds of use after which there should be one
_OLD_S: Final = 30 * 86_400.0
_BACK_UP: Final = "Make one: `action-assistant backup FILE`, and keep it elsewhere."


def backups_are_made(place: Installation) -> Iterator[Diagnostic]:
    """What is known of backups of this folder."""
    state, where, now = backup_state(place.data), place.data / FILE, time.time()
    if state is None:
        message = "What is known of backups cannot be read."
        yield found("backup-missing", where, message, f"Move the file away. {_BACK_UP}")
    elif state.last is None:
        used = _used_since(place)
        if used is not None and now - used > _WORTH_S:
            days = f"{(now - used) / 86_400:.0f} days"
            message = f"There is no backup, though this folder has been used for {days}."
            yield found("backup-missing", where, message, _BACK_UP)
        else:
            yield fine(where, "There is no backup yet.")
    elif trouble := _trouble(state, state.last.at, now):
        yield found("backup-old", where, trouble, _BACK_UP)
    else:
        yield fine(where, f"The last backup is of {_day(state.last.at)}.")


def _trouble(state: BackupState, last: float, now: float) -> str:
    """Why the newest backup is not what it should be."""
    if state.failed is not None:
        return f"The last backup failed ({state.failed.why}); the newest is of {_day(last)}."
    if state.is_late(now) and state.schedule is not None:
        due = _day(state.schedule.next)
        return f"A backup was due on {due} and was not made; the newest is of {_day(last)}."
    if state.schedule is None and now - last > _OLD_S:
        return f"The newest backup is of {_day(last)}, and nobody makes them regularly."
    return ""


def _used_since(place: Installation) -> float | None:
    """When the first event of graphs or runs was written, in seconds since 1970."""
    found_at: list[int] = []
    for name in ("editor.db", "runner.db"):
        file = place.data / name
        if not file.exists():
            continue
        try:
            database_of(f"sqlite:///{file}").look(
                lambda each: found_at.append(oldest_at(each) or 0) if has_events(each) else None
            )
        except CannotStart:  # told where the databases are looked at
            continue
    return min(found_at) / 1e6 if found_at else None


def _day(at: float) -> str:
    return f"{datetime.fromtimestamp(at, UTC):%Y-%m-%d}"
