"""Sub-graphs in graphs that robots are led through: whose they are, and what their states tell."""

import random
from collections import Counter
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.led_subgraphs import (
    StatesInside,
    actors_of,
    graphs_within,
    outcome_of_subgraph,
    players,
    subgraph_obstacles,
)
from action_assistant.umrf.model import Action, Conditions, Graph
from action_assistant.umrf.pieces import piece_of
from action_assistant.umrf.semantics import (
    Behaviour,
    Engine,
    GraphRefused,
    NodeResultEvent,
    Script,
)
from runner.harness import sequence
from support.doses import examples, is_share
from umrf.drawn import busy_graphs

PIECE = "g--Sub_0--v1"


def plain(graph: Graph, name: str, inner: str = "") -> Graph:
    """The graph under this name, without values; `inner`: the name of its second action."""
    actions = tuple(
        msgspec.structs.replace(
            each, inputs=(), outputs=(), name=inner if inner and number == 1 else each.name
        )
        for number, each in enumerate(graph.actions)
    )
    relations = tuple(msgspec.structs.replace(each, remap=()) for each in graph.relations)
    return msgspec.structs.replace(graph, name=name, actions=actions, relations=relations)


def played(inside: dict[str, Graph], chance: random.Random) -> tuple[Engine, str | None]:
    """Play the sub-graph Sub as a piece; return the engine, and the result of its action if it has one
    and nothing moves any more."""
    alone = Graph(name="g", actions=(Action(key="k", name="Sub"),), relations=())
    piece = piece_of(alone, alone.actions[0], "1")
    calls = {
        each.full_name: tuple(
            Behaviour(
                after_s=round(chance.uniform(0.1, 4), 3),
                result=chance.choice(["on_true", "on_false", "on_error"]),
                stop_s=0.05,
            )
            for _ in range(4)
        )
        for graph in inside.values()
        for each in graph.actions
    }
    engine = Engine(facts=SIMULATED, script=Script(calls), library=inside)
    traces = engine.start(piece, 0.0)
    while len(traces) < 600 and engine.due is not None and engine.due < 100_000:
        traces += engine.advance(engine.due)
    at_rest = not any(
        state in {"RUNNING", "PAUSED", "STOPPING"}
        for graph in engine.states().values()
        for state in graph.nodes.values()
    )
    results = [
        each.result
        for each in traces
        if isinstance(each, NodeResultEvent) and (each.graph, each.node) == (PIECE, "Sub_0")
    ]
    return engine, results[-1] if results and at_rest and not engine.crashed else None


def told(engine: Engine, inside: dict[str, Graph]) -> str | None:
    """What the states in an engine tell of the piece."""
    states = engine.states()
    seen = StatesInside(
        {name: each.state for name, each in states.items()},
        {
            f"{name}/{node}": state
            for name, each in states.items()
            for node, state in each.nodes.items()
        },
    )
    own = states[PIECE].state, states[PIECE].nodes["Sub_0"]
    return outcome_of_subgraph(PIECE, Action(key="k", name="Sub"), own, seen, inside)


def test_no_outcome_of_a_sub_graph_is_misread() -> None:
    count: Counter[str] = Counter()

    @settings(max_examples=examples(800), deadline=None)
    @given(
        outer=busy_graphs(7), inner=busy_graphs(4), is_deep=st.booleans(), seed=st.integers(0, 9**9)
    )
    def tried(outer: Graph, inner: Graph, is_deep: bool, seed: int) -> None:
        inside = {
            "Sub": plain(outer, "Sub", "Deep" if is_deep else ""),
            "Deep": plain(inner, "Deep"),
        }
        try:
            engine, result = played(inside, random.Random(seed))
        except GraphRefused:
            return
        if result is None:
            return
        found = told(engine, inside)
        assert found in {None, result}
        count[result if found else "not told"] += 1

    tried()
    total = sum(count.values())
    assert is_share(total - count["not told"], total, 0.5), count


ALWAYS = Conditions(on_true="run", on_false="run", on_error="run", on_stopped="run")


