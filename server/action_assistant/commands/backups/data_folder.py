"""The contents of a data folder, as `backup` and `restore` see it: journals, keys, archives, and the rest."""

import asyncio
import os
import shutil
import sqlite3
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from itertools import count
from pathlib import Path
from typing import Any, Final

import msgspec
from sqlalchemy import Row, Select, select
from sqlalchemy.exc import DBAPIError

from action_assistant.commands.backups.progress import Progress
from action_assistant.errors import CannotStart
from action_assistant.journal.copies import backup_state, before_upgrade
from action_assistant.journal.copies.copying import sentence
from action_assistant.journal.database import Branch, cause_of
from action_assistant.journal.databases import database_of
from action_assistant.journal.events import Fold
from action_assistant.journal.journal import Journal
from action_assistant.journal.removal import StreamRemoved
from action_assistant.private_files import opener
from action_assistant.runner.archives.raw_messages import RawArchived
from action_assistant.runner.runs import photos, sight
from action_assistant.schema.runner_tables import runner_event
from action_assistant.settings import ARCHIVE, RESTORING
from action_assistant.system import posix
from action_assistant.web.auth import (
    confirmations,
    graph_seals,
    keys,
    released_versions,
    revocations,
)
from action_assistant.web.network import certificate

BRANCHES: Final[tuple[Branch, ...]] = ("editor", "runner")
RECORDINGS: Final = "recordings"
#: What is taken along beside journals and archives. A folder of these is put back file by file, if
#: its files never change; the others are put back where there is none.
MERGED: Final = frozenset({revocations.FOLDER, RECORDINGS, photos.FOLDER})
WHOLE: Final = frozenset(
    {
        *(keys.TOKEN_FILE, certificate.FOLDER, graph_seals.FILE, sight.FILE),
        *("people", "passkeys", "sessions", "sessions.db", "tokens", "views"),
        released_versions.FOLDER,
    }
)
#: Files that are created again, or that belong to this data folder only.
_OWN: Final = frozenset(
    {
        *(f"{branch}.{kind}" for branch in BRANCHES for kind in ("db", "address")),
        *("editor.mark", "editor.database", "open.html", ARCHIVE, RESTORING),
        confirmations.FOLDER,
        *(backup_state.FILE, before_upgrade.FOLDER),
    }
)
_PASSING: Final = (".lock", ".lock.new", "-wal", "-shm", "-journal", ".part")
ASIDE: Final = "before-restore-"
#: The prefix of folders that `move` leaves behind.
MOVED: Final = "before-move-"
_MAGIC: Final = b"SQLite format 3\0"
_PAGES: Final = 5_000  # copied between two reports of progress
_AT_WORK: Final = ".at-work"


def belongings(data: Path) -> Iterator[tuple[str, Path]]:
    """Yield the files of the data folder, beside the journals, that a backup includes: the path
    relative to the folder, and the path."""
    for name in sorted(MERGED | WHOLE):
        top = data / name
        for path in sorted(top.rglob("*")) if top.is_dir() else [top]:
            if path.is_file() and not path.is_symlink() and not _is_passing(path):
                yield path.relative_to(data).as_posix(), path


def left_out(data: Path) -> list[Path]:
    """Return the entries of the data folder that are not this program's, and so not in a backup."""
    if not data.is_dir():
        return []
    known = MERGED | WHOLE | _OWN
    return sorted(
        path
        for path in data.iterdir()
        if path.name not in known
        and not _is_passing(path)
        and not path.name.startswith((ASIDE, MOVED))
    )


def _is_passing(path: Path) -> bool:
    return path.name.startswith(".") or path.name == "lock" or path.name.endswith(_PASSING)


def is_database(path: Path) -> bool:
    """Return whether the file `path` is a SQLite database, which has to be copied by SQLite itself."""
    with path.open("rb") as file:
        return file.read(len(_MAGIC)) == _MAGIC


def tables_copied(source: Path, target: Path, name: str, progress: Progress) -> None:
    """Copy the SQLite file `source` to `target`, as it is at one moment, even if other processes
    write to it meanwhile. Only the owner may read the copy. The number of copied pages is reported
    to `progress`, with the name `name` for the file."""

    def tell(_: int, remaining: int, total: int) -> None:
        progress.tell(f"{name}: {total - remaining} of {total} pages copied")

    # What may not write could not remove the files beside the database again.
    with (
        closing(sqlite3.connect(f"{source.as_uri()}?mode=rw", uri=True)) as there,
        closing(sqlite3.connect(target)) as here,
    ):
        target.chmod(0o600)
        there.execute("BEGIN")  # otherwise each commit of another process restarts it
        there.execute("SELECT count(*) FROM sqlite_master").fetchone()
        there.backup(here, pages=_PAGES, progress=tell, sleep=0)


