"""The databases of graphs and runs: that they are there, of this version, sound, and nobody else's.

Files are looked at without opening them for writing, and of the events the newest: `verify` looks at all.
"""

import shutil
import socket
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, Final

import anyio
import asyncpg  # type: ignore[import-untyped]
import msgspec
from sqlalchemy import Connection, func, inspect, make_url, select, text
from sqlalchemy.exc import DBAPIError

from action_assistant.commands.doctor.installation import Installation
from action_assistant.editor.log import database_location
from action_assistant.editor.log.epochs import MARK, marked
from action_assistant.errors import AnothersDatabase, CannotStart, NewerSchema
from action_assistant.journal.chain import NOTHING, Head, link
from action_assistant.journal.copies import before_upgrade
from action_assistant.journal.database import Database, cause_of
from action_assistant.journal.databases import ask_once, database_of
from action_assistant.journal.events import Event
from action_assistant.journal.failover import failover_of, hosts_of
from action_assistant.journal.migrate import recognize, revisions_of, steps_after
from action_assistant.journal.postgres import weakness
from action_assistant.journal.slots import ends_of_slots, newest_in, slot_of
from action_assistant.schema.editor_tables import editor_event, editor_head, graph
from action_assistant.system.diagnostics import Diagnostic, fine, found

_PASSWORD: Final = (
    asyncpg.InvalidPasswordError,
    asyncpg.InvalidAuthorizationSpecificationError,
)


def fault(url: str, error: Exception) -> Diagnostic:
    """Return the diagnostic for a database that could not be asked, by its error. `url` has no
    password."""
    host = " or ".join(hosts_of(make_url(url))) or "this computer"
    causes = [*_causes(error)]
    if any(isinstance(each, socket.gaierror) for each in causes):
        return found(
            "database-host-unknown",
            url,
            f"The host {host} of the database is unknown: no name server knows an address of it.",
            "Correct the name in --database or ACTION_ASSISTANT_DATABASE; in compose it is the name of "
            "the service, and only containers of its network know it.",
        )
    if any(isinstance(each, _PASSWORD) for each in causes):
        return found(
            "database-password",
            url,
            f"The database refuses us: {cause_of(error)}.",
            "Give the right user and password in ACTION_ASSISTANT_DATABASE, PGPASSWORD or ~/.pgpass; "
            "a folder never remembers a password.",
        )
    if any(isinstance(each, asyncpg.InvalidCatalogNameError) for each in causes):
        return found(
            "database-absent",
            url,
            f"The server {host} answers, but has no such database: {cause_of(error)}.",
            "Correct its name, or create it (`createdb`) and restore a backup into it.",
        )
    why = "it does not answer in time" if isinstance(error, TimeoutError) else cause_of(error)
    return found(
        "database-unreachable",
        url,
        f"The database cannot be asked: {why}.",
        "Start its server, or open the way to it (port, firewall, pg_hba.conf); the graphs are there.",
    )


def _causes(error: BaseException) -> Iterator[BaseException]:
    """Yield an error and all its causes and contexts."""
    waiting: list[BaseException | None] = [error]
    seen: list[BaseException] = []
    while waiting:
        each = waiting.pop()
        if each is None or each in seen:
            continue
        seen.append(each)
        yield each
        waiting += [each.__cause__, each.__context__]
        if isinstance(each, DBAPIError):
            waiting.append(each.orig)


_EVENTS: Final = 2000
_SECONDS: Final = 1.5
_TYPES: Final = (str, int, str, str, int, bytes, int, bytes)
_event, _head = editor_event.c, editor_head.c  # both databases have these tables


def newest_at(connection: Connection) -> int | None:
    """Return when the newest events in a database were written, in microseconds since 1970; None
    without events."""
    found: list[int] = []
    for end in ends_of_slots(connection, _event.position):
        newest = select(_event.at).where(_event.position <= end)
        rows = connection.execute(newest.order_by(_event.position.desc()).limit(50))
        found += [row.at for row in rows if type(row.at) is int]
    return max(found, default=None)


def oldest_at(connection: Connection) -> int | None:
    """Return when the first event in a database was written, in microseconds since 1970; None
    without events."""
    oldest = select(_event.at).order_by(_event.position).limit(1)
    return connection.execute(oldest).scalar()


def has_events(connection: Connection) -> bool:
    """Return whether a database has any stored event."""
    if not inspect(connection).has_table(editor_event.name):
        return False
    return connection.execute(select(_event.position).limit(1)).first() is not None


def first_damage(database: Database, connection: Connection) -> str:
    """Return a clause about damage among the newest events of a database; "" if none is found. The
    search covers some thousand events and ends after two seconds at most."""
    until = time.monotonic() + _SECONDS
    heads: dict[str, Head] = {}
    after = _last(connection) - _EVENTS
    while time.monotonic() < until:
        rows, further = database.scan(connection, after)
        for row in rows:
            if wrong := _wrong(connection, heads, row):
                return wrong
        if not rows or further == after:
            return _wrong_ends(connection, heads)
        after = further
    return ""


