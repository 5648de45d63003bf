"""The action library: the actions that have a document, and those that graphs use, each name once."""

from collections.abc import Callable
from typing import Final

from anyio import CapacityLimiter, Lock, create_task_group
from sqlalchemy import select

from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.library.action_uses import (
    NOTHING,
    ActionSource,
    as_actions,
    found,
    merged,
)
from action_assistant.editor.log.graph_events import DocumentKind
from action_assistant.journal.journal import Journal
from action_assistant.schema import editor_tables
from action_assistant.web.workers.lanes import HOPELESS

_AT_ONCE: Final = 4  # documents that are read

_Listing = Callable[[list[tuple[ActionSource, bytes]]], bytes]


class Library:
    """Reads a document again only when it has changed."""

    def __init__(self, journal: Journal, graph_reader: GraphReader) -> None:
        self._journal = journal
        self._graph_reader = graph_reader
        self._read: dict[str, tuple[int, bytes]] = {}
        self._reading = Lock()
        self._shown: dict[_Listing, tuple[dict[str, int], bytes]] = {}

    async def all(self) -> bytes:
        """Return every action, sorted by name: the JSON of a list of `LibraryAction`. Documents
        that cannot be read are left out."""
        return await self._listed(merged)

    async def graphs(self) -> bytes:
        """Return every graph as the action that stands for it: the JSON of a list of
        `GraphAsAction`."""
        return await self._listed(as_actions)

    async def _listed(self, listing: _Listing) -> bytes:
        async with self._reading:  # what one request reads the next one has
            sources = await self._sources()
            seqs = {source.document: source.seq for source, _ in sources}
            before = self._shown.get(listing)
            if before is None or before[0] != seqs:
                before = seqs, await self._graph_reader.ask(listing, sources)
                self._shown[listing] = before
            return before[1]

    async def _sources(self) -> list[tuple[ActionSource, bytes]]:
        """Return the action that each document holds, with its text; the document that changed last comes
        first."""
        graph, event = editor_tables.graph, editor_tables.editor_event
        last = (
            select(event.c.seq)
            .where(event.c.stream == "graph/" + graph.c.id)
            .order_by(event.c.seq.desc())
            .limit(1)
        )
        rows = await self._journal.query(
            select(
                graph.c.id,
                graph.c.made_at,
                graph.c.kind,
                last.scalar_subquery().label("seq"),
                last.with_only_columns(event.c.at).scalar_subquery().label("at"),
            )
            .where(graph.c.deleted_at.is_(None), graph.c.draft_of.is_(None))
            .order_by(graph.c.made_at, graph.c.id)
        )
        limit = CapacityLimiter(_AT_ONCE)
        async with create_task_group() as reading:
            for row in rows:
                reading.start_soon(self._refresh, row.id, row.seq, row.kind, limit)
        self._read = {row.id: self._read[row.id] for row in rows}
        return [
            (
                ActionSource(row.id, row.made_at, self._read[row.id][0], row.kind),
                self._read[row.id][1],
            )
            for row in sorted(rows, key=lambda row: row.at, reverse=True)
        ]

    async def _refresh(
        self, graph: str, seq: int, kind: DocumentKind, limit: CapacityLimiter
    ) -> None:
        known = self._read.get(graph)
        if known is not None and known[0] >= seq:
            return
        async with limit:
            try:
                sight = await self._graph_reader.now(graph)
                seq, actions = sight.seq, await self._graph_reader.ask(found, sight, kind)
            except HOPELESS:
                actions = NOTHING
        self._read[graph] = seq, actions
