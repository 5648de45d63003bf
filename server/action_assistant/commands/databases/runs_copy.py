"""Copies the runner's events and tables into a Postgres schema, for a team's own queries.

The runner's journal stays the truth and knows nothing of it. Events are copied once each, by stream and
seq, in the order of the log, so that whatever ends this, the next time goes on where it was.
"""

import asyncio
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, TypeVar

import asyncpg  # type: ignore[import-untyped]
from sqlalchemy import (
    BigInteger,
    Column,
    Connection,
    LargeBinary,
    MetaData,
    Table,
    Text,
    func,
    select,
    text,
)
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.exc import DBAPIError
from sqlalchemy.ext.asyncio import AsyncEngine

from action_assistant.commands.backups.progress import Progress
from action_assistant.errors import CannotStart, Refused, Unavailable
from action_assistant.journal.database import cause_of
from action_assistant.journal.events import Event
from action_assistant.journal.reader import FileJournalReader
from action_assistant.runner.archives.archive_store import ArchiveStore
from action_assistant.schema.runner_tables import RUNNER, review, run, runner_event
from action_assistant.web.workers.lanes import run_here

T = TypeVar("T")

_PAGE: Final = 500  # events in a transaction
_PAUSE: Final = 1.0  # seconds between two queries
_AWAY: Final = 10.0  # seconds between attempts while the database is away
_FAULTS: Final = (DBAPIError, asyncpg.PostgresError, asyncpg.InterfaceError, OSError)
#: The schema of Postgres that holds the copies.
SCHEMA: Final = "action_assistant_runs"
_COPY: Final = MetaData(schema=SCHEMA)
#: The events, with what they say as bytes; a view beside it has it as JSON.
_event: Final = Table(
    "event",
    _COPY,
    Column("stream", Text, primary_key=True),
    Column("seq", BigInteger, primary_key=True, autoincrement=False),
    Column("kind", Text, nullable=False),
    Column("author", Text, nullable=False),
    Column("at", BigInteger, nullable=False),
    Column("body", LargeBinary, nullable=False),
    Column("position", BigInteger, nullable=False, unique=True),
    Column("chain", LargeBinary),
)
#: Tables that follow from events, as the runner has them. Of these with a run, the rows of a run.
_FOLDS: Final = {
    name: RUNNER.tables[name].to_metadata(_COPY, schema=SCHEMA)
    for name in ("run", "review", "run_label", "action_sum", "robot")
}
_VIEW: Final = f"""
CREATE OR REPLACE VIEW {SCHEMA}.run_event AS
SELECT substr(stream, 5) AS run, seq, kind, author, to_timestamp(at / 1e6) AS time,
       convert_from(body, 'UTF8')::json AS data
FROM {SCHEMA}.event WHERE stream LIKE 'run/%'
"""


async def once(copier: "RunsCopier", name: str) -> int:
    """Copy the events that are new, close the copier, and return the exit code: 1 if archives are
    missing. `name`: the name of the database, for messages. Raise CannotStart if a database cannot
    be used."""
    try:
        copied = await copier.catch_up()
    except _FAULTS as error:
        raise CannotStart(f"The database {name} cannot be used: {cause_of(error)}.") from error
    finally:
        await copier.close()
    print(f"{copied} events copied; the schema {SCHEMA} is as the log is now")
    for each in copier.missing:
        print(f"missing: {each}", file=sys.stderr)
    return 1 if copier.missing else 0


async def followed(copier: "RunsCopier") -> int:
    """Copy new events again and again, and wait and retry while the database is away. It runs
    until it is cancelled, and then closes `copier`."""
    away = False
    try:
        while True:
            try:
                copied = await copier.catch_up()
            except _FAULTS as error:
                if not away:
                    _say(f"the database is away ({cause_of(error)}); going on when it is there")
                away = True
            except Unavailable as error:
                _say(error.detail)
            else:
                if away or copied:
                    _say(f"{copied} events copied")
                away = False
            await asyncio.sleep(_AWAY if away else _PAUSE)
    finally:
        await copier.close()


