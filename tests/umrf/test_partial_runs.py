"""Runs of a part of a graph: what is left out, what is assumed, and the course that remains."""

import random
from collections.abc import Iterable

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from action_assistant.umrf.check import check, forbids_start
from action_assistant.umrf.digest import digest
from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Parameter,
    Relation,
)
from action_assistant.umrf.partial_runs import (
    AssumedOutcome,
    AssumedValue,
    EndedBy,
    KnownOutcome,
    NoPart,
    partial_graph,
)
from action_assistant.umrf.semantics import Behaviour, Script, simulate
from action_assistant.umrf.semantics.trace import (
    GraphResultEvent,
    HazardEvent,
    NodeResultEvent,
    NodeStateEvent,
    Trace,
)
from support.doses import examples
from umrf.semantics.traces import graph_of, optional

STOP = Conditions(on_true="stop")
ONLY_TRUE = Conditions(on_true="run")


def arrows(graph: Graph) -> set[tuple[str, str, bool]]:
    return {(each.parent, each.child, each.required) for each in graph.relations}


def test_what_comes_before_is_skipped_and_counts_as_ended() -> None:
    graph = graph_of("entry>A", "A>B", "B>C", "C>exit")
    part = partial_graph(graph, ["B_0"], {"A_0": KnownOutcome("on_true", 7)})
    assert part.begins == ("B_0",)
    assert part.skipped == ("A_0",)
    assert part.assumed == (AssumedOutcome("A_0", "on_true", 7),)
    assert arrows(part.graph) == {
        (ENTRY, "B", True),
        ("B", "C", True),
        ("C", EXIT, True),
    }
    assert part.graph.name == graph.name
    assert digest(part.graph) != digest(graph)


def test_a_join_takes_a_skipped_branch_for_ended_also_where_no_run_knows_it() -> None:
    graph = graph_of("entry>A", "entry>B", "A>C", "B>C", "C>exit")
    part = partial_graph(graph, ["A_0"], {})
    assert part.assumed == (AssumedOutcome("B_0"),)
    assert arrows(part.graph) == {(ENTRY, "A", True), ("A", "C", True), ("C", EXIT, True)}
    assert results(simulate(part.graph, script=Script({}), until_ms=1e5)) == ["on_true"]


def test_what_only_a_skipped_action_would_stop_is_named() -> None:
    graph = graph_of("entry>A", "entry>B", "A>B", "B>exit", AB=STOP)
    assert partial_graph(graph, ["B_0"], {}).ended_by == (EndedBy("B_0", "A_0"),)
    assert partial_graph(graph, ["A_0"], {}).ended_by == ()


def test_in_a_loop_what_has_run_before_is_not_waited_for() -> None:
    graph = optional(graph_of("entry>A", "A>B", "B>C", "A>C", "C>A", "C>exit"), "C>A")
    part = partial_graph(graph, ["B_0"], {})
    assert part.skipped == ()
    assert ("A", "C", False) in arrows(part.graph)
    assert not any(map(forbids_start, check(part.graph, None, SIMULATED, {})))


def test_only_one_action_ends_the_run_whatever_its_outcome() -> None:
    graph = graph_of("entry>A", "A>B", "B>C", "C>exit", BC=ONLY_TRUE)
    part = partial_graph(graph, ["B_0"], {}, only=True)
    assert part.skipped == ("A_0", "C_0")
    for outcome in ("on_true", "on_false", "on_error"):
        script = Script({"B": (Behaviour(result=outcome),)})
        assert results(simulate(part.graph, script=script, until_ms=1e5)) == [outcome]


def test_a_selection_begins_with_its_first_actions_and_keeps_its_arrows() -> None:
    graph = graph_of("entry>A", "A>B", "B>C", "C>D", "D>exit")
    part = partial_graph(graph, ["C_0", "B_0"], {}, only=True)
    assert part.begins == ("B_0",)
    assert arrows(part.graph) == {(ENTRY, "B", True), ("B", "C", True), ("C", EXIT, True)}


def test_a_selection_that_is_a_loop_begins_where_something_leads_into_it() -> None:
    graph = optional(graph_of("entry>A", "A>B", "B>C", "C>B", "C>exit"), "C>B")
    assert partial_graph(graph, ["C_0", "B_0"], {}, only=True).begins == ("B_0",)


@pytest.mark.parametrize("names", [["Nobody_0"], ["A_0", "Nobody_0"]])
def test_an_action_that_is_not_there_is_refused_by_name(names: list[str]) -> None:
    with pytest.raises(NoPart, match="no action Nobody_0"):
        partial_graph(graph_of("entry>A", "A>exit"), names, {})


def valued(graph: Graph, giver: str, taker: str) -> Graph:
    """The graph in which one action gives the number that the other one needs."""
    sides = {
        giver: {"outputs": (Parameter("load", '{"pvf_type": "number"}'),)},
        taker: {"inputs": (Parameter("load", '{"pvf_type": "number", "unknown": 1}'),)},
    }
    actions = tuple(
        Action(key=each.key, name=each.name, **sides.get(each.key, {})) for each in graph.actions
    )
    return Graph(name=graph.name, actions=actions, relations=graph.relations)


def test_a_value_of_the_earlier_run_becomes_a_literal_with_its_age() -> None:
    graph = valued(graph_of("entry>A", "A>B", "B>exit"), "A", "B")
    known = {"A_0": KnownOutcome("on_true", 7, {"load": 2.5})}
    part = partial_graph(graph, ["B_0"], known)
    assert part.values == (AssumedValue("B_0", "load", "A_0", "2.5", 7),)
    (taker,) = part.graph.actions
    assert taker.inputs[0].text == '{"pvf_type":"number","unknown":1,"pvf_value":2.5}'