def fold_of(branch: Branch) -> Fold:
    """Return the function that turns the events of a journal (the editor's or the runner's) into
    its tables."""
    if branch == "editor":
        from action_assistant.editor.log.graph_events import fold as editor_fold

        return editor_fold
    from action_assistant.runner.projection import fold as runner_fold

    return runner_fold


def checked(
    path: Path,
    branch: Branch,
    progress: Progress,
    *,
    expected: int | None = None,
    anew: bool = False,
) -> int:
    """Verify the copy of a journal (`path`), bring its tables to this version, and return the
    number of its events. Raise CannotStart if an event is damaged or the number is not `expected`.
    `anew`: begin another epoch (history) in the copy."""
    from action_assistant.editor.log import epochs

    async def look() -> int:
        """Prove the journal, and return the number of its events."""
        url = f"sqlite:///{path}"
        journal = await Journal.open(url, branch=branch, fold=fold_of(branch))
        try:
            told = lambda count: progress.tell(f"{branch}: {count} events proven")  # noqa: E731
            for damage in await journal.verify(told):
                raise CannotStart(
                    f"The journal of the {branch} is damaged: {sentence(damage)}. "
                    "`verify` tells more."
                )
            events = (await journal.cursor()).events
            if expected not in {None, events}:
                raise CannotStart(
                    f"The journal of the {branch} ends at event {events}, not at {expected}."
                )
            if anew and branch == "editor":
                await epochs.begin(journal, "a backup was restored")
            return events
        finally:
            await journal.close()

    events = asyncio.run(look())
    path.with_name(f"{path.name}.lock").unlink(missing_ok=True)
    return events


def aside_folder(data: Path, prefix: str = ASIDE) -> Path:
    """Create and return a new folder in the data folder, named by `prefix` and the time, for files
    that are replaced."""
    name = time.strftime(f"{prefix}%Y%m%d-%H%M%S")
    for number in count(1):
        path = data / (name if number == 1 else f"{name}-{number}")
        try:
            path.mkdir(mode=0o700)
        except FileExistsError:
            continue
        return path
    raise AssertionError


def rows_of(path: Path, question: Select[Any]) -> list[Row[Any]]:
    """Return the rows of a query on a SQLite file (`path`) that no process writes."""
    found: list[Row[Any]] = []
    database_of(f"sqlite:///{path}").look(lambda c: found.extend(c.execute(question).all()))
    return found


def archived(runner: Path) -> dict[str, str]:
    """Return the archives that the copy of the runner's journal names: their SHA-256 by path in the
    archive folder."""
    if not runner.exists():
        return {}
    event = runner_event.c
    kinds = event.kind.in_([StreamRemoved.kind, RawArchived.kind])
    places = {}
    for row in rows_of(
        runner, select(event.kind, event.body).where(kinds).order_by(event.position)
    ):
        if row.kind == StreamRemoved.kind:
            removed = msgspec.json.decode(row.body, type=StreamRemoved)
            if not removed.kept:
                continue  # it was dropped for its age
            places[removed.kept] = removed.sha256
        else:
            put = msgspec.json.decode(row.body, type=RawArchived)
            places[put.file] = put.sha256
    return places


@contextmanager
def workshop(parent: Path, prefix: str) -> Iterator[Path]:
    """Return a context with a temporary folder in `parent`, which is on the disk of the result. It
    is private to this user, locked against `sweep`, and removed at the end. Errors of disk and
    database are raised as CannotStart."""
    try:
        with tempfile.TemporaryDirectory(prefix=prefix, dir=parent) as folder:
            held = opener(str(Path(folder) / _AT_WORK), os.O_RDWR | os.O_CREAT)
            try:
                if not posix.lock_file(held):
                    raise CannotStart(f"{parent} is just being tidied up. Try it again.")
                yield Path(folder)
            finally:
                os.close(held)
    except (OSError, sqlite3.Error, DBAPIError) as error:
        text = error.strerror if isinstance(error, OSError) else cause_of(error)
        raise CannotStart(f"Cannot work in {parent}: {text}.") from error


def sweep(parent: Path, prefix: str) -> None:
    """Remove the work folders in `parent` with this prefix that killed processes have left; folders
    that a process still uses stay."""
    for left in parent.glob(f"{prefix}*"):
        if left.is_symlink() or (left / _AT_WORK).is_symlink():
            continue  # a foreign file: the folder may be a shared one, such as /tmp
        try:
            held = opener(str(left / _AT_WORK), os.O_RDWR | os.O_CREAT)
        except OSError:
            continue  # it was just removed, or is another user's
        try:
            if posix.lock_file(held):  # until all is removed, in case another call begins there
                shutil.rmtree(left, ignore_errors=True)
        finally:
            os.close(held)
