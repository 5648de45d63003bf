"""Servers of Postgres that take over from each other, and what proves that a failover loses nothing.

A commit is confirmed when the replica that would take over has it too (decision 168). The URL of the
database says who takes over: several `host`s, `patroni=http://db1:8008` for each node of Patroni, or
`failover=synchronous` for another manager behind one address.
"""

import asyncio
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


class NoPrimary(OSError):
    """Raised if no server of a database takes commits."""


class Failover(NamedTuple):
    """The way in which one server of a database takes over from another. `patroni`: the addresses of
    Patroni; without any, another manager promotes only a server in `synchronous_standby_names`."""

    patroni: tuple[str, ...]

    async def weakness(self, standbys: str, identifier: str) -> str:
        """Return why a failover could lose confirmed commits, as a sentence without a full stop; ""
        if it cannot. `standbys`: the setting `synchronous_standby_names` of the primary, `identifier`:
        the identifier of its system."""
        if not self.patroni:
            return (
                ""
                if standbys
                else "a failover could lose what it confirms (synchronous_standby_names is empty)"
            )
        found = await asyncio.gather(*(_asked(each, identifier) for each in self.patroni))
        if _SYNCHRONOUS in found:
            return ""  # while it has no replica, Patroni promotes none
        # Only a primary whose Patroni led it into synchronous mode waits for a replica.
        if standbys and not any(found):
            return ""
        faults = dict.fromkeys(each for each in found if each)
        return " and ".join(faults) or f"Patroni does not answer at {', '.join(self.patroni)}"


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
        return await _first([{**known, "host": host, "port": port} for host, port in hosts])

    return create_async_engine(url, async_creator=connect, **options)


async def _first(servers: Iterable[Mapping[str, Any]]) -> Any:
    """Connect to all servers at once, and return the first connection to a primary: a server that is
    silent must not use up the time of the others."""
    waiting = {asyncio.ensure_future(asyncpg.connect(**each)): _place(each) for each in servers}
    faults: dict[str, BaseException] = {}
    chosen: Any = None
    try:
        while chosen is None and len(faults) < len(waiting):
            left = [each for each in waiting if waiting[each] not in faults]
            done, _ = await asyncio.wait(left, return_when=asyncio.FIRST_COMPLETED)
            for each in done:
                if (fault := each.exception()) is not None:
                    faults[waiting[each]] = fault
                else:
                    chosen = each.result()
    finally:
        for each in waiting:
            each.cancel()
        for other in await asyncio.gather(*waiting, return_exceptions=True):
            if isinstance(other, asyncpg.Connection) and other is not chosen:
                other.terminate()
    if chosen is None:
        told = "; ".join(f"{place}: {_told(fault)}" for place, fault in faults.items())
        speaking = (each for each in faults.values() if isinstance(each, asyncpg.PostgresError))
        raise NoPrimary(f"none of its servers is a primary ({told})") from next(
            speaking, next(iter(faults.values()))
        )
    return chosen


async def _asked(address: str, identifier: str) -> str:
    """Return `synchronous` if the Patroni at an address replicates synchronously, "" if it does not
    answer, else what is wrong with it."""
    import httpx  # slow to load, and only clusters need it

    try:
        async with httpx.AsyncClient(timeout=_PATRONI_S) as client:
            state = (await client.get(f"{address}/patroni")).json()
            settings = (await client.get(f"{address}/config")).raise_for_status().json()
        if state.get("database_system_identifier") not in {None, identifier}:
            return f"the Patroni at {address} leads another cluster"
        mode = settings.get("synchronous_mode")
    except (httpx.HTTPError, OSError, ValueError, AttributeError):
        return ""
    if mode in {True, "on", "quorum"}:
        return _SYNCHRONOUS
    return "a failover could lose what it confirms (synchronous_mode of Patroni is off)"


def _several(value: str | tuple[str, ...]) -> tuple[str, ...]:
    return (value,) if isinstance(value, str) else value


def _place(server: Mapping[str, Any]) -> str:
    return f"{server['host']}:{server['port'] or 5432}"


def _told(fault: BaseException) -> str:
    if isinstance(fault, asyncpg.TargetServerAttributeNotMatched):
        return "a read-only copy"
    return cause_of(fault) if isinstance(fault, Exception) else type(fault).__name__
