"""A journal in a Postgres database: asyncpg writes, SQLAlchemy asks and makes the tables."""

import asyncio
import hashlib
import os
import secrets
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Any, Final, TypeVar

import asyncpg  # type: ignore[import-untyped]
from sqlalchemy import URL, Connection, NullPool, func, make_url, select
from sqlalchemy.exc import DBAPIError, SQLAlchemyError
from sqlalchemy.ext.asyncio import AsyncConnection, AsyncEngine
from sqlalchemy.util import await_only

from action_assistant.errors import CannotStart
from action_assistant.journal.chain import Head
from action_assistant.journal.database import Before, Branch, Overtaken, cause_of, no_copy
from action_assistant.journal.events import Event
from action_assistant.journal.failover import (
    IDENTITY,
    Failover,
    Primary,
    Watch,
    engine_of,
    failover_of,
    hosts_of,
)
from action_assistant.journal.migrate import kept_as_it_is, only_expands, upgrade_to
from action_assistant.journal.slots import SLOTS, ends_of_slots, slot_of
from action_assistant.schema.editor_tables import editor_event

T = TypeVar("T")

_READERS: Final = 3  # connections
_PAGE: Final = 500
_CONNECT: Final = 5.0  # seconds for a connection to come up
_ANSWER: Final = 30.0  # seconds for a statement; after that the connection counts as dead
_HANDOVER: Final = 3.0  # seconds until a server has ended the connections of a process that died
_READ_ONLY: Final = "transaction_read_only"
#: Settings without which an acknowledged commit may be lost, and the error where they are missing.
_SETTINGS: Final = {
    "fsync": ({"on"}, "it does not write commits to the disk"),
    "full_page_writes": ({"on"}, "a power cut would tear its pages"),
    "synchronous_commit": (
        {"on", "local", "remote_write", "remote_apply"},
        "it confirms commits that it may lose",
    ),
    "server_encoding": ({"UTF8"}, "it cannot hold every text"),
    _READ_ONLY: ({"off"}, "it is a read-only copy"),
}
#: One statement that inserts events if each of their streams still ends where the writer read its end, in
#: the same epoch where it has one, and moves those ends. If one does not, the column `position`, which is
#: never null, would become null: the server refuses the whole statement, and nothing is written (decision
#: 150). In a shared database it locks the ends in one order, so that writers do not deadlock.
_STORE_TEXT: Final = """
WITH known AS (
    SELECT * FROM unnest($9::text[], $10::bigint[], $11::bytea[], $12::bigint[], $13::bytea[]{epochs})
        AS k (stream, seq, chain, old_seq, old_chain{epoch})
), {held}begun AS (
    INSERT INTO head (stream, seq, chain)
    SELECT stream, seq, chain FROM known WHERE old_seq = 0 ORDER BY stream
    ON CONFLICT (stream) DO NOTHING
    RETURNING stream
), moved AS (
    UPDATE head SET seq = k.seq, chain = k.chain FROM {ends}
    WHERE head.stream = k.stream AND (head.seq, head.chain) = (k.old_seq, k.old_chain){is_same}
    RETURNING head.stream
)
INSERT INTO event (stream, seq, kind, author, at, body, position, chain)
SELECT e.stream, e.seq, e.kind, e.author, e.at, e.body,
       CASE WHEN (SELECT count(*) FROM begun) + (SELECT count(*) FROM moved) = $14
            THEN e.position END,
       e.chain
FROM unnest($1::text[], $2::bigint[], $3::text[], $4::text[], $5::bigint[],
            $6::bytea[], $7::bigint[], $8::bytea[])
    AS e (stream, seq, kind, author, at, body, position, chain)
"""
_HOLD: Final = "SELECT stream FROM head WHERE stream = ANY({0}) ORDER BY stream FOR UPDATE"
_STORE: Final = _STORE_TEXT.format(epochs="", epoch="", held="", ends="known k", is_same="")
_STORE_SHARED: Final = _STORE_TEXT.format(
    epochs=", $15::bigint[]",
    epoch=", epoch",
    held=f"held AS ({_HOLD.format('$9::text[]')}), ",
    ends="held JOIN known k USING (stream)",
    is_same=" AND head.epoch = k.epoch",
)
#: A commit that waits for the replica: once it is confirmed, the replica has all that came before, also a
#: commit whose wait ended with its connection, and that would be lost in a failover (decision 168).
_BARRIER: Final = "SELECT pg_logical_emit_message(true, 'action-assistant', '')"
_PRIMARY: Final = f"SELECT current_setting('synchronous_standby_names'), {IDENTITY}"
#: Commits that a failover keeps: they wait for the replica's disk.
_KEPT: Final = frozenset({"on", "remote_apply"})
#: Connections of an earlier session of this process that the server has not ended yet.
_OLD: Final = (
    "SELECT count(*) FROM pg_stat_activity WHERE application_name = $1 AND pid <> pg_backend_pid()"
)
#: The first number of the locks of slots; the second one is the slot.
SLOT_LOCKS: Final = (
    int.from_bytes(hashlib.sha256(b"action-assistant slots").digest()[:4], "big") >> 1
)
#: Locks of slots that are held now.
_HELD: Final = (
    "FROM pg_locks WHERE locktype = 'advisory' AND granted AND objsubid = 2"
    f" AND classid = {SLOT_LOCKS}"
    " AND database = (SELECT oid FROM pg_database WHERE datname = current_database())"
)
_EDITORS: Final = f"SELECT count(*) {_HELD}"
#: The condition that a session holds a slot, to be formatted with the slot.
HELD_SLOT: Final = f"EXISTS (SELECT 1 {_HELD} AND objid = ({{}})::oid)"
#: Levels of messages at which a commit tells that its wait for the replica was cancelled.
_WARNING: Final = frozenset(
    {"debug5", "debug4", "debug3", "debug2", "debug1", "log", "notice", "warning"}
)
_END_OLD: Final = """
SELECT pg_terminate_backend(pid) FROM pg_stat_activity
WHERE application_name = $1 AND pid <> pg_backend_pid()
"""
#: While others are beside, a change of tables waits this long for a table: their queries wait behind it, and
#: an editor that stores no beat for 1.5 s closes its rooms (decision 174).
_TABLE_WAIT: Final = "SET LOCAL lock_timeout = '500ms'"
_TRIES: Final = 8  # of such a change
_PAUSE: Final = 1.0  # seconds between two, in which the others go on
#: SQLSTATE of a statement that waited for a lock for longer than `lock_timeout`.
_LOCKED: Final = "55P03"
#: SQLSTATE of a deadlock, and of a transaction that others have overtaken.
_RACES: Final = ("40P01", "40001")
#: SQLSTATE classes that speak of the server: connection, resources, operator, system, internal.
_SERVER: Final = ("08", "53", "57", "58", "XX", "25", "F0")


