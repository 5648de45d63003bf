"""Servers of Postgres that take over from each other, and what proves that a failover loses nothing.

A commit is confirmed when the replica that would take over has it too (decision 168). The URL of the
database says who takes over: several `host`s, `patroni=http://db1:8008` for each node of Patroni, or
`failover=synchronous` for another manager behind one address.
"""

import asyncio
import threading
from collections.abc import Iterable, Mapping
from typing import Any, Final, NamedTuple
from urllib.parse import urlsplit

import asyncpg  # type: ignore[import-untyped]
from sqlalchemy import URL
from sqlalchemy.dialects.postgresql.asyncpg import PGDialect_asyncpg
from sqlalchemy.ext.asyncio import AsyncEngine, create_async_engine

from action_assistant.errors import CannotStart
from action_assistant.journal.database import cause_of

_PATRONI: Final = "patroni"
_FAILOVER: Final = "failover"
_SYNCHRONOUS: Final = "synchronous"
_PATRONI_S: Final = 2.0  # seconds to wait for an answer of Patroni
_WATCH_S: Final = 5.0  # seconds between two questions about a connection
_GRACE_S: Final = 0.3  # seconds for a second primary to answer
#: The timeline of a primary; `pg_control_checkpoint` says it later.
TIMELINE: Final = "SELECT ('x' || left(pg_walfile_name(pg_current_wal_lsn()), 8))::bit(32)::int"


class NoPrimary(OSError):
    """Raised if no server of a database takes commits."""


class Primary(NamedTuple):
    """The facts that a primary tells about itself. `standbys`: its setting `synchronous_standby_names`; `identifier`:
    of its cluster; `timeline`: rises with each server that takes over."""

    standbys: str
    identifier: str
    timeline: int


class Failover(NamedTuple):
    """The way in which one server of a database takes over from another. `patroni`: the addresses of
    Patroni; without any, another manager promotes only a server that has every confirmed commit."""

    patroni: tuple[str, ...]

    async def weakness(self, primary: Primary) -> str:
        """Return why what this primary confirms could be lost, as a sentence without a full stop; ""
        if it cannot."""
        if self.patroni and (said := await self.said(primary)) is not None:
            return said
        # A primary that its Patroni led into synchronous mode names a replica, and waits for it.
        if primary.standbys:
            return ""
        if self.patroni:
            return f"Patroni does not answer at {', '.join(self.patroni)}"
        return "a failover could lose what it confirms (synchronous_standby_names is empty)"

    async def said(self, primary: Primary) -> str | None:
        """Return what Patroni says against this primary, "" for nothing, None if no Patroni answers."""
        answers = await asyncio.gather(*(_asked(each) for each in self.patroni))
        ours = [each for each in answers if each is not None]
        if not ours:
            return None
        if any(each.identifier not in {None, primary.identifier} for each in ours):
            return f"a Patroni at {', '.join(self.patroni)} leads another cluster"
        if any(each.is_primary and each.timeline > primary.timeline for each in ours):
            return "another server has taken over from it"
        if not any(each.is_synchronous for each in ours):
            return "a failover could lose what it confirms (synchronous_mode of Patroni is off)"
        return ""  # while a primary has no replica, Patroni promotes none


class Watch:
    """Asks Patroni, if there is one, about the primary of one connection, every few seconds, on a thread
    of its own, so that no commit waits for the answer."""

    def __init__(self, failover: Failover, primary: Primary) -> None:
        self._failover: Final = failover
        self._primary: Final = primary
        self._over = threading.Event()
        #: What Patroni says against the primary; the connection is not to be used any more.
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


def engine_of(url: URL, arguments: Mapping[str, Any], **options: Any) -> AsyncEngine:
    """Return an engine that connects to the primary among the hosts of a URL. `arguments`: those of
    each connection; `options`: those of the engine."""
    url = url.set(drivername="postgresql+asyncpg")
    if len(hosts_of(url)) < 2:
        return create_async_engine(url, connect_args=dict(arguments), **options)
    _, known = PGDialect_asyncpg().create_connect_args(url)  # type: ignore[no-untyped-call]
    hosts = list(zip(known.pop("host"), known.pop("port"), strict=True))
    known |= {"target_session_attrs": "primary", **arguments}

    async def connect() -> Any:
        return await _connected_to_primary(
            [{**known, "host": host, "port": port} for host, port in hosts]
        )

    return create_async_engine(url, async_creator=connect, **options)


async def _connected_to_primary(servers: Iterable[Mapping[str, Any]]) -> Any:
    """Connect to all servers at once, and return the connection to the primary: a server that is
    silent must not use up the time of the others. Of two, an old primary that lives on has the lower
    timeline."""
    waiting = {asyncio.ensure_future(asyncpg.connect(**each)): _place(each) for each in servers}
    primaries: dict[Any, int] = {}
    chosen: Any = None
    try:
        left: set[asyncio.Future[Any]] = set(waiting)
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
                    primaries[each.result()] = await each.result().fetchval(TIMELINE)
        if primaries:
            chosen = max(primaries, key=lambda each: primaries[each])
            return chosen
        raise _no_primary({place: each.exception() for each, place in waiting.items()})
    finally:
        for each in waiting:
            each.cancel()
        for other in await asyncio.gather(*waiting, return_exceptions=True):
            if isinstance(other, asyncpg.Connection) and other is not chosen:
                other.terminate()


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
        async with httpx.AsyncClient(timeout=_PATRONI_S) as client:
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