def _last(connection: Connection) -> int:
    """Return the last position for `Database.scan`: the row id in a file, the event's position on a
    server; 0 without events."""
    if connection.dialect.name == "sqlite":
        return connection.execute(text("SELECT max(rowid) FROM event NOT INDEXED")).scalar() or 0
    return connection.execute(select(func.max(_event.position))).scalar() or 0


def _wrong(connection: Connection, heads: dict[str, Head], row: Sequence[Any]) -> str:
    """Return a clause about what is wrong with the stored event in `row`, compared with the one
    before it; "" if it is sound. `heads`: the end of each stream so far (number and hash), which is
    updated."""
    stream, seq = row[0], row[1]
    if tuple(map(type, row)) != _TYPES:
        return f"one of {stream!r} holds values of the wrong kind"
    before = heads.get(stream) or _before(connection, stream, seq)
    heads[stream] = Head(seq, row[7])
    if before is None:
        return ""
    if seq != before.seq + 1:
        return f"of {stream}, {seq} stands in the place of {before.seq + 1}"
    if row[7] != link(before.chain, Event(*row[:7])):
        return f"event {seq} of {stream} was altered"
    return ""


def _before(connection: Connection, stream: str, seq: int) -> Head | None:
    """Return the end of a stream (number and hash) before its event `seq`; None if the previous
    event is not in the database."""
    if seq == 1:
        return NOTHING
    chosen = select(_event.chain).where(_event.stream == stream, _event.seq == seq - 1)
    chain = connection.execute(chosen).scalar()
    return None if chain is None else Head(seq - 1, bytes(chain))


def _wrong_ends(connection: Connection, heads: dict[str, Head]) -> str:
    """Return a clause about a stream whose stored end differs from that of its events; "" if none
    does. `heads`: the end of each stream by its events."""
    names = list(heads)[:500]
    chosen = select(_head.stream, _head.seq, _head.chain).where(_head.stream.in_(names))
    for row in connection.execute(chosen):
        if Head(row.seq, bytes(row.chain)) != heads[row.stream]:
            return f"{row.stream} is written down to end at {row.seq}, and ends at {heads[row.stream].seq}"
    return _cut_off(connection)


def _cut_off(connection: Connection) -> str:
    """Return a clause about a stream of the editor whose last event is missing; "" if there is
    none. Streams of runs are not checked, since they may be in archives."""
    if not inspect(connection).has_table(graph.name):
        return ""
    last = select(_event.seq).where(_event.stream == _head.stream, _event.seq == _head.seq)
    found = connection.execute(
        select(_head.stream, _head.seq).where(~last.exists()).limit(1)
    ).first()
    return (
        f"{found.stream} is written down to end at {found.seq}, which is missing" if found else ""
    )


_PATIENCE_S: Final = 6.0
_CLOCK_S: Final = 120.0  # by which an event may lie in the future
_NEWER: Final = (
    "Install that version again, or restore a backup of before the upgrade into an empty folder."
)


def graphs_are_there(place: Installation) -> Iterator[Diagnostic]:
    """Check whether the database of graphs is there and can be read: the one that `place` names, or
    else the one that the data folder remembers. Yield what is wrong, or one result that says that
    all is well."""
    data = place.data
    try:
        url = place.database or database_location.of(data)
        database_of(url)
    except CannotStart as error:
        lost = (data / MARK).exists() and not place.database
        yield found(
            "database-lost" if lost else "database-url",
            data,
            str(error),
            "Name the database by --database URL, or restore a backup into an empty folder.",
        )
        return
    if not url.startswith("sqlite:"):
        yield from _on_server(data, url)
        return
    file = Path(make_url(url).database or "")
    if file.exists():
        yield from _in_file("graphs", file, data)
    elif database_location.remembered(data) or _holds_events(data / "runner.db"):
        yield found(
            "database-lost",
            file,
            "The database of graphs is gone, though this folder was served with it.",
            "Put the file back or restore a backup; if the graphs are in another database, name it by "
            "--database URL. A start without them begins with an empty catalogue.",
        )
    else:
        yield fine(file, "There are no graphs yet; serve makes the database.")