class PostgresSession:
    """The connection that writes, on an event loop of its own that only runs inside `run`."""

    connection: Connection

    def __init__(
        self,
        engine: AsyncEngine,
        begin: Callable[[Any], Awaitable[Watch | None]],
        *,
        is_shared: bool = False,
    ) -> None:
        self.is_shared: Final = is_shared
        self.slot = 0
        self._engine = engine
        self._watch: Watch | None = None
        self._warned = ""
        self._loop = asyncio.new_event_loop()
        self._open: AsyncConnection | None = None
        self._raw: Any = None
        try:
            self._loop.run_until_complete(self._connect(begin))
        except BaseException:
            self.close()
            raise

    async def _connect(self, begin: Callable[[Any], Awaitable[Watch | None]]) -> None:
        self._open = await self._engine.connect()
        self._raw = (await self._open.get_raw_connection()).driver_connection
        self._raw.add_log_listener(self._hear_warning)
        self._watch = await begin(self._raw)
        self._check()
        sync = self._open.sync_connection
        assert sync is not None
        self.connection = sync

    def run(self, work: Callable[[], T]) -> T:
        assert self._open is not None
        return self._loop.run_until_complete(self._open.run_sync(lambda _: work()))

    def alive(self) -> bool:
        self._loop.run_until_complete(_hear())
        return not self._raw.is_closed() and not (self._watch is not None and self._watch.doubt)

    def begin(self) -> None:
        """Open a transaction on the server, for this session."""
        self.say("BEGIN")

    def say(self, command: str) -> None:
        """Execute a command of SQL without a result."""
        await_only(self._raw.execute(command))
        self._check()

    def _hear_warning(self, _: object, message: Any) -> None:
        if message.severity_en == "WARNING":
            self._warned = str(message)

    def _check(self) -> None:
        """Raise Unfit if what was just confirmed is in doubt. A commit whose wait for the replica was
        cancelled succeeds with a warning, in the language of the server."""
        if self._watch is not None and (doubt := self._warned or self._watch.doubt):
            raise Unfit(doubt)

    def store(
        self,
        events: Sequence[tuple[Event, bytes]],
        known: Mapping[str, Head],
        epochs: Mapping[str, int],
    ) -> None:
        """Write events, each with its link of the hash chain, and the new end of each stream (the
        number and link of its last event). If no transaction is open, this is one of its own. Raise
        Overtaken if a stream does not end where `known` says, has another epoch in a shared database,
        or a position is taken."""
        columns = [(e.stream, e.seq, e.kind, e.author, e.at, e.body, e.position) for e, _ in events]
        values = [list(column) for column in zip(*columns, strict=True)]
        heads = {event.stream: Head(event.seq, chain) for event, chain in events}
        old = [known[stream] for stream in heads]
        ends = [[end.seq for end in ends] for ends in (heads.values(), old)]
        links = [[end.chain for end in ends] for ends in (heads.values(), old)]
        shared = ([epochs[stream] for stream in heads],) if self.is_shared else ()
        try:
            await_only(
                self._raw.execute(
                    _STORE_SHARED if self.is_shared else _STORE,
                    *values,
                    [chain for _, chain in events],
                    list(heads),
                    ends[0],
                    links[0],
                    ends[1],
                    links[1],
                    len(heads),
                    *shared,
                )
            )
        except asyncpg.UniqueViolationError as error:
            raise Overtaken(heads, by_position=True) from error
        except (asyncpg.NotNullViolationError, asyncpg.DeadlockDetectedError) as error:
            raise Overtaken(heads) from error
        self._check()

    def hold(self, streams: Sequence[str]) -> None:
        """Lock the ends of these streams until the end of the transaction, in the order of `store`."""
        await_only(self._raw.execute(_HOLD.format("$1::text[]"), list(streams)))

    def abandon(self) -> None:
        """Roll the open transaction back, if there is one."""
        if self._raw.is_in_transaction():
            self.say("ROLLBACK")

    def close(self) -> None:
        """Close the connection at once; an uncommitted transaction is rolled back."""
        try:
            self._loop.run_until_complete(self._end())
        finally:
            self._loop.close()

    async def _end(self) -> None:
        if self._watch is not None:
            self._watch.end()
        if self._open is not None:
            # One that was aborted, as after a silence, does not even know whether it is in a transaction.
            gone = self._raw is None or self._raw.is_closed()
            if gone or self._raw.is_in_transaction():
                await _quietly(self._open.invalidate())
            else:
                await _quietly(self._raw.close(timeout=1))
            await _quietly(self._open.close())
        await self._engine.dispose()
        await _hear()


