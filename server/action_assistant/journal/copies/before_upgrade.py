"""A copy of a journal before its tables change, so that the older version can have it back.

It is one SQLite file whatever database it came from, at the revision that it had: for SQLite the very
file, for Postgres all rows of all tables. It is proven by the chain of its events. The newest few stay.
"""

import logging
import shutil
import sqlite3
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, NamedTuple

from sqlalchemy import Connection, MetaData, NullPool, Table, create_engine, insert, select, text

from action_assistant.errors import CannotStart
from action_assistant.journal.chain import Damage, Inspector
from action_assistant.journal.database import Branch
from action_assistant.journal.events import Event
from action_assistant.journal.migrate import last_writer, run_scripts
from action_assistant.journal.removal import removed_by, taken_out
from action_assistant.journal.slots import pages_in_order
from action_assistant.journal.sqlite import inspected
from action_assistant.private_files import make_folder, sync
from action_assistant.schema.branches import VERSIONS

log: Final = logging.getLogger(__name__)

FOLDER: Final = "before-upgrade"
_KEPT: Final = 3  # of each journal, and so many revisions
#: Bytes that have to be left on the disk beside a copy.
ROOM: Final = 64 << 20
_PAGES: Final = 5_000  # copied between two reports of progress
_ROWS: Final = 64  # in memory: an event has up to a MiB
_EVERY: Final = 1.0  # seconds between two reports of progress
_STAMP: Final = "%Y%m%d-%H%M%S"
_COLUMNS: Final = (*Event.__struct_fields__, "chain")


class UpgradeCopy(NamedTuple):
    """A copy of a journal from before an upgrade: its file, the branch (editor or runner), the
    revision of the tables, and when it was made."""

    path: Path
    branch: Branch
    revision: str
    made_at: datetime


def copy_at(path: Path) -> UpgradeCopy | None:
    """Return the copy that the file name of `path` describes; None for other names."""
    revision, _, stamp = path.stem.partition("-")
    named = revision.partition("_")[0]
    try:
        made_at = datetime.strptime(stamp, _STAMP).replace(tzinfo=UTC)
    except ValueError:
        return None
    branches: tuple[Branch, ...] = ("editor", "runner")
    for branch in branches:
        if named == branch:
            return UpgradeCopy(path, branch, revision, made_at)
    return None


def copies_in(folder: Path) -> list[UpgradeCopy]:
    """Return the copies in a folder, the newest first."""
    found = [copy for path in folder.glob("*.db") if (copy := copy_at(path)) is not None]
    return sorted(found, key=lambda each: (each.made_at, each.path), reverse=True)


def keep_copy(folder: Path, connection: Connection, branch: Branch, revision: str) -> Path:
    """Copy a database of a branch, at this revision of its tables, into a folder, in the
    transaction in which it is about to change; return the file. Raise CannotStart if that fails;
    nothing has changed then."""
    begun = time.monotonic()
    try:
        make_folder(folder)
        target = _free(folder, revision)
        events = _written(target, connection, branch, revision)
        for old in _superfluous([each for each in copies_in(folder) if each.branch == branch]):
            old.path.unlink(missing_ok=True)
        for left in folder.glob(f".{branch}_*.db.part*"):  # of a copy that was killed
            left.unlink(missing_ok=True)
    except (OSError, sqlite3.Error) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        raise CannotStart(_refusal(folder, why or str(error))) from error
    writer = last_writer(connection)
    log.info(
        "before its tables change, the %s's journal (%s%s) is copied to %s: %d events, %.1f MiB, %.1f s",
        branch,
        revision,
        f", last written by version {writer}" if writer is not None else "",
        target,
        events,
        target.stat().st_size / 2**20,
        time.monotonic() - begun,
    )
    return target


def _superfluous(copies: list[UpgradeCopy]) -> list[UpgradeCopy]:
    """Return the copies that may be deleted; `copies`: the newest first. The newest few stay, and
    the newest one of each of the last few revisions of the database schema, since an upgrade that
    fails at each start must not push out the old state."""
    newest: dict[str, UpgradeCopy] = {}
    for each in copies:
        newest.setdefault(each.revision, each)
    stays = {*copies[:_KEPT], *list(newest.values())[:_KEPT]}
    return [each for each in copies if each not in stays]


def _written(target: Path, connection: Connection, branch: Branch, revision: str) -> int:
    """Write a copy of the database, verify it, and rename it to `target`; return the number of its
    events."""
    for left in target.parent.glob(f".{branch}_*.part*"):  # of a killed process
        left.unlink()
    part = target.with_name(f".{target.name}.part")
    try:
        part.touch(mode=0o600)
        copy = _copy_file if connection.dialect.name == "sqlite" else _copy_rows
        events = _proven(part, copy(connection, branch, revision, part))
        sync(part)
        part.replace(target)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    sync(target.parent)
    return events


