"""Breakpoints of a graph whose sub-graphs are opened."""

import pytest

from action_assistant.umrf.breakpoints import Breakpoint, Told, ValueTest
from action_assistant.umrf.hierarchy.opening import (
    CannotOpen,
    OpenedGraph,
    opened,
    opened_breakpoints,
)
from runner.execution.test_conducted_subgraphs import going_on, named
from runner.harness import sequence


def task(inside: int = 2) -> OpenedGraph:
    """`Work_0` → `Pick_0`, a graph of some actions, → `Work_2`."""
    graph = going_on(named(sequence("task", 3), "Work", "Pick"))
    return opened(graph, {"Pick": going_on(sequence("Pick", inside))})


def translated(found: OpenedGraph, **place: object) -> list[tuple[str, str, tuple[Told, ...]]]:
    each = Breakpoint(**place)  # type: ignore[arg-type]
    return [(one.action, one.to, one.outcomes) for one in opened_breakpoints(found, [each])]


def test_the_opened_graph_keeps_its_name_and_says_where_its_actions_are() -> None:
    found = task()
    assert found.graph.name == "task"
    assert [each.full_name for each in found.graph.actions] == [
        "Work_0",
        *found.levels,
        "Work_2",
    ]
    assert set(found.levels.values()) == {("Pick_0",)}


def test_a_breakpoint_at_a_sub_graph_is_where_that_begins_or_ends() -> None:
    found = task()
    first, last = found.levels
    assert translated(found, action="Pick_0") == [(first, "", ())]
    assert translated(found, action="Pick_0", outcomes=("false",)) == [(last, "", ("false",))]
    assert translated(found, action="Work_0", to="Pick_0") == [("Work_0", first, ())]
    assert translated(found, action="Pick_0", to="Work_2") == [(last, "Work_2", ())]
    assert translated(found, action="Work_2") == [("Work_2", "", ())]
    assert translated(found, action="Work_2", to="exit") == [("Work_2", "exit", ())]


def test_a_value_that_the_first_action_inside_lacks_is_no_condition() -> None:
    test = ValueTest("nothing", "==", 1.0)
    (one,) = opened_breakpoints(task(), [Breakpoint(action="Pick_0", value=test)])
    assert one.value is None


def test_what_is_not_known_to_do_the_same_is_not_opened() -> None:
    graph = going_on(named(sequence("task", 2), "Pick"))
    with pytest.raises(CannotOpen, match="one by one"):
        opened(graph, {"Pick": going_on(named(sequence("Pick", 2), "Pick"))})
