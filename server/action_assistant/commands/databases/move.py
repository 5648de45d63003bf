"""`move`: takes the graphs of a data folder from SQLite to Postgres, or back.

Nobody else can write to either database meanwhile. Everything is copied in one transaction, both are
compared row by row, and only then does the folder remember the other one, by one rename. Until then the
old one is the truth, from then on the new one, whatever ends this. The old one stays as it is.
"""

import argparse
import logging
import os
import shutil
import sqlite3
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from functools import partial
from hashlib import blake2b
from pathlib import Path
from struct import pack
from typing import Any, Final, NamedTuple

from sqlalchemy import Connection, Table, make_url, select, text
from sqlalchemy.exc import ArgumentError

from action_assistant import settings
from action_assistant.commands.backups.data_folder import (
    MOVED,
    aside_folder,
    fold_of,
    sweep,
    workshop,
)
from action_assistant.commands.backups.progress import Progress
from action_assistant.commands.place import add_data, add_database
from action_assistant.errors import CannotStart
from action_assistant.journal.copies.before_upgrade import FOLDER, keep_copy
from action_assistant.journal.copies.copying import copy
from action_assistant.journal.databases import ask_once, database_of
from action_assistant.journal.lock import own
from action_assistant.private_files import sync
from action_assistant.schema.branches import BRANCHES

#: Tables that are not compared: the writers, and tables that are computed again from events.
_APART: Final = frozenset(
    {
        "written_by",
        *("key_change", "overwritten_value", "key_change_head"),
        *("graph_facts", "graph_label"),
    }
)
_ROWS: Final = 500  # in memory
_WIDE: Final = 1 << 256


class TableSum(NamedTuple):
    """The number of rows of a table, and the sum of their digests as a number."""

    rows: int
    digest: int


def differences(one: str, other: str, progress: Progress) -> list[str]:
    """Return one sentence for each table of the editor that differs between the databases with the
    URLs `one` and `other`. Raise CannotStart if one cannot be read."""
    found = [ask_once(url, lambda c: dict(_sums(c, progress))) for url in (one, other)]
    return [
        f"{name}: {found[0][name].rows} rows and {found[1][name].rows}"
        for name in found[0]
        if found[0][name] != found[1][name]
    ]


def _sums(connection: Connection, progress: Progress) -> Iterator[tuple[str, TableSum]]:
    for table in BRANCHES["editor"].sorted_tables:
        if table.name not in _APART:
            yield table.name, _sum(connection, table, progress)


def _sum(connection: Connection, table: Table, progress: Progress) -> TableSum:
    rows = digest = 0
    chosen = select(table).execution_options(yield_per=_ROWS)
    with connection.execute(chosen) as found:
        for some in found.partitions():
            for row in some:
                digest = (digest + int.from_bytes(_digest(tuple(row)), "big")) % _WIDE
            rows += len(some)
            progress.tell(f"{table.name}: {rows} rows compared")
    return TableSum(rows, digest)


def _digest(values: tuple[Any, ...]) -> bytes:
    """Return the digest of the values of a row. It covers type and length of each value, so that
    different rows differ."""
    digest = blake2b(digest_size=32)
    for value in values:
        if isinstance(value, bytes | memoryview):
            kind, data = b"b", bytes(value)
        else:
            kind, data = type(value).__name__[:1].encode(), str(value).encode()
        digest.update(kind + pack(">I", len(data)) + data)
    return digest.digest()


_WORK: Final = ".move-"
_ROOM: Final = 64 << 20  # bytes that have to be left on the disk


def _add_move(move: argparse.ArgumentParser) -> None:
    move.epilog = (
        "example: action-assistant move --to postgresql://lab@db/graphs --data ./data; "
        "action-assistant move --to sqlite --data ./data"
    )
    move.add_argument(
        "--to",
        required=True,
        metavar="URL|sqlite",
        help="an empty Postgres database, or the data folder itself",
    )
    add_data(move)
    add_database(
        move,
        "where the graphs are now, if its password is asked for; default: as the folder knows it",
    )
    move.set_defaults(handler=_move)


COMMANDS: Final = {"move": _add_move}


def _move(options: argparse.Namespace) -> int:
    from action_assistant.editor.log import database_location

    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(message)s")
    data = settings.data_folder(options.data.resolve())
    target = _target(data, options.to)
    known = database_location.of(data)
    if database_location.same(known, target):
        print(f"The graphs of {data} are there already.")
        _tidy(data, target)
        return 0
    source = _source(data, known, options.database)
    if not (source.startswith("sqlite:") or target.startswith("sqlite:")):
        raise CannotStart(
            "From one Postgres to another the way leads through the data folder: "
            "`move --to sqlite` first, then `move --to URL`."
        )
    begun = time.monotonic()
    events, aside = _moved(data, source, target)
    _tell(data, source, target, aside)
    print(
        f"{events} events, each compared, and all tables alike ({time.monotonic() - begun:.1f} s)"
    )
    return 0


def _moved(data: Path, source: str, target: str) -> tuple[int, Path | None]:
    """Copy the graphs from the database `source` to `target` (URLs) while no other process can
    write. Return the number of events and the path to which the files of the data folder were
    moved, None if none was. Raise CannotStart if a database cannot be used."""
    progress = Progress()
    database = database_of(source)
    try:
        session = database.open("editor", partial(keep_copy, data / FOLDER))
    except BaseException:
        database.disown()
        raise
    aside: Path | None = None
    try:
        try:
            if target.startswith("sqlite:"):
                events, aside = _into_folder(data, source, target, progress)
            else:
                events = _into_server(data, source, target, progress)
        finally:
            session.close()
        aside = aside or _put_aside(data, keep=target)
    finally:
        database.disown()
    progress.end()
    return events, aside


