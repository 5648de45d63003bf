"""`migrate`: brings the databases of a data folder to this version, and back to a copy from before."""

import argparse
import logging
import os
import shutil
import sqlite3
import sys
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Final

from sqlalchemy import Connection, MetaData, NullPool, create_engine, insert, make_url, select

from action_assistant import settings
from action_assistant.commands.backups.data_folder import aside_folder
from action_assistant.commands.backups.progress import Progress
from action_assistant.commands.place import add_data, add_database
from action_assistant.editor.log import database_location
from action_assistant.errors import CannotStart, NewerSchema
from action_assistant.journal.copies.before_upgrade import (
    FOLDER,
    UpgradeCopy,
    copies_in,
    copy_at,
    keep_copy,
)
from action_assistant.journal.copies.copying import sentence
from action_assistant.journal.database import Branch, no_copy
from action_assistant.journal.databases import database_of
from action_assistant.journal.lock import own
from action_assistant.journal.migrate import last_writer, recognize, revisions_of, run_scripts
from action_assistant.journal.sqlite import inspected, unchanged
from action_assistant.private_files import opener, sync
from action_assistant.schema.branches import BRANCHES, VERSIONS

_ROWS: Final = 500  # in memory
#: Errors of SQLite for a file that is no database, or no copy of ours.
_DAMAGED: Final = {sqlite3.SQLITE_ERROR, sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB}


def go_back(data: Path, database: str | None, files: list[Path]) -> int:
    """Run `migrate --back` in a data folder and return the exit code: put copies (`files`) of
    journals in place of the journals, or list the copies if no file is named. Raise CannotStart if
    a copy or a database cannot be used."""
    settings.settled(data)
    if not files:
        return _list(data)
    copies = [_copy(data, file) for file in files]
    if len({copy.branch for copy in copies}) < len(copies):
        raise CannotStart("Name one copy of each journal at most. Nothing was changed.")
    progress = Progress()
    with ExitStack() as locks:
        places = [(copy, _place(_url(data, database, copy))) for copy in copies]
        for _, place in places:
            if isinstance(place, Path):
                locks.callback(os.close, own(place))
        for copy, place in places:
            if isinstance(place, Path):
                _put_file(data, copy, place, progress)
            else:
                _put_rows(data, copy, place, progress)
    return 0


def _list(data: Path) -> int:
    copies = copies_in(data / FOLDER)
    if not copies:
        print(f"There is no copy from before an upgrade in {data / FOLDER}.")
        return 1
    for copy in copies:
        when = copy.made_at.astimezone().strftime("%Y-%m-%d %H:%M:%S")
        writer = _asked(copy.path)
        by = f", written by version {writer}" if writer else ""
        size = copy.path.stat().st_size / 2**20
        print(f"{copy.path}  {copy.branch}, {when}, schema {copy.revision}, {size:.1f} MiB{by}")
    print("Put back those that you want by: action-assistant migrate --back FILE …")
    return 0


def _asked(path: Path) -> str:
    """Return the version of this program that last wrote the database file `path`; "" if the file
    does not say. The file is not changed."""
    engine = create_engine(unchanged(path), poolclass=NullPool)
    try:
        with engine.connect() as connection:
            return str(last_writer(connection) or "")
    finally:
        engine.dispose()


def _copy(data: Path, file: Path) -> UpgradeCopy:
    path = file.resolve()
    copy = copy_at(path)
    if copy is None or not path.is_file():
        raise CannotStart(
            f"{file} is no copy from before an upgrade. Those of {data} are in {data / FOLDER}: "
            "`migrate --back` lists them."
        )
    try:
        _, damages = inspected(path)
    except sqlite3.Error as error:
        raise CannotStart(f"{file} cannot be read: {error}.") from error
    if damages:
        raise CannotStart(f"{file} is damaged: {sentence(damages[0])}. Nothing was changed.")
    return copy


def _url(data: Path, database: str | None, copy: UpgradeCopy) -> str:
    if copy.branch == "runner":
        return f"sqlite:///{data / 'runner.db'}"
    return database or database_location.of(data)


def _place(url: str) -> Path | str:
    """Return the path of a SQLite file, or the URL of a database on a server."""
    parsed = make_url(url)
    return Path(parsed.database or "") if parsed.get_backend_name() == "sqlite" else url


def _put_file(data: Path, copy: UpgradeCopy, path: Path, progress: Progress) -> None:
    part = path.with_name(f".{path.name}.part")
    with _told(path.parent):
        try:
            progress.tell(f"{copy.path.name} is copied")
            with copy.path.open("rb") as there, open(part, "wb", opener=opener) as here:
                shutil.copyfileobj(there, here)
            sync(part)
            now = _emptied(path)
            # Links lead to no other disk.
            is_here = path.parent.stat().st_dev == data.stat().st_dev
            aside = aside_folder(data if is_here else path.parent)
            _replace_database(part, path, aside)
        finally:
            part.unlink(missing_ok=True)
    progress.end()
    _tell(copy, str(path), inspected(path)[0], now, aside)


def _replace_database(part: Path, path: Path, aside: Path) -> None:
    """Put the file `part` in the place of `path`. Before that, link the old file and its SQLite
    side files (-wal, -shm, -journal) into the folder `aside`, and remove the side files."""
    beside = [path.with_name(f"{path.name}{suffix}") for suffix in ("-wal", "-shm", "-journal")]
    for each in (path, *beside):
        if each.exists():
            os.link(each, aside / each.name)
    sync(aside)
    sync(aside.parent)
    for each in beside:  # empty by now, unless the file is damaged
        each.unlink(missing_ok=True)
    part.replace(path)
    sync(path.parent)