def _free(folder: Path, revision: str) -> Path:
    """Return a file name, by the time, for a copy at this revision that no copy in the folder has
    yet; wait until the time gives one, if needed."""
    while True:
        target = folder / f"{revision}-{datetime.now(UTC).strftime(_STAMP)}.db"
        if not target.exists():
            return target
        time.sleep(0.1)


def _refusal(folder: Path, why: str) -> str:
    return (
        f"The tables of this version are others, and no copy of the database can be made in {folder} "
        f"before they change: {why}. Nothing was changed. Mend that; or make a backup by the version "
        "that you had, and then `action-assistant migrate --without-copy`."
    )


def _check_room(folder: Path, size: int) -> None:
    free = shutil.disk_usage(folder).free
    if size + ROOM > free:
        why = f"it needs {(size + ROOM) >> 20} MiB, and {free >> 20} MiB are left"
        raise CannotStart(_refusal(folder, why))


def _copy_file(
    connection: Connection, branch: Branch, revision: str, part: Path
) -> Callable[[], list[Damage]]:
    """Copy the SQLite file of `connection`, with its write-ahead log, to `part`; return a function
    that returns the damage of the original."""
    del branch, revision
    row = connection.exec_driver_sql("PRAGMA database_list").first()
    source = Path(str(row[2]) if row is not None else "")
    waits = source.with_name(f"{source.name}-wal")
    _check_room(part.parent, sum(each.stat().st_size for each in (source, waits) if each.exists()))
    tell = _telling(f"{source.name} is copied before its tables change")
    with (
        closing(sqlite3.connect(f"{source.as_uri()}?mode=ro", uri=True)) as there,
        closing(sqlite3.connect(part)) as here,
    ):
        there.backup(
            here,
            pages=_PAGES,
            progress=lambda _, left, total: tell(f"{total - left} of {total} pages"),
            sleep=0,
        )
    return lambda: inspected(source)[1]


def _copy_rows(
    connection: Connection, branch: Branch, revision: str, part: Path
) -> Callable[[], list[Damage]]:
    """Copy all tables of this program into a SQLite file (`part`) of the same revision; return a
    function that returns the damage of the original."""
    _check_room(
        part.parent,
        connection.execute(text("SELECT pg_database_size(current_database())")).scalar_one(),
    )
    tell = _telling("the database is copied before its tables change")
    engine = create_engine(f"sqlite:///{part}", poolclass=NullPool)
    inspector, ends, tables = Inspector(taken_out), list[Sequence[Any]](), MetaData()
    try:
        with engine.begin() as here:
            run_scripts(here, branch, revision)
            tables.reflect(here, only=lambda name, _: name != VERSIONS.name)
            for table in tables.sorted_tables:
                for rows in _rows_of(connection, table):
                    here.execute(insert(table), rows)
                    if table.name == "event":
                        for row in rows:
                            inspector.see([row[name] for name in _COLUMNS])
                    elif table.name == "head":
                        ends += [(row["stream"], row["seq"], row["chain"]) for row in rows]
                    tell(f"{inspector.seen} events")
    finally:
        engine.dispose()
    return lambda: inspector.findings(ends)


def _rows_of(connection: Connection, table: Table) -> Iterator[list[dict[str, Any]]]:
    """Yield the rows of a table in batches, events in their order. Its cursor is closed before the
    tables change; the driver's own stays open until the end of the transaction."""
    if table.name == "event":
        chosen = select(*(table.c[name] for name in _COLUMNS))
        for page in pages_in_order(connection, chosen, table.c.position, _ROWS, removed_by):
            yield [row._asdict() for row in page]
        return
    cursor = f"copied_{table.name}"
    connection.exec_driver_sql(f'DECLARE {cursor} CURSOR FOR SELECT * FROM "{table.name}"')
    while rows := connection.exec_driver_sql(f"FETCH {_ROWS} FROM {cursor}").mappings().all():
        yield [dict(row) for row in rows]
    connection.exec_driver_sql(f"CLOSE {cursor}")


def _proven(part: Path, before: Callable[[], list[Damage]]) -> int:
    """Return the number of events in the copy `part`. Raise CannotStart if it has damage that the
    original (`before`: returns its damage) had not. Damage of the original is copied as well, and
    logged."""
    events, damages = inspected(part)
    if damages and damages != before():
        raise CannotStart(_refusal(part.parent, "the copy is not what was copied"))
    for damage in damages[:1]:
        log.warning(
            "the journal was damaged before, and its copy is the same: %s, event %d: %s. "
            "`verify` tells more.",
            damage.stream or "the file",
            damage.seq,
            damage.why,
        )
    return events


def _telling(what: str) -> Callable[[str], None]:
    """Return a function that logs progress of `what`, once a second at most."""
    last = time.monotonic()

    def tell(how_far: str) -> None:
        nonlocal last
        if time.monotonic() > last + _EVERY:
            last = time.monotonic()
            log.info("%s: %s …", what, how_far)

    return tell
