"""What can be derived from a graph at one seq of its log. For workers, except `GraphAtSeq`.

The event loop knows a graph only as the bytes of its document; what depends on its size is asked of
a worker, which remembers the graphs that it read last.
"""

from collections import OrderedDict
from functools import cached_property
from typing import Any, Final

import msgspec
from pycrdt import Doc

from action_assistant.editor.documents import document
from action_assistant.editor.documents.document import Maps
from action_assistant.editor.documents.fingerprint import Fingerprint, fingerprint
from action_assistant.umrf.check import check_written
from action_assistant.umrf.difference import difference
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import Action, Graph, Problem
from action_assistant.umrf.problem_kinds import ToldCounts, told_counts

_REMEMBERED: Final = 4  # moments of graphs
_LABELS: Final = 20  # of one graph
_LABEL: Final = 60  # characters


class GraphAtSeq(msgspec.Struct, frozen=True):
    """A graph at one seq of its log: its document as one Yjs update."""

    graph: str
    seq: int
    state: bytes


class ReadGraph(msgspec.Struct, frozen=True):
    """A graph at one seq of its log, read."""

    seq: int
    maps: Maps
    graph: Graph


class Counts(msgspec.Struct, frozen=True):
    """How many problems of each severity."""

    error: int
    warning: int


class GraphInfo(msgspec.Struct, frozen=True):
    """What lists say of a graph. `told`: of its problems, those that people are told to mend or to
    fill in, one thing once. `first`: name and description of its first action."""

    name: str
    description: str
    actions: int
    problems: Counts
    told: ToldCounts
    robots: tuple[str, ...]
    labels: tuple[str, ...]
    first: tuple[str, str] | None = None


class Read:
    """A moment, and what was found out about it."""

    def __init__(self, moment: ReadGraph) -> None:
        self.moment: Final = moment

    @cached_property
    def problems(self) -> list[Problem]:
        """What is wrong with the graph."""
        return check_written(self.moment.graph)


_recent: "Final[OrderedDict[tuple[str, int], Read]]" = OrderedDict()


def read(sight: GraphAtSeq) -> Read:
    """A graph, read once by each worker."""
    key = sight.graph, sight.seq
    found = _recent.get(key)
    if found is None:
        maps = maps_of(sight.state)
        found = _recent[key] = Read(ReadGraph(sight.seq, maps, document.read_maps(maps)))
        if len(_recent) > _REMEMBERED:
            _recent.popitem(last=False)
    _recent.move_to_end(key)
    return found


def maps_of(state: bytes) -> Maps:
    """What a document holds."""
    doc: Doc[Any] = Doc()
    doc.apply_update(state)
    return document.maps_of(doc)


def info(sight: GraphAtSeq) -> GraphInfo:
    """What a list shows."""
    found = read(sight)
    return info_of(found.moment.graph, found.problems)


def info_of(graph: Graph, problems: list[Problem]) -> GraphInfo:
    """As `info`, of a graph that was read already."""
    errors = sum(problem.severity == "error" for problem in problems)
    return GraphInfo(
        graph.name,
        graph.description,
        sum(not action.missing for action in graph.actions),
        Counts(errors, len(problems) - errors),
        told_counts(problems, graph),
        tuple(sorted({action.actor for action in graph.actions} - {""})),
        labels_of(graph),
        None if (action := first_action(graph)) is None else (action.name, action.description),
    )


def first_action(graph: Graph) -> Action | None:
    """The action of which the document of a library's action tells. Clients may write anything: of
    several it is the first."""
    return next((action for action in graph.actions if not action.missing), None)


def problems(sight: GraphAtSeq) -> bytes:
    """What is wrong, as JSON."""
    return msgspec.json.encode(read(sight).problems)


def umrf(sight: GraphAtSeq, stamp: codec.Stamp | None = None) -> bytes:
    """The canonical text."""
    return codec.write(read(sight).moment.graph, stamp).encode()


def released(sight: GraphAtSeq, stamp: codec.Stamp) -> tuple[str, bytes]:
    """The digest and the text of a version."""
    graph = read(sight).moment.graph
    return digest(graph), codec.write(graph, stamp).strip().encode()


def differing(before: GraphAtSeq, after: GraphAtSeq) -> bytes:
    """What differs, as JSON."""
    then, later = read(before).moment, read(after).moment
    return msgspec.json.encode(difference((then.seq, then.graph), (later.seq, later.graph)))


def shown(state: bytes) -> Fingerprint:
    """The fingerprint of what a document shows."""
    return fingerprint(maps_of(state))


def labels_of(graph: Graph) -> tuple[str, ...]:
    """What people sort the graph under: `labels` in its `gui_attributes`, which no engine reads."""
    attributes = parse_small(dict(graph.extra).get("gui_attributes", "null"))
    labels = attributes.get("labels") if isinstance(attributes, dict) else None
    texts = [text for text in labels if isinstance(text, str)] if isinstance(labels, list) else []
    return tuple(dict.fromkeys(text.strip()[:_LABEL] for text in texts if text.strip()))[:_LABELS]
