"""An unpacked sub-graph is the graph from which it was made."""

from collections import Counter

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from action_assistant.umrf.hierarchy.extraction import (
    Extracted,
    Unpackable,
    Unpacked,
    behaviour_differences,
    extracted,
    unpacked,
)
from action_assistant.umrf.hierarchy.flattening import Flattened, flattened
from action_assistant.umrf.hierarchy.inlining import under_keys
from action_assistant.umrf.model import Conditions, Graph
from support.doses import examples, is_share
from umrf.hierarchy.hierarchies import Hierarchy, hierarchies, leaf
from umrf.hierarchy.lines import CHAIN, TWO, changed, inner, with_values
from umrf.hierarchy.test_extraction import SAME, graphs
from umrf.semantics.traces import graph_of


def again(graph: Graph, back: Unpacked) -> Graph:
    """The unpacked graph under the keys that the actions had."""
    names = {action.full_name: action.key for action in graph.actions}
    keys = {action.key: names[action.full_name] for action in back.graph.actions}
    return under_keys(back.graph, keys)


@pytest.mark.parametrize("what", SAME)
def test_an_extracted_sub_graph_unpacks_to_the_original_graph(what: str) -> None:
    graph, chosen = SAME[what]
    places = {a.key: (float(40 * n), float(200 * n)) for n, a in enumerate(graph.actions)}
    graph = replace(
        graph,
        actions=tuple(
            replace(a, position=places[a.key], extra=(("mark", f'"{a.key}"'),))
            for a in graph.actions
        ),
    )
    made = extracted(graph, set(chosen), "S", "new")
    assert isinstance(made, Extracted)
    back = unpacked(made.outer, "new", made.inner)
    assert isinstance(back, Unpacked)
    assert (back.differences, back.left_out) == ((), ())
    assert list(behaviour_differences(graph, again(graph, back))) == []
    shown = {a.name: (a.position, a.extra) for a in back.graph.actions}
    assert shown == {a.name: (a.position, a.extra) for a in graph.actions}
    assert {a.key for a in back.graph.actions} == {a.key for a in graph.actions}
    assert set(back.keys) == set(chosen)


@pytest.mark.timeout(900)
def test_any_graph_is_extracted_and_unpacked_or_refused_with_a_reason() -> None:
    told = Counter[str]()

    @settings(
        max_examples=examples(150), deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )  # fmt: skip
    @given(data=st.data(), wired=st.booleans())
    def make(data: st.DataObject, wired: bool) -> None:
        graph = data.draw(graphs(wired=wired))
        keys = [action.key for action in graph.actions]
        made = extracted(graph, data.draw(st.sets(st.sampled_from(keys), min_size=1)), "S", "new")
        told["all"] += 1
        if not isinstance(made, Extracted):
            return
        back = unpacked(made.outer, "new", made.inner)
        if isinstance(back, Unpackable):
            assert back.reasons
            assert made.differences
            return
        told["back"] += 1
        # Whoever looks at history, statistics or a comparison finds each action again.
        assert {a.key: a.name for a in back.graph.actions} == {a.key: a.name for a in graph.actions}
        assert back.differences == made.differences or "otherwise" in {
            each.code for each in made.differences
        }
        if not made.differences:
            assert list(behaviour_differences(graph, again(graph, back))) == []

    make()
    assert is_share(told["back"], told["all"], 1 / 5)


def by_name(graph: Graph) -> Graph:
    return under_keys(graph, {action.key: action.full_name for action in graph.actions})


def test_one_level_unpacked_is_the_flat_graph() -> None:
    """About one hierarchy of ten; test_flattening compares their courses."""
    told = Counter[str]()

    @settings(
        max_examples=examples(500), deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )  # fmt: skip
    @given(hierarchy=hierarchies())
    def unpack(hierarchy: Hierarchy) -> None:
        graphs = hierarchy.graphs
        subs = [a for a in hierarchy.graph.actions if a.name in graphs]
        told["all"] += bool(subs)
        for action in subs:
            back = unpacked(hierarchy.graph, action.key, graphs[action.name])
            if isinstance(back, Unpackable):
                assert back.reasons
                continue
            names = [each.full_name for each in back.graph.actions]
            assert len(set(names)) == len(names)
            below = {a.name for a in back.graph.actions} & graphs.keys()
            if not below and not back.differences:
                found = flattened(hierarchy.graph, graphs)
                assert isinstance(found, Flattened)
                assert list(behaviour_differences(by_name(found.graph), by_name(back.graph))) == []
                told["unpacked"] += 1

    unpack()
    assert is_share(told["unpacked"], told["all"], 1 / 20)


def test_an_action_that_is_unpacked_twice_is_two_actions() -> None:
    twice = graph_of("entry>S", "S>T", "T>exit")
    one = unpacked(changed(twice, "T", name="S", instance_id=1), "S", TWO)
    assert isinstance(one, Unpacked)
    assert set(one.keys) == {action.key for action in TWO.actions}
    two = unpacked(one.graph, "T", TWO)
    assert isinstance(two, Unpacked)
    assert not set(one.keys) & set(two.keys)
    assert len({action.key for action in two.graph.actions}) == len(two.graph.actions)


def test_only_the_chosen_one_of_two_places_of_a_sub_graph_is_unpacked() -> None:
    outer = changed(graph_of("entry>S", "S>T", "T>exit"), "T", name="S", instance_id=1)
    back = unpacked(outer, "T", TWO)
    assert isinstance(back, Unpacked)
    assert [a.full_name for a in back.graph.actions] == ["S_0", "X_0", "Y_0"]
    assert back.differences == ()


def test_a_difference_in_behaviour_is_reported_with_its_place() -> None:
    halting = inner("entry>X", "X>Y", "Y>exit", XY=Conditions("run"))
    back = unpacked(CHAIN, "S", halting)
    assert isinstance(back, Unpacked)
    (reason,) = back.differences
    assert (reason.code, [level.action for level in reason.at]) == ("never-ends", ["S_0"])
    assert "Unpacked" not in reason.message


def test_a_sub_graph_without_equivalent_arrows_is_refused() -> None:
    text = leaf("string")
    other = with_values(CHAIN, S=({"p": text}, {}))
    assert isinstance(unpacked(other, "S", TWO), Unpackable)
    assert isinstance(unpacked(CHAIN, "S", replace(TWO, actions=(), relations=())), Unpackable)


def test_actions_that_would_be_covered_are_moved() -> None:
    at = {"A": (0.0, 0.0), "S": (0.0, 200.0), "B": (0.0, 400.0)}
    outer = replace(CHAIN, actions=tuple(replace(a, position=at[a.name]) for a in CHAIN.actions))
    places = {"X": (0.0, 0.0), "Y": (0.0, 400.0)}
    sub = replace(TWO, actions=tuple(replace(a, position=places[a.name]) for a in TWO.actions))
    back = unpacked(outer, "S", sub)
    assert isinstance(back, Unpacked)
    assert {a.name: a.position for a in back.graph.actions} == {
        "A": (0.0, -200.0), "X": (0.0, 0.0), "Y": (0.0, 400.0), "B": (0.0, 600.0),
    }  # fmt: skip
    small = replace(
        TWO, actions=tuple(replace(a, position=(0.0, 60.0 * n)) for n, a in enumerate(TWO.actions))
    )
    near = unpacked(outer, "S", small)
    assert isinstance(near, Unpacked)
    assert next(a.position for a in near.graph.actions if a.name == "A") == (0.0, 0.0)