def _target(data: Path, to: str) -> str:
    if to == "sqlite":
        return f"sqlite:///{data / 'editor.db'}"
    try:
        database_of(to)
        is_server = make_url(to).get_backend_name() != "sqlite"
    except ArgumentError:
        is_server = False
    if not is_server:
        raise CannotStart("--to is `sqlite`, for the data folder, or postgresql://USER@HOST/NAME.")
    return to


def _source(data: Path, known: str, given: str | None) -> str:
    """Return the URL of the graphs' database: `given`, which may have a password, if it names the
    same database as `known`, else `known`, the URL without a password that is stored in the data
    folder. Raise CannotStart if the data folder has no graphs yet."""
    from action_assistant.editor.log import database_location

    if given is not None and database_location.same(given, known):
        return given  # the folder stores no password
    if database_location.journal_of(data, None) is None:
        raise CannotStart(f"There are no graphs in {data} yet.")
    return known


def _into_server(data: Path, source: str, target: str, progress: Progress) -> int:
    """Copy the graphs from `source` into the database `target` on a server, compare, and switch to
    it; return the number of events. Raise CannotStart if that fails; nothing has changed then."""
    return copy(
        database_of(source),
        database_of(target),
        branch="editor",
        fold=fold_of("editor"),
        tell=lambda count: progress.tell(f"{count} events copied"),
        over_older=True,
        then=lambda: _switch(data, source, target, target, progress),
    )


def _into_folder(
    data: Path, source: str, target: str, progress: Progress
) -> tuple[int, Path | None]:
    """Copy the graphs from `source` into a file of the data folder, and switch to it (`target`: its
    URL); return the number of events and the old file that was moved aside, None if there was none.
    """
    with workshop(data, _WORK) as folder, ExitStack() as locks:
        locks.callback(os.close, own(data / "editor.db"))
        sweep(data, _WORK)
        _check_room(folder, source)
        file = folder / "editor.db"
        events = copy(
            database_of(source),
            database_of(f"sqlite:///{file}"),
            branch="editor",
            fold=fold_of("editor"),
            tell=lambda count: progress.tell(f"{count} events copied"),
        )
        with closing(sqlite3.connect(file)) as database:
            database.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
        sync(file)
        aside = _put_aside(data)
        _switch(data, source, f"sqlite:///{file}", target, progress, file)
    return events, aside


def _tidy(data: Path, target: str) -> None:
    """Remove what is left of a move to `target` that was killed after the switch. Do nothing while
    another process uses the old file."""
    try:
        lock = own(data / "editor.db")
    except CannotStart:
        return  # it is in use
    try:
        sweep(data, _WORK)
        _put_aside(data, keep=target)
    finally:
        os.close(lock)


def _check_room(folder: Path, source: str) -> None:
    size = int(
        ask_once(
            source,
            lambda c: (
                c.execute(text("SELECT pg_database_size(current_database())")).scalar_one()
                if c.dialect.name != "sqlite"
                else 0
            ),
        )
    )
    free = shutil.disk_usage(folder).free
    if size + _ROOM > free:
        raise CannotStart(
            f"The graphs need {(size + _ROOM) >> 20} MiB, and {folder.parent} has {free >> 20} MiB left."
        )


def _switch(
    data: Path, source: str, copied: str, target: str, progress: Progress, file: Path | None = None
) -> None:
    """Compare the databases `source` and `copied`, then make the copy the one that this data folder
    uses, under the URL `target`; `file`: the copied file to move into the folder, None for a
    database on a server. Raise CannotStart if its tables differ from the source or the choice
    cannot be stored."""
    from action_assistant.editor.log import database_location

    unlike = differences(source, copied, progress)
    if unlike:
        raise CannotStart(
            f"What was copied is not the same ({'; '.join(unlike)}), so that the graphs stay where they "
            "are. `action-assistant rebuild` makes the tables here as the events say; then try again."
        )
    if file is not None:
        file.replace(data / "editor.db")
        sync(data)
    database_location.remember(data, target)
    sync(data)
    if not database_location.same(database_location.of(data), target):
        raise CannotStart(
            f"{data / database_location.FILE} cannot be written: nothing has changed."
        )


def _put_aside(data: Path, keep: str = "") -> Path | None:
    """Move `editor.db` of the data folder into a new folder, since it is not the database in use.
    Return that folder; None if there is no such file or it is the database `keep`."""
    path = data / "editor.db"
    if not path.exists() or keep == f"sqlite:///{path}":
        return None
    aside = aside_folder(data, MOVED)
    for each in (path, *(path.with_name(f"{path.name}{suffix}") for suffix in ("-wal", "-shm"))):
        if each.exists():
            os.link(each, aside / each.name)
    sync(aside)
    for suffix in ("-wal", "-shm", ""):
        path.with_name(f"{path.name}{suffix}").unlink(missing_ok=True)
    sync(data)
    return aside


def _tell(data: Path, source: str, target: str, aside: Path | None) -> None:
    from action_assistant.editor.log import database_location

    if target.startswith("sqlite:"):
        print(f"The graphs of {data} are in the folder itself now; start it without --database.")
        print(
            f"{database_location.shown(source)} is as it was; nothing of this folder uses it any more."
        )
    else:
        shown = database_location.shown(target)
        print(f"The graphs of {data} are in {shown} now; start it with --database {shown}.")
    if aside is not None:
        print(f"The file that was in the folder is in {aside}, as it was.")
