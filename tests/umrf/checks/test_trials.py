"""Every single deviation is tried, at any size, and ends as the simulated engine says."""

import json
import time
from typing import Any

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from action_assistant.umrf.check import check
from action_assistant.umrf.checks.trials import Trials
from action_assistant.umrf.courses.baseline import BaselineCourse, Outcome
from action_assistant.umrf.courses.deviations import DeviatingCourses, SimultaneousEnds
from action_assistant.umrf.courses.network import Network
from action_assistant.umrf.courses.simulated import simulated_outcome
from action_assistant.umrf.files.codec import read
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Relation,
)
from support.doses import examples
from umrf.drawn import busy_graphs
from umrf.shapes import GROWING

# Against the engine


def told(outcome: Outcome) -> Outcome:
    """Return the part of an outcome that is reported, without who asked last and how far the course
    was followed."""
    if outcome.kind != "stuck":
        return Outcome(outcome.kind, outcome.early)
    return outcome._replace(cut=False, last=-1)


@given(busy_graphs(), st.booleans(), st.booleans())
@settings(max_examples=examples(250), deadline=None, suppress_health_check=list(HealthCheck))
def test_a_deviation_ends_as_when_the_engine_goes_through_all_of_it(
    graph: Graph, slower_first: bool, backwards: bool
) -> None:
    """The result does not depend on the order of trials, although outcomes of one trial are kept
    for the others."""
    net = Network(graph, slower_first=slower_first)
    course = BaselineCourse(net)
    assume(not course.tied)
    assert told(course.outcome) == told(simulated_outcome(net, graph, "", "on_true")[0])
    deviations = DeviatingCourses(course)
    ways = [(name, outcome) for name in net.names for outcome in ("on_false", "on_error")]
    for name, outcome in reversed(ways) if backwards else ways:
        try:
            found = deviations.outcome(net.index[name], outcome)  # type: ignore[arg-type]
        except SimultaneousEnds:
            continue
        assert told(found) == told(simulated_outcome(net, graph, name, outcome)[0]), (name, outcome)


def test_a_deviating_course_continues_after_the_end_of_the_baseline() -> None:
    """A graph that A0 ends while A1 begins; if A0 is false, A1 goes on to an end of its own."""
    arrows = [
        Relation(parent=ENTRY, child="k0", conditions=ENTRY_CONDITIONS),
        Relation(parent="k0", child="k1", conditions=Conditions("run", "run")),
        Relation(parent="k1", child="k2", conditions=Conditions("run")),
        Relation(parent="k0", child=EXIT, conditions=Conditions("run")),
    ]
    actions = tuple(Action(key=f"k{n}", name=f"A{n}") for n in range(3))
    ends = {t.outcome: t.end.kind for t in Trials(Graph(name="g", actions=actions, relations=tuple(arrows))) if t.action is None or t.action.name == "A0"}  # fmt: skip
    assert ends == {"": "finished", "on_false": "halted", "on_error": "halted"}


def test_a_bypass_passes_the_outcome_on_so_it_is_tried_though_it_is_the_answer_to_all() -> None:
    """A1 bypasses A0 whether true or an error; with an error A0 bypasses A1, round and round."""
    bypassing = Conditions("bypass", "run", "bypass", "run")
    arrows = (
        Relation(parent=ENTRY, child="k0", conditions=ENTRY_CONDITIONS),
        Relation(
            parent="k0", child="k1", conditions=Conditions("run", "run", "bypass"), required=False
        ),
        Relation(parent="k1", child="k0", conditions=bypassing, required=False),
    )
    actions = tuple(Action(key=f"k{n}", name=f"A{n}") for n in range(2))
    trials = Trials(Graph(name="g", actions=actions, relations=arrows))
    ends = {(t.action.name, t.outcome): t.end.kind for t in trials if t.action is not None}
    assert ends["A1", "on_error"] == "locked"


@given(busy_graphs(8))
@settings(max_examples=examples(60), deadline=None, suppress_health_check=list(HealthCheck))
def test_a_course_that_is_not_tried_ends_like_the_baseline(graph: Graph) -> None:
    """An outcome that no child answers in another way is no way of its own."""
    trials = Trials(graph)
    ways = {(t.action.full_name if t.action else "", t.outcome) for t in trials}
    usual = told(simulated_outcome(trials.net, graph, "", "on_true")[0])
    for name in trials.net.names:
        for outcome in ("on_false", "on_error"):
            if (name, outcome) not in ways:
                assert told(simulated_outcome(trials.net, graph, name, outcome)[0]) == usual


# At any size


def action(name: str, parents: list[Any], children: list[str], **fields: Any) -> dict[str, Any]:
    listed = [{"name": child} for child in children]
    return {"name": name, "type": "sync", "parents": parents, "children": listed} | fields


def trap(count: int, at: int) -> Graph:
    """A chain in which `on_false` of one action stops the next, which does not run: then nothing
    runs any more and the graph stays RUNNING. All other ways end it."""
    names = [f"A{n}" for n in range(count)]
    actions = []
    for n, name in enumerate(names):
        said = ["on_false -> stop"] if n == at + 1 else []
        parents = [{"name": above, "conditions": said} for above in names[max(0, n - 1) : n]]
        actions.append(action(name, parents, names[n + 1 : n + 2]))
    ends = {"graph_entry": [{"name": "A0"}], "graph_exit": [{"name": names[-1]}]}
    return read(json.dumps({"graph_name": "g", "actions": actions} | ends)).graph


@pytest.mark.parametrize(
    ("count", "at"), [(60, 20), (60, 50), (60, 58), (1_000, 990), (2_500, 20), (2_500, 2_400)]
)
def test_a_trap_is_found_wherever_it_stands(count: int, at: int) -> None:
    found = [p for p in check(trap(count, at)) if p.code == "H8"]
    assert [p.message for p in found] == [
        f"If A{at}_0 ends with on_false, the graph stays RUNNING for ever: nothing runs any more."
    ]
    assert found[0].where.path == f"/actions/{at}"


@pytest.mark.turns
@pytest.mark.parametrize(
    "shape",
    [
        pytest.param(each, marks=pytest.mark.long if each.endswith("-default") else ())
        for each in GROWING
    ],
)
def test_every_way_through_a_large_graph_of_any_shape_is_tried(shape: str) -> None:
    graph = read(json.dumps(GROWING[shape](1_000))).graph
    started = time.process_time()
    trials = Trials(graph)
    ends = list(trials)
    assert time.process_time() - started < 20  # a square would take minutes
    coverage = trials.coverage()
    assert coverage.tried == coverage.ways == len(ends) > 150


def test_courses_that_are_not_tried_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("action_assistant.umrf.checks.trials.BUDGET", 20)
    (problem,) = [p for p in check(trap(60, 50)) if p.code == "not-tried"]
    assert problem.severity == "warning"
    assert "were tried" in problem.message
    assert "on none was" in problem.message
