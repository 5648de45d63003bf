"""Breakpoints hold a led run at their place, visit, outcome and value, and nowhere else."""

import msgspec
import pytest

from action_assistant.umrf.breakpoints import (
    Breakpoint,
    NoSuchPlace,
    ValueTest,
    breakpoints_in,
    pinned,
)
from action_assistant.umrf.model import EXIT, Action, Conditions, Graph, Parameter, Relation

LIFT, SCAN, STOP = (Action(key=name, name=name) for name in ("Lift", "Scan", "Halt"))


def graph() -> Graph:
    """Lift goes on to Scan after true, stops Halt after false, and ends the graph after an error."""
    lift = msgspec.structs.replace(LIFT, outputs=(Parameter("pose/x", '{"pvf_type":"number"}'),))
    arrows = (
        Relation(parent="Lift", child="Scan", conditions=Conditions(on_true="run")),
        Relation(parent="Lift", child="Halt", conditions=Conditions(on_false="stop")),
        Relation(parent="Lift", child=EXIT, conditions=Conditions(on_error="run")),
    )
    return Graph(name="g", actions=(lift, SCAN, STOP), relations=arrows)


@pytest.mark.parametrize(
    ("test", "value", "found", "holds"),
    [
        ("==", 5.0, 5, True),
        ("<", 5.0, 4.9, True),
        (">=", 5.0, 4.9, False),
        ("==", "a", "a", True),
        ("==", True, 1, False),
        ("!=", 5.0, "5", True),
        ("<", 5.0, float("nan"), False),
        ("<", 5.0, None, False),
        ("!=", 5.0, None, True),
    ],
)
def test_a_value_meets_a_condition_of_its_own_kind_only(
    test: str, value: object, found: object, holds: bool
) -> None:
    asked = msgspec.convert({"name": "pose::x", "test": test, "value": value}, ValueTest)
    assert asked.holds({"pose::x": found}) is holds


def test_a_breakpoint_on_an_arrow_holds_by_the_outcomes_that_go_on_there() -> None:
    (mark,) = pinned(graph(), [Breakpoint(action="Lift_0", to="Scan_0")])
    assert mark.outcomes == ("true",)
    (mark,) = pinned(graph(), [Breakpoint(action="Lift_0", to="exit")])
    assert mark.outcomes == ("error",)


@pytest.mark.parametrize(
    ("mark", "why"),
    [
        (Breakpoint(action="Lift_0", to="Halt_0"), "Nothing goes on by the arrow"),
        (Breakpoint(action="Lift_0", to="Scan_0", outcomes=("error",)), "Nothing goes on by"),
        (Breakpoint(action="Scan_0", to="Lift_0"), "There is no arrow"),
        (Breakpoint(action="Grip_0"), "There is no action Grip_0"),
        (
            Breakpoint(action="Lift_0", value=ValueTest("pose::x", "<", 1.0)),
            "Lift_0 has no input pose::x",
        ),
    ],
)
def test_a_place_where_no_run_can_wait_is_refused(mark: Breakpoint, why: str) -> None:
    with pytest.raises(NoSuchPlace, match=why):
        pinned(graph(), [mark])


def test_an_output_can_be_a_condition_at_the_end() -> None:
    low = ValueTest("pose::x", "<", 1.0)
    (mark,) = pinned(graph(), [Breakpoint(action="Lift_0", outcomes=("true",), visit=2, value=low)])
    assert mark.holds(2, {"pose::x": 0.5})
    assert not mark.holds(1, {"pose::x": 0.5})
    assert not mark.holds(2, {"pose::x": 1.5})


def test_a_start_names_the_breakpoints_of_a_graph_once_for_each_place_and_none_that_cannot_hold() -> (
    None
):
    texts = {
        "Lift": '{"outcomes":["error","true"],"value":{"name":"pose::x","test":"<","value":1}}',
        "Scan": '{"visit":7,"colour":"red"}',
        "Halt": '{"visit":-1}',
        "Lift>Scan": "{}",
        "Lift>Halt": "{}",  # a stop always passes
        "Lift>exit": "no JSON",
    }
    drawn = graph()
    actions = tuple(
        msgspec.structs.replace(each, breakpoint=texts[each.key]) for each in drawn.actions
    )
    arrows = tuple(
        msgspec.structs.replace(each, breakpoint=texts[f"{each.parent}>{each.child}"])
        for each in drawn.relations
    )
    listed_twice = msgspec.structs.replace(arrows[0], breakpoint='{"visit":2}', listing=1)
    marked = msgspec.structs.replace(drawn, actions=actions, relations=(*arrows, listed_twice))
    found = breakpoints_in(marked)
    test = ValueTest("pose::x", "<", 1)
    assert found == (
        Breakpoint(action="Lift_0", outcomes=("true", "error"), value=test),
        Breakpoint(action="Scan_0", visit=7),
        Breakpoint(action="Lift_0", to="Scan_0"),
    )
    assert len(pinned(marked, found)) == 3
