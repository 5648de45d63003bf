"""The index of key changes: brought up to the log when somebody asks and now and then; its queries."""

import logging
from collections import defaultdict
from collections.abc import AsyncIterator, Collection, Iterable
from contextlib import asynccontextmanager
from typing import Any, Final

import anyio
from sqlalchemy import ColumnElement, Connection, Row, Select, and_, delete, func, insert, select

from action_assistant.editor.documents.values import Root
from action_assistant.editor.history.key_changes import (
    LoggedChange,
    ObservedEvents,
    Place,
    observed,
    owner_of,
)
from action_assistant.editor.log.graph_events import graph_of, graph_stream
from action_assistant.errors import Refused
from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal
from action_assistant.schema.editor_tables import editor_head, key_change, key_change_head
from action_assistant.web.workers.lanes import RunInWorker, run_here

log: Final = logging.getLogger(__name__)

_EVENTS: Final = 1000  # looked at in one go
_BYTES: Final = 4 << 20  # of them
_OWNERS: Final = 400  # that one question names
_PERIOD: Final = 20.0  # seconds between two looks at what is behind
_FAR: Final = 5_000  # events behind, from which on it is not left for later

_c = key_change.c
_CHANGE: Final = select(_c.seq, _c.author, _c.at, _c.root, _c.key, _c.before, _c.after)


