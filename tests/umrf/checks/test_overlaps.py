"""H4, H5 and H12 are reported for everything that can happen and for nothing else, each thing
once."""

import json
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from action_assistant.umrf.check import check
from action_assistant.umrf.checks.concurrency import Concurrency
from action_assistant.umrf.checks.flow import Reachability
from action_assistant.umrf.checks.places import Subject
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files.codec import read
from action_assistant.umrf.model import Graph, Problem
from action_assistant.umrf.semantics import (
    Behaviour,
    EdgeEval,
    HazardEvent,
    NodeResultEvent,
    NodeStateEvent,
    Script,
    simulate,
)
from support.doses import examples
from umrf.drawn import busy_graphs

SAFE = ["on_error -> ignore"]
Calls = list[tuple[str, float, float]]
CALLS = st.lists(
    st.tuples(st.sampled_from(["on_true", "on_false", "on_error"]), st.sampled_from([0.1, 0.7, 1.3, 3.1]),
              st.sampled_from([0.0, 0.0, 0.4, 1.5, 8.0])),
    min_size=24, max_size=24,
)  # fmt: skip


def scripted(graph: Graph, calls: Calls) -> Script:
    """Two calls for each action."""
    pairs = zip(calls[::2], calls[1::2], strict=True)
    return Script(
        {
            action.full_name: tuple(Behaviour(result=r, after_s=t, load_s=o) for r, t, o in each)
            for action, each in zip(graph.actions, pairs, strict=False)
        }
    )


@given(busy_graphs(), CALLS)
@settings(max_examples=examples(200), deadline=None, suppress_health_check=list(HealthCheck))
def test_actions_that_run_at_once_in_a_simulation_may_run_at_once(
    graph: Graph, calls: Calls
) -> None:
    subject = Subject(graph, PINNED)
    reach = Reachability(subject)
    together = Concurrency(subject, reach.runs, reach.reports)
    keys = {action.full_name: action.key for action in graph.actions}
    now: set[str] = set()
    for trace in simulate(graph, script=scripted(graph, calls), max_events=400, until_ms=60_000):
        match trace:
            case NodeStateEvent(node=node, state="RUNNING" | "PAUSED" | "STOPPING"):
                now.add(node)
                for other in now - {node}:
                    assert together.may_run(keys[node], keys[other])
                    assert together.may_run(keys[other], keys[node])
            case (
                NodeResultEvent(node=node) | NodeStateEvent(node=node)
            ):  # it informs its children after its end
                now.discard(node)
            case _:
                pass


@st.composite
def lively_graphs(draw: st.DrawFn) -> Graph:
    """Busy graphs of which some actions are spontaneous."""
    graph = draw(busy_graphs())
    kinds = draw(
        st.lists(st.sampled_from(["sync", "sync", "sync", "spontaneous"]), min_size=12, max_size=12)
    )
    actions = tuple(
        replace(each, type=kind) for each, kind in zip(graph.actions, kinds, strict=False)
    )
    return replace(graph, actions=actions)


@pytest.mark.turns
@given(st.one_of(busy_graphs(), lively_graphs()), CALLS)
@settings(max_examples=examples(300), deadline=None, suppress_health_check=list(HealthCheck))
def test_a_hazard_of_any_simulation_is_reported_by_check(graph: Graph, calls: Calls) -> None:
    told = {problem.code for problem in check(graph)}
    failed = False  # what halts a graph by an error is not told
    for trace in simulate(graph, script=scripted(graph, calls), max_events=400, until_ms=60_000):
        if isinstance(trace, EdgeEval):
            failed = trace.eval.startswith("on_error")
        elif isinstance(trace, NodeResultEvent):
            failed = trace.result == "on_error"
        if not isinstance(trace, HazardEvent) or (trace.code == "H14" and failed):
            continue
        if trace.code in ("H3", "H4", "H12", "H14"):
            assert trace.code in told, trace


def action(name: str, parents: Any = (), children: Any = ()) -> dict[str, Any]:
    sides = {
        "parents": [{"name": p, "conditions": SAFE} if isinstance(p, str) else p for p in parents],
        "children": [{"name": c} for c in children],
    }
    return {"name": name, "type": "sync"} | sides


def graph(*actions: dict[str, Any], entry: Any = ("A",), exits: Any = ()) -> Graph:
    ends = [{"name": e, "conditions": SAFE} if isinstance(e, str) else e for e in exits]
    file = {"graph_name": "g", "actions": list(actions), "graph_exit": ends}
    return read(json.dumps(file | {"graph_entry": [{"name": e} for e in entry]})).graph


def found(value: Graph, code: str) -> list[Problem]:
    return [problem for problem in check(value) if problem.code == code]


def asks(name: str, *said: str) -> dict[str, Any]:
    return {"name": name, "required": False, "conditions": [*said, *SAFE]}


