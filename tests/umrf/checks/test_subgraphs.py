"""Graphs inside graphs, as `check` sees them."""

import json
import sys
from itertools import pairwise
from typing import Any

import msgspec
import pytest

from action_assistant.umrf.check import blocking, check, check_reading
from action_assistant.umrf.checks.subgraphs import Resolution
from action_assistant.umrf.files.codec import read
from action_assistant.umrf.model import Action, Graph, Signature
from action_assistant.umrf.semantics import Engine, GraphRefused
from support.recordings import family

SAFE = ["on_error -> ignore"]
RUN = ["on_error -> run"]
TEXT = {"pvf_type": "string"}


def graph(name: str, *actions: dict[str, Any], exits: bool = True, **fields: Any) -> Graph:
    """A chain of these actions."""
    file: dict[str, Any] = {"graph_name": name, "actions": list(actions)} | fields
    for first, second in pairwise(actions):
        first["children"] = [{"name": second["name"]}]
        second.setdefault("parents", [{"name": first["name"], "conditions": SAFE}])
    file["graph_entry"] = [{"name": actions[0]["name"]}]
    file["graph_exit"] = [{"name": actions[-1]["name"], "conditions": RUN}] if exits else []
    return read(json.dumps(file)).graph


def action(name: str, **fields: Any) -> dict[str, Any]:
    return {"name": name, "type": "sync"} | fields


def found(outer: Graph, *inner: Graph, library: Any = None) -> dict[str, str]:
    graphs = {each.name: each for each in inner}
    return {p.code: p.severity for p in check(outer, library, graphs=graphs)}


def test_a_sound_sub_graph_is_no_problem() -> None:
    assert found(graph("outer", action("Inner"), action("B")), graph("Inner", action("A"))) == {}


def test_a_sub_graph_that_never_finishes_keeps_its_parent_running_for_ever() -> None:
    inner = graph("Inner", action("A"), exits=False)
    (problem,) = check(graph("outer", action("Inner")), graphs={"Inner": inner})
    assert (problem.code, problem.severity) == ("H8", "error")
    assert problem.where.path == "/actions/0/name"
    assert "HALTED in any case" in problem.message


def test_a_sub_graph_that_may_be_halted_is_a_warning_that_says_when() -> None:
    inner = graph("Inner", action("A"), action("B"))
    outer = graph("outer", action("Inner"))
    assert found(outer, inner) == {"H8": "warning"}
    (problem,) = check(outer, graphs={"Inner": inner})
    assert "ends HALTED if A_0 ends with on_error" in problem.message


def test_an_error_in_a_sub_graph_is_an_error_of_the_graph_around_it() -> None:
    inner = graph("Inner", action("A", children=[]), action("B", parents=[]))
    assert found(graph("outer", action("Inner")), inner) == {"subgraph": "error"}


def test_a_sub_graph_gets_its_inputs_from_outside() -> None:
    inner = graph("Inner", action("A", input_parameters={"text": TEXT}))
    given = {"input_parameters": {"text": TEXT | {"pvf_value": "x"}}}
    assert found(graph("outer", action("Inner", **given)), inner) == {}
    assert found(graph("outer", action("Inner")), inner) == {"signature": "error"}


def test_graphs_that_contain_each_other_are_found() -> None:
    first, second = graph("First", action("Second")), graph("Second", action("First"))
    assert found(first, first, second) == {"recursion": "error"}
    assert found(graph("outer", action("First")), first, second) == {"recursion": "error"}


def test_a_graph_that_is_known_by_another_name_than_its_own_may_contain_itself() -> None:
    inner = graph("Called otherwise", action("First"))
    assert found_by_name(graph("outer", action("First")), {"First": inner}) == {"recursion"}
    ring = {"First": graph("x", action("Second")), "Second": graph("x", action("First"))}
    assert found_by_name(graph("outer", action("First")), ring) == {"recursion"}


def test_an_action_called_like_the_graph_that_it_is_in_is_no_way_into_an_older_one() -> None:
    older = graph("outer", action("A"))
    assert found_by_name(graph("outer", action("outer")), {"outer": older}) == {"recursion"}


def found_by_name(outer: Graph, graphs: dict[str, Graph]) -> set[str]:
    return {problem.code for problem in check(outer, graphs=graphs)}


def test_a_hierarchy_may_be_deeper_than_the_stack_of_the_interpreter() -> None:
    depth = sys.getrecursionlimit() + 50
    chain = {f"L{n}": graph(f"L{n}", action(f"L{n + 1}")) for n in range(depth)}
    chain[f"L{depth}"] = graph(f"L{depth}", action("A"), exits=False)
    (problem,) = check(graph("outer", action("L0")), graphs=chain)
    assert problem.code == "subgraph"
    assert problem.inside is not None
    assert (len(problem.inside.levels), problem.inside.graph) == (depth, f"L{depth - 1}")


