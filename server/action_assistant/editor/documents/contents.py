"""Derives texts, problems and facts from a graph at one seq of its log. Runs in workers, except `GraphAtSeq`.

The event loop knows a graph only as the bytes of its document; what depends on its size is asked of
a worker, which remembers the graphs that it read last.
"""

from typing import Any, Final

import msgspec
from pycrdt import Doc

from action_assistant.editor.documents import document
from action_assistant.editor.documents.document import Maps
from action_assistant.editor.documents.fingerprint import Fingerprint, fingerprint
from action_assistant.editor.documents.thumbnails import thumbnail
from action_assistant.kit.lru_cache import LruCache
from action_assistant.umrf.breakpoints import Breakpoint, breakpoints_in
from action_assistant.umrf.check import check_written
from action_assistant.umrf.checks.subgraphs import Resolution
from action_assistant.umrf.digest import digest, tree_digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import Action, Graph, Problem
from action_assistant.umrf.problem_kinds import ProblemCounts, problem_counts
from action_assistant.umrf.run_size import RunSize

_REMEMBERED: Final = 32  # moments of graphs
_ACTIONS: Final = 20_000  # of them together, besides the newest
_LABELS: Final = 20  # of one graph
_LABEL: Final = 60  # characters


class GraphAtSeq(msgspec.Struct, frozen=True):
    """A graph (its id) after its change `seq`. `state`: its document as one Yjs update."""

    graph: str
    seq: int
    state: bytes


class Inside(msgspec.Struct, frozen=True):
    """The graphs inside of a graph, by the names of the actions that stand for them, each at one
    seq (docs/decisions/070-one-truth-for-sub-graphs.md). `several`: names that several graphs
    have; `cut`: more graphs are inside than listed; `hidden`: names that an action of the
    library has, too; `unseen`: graphs are left out that the person may not see."""

    graphs: tuple[tuple[str, GraphAtSeq], ...] = ()
    several: tuple[str, ...] = ()
    cut: bool = False
    hidden: tuple[str, ...] = ()
    unseen: bool = False

    @property
    def key(self) -> tuple[object, ...]:
        """A cache key, equal for equal graphs after equal changes."""
        moments = tuple((name, each.graph, each.seq) for name, each in self.graphs)
        return moments, self.several, self.cut, self.hidden

    @property
    def resolution(self) -> Resolution:
        """The result of resolving names of actions to graphs, as checks need it."""
        return Resolution(frozenset(self.several), self.cut, frozenset(self.hidden))


NOTHING_INSIDE: Final = Inside()


class ReadGraph(msgspec.Struct, frozen=True):
    """A graph at one seq of its log, read."""

    seq: int
    maps: Maps
    graph: Graph


class Counts(msgspec.Struct, frozen=True):
    """The number of problems of each severity."""

    error: int
    warning: int


class GraphInfo(msgspec.Struct, frozen=True):
    """The facts about a graph that lists show. `problems`, `told`: the problems found, and those
    that people should fix or fill in, both without the graphs inside. `first`: name and
    description of its first action. `uses`: the names of its actions. `thumbnail`: the JSON of its
    `Thumbnail`, empty for none."""

    name: str
    description: str
    actions: int
    problems: Counts
    told: ProblemCounts
    robots: tuple[str, ...]
    labels: tuple[str, ...]
    first: tuple[str, str] | None = None
    uses: tuple[str, ...] = ()
    thumbnail: bytes = b""


class Read:
    """A graph at one seq, and results computed from it."""

    def __init__(self, moment: ReadGraph) -> None:
        self.moment: Final = moment
        self._found: tuple[object, list[Problem]] | None = None

    def problems(self, inside: Inside = NOTHING_INSIDE) -> list[Problem]:
        """Return the problems of the graph, checked with the graphs `inside`. The last result is
        cached."""
        if self._found is None or self._found[0] != inside.key:
            graph = self.moment.graph
            found = check_written(graph, graphs_of(inside), inside.resolution)
            self._found = inside.key, found
        return self._found[1]


_recent: Final = LruCache[tuple[str, int], Read](_REMEMBERED, _ACTIONS)


def read(sight: GraphAtSeq) -> Read:
    """Return a graph at a change (`sight`), decoded from its document; each worker process caches
    the recent ones."""
    key = sight.graph, sight.seq
    found = _recent.get(key)
    if found is None:
        maps = maps_of(sight.state)
        found = Read(ReadGraph(sight.seq, maps, document.read_maps(maps)))
        _recent.put(key, found, len(found.moment.graph.actions))
    return found


def graphs_of(inside: Inside) -> dict[str, Graph]:
    """Return the graphs inside of a graph, keyed by name."""
    return {name: read(sight).moment.graph for name, sight in inside.graphs}


def maps_of(state: bytes) -> Maps:
    """Return the root maps of a document. `state`: the document as one Yjs update."""
    doc: Doc[Any] = Doc()
    doc.apply_update(state)
    return document.maps_of(doc)