@pytest.mark.parametrize("given", [{}, {"load": "heavy"}, {"load": [1.0]}])
def test_a_value_that_is_missing_or_of_another_type_is_not_made_up(
    given: dict[str, object],
) -> None:
    graph = valued(graph_of("entry>A", "A>B", "B>exit"), "A", "B")
    part = partial_graph(graph, ["B_0"], {"A_0": KnownOutcome("on_true", 7, given)})
    assert part.values == ()
    assert "pvf_value" not in part.graph.actions[0].inputs[0].text


def test_a_value_after_an_outcome_that_hands_nothing_on_is_not_taken() -> None:
    graph = valued(graph_of("entry>A", "A>B", "B>exit", AB=ONLY_TRUE), "A", "B")
    known = {"A_0": KnownOutcome("on_false", 7, {"load": 2.5})}
    assert partial_graph(graph, ["B_0"], known).values == ()


# --- random graphs ------------------------------------------------------------------------------------


def results(traces: Iterable[Trace]) -> list[str]:
    return [each.value for each in traces if isinstance(each, GraphResultEvent)]


def drawn(chance: random.Random) -> tuple[Graph, Script]:
    """A graph without loops that hands values on, and what its actions do."""
    count = chance.randint(2, 7)
    names = [f"A{number}" for number in range(count)]
    leaf = Parameter("load", '{"pvf_type": "number", "pvf_required": false}')
    actions = tuple(Action(key=name, name=name, inputs=(leaf,), outputs=(leaf,)) for name in names)
    relations = [Relation(parent=ENTRY, child=names[0], conditions=ENTRY_CONDITIONS)]
    for number, name in enumerate(names[1:], 1):
        for parent in chance.sample(names[:number], chance.randint(1, min(2, number))):
            answers = [chance.choice(("run", "run", "ignore")) for _ in range(3)]
            relations.append(
                Relation(
                    parent=parent,
                    child=name,
                    conditions=Conditions(*answers),
                    required=chance.random() < 0.8,
                    parent_order=float(number),
                    child_order=float(number),
                )
            )
    for name in chance.sample(names, chance.randint(1, 2)):
        always = Conditions("run", "run", "run")
        relations.append(Relation(parent=name, child=EXIT, conditions=always, parent_order=99.0))
    behaviours = {
        name: (
            Behaviour(
                after_s=chance.choice((0.5, 1, 2)),
                result=chance.choice(("on_true", "on_true", "on_false", "on_error")),
                outputs={"load": float(chance.randint(1, 99))},
            ),
        )
        for name in names
    }
    return Graph(name="g", actions=actions, relations=tuple(relations)), Script(behaviours)


def course(traces: list[Trace]) -> list[tuple[str, str]]:
    return [(each.node, each.result) for each in traces if isinstance(each, NodeResultEvent)]


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(0, 10**9))
def test_from_an_action_that_runs_alone_the_run_takes_the_course_of_the_whole(seed: int) -> None:
    chance = random.Random(seed)
    graph, script = drawn(chance)
    traces = list(simulate(graph, script=script, until_ms=1e6))
    assume(not any(isinstance(each, HazardEvent) for each in traces))
    known: dict[str, KnownOutcome] = {}
    active: set[str] = set()
    alone: list[tuple[int, str, dict[str, KnownOutcome]]] = []
    for place, each in enumerate(traces):
        match each:
            case NodeStateEvent(state="RUNNING", node=node):
                active.add(node)
                after = (e for e in traces[place + 1 :] if isinstance(e, NodeResultEvent))
                begun = {
                    e.node
                    for e in traces[place + 1 :]
                    if isinstance(e, NodeStateEvent)
                    and e.state == "RUNNING"
                    and e.t_ms == each.t_ms
                }
                if active == {node} and not begun and next(after).node == node:
                    alone.append((place, node, dict(known)))
            case NodeResultEvent(node=node, result=result):
                active.discard(node)
                outputs = script.behaviours[node.removesuffix("_0")][0].outputs or {}
                known[node] = KnownOutcome(result, round(each.t_ms * 1000), outputs)
    assume(alone)
    place, node, before = chance.choice(alone)
    part = partial_graph(graph, [node], before)
    assume(all(each.outcome for each in part.assumed))
    rest = list(simulate(part.graph, script=script, until_ms=1e6))
    assert course(rest) == course(traces[place:])
    if any(
        each.child == EXIT and each.parent in {a.key for a in part.graph.actions}
        for each in graph.relations
    ):
        assert results(rest) == results(traces)


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(0, 10**9))
def test_a_part_names_everything_that_it_leaves_out_and_nothing_else(seed: int) -> None:
    chance = random.Random(seed)
    graph, _ = drawn(chance)
    names = [each.full_name for each in graph.actions]
    at, only = chance.sample(names, chance.randint(1, len(names))), chance.random() < 0.5
    part = partial_graph(graph, at, {}, only=only)
    played = [each.full_name for each in part.graph.actions]
    assert sorted([*played, *part.skipped]) == sorted(names)
    assert set(part.begins) <= set(at) <= set(played)
    inner = {each.key for each in part.graph.actions} | {ENTRY, EXIT}
    assert all(each.parent in inner and each.child in inner for each in part.graph.relations)
    assert {each.action for each in part.assumed}.isdisjoint(part.begins) or not only
    again = partial_graph(graph, at, {}, only=only)
    assert digest(again.graph) == digest(part.graph)
