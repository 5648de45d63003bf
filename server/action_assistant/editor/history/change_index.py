"""The index of key changes: updated from the log on demand and periodically, and read by workers.

Nothing here reads or makes what grows with a graph: a worker reads the log and the index from the database itself,
and hands back rows that are stored slice by slice (decision 108).
"""

import logging
from collections import defaultdict
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from functools import partial
from typing import Any, Concatenate, Final, ParamSpec, TypeVar

import anyio
import msgspec
from sqlalchemy import Connection, Table, and_, delete, func, insert, select, tuple_

from action_assistant.editor.cluster.locks import Exclusively, alone
from action_assistant.editor.history.index_queries import (
    COLUMNS,
    FORM,
    OVERWRITTEN_COLUMNS,
    IndexGrowth,
    growth,
)
from action_assistant.editor.log.graph_events import graph_of, graph_stream
from action_assistant.errors import Refused
from action_assistant.journal.databases import ask_from_worker
from action_assistant.journal.journal import Journal
from action_assistant.schema.editor_tables import (
    editor_head,
    key_change,
    key_change_head,
    overwritten_value,
)
from action_assistant.web.workers.lanes import RunInWorker, run_here

log: Final = logging.getLogger(__name__)

P = ParamSpec("P")
T = TypeVar("T")

_PERIOD: Final = 20.0  # seconds between two searches for indexes that are behind
_FAR: Final = 5_000  # events behind, from which on it is not left for later
#: Rows that one transaction stores or deletes: it takes some milliseconds, for which others wait.
ROWS: Final = 200

_head = key_change_head.c
_TABLES: Final = (key_change, overwritten_value)