def info(sight: GraphAtSeq) -> GraphInfo:
    """Return the facts that lists show about a graph at a change (`sight`), without graphs inside."""
    found = read(sight)
    return info_of(found.moment.graph, found.problems())


def counted(sight: GraphAtSeq, inside: Inside) -> tuple[Counts, ProblemCounts]:
    """Return the number of problems by severity of a graph at a change (`sight`), with the graphs
    inside, and the numbers for people."""
    found = read(sight)
    problems = found.problems(inside)
    return _counts(problems), problem_counts(problems, found.moment.graph)


def names(sight: GraphAtSeq) -> tuple[str, tuple[str, ...]]:
    """Return the name of a graph at a change (`sight`), and the names of its actions."""
    graph = read(sight).moment.graph
    return graph.name, uses_of(graph)


def uses_of(graph: Graph) -> tuple[str, ...]:
    """Return the names of a graph's actions, sorted, each once."""
    return tuple(sorted({action.name for action in graph.actions if not action.missing} - {""}))


def info_of(graph: Graph, problems: list[Problem]) -> GraphInfo:
    """Return the facts that lists show about a graph that was read already and has these problems."""
    return GraphInfo(
        graph.name,
        graph.description,
        sum(not action.missing for action in graph.actions),
        _counts(problems),
        problem_counts(problems, graph),
        tuple(sorted({action.actor for action in graph.actions} - {""})),
        labels_of(graph),
        None if (action := first_action(graph)) is None else (action.name, action.description),
        uses_of(graph),
        thumbnail(graph),
    )


def _counts(problems: list[Problem]) -> Counts:
    errors = sum(problem.severity == "error" for problem in problems)
    return Counts(errors, len(problems) - errors)


def first_action(graph: Graph) -> Action | None:
    """Return the action of a library document: its first one, since clients may write several; None
    if there is none."""
    return next((action for action in graph.actions if not action.missing), None)


def problems(sight: GraphAtSeq, inside: Inside = NOTHING_INSIDE) -> bytes:
    """Return the JSON of the problems of a graph at a change (`sight`), with the graphs inside."""
    return msgspec.json.encode(read(sight).problems(inside))


def breakpoints(sight: GraphAtSeq) -> tuple[Breakpoint, ...]:
    """Return the breakpoints of a graph at a change (`sight`), as a start names them."""
    return breakpoints_in(read(sight).moment.graph)


def umrf(sight: GraphAtSeq, stamp: codec.Stamp | None = None) -> bytes:
    """Return the canonical UMRF text of a graph at a change (`sight`). `stamp`: ids to write into
    it, None for none."""
    return codec.write(read(sight).moment.graph, stamp).encode()


class ReleasedPart(msgspec.Struct, frozen=True):
    """A graph inside of a version: its name, id and content."""

    name: str
    graph: str
    digest: str
    umrf: bytes


class Released(msgspec.Struct, frozen=True):
    """The content of a version to be published. `size`: of the graph together with all graphs
    inside."""

    digest: str
    umrf: bytes
    tree_digest: str
    parts: tuple[ReleasedPart, ...]
    size: RunSize


def released(sight: GraphAtSeq, stamp: codec.Stamp, inside: Inside) -> Released:
    """Return the content of a version of a graph at a change (`sight`): digest and text of it and
    of all graphs inside. `stamp`: ids to write into the text."""
    graph = read(sight).moment.graph
    parts = tuple(_part(name, each) for name, each in inside.graphs)
    own = digest(graph)
    tree = tree_digest(own, ((each.name, each.digest) for each in parts))
    text = _text(graph, stamp)
    texts = len(text) + sum(len(part.umrf) for part in parts)
    actions = sum(len(each.actions) for each in (graph, *graphs_of(inside).values()))
    return Released(own, text, tree, parts, RunSize(texts, actions, len(parts)))


def _part(name: str, sight: GraphAtSeq) -> ReleasedPart:
    graph = read(sight).moment.graph
    return ReleasedPart(
        name, sight.graph, digest(graph), _text(graph, codec.Stamp(graph=sight.graph))
    )


def _text(graph: Graph, stamp: codec.Stamp) -> bytes:
    return codec.write(graph, stamp).strip().encode()


def digest_at(sight: GraphAtSeq) -> str:
    """Return the digest of a graph at a change (`sight`)."""
    return digest(read(sight).moment.graph)


def shown(state: bytes) -> Fingerprint:
    """Return the fingerprint of a document's content. `state`: the document as one Yjs update."""
    return fingerprint(maps_of(state))


def labels_of(graph: Graph) -> tuple[str, ...]:
    """Return the labels by which people group graphs: the texts in `labels` of the graph's
    `gui_attributes`, without blanks around them and each once. No engine reads them."""
    attributes = parse_small(dict(graph.extra).get("gui_attributes", "null"))
    labels = attributes.get("labels") if isinstance(attributes, dict) else None
    texts = [text for text in labels if isinstance(text, str)] if isinstance(labels, list) else []
    return tuple(dict.fromkeys(text.strip()[:_LABEL] for text in texts if text.strip()))[:_LABELS]