class RunsCopier:
    """Copies the runner's log into another database, for other programs to read. `missing`: runs
    whose archive is not there."""

    def __init__(self, path: Path, kept: Path, engine: AsyncEngine, progress: Progress) -> None:
        self.missing: list[str] = []
        self._log = FileJournalReader(path)
        # Only `pieces` and `read` are called here, which need no more than this reader has.
        self._archives = ArchiveStore(self._log, kept, run_here)  # type: ignore[arg-type]
        self._engine = engine
        self._progress = progress
        self._prepared = False

    async def catch_up(self) -> int:
        """Copy the events that are not in the copy yet, and return their number. Raise CannotStart
        if the copy is of another log, Unavailable if the log cannot be read, and errors of the
        driver as they are."""
        if not self._prepared:
            await self._do(_prepare)
            await self._archived()
            self._prepared = True
        copied, last = 0, await self._do(_last)
        await self._check(last)
        while events := await self._log.read_all(after=last, limit=_PAGE):
            chains = await self._log.query(
                select(runner_event.c.position, runner_event.c.chain).where(
                    runner_event.c.position.in_([each.position for each in events])
                )
            )
            await self._store(events, {row.position: row.chain for row in chains})
            copied, last = copied + len(events), events[-1].position
            self._progress.tell(f"{copied} events copied")
        await self._summed()
        self._progress.end()
        return copied

    async def close(self) -> None:
        """Close all connections to the copy's database."""
        await self._engine.dispose()

    async def _do(self, work: Any, *values: Any) -> Any:
        async with self._engine.begin() as connection:
            return await connection.run_sync(work, *values)

    async def _check(self, last: int) -> None:
        """Raise CannotStart unless the copy, whose last event has the position `last`, is a copy
        of this log, or if the log ends before `last`. Events of archived runs are removed from the
        log, so only the newest event up to `last` that the log still has is compared; if it has
        none, nothing is."""
        chosen = select(runner_event.c.position, runner_event.c.chain)
        chosen = chosen.where(runner_event.c.position <= last)
        rows = await self._log.query(chosen.order_by(runner_event.c.position.desc()).limit(1))
        if last > await self._log.position():
            raise CannotStart(_another("the log has gone back, as after a restore"))
        for row in rows:
            if await self._do(_chain_at, row.position) != bytes(row.chain):
                raise CannotStart(_another(f"event {row.position} is another one"))

    async def _store(self, events: Sequence[Event], chains: dict[int, bytes]) -> None:
        """Store events and the rows of their runs in one transaction. `chains`: the hash chain at
        each event, by position."""
        runs = {name for each in events if (name := _run_of(each.stream))}
        rows = await self._rows(sorted(runs))
        rows["robot"] = [
            row._asdict() for row in await self._log.query(select(RUNNER.tables["robot"]))
        ]
        await self._do(_write, events, chains, sorted(runs), rows)

    async def _rows(self, runs: Sequence[str]) -> dict[str, list[dict[str, Any]]]:
        found = {}
        for name in ("run", "review", "run_label", "action_sum"):
            table = RUNNER.tables[name]
            key = table.c.id if name == "run" else table.c.run
            chosen = select(table).where(key.in_(runs))
            found[name] = [row._asdict() for row in await self._log.query(chosen)]
        return found

    async def _summed(self) -> None:
        """Update the rows of runs whose review was computed after their last event."""
        behind = await self._do(_not_summed)
        for start in range(0, len(behind), _PAGE):
            some = behind[start : start + _PAGE]
            chosen = select(review.c.run).where(review.c.run.in_(some), review.c.summed)
            runs = [row.run for row in await self._log.query(chosen)]
            if runs:
                await self._do(_write, [], {}, runs, await self._rows(runs))

    async def _archived(self) -> None:
        """Copy the runs that were archived before the copy began, from their archives."""
        chosen = select(run.c.id, run.c.number).where(run.c.archived_as.is_not(None))
        there = await self._do(_streams)
        for row in await self._log.query(chosen.order_by(run.c.number)):
            stream = f"run/{row.id}"
            if stream in there:
                continue
            try:
                pieces = await self._archives.pieces(row.id)
                events = [
                    event
                    for each in (row.id, *pieces)
                    for event in await self._archives.read(f"run/{each}")
                ]
            except Refused as error:
                self.missing.append(error.detail)
                continue
            await self._do(_write, events, {}, [row.id], await self._rows([row.id]))
            self._progress.tell(f"run {row.number} copied from its archive")


def _prepare(connection: Connection) -> None:
    connection.execute(text("SELECT pg_advisory_xact_lock(7205759404)"))
    connection.execute(text(f"CREATE SCHEMA IF NOT EXISTS {SCHEMA}"))
    _COPY.create_all(connection)
    connection.execute(text(_VIEW))


def _last(connection: Connection) -> int:
    """Return the position up to which the copy has the log; 0 without events. Events from archives
    do not count."""
    chosen = select(func.max(_event.c.position)).where(_event.c.chain.is_not(None))
    return int(connection.execute(chosen).scalar() or 0)


def _chain_at(connection: Connection, position: int) -> bytes | None:
    found = connection.execute(select(_event.c.chain).where(_event.c.position == position)).scalar()
    return None if found is None else bytes(found)


def _streams(connection: Connection) -> set[str]:
    return set(connection.scalars(select(_event.c.stream).distinct()))


def _not_summed(connection: Connection) -> list[str]:
    table = _FOLDS["review"]
    return list(connection.scalars(select(table.c.run).where(table.c.summed.is_(False))))


def _write(
    connection: Connection,
    events: Sequence[Event],
    chains: dict[int, bytes],
    runs: Sequence[str],
    rows: dict[str, list[dict[str, Any]]],
) -> None:
    """Insert the events that the copy lacks, and replace the rows of these runs. `chains`: the hash
    chain at each event, by position."""
    if events:
        values = [
            {name: getattr(each, name) for name in Event.__struct_fields__}
            | {"chain": chains.get(each.position)}
            for each in events
        ]
        connection.execute(insert(_event).on_conflict_do_nothing(), values)
    for name, some in rows.items():
        table = _FOLDS[name]
        if name != "robot":
            key = table.c.id if name == "run" else table.c.run
            connection.execute(table.delete().where(key.in_(runs)))
        else:
            connection.execute(table.delete())
        if some:
            connection.execute(table.insert(), [_storable(row) for row in some])


def _storable(row: dict[str, Any]) -> dict[str, Any]:
    """Return a row with each NUL in its texts replaced, since Postgres cannot store it; the event
    keeps it."""
    return {
        name: value.replace("\0", "\ufffd") if isinstance(value, str) else value
        for name, value in row.items()
    }


def _run_of(stream: str) -> str | None:
    top, _, name = stream.partition("/")
    return name if top in {"run", "about"} and name else None


def _another(why: str) -> str:
    return (
        f"The schema {SCHEMA} is a copy of another log: {why}. DROP SCHEMA {SCHEMA} CASCADE, and copy "
        "anew; or name another database."
    )


def _say(words: str) -> None:
    sys.stderr.write(f"action-assistant: {words}\n")
    sys.stderr.flush()
