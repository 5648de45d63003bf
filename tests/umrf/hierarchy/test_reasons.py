"""What cannot be made flat, each with its reason and its place; and what can, in its details."""

import json
from random import Random

import msgspec
import pytest
from msgspec.structs import replace

from action_assistant.umrf.files import codec
from action_assistant.umrf.hierarchy import flattening
from action_assistant.umrf.hierarchy.flattening import Flattened, Unflattenable, flattened
from action_assistant.umrf.model import ENGINE_DEFAULTS, Action, Conditions, Graph, Parameter
from support.recordings import CORPUS, NO_CORPUS, family
from umrf.hierarchy.hierarchies import Hierarchy, leaf, nested_names
from umrf.hierarchy.test_flattening import agree
from umrf.semantics.traces import graph_of, optional

RUN_TRUE, OTHERWISE = Conditions("run"), Conditions("ignore", "run", "run")
SAFE = Conditions("run", "run", "ignore", "ignore")


def inner(*arrows: str, name: str = "S", **conditions: Conditions) -> Graph:
    return replace(graph_of(*arrows, **conditions), name=name)


def with_values(graph: Graph, **values: tuple[dict[str, str], dict[str, str]]) -> Graph:
    """`with_values(graph, A=({"p": text}, {"q": text}))`: inputs and outputs of actions."""

    def sides(action: Action) -> Action:
        if action.name not in values:
            return action
        inputs, outputs = (
            tuple(Parameter(*p) for p in side.items()) for side in values[action.name]
        )
        return replace(action, inputs=inputs, outputs=outputs)

    return replace(graph, actions=tuple(map(sides, graph.actions)))


def changed(graph: Graph, which: str, **fields: object) -> Graph:
    actions = (replace(a, **fields) if a.name == which else a for a in graph.actions)
    return replace(graph, actions=tuple(actions))


TEXT = leaf("string")
CHAIN = graph_of("entry>A", "A>S", "S>B", "B>exit")
ONE = inner("entry>X", "X>exit")
TWO = inner("entry>X", "X>Y", "Y>exit")
SIDE_BY_SIDE = inner("entry>X", "entry>Y", "X>exit", "Y>exit")
CHOICE = optional(
    inner("entry>X", "X>Y", "Y>exit", "X>exit", XY=RUN_TRUE, Xexit=OTHERWISE), "Y>exit", "X>exit"
)
LOOP = optional(
    inner("entry>X", "X>Y", "Y>X", "Y>exit", YX=OTHERWISE, Yexit=RUN_TRUE), "Y>X", "X>Y"
)