class ChangeIndex:
    """Which keys each event changed. What it stores is derived, and may vanish at any time."""

    def __init__(self, journal: Journal, run_in_worker: RunInWorker = run_here) -> None:
        self._journal = journal
        self._run_in_worker = run_in_worker
        self._catching_up: defaultdict[str, anyio.Lock] = defaultdict(anyio.Lock)

    async def upto(self, graph: str, seq: int | None = None) -> int:
        """Bring the index of a graph up to a change, or to its newest; where it ends then, which is
        earlier only where the log is damaged. Raises Unavailable."""
        wanted = await self._journal.newest(graph_stream(graph)) if seq is None else seq
        async with self._catching_up[graph]:
            done, document = await self._head(graph)
            while done < wanted and (events := await self._some_events(graph, done)):
                found = await self._run_in_worker(observed, document, events)
                if found is None:  # made by another version of ours
                    await self._forget(graph)
                    done, document = 0, b""
                    continue
                await self._keep(graph, found)
                done, document = found.seq, found.document
                if found.damaged:
                    break
            return done

    @asynccontextmanager
    async def kept_up(self) -> AsyncIterator[None]:
        """While you are inside, graphs that change are looked at now and then, so that who asks for
        a history seldom waits."""
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._keep_up)
            yield
            tasks.cancel_scope.cancel()

    # --- what it knows ---------------------------------------------------------------------------

    async def between(
        self, graph: str, after: int, upto: int, *, limit: int, by: str | None = None
    ) -> list[LoggedChange]:
        """The newest changes with `after < seq <= upto`, in order of time; `by` one person."""
        chosen = _CHANGE.where(_c.graph == graph, _c.seq > after, _c.seq <= upto)
        if by is not None:
            chosen = chosen.where(_c.author == by)
        newest_first = chosen.order_by(_c.seq.desc(), _c.root, _c.key).limit(limit)
        return _changes(await self._journal.query(newest_first))[::-1]

    async def at(
        self, graph: str, seq: int, *, of: Collection[str] | None = None
    ) -> list[LoggedChange]:
        """The change that gave each key the value that it has after the change `seq`: of everything, or
        of some owners."""
        if of is None:
            return _changes(
                await self._journal.query(_last(graph, seq).where(_c.after.is_not(None)))
            )
        return [each for each in await self.latest(graph, seq, of=of) if each.after is not None]

    async def latest(self, graph: str, seq: int, *, of: Collection[str]) -> list[LoggedChange]:
        """The last change of each key of some owners up to the change `seq`, also of keys that are gone."""
        owners = sorted(of)
        found: list[LoggedChange] = []
        for start in range(0, len(owners), _OWNERS):
            some = _c.owner.in_(owners[start : start + _OWNERS])
            found += _changes(await self._journal.query(_last(graph, seq, some)))
        return found

    async def latest_since(self, graph: str, seq: int) -> dict[Place, int]:
        """The last change of each key that the change `seq` or a later one changed."""
        newest = select(_c.root, _c.key, func.max(_c.seq).label("seq"))
        chosen = newest.where(_c.graph == graph, _c.seq >= seq).group_by(_c.root, _c.key)
        return {(row.root, row.key): row.seq for row in await self._journal.query(chosen)}

    async def of_key(self, graph: str, root: Root, key: str, upto: int) -> list[LoggedChange]:
        """All changes of one key, in order of time."""
        same = (_c.graph == graph, _c.root == root, _c.key == key, _c.seq <= upto)
        return _changes(await self._journal.query(_CHANGE.where(*same).order_by(_c.seq)))

    # --- bringing it up ----------------------------------------------------------------------------

    async def _keep_up(self) -> None:
        seen: dict[str, int] = {}
        while True:
            behind = await self._behind()
            # What is being edited is left until it rests, unless there is much of it: who edits needs the
            # time, and who asks for its history now has it brought up.
            ripe = [
                g for g, (newest, more) in behind.items() if seen.get(g) == newest or more > _FAR
            ]
            seen = {graph: newest for graph, (newest, _) in behind.items()}
            for graph in ripe:
                try:
                    await self.upto(graph)
                except Refused as error:
                    log.warning("%s: its changes are not indexed: %s", graph, error.detail)
                except Exception:  # whatever one document holds, the editor is not ended by it
                    log.exception("%s: its changes cannot be indexed", graph)
            await anyio.sleep(_PERIOD)

    async def _behind(self) -> dict[str, tuple[int, int]]:
        """Graphs whose newest events are not in the index: which the newest is, and how many there are."""
        stream, newest = editor_head.c.stream, editor_head.c.seq
        indexed = func.coalesce(key_change_head.c.seq, 0)
        same = stream == graph_stream("") + key_change_head.c.graph
        joined = editor_head.outerjoin(key_change_head, same)
        chosen = select(stream, newest, (newest - indexed).label("more")).select_from(joined)
        chosen = chosen.where(newest > indexed, stream.startswith("graph/"))
        try:
            rows = await self._journal.query(chosen)
        except Refused as error:
            log.warning("changes are not indexed: %s", error.detail)
            return {}
        found = {graph_of(row.stream): (row.seq, row.more) for row in rows}
        return {graph: numbers for graph, numbers in found.items() if graph is not None}

    async def _head(self, graph: str) -> tuple[int, bytes]:
        head = key_change_head.c
        rows = await self._journal.query(select(head.seq, head.document).where(head.graph == graph))
        return (rows[0].seq, rows[0].document) if rows else (0, b"")

    async def _some_events(self, graph: str, after: int) -> list[Event]:
        events = await self._journal.read(graph_stream(graph), after=after, limit=_EVENTS)
        size = 0
        for n, event in enumerate(events):
            size += len(event.body)
            if size > _BYTES:
                return events[: n + 1]
        return events

    async def _keep(self, graph: str, found: ObservedEvents) -> None:
        rows = [_row(graph, change) for change in found.changes]
        head = {"graph": graph, "seq": found.seq, "document": found.document}

        def keep(connection: Connection) -> None:
            if rows:
                connection.execute(insert(key_change), rows)
            _drop_head(connection, graph)
            connection.execute(insert(key_change_head), [head])

        await self._journal.derive(keep)

    async def _forget(self, graph: str) -> None:
        def forget(connection: Connection) -> None:
            connection.execute(delete(key_change).where(_c.graph == graph))
            _drop_head(connection, graph)

        await self._journal.derive(forget)


def _drop_head(connection: Connection, graph: str) -> None:
    connection.execute(delete(key_change_head).where(key_change_head.c.graph == graph))


def _row(graph: str, change: LoggedChange) -> dict[str, Any]:
    return {"graph": graph, "owner": owner_of(change.root, change.key)} | change._asdict()


def _changes(rows: Iterable[Row[Any]]) -> list[LoggedChange]:
    return [LoggedChange._make(row) for row in rows]


def _last(graph: str, seq: int, *also: ColumnElement[bool]) -> Select[Any]:
    """The last change of each key up to a change."""
    newest = (
        select(_c.root, _c.key, func.max(_c.seq).label("seq"))
        .where(_c.graph == graph, _c.seq <= seq, *also)
        .group_by(_c.root, _c.key)
        .subquery()
    )
    same = and_(
        _c.graph == graph,
        _c.root == newest.c.root,
        _c.key == newest.c.key,
        _c.seq == newest.c.seq,
    )
    return _CHANGE.select_from(key_change.join(newest, same))
