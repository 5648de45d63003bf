"""Servers of Postgres that take over from each other, and what proves that a failover loses
nothing.

A commit is confirmed when the replica that would take over has it too (decision 168). The URL of
the database says who takes over: several `host`s, `patroni=http://db1:8008` for each node of
Patroni, or `failover=synchronous` for another manager behind one address.
"""

import asyncio
import threading
from collections.abc import Iterable, Mapping
from typing import Any, Final, NamedTuple
from urllib.parse import urlsplit
from weakref import WeakKeyDictionary

import asyncpg  # type: ignore[import-untyped]
from sqlalchemy import URL
from sqlalchemy.dialects.postgresql.asyncpg import PGDialect_asyncpg
from sqlalchemy.event import listens_for
from sqlalchemy.exc import DisconnectionError
from sqlalchemy.ext.asyncio import AsyncEngine, create_async_engine
from sqlalchemy.pool import ConnectionPoolEntry

from action_assistant.errors import CannotStart
from action_assistant.journal.database import cause_of

_PATRONI: Final = "patroni"
_FAILOVER: Final = "failover"
_SYNCHRONOUS: Final = "synchronous"
_PATRONI_S: Final = 2.0  # seconds to wait for an answer of Patroni
_WATCH_S: Final = 5.0  # seconds between two questions about a connection
_GRACE_S: Final = 0.3  # seconds for a second primary to answer
_TAKEN_OVER: Final = "another server has taken over from it"
#: The identifier of the cluster of a primary, and its timeline; `pg_control_checkpoint` says it later.
IDENTITY: Final = (
    "(SELECT system_identifier::text FROM pg_control_system()),"
    " ('x' || left(pg_walfile_name(pg_current_wal_lsn()), 8))::bit(32)::int"
)


class NoPrimary(OSError):
    """Raised if no server of a database takes commits."""


class Primary(NamedTuple):
    """The facts that a primary tells about itself. `standbys`: its setting
    `synchronous_standby_names`; `identifier`: of its cluster; `timeline`: rises with each server
    that takes over."""

    standbys: str
    identifier: str
    timeline: int


class _Identity(NamedTuple):
    """The identifier of a primary's cluster, and its timeline."""

    identifier: str
    timeline: int


class Failover:
    """The way in which one server of a database takes over from another. `patroni`: the addresses
    of Patroni; without any, another manager promotes only a server that has every confirmed
    commit."""

    def __init__(self, patroni: tuple[str, ...]) -> None:
        self.patroni: Final = patroni
        self._newest: dict[str, int] = {}  # timeline, by the identifier of a cluster

    def note(self, identifier: str, timeline: int) -> None:
        """Remember that a server of this cluster has begun this timeline: a server on an earlier
        one is an old primary that lives on."""
        self._newest[identifier] = max(timeline, self._newest.get(identifier, 0))

    def is_old(self, identifier: str, timeline: int) -> bool:
        """Return whether another server is known to have taken over from a primary."""
        return timeline < self._newest.get(identifier, 0)

    async def weakness(self, primary: Primary) -> str:
        """Return why what this primary confirms could be lost, as a sentence without a full stop;
        "" if it cannot."""
        if self.patroni and (said := await self.said(primary)) is not None:
            return said
        # A primary that its Patroni led into synchronous mode names a replica, and waits for it.
        if primary.standbys:
            return ""
        if self.patroni:
            return f"Patroni does not answer at {', '.join(self.patroni)}"
        return "a failover could lose what it confirms (synchronous_standby_names is empty)"

    async def said(self, primary: Primary) -> str | None:
        """Return why Patroni says that commits on this primary could be lost; "" if it does not say
        so, None if no Patroni answers."""
        answers = await asyncio.gather(*(_asked(each) for each in self.patroni))
        ours = [each for each in answers if each is not None]
        if not ours:
            return None
        if any(each.identifier not in {None, primary.identifier} for each in ours):
            return f"a Patroni at {', '.join(self.patroni)} leads another cluster"
        for each in ours:
            if each.is_primary:
                self.note(primary.identifier, each.timeline)
        if self.is_old(primary.identifier, primary.timeline):
            return _TAKEN_OVER
        if not any(each.is_synchronous for each in ours):
            return "a failover could lose what it confirms (synchronous_mode of Patroni is off)"
        return ""  # while a primary has no replica, Patroni promotes none