class Postgres:
    """A Postgres database in which this process is the only writer, or with `several` one of several:
    then it has the first slot that is free, and keeps out whoever wants to be the only one."""

    is_local: Final = False
    patience: Final = 10.0
    faults: Final[tuple[type[Exception], ...]] = (
        asyncpg.PostgresError,
        asyncpg.InterfaceError,
        asyncpg.InternalClientError,
        DBAPIError,
        OSError,
    )

    def __init__(self, url: URL, *, several: bool = False) -> None:
        self._several = several
        self._slot = 0
        self._failover, self._url = failover_of(url)
        self.name: Final = f"The database {_named(url)}"
        self.address: Final = url.set(drivername="postgresql").render_as_string(hide_password=False)
        self._me = f"action-assistant {os.getpid()} {secrets.token_hex(8)}"
        self._key = 0
        self._readers = self._engine(
            {"application_name": f"{self._me} reads", "default_transaction_read_only": "on"},
            pool_size=_READERS,
            pool_pre_ping=True,
        )

    def open(
        self, branch: Branch, before: Before = no_copy, *, upgrades: bool = True
    ) -> PostgresSession:
        """Lock the database for this process, check that it stores commits durably, bring the
        tables of the branch to this version, and connect. `before` is called if tables are about to
        change; without `upgrades` they stay as they are. Raise CannotStart if the database cannot
        be used."""
        session = self.own(branch)
        if self._several:
            before = _alone(before)
        try:
            self.migrate(upgrade_to(branch, before=before) if upgrades else kept_as_it_is(branch))
        except BaseException:
            session.close()
            raise
        return session

    def own(self, branch: Branch) -> PostgresSession:
        """Lock the database for this process as the writer of a branch, whatever tables it has, and
        connect. Raise CannotStart if it cannot be used or another process holds the lock."""
        mark = hashlib.sha256(f"action-assistant journal {branch}".encode()).digest()
        self._key = int.from_bytes(mark[:8], "big", signed=True)
        try:
            return self.connect()
        except self.faults as error:
            raise CannotStart(f"Cannot use {self._the}: {cause_of(error)}.") from error

    def look(self, question: Callable[[Connection], object]) -> None:
        """Do nothing, not even call `question`: the check is made inside of the transaction that
        changes the tables, and no other code alters them."""

    def migrate(self, upgrade: Callable[[Connection], T]) -> T:
        """Call `upgrade`, which changes the schema, in one transaction, and return its result. If it
        limits how long it waits for a table (`_alone`) and that is too short, try again a few times. Raise
        CannotStart if the database cannot be used, or a table is in use each time."""

        async def change() -> T:
            engine = engine_of(self._url, {}, self._failover, poolclass=NullPool)
            try:
                async with engine.begin() as connection:
                    await connection.exec_driver_sql("SELECT pg_advisory_xact_lock(7205759403)")
                    return await connection.run_sync(upgrade)
            finally:
                await engine.dispose()

        for left in reversed(range(_TRIES)):
            try:
                return asyncio.run(change())
            except self.faults as error:
                if _state_of(error) != _LOCKED:
                    raise CannotStart(f"Cannot use {self._the}: {cause_of(error)}.") from error
                if not left:
                    raise CannotStart(
                        f"{self.name}: this version has to change tables that somebody reads for long, such "
                        "as a backup; start it again when that has ended."
                    ) from error
            time.sleep(_PAUSE)
        raise AssertionError

    def connect(self) -> PostgresSession:
        """Connect, become the only writer (again), and return the session. Once it has the lock,
        this process's last session has ended on the server, and its last commit has either happened
        or never will."""
        server = {"application_name": self._me}
        if self._failover is not None:
            # Whatever the server is told while we are connected.
            server |= {"synchronous_commit": "on", "client_min_messages": "warning"}
        engine = self._engine(server, poolclass=NullPool)
        session = PostgresSession(engine, self._take_over, is_shared=self._several)
        session.slot = self._slot
        return session

    async def _take_over(self, raw: Any) -> Watch | None:
        for name, (allowed, why) in _SETTINGS.items():
            value = await raw.fetchval("SELECT current_setting($1)", name)
            if value not in allowed:
                raise Unfit(f"{why} ({name} is {value})")
        primary = await self._checked_primary(raw)
        await raw.execute(_END_OLD, self._me)
        if self._several:
            await self._take_slot(raw)
        else:
            await _until(
                lambda: raw.fetchval("SELECT pg_try_advisory_lock($1)", self._key),
                "it is in use by another process",
            )
        if self._failover is None or primary is None:
            return None
        await raw.execute(_BARRIER)
        self._failover.note(primary.identifier, primary.timeline)  # readers follow
        return Watch(self._failover, primary)

    async def _take_slot(self, raw: Any) -> None:
        """Lock the slot that this process had, or the first that is free, once its last session has ended
        on the server. Raise Unfit if there is none, or a process is the only writer."""
        await _until(
            lambda: raw.fetchval("SELECT pg_try_advisory_lock_shared($1)", self._key),
            "it is in use by a process that shares it with no other",
        )
        await _until(
            lambda: raw.fetchval(f"SELECT ({_OLD}) = 0", self._me),
            "it has not ended an earlier connection of this process",
        )
        for slot in (self._slot, *range(SLOTS)):
            if await raw.fetchval("SELECT pg_try_advisory_lock($1, $2)", SLOT_LOCKS, slot):
                self._slot = slot
                return
        raise Unfit(f"{SLOTS} editors use it already")

    async def _checked_primary(self, raw: Any) -> Primary | None:
        """Return what the server says of itself, None where no other takes over from it. Raise Unfit if
        a failover could lose what it confirms."""
        if self._failover is None:
            return None
        commit = await raw.fetchval("SELECT current_setting('synchronous_commit')")
        if commit not in _KEPT:  # a pooler may drop the setting of this session
            raise Unfit(
                f"it confirms commits before its replica has them (synchronous_commit is {commit})"
            )
        told = await raw.fetchval("SELECT current_setting('client_min_messages')")
        if told not in _WARNING:
            raise Unfit(
                f"it does not say that a commit was not waited for (client_min_messages is {told})"
            )
        primary = Primary(*await raw.fetchrow(_PRIMARY))
        if why := await self._failover.weakness(primary):
            raise Unfit(why)
        return primary

    def lost(self, error: Exception) -> bool:
        """Return whether an error is the fault of the server or the connection, and not of the
        statement."""
        cause: Any = error.orig if isinstance(error, DBAPIError) else error
        if isinstance(error, DBAPIError) and error.connection_invalidated:
            return True
        state = getattr(cause, "sqlstate", None) or getattr(cause, "pgcode", None)
        return state is None or str(state).startswith(_SERVER)

    def raced(self, error: Exception) -> bool:
        """Return whether others, in a shared database, wrote at the same time."""
        return self._several and _state_of(error) in _RACES

    async def ask(self, question: Callable[[Connection], T]) -> T:
        """Call `question` with a connection that is not the writer's, and return its result."""
        async with self._readers.connect() as connection:
            return await connection.run_sync(question)

    async def at_one_moment(self, question: Callable[[Connection], T]) -> T:
        """Call `question` in one read-only transaction, which sees no later commits of others, and
        return its result."""
        async with self._readers.connect() as connection:
            await connection.execution_options(
                isolation_level="REPEATABLE READ", postgresql_readonly=True
            )
            return await connection.run_sync(question)

    def slots(self, connection: Connection) -> list[int]:
        """Return the slots in which there are events."""
        return [slot_of(end) for end in ends_of_slots(connection, editor_event.c.position)]

    def scan(self, connection: Connection, after: int) -> tuple[list[Sequence[Any]], int]:
        """Return a page of stored events after the position `after`, with their links of the hash
        chain, and the position for the next page."""
        columns = editor_event.c
        chosen = select(*(columns[name] for name in (*Event.__struct_fields__, "chain")))
        chosen = chosen.where(columns.position > after).order_by(columns.position).limit(_PAGE)
        rows = [tuple(row) for row in connection.execute(chosen)]
        return list(rows), rows[-1][6] if rows else after

    def bytes_in_use(self, connection: Connection) -> dict[str, int]:
        """Return the size of the database in bytes. The write-ahead log belongs to the whole
        server, and is not included."""
        asked = "SELECT pg_database_size(current_database())"
        return {"database": int(connection.exec_driver_sql(asked).scalar_one())}

    def complaints(self, connection: Connection) -> list[str]:
        """Return an empty list: the server checks its own files."""
        del connection
        return []

    async def close(self) -> None:
        """Close all connections that read."""
        await self._readers.dispose()

    def disown(self) -> None:
        """Do nothing: the lock ended with the session that wrote."""

    def _engine(self, server: dict[str, str], **options: Any) -> AsyncEngine:
        arguments = {
            "timeout": _CONNECT,
            "command_timeout": _ANSWER,
            "server_settings": server,
        }
        # This module sends BEGIN and COMMIT itself.
        return engine_of(
            self._url, arguments, self._failover, isolation_level="AUTOCOMMIT", **options
        )

    @property
    def _the(self) -> str:
        return self.name[0].lower() + self.name[1:]


