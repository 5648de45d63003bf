"""Each fact of a run belongs to one place of its levels: vectors that the page reads, too, and runs drawn at random."""

import json
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from action_assistant.runner.analysis.levels import places, within
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics import (
    Behaviour,
    Engine,
    GraphRefused,
    NodeResultEvent,
    NodeStateEvent,
    Script,
    Trace,
)
from action_assistant.umrf.semantics.parts import Node, Running
from support.recordings import SHARED, family
from umrf.hierarchy.hierarchies import Hierarchy, hierarchies

VECTORS = json.loads(
    (Path(__file__).parents[2] / "vectors" / "levels.json").read_text(encoding="utf-8")
)
#: Names of graphs and actions that contain marks of levels and digits.
HOSTILE = ["Grip", "Grip_2", "A__B", "A__0", "A__B__0", "0", "_", "__", "A_", "B__0__A", "é ›"]
RENAMED = ["g", "H0", "I0", "H1", "H2", "A", "B"]


@pytest.mark.parametrize("vector", VECTORS, ids=lambda each: str(each["why"]))
def test_each_fact_has_the_place_that_the_vectors_say(vector: dict[str, Any]) -> None:
    found = places(vector["graph"], vector["own"], vector["names"])
    told = {name: [list(each.levels), each.name, each.known] for name, each in found.items()}
    assert told == vector["places"]


def recorded() -> dict[str, list[Path]]:
    """The recordings with graphs inside, of here and of wherever else there are some."""
    found: dict[str, list[Path]] = defaultdict(list)
    for folder in (family("engine"), SHARED / "umrf" / "traces"):
        for path in sorted(folder.glob("sub_*.trace*.jsonl")):
            found[path.name.partition(".")[0]].append(path)
    return found


@pytest.mark.parametrize("name", sorted(recorded()))
def test_actions_of_graphs_inside_stand_below_the_actions_around_them(name: str) -> None:
    for path in recorded()[name]:
        events = [json.loads(line) for line in path.read_text().splitlines()]
        told = {(e["graph"], e["node"]) for e in events if e["kind"] == "node_state"}
        keys = {node if graph == name else f"{graph}/{node}" for graph, node in told}
        own = {node for graph, node in told if graph == name}
        found = places(name, own, keys)
        assert found.keys() == keys
        (outer,) = (node for node in own if node.startswith("Sub"))
        inner = {node for graph, node in told if graph.startswith(f"{name}__")}
        assert {found[each].name for each in within(found, outer)} == inner != set()
        lost = {key for key, place in found.items() if not place.known}
        assert lost == ({f"/{outer}"} if name == "sub_restart_by_json" else set())


class Watched(Engine):
    """An engine that remembers which action each of its graphs was begun for."""

    def __init__(self, script: Script, library: dict[str, Graph]) -> None:
        super().__init__(script=script, library=library)
        self.ways: dict[str, set[tuple[str, ...]]] = defaultdict(set)

    def _built(self, name: str, graph: Graph, above: Node | None, home: Running | None) -> Running:
        way: list[str] = []
        node, around = above, home
        while node is not None and around is not None:
            way.insert(0, node.full_name)
            node, around = around.above, around.home
        self.ways[name].add(tuple(way))
        return super()._built(name, graph, above, home)


@st.composite
def renamed(draw: st.DrawFn) -> Hierarchy:
    """A hierarchy whose graphs and actions have hostile names."""
    drawn = draw(hierarchies())
    names = draw(st.permutations(HOSTILE))
    to = dict(zip(RENAMED, names, strict=False))

    def under(graph: Graph) -> Graph:
        actions = tuple(replace(a, name=to.get(a.name, a.name)) for a in graph.actions)
        return replace(graph, name=to.get(graph.name, graph.name), actions=actions)

    graphs = [under(each) for each in drawn.graphs.values()]
    return Hierarchy(under(drawn.graph), {each.name: each for each in graphs})


RESULTS = st.sampled_from(["on_true", "on_true", "on_false", "on_error"])
CALL = st.builds(Behaviour, after_s=st.sampled_from([0.2, 0.5, 1.0, 3.0]), result=RESULTS)
CALLS = st.lists(CALL, max_size=4).map(tuple)


@settings(suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much])
@given(renamed(), st.dictionaries(st.sampled_from([*HOSTILE, "*"]), CALLS, max_size=3))
def test_actions_of_sub_graphs_are_placed_where_they_run(
    drawn: Hierarchy, calls: dict[str, tuple[Behaviour, ...]]
) -> None:
    engine = Watched(Script({k: v for k, v in calls.items() if v}), drawn.graphs)
    top = drawn.graph
    traces: list[Trace] = []
    try:
        traces += engine.start(top, 0.0)
    except GraphRefused:
        return
    while not engine.crashed and engine.due is not None and engine.due <= 20_000:
        traces += engine.advance(engine.due)
        if len(traces) > 3_000:
            break
    true: dict[str, set[tuple[tuple[str, ...], str]]] = defaultdict(set)
    for each in traces:
        if isinstance(each, NodeStateEvent | NodeResultEvent) and each.graph in engine.ways:
            own = each.graph == top.name
            name = each.node if own else f"{each.graph}/{each.node}"
            true[name] |= {(way, each.node) for way in engine.ways[each.graph]}
    own_names = {action.full_name for action in top.actions}
    found = places(top.name, own_names, [*own_names, *true])
    assert set(found) == own_names | set(true)
    for name, ways in true.items():
        assert found[name].known
        if len(ways) == 1:  # an engine has one name for two places, and so one graph
            assert (found[name].levels, found[name].name) in ways
    inside = {each for name in found for each in within(found, name)}
    top_level = {name for name, place in found.items() if not place.levels}
    assert inside | top_level == set(found)
