"""Graphs as they are or were: read from rooms and from the log, checked, remembered for a while."""

from collections import OrderedDict
from typing import Final, Generic, TypeVar

import msgspec

from action_assistant.editor import document
from action_assistant.editor.document import Maps
from action_assistant.editor.happenings import graph_stream
from action_assistant.editor.loading import load
from action_assistant.editor.rooms import Rooms
from action_assistant.errors import Conflict, NotFound, Unavailable
from action_assistant.journal.journal import Journal
from action_assistant.umrf.check import check_written
from action_assistant.umrf.jsontext import parse_small
from action_assistant.umrf.model import Graph, Problem

T = TypeVar("T")

_REMEMBERED: Final = 32  # moments of graphs
_COUNTED: Final = 5000
_LABELS: Final = 20  # of one graph
_LABEL: Final = 60  # characters


class Moment(msgspec.Struct, frozen=True):
    """A graph at one seq of its log."""

    seq: int
    maps: Maps
    graph: Graph


class Counts(msgspec.Struct, frozen=True):
    """How many problems of each severity."""

    error: int
    warning: int


class Summary(msgspec.Struct, frozen=True):
    """What a list shows of a graph. `damaged`: the first change that cannot be read."""

    seq: int
    name: str
    description: str
    actions: int
    problems: Counts
    robots: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    damaged: int | None = None


class Sights:
    """Reads graphs. Nothing that it remembers is needed; it only saves reading again."""

    def __init__(self, journal: Journal, rooms: Rooms) -> None:
        self._journal = journal
        self._rooms = rooms
        self._moments = _Recent[tuple[str, int], Moment](_REMEMBERED)
        self._problems = _Recent[tuple[str, int], list[Problem]](_REMEMBERED)
        self._summaries = _Recent[str, Summary](_COUNTED)

    async def now(self, graph: str) -> Moment:
        """The graph as it is; of one whose history is damaged, what can be read of it.

        Raises Unavailable, NotFound.
        """
        room = self._rooms.open_room(graph_stream(graph))
        if room is None:
            newest = await self._newest(graph)
            return self._moments.get((graph, newest)) or await self._loaded(graph, newest)
        found = await room.look(
            lambda replica, seq: (
                self._moments.get((graph, seq)) or _moment(seq, document.maps_of(replica.doc))
            )
        )
        return self._moments.put((graph, found.seq), found)

    async def at(self, graph: str, seq: int) -> Moment:
        """The graph after its change `seq`. Raises NotFound, Conflict, Unavailable."""
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

    async def _loaded(self, graph: str, seq: int) -> Moment:
        """The graph after its change `seq`, or after the last one before it that can be read."""
        loaded = await load(self._journal, graph_stream(graph), upto=seq)
        try:
            maps = document.maps_of(loaded.replica.doc)
        finally:
            loaded.replica.close()
        return self._moments.put((graph, seq), _moment(loaded.seq, maps))

    async def moment(self, graph: str, seq: int | None) -> Moment:
        """The graph at `seq`, or as it is."""
        return await (self.now(graph) if seq is None else self.at(graph, seq))

    def problems(self, graph: str, moment: Moment) -> list[Problem]:
        """What is wrong with a graph at a moment."""
        found = self._problems.get((graph, moment.seq))
        if found is None:
            found = self._problems.put((graph, moment.seq), check_written(moment.graph))
        return found

    async def summary(self, graph: str, newest: int) -> Summary:
        """What a list shows of a graph whose last change is `newest`."""
        known = self._summaries.get(graph)
        if known is not None and known.seq >= newest:
            return known
        moment = await self.now(graph)
        problems = self.problems(graph, moment)
        errors = sum(problem.severity == "error" for problem in problems)
        return self._summaries.put(
            graph,
            Summary(
                moment.seq,
                moment.graph.name,
                moment.graph.description,
                sum(not action.missing for action in moment.graph.actions),
                Counts(errors, len(problems) - errors),
                tuple(sorted({action.actor for action in moment.graph.actions} - {""})),
                labels_of(moment.graph),
                moment.seq + 1 if moment.seq < newest else None,
            ),
        )

    async def _newest(self, graph: str) -> int:
        newest = await self._journal.newest(graph_stream(graph))
        if newest == 0:
            raise NotFound(f"There is no graph {graph}.")
        return newest


def labels_of(graph: Graph) -> tuple[str, ...]:
    """What people sort the graph under: `labels` in its `gui_attributes`, which no engine reads."""
    attributes = parse_small(dict(graph.extra).get("gui_attributes", "null"))
    labels = attributes.get("labels") if isinstance(attributes, dict) else None
    texts = [text for text in labels if isinstance(text, str)] if isinstance(labels, list) else []
    return tuple(dict.fromkeys(text.strip()[:_LABEL] for text in texts if text.strip()))[:_LABELS]


def _moment(seq: int, maps: Maps) -> Moment:
    return Moment(seq, maps, document.read_maps(maps))


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