@pytest.mark.parametrize("result", ["on_true", "on_false", "on_error"])
@pytest.mark.parametrize("deep", [False, True])
def test_one_last_action_tells_the_outcome(result: Any, deep: bool) -> None:
    line = sequence("Sub", 2)
    relations = tuple(
        each if each.parent == "entry" else msgspec.structs.replace(each, conditions=ALWAYS)
        for each in line.relations
    )
    sub = msgspec.structs.replace(line, relations=relations)
    inside = {"Sub": sub}
    if deep:
        outer = msgspec.structs.replace(
            sub, actions=(sub.actions[0], msgspec.structs.replace(sub.actions[1], name="Deep"))
        )
        inside = {"Sub": outer, "Deep": msgspec.structs.replace(sub, name="Deep")}
    alone = Graph(name="g", actions=(Action(key="k", name="Sub"),), relations=())
    calls = {
        "Work_0": (Behaviour(after_s=1, result="on_error"),),
        "Work_1": (Behaviour(after_s=1, result=result),),
    }
    engine = Engine(facts=SIMULATED, script=Script(calls), library=inside)
    engine.start(piece_of(alone, alone.actions[0], "1"), 0.0)
    engine.advance(20_000)
    assert told(engine, inside) == result


# --- whose they are ---------------------------------------------------------------------------------


def of(*actors: str, name: str = "Work") -> Graph:
    line = sequence("Sub", len(actors))
    actions = tuple(
        msgspec.structs.replace(each, actor=actor, name=name)
        for each, actor in zip(line.actions, actors, strict=True)
    )
    return msgspec.structs.replace(line, actions=actions)


@pytest.mark.parametrize(
    ("around", "inside", "actors"),
    [
        ("", ("", ""), {""}),
        ("Scout", ("", ""), {"Scout"}),
        ("", ("Scout", "Scout"), {"Scout"}),
        ("Carrier", ("Scout", "Scout"), {"Scout"}),
        ("", ("Scout", ""), {"", "Scout"}),
        ("Scout", ("Scout", ""), {"Scout"}),
        ("Carrier", ("Scout", ""), {"Carrier", "Scout"}),
        ("Carrier", (), {"Carrier"}),
    ],
)
def test_the_actors_of_a_sub_graph(around: str, inside: tuple[str, ...], actors: set[str]) -> None:
    action = Action(key="k", name="Sub", actor=around)
    assert actors_of(action, {"Sub": of(*inside)}) == actors
    deep = {
        "Sub": msgspec.structs.replace(of(""), actions=(Action(key="d", name="Deep"),)),
        "Deep": of(*inside),
    }
    assert actors_of(action, deep) == actors
    assert graphs_within(action, deep) == {"Sub", "Deep"}


def test_two_actors_of_one_robot_are_one_and_of_two_are_refused_with_their_actions() -> None:
    graph = Graph(name="g", actions=(Action(key="k", name="Sub"),), relations=())
    inside = {"Sub": of("Scout", "Carrier")}
    assert players(graph, inside, {"Scout": "David", "Carrier": "David"}) == {"Sub_0": "David"}
    robots = {"Scout": "David", "Carrier": "Carol"}
    assert players(graph, inside, robots) == {}
    (obstacle,) = subgraph_obstacles(graph, inside, robots)
    assert obstacle.code == "subgraph-across"
    assert obstacle.aid == "k"
    assert "Carol (Work_1), David (Work_0)" in obstacle.text


def test_levels_that_double_are_read_once_for_each_actor() -> None:
    """Thirty levels of two hold a thousand million actions."""
    levels = {f"L{level}": of("", "Scout", name=f"L{level + 1}") for level in range(30)}
    levels["L30"] = of("", "Carrier")
    top = Action(key="k", name="L0", actor="David")
    assert actors_of(top, levels) == {"David", "Scout", "Carrier"}
    (obstacle,) = subgraph_obstacles(
        Graph(name="g", actions=(top,), relations=()),
        levels,
        {"David": "David", "Scout": "Carol", "Carrier": "Carol"},
    )
    assert "Carol (Work_1, Work_0), David (Work_0)." in obstacle.text


def test_a_graph_inside_of_itself_has_the_actors_of_its_other_actions() -> None:
    (loop, other) = of("Scout", "Carrier").actions
    graph = Graph(
        name="Sub", actions=(msgspec.structs.replace(loop, name="Sub"), other), relations=()
    )
    assert actors_of(Action(key="k", name="Sub"), {"Sub": graph}) == {"Carrier"}
