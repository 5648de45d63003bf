"""The course of a run as steps without times, and the first step in which two courses differ.
Pure."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Final, Literal

import msgspec

from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics.script import Script
from action_assistant.umrf.semantics.simulate import CUT_OFF, DAY_MS, simulate
from action_assistant.umrf.semantics.trace import (
    Dispatch,
    GraphResultEvent,
    GraphStateEvent,
    HazardEvent,
    NodeResultEvent,
    Trace,
)

MOST: Final = 20_000  # the most events of one course


class ExpectedStep(msgspec.Struct, frozen=True):
    """One step of a course: it concerns one action of the graph `graph`, or this graph itself if no
    action is named. `how` is the result, state, response or hazard code that `what` announces."""

    graph: str
    node: str
    what: Literal["runs", "result", "state", "ends", "hazard"]
    how: str


class Departure(msgspec.Struct, frozen=True):
    """The first step in which a course differs from the expected one. `place` is its index from 0;
    `expected` or `found` is None if that course ended before it."""

    place: int
    expected: ExpectedStep | None
    found: ExpectedStep | None


def course(
    graph: Graph,
    script: Script,
    most: int = MOST,
    inside: Mapping[str, Graph] | None = None,
) -> tuple[ExpectedStep, ...]:
    """Simulate this graph under this script, and return the steps without times. The same arguments
    always give the same steps.

    `most`: the number of trace events after which the simulation is cut off. `inside`: the graphs
    that can be its sub-graphs, by name.
    """
    traces = simulate(
        graph, script=script, library=inside, facts=SIMULATED, until_ms=DAY_MS, max_events=most
    )
    return steps_of(traces)


def steps_of(traces: Iterable[Trace]) -> tuple[ExpectedStep, ...]:
    """Return the steps of a course among trace events, in the same order; other events are dropped."""
    return tuple(step for trace in traces if (step := _step(trace)) is not None)


def _step(trace: Trace) -> ExpectedStep | None:
    match trace:
        case NodeResultEvent():
            return ExpectedStep(trace.graph, trace.node, "result", trace.result)
        case Dispatch():
            return ExpectedStep(trace.graph, trace.node, "runs", trace.response)
        case GraphResultEvent():
            return ExpectedStep(trace.graph, "", "ends", trace.value)
        case GraphStateEvent():
            return ExpectedStep(trace.graph, "", "state", trace.state)
        case HazardEvent(code=code):  # a cut-off is no step: earlier versions did not record it
            is_cut = code == CUT_OFF
            return None if is_cut else ExpectedStep(trace.graph, trace.node or "", "hazard", code)
        case _:
            return None


def departure(expected: Sequence[ExpectedStep], found: Sequence[ExpectedStep]) -> Departure | None:
    """Return the first step in which `found` differs from `expected`; None if they are equal."""
    for place in range(max(len(expected), len(found))):
        one = expected[place] if place < len(expected) else None
        other = found[place] if place < len(found) else None
        if one != other:
            return Departure(place, one, other)
    return None


def unnamed(steps: Sequence[ExpectedStep]) -> list[ExpectedStep]:
    """Return the steps without the name of the top graph, so that the courses of a graph before and
    after a renaming are equal.

    The graph of the first step is the top graph.
    """
    top = steps[0].graph if steps else ""
    return [
        msgspec.structs.replace(step, graph=step.graph.removeprefix(top).lstrip("_"))
        for step in steps
    ]


_WORDS: Final = {"result": "ends", "runs": "is told to", "state": "is", "hazard": "does"}


def step_text(step: ExpectedStep | None) -> str:
    """Return a step in words that follow "expected" or "found"; "the end" for None."""
    if step is None:
        return "the end"
    if step.what == "ends":
        return f"the graph to end {step.how}"
    return f"{step.node or 'the graph'} {_WORDS[step.what]} {step.how}"
