"""Limits on numbers that robots get: what is inside, what is outside, and what cannot be held."""

import json
import math
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.umrf.limits import Limit, extremes, inputs_of, over_limits
from action_assistant.umrf.model import ENTRY, Graph, Parameter, Remap
from runner.harness import sequence

TORQUE = Limit(parameter="torque", most=60)


def parameter(path: str, kind: str, *value: Any) -> Parameter:
    """A parameter of this type, with a value if one is given."""
    leaf: dict[str, Any] = {"pvf_type": kind}
    return Parameter(path, json.dumps(leaf | ({"pvf_value": value[0]} if value else {})))


def task(*inputs: Parameter, outputs: tuple[Parameter, ...] = (), count: int = 1) -> Graph:
    """`Grip_0`, `Grip_1` … one after the other, with these inputs and outputs."""
    line = sequence("task", count)
    actions = tuple(
        msgspec.structs.replace(each, name="Grip", inputs=inputs, outputs=outputs)
        for each in line.actions
    )
    return msgspec.structs.replace(line, actions=actions)


def sentences(graph: Graph, *limits: Limit, inside: dict[str, Graph] | None = None) -> list[str]:
    """Return the sentence of each value outside a limit, for the robot David."""
    found = over_limits(limits or (TORQUE,), inputs_of(graph, inside or {}))
    return [each.sentence("David") for each in found]


@pytest.mark.parametrize(
    ("kind", "value", "shown"),
    [
        ("number", 60.5, "60.5"),
        ("number", 1e300, "1e+300"),
        ("numbers", [1, 60, 61], "[1, 60, 61]"),
        ("string", "60", '"60"'),
        ("bool", True, "true"),
        ("number", "high", '"high"'),
        ("number", None, "null"),
        ("numbers", [1, "2"], '[1.0,"2"]'),
        ("numbers", [[1]], "[[1.0]]"),
        ("geometry_msgs::Pose", 1, "1"),
        ("number", {"x": 1}, '{"x":1.0}'),
    ],
)
def test_a_value_outside_a_limit_is_named_with_its_place_and_the_limit(
    kind: str, value: Any, shown: str
) -> None:
    (said,) = sentences(task(parameter("torque", kind, value)))
    assert said == (
        f"David would get {shown} as torque of Grip_0. The limit there is torque at most 60."
    )


def test_a_value_that_is_missing_is_outside_a_limit() -> None:
    (said,) = sentences(task(parameter("torque", "number")))
    assert said.startswith("David would get no value as torque of Grip_0.")


@given(st.lists(st.floats(), max_size=4), st.floats(-1e9, 1e9), st.floats(-1e9, 1e9), st.booleans())
def test_numbers_are_inside_exactly_if_each_is_finite_and_within_both_bounds(
    numbers: list[float], one: float, other: float, is_one: bool
) -> None:
    least, most = sorted((one, other))
    limit = Limit(parameter="torque", least=least, most=most)
    value: Any = numbers[0] if is_one and numbers else numbers
    members = numbers[:1] if is_one and numbers else numbers
    spelled = json.dumps({"pvf_type": "numbers", "pvf_value": value})
    is_in = all(math.isfinite(each) and least <= each <= most for each in members)
    found = sentences(task(Parameter("torque", spelled)), limit)
    assert (found == []) == is_in


_VALUES = st.floats(-9, 9) | st.lists(st.floats(), max_size=2) | st.just("high")
_BOUNDS = st.floats(-9, 9) | st.none()


@given(
    st.lists(st.tuples(st.sampled_from(["Grip", "Push"]), st.booleans(), _VALUES), max_size=6),
    st.sampled_from(["", "Grip"]),
    _BOUNDS,
    _BOUNDS,
)
def test_of_extremes_one_is_outside_exactly_if_one_of_all_is(
    given_: list[tuple[str, bool, Any]], action: str, least: float | None, most: float | None
) -> None:
    limit = Limit(parameter="torque", action=action, least=least, most=most)
    line = sequence("task", len(given_) or 1)
    actions = tuple(
        msgspec.structs.replace(
            each,
            name=name,
            inputs=(parameter("arm/torque" if is_deep else "torque", "number", value),),
        )
        for each, (name, is_deep, value) in zip(line.actions, given_, strict=False)
    )
    inputs = inputs_of(msgspec.structs.replace(line, actions=actions), {})
    few = extremes(inputs)
    assert bool(list(over_limits([limit], few))) == bool(list(over_limits([limit], inputs)))
    assert sum(map(len, few.values())) <= 2 * 2 * 4


def test_a_limit_counts_for_its_action_and_for_names_that_end_so() -> None:
    graph = task(parameter("arm/torque", "number", 70), parameter("torque_max", "number", 99))
    assert len(sentences(graph)) == 1
    assert len(sentences(graph, Limit(parameter="arm::torque", action="Grip", most=60))) == 1
    assert sentences(graph, Limit(parameter="torque", action="Drive", most=60)) == []


def test_what_an_engine_hands_on_by_itself_cannot_be_held() -> None:
    torque = parameter("torque", "number", 5)
    graph = task(torque, outputs=(parameter("torque", "number"),), count=2)
    (said,) = sentences(graph)
    assert said.startswith(
        "torque of Grip_1 cannot be held to its limit on David: the robot's engine"
    )
    received = {graph.actions[1].key: {"torque"}}
    assert list(over_limits([TORQUE], inputs_of(graph, {}, received))) == []


def test_graphs_inside_are_held_to_the_limits_too() -> None:
    outer = task(parameter("torque", "number", 50))
    inner = msgspec.structs.replace(task(parameter("torque", "number")), name="Grip")
    assert sentences(outer, inside={"Grip": inner}) == []  # it gets what the outer one has
    (said,) = sentences(
        outer, Limit(parameter="torque", action="Grip", most=60), inside={"Grip": inner}
    )
    assert "it is given from outside of its sub-graph, under another action" in said
    renaming = tuple(
        msgspec.structs.replace(each, remap=(Remap("speed", "torque"),))
        if each.parent == ENTRY
        else each
        for each in inner.relations
    )
    renamed = msgspec.structs.replace(inner, relations=renaming)
    assert len(sentences(outer, inside={"Grip": renamed})) == 1
    high = msgspec.structs.replace(task(parameter("torque", "number", 61)), name="Grip")
    assert "61 as torque of Grip_0" in sentences(outer, inside={"Grip": high})[0]


def test_a_limit_that_limits_nothing_has_a_fault() -> None:
    for limit in (
        Limit(parameter="torque"),
        Limit(parameter="torque", most=math.inf),
        Limit(parameter="torque", least=math.nan),
        Limit(parameter="torque", least=2, most=1),
    ):
        assert limit.fault
    assert TORQUE.fault == ""
    assert Limit(parameter="torque", least=2, most=2).fault == ""