def beside(url: str, name: str, *, size: int, patience: float) -> AsyncEngine:
    """Return an engine for connections beside those of a journal, with transactions of their own. `size`:
    how many at most; `patience`: seconds for a statement, and for a connection to come up."""
    failover, parsed = failover_of(make_url(url))
    server = {"application_name": f"action-assistant {os.getpid()} {name}"}
    if failover is not None:
        server["synchronous_commit"] = "on"
    arguments = {"timeout": patience, "command_timeout": patience, "server_settings": server}
    return engine_of(
        parsed, arguments, failover, pool_size=size, max_overflow=0, pool_pre_ping=True
    )


def weakness(connection: Connection, failover: Failover | None) -> str:
    """Return a sentence about the first setting that forbids writing to a database (an event could be
    lost, or the server is a read-only copy); "" if all settings are right. It only reads. `connection`
    belongs to an asynchronous one; `failover`: how the servers take over from each other."""
    for name, (allowed, why) in _SETTINGS.items():
        if name == _READ_ONLY:  # as whoever only looks has it
            value = "on" if connection.execute(select(func.pg_is_in_recovery())).scalar() else "off"
        else:
            value = str(connection.execute(select(func.current_setting(name))).scalar())
        if value not in allowed:
            return f"{why} ({name} is {value})"
    if failover is None:
        return ""
    primary = Primary(*connection.exec_driver_sql(_PRIMARY).one())
    return str(await_only(failover.weakness(primary)))