def test_a_pause_of_an_action_that_cannot_run_then_is_ignored() -> None:
    """C is asked to pause before it ever ran."""
    pausing = asks("A", "on_true -> pause", "on_false -> ignore")
    idle = graph(action("A", children=["B", "C"]), action("B", ["A"], ["C"]),
                 action("C", [pausing, asks("B")]), exits=["C"])  # fmt: skip
    assert found(idle, "H5") == []
    assert found(idle, "H4") == []
    beside = graph(action("A", children=["C"]), action("C", [pausing]), entry=["A", "C"])
    assert "only a pause and a resume" in found(beside, "H5")[0].message


def together(value: Graph) -> Concurrency:
    subject = Subject(value, PINNED)
    reach = Reachability(subject)
    return Concurrency(subject, reach.runs, reach.reports)


def test_an_action_that_starts_again_runs_beside_one_that_waited_for_it() -> None:
    """B begins with the graph, and again when A ends; C needs both."""
    twice = graph(action("A", children=["B", "C"]),
                  action("B", [{"name": "A", "required": False, "conditions": SAFE}], ["C"]),
                  action("C", ["A", "B"]), entry=["A", "B"])  # fmt: skip
    _, again, joined = (each.key for each in twice.actions)
    assert together(twice).may_run(again, joined)
    once = graph(action("A", children=["B", "C"]), action("B", ["A"], ["C"]),
                 action("C", ["A", "B"]))  # fmt: skip
    _, first, after = (each.key for each in once.actions)
    assert not together(once).may_run(first, after)


def test_a_bypassed_action_has_reported_before_its_parent_begins() -> None:
    """A bypasses F, which C leads to; J needs B and F, so that it begins when C does."""
    value = graph(action("A", children=["B", "F"]), action("B", ["A"], ["C", "J"]),
                  action("C", ["B"], ["F"]),
                  action("F", [asks("A", "on_true -> bypass"), "C"], ["J"]),
                  action("J", ["B", "F"]))  # fmt: skip
    _, _, before, _, joined = (each.key for each in value.actions)
    assert together(value).may_run(joined, before)


def test_actions_in_sequence_are_not_run_during_a_stop() -> None:
    """Three in a circle and a timer that stops them all: only one of them runs at a time."""
    stop = asks("T", "on_true -> stop", "on_false -> stop")
    names = "ABC"
    ring = [
        action(name, [asks(names[n - 1]), stop], [names[(n + 1) % 3]])
        for n, name in enumerate(names)
    ]
    value = graph(action("T", children=names), *ring, entry=["T", "A"])
    assert found(value, "H4") == []
    both = graph(action("T", children="B"), action("A", children="B"),
                 action("B", [asks("A"), stop]), entry=["T", "A", "B"])  # fmt: skip
    assert "may run B_0 just when" in found(both, "H4")[0].message


def test_actions_that_cannot_run_bypass_and_pause_nobody() -> None:
    value = graph(
        action("A"),
        action("X", children=["Y"]),
        action("Y", [{"name": "X", "conditions": ["on_false -> pause"]}]),
        exits=["A"],
    )
    assert {p.code for p in check(value)} == {"unreachable"}


def test_a_graph_that_waits_for_all_that_it_started_is_never_finished_early() -> None:
    fork = graph(action("A", children=["B", "C"]), action("B", ["A"], ["D"]), action("C", ["A"], ["D"]),
                 action("D", ["B", "C"]), exits=[{"name": "D"}])  # fmt: skip
    assert found(fork, "H12") == []
    loose = graph(action("A", children=["B", "C"]), action("B", ["A"], ["D"]), action("C", ["A"]),
                  action("D", ["B"]), exits=[{"name": "D"}])  # fmt: skip
    assert "while C_0 may run on" in found(loose, "H12")[0].message


def test_thirty_bypasses_are_told_once_with_all_their_places() -> None:
    names = [f"A{n}" for n in range(31)]
    chain = [
        action(name, [{"name": p} for p in names[max(0, n - 1) : n]], names[n + 1 : n + 2])
        for n, name in enumerate(names)
    ]
    (problem,) = found(graph(*chain, entry=names[:1], exits=names[-1:]), "H3")
    assert "29 more bypasses of this kind" in problem.message
    places = [problem.where, *problem.also]
    assert [p.path for p in places] == [f"/actions/{n}/parents/0/conditions" for n in range(1, 31)]
    assert len({p.relation for p in places}) == 30


def test_thirty_ways_out_are_told_once_with_all_their_places() -> None:
    names = [f"A{n}" for n in range(30)]
    ends = [asks(name) for name in names]
    (problem,) = found(graph(*map(action, names), entry=names, exits=ends), "H12")
    assert "29 more ways to the exit of this kind" in problem.message
    assert len({p.relation for p in (problem.where, *problem.also)}) == 30


