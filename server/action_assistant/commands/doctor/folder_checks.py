"""The data folder: whose it is, who can read it, how full its disk is; the archive; the token."""

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from action_assistant import settings
from action_assistant.commands.doctor.database_checks import has_events, oldest_at
from action_assistant.commands.doctor.installation import Installation
from action_assistant.editor.log import database_location
from action_assistant.errors import CannotStart
from action_assistant.journal.copies import backup_state as backups
from action_assistant.journal.copies.backup_state import BackupState, backup_state
from action_assistant.journal.databases import database_of
from action_assistant.private_files import holds_nothing_else, of_others, open_to_others
from action_assistant.system import users
from action_assistant.system.diagnostics import Diagnostic, fine, found
from action_assistant.web.auth.keys import TOKEN_FILE, Keys

_WORTH_S: Final = 7 * 86_400.0  # seconds of use after which there should be one
_OLD_S: Final = 30 * 86_400.0
_BACK_UP: Final = "Make one: `action-assistant backup FILE`, and keep it elsewhere."


def backups_are_made(place: Installation) -> Iterator[Diagnostic]:
    """Check that backups of this folder exist and are not late."""
    state, where, now = backup_state(place.data), place.data / backups.FILE, time.time()
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
    """Return a sentence about what is wrong with the newest backup; empty if it is fine."""
    if state.failed is not None:
        return f"The last backup failed ({state.failed.why}); the newest is of {_day(last)}."
    if state.is_late(now) and state.schedule is not None:
        due = _day(state.schedule.next)
        return f"A backup was due on {due} and was not made; the newest is of {_day(last)}."
    if state.schedule is None and now - last > _OLD_S:
        return f"The newest backup is of {_day(last)}, and nobody makes them regularly."
    return ""


def _used_since(place: Installation) -> float | None:
    """Return the time of the first event of graphs or runs, in seconds since 1970; None without
    events."""
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


_LEAST_MIB: Final = 100
_SHOWN: Final = 5


def folder_is_ours(place: Installation) -> Iterator[Diagnostic]:
    """Check that the current user can use the data folder, and that nobody else can."""
    data = place.data
    if not data.exists():
        if blocked := _blocked(data):
            yield _unusable(data, blocked)
        else:
            yield fine(data, "The data folder is not there yet; serve makes it.")
        return
    if not data.is_dir() or not os.access(data, os.R_OK | os.W_OK | os.X_OK):
        yield _unusable(data, data)
        return
    strangers = of_others(data)
    if strangers:
        whose = users.name_of(strangers[0].lstat().st_uid)
        owner = users.name_of(data.stat().st_uid)
        yield found(
            "folder-of-others",
            data,
            f"{_listed(data, strangers)} {'is' if len(strangers) == 1 else 'are'} {whose}'s, the "
            f"folder is {owner}'s: this program was once started as another user.",
            f"Start it as {owner} only, and give the files back: sudo chown -R {owner} {data}",
        )
    yield from _readable(data)
    if not strangers:
        yield fine(data, "The data folder can be read and written.")


def _unusable(data: Path, why: Path) -> Diagnostic:
    if why.exists() and not why.is_dir():
        return found(
            "folder-unusable",
            data,
            f"{why} is no folder.",
            "Choose another data folder with --data, or move that file away.",
        )
    owner = users.name_of(why.stat().st_uid) if why.exists() else "nobody"
    return found(
        "folder-unusable",
        data,
        f"{users.mine()} cannot read and write in {why}, which is {owner}'s.",
        f"Run this program as {owner}, mend the rights of the folder, or choose another with --data.",
    )


def _blocked(folder: Path) -> Path | None:
    """Return the path that keeps us from creating a missing folder; None if nothing does."""
    above = next(each for each in folder.absolute().parents if each.exists())
    return None if above.is_dir() and os.access(above, os.W_OK | os.X_OK) else above


def _readable(data: Path) -> Iterator[Diagnostic]:
    exposed = open_to_others(data)
    token = data / TOKEN_FILE
    if token in exposed:
        yield found(
            "token-readable",
            token,
            "Other users of this computer may read the token, and sign in as the owner with it.",
            f"Run `chmod 600 {token}`; if others may have read it, delete it instead: the next start "
            "makes another, and links and sessions of the old one end.",
        )
    rest = [each for each in exposed if each != token]
    if not rest:
        return
    remedy = "The next start of this program closes them."
    if data in rest and not holds_nothing_else(data):
        remedy = (
            f"Run `chmod 700 {data}`, or move what else is in it; the start closes only our files."
        )
    yield found(
        "folder-readable",
        data,
        f"Other users of this computer can read {_listed(data, rest)}.",
        remedy,
    )