ACCEPTED = {
    "one action": (CHAIN, ONE),
    "a chain": (CHAIN, TWO),
    "a loop inside": (CHAIN, LOOP),
    "an exit that waits for all": (CHAIN, SIDE_BY_SIDE),
    "an exit that several reach": (CHAIN, CHOICE),
    "the sub-graph alone": (graph_of("entry>S", "S>exit"), CHOICE),
    "beside others": (
        graph_of("entry>A", "entry>S", "A>B", "S>B", "B>exit"),
        SIDE_BY_SIDE,
    ),
    "a bypass goes through": (
        graph_of("entry>A", "A>S", "S>B", "B>exit", AS=ENGINE_DEFAULTS),
        inner("entry>X", "X>Y", "Y>exit", XY=ENGINE_DEFAULTS, Yexit=ENGINE_DEFAULTS),
    ),
    "values go through": (
        with_values(CHAIN, A=({}, {"p": TEXT}), S=({"p": TEXT}, {"q": TEXT}), B=({"q": TEXT}, {})),
        with_values(
            inner("entry>X", "X>exit", Xexit=ENGINE_DEFAULTS), X=({"p": TEXT}, {"q": TEXT})
        ),
    ),
    "a value in the file": (
        with_values(CHAIN, S=({"p": leaf("string", '"s"')}, {})),
        with_values(ONE, X=({"p": TEXT}, {})),
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", ACCEPTED)
def test_what_can_be_flat_has_the_same_course(what: str) -> None:
    outer, sub = ACCEPTED[what]
    found = flattened(outer, {"S": sub})
    assert isinstance(found, Flattened)
    hierarchy = Hierarchy(outer, {"S": sub})
    assert agree(hierarchy, found, Random(7), stop=False) > 5
    assert agree(hierarchy, found, Random(7), stop=True) > 5


REFUSED = {
    "halts": ("never-ends", CHAIN, inner("entry>X", "X>Y", "Y>exit", XY=SAFE)),
    "waits": ("never-ends", CHAIN, inner("entry>X", "X>exit", "Y>exit")),
    "waits for outputs": (
        "never-ends",
        with_values(CHAIN, S=({}, {"q": TEXT})),
        with_values(ONE, X=({}, {"q": TEXT})),
    ),
    "ends early": (
        "left-running", CHAIN,
        optional(inner("entry>X", "entry>Y", "X>exit", "Y>exit"), "X>exit", "Y>exit"),
    ),
    "goes on when the graph around it has ended": (
        "left-running",
        optional(graph_of("entry>A", "entry>S", "A>exit", "S>exit"), "A>exit", "S>exit"), ONE,
    ),
    "asks another beside the exit": ("left-running", CHAIN, inner("entry>X", "X>Y", "X>exit")),
    "asks one beside the exit that does not begin": (
        "asks-beside", CHAIN,
        inner("entry>X", "X>Y", "X>exit", "Z>Y"),
    ),
    "a second time": (
        "begins-again", optional(graph_of("entry>A", "A>S", "S>A", "S>exit", SA=OTHERWISE,
        Sexit=RUN_TRUE), "S>A", "A>S"), ONE,
    ),
    "a bypass that nothing lets through": (
        "bypass", graph_of("entry>A", "A>S", "S>B", "B>exit", AS=ENGINE_DEFAULTS), TWO,
    ),
    "told to stop": (
        "stops", graph_of("entry>A", "A>S", "S>B", "B>exit", AS=Conditions("run", "stop")), ONE,
    ),
    "told to restart": (
        "response", graph_of("entry>A", "A>S", "S>B", "B>exit", AS=Conditions("run", "restart")), ONE,
    ),
    "stops inside": ("stops", CHAIN, inner("entry>X", "X>Y", "Y>exit", XY=Conditions("stop"))),
    "spontaneous": ("spontaneous", CHAIN, changed(ONE, "X", type="spontaneous")),
    "ways out that are both required and not": (
        "exits",
        CHAIN,
        optional(
            inner("entry>X", "X>Y", "Y>exit", "X>exit", XY=RUN_TRUE, Xexit=OTHERWISE), "Y>exit"
        ),
    ),
    "what follows waits for others": (
        "exits", graph_of("entry>A", "entry>S", "A>B", "S>B", "B>exit"), CHOICE,
    ),
    "an end inside that is none, and others wait": (
        "exits", graph_of("entry>A", "entry>S", "A>B", "S>B", "B>exit"), changed(LOOP, "X"),
    ),
    "all have to end, and one is bypassed": (
        "exits",
        CHAIN,
        inner(
            "entry>X", "X>Y", "Y>exit", "X>exit", XY=RUN_TRUE,
            Xexit=Conditions("ignore", "bypass", "bypass"),
        ),
    ),
    "an input that one entry needs and another does not": (
        "entries",
        with_values(CHAIN, A=({}, {"p": TEXT}), S=({"p": TEXT}, {})),
        with_values(SIDE_BY_SIDE, X=({"p": TEXT}, {})),
    ),
    "other types": (
        "inputs",
        with_values(CHAIN, A=({}, {"p": TEXT}), S=({"p": leaf("number")}, {})),
        with_values(ONE, X=({"p": TEXT}, {})),
    ),
    "values that are gone in a loop": (
        "loop",
        with_values(CHAIN, A=({}, {"p": TEXT}), S=({"p": TEXT}, {})),
        with_values(LOOP, X=({"p": TEXT}, {})),
    ),
    "a value that would go past the sub-graph": (
        "renaming",
        with_values(CHAIN, A=({}, {"p": TEXT}), S=({}, {})),
        with_values(ONE, X=({"p": leaf("string", '"own"')}, {})),
    ),
    "outputs, and an end with an error": (
        "outputs",
        with_values(CHAIN, S=({}, {"q": leaf("string", extra=',"pvf_required":false')})),
        with_values(ONE, X=({}, {"q": leaf("string", extra=',"pvf_required":false')})),
    ),
    "choosy": (
        "allowed-values",
        with_values(graph_of("entry>A", "A>B", "B>S", "S>exit"), A=({}, {"p": TEXT}),
                    B=({"p": leaf("string", extra=',"pvf_allowed_values":["a"]')}, {})),
        ONE,
    ),
    "other parameters": ("signature", CHAIN, with_values(ONE, X=({"p": TEXT}, {}))),
    "itself": ("recursion", CHAIN, inner("entry>S", "S>exit")),
    "two actors": ("actors", changed(CHAIN, "A", actor="one"), changed(ONE, "X", actor="two")),
    "a ghost": ("faulty", CHAIN, changed(TWO, "Y", missing=True)),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_flat_says_why(what: str) -> None:
    code, outer, sub = REFUSED[what]
    found = flattened(outer, {"S": sub})
    assert isinstance(found, Unflattenable)
    assert code in {reason.code for reason in found.reasons}


def test_a_reason_leads_to_its_place_at_any_depth() -> None:
    middle = inner("entry>T", "T>exit", name="S")
    deepest = inner("entry>X", "X>Y", "Y>exit", name="T", XY=SAFE)
    found = flattened(CHAIN, {"S": middle, "T": deepest})
    assert isinstance(found, Unflattenable)
    (reason,) = found.reasons
    assert [(level.graph, level.action) for level in reason.at] == [("g", "S_0"), ("S", "T_0")]
    assert "when X_0 ends on_error" in reason.message


def test_all_reasons_are_told_and_not_the_first_alone() -> None:
    outer = graph_of("entry>S", "S>T", "T>exit", ST=ENGINE_DEFAULTS)
    halting = inner("entry>X", "X>exit", Xexit=SAFE)
    found = flattened(
        outer, {"S": halting, "T": changed(replace(ONE, name="T"), "X", type="spontaneous")}
    )
    assert isinstance(found, Unflattenable)
    assert [(r.code, r.at[0].action) for r in found.reasons] == [
        ("never-ends", "S_0"), ("spontaneous", "T_0"),
    ]  # fmt: skip


def test_more_than_is_looked_at_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flattening, "BUDGET", 10)
    found = flattened(CHAIN, {"S": TWO})
    assert isinstance(found, Unflattenable)
    assert {reason.code for reason in found.reasons} == {"undecided"}


def test_levels_and_actions_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    deep = {f"N{n}": inner(f"entry>N{n + 1}", f"N{n + 1}>exit", name=f"N{n}") for n in range(60)}
    found = flattened(graph_of("entry>N0", "N0>exit"), deep | {"N60": replace(ONE, name="N60")})
    assert isinstance(found, Unflattenable)
    assert [reason.code for reason in found.reasons] == ["too-large"]
    doubling = {
        f"N{n}": replace(
            graph_of(f"entry>N{n + 1}", f"N{n + 1}>B", "B>exit"), name=f"N{n}",
        )
        for n in range(12)
    }  # fmt: skip
    for name, graph in doubling.items():
        again = f"N{int(name[1:]) + 1}"
        doubling[name] = changed(graph, "B", name=again, instance_id=1)
    doubling["N12"] = replace(ONE, name="N12")
    monkeypatch.setattr(flattening, "MOST", 500)
    found = flattened(graph_of("entry>N0", "N0>exit"), doubling)
    assert isinstance(found, Unflattenable)
    assert {reason.code for reason in found.reasons} == {"too-large"}


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


def test_unknown_fields_survive_and_what_has_no_place_is_told() -> None:
    outer = changed(CHAIN, "S", extra=(("team", '"red"'),))
    outer = changed(outer, "A", extra=(("mark", "1"),))
    relations = (
        replace(r, parents_extra=(("why", '"x"'),)) if r.child == "S" else r
        for r in outer.relations
    )
    sub = changed(replace(TWO, extra=(("license", '"MIT"'),)), "Y", extra=(("deep", "[2]"),))
    found = flattened(replace(outer, relations=tuple(relations)), {"S": sub})
    assert isinstance(found, Flattened)
    actions = {a["name"]: a for a in json.loads(codec.write(found.graph))["actions"]}
    assert actions["A"]["mark"] == 1
    assert actions["Y"]["deep"] == [2]
    assert actions["X"]["parents"][0]["why"] == "x"
    (left,) = found.left_out
    assert (left.levels[-1].action, left.fields) == ("S_0", ("team", "license"))


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
    if not (folder / f"{name}.graph.json").exists():
        pytest.skip("this recording is not here")
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