def runs_are_there(place: Installation) -> Iterator[Diagnostic]:
    """Check the runner's database, the file `runner.db` in the data folder of `place`. Yield an
    error if the file is missing although archives or recordings of runs exist, and what is wrong in
    the file if it exists."""
    file = place.data / "runner.db"
    left = [place.data / name for name in ("archive", "recordings")]
    if file.exists():
        yield from _in_file("runs", file, place.data)
    elif any(each.is_dir() and any(each.iterdir()) for each in left):
        yield found(
            "database-lost",
            file,
            "The database of runs is gone, though archives or recordings of runs are here.",
            "Put the file back or restore a backup: a start without it has no robots and no runs.",
        )
    else:
        yield fine(file, "There are no runs yet; serve makes the database.")


class _DatabaseFindings(msgspec.Struct):
    """The results of one examination of a database. `damage`: a clause, "" for none; `newest`: when
    the newest event was written (microseconds since 1970); `weak`: why nothing may be written, ""
    for no reason; `older`: the revision of its tables, that of this program, and the bytes that it has,
    where these differ; `lacks`: events that the data folder has seen are missing."""

    damage: str = ""
    older: tuple[str, str, int] | None = None
    newest: int | None = None
    weak: str = ""
    lacks: bool = False


def _holds_events(file: Path) -> bool:
    """Return whether the journal in a SQLite file has events; False where it cannot be read, which
    another check reports."""
    held: list[bool] = []
    try:
        database_of(f"sqlite:///{file}").look(lambda each: held.append(has_events(each)))
    except CannotStart:
        return False
    return any(held)


def _in_file(what: str, file: Path, data: Path) -> Iterator[Diagnostic]:
    database = database_of(f"sqlite:///{file}")
    seen = _DatabaseFindings()
    try:
        database.look(lambda connection: _examine(database, connection, seen))
    except CannotStart as error:
        yield _refused(file, error)
        return
    problems = [*_upgrade(file, data, seen), *_events(what, file, seen)]
    yield from problems
    if not problems:
        yield fine(file, f"The database of {what} can be read; its newest events are sound.")


def _examine(database: Database, connection: Connection, seen: _DatabaseFindings) -> None:
    """Look for damage, the newest event and older tables in the database behind `connection`, and write all
    into `seen`; an empty database leaves `seen` as it is. Raise CannotStart for a database of
    another program or of a newer version."""
    current = max(recognize(connection), default="")
    if current:
        seen.older = _older(database, connection, current)
        seen.damage = first_damage(database, connection)
        seen.newest = newest_at(connection)


def _older(database: Database, connection: Connection, current: str) -> tuple[str, str, int] | None:
    """Return `current` (the revision of the tables), that of this program, and the bytes of the
    database; None if both are the same."""
    ours = revisions_of(current.partition("_")[0])[-1]
    if current == ours:
        return None
    return current, ours, sum(database.bytes_in_use(connection).values())


def copies_fit(place: Installation) -> Iterator[Diagnostic]:
    """Check that there is room for the copies of both databases together, which the next start
    makes before it changes their tables. Yield the result; nothing where one of them cannot
    be read, which the checks of the databases report."""
    data, sizes, is_known = place.data, list[int](), True

    def look(database: Database, connection: Connection) -> None:
        current = max(recognize(connection), default="")
        if current and (older := _older(database, connection, current)):
            sizes.append(older[2])

    for url in _databases(place):
        database = database_of(url)
        question = partial(look, database)
        try:
            if database.is_local:
                database.look(question)
            else:
                ask_once(url, question)
        except (CannotStart, TimeoutError):
            is_known = False
    where = data / before_upgrade.FOLDER
    if not is_known:  # what it needs is not known; the checks of the databases say why
        return
    if not sizes:
        yield fine(where, "The next start changes no tables, and makes no copy.")
        return
    needed, free = sum(sizes) + before_upgrade.ROOM, _bytes_left(data)
    says = (
        f"The next start copies {max(1, sum(sizes) >> 20)} MiB there before it changes tables; with "
        f"what has to stay free it needs {needed >> 20} MiB, and {free >> 20} MiB are left"
    )
    if needed > free:
        yield found("schema-room", where, f"{says}.", "Make room before you start it.")
    else:
        yield fine(where, f"{says}.")


def _bytes_left(folder: Path) -> int:
    above = next(each for each in (folder, *folder.absolute().parents) if each.exists())
    return shutil.disk_usage(above).free


def _databases(place: Installation) -> Iterator[str]:
    """Yield the URLs of the databases of graphs and runs that are there."""
    with suppress(CannotStart):
        url = place.database or database_location.of(place.data)
        database_of(url)
        if not url.startswith("sqlite:") or Path(make_url(url).database or "").exists():
            yield url
    if (place.data / "runner.db").exists():
        yield f"sqlite:///{place.data / 'runner.db'}"


def _refused(where: object, error: CannotStart) -> Diagnostic:
    if isinstance(error, NewerSchema):
        return found("schema-newer", where, str(error), _NEWER)
    if isinstance(error, AnothersDatabase):
        return found(
            "database-foreign", where, str(error), "Choose another data folder, or database."
        )
    return found(
        "database-unreadable",
        where,
        str(error),
        "Mend the rights of the file if they are the reason; else restore a backup.",
    )


