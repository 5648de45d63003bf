"""The contents of a flat graph: names, origins, positions and unknown fields; and real files."""

import json
from itertools import pairwise
from random import Random

import msgspec
import pytest
from msgspec.structs import replace

from action_assistant.umrf.files import codec
from action_assistant.umrf.hierarchy.flattening import Flattened, Unflattenable, flattened
from action_assistant.umrf.model import Graph
from support.recordings import CORPUS, NO_CORPUS, family
from umrf.hierarchy.hierarchies import Hierarchy, nested_names
from umrf.hierarchy.lines import CHAIN, ONE, TWO, changed
from umrf.hierarchy.test_flattening import agree
from umrf.semantics.traces import graph_of


def test_one_sub_graph_twice_which_an_engine_refuses_becomes_flat() -> None:
    outer = changed(graph_of("entry>S", "S>T", "T>exit"), "T", name="S", instance_id=1)
    found = flattened(outer, {"S": TWO})
    assert isinstance(found, Flattened)
    assert [origin.action for origin in found.origins] == ["X_0", "Y_0", "X_1", "Y_1"]
    copied = graph_of("entry>S", "S>T", "T>exit")
    alike = flattened(copied, {"S": TWO, "T": replace(TWO, name="T")})
    assert isinstance(alike, Flattened)
    assert [(r.parent_order, r.child_order) for r in found.graph.relations] == [
        (r.parent_order, r.child_order) for r in alike.graph.relations
    ]
    assert agree(
        Hierarchy(copied, {"S": TWO, "T": replace(TWO, name="T")}), alike, Random(1), False
    )


def test_outer_actions_keep_their_names_and_origins_lead_down() -> None:
    outer = graph_of("entry>X", "X>S", "S>exit")
    found = flattened(outer, {"S": TWO})
    assert isinstance(found, Flattened)
    assert [a.full_name for a in found.graph.actions] == ["X_0", "X_1", "Y_0"]
    assert next(a.key for a in found.graph.actions) == "X"
    assert all(len(a.key) == 12 for a in found.graph.actions[1:])
    assert [[(v.graph, v.action) for v in o.levels] for o in found.origins] == [
        [("g", "X_0")], [("g", "S_0"), ("S", "X_0")], [("g", "S_0"), ("S", "Y_0")],
    ]  # fmt: skip
    assert nested_names(found)["X_1"] == ("g__S__0", "X_0")


def test_a_graph_without_sub_graphs_stays_as_it_is() -> None:
    found = flattened(CHAIN, {"S": TWO}, known={"S"})
    assert isinstance(found, Flattened)
    assert found.graph is CHAIN


def test_unknown_fields_survive_and_fields_without_a_place_are_reported() -> None:
    outer = changed(CHAIN, "S", extra=(("team", '"red"'),))
    outer = changed(outer, "A", extra=(("mark", "1"),))
    relations = (
        replace(r, parents_extra=(("why", '"x"'),)) if r.child == "S" else r
        for r in outer.relations
    )
    sub = changed(
        replace(TWO, description="two", extra=(("license", '"MIT"'),)),
        "Y",
        extra=(("deep", "[2]"),),
    )
    found = flattened(replace(outer, relations=tuple(relations)), {"S": sub})
    assert isinstance(found, Flattened)
    actions = {a["name"]: a for a in json.loads(codec.write(found.graph))["actions"]}
    assert actions["A"]["mark"] == 1
    assert actions["Y"]["deep"] == [2]
    assert actions["X"]["parents"][0]["why"] == "x"
    (left,) = found.left_out
    assert (left.levels[-1].action, left.fields) == ("S_0", ("description", "team", "license"))