class Unfit(OSError):
    """A database that answers, but must not be written to."""


def _named(url: URL) -> str:
    """Return a URL for people: its servers and its name, without users and passwords."""
    hosts = hosts_of(url)
    if len(hosts) < 2:
        return str(URL.create("postgresql", host=url.host, port=url.port, database=url.database))
    return f"postgresql://{','.join(hosts)}/{url.database}"


async def _until(ask: Callable[[], Awaitable[bool]], why_not: str) -> None:
    """Ask until the answer is yes. Raise Unfit with the reason `why_not` after some seconds."""
    until = time.monotonic() + _HANDOVER
    while not await ask():
        if time.monotonic() > until:
            raise Unfit(why_not)
        await asyncio.sleep(0.05)


def _state_of(error: Exception) -> str | None:
    """Return the SQLSTATE of an error, None if it has none."""
    cause: object = error.orig if isinstance(error, DBAPIError) else error
    return getattr(cause, "sqlstate", None)


def _alone(before: Before) -> Before:
    """Return a function that is called before tables change, and refuses that while other editors use
    them, unless these can go on; then the change must not wait long for a table. Else it calls `before`."""

    called_for: set[str] = set()

    def check(connection: Connection, branch: Branch, revision: str) -> None:
        beside = connection.exec_driver_sql(_EDITORS).scalar_one() > 1
        if beside and not only_expands(branch, revision):
            raise CannotStart(
                "This version has to change the tables, but other editors use them and could not go on: end "
                "those first."
            )
        if revision not in called_for:  # one copy is enough for all tries
            before(connection, branch, revision)
            called_for.add(revision)
        if beside:
            connection.exec_driver_sql(_TABLE_WAIT)

    return check


async def _hear() -> None:
    """Let the event loop notice incoming data, such as the end of a connection."""
    for _ in range(3):
        await asyncio.sleep(0)


async def _quietly(closing: Awaitable[None]) -> None:
    try:
        await closing
    except (asyncpg.PostgresError, asyncpg.InterfaceError, SQLAlchemyError, OSError):
        return  # it has gone, as intended