def beside(*names: str) -> Graph:
    """A chain of actions of these full names."""
    actions = []
    for full_name in names:
        name, _, number = full_name.rpartition("_")
        actions.append(action(name, instance_id=int(number)))
    file: dict[str, Any] = {"graph_name": "outer", "actions": actions}
    for first, second in pairwise(actions):
        first["children"] = [{k: second[k] for k in ("name", "instance_id")}]
        above = {k: first[k] for k in ("name", "instance_id")}
        second["parents"] = [above | {"conditions": SAFE}]
    file["graph_entry"] = [{k: actions[0][k] for k in ("name", "instance_id")}]
    end = {k: actions[-1][k] for k in ("name", "instance_id")}
    file["graph_exit"] = [end | {"conditions": RUN}]
    return read(json.dumps(file)).graph


#: The behaviour of the real node with these on 2026-11-22, each started as the first graph of its
#: name.
RESOLVED = [
    (("Seq_0",), True),
    (("Seq_0", "Seq_1"), False),
    (("Nest_0", "Seq_0"), True),  # in the order of names, Nest is resolved before Seq is used up
    (("Seq_0", "Nest_0"), True),  # whatever the order of arrows
    (("Seq_0", "ZNest_0"), False),
    (("Nest_0", "ZNest_0"), True),
    (("Twice_0",), False),
    (("Nest_0", "Nest_1"), False),
]


@pytest.mark.parametrize(("names", "resolves"), RESOLVED)
def test_a_sub_graph_is_used_up_for_what_the_engine_resolves_after_it(
    names: tuple[str, ...], resolves: bool
) -> None:
    outer = beside(*names)
    inner = {
        "Seq": graph("Seq", action("A")),
        "Nest": graph("Nest", action("Seq")),
        "ZNest": graph("ZNest", action("Seq")),
        "Twice": msgspec.structs.replace(beside("Seq_0", "Seq_1"), name="Twice"),
    }
    problems = [p for p in check(outer, graphs=inner) if p.code == "subgraph-twice"]
    assert [p.severity for p in problems] == ([] if resolves else ["error"])
    engine = Engine(library=inner)
    if resolves:
        engine.start(outer, 0.0)
        return
    assert problems[0].where.path == f"/actions/{len(names) - 1}/name"
    with pytest.raises(GraphRefused, match="Could not resolve graph 'outer'"):
        engine.start(outer, 0.0)


def test_each_robot_resolves_its_own_sub_graphs() -> None:
    both = beside("Seq_0", "Seq_1")
    first, second = both.actions
    shared = tuple(
        msgspec.structs.replace(each, actor=actor)
        for each, actor in ((first, "Arm"), (second, "Base"))
    )
    apart = msgspec.structs.replace(both, actions=shared)
    seq = graph("Seq", action("A"))
    assert "subgraph-twice" not in {p.code for p in check(apart, graphs={"Seq": seq})}


def test_sub_graphs_that_double_with_each_level_are_looked_at_for_a_moment_only() -> None:
    library = {
        f"{side}{level}": graph(f"{side}{level}", action(f"L{level + 1}"), action(f"R{level + 1}"))
        for level in range(60)
        for side in "LR"
    }
    check(graph("outer", action("L0"), action("R0")), graphs=library)


def test_an_action_comes_before_a_graph_of_its_name_and_a_graph_before_the_unknown() -> None:
    inner = graph("Inner", action("A"), exits=False)
    outer = graph("outer", action("Inner"))
    assert found(outer, inner, library={"Inner": Signature()}) == {"subgraph-hidden": "warning"}
    assert found(outer, library={}) == {"unknown-action": "warning"}
    assert "unknown-action" not in found(outer, inner, library={})


def test_pausing_a_sub_graph_is_told() -> None:
    pausing = [{"name": "A", "conditions": ["on_true -> pause", "on_false -> run", *SAFE]}]
    outer = graph("outer", action("A"), action("Inner", parents=pausing))
    messages = [p.message for p in check(outer, graphs={"Inner": graph("Inner", action("B"))})]
    assert any("Inner_0 is a sub-graph: a pause of it never completes" in m for m in messages)


def test_the_recorded_sub_graph_that_halted_is_found() -> None:
    library = {
        inner.name: inner
        for path in (family("engine") / "subgraphs").glob("*.json")
        for inner in [read(path.read_bytes()).graph]
    }
    halting = {}
    for path in sorted(family("engine").glob("sub_*.graph.json")):
        name = path.name.removesuffix(".graph.json")
        problems = check_reading(read(path.read_bytes()), None, graphs=library)
        halting[name] = [p for p in problems if "ends HALTED" in p.message]
        if name != "sub_halt":
            assert blocking(problems) == [], name
    assert halting["sub_halt"]