class Watch:
    """Asks Patroni, if there is one, about the primary of one connection, every few seconds, on a
    thread of its own, so that no commit waits for the answer."""

    def __init__(self, failover: Failover, primary: Primary) -> None:
        self._failover: Final = failover
        self._primary: Final = primary
        self._over = threading.Event()
        #: Why commits on the primary could be lost; "" while they cannot. The connection must not be used then.
        self.doubt = ""
        if failover.patroni:
            threading.Thread(target=self._run, name="failover watch", daemon=True).start()

    def end(self) -> None:
        """Let the thread end; nothing is asked any more."""
        self._over.set()

    def _run(self) -> None:
        while not self._over.wait(_WATCH_S) and not self.doubt:
            self.doubt = asyncio.run(self._failover.said(self._primary)) or ""


def failover_of(url: URL) -> tuple[Failover | None, URL]:
    """Return how the servers of a database take over from each other, None for a single server, and
    the URL without the parts that a driver does not know. Raise CannotStart if they are wrong."""
    query = dict(url.query)
    patroni = _several(query.pop(_PATRONI, ()))
    mode = query.pop(_FAILOVER, None)
    if mode not in {None, _SYNCHRONOUS}:
        raise CannotStart(f"failover in the URL of --database is `{_SYNCHRONOUS}`, or left out.")
    for each in patroni:
        parts = urlsplit(each)
        if parts.scheme not in {"http", "https"} or not parts.hostname:
            raise CannotStart(
                "patroni in the URL of --database is an address such as http://db1:8008."
            )
    plain = url.set(query=query)
    if patroni or mode or len(hosts_of(url)) > 1:
        return Failover(tuple(each.rstrip("/") for each in patroni)), plain
    return None, plain


def hosts_of(url: URL) -> list[str]:
    """Return the hosts of a URL, each with its port if it names one; empty for a local socket."""
    named = _several(url.query.get("host", ()))
    if url.host is None:
        return list(named)
    return [f"{url.host}:{url.port}" if url.port else url.host, *named]


def engine_of(
    url: URL, arguments: Mapping[str, Any], failover: Failover | None = None, **options: Any
) -> AsyncEngine:
    """Return an engine that connects to the primary among the hosts of a URL. `arguments`: those of
    each connection; `failover`: knows which primaries are old; `options`: those of the engine,
    whose pool hands out no connection to an old primary."""
    url = url.set(drivername="postgresql+asyncpg")
    if len(hosts_of(url)) < 2:
        return create_async_engine(url, connect_args=dict(arguments), **options)
    _, known = PGDialect_asyncpg().create_connect_args(url)  # type: ignore[no-untyped-call]
    hosts = list(zip(known.pop("host"), known.pop("port"), strict=True))
    known |= {"target_session_attrs": "primary", **arguments}
    servers = [{**known, "host": host, "port": port} for host, port in hosts]
    found: WeakKeyDictionary[Any, _Identity] = WeakKeyDictionary()

    async def connect() -> Any:
        connection, identity = await _connected_to_primary(servers, failover)
        found[connection] = identity
        return connection

    is_pinged = options.pop("pool_pre_ping", False)
    engine = create_async_engine(url, async_creator=connect, **options)

    @listens_for(engine.sync_engine.pool, "checkout")
    def check(adapted: Any, record: ConnectionPoolEntry, __: object) -> None:
        """Refuse a connection to an old primary before it is asked anything: that one may be
        frozen."""
        identity = found.get(record.driver_connection)
        if failover is not None and identity is not None and failover.is_old(*identity):
            raise DisconnectionError
        if is_pinged:
            try:
                engine.sync_engine.dialect.do_ping(adapted)
            except Exception as gone:  # whatever it is: another connection is made
                raise DisconnectionError from gone

    return engine


