"""Stores the facts that lists show of each graph, so that after a restart no document is read for them.

The table is a cache: a row that is missing, or that another version of this program wrote, is
computed again from the document.
"""

import asyncio
import logging
import sys
from collections.abc import AsyncIterator, Collection, Sequence
from contextlib import asynccontextmanager
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Final

import msgspec
from sqlalchemy import Connection, delete, insert, select

from action_assistant.editor.documents.contents import Counts, GraphInfo
from action_assistant.errors import Refused
from action_assistant.journal.journal import Journal
from action_assistant.kit.lru_cache import LruCache
from action_assistant.schema.editor_tables import graph_facts
from action_assistant.umrf.problem_kinds import ProblemCounts

log: Final = logging.getLogger(__name__)

_REMEMBERED: Final = 20_000  # graphs
_NAMES: Final = 500_000  # of actions, over all graphs that are remembered
_ROWS: Final = 200  # in one query or transaction
_PERIOD: Final = 1.0  # seconds between two transactions
#: The code on which the facts depend.
_SOURCES: Final = ("umrf", "editor/documents", "editor/crdt")


class CountsInside(msgspec.Struct, frozen=True):
    """The problems of a graph together with the graphs inside of it, of which `key` is the digest."""

    key: bytes
    problems: Counts
    told: ProblemCounts


class Facts(msgspec.Struct, frozen=True):
    """The facts about a graph after its change `seq`, the last one that can be read. `newest`: its
    last change when they were computed. `is_current`: this version of the program computed them;
    the problems of others may be counted in another way."""

    seq: int
    newest: int
    info: GraphInfo
    inside: CountsInside | None = None
    is_current: bool = True


class GraphFacts:
    """Remembers the facts about graphs: in memory, and in a table for the next start."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._known = LruCache[str, Facts](_REMEMBERED, _NAMES)
        self._unwritten: dict[str, Facts] = {}
        self._changed = asyncio.Event()

    def get(self, graph: str) -> Facts | None:
        """Return what is in memory about the graph with this id; None if that is nothing."""
        return self._known.get(graph)

    def put(self, graph: str, facts: Facts) -> Facts:
        """Remember facts that were computed now, and return them."""
        self._unwritten[graph] = facts
        self._changed.set()
        return self._put(graph, facts)

    async def recall(self, graphs: Collection[str]) -> None:
        """Bring what the table has about the graphs with these ids into memory. Raise Unavailable
        if the journal cannot be read."""
        missing = [graph for graph in graphs if self._known.get(graph) is None]
        for start in range(0, len(missing), _ROWS):
            some = missing[start : start + _ROWS]
            rows = await self._journal.query(
                select(graph_facts).where(graph_facts.c.graph.in_(some))
            )
            for row in rows:
                try:
                    found = msgspec.msgpack.decode(row.facts, type=Facts)
                except msgspec.DecodeError as error:
                    log.warning("%s: the stored facts cannot be read: %s", row.graph, error)
                    continue
                if self._known.get(row.graph) is None:  # an edit may have come first
                    is_current = row.form == form()
                    self._put(row.graph, msgspec.structs.replace(found, is_current=is_current))

    @asynccontextmanager
    async def kept_up(self) -> AsyncIterator[None]:
        """Return a context while which new facts are written in the background, and at its end."""
        writing = asyncio.create_task(self._keep_writing(), name="facts of graphs")
        try:
            yield
        finally:
            writing.cancel()
            await asyncio.wait([writing])
            await self._write()

    async def _keep_writing(self) -> None:
        while True:
            await self._changed.wait()
            await asyncio.sleep(_PERIOD)  # of many edits only the last one counts
            await self._write()

    async def _write(self) -> None:
        self._changed.clear()
        unwritten, self._unwritten = self._unwritten, {}
        graphs = list(unwritten)
        for start in range(0, len(graphs), _ROWS):
            some = [(graph, unwritten[graph]) for graph in graphs[start : start + _ROWS]]
            try:
                await self._journal.derive(partial(_replace, _rows(some)))
            except Refused as error:  # the next start computes them again
                log.warning("facts of %d graphs are not stored: %s", len(some), error.detail)

    def _put(self, graph: str, facts: Facts) -> Facts:
        uses = tuple(map(sys.intern, facts.info.uses))  # most graphs use the same actions
        info = msgspec.structs.replace(facts.info, uses=uses)
        return self._known.put(graph, msgspec.structs.replace(facts, info=info), len(uses))


@cache
def form() -> bytes:
    """Return a digest of the code that computes the facts, in bytes. Facts of another version have another one."""
    package = Path(__file__).resolve().parents[2]
    files = sorted(path for each in _SOURCES for path in (package / each).rglob("*.py"))
    return sha256(b"".join(sha256(path.read_bytes()).digest() for path in files)).digest()


def _rows(some: Sequence[tuple[str, Facts]]) -> list[dict[str, object]]:
    encode = msgspec.msgpack.encode
    return [{"graph": graph, "form": form(), "facts": encode(facts)} for graph, facts in some]


def _replace(rows: Sequence[dict[str, object]], connection: Connection) -> None:
    graphs = [row["graph"] for row in rows]
    connection.execute(delete(graph_facts).where(graph_facts.c.graph.in_(graphs)))
    connection.execute(insert(graph_facts), rows)