def _emptied(path: Path) -> int | None:
    """Merge the write-ahead log of the SQLite database `path` into its file, and return the number
    of its events, 0 if there is no file. Return None if the file is damaged. Raise CannotStart if
    another process has the database open, or if it cannot be closed for another reason."""
    if not path.exists():
        return 0
    try:
        with closing(sqlite3.connect(path)) as database:
            (busy, *_) = database.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
            (events,) = database.execute("SELECT count(*) FROM event").fetchone()
    except sqlite3.Error as error:
        if getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF in _DAMAGED:
            return None
        raise CannotStart(f"{path} cannot be closed: {error}. Nothing was changed.") from error
    if busy:
        raise CannotStart(
            f"Somebody else has {path} open, as for a backup: nothing was changed. Try again later."
        )
    return int(events)


def _put_rows(data: Path, copy: UpgradeCopy, url: str, progress: Progress) -> None:
    from action_assistant.journal.postgres import Postgres

    database = database_of(url)
    assert isinstance(database, Postgres)
    session = database.own(copy.branch)
    aside = aside_folder(data)
    try:
        with _told(data):
            then, now = database.migrate(
                lambda connection: _exchanged(connection, copy, aside, progress)
            )
    except BaseException:
        with suppress(OSError):  # one that holds a copy stays: a commit may have come to its end
            aside.rmdir()
        raise
    finally:
        session.close()
    progress.end()
    _tell(copy, database_location.shown(url), then, now, aside)


def _exchanged(
    connection: Connection, copy: UpgradeCopy, aside: Path, progress: Progress
) -> tuple[int, int]:
    """Copy the present tables of the branch to a file in the folder `aside`, if there are any, then
    replace them by the tables of the copy. Return how many events there are now, and how many there
    were before. Raise CannotStart, without a change, if a newer version made the tables or they
    cannot be copied."""
    try:
        current = recognize(connection)
    except NewerSchema as error:  # none of its tables may stay behind, and we do not know them
        raise CannotStart(
            f"Graphs on a server are put back by the version that made their tables, and this is an "
            f"older one: nothing was changed. {error}"
        ) from error
    now = 0
    if current:
        progress.tell("what is there now is copied aside")
        now = inspected(keep_copy(aside, connection, copy.branch, max(current)))[0]
    names = {*BRANCHES[copy.branch].tables, VERSIONS.name}
    there = MetaData()
    there.reflect(connection, only=lambda name, _: name in names)
    there.drop_all(connection)
    run_scripts(connection, copy.branch, copy.revision)
    engine = create_engine(unchanged(copy.path), poolclass=NullPool)
    tables, events = MetaData(), 0
    try:
        with engine.connect() as here:
            tables.reflect(here, only=lambda name, _: name in names - {VERSIONS.name})
            for table in tables.sorted_tables:
                chosen = here.execution_options(yield_per=_ROWS).execute(select(table))
                for rows in chosen.mappings().partitions():
                    connection.execute(insert(table), [dict(row) for row in rows])
                    events += len(rows) * (table.name == "event")
                    progress.tell(f"{table.name}: rows are put back, {events} events so far")
    finally:
        engine.dispose()
    return events, now


def _tell(copy: UpgradeCopy, place: str, then: int, now: int | None, aside: Path) -> None:
    print(f"{copy.branch}: {place} is as it was at schema {copy.revision}, with {then} events")
    if now is None:
        print("What was there could not be read, and so it is not known what came after.")
    elif now > then:
        print(f"{now - then} events that came after are not in it.")
    print(f"What was there is in {aside}.")
    if copy.revision != revisions_of(copy.branch)[-1]:
        print(
            "Start it with the version that the copy is of; this one would change the tables again."
        )


@contextmanager
def _told(folder: Path) -> Iterator[None]:
    """Return a context that turns errors of the disk into CannotStart with a sentence about
    `folder`."""
    try:
        yield
    except OSError as error:
        raise CannotStart(f"Cannot write to {folder}: {error.strerror}.") from error


def _add_migrate(migrate: argparse.ArgumentParser) -> None:
    migrate.epilog = "example: action-assistant migrate --data ./data"
    add_data(migrate)
    add_database(migrate)
    ways = migrate.add_mutually_exclusive_group()
    ways.add_argument(
        "--back",
        nargs="*",
        type=Path,
        metavar="COPY",
        help="put back copies that were made before tables changed, for the version that made them; "
        "without a name, list them",
    )
    ways.add_argument(
        "--without-copy",
        action="store_true",
        help="make none before tables change: where there is no room, and a backup is elsewhere",
    )
    migrate.set_defaults(handler=_migrate)


COMMANDS: Final = {"migrate": _add_migrate}


def _migrate(options: argparse.Namespace) -> int:
    if options.back is not None:
        return go_back(options.data.resolve(), options.database, options.back)
    return _forward(options)


def _forward(options: argparse.Namespace) -> int:
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(message)s")
    data = settings.data_folder(options.data.resolve())
    before = no_copy if options.without_copy else partial(keep_copy, data / FOLDER)
    database = options.database or database_location.of(data)
    urls: dict[Branch, str] = {"editor": database, "runner": f"sqlite:///{data / 'runner.db'}"}
    for branch, url in urls.items():
        place = database_of(url)
        try:
            # Take the lock of the only writer: a running older version would write to the new tables.
            place.open(branch, before).close()
        finally:
            place.disown()
        name = place.name.removeprefix("The database ")
        print(f"{branch}: {name} is at revision {revisions_of(branch)[-1]}")
    return 0