def _listed(data: Path, paths: list[Path]) -> str:
    """Return the first of these paths in one text, relative to the data folder, and how many more
    there are."""
    names = [str(path.relative_to(data)) if path != data else str(data) for path in paths]
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(names[:_SHOWN]) + more


def token_is_there(place: Installation) -> Iterator[Diagnostic]:
    """Check that a data folder that was served has a token, unless the environment gives one."""
    data, token = place.data, place.data / TOKEN_FILE
    served = any(
        (data / name).exists()
        for name in (database_location.JOURNAL, database_location.FILE, "runner.db")
    )
    if os.environ.get("ACTION_ASSISTANT_TOKEN"):
        yield fine("ACTION_ASSISTANT_TOKEN", "The token is the environment's.")
    elif not served and not token.exists():
        yield fine(token, "There is no token yet; serve makes it.")
    elif served and not token.exists():
        yield found(
            "token-missing",
            token,
            "The token is gone, though this folder was served: the next start makes another, with "
            "which no link and no session of before opens.",
            "Restore the file from a backup; or set ACTION_ASSISTANT_TOKEN here, if the server has "
            "its token from there; or start anew and send new links.",
        )
    else:
        try:
            Keys.known(data)
        except CannotStart as error:
            yield found(
                "token-unusable",
                token,
                str(error),
                "Restore the file from a backup, or delete it: the next start makes another, and links "
                "and sessions of the old one end.",
            )
        else:
            yield fine(token, "The token can be read.")


def nothing_was_interrupted(place: Installation) -> Iterator[Diagnostic]:
    """Report a restore that was interrupted, after which no process starts."""
    mark = place.data / settings.RESTORING
    if mark.exists():
        yield found(
            "restore-unfinished",
            mark,
            "A restore was interrupted, so the folder holds parts of a backup and nothing starts.",
            f"Run the same `action-assistant restore FILE --data {place.data}` again.",
        )


def archive_is_usable(place: Installation) -> Iterator[Diagnostic]:
    """Check the folder of archives."""
    try:
        folder = settings.keep(place.data).folder
    except CannotStart:  # told with the settings
        return
    problem = ""
    if folder.exists():
        if not folder.is_dir():
            problem = f"{folder} is no folder"
        elif not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
            problem = f"{users.mine()} cannot read and write in it"
    elif blocked := _blocked(folder):
        problem = f"it is not there, and cannot be made in {blocked}"
    if problem and folder != place.data / settings.ARCHIVE:
        yield found(
            "archive-unusable",
            folder,
            f"Runs cannot go into the archive: {problem}; archived runs do not open.",
            "Mount its disk or mend its rights, or name another folder in ACTION_ASSISTANT_ARCHIVE.",
        )
    elif problem and place.data.is_dir():
        yield found(
            "archive-unusable",
            folder,
            f"Runs cannot go into the archive: {problem}; archived runs do not open.",
            "Mend its rights, or move what stands in its place away.",
        )
    else:
        yield fine(folder, "The archive of runs can be used.")


def disk_has_room(place: Installation) -> Iterator[Diagnostic]:
    """Check the free space on the disks of the data folder and of the archive."""
    folders = [place.data]
    with suppress(CannotStart):  # told with the settings
        folders.append(settings.keep(place.data).folder)
    seen: set[int] = set()
    for folder in folders:
        above = next(each for each in (folder, *folder.absolute().parents) if each.exists())
        if above.stat().st_dev in seen:
            continue
        seen.add(above.stat().st_dev)
        free = shutil.disk_usage(above).free // 2**20
        if free < _LEAST_MIB:
            yield found(
                "disk-full",
                folder,
                f"Its disk has {free} MiB left: soon no edit can be saved and no run recorded.",
                "Make room there, move the data folder, or let older runs go into archives elsewhere "
                "(`action-assistant runs archive`, ACTION_ASSISTANT_ARCHIVE).",
            )
        else:
            yield fine(folder, f"Its disk has {free} MiB left.")
