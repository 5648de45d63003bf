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
    """One step of a course: an event of an action, or of the graph if no action is named."""

    graph: str
    node: str
    what: Literal["runs", "result", "state", "ends", "hazard"]
    how: str


class Departure(msgspec.Struct, frozen=True):
    """The first step in which a course differs from the expected one. A step is None where that
    course has ended."""

    place: int
    expected: ExpectedStep | None
    found: ExpectedStep | None


def course(
    graph: Graph,
    script: Script,
    most: int = MOST,
    inside: Mapping[str, Graph] | None = None,
) -> tuple[ExpectedStep, ...]:
    """Return the steps of this graph under this script, with the graphs of `inside` as sub-graphs,
    up to `most` trace events.

    Deterministic; times are left out.
    """
    traces = simulate(
        graph, script=script, library=inside, facts=SIMULATED, until_ms=DAY_MS, max_events=most
    )
    return steps_of(traces)


def steps_of(traces: Iterable[Trace]) -> tuple[ExpectedStep, ...]:
    """Return the steps of a trace."""
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
    """Return the first step in which the second course differs from the first; None if they are
    equal."""
    for place in range(max(len(expected), len(found))):
        one = expected[place] if place < len(expected) else None
        other = found[place] if place < len(found) else None
        if one != other:
            return Departure(place, one, other)
    return None


def unnamed(steps: Sequence[ExpectedStep]) -> list[ExpectedStep]:
    """Return the steps without the name of the top graph, so that a renamed graph compares
    equal."""
    top = steps[0].graph if steps else ""
    return [
        msgspec.structs.replace(step, graph=step.graph.removeprefix(top).lstrip("_"))
        for step in steps
    ]


_WORDS: Final = {"result": "ends", "runs": "is told to", "state": "is", "hazard": "does"}


def step_text(step: ExpectedStep | None) -> str:
    """Return a step in words."""
    if step is None:
        return "the end"
    if step.what == "ends":
        return f"the graph to end {step.how}"
    return f"{step.node or 'the graph'} {_WORDS[step.what]} {step.how}"
