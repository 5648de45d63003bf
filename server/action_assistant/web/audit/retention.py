"""Drops rows of the audit that are older than the owner wants to keep them, by whole months.

Only streams of the audit are dropped: events of graphs, runs, robots and people are their history. What
was dropped is itself a fact of the audit. The chain of hashes says how each dropped stream ended.
"""

import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from typing import Final, TypeAlias

import anyio
import msgspec
from sqlalchemy import Connection, func, select

from action_assistant.errors import Refused
from action_assistant.journal.events import Addition, Draft
from action_assistant.journal.journal import Journal
from action_assistant.journal.removal import StreamRemoved
from action_assistant.kit.clock import ClockUs, utc_us
from action_assistant.schema.editor_tables import editor_event, editor_head
from action_assistant.web.audit.events import (
    KEEPING,
    STREAM,
    AuditDropped,
    AuditKept,
    stream_at,
)
from action_assistant.web.audit.rows import drops

log: Final = logging.getLogger(__name__)

_DAY_US: Final = 86_400_000_000
_EVERY_S: Final = 3_600.0
_PAUSE_S: Final = 0.02  # between two steps, for other work of the journal
# The tables of the log are the same for both branches.
_event, _head = editor_event.c, editor_head.c

#: Returns the times (µs UTC, begin and end) in which no row is dropped: those of incidents.
KeptTimes: TypeAlias = Callable[[Connection], list[tuple[int, int]]]


class AuditRetention:
    """Drops old rows of the audit of one process. `days`: the age from which on; None drops none."""

    def __init__(
        self,
        journal: Journal,
        days: float | None,
        kept: KeptTimes,
        *,
        clock_us: ClockUs = utc_us,
        every_s: float = _EVERY_S,
    ) -> None:
        self._journal = journal
        self._days = days
        self._kept = kept
        self._clock_us = clock_us
        self._every_s = every_s

    @asynccontextmanager
    async def sweeping(self) -> AsyncIterator[None]:
        """Return a context during which old rows are dropped, once an hour."""
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._run)
            yield
            tasks.cancel_scope.cancel()

    async def _run(self) -> None:
        while True:
            try:
                await self.sweep()
            except Refused as error:
                log.warning("old rows of the audit are not dropped yet: %s", error.detail)
            except Exception:  # the process goes on without this
                log.exception("old rows of the audit cannot be dropped")
            await anyio.sleep(self._every_s)

    async def sweep(self) -> int:
        """Drop all streams whose newest row is too old; return how many. What an earlier process
        had dropped and not yet deleted is deleted first, also without a setting. Raise Unavailable
        if the journal cannot be read or written, Conflict if a stream has just grown."""
        for dropped in await self._journal.ask(_undeleted):
            await self._delete(dropped.stream, dropped.by)
        if self._days is None:
            return 0
        now = self._clock_us()
        before = now - round(self._days * _DAY_US)
        names = await self._journal.ask(months_of)
        done = 0
        for stream in names:
            if stream != stream_at(now) and await self._drop(stream, before, self._days):
                done += 1
        return done

    async def _drop(self, stream: str, before: int, days: float) -> bool:
        """Drop a stream if all of it is older than the time `before` and no incident needs it."""
        end = await self._journal.end(stream)
        facts = await self._journal.ask(partial(_facts, stream, before, self._kept))
        if facts is None or facts.until >= before or facts.is_kept:
            return False
        chain = end.chain.hex()
        removed = StreamRemoved(stream, end.seq, chain, "", "", facts.first, facts.last)

        def recorded(by: int) -> Addition:
            dropped = AuditDropped(
                stream, facts.rows, facts.since, facts.until, end.seq, chain, by, days
            )
            body = msgspec.json.encode(dropped)
            return Addition(KEEPING, (Draft(dropped.kind, "", body),))

        by = await self._journal.take_out(removed, recorded)
        log.info("%d rows of %s are dropped: older than %g days", facts.rows, stream, days)
        await self._delete(stream, by)
        return True

    async def _delete(self, stream: str, by: int) -> None:
        left = True
        while left:
            left = await self._journal.delete_some(stream, by)
            await anyio.sleep(_PAUSE_S)


class _Facts(msgspec.Struct, frozen=True):
    """The rows of a stream: their number, the times of the oldest and newest, and the positions of
    the first and last. `is_kept`: an incident needs some of them."""

    rows: int
    since: int
    until: int
    first: int
    last: int
    is_kept: bool


def _facts(stream: str, before: int, kept: KeptTimes, connection: Connection) -> _Facts | None:
    """Return what a stream holds; None if that is nothing, or its last row is of after `before`."""
    at, position, mine = _event.at, _event.position, _event.stream == stream
    last_at = connection.scalar(select(at).where(mine).order_by(_event.seq.desc()).limit(1))
    if last_at is None or last_at >= before:
        return None
    columns = func.count(), func.min(at), func.max(at), func.min(position), func.max(position)
    found = connection.execute(select(*columns).where(mine)).one()
    rows, since, until, first, last = found
    is_kept = any(begin <= until and since <= end for begin, end in kept(connection))
    return _Facts(rows, since, until, first, last, is_kept)


def months_of(connection: Connection) -> list[str]:
    """Return the streams of the audit that may have rows, oldest first."""
    of_month = _head.stream.startswith(f"{STREAM}/", autoescape=True)
    chosen = select(_head.stream).where((_head.stream == STREAM) | of_month)
    return sorted(connection.scalars(chosen.order_by(_head.stream)))


def _undeleted(connection: Connection) -> list[AuditDropped]:
    first = select(func.min(_event.seq))
    return [
        each
        for _, each in drops(connection)
        if (connection.scalar(first.where(_event.stream == each.stream)) or each.seq + 1)
        <= each.seq
    ]


def kept_for_incidents(connection: Connection) -> list[tuple[int, int]]:
    """Return the times for which an owner keeps rows, as the log of this process has them."""
    chosen = select(_event.body).where(_event.stream == KEEPING, _event.kind == AuditKept.kind)
    found = [msgspec.json.decode(body, type=AuditKept) for body in connection.scalars(chosen)]
    return [(each.since, each.until) for each in found]