class ChangeIndex:
    """Maintains an index, in the database, of the keys that each event of a graph changed. It is
    derived from the log and may be deleted at any time. Its methods raise Unavailable while the
    journal cannot be read or written. `exclusively`: keeps other editors from the same index."""

    def __init__(
        self,
        journal: Journal,
        run_in_worker: RunInWorker = run_here,
        exclusively: Exclusively = alone,
    ) -> None:
        self._journal = journal
        self._exclusively = exclusively
        self._run_in_worker = run_in_worker
        self._catching_up: defaultdict[str, anyio.Lock] = defaultdict(anyio.Lock)

    async def upto(self, graph: str, seq: int | None = None) -> int:
        """Bring the index of a graph up to the change `seq`, or to its newest change. Return the
        last indexed seq, which is less than that only where the log is damaged. Raise
        Unavailable if the journal cannot be read or written."""
        wanted = await self._journal.newest(graph_stream(graph)) if seq is None else seq
        async with self._catching_up[graph]:
            done = await self.head(graph)
            if done >= wanted:
                return done
            return await self._bring_up(graph, wanted)

    async def _bring_up(self, graph: str, wanted: int) -> int:
        async with self._exclusively(f"index {graph}"):
            done = await self.head(graph)
            while done < wanted and (found := await self.value(growth, graph, ROWS)) is not None:
                if found.unreadable:
                    await self._forget(graph)
                    done = 0
                    continue
                await self._keep(graph, found)
                done = found.seq
                if found.damaged:
                    break
            return done

    async def head(self, graph: str) -> int:
        """Return the last change of a graph that is in the index; 0 if it has none."""
        rows = await self._journal.query(
            select(_head.seq).where(_head.graph == graph, _head.form == FORM)
        )
        return rows[0].seq if rows else 0

    async def value(
        self, question: Callable[Concatenate[Connection, P], T], *args: P.args, **kw: P.kwargs
    ) -> T:
        """Call `question` with a database connection and these arguments, on one consistent
        snapshot of the database in a worker process, and return the result. It must be small, since
        the event loop decodes it. Raise the question's errors; Unavailable or TooMany if no worker
        can answer."""
        bound: Callable[..., T] = partial(question, **kw) if kw else question
        if self._run_in_worker is run_here:
            return await self._journal.ask(lambda connection: bound(connection, *args))
        return await self._run_in_worker(_answered, self._journal.address, bound, args)

    async def text(
        self, question: Callable[Concatenate[Connection, P], Any], *args: P.args, **kw: P.kwargs
    ) -> bytes:
        """Call `question` as `value` does, and return the result as JSON, which the worker encodes.
        Raise the errors of `value`."""
        return await self.value(_as_json, partial(question, **kw) if kw else question, args)

    @asynccontextmanager
    async def kept_up(self) -> AsyncIterator[None]:
        """Return a context during which the index is kept up to date in the background, so that a
        request for a history rarely waits."""
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._keep_up)
            yield
            tasks.cancel_scope.cancel()

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
        """Return the graphs whose newest events are not in the index, each with its newest seq and
        the number of missing events. Return none if the journal cannot be read."""
        stream, newest = editor_head.c.stream, editor_head.c.seq
        indexed = func.coalesce(_head.seq, 0)
        same = stream == graph_stream("") + _head.graph
        joined = editor_head.outerjoin(key_change_head, and_(same, _head.form == FORM))
        chosen = select(stream, newest, (newest - indexed).label("more")).select_from(joined)
        chosen = chosen.where(newest > indexed, stream.startswith("graph/"))
        try:
            rows = await self._journal.query(chosen)
        except Refused as error:
            log.warning("changes are not indexed: %s", error.detail)
            return {}
        found = {graph_of(row.stream): (row.seq, row.more) for row in rows}
        return {graph: numbers for graph, numbers in found.items() if graph is not None}

    async def _keep(self, graph: str, found: IndexGrowth) -> None:
        """Store the new rows of a graph's index in slices, so that other commits come in between,
        and then its head (how far the index goes). Rows after the head do not count."""
        if found.leftovers:
            await self._delete_after(graph, found.after)
        for each in found.slices:
            await self._journal.derive(partial(_insert, key_change, COLUMNS, each))
        for each in found.overwritten:
            await self._journal.derive(
                partial(_insert, overwritten_value, OVERWRITTEN_COLUMNS, each)
            )
        head = {"graph": graph, "seq": found.seq, "document": found.document, "form": FORM}

        def keep(connection: Connection) -> None:
            _drop_head(connection, graph)
            connection.execute(insert(key_change_head), [head])

        await self._journal.derive(keep)

    async def _forget(self, graph: str) -> None:
        """Delete the index of a graph: first its head (how far it goes), without which no row
        counts, then the rows."""
        await self._journal.derive(partial(_drop_head, graph=graph))
        await self._delete_after(graph, 0)

    async def _delete_after(self, graph: str, seq: int) -> None:
        for table in _TABLES:
            while await self._journal.derive(partial(_delete_some, table, graph=graph, after=seq)):
                pass


def _answered(url: str, question: Callable[..., T], args: tuple[Any, ...]) -> T:
    """Call `question` with a database connection of this worker process and the arguments `args`,
    and return the result."""
    return ask_from_worker(url, lambda connection: question(connection, *args))


def _as_json(connection: Connection, question: Callable[..., Any], args: tuple[Any, ...]) -> bytes:
    return msgspec.json.encode(question(connection, *args))


def _insert(table: Table, columns: Sequence[str], rows: bytes, connection: Connection) -> None:
    values = [dict(zip(columns, row, strict=True)) for row in msgspec.msgpack.decode(rows)]
    connection.execute(insert(table), values)


def _drop_head(connection: Connection, graph: str) -> None:
    connection.execute(delete(key_change_head).where(_head.graph == graph))


def _delete_some(table: Table, connection: Connection, graph: str, after: int) -> bool:
    """Delete some of the rows of a graph in this table after the change `after`; return whether any
    were deleted."""
    c = table.c
    keys = (c.seq, c.root, c.key)
    some = select(*keys).where(c.graph == graph, c.seq > after).limit(ROWS)
    done = connection.execute(delete(table).where(c.graph == graph, tuple_(*keys).in_(some)))
    return done.rowcount > 0
