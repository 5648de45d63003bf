"""Reads graphs as they are or were, from open rooms and the log, with a small cache."""

import logging
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, Final, Generic, TypeVar

import msgspec

from action_assistant.editor.crdt.loading import stored
from action_assistant.editor.crdt.replica import ReplicaState
from action_assistant.editor.documents import contents
from action_assistant.editor.documents.contents import Counts, GraphAtSeq, GraphInfo
from action_assistant.editor.log.graph_events import DocumentKind, graph_stream
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Conflict, NotFound, Unavailable
from action_assistant.journal.journal import Journal
from action_assistant.umrf.problem_kinds import ToldCounts
from action_assistant.web.workers.lanes import HOPELESS, Crashed, RunInWorker, run_here

log: Final = logging.getLogger(__name__)

T = TypeVar("T")

_REMEMBERED: Final = 32  # moments of graphs
_COUNTED: Final = 5000


class GraphSummary(msgspec.Struct, frozen=True):
    """What a list shows of a graph. `damaged`: the first change that cannot be read. `first`: name and
    description of its first action. What is None is not known, since finding it out takes more than it
    may."""

    seq: int
    name: str | None = None
    description: str | None = None
    actions: int | None = None
    problems: Counts | None = None
    told: ToldCounts | None = None
    robots: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    damaged: int | None = None
    first: tuple[str, str] | None = None

    def called(self, kind: DocumentKind) -> tuple[str | None, str | None]:
        """Name and description; of an action they are those of the action itself."""
        return (self.name, self.description) if kind == "graph" or not self.first else self.first


class GraphReader:
    """Reads graphs. Nothing that it remembers is needed; it only saves reading again."""

    def __init__(
        self, journal: Journal, rooms: Rooms, run_in_worker: RunInWorker = run_here
    ) -> None:
        self._journal = journal
        self._rooms = rooms
        self._run_in_worker = run_in_worker
        self._graph_reader = _Recent[tuple[str, int], GraphAtSeq](_REMEMBERED)
        self._problems = _Recent[tuple[str, int], bytes](_REMEMBERED)
        self._summaries = _Recent[str, GraphSummary](_COUNTED)

    async def now(self, graph: str) -> GraphAtSeq:
        """The graph as it is; of one whose history is damaged, what can be read of it.

        Raises Unavailable, NotFound.
        """
        room = self._rooms.open_room(graph_stream(graph))
        if room is None:
            newest = await self._newest(graph)
            return self._graph_reader.get((graph, newest)) or await self._loaded(graph, newest)
        found = await room.look(
            lambda replica, seq: (
                self._graph_reader.get((graph, seq))
                or GraphAtSeq(graph, seq, replica.doc.get_update())
            )
        )
        return self._graph_reader.put((graph, found.seq), found)

    async def at(self, graph: str, seq: int) -> GraphAtSeq:
        """The graph after its change `seq`. Raises NotFound, Conflict, Unavailable."""
        known = self._graph_reader.get((graph, seq))
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
        """The graph after its change `seq`, or after the last one before it that can be read."""
        found = await stored(
            self._journal, graph_stream(graph), seq, learn=False, run_in_worker=self._run_in_worker
        )
        sight = GraphAtSeq(graph, found.seq, ReplicaState.state_of(found.document))
        return self._graph_reader.put((graph, seq), sight)

    async def moment(self, graph: str, seq: int | None) -> GraphAtSeq:
        """The graph at `seq`, or as it is."""
        return await (self.now(graph) if seq is None else self.at(graph, seq))

    async def ask(self, work: Callable[..., T], /, *values: Any) -> T:
        """The outcome of a function of `contents`, of sights and other values."""
        return await self._run_in_worker(work, *values)

    async def problems(self, sight: GraphAtSeq) -> bytes:
        """What is wrong with a graph at a moment, as JSON."""
        key = sight.graph, sight.seq
        found = self._problems.get(key)
        if found is None:
            found = self._problems.put(key, await self._run_in_worker(contents.problems, sight))
        return found

    def made(self, graph: str, state: bytes, about: GraphInfo) -> None:
        """A graph has been made of this document, and this is to be said of it."""
        self._graph_reader.put((graph, 1), GraphAtSeq(graph, 1, state))
        self._summaries.put(graph, _summary(1, about))

    async def summary(self, graph: str, newest: int) -> GraphSummary:
        """What a list shows of a graph whose last change is `newest`."""
        known = self._summaries.get(graph)
        if known is not None and known.seq >= newest:
            return known
        try:
            sight = await self.now(graph)
            about = await self._run_in_worker(contents.info, sight)
        except HOPELESS as error:  # others are in the list too
            log.error("%s: nothing can be said of change %d: %s", graph, newest, error.detail)
            nothing = GraphSummary(newest)
            # What has died once may have been in somebody's way: the next list tries it again.
            return nothing if isinstance(error, Crashed) else self._summaries.put(graph, nothing)
        return self._summaries.put(graph, _summary(sight.seq, about, newest))

    async def _newest(self, graph: str) -> int:
        newest = await self._journal.newest(graph_stream(graph))
        if newest == 0:
            raise NotFound(f"There is no graph {graph}.")
        return newest


def _summary(seq: int, about: GraphInfo, newest: int = 0) -> GraphSummary:
    return GraphSummary(
        seq,
        about.name,
        about.description,
        about.actions,
        about.problems,
        about.told,
        about.robots,
        about.labels,
        seq + 1 if seq < newest else None,
        about.first,
    )


K = TypeVar("K")
V = TypeVar("V")


class _Recent(Generic[K, V]):
    """The values that were asked for last."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._values: OrderedDict[K, V] = OrderedDict()

    def get(self, key: K) -> V | None:
        value = self._values.get(key)
        if value is not None:
            self._values.move_to_end(key)
        return value

    def put(self, key: K, value: V) -> V:
        self._values[key] = value
        self._values.move_to_end(key)
        if len(self._values) > self._size:
            self._values.popitem(last=False)
        return value