def test_a_sub_graph_is_drawn_where_its_action_stood_and_room_is_made() -> None:
    at = {"A": (0.0, 0.0), "S": (0.0, 100.0), "B": (0.0, 200.0)}
    outer = replace(
        CHAIN, actions=tuple(replace(a, position=at[a.name]) for a in CHAIN.actions),
        exit_position=(0.0, 300.0), notes=(("n", '{"kind":"note","at":[50,10]}'),),
    )  # fmt: skip
    places = {"X": (1000.0, 0.0), "Y": (1000.0, 400.0)}
    sub = replace(
        TWO, actions=tuple(replace(a, position=places[a.name]) for a in TWO.actions),
        notes=(("n", '{"kind":"frame","at":[1000,0],"text":"in"}'),),
    )  # fmt: skip
    found = flattened(outer, {"S": sub})
    assert isinstance(found, Flattened)
    assert {a.name: a.position for a in found.graph.actions} == {
        "A": (0.0, -200.0), "X": (0.0, -100.0), "Y": (0.0, 300.0), "B": (0.0, 400.0),
    }  # fmt: skip
    assert found.graph.exit_position == (0.0, 500.0)
    (own, first), (other, second) = found.graph.notes
    assert (own, json.loads(first)["at"]) == ("n", [50, -190])
    assert other != "n"
    assert json.loads(second) == {"kind": "frame", "at": [0, -100], "text": "in"}
    undrawn = flattened(outer, {"S": TWO})
    assert isinstance(undrawn, Flattened)
    drawn = {a.name: a.position for a in undrawn.graph.actions}
    assert drawn["X"] is not None
    assert drawn["Y"] == (drawn["X"][0], drawn["X"][1] + 280)


def test_results_are_values_that_programs_can_read() -> None:
    found = flattened(CHAIN, {"S": changed(ONE, "X", type="spontaneous")})
    told = json.loads(msgspec.json.encode(found))
    assert told["kind"] == "unflattenable"
    assert told["reasons"][0]["at"][-1] == {"graph": "S", "key": "X", "action": "X_0"}


RECORDED = {
    "sub_seq": True, "sub_params": True, "sub_fast": True, "sub_error": True, "sub_stop": True,
    "sub_halt": False,
}  # fmt: skip


@pytest.mark.parametrize("name", RECORDED)
def test_recorded_hierarchies_become_flat_or_say_why(name: str) -> None:
    folder = family("engine")
    read = [codec.read(p.read_bytes()).graph for p in (folder / "subgraphs").glob("*.json")]
    graphs = {graph.name: graph for graph in read}
    graph = codec.read((folder / f"{name}.graph.json").read_bytes()).graph
    found = flattened(graph, graphs)
    assert isinstance(found, Flattened) is RECORDED[name]
    if isinstance(found, Flattened):
        assert agree(Hierarchy(graph, graphs), found, Random(3), stop=False) > 1


def test_real_files_become_flat_or_say_why() -> None:
    if not CORPUS.exists():
        pytest.skip(NO_CORPUS)
    graphs: dict[str, Graph] = {}
    for path in sorted((CORPUS / "graphs").rglob("*.json")):
        try:
            reading = codec.read(path.read_bytes())
        except codec.Unreadable:
            continue
        graphs.setdefault(reading.graph.name, reading.graph)
    hierarchical = 0
    for graph in graphs.values():
        found = flattened(graph, graphs)
        hierarchical += any(action.name in graphs for action in graph.actions)
        if isinstance(found, Unflattenable):
            assert found.reasons
            continue
        if found.graph is not graph:
            agree(Hierarchy(graph, graphs), found, Random(5), stop=False)
    assert hierarchical > 0


def test_long_chains_and_several_branches_are_looked_at_whole() -> None:
    names = [f"A{n}" for n in range(400)]
    arrows = [f"{one}>{other}" for one, other in pairwise(["entry", *names, "S", "exit"])]
    assert isinstance(flattened(graph_of(*arrows), {"S": TWO}), Flattened)
    branches = [arrow for n in range(6) for arrow in (f"S>A{n}", f"A{n}>B{n}", f"B{n}>exit")]
    assert isinstance(flattened(graph_of("entry>S", *branches), {"S": TWO}), Flattened)
