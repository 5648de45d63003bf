"""Resolves the names of actions to graphs of this server; follows the names in documents as the log grows.

See docs/decisions/070-one-truth-for-sub-graphs.md.
"""

import asyncio
import logging
from bisect import insort
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable, Collection, Iterable, Mapping
from contextlib import asynccontextmanager
from typing import Any, Final

import msgspec
from anyio import CapacityLimiter, Lock, create_task_group
from sqlalchemy import Row, func, select

from action_assistant.editor.log.graph_events import DocumentKind
from action_assistant.errors import NotFound, Refused, TooLarge
from action_assistant.journal.journal import Journal
from action_assistant.journal.slots import Cursor, is_later, slot_in
from action_assistant.schema import editor_tables
from action_assistant.schema.editor_tables import editor_event, editor_head
from action_assistant.web.auth.caller import Caller, set_caller
from action_assistant.web.workers.lanes import GaveUp

log: Final = logging.getLogger(__name__)

_AT_ONCE: Final = 4  # documents that are read
_ROWS: Final = 400  # that one question names
#: The caller for whom names are read: its place in the queue of workers is its own.
_OURSELVES: Final = Caller("graph names")

#: The name of a document after a change of it, or of a later one.
ReadName = Callable[[str, int, DocumentKind], Awaitable[str]]
#: Return the names that are known without reading documents, by id. Its argument has the newest change and the kind
#: of each document.
KnownNames = Callable[[Mapping[str, tuple[int, DocumentKind]]], Awaitable[dict[str, str]]]


class NamedGraph(msgspec.Struct, frozen=True):
    """The id of a graph, and the number of its last change as of the last refresh."""

    graph: str
    seq: int


class _Document(msgspec.Struct, frozen=True):
    """A document that counts: neither a draft nor deleted. `name`: "" where it cannot be read."""

    kind: DocumentKind
    made_at: int
    name: str = ""


