"""Checks expected courses against a graph as it is now: which it still takes, and which arrows they
cover. Runs in workers."""

import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Final

import msgspec

from action_assistant.errors import BadInput
from action_assistant.runner.analysis.expected_runs import Expected
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.sent_graphs import (
    Inner,
    SentGraph,
    SentSubgraph,
    graphs_in,
    read_inside,
    read_sent,
)
from action_assistant.safe_text import hold_names
from action_assistant.umrf.courses.arrow_search import ArrowReached, ArrowSearch, search_arrow
from action_assistant.umrf.courses.coverage import (
    ArrowCoverage,
    OutcomeArrow,
    TakenArrows,
    arrows_taken,
    arrows_taken_opened,
    coverage,
)
from action_assistant.umrf.courses.expected import check_expected
from action_assistant.umrf.files import codec
from action_assistant.umrf.hierarchy.opening import CannotOpen, opened
from action_assistant.umrf.json.text import JsonObject
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics import script_from
from action_assistant.umrf.semantics.script import script_json
from action_assistant.umrf.semantics.trace import Trace

#: Seconds of processor time for all courses of a graph.
BUDGET_S: Final = 10.0


class CheckRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to check the expected courses of `graph` against the text `umrf`. `subgraphs`: the
    graphs inside; if empty, those stored with each expectation are used."""

    umrf: SentGraph
    graph: str
    subgraphs: tuple[SentSubgraph, ...] = ()


class ProposalRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A graph, and the outcome of an arrow that a test is to take."""

    umrf: SentGraph
    arrow: OutcomeArrow
    subgraphs: tuple[SentSubgraph, ...] = ()


class CheckedCourse(msgspec.Struct, frozen=True, kw_only=True):
    """One checked expected course. `same`: null if there was no time to check it; `why`: where the
    courses differ. `run`: "" for the course of a dry-run."""

    name: str
    run: str
    author: Author
    at: int
    same: bool | None
    why: str = ""
    taken: tuple[OutcomeArrow, ...] = ()
    script: JsonObject

    def __post_init__(self) -> None:
        hold_names(self, "why")


class CheckedCourses(msgspec.Struct, frozen=True):
    """All expected courses of a graph, by name, and the coverage by those that still go the same
    way."""

    courses: list[CheckedCourse]
    coverage: ArrowCoverage


class ArrowProposal(msgspec.Struct, frozen=True, kw_only=True):
    """The result of a search for an arrow. `verdict`: `reached` (with a `script`), `unreachable`
    (after all `states`) or `undecided` (with `why`)."""

    verdict: str
    script: JsonObject | None = None
    states: int = 0
    why: str = ""

    def __post_init__(self) -> None:
        hold_names(self, "why")


def check_courses(
    saved: Iterable[Expected],
    umrf: bytes,
    budget_s: float = BUDGET_S,
    subgraphs: Sequence[SentSubgraph] = (),
) -> CheckedCourses:
    """Simulate the saved expected courses with this graph (`umrf`: its text) and its sub-graphs,
    for at most `budget_s` seconds of processor time, and return where they differ. Raise BadInput,
    NotUmrf or TooLarge if the graph cannot be read."""
    _, reading = read_sent(umrf)
    _, inside = read_inside(subgraphs, "", None, approved=False)
    until = time.thread_time() + budget_s
    found: list[CheckedCourse] = []
    kept: list[TakenArrows] = []
    for each in saved:
        course, took = _checked(each, reading.graph, inside, looks=time.thread_time() < until)
        found.append(course)
        if took is not None:
            kept.append(took)
    return CheckedCourses(found, coverage(reading.graph, kept))


def _checked(
    saved: Expected, now: Graph, inside: Inner, *, looks: bool
) -> tuple[CheckedCourse, TakenArrows | None]:
    """Check one saved course with the graph `now` and its sub-graphs (`inside`); if `looks` is
    false (no time is left), return it unchecked. Also return the arrows that it took; None unless
    it is as expected."""
    unchecked = CheckedCourse(
        name=saved.name,
        run=saved.run,
        author=saved.author,
        at=saved.at,
        same=None,
        script=msgspec.Raw(saved.script.encode()),
    )
    if not looks:
        return unchecked, None
    was = codec.read(saved.umrf.encode()).graph
    script = script_from(msgspec.json.decode(saved.script))
    inside = inside or graphs_in(saved.subgraphs)
    flat: Graph = now
    arrows_in: Callable[[Graph, Sequence[Trace]], TakenArrows] = arrows_taken
    if saved.opened:
        try:
            found = opened(now, inside)
        except CannotOpen as why:
            return msgspec.structs.replace(unchecked, same=False, why=str(why)), None
        tops = {name: levels[0].key for name, levels in found.paths.items()}
        flat = found.graph
        arrows_in = partial(arrows_taken_opened, now, tops)
    check = check_expected(was, saved.course, script, flat, inside, arrows_in)
    same = check.apart is None
    arrows = tuple(sorted(check.taken.arrows))
    course = msgspec.structs.replace(unchecked, same=same, why=check.why, taken=arrows)
    return course, check.taken if same else None


def propose(
    umrf: bytes, arrow: OutcomeArrow, subgraphs: Sequence[SentSubgraph] = ()
) -> ArrowProposal:
    """Search for a script under which the arrow is taken in this graph (`umrf`: its text). Raise
    BadInput if the graph has no such arrow, or BadInput, NotUmrf or TooLarge if it cannot be read.
    """
    _, reading = read_sent(umrf)
    _, inside = read_inside(subgraphs, "", None, approved=False)
    graph = reading.graph
    if not any(
        (each.parent, each.child) == (arrow.parent, arrow.child) for each in graph.relations
    ):
        raise BadInput("The graph has no such arrow.", where={"path": "/arrow"})
    found: ArrowSearch = search_arrow(graph, arrow, inside=inside)
    if isinstance(found, ArrowReached):
        script = msgspec.json.encode(script_json(found.script))
        return ArrowProposal(verdict="reached", script=msgspec.Raw(script))
    return ArrowProposal(**msgspec.to_builtins(found))
