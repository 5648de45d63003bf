"""What would take away a problem of leading a graph: a sub-graph of some of its actions."""

import msgspec
import pytest

from action_assistant.umrf.checks.actors import led_problems
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.led_steps import as_one_step
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Relation,
)

NEXT = Conditions(on_true="run", on_false="ignore", on_error="ignore")
ALWAYS = Conditions(on_true="run", on_false="run", on_error="run")


def graph(actors: str, *arrows: str, conditions: Conditions = ALWAYS) -> Graph:
    """A graph of actions A, B, C … with these actors (a letter each), and arrows such as `AB`, `^A`
    and `A$`; a lower-case second letter does not wait for the first one."""
    actions = tuple(
        Action(key=chr(65 + n), name=chr(65 + n), actor=actor) for n, actor in enumerate(actors)
    )
    ends = {"^": ENTRY, "$": EXIT}
    relations = tuple(
        Relation(
            parent=ends.get(a, a),
            child=ends.get(b, b.upper()),
            conditions=ENTRY_CONDITIONS if a == "^" else conditions,
            required=b != b.lower() or b == "$",
            parent_order=number,
            child_order=number,
        )
        for number, (a, b) in enumerate(arrows)
    )
    return Graph(name="g", actions=actions, relations=relations)


def remedies(of: Graph) -> dict[str, str]:
    return as_one_step(of, led_problems(of, PINNED), PINNED)


STEP = "Make a sub-graph of {}: then they go as one step."


def test_two_actions_beside_each_other_that_a_join_waits_for_make_one_step() -> None:
    found = remedies(graph("sdds", "^A", "AB", "AC", "BD", "CD", "D$"))
    assert found == {"two-at-once": STEP.format("B_0 and C_0")}


def test_rows_beside_each_other_make_one_step_as_a_whole() -> None:
    found = remedies(graph("sddddc", "^A", "AB", "AC", "BD", "CE", "DF", "EF", "F$"))
    assert found == {"two-at-once": STEP.format("B_0, C_0, D_0 and E_0")}


def test_a_loop_of_one_robot_makes_one_step() -> None:
    again = Conditions(on_true="ignore", on_false="run", on_error="ignore")
    loop = graph("sddc", "^A", "AB", "BC", "CD", "D$")
    back = Relation(
        parent="C", child="B", conditions=again, required=False, parent_order=9, child_order=9
    )
    relations = tuple(
        msgspec.structs.replace(each, conditions=NEXT) if each.child == "D" else each
        for each in loop.relations
    )
    found = remedies(msgspec.structs.replace(loop, relations=(*relations, back)))
    assert found == {"loaded-anew": STEP.format("B_0 and C_0")}


@pytest.mark.parametrize(
    "unproven",
    [
        graph("sddc", "^A", "AB", "AC", "BD", "B$", "C$"),  # one of them leads on alone
        graph("dc", "^A", "AB", "Ba"),  # a loop of two robots
    ],
)
def test_nothing_is_said_where_a_sub_graph_would_do_otherwise(unproven: Graph) -> None:
    assert remedies(unproven) == {}