class GraphNames:
    """Finds graphs and library actions by their names. Each refresh reads only what has changed."""

    def __init__(self, journal: Journal, read_name: ReadName, known_names: KnownNames) -> None:
        self._journal = journal
        self._read_name = read_name
        self._known_names = known_names
        self._refreshing = Lock()
        self._next: asyncio.Task[None] | None = None  # has not begun yet
        self._tasks: set[asyncio.Task[None]] = set()
        self._seen: Cursor | None = None
        self._seqs: dict[str, int] = {}
        self._documents: dict[str, _Document] = {}
        self._again: set[str] = set()  # whose reading died
        self._graphs: dict[str, list[tuple[int, str]]] = {}  # by name, the oldest first
        self._actions: Counter[str] = Counter()

    def graph(self, name: str) -> NamedGraph | None:
        """Return the graph that an action of this name stands for, by the names that the last
        `refresh` read. Return None if no graph has the name, or if an action of the library has it.
        If several graphs have the name, return the oldest of them."""
        found = self._graphs.get(name)
        if not found or self._actions[name]:
            return None
        graph = found[0][1]
        return NamedGraph(graph, self._seqs[graph])

    def of_graphs(self, names: Iterable[str]) -> list[str]:
        """Return those of `names` that a graph has, in their order."""
        graphs = self._graphs
        return [name for name in names if name in graphs]

    def is_hidden(self, name: str) -> bool:
        """Return whether a graph has this name and an action of the library too; then the action counts."""
        return bool(self._actions[name]) and name in self._graphs

    def called(self, name: str) -> list[str]:
        """Return the ids of the graphs with this name, the oldest first."""
        return [graph for _, graph in self._graphs.get(name, ())]

    def is_taken(self, name: str) -> bool:
        """Return whether a graph or an action of the library has this name."""
        return name in self._graphs or bool(self._actions[name])

    @property
    def are_read(self) -> bool:
        """Return whether every name was read once, so that a refresh reads only what has changed since."""
        return self._seen is not None

    async def refresh(self) -> None:
        """Read the names that were stored since the last call. Raise Unavailable if the journal
        cannot be read."""
        await asyncio.shield(self._begun())  # others wait for it too

    @asynccontextmanager
    async def read_ahead(self) -> AsyncIterator[None]:
        """Return a context while which names are read in background tasks, so that the first
        request for a name seldom waits."""
        self._begun()
        try:
            yield
        finally:
            for task in self._tasks:
                task.cancel()

    def _begun(self) -> "asyncio.Task[None]":
        if self._next is None:
            self._next = asyncio.create_task(self._refresh(), name="graph names")
            self._tasks.add(self._next)
            self._next.add_done_callback(self._ended)
        return self._next

    def _ended(self, task: "asyncio.Task[None]") -> None:
        """Remove a refresh task that has ended. Its error is read, so that asyncio logs none if no
        caller waits."""
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()

    async def _refresh(self) -> None:
        set_caller(_OURSELVES)  # it goes on although the first caller has left
        async with self._refreshing:
            self._next = None  # later callers may know of newer events
            seen, seqs, abouts = await self._news()
            self._seqs |= seqs
            changed = await self._look_up(abouts)
            changed |= (seqs.keys() | self._again) & self._documents.keys()
            to_read = sorted(changed & self._seqs.keys())
            limit = CapacityLimiter(_AT_ONCE)
            for start in range(0, len(to_read), _ROWS):
                some = to_read[start : start + _ROWS]
                known = await self._known_names(
                    {graph: (self._seqs[graph], self._documents[graph].kind) for graph in some}
                )
                for graph, name in known.items():
                    self._call(graph, name)
                async with create_task_group() as reading:
                    for graph in some:
                        if graph not in known:
                            reading.start_soon(self._read, graph, limit)
            self._seen = seen

    async def _news(self) -> tuple[Cursor, dict[str, int], set[str]]:
        """Return the moment up to which events were read, the newest change of each document
        that has changed since the last call, and the ids of the documents about which there are
        other new events."""
        seen = self._seen
        if seen is None:
            seen = await self._journal.cursor()
            rows = await self._journal.query(select(editor_head.c.stream, editor_head.c.seq))
        else:
            event = editor_event.c
            newest = select(
                event.stream, func.max(event.seq).label("seq"), func.max(event.position).label("at")
            )
            chosen = newest.where(is_later(event.position, seen))
            rows = await self._journal.query(chosen.group_by(event.stream, slot_in(event.position)))
            for row in rows:
                seen = seen.after(row.at)
        seqs: dict[str, int] = {}
        abouts: set[str] = set()
        for row in rows:
            kind, _, graph = row.stream.partition("/")
            if kind == "graph":
                seqs[graph] = max(row.seq, seqs.get(graph, 0))
            elif kind == "about":
                abouts.add(graph)
        return seen, seqs, abouts

    async def _look_up(self, abouts: Collection[str]) -> set[str]:
        """Read the rows of the documents with the ids `abouts` from the tables. Forget documents
        that are deleted or are drafts, and return the ids of documents that are new here."""
        ids = sorted(abouts)
        fresh: set[str] = set()
        graph = editor_tables.graph.c
        fields = (graph.id, graph.kind, graph.made_at, graph.deleted_at, graph.draft_of)
        for start in range(0, len(ids), _ROWS):
            chosen = select(*fields).where(graph.id.in_(ids[start : start + _ROWS]))
            for row in await self._journal.query(chosen):
                if row.deleted_at is not None or row.draft_of is not None:
                    self._set_document(row.id, None)
                elif row.id not in self._documents:
                    self._set_document(row.id, _as_document(row))
                    fresh.add(row.id)
        return fresh

    async def _read(self, graph: str, limit: CapacityLimiter) -> None:
        async with limit:
            try:
                name = await self._read_name(graph, self._seqs[graph], self._documents[graph].kind)
            except (GaveUp, TooLarge, NotFound):
                name = ""
            except Refused:  # not now
                self._again.add(graph)
                return
            except Exception:  # whatever one document holds, the names of the others are read
                log.exception("%s: its name cannot be read", graph)
                name = ""
            self._call(graph, name)

    def _call(self, graph: str, name: str) -> None:
        """Store the name that was read of a document."""
        self._again.discard(graph)
        self._set_document(graph, msgspec.structs.replace(self._documents[graph], name=name))

    def _set_document(self, graph: str, document: _Document | None) -> None:
        """Replace what is stored of the document with this id by `document`; None removes it, since
        it was deleted or is a draft."""
        before = self._documents.pop(graph, None)
        if before is not None and before.name:
            if before.kind == "action":
                self._actions -= Counter((before.name,))
            else:
                self._graphs[before.name].remove((before.made_at, graph))
                if not self._graphs[before.name]:
                    del self._graphs[before.name]
        if document is None:
            return
        self._documents[graph] = document
        if document.name and document.kind == "action":
            self._actions[document.name] += 1
        elif document.name:
            insort(self._graphs.setdefault(document.name, []), (document.made_at, graph))


def _as_document(row: Row[Any]) -> _Document:
    return _Document(row.kind, row.made_at)
