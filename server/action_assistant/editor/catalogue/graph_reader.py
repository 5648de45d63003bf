"""Reads graphs as they are or were, from open rooms and the log, with a small cache."""

from collections.abc import Callable
from typing import Any, Final, TypeVar

from action_assistant.editor.crdt.loading import stored
from action_assistant.editor.crdt.messages import NOTHING_NEW
from action_assistant.editor.crdt.replica import ReplicaState
from action_assistant.editor.documents.contents import GraphAtSeq
from action_assistant.editor.log.graph_events import graph_stream
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Conflict, NotFound, Unavailable
from action_assistant.journal.journal import Journal
from action_assistant.kit.lru_cache import LruCache
from action_assistant.web.workers.lanes import RunInWorker, run_here

T = TypeVar("T")

_REMEMBERED: Final = 32  # moments of graphs


class GraphReader:
    """Reads graphs as they are or were after a change, from their rooms or the log. All that it
    stores is a cache."""

    def __init__(
        self, journal: Journal, rooms: Rooms, run_in_worker: RunInWorker = run_here
    ) -> None:
        self._journal = journal
        self._rooms = rooms
        self._run_in_worker = run_in_worker
        self._moments = LruCache[tuple[str, int], GraphAtSeq](_REMEMBERED)

    async def now(self, graph: str) -> GraphAtSeq:
        """Return the graph as it is now. If its history is damaged, return the last state that can
        be read. Raise Unavailable if the log cannot be read, NotFound if there is no such graph."""
        room = self._rooms.open_room(graph_stream(graph))
        if room is None:
            newest = await self._newest(graph)
            return self._moments.get((graph, newest)) or await self._loaded(graph, newest)
        found = GraphAtSeq(graph, *await room.now())
        return self._moments.put((graph, found.seq), found)

    async def at(self, graph: str, seq: int) -> GraphAtSeq:
        """Return the graph after its change `seq`. Raise Conflict if it has no such change,
        NotFound if there is no such graph, Unavailable if the log cannot be read."""
        known = self._moments.get((graph, seq))
        if known is not None and known.seq == seq:
            return known
        room = self._rooms.open_room(graph_stream(graph))
        if room is not None and room.seq == seq:
            found = await self.now(graph)
            if found.seq == seq:
                return found
        newest = await self._newest(graph)
        if not 1 <= seq <= newest:
            raise Conflict(
                f"This graph has the changes 1 to {newest}; there is no {seq}.",
                where={"path": "/seq"},
            )
        found = await self._loaded(graph, seq)
        if found.seq < seq:
            raise Unavailable(
                f"Change {found.seq + 1} of this graph's history is damaged; those before it can "
                "be read."
            )
        return found

    async def _loaded(self, graph: str, seq: int) -> GraphAtSeq:
        """Load the graph after its change `seq` from the log. If that state cannot be read, return
        the state after the last earlier change that can be read. Raise Unavailable if the log
        cannot be read."""
        found = await stored(
            self._journal, graph_stream(graph), seq, learn=False, run_in_worker=self._run_in_worker
        )
        kept = await ReplicaState.read_aside(found.document)
        sight = GraphAtSeq(graph, found.seq, NOTHING_NEW if kept is None else kept.state)
        return self._moments.put((graph, seq), sight)

    async def moment(self, graph: str, seq: int | None) -> GraphAtSeq:
        """Return the graph after its change `seq`, or its present state for None. Raise Conflict if
        it has no such change, NotFound if there is no such graph, Unavailable if the log cannot be
        read."""
        return await (self.now(graph) if seq is None else self.at(graph, seq))

    def made(self, graph: str, state: bytes) -> None:
        """Remember the state of a new graph, which is its state after change 1."""
        self._moments.put((graph, 1), GraphAtSeq(graph, 1, state))

    async def ask(self, work: Callable[..., T], /, *values: Any) -> T:
        """Call `work`, a function of `contents`, in a worker process with the arguments `values`,
        and return its result."""
        return await self._run_in_worker(work, *values)

    async def _newest(self, graph: str) -> int:
        newest = await self._journal.newest(graph_stream(graph))
        if newest == 0:
            raise NotFound(f"There is no graph {graph}.")
        return newest