def _upgrade(where: object, data: Path, seen: _DatabaseFindings) -> Iterator[Diagnostic]:
    """Yield what the next start does to tables of an earlier version. `data`: the data folder, which
    gets the copy."""
    if seen.older is None:
        return
    current, ours, size = seen.older
    steps = ", ".join(steps_after(current.partition("_")[0], current))
    says = (
        f"Its tables are those of {current}; the next start changes them to {ours} ({steps}), after a copy of "
        f"{max(1, size >> 20)} MiB into {data / before_upgrade.FOLDER}"
    )
    free = _bytes_left(data)
    if size + before_upgrade.ROOM > free:
        needs = (
            f"which needs {(size + before_upgrade.ROOM) >> 20} MiB, and {free >> 20} MiB are left"
        )
        yield found("schema-room", where, f"{says}, {needs}.", "Make room before you start it.")
    else:
        yield found(
            "schema-older",
            where,
            f"{says}, for which there is room.",
            "Make a backup before, and start it once no robot moves.",
        )


def _events(what: str, where: object, seen: _DatabaseFindings) -> Iterator[Diagnostic]:
    """Yield the faults of the newest events by `seen`, the results of an examination. `what`,
    `where`: the contents and the address of the database, for the message."""
    if seen.damage:
        yield found(
            "events-damaged",
            where,
            f"Stored events of {what} are not what was written: {seen.damage}.",
            "Run `action-assistant verify` for all that is damaged, and restore the last backup that "
            "is sound; what is not damaged stays readable.",
        )
    ahead = (seen.newest or 0) / 1e6 - time.time()
    if ahead > _CLOCK_S:
        yield found(
            "clock-wrong",
            where,
            f"The newest events of {what} are {span(ahead)} in the future: the clock of this computer "
            "is behind, or was ahead when they were written.",
            "Set the clock (`timedatectl set-ntp true`): histories of runs are dated by it.",
        )


def span(seconds: float) -> str:
    """Return a time in seconds, without its sign, as text, for example `90 s` or `5 min`."""
    if abs(seconds) < 120:
        return f"{abs(seconds):.0f} s"
    return f"{abs(seconds) / 60:.0f} min" if abs(seconds) < 7200 else f"{abs(seconds) / 3600:.0f} h"


def _on_server(data: Path, url: str) -> Iterator[Diagnostic]:
    """Check that the database `url` on a server answers, stores commits durably, and has the graphs
    of the data folder. Yield the findings."""
    shown = database_location.shown(url)
    database = database_of(url)
    try:
        seen = anyio.run(_asked, url, database, data)
    except (NewerSchema, AnothersDatabase) as error:
        yield _refused(shown, error)
        return
    except (TimeoutError, CannotStart) as error:
        yield fault(shown, error)
        return
    except database.faults as error:
        yield fault(shown, error)
        return
    problems = [*_upgrade(shown, data, seen), *_events("graphs", shown, seen)]
    if seen.lacks:
        problems.append(
            found(
                "database-lost",
                shown,
                f"The database answers, but lacks the graphs that {data} has seen in it.",
                "Name the right database by --database URL, or restore a backup into an empty one.",
            )
        )
    if seen.weak:
        problems.append(
            found(
                "database-unsafe",
                shown,
                f"No editor writes to this database: {seen.weak}.",
                "Change that in its postgresql.conf (or Patroni's settings), and reload it.",
            )
        )
    yield from problems
    if not problems:
        yield fine(shown, "The database answers, and keeps what it confirms.")


async def _asked(url: str, database: Database, data: Path) -> _DatabaseFindings:
    """Examine the database `url` on a server without changing it, and return the results. `data`: the
    data folder. Raise its driver's errors or TimeoutError if it does not answer, CannotStart for a
    database of another program."""
    seen = _DatabaseFindings()
    failover, _ = failover_of(make_url(url))

    def question(connection: Connection) -> None:
        seen.weak = weakness(connection, failover)
        seen.lacks = not _holds_mark(connection, data)
        _examine(database, connection, seen)

    try:
        with anyio.fail_after(_PATIENCE_S):
            await database.at_one_moment(question)
    finally:
        await database.close()
    return seen


def _holds_mark(connection: Connection, data: Path) -> bool:
    """Return whether the database has all events that the data folder `data` has seen; True where
    the folder has seen none."""
    mark = marked(data / MARK)
    if mark is None or mark.position == 0:
        return True
    if not inspect(connection).has_table(editor_event.name):
        return False
    newest = newest_in(editor_event.c.position, slot_of(mark.position))
    return int(connection.execute(newest).scalar_one()) >= mark.position