def test_certain_crashes_come_before_possible_ones() -> None:
    stop = asks("A", "on_true -> stop")
    value = graph(
        action("A", children=["C"]),
        action("B", children=["C"]),
        action("C", [stop, {"name": "B", "required": False}], ["D"]),
        action("D", [{"name": "C"}]),
        entry=["A", "B", "C"],
        exits=["D"],
    )
    warnings = [p.code for p in check(value) if p.severity == "warning"]
    assert warnings[0] == "H4"
    assert warnings.index("H12") < warnings.index("H3")


def test_an_action_that_waits_for_another_does_not_begin_beside_it() -> None:
    """B and C both follow A, and C waits for B, too."""
    value = graph(
        action("A", children=["B", "C"]),
        action("B", ["A"], ["C"]),
        action("C", ["A", "B"]),
        exits=[{"name": "C", "conditions": ["on_error -> run"]}],
    )
    assert found(value, "H12") == []


# Spontaneous actions, which no stop reaches in a graph that is FINISHED


def lively(value: Graph, *names: str) -> Graph:
    kinds = tuple(
        replace(a, type="spontaneous" if a.name in names else "sync") for a in value.actions
    )
    return replace(value, actions=kinds)


def endless(value: Graph) -> tuple[str, str]:
    (problem,) = found(value, "H12")
    return problem.severity, problem.message


LEADS_TO_EXIT = {
    "it leads to the exit itself": graph(action("A"), exits=["A"]),
    "behind another one": graph(action("B", children=["A"]), action("A", ["B"]), entry=["B"], exits=["A"]),
    "another one stands before the exit": graph(action("A", children=["B"]), action("B", ["A"]), exits=["B"]),
    "beside the way to the exit": graph(
        action("C", children=["A", "B"]), action("A", ["C"]), action("B", ["C"]), entry=["C"], exits=["B"]),
    "the exit waits for both": graph(action("A"), action("B"), entry=["A", "B"], exits=["A", "B"]),
}  # fmt: skip


@pytest.mark.parametrize("shape", LEADS_TO_EXIT)
def test_a_spontaneous_action_that_outlasts_the_graph_when_all_goes_well_is_an_error(
    shape: str,
) -> None:
    value = lively(LEADS_TO_EXIT[shape], "A")
    severity, message = endless(value)
    assert severity == "error"
    assert message.startswith("If all goes well, the graph is FINISHED, and A_0")
    traces = list(
        simulate(value, max_events=400, script=Script({"B_0": (Behaviour(after_s=0.5),)}))
    )
    finished = next(
        n
        for n, t in enumerate(traces)
        if getattr(t, "state", "") == "FINISHED" and t.graph == "g" and not hasattr(t, "node")
    )
    assert any(isinstance(t, HazardEvent) and t.code == "H12" for t in traces)
    begun = [t for t in traces[finished:] if isinstance(t, NodeStateEvent) and t.state == "RUNNING"]
    assert len(begun) > 20


def test_an_action_that_outlasts_the_graph_on_another_course_is_reported_with_its_condition() -> (
    None
):
    safe = {"name": "A", "conditions": ["on_true -> ignore", "on_false -> run", *SAFE]}
    assert endless(lively(graph(action("A"), exits=[safe]), "A")) == (
        "warning",
        "If A_0 ends with on_false, the graph is FINISHED, and A_0, which is spontaneous, begins again "
        "and again: the engine then ignores every stop of the graph.",
    )
    other = graph(action("A"), action("B"), entry=["A", "B"],
                  exits=[{"name": "B", "conditions": ["on_true -> ignore", "on_false -> run", *SAFE]}])  # fmt: skip
    severity, message = endless(lively(other, "A"))
    assert (severity, message.startswith("If B_0 ends with on_false while A_0 runs,")) == (
        "warning",
        True,
    )


def test_a_spontaneous_action_that_throws_begins_again_as_on_the_real_node() -> None:
    """The real node showed 39 begins and ends in 2 s, and 77 two seconds after a stop."""
    value = lively(
        graph(action("A"), exits=[{"name": "A", "conditions": ["on_error -> run"]}]), "A"
    )
    fails = Script({"A_0": (Behaviour(after_s=0.1, result="on_error"),)})
    traces = list(simulate(value, script=fails, until_ms=2_000, commands=[(1_000, "stop", None)]))
    begun = [t.t_ms for t in traces if isinstance(t, NodeStateEvent) and t.state == "RUNNING"]
    assert len(begun) >= 20
    assert begun[-1] >= 1_900


def test_an_action_that_is_stopped_before_the_exit_does_not_outlast_the_graph() -> None:
    stops = {
        "name": "B",
        "required": False,
        "conditions": ["on_true -> stop", "on_false -> stop", *SAFE],
    }
    value = graph(action("A", [stops]), action("B", children=["A"]), entry=["A", "B"], exits=["B"])
    assert found(lively(value, "A"), "H12") == []