async def _connected_to_primary(
    servers: Iterable[Mapping[str, Any]], failover: Failover | None
) -> tuple[Any, _Identity]:
    """Connect to all servers at once, and return the connection to the primary: a server that is
    silent must not use up the time of the others. Of two, an old primary that lives on has the
    lower timeline; one of which it is known is not waited with, and not taken."""
    waiting = {asyncio.ensure_future(_identified(each)): _place(each) for each in servers}
    primaries: dict[Any, _Identity] = {}
    chosen: Any = None
    try:
        left: set[asyncio.Future[tuple[Any, _Identity]]] = set(waiting)
        while left:
            done, left = await asyncio.wait(
                left,
                timeout=_GRACE_S if primaries else None,
                return_when=asyncio.FIRST_COMPLETED,
            )
            if not done:
                break
            for each in done:
                if each.exception() is None:
                    connection, identity = each.result()
                    if failover is None or not failover.is_old(*identity):
                        primaries[connection] = identity
        if primaries:
            chosen = max(primaries, key=lambda each: primaries[each].timeline)
            return chosen, primaries[chosen]
        raise _no_primary(
            {place: each.exception() or NoPrimary(_TAKEN_OVER) for each, place in waiting.items()}
        )
    finally:
        for each in waiting:
            each.cancel()
        for other in await asyncio.gather(*waiting, return_exceptions=True):
            if isinstance(other, tuple) and other[0] is not chosen:
                other[0].terminate()


async def _identified(server: Mapping[str, Any]) -> tuple[Any, _Identity]:
    """Connect to a primary, and return the connection with what the primary says of itself."""
    connection = await asyncpg.connect(**server)
    try:
        return connection, _Identity(*await connection.fetchrow(f"SELECT {IDENTITY}"))
    except BaseException:
        connection.terminate()
        raise


def _no_primary(faults: Mapping[str, BaseException | None]) -> NoPrimary:
    """Return the error for servers none of which is a primary, with why each is not."""
    told = "; ".join(f"{place}: {_told(fault)}" for place, fault in faults.items())
    error = NoPrimary(f"none of its servers is a primary ({told})")
    speaking = (each for each in faults.values() if isinstance(each, asyncpg.PostgresError))
    error.__cause__ = next(speaking, next(iter(faults.values())))
    return error


class _Answer(NamedTuple):
    """The answer of one Patroni: about its server, and about the settings of its cluster."""

    identifier: str | None
    is_primary: bool
    timeline: int
    is_synchronous: bool


async def _asked(address: str) -> _Answer | None:
    """Ask the Patroni at an address; None if it does not answer."""
    import httpx  # slow to load, and only clusters need it

    try:
        async with asyncio.timeout(_PATRONI_S), httpx.AsyncClient(timeout=_PATRONI_S) as client:
            state = (await client.get(f"{address}/patroni")).json()
            settings = (await client.get(f"{address}/config")).raise_for_status().json()
        return _Answer(
            state.get("database_system_identifier"),
            state.get("role") in {"master", "primary"},
            int(state.get("timeline") or 0),
            settings.get("synchronous_mode") in {True, "on", "quorum"},
        )
    except (httpx.HTTPError, OSError, ValueError, AttributeError, TypeError):
        return None


def _several(value: str | tuple[str, ...]) -> tuple[str, ...]:
    return (value,) if isinstance(value, str) else value


def _place(server: Mapping[str, Any]) -> str:
    return f"{server['host']}:{server['port'] or 5432}"


def _told(fault: BaseException | None) -> str:
    if isinstance(fault, asyncpg.TargetServerAttributeNotMatched):
        return "a read-only copy"
    return cause_of(fault) if isinstance(fault, Exception) else type(fault).__name__
