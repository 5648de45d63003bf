"""No action begins in a graph that has left RUNNING and does not move, unless it was named as
possibly loading."""

import itertools
from collections.abc import Mapping

import msgspec
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Relation,
)
from action_assistant.umrf.semantics import Engine, NodeStateEvent, script_from
from action_assistant.umrf.triggers import (
    LEFT,
    NEVER_BEGAN,
    SeenAfter,
    may_be_loading,
    triggers_of,
)
from support.doses import examples
from umrf.drawn import busy_graphs
from umrf.test_laps import graphs

MOVING = frozenset({"RUNNING", "STOPPING", "PAUSED", "PAUSE_REQUESTED"})
GO = Conditions(on_true="run", on_false="run", on_error="run")


def seen(before: SeenAfter, state: str, nodes: Mapping[str, str]) -> SeenAfter:
    """Return the observation `before` with one more look at a graph."""
    if state not in LEFT:
        return before
    return SeenAfter(
        before.active | {name for name, each in nodes.items() if each in MOVING},
        before.idle | {name for name, each in nodes.items() if each in NEVER_BEGAN},
        before.drained or state in {"FINISHED", "HALTED"},
    )


@settings(max_examples=examples(400), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    graph=st.one_of(graphs(), busy_graphs(6)),
    results=st.lists(st.sampled_from(["on_true", "on_false", "on_error"]), min_size=6, max_size=6),
    times=st.lists(st.sampled_from([0.0, 0.1, 0.3, 0.7, 1.1]), min_size=6, max_size=6),
    loading_ms=st.sampled_from([20.0, 130.0, 500.0, 3_000.0]),
    stop_ms=st.none() | st.floats(0, 4_000),
    looks_ms=st.lists(st.sampled_from([5.0, 30.0, 90.0, 400.0]), min_size=1, max_size=4),
)
def test_an_action_that_begins_late_was_reported_as_loading(
    graph: Graph,
    results: list[str],
    times: list[float],
    loading_ms: float,
    stop_ms: float | None,
    looks_ms: list[float],
) -> None:
    calls = {
        each.full_name: [{"result": result, "after_s": time}]
        for each, result, time in zip(graph.actions, results, times, strict=False)
    }
    engine = Engine(
        facts=SIMULATED, script=script_from({"behaviours": calls}), loading_ms=loading_ms
    )
    known, after = triggers_of(graph, exits_known=True), SeenAfter()
    try:
        engine.start(graph, 0.0)
    except ValueError:
        return
    at, gaps = 0.0, itertools.cycle(looks_ms)
    stopped = stop_ms is None
    while at < 9_000 and not engine.crashed and not engine.locked:
        at += next(gaps)
        if not stopped and stop_ms is not None and at >= stop_ms:
            engine.stop(graph.name, at)
            stopped = True
        engine.advance(at)
        shown = engine.states()[graph.name]
        after = seen(after, shown.state, shown.nodes)
        if shown.state in LEFT - {"STOPPING"} and not MOVING & set(shown.nodes.values()):
            break
    else:
        return
    if engine.crashed or engine.locked:
        return
    told = may_be_loading(known, shown.state, shown.nodes, after)
    begun = {
        each.node
        for each in engine.advance(at + 5_000)
        if isinstance(each, NodeStateEvent)
        and each.graph == graph.name
        and each.state in {"RUNNING", "ERROR"}
        and shown.nodes[each.node] in NEVER_BEGAN
    }
    assert begun <= set(told), (begun, told, shown, after)


def line(*conditions: Conditions, extra: tuple[Relation, ...] = ()) -> Graph:
    """A_0, then B_0, then C_0."""
    names = (ENTRY, "a", "b", "c", EXIT)
    said = (ENTRY_CONDITIONS, *conditions, GO, GO, GO)
    arrows = tuple(
        Relation(parent=one, child=other, conditions=each)
        for (one, other), each in zip(itertools.pairwise(names), said, strict=False)
    )
    actions = tuple(Action(key=key, name=key.upper()) for key in "abc")
    return Graph(name="g", actions=actions, relations=(*arrows, *extra))


def told(graph: Graph, state: str, nodes: str, after: SeenAfter = SeenAfter()) -> tuple[str, ...]:  # noqa: B008 - frozen
    """Return the actions that may be loading; each letter is the state of an action."""
    states = {"F": "FINISHED", "E": "ERROR", ".": "UNINITIALIZED", "I": "INITIALIZED"}
    shown = {f"{name}_0": states[each] for name, each in zip("ABC", nodes, strict=True)}
    return may_be_loading(triggers_of(graph, exits_known=True), state, shown, after)