def test_a_name_of_several_graphs_is_told_at_each_action_that_uses_it() -> None:
    outer = graph("outer", action("Inner"), action("Other"))
    graphs = {"Inner": graph("Inner", action("A")), "Other": graph("Other", action("A"))}
    resolution = Resolution(several=frozenset({"Inner"}))
    (problem,) = check(outer, graphs=graphs, resolution=resolution)
    assert (problem.code, problem.severity) == ("subgraph-ambiguous", "warning")
    assert problem.where.path == "/actions/0/name"


def test_an_action_of_the_library_hides_a_graph_of_its_name_and_that_is_told() -> None:
    outer, inner = graph("outer", action("Inner")), graph("Inner", action("A"), exits=False)
    told = [("subgraph-hidden", "warning")]
    hidden = check(outer, resolution=Resolution(hidden=frozenset({"Inner"})))
    assert [(each.code, each.severity) for each in hidden] == told
    known = check(outer, {"Inner": Signature()}, graphs={"Inner": inner})
    assert [(each.code, each.severity) for each in known] == told


def test_more_graphs_inside_than_are_looked_at_are_told() -> None:
    outer = graph("outer", action("Inner"))
    inner = {"Inner": graph("Inner", action("A"))}
    found = check(outer, graphs=inner, resolution=Resolution(cut=True))
    assert [(each.code, each.severity) for each in found] == [("not-tried", "warning")]


def only(around: Graph) -> Action:
    (action,) = around.actions
    return action


def broken(name: str) -> Graph:
    """One whose second action nobody leads to from both sides."""
    return graph(name, action("A", children=[]), action("B", parents=[]))


def test_an_error_two_levels_down_is_told_with_the_way_to_it() -> None:
    outer = graph("outer", action("Fetch"))
    inner = {"Fetch": graph("Fetch", action("Grip")), "Grip": broken("Grip")}
    own = [p for p in check(broken("Grip")) if p.severity == "error"]
    problems = check(outer, graphs=inner)
    assert [(p.code, p.severity) for p in problems] == [("subgraph", "error")] * len(own)
    assert {p.where.path for p in problems} == {"/actions/0/name"}
    places = [p.inside for p in problems if p.inside]
    assert [(each.code, each.message, each.where) for each in places] == [
        (each.code, each.message, each.where) for each in own
    ]
    assert {(each.levels, each.graph) for each in places} == {(("Fetch_0", "Grip_0"), "Grip")}
    ways = {each.aids for each in places}
    assert ways == {(only(outer).key, only(inner["Fetch"]).key)}
    assert problems[0].message.startswith(
        f"The sub-graph “Grip” inside Fetch_0 has an error ({own[0].code}): "
    )


def test_a_missing_input_two_levels_down_is_an_error_of_the_outermost_graph() -> None:
    needy = graph("Grip", action("A", input_parameters={"text": TEXT}))
    outer = graph("outer", action("Fetch"))
    (problem,) = check(outer, graphs={"Fetch": graph("Fetch", action("Grip")), "Grip": needy})
    assert problem.inside
    assert (problem.code, problem.inside.code) == ("subgraph", "signature")
    assert problem.inside.levels == ("Fetch_0",)
    assert problem.inside.where.path == "/actions/0/input_parameters"


def test_a_pause_and_an_end_that_never_comes_reach_out_of_two_levels() -> None:
    pausing = [{"name": "A", "conditions": ["on_true -> pause", "on_false -> run", *SAFE]}]
    fetch = graph("Fetch", action("A"), action("Grip", parents=pausing))
    inner = {"Fetch": fetch, "Grip": graph("Grip", action("B"))}
    problems = check(graph("outer", action("Fetch")), graphs=inner)
    paused = [
        p for p in problems if p.code == "H5" and "a pause of it never completes" in p.message
    ]
    assert [p.inside.levels for p in paused if p.inside] == [("Fetch_0",)]

    halting = {
        "Fetch": graph("Fetch", action("Grip")),
        "Grip": graph("Grip", action("B"), exits=False),
    }
    (problem,) = check(graph("outer", action("Fetch")), graphs=halting)
    assert (problem.code, problem.severity) == ("subgraph", "error")
    assert "inside" not in problem.message.split("has an error")[0]
    assert "“Grip” ends HALTED in any case" in problem.message


def test_graphs_that_contain_each_other_far_inside_are_found_once_and_with_their_way() -> None:
    first, second = graph("First", action("Second")), graph("Second", action("First"))
    around = {"Around": graph("Around", action("First")), "First": first, "Second": second}
    (problem,) = check(graph("outer", action("Around")), graphs=around)
    assert problem.inside
    assert (problem.code, problem.inside.code) == ("subgraph", "recursion")
    assert problem.inside.levels == ("Around_0",)


def test_some_of_many_errors_inside_are_reported_with_the_number_of_the_others() -> None:
    lone = [action("A", instance_id=i, children=[], type="sync") for i in range(60)]
    inner = graph("Inner", *lone)
    one = check(graph("outer", action("Inner")), graphs={"Inner": inner})
    assert 1 < len(one) <= 20
    assert "more problems of this kind" in one[-1].message