def test_the_first_action_is_triggered_by_the_start_itself() -> None:
    assert told(line(), "STOPPED", "...") == ("A_0",)
    assert told(line(), "UNINITIALIZED", "...") == ()


def test_the_end_of_a_parent_may_have_triggered_the_next_one() -> None:
    assert told(line(), "STOPPED", "F..") == ("B_0",)
    assert told(line(), "STOPPED", "FF.") == ("C_0",)
    assert told(line(), "STOPPED", "FFF") == ()


def test_a_parent_that_moved_when_the_graph_had_left_running_has_triggered_nothing() -> None:
    assert told(line(), "STOPPED", "F..", SeenAfter(active=frozenset({"A_0"}))) == ()


def test_a_parent_that_had_not_begun_by_then_has_triggered_nothing() -> None:
    idle = SeenAfter(idle=frozenset({"A_0", "B_0", "C_0"}))
    assert told(line(), "STOPPED", "F..", idle) == ()


def test_an_outcome_that_the_arrow_ignores_triggers_nothing() -> None:
    only_errors = Conditions(on_error="run")
    assert told(line(only_errors), "STOPPED", "F..") == ()
    assert told(line(only_errors), "STOPPED", "E..") == ("B_0",)


def test_a_bypass_reaches_the_actions_behind_it() -> None:
    assert told(line(Conditions(on_error="bypass")), "STOPPED", "E..") == ("C_0",)


def test_a_loaded_action_will_run_whatever_was_seen() -> None:
    assert told(line(), "STOPPED", "FI.", SeenAfter(active=frozenset({"A_0"}))) == ("B_0",)


def test_a_join_needs_every_required_parent() -> None:
    wait = Relation(parent="a", child="c", conditions=GO)
    joined = line(extra=(wait,))
    assert told(joined, "STOPPED", "F..") == ("B_0",)
    assert told(joined, "STOPPED", "FF.") == ("C_0",)


def test_a_sequential_graph_that_ended_by_itself_is_at_rest() -> None:
    branch = line(Conditions(on_true="run"))
    other = Relation(parent="a", child=EXIT, conditions=Conditions(on_false="bypass"))
    graph = msgspec.structs.replace(branch, relations=(*branch.relations, other))
    assert triggers_of(graph, exits_known=True).in_turn
    assert told(graph, "FINISHED", "F..", SeenAfter(drained=True)) == ()
    assert told(graph, "STOPPED", "F..") == ("B_0",)


def test_a_leaf_that_halts_a_graph_proves_nothing_about_loading_actions() -> None:
    fork = Relation(parent="a", child="c", conditions=GO)
    arrows = tuple(each for each in line().relations if (each.parent, each.child) != ("b", "c"))
    graph = msgspec.structs.replace(line(), relations=(*arrows, fork))
    assert told(graph, "HALTED", "FF.", SeenAfter(drained=True)) == ("C_0",)


def test_a_branch_that_has_begun_rules_the_other_out() -> None:
    one, other = Conditions(on_true="run"), Conditions(on_false="run")
    beside = Relation(parent=ENTRY, child="d", conditions=ENTRY_CONDITIONS)
    arrows = (
        Relation(parent=ENTRY, child="a", conditions=ENTRY_CONDITIONS),
        Relation(parent="a", child="b", conditions=one),
        Relation(parent="a", child="c", conditions=other),
        beside,
    )
    actions = tuple(Action(key=key, name=key.upper()) for key in "abcd")
    known = triggers_of(Graph(name="g", actions=actions, relations=arrows), exits_known=True)
    assert not known.in_turn
    states = dict.fromkeys(("A_0", "B_0", "D_0"), "FINISHED") | {"C_0": "UNINITIALIZED"}
    assert may_be_loading(known, "FINISHED", states, SeenAfter()) == ()
    states["B_0"] = "UNINITIALIZED"
    assert may_be_loading(known, "FINISHED", states, SeenAfter()) == ("B_0", "C_0")


def test_the_text_of_an_engine_leaves_open_how_the_end_answers() -> None:
    branch = line(Conditions(on_true="run"))
    other = Relation(parent="a", child=EXIT, conditions=Conditions(on_false="bypass"))
    graph = msgspec.structs.replace(branch, relations=(*branch.relations, other))
    assert not triggers_of(graph, exits_known=False).in_turn
