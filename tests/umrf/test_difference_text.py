"""A difference as text: changes for a robot line by line, and changes of the drawing apart."""

import json
from typing import Any

from hypothesis import given, settings

from action_assistant.umrf.difference import Difference, difference
from action_assistant.umrf.difference_text import by_name, is_same, lines, without_looks
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from strategies import graphs
from support.doses import examples


def _graph(**fields: Any) -> Graph:
    speed = {"pvf_type": "number", "pvf_value": fields.pop("speed", 0.4)}
    place = {"position": {"x": fields.pop("x", 0), "y": 0}}
    child = fields.pop("child", "Charge")
    dock = {"name": "Dock", "type": "sync", "input_parameters": {"speed": speed}}
    actions = [
        dock | {"children": [{"name": child}], "gui_attributes": place},
        {"name": child, "type": "sync", "parents": [{"name": "Dock"}]},
    ]
    return codec.read(json.dumps({"graph_name": "pair", "actions": actions} | fields)).graph


def _difference(before: Graph, after: Graph) -> Difference:
    return difference((0, by_name(before)), (0, by_name(after)))


def test_changes_for_a_robot_come_before_changes_of_the_drawing() -> None:
    after = _graph(speed=0.9, child="Load", x=40, graph_description="to the dock")
    assert list(lines(_difference(_graph(), after))) == [
        "~ graph",
        '    description: "" -> "to the dock"',
        "~ Dock_0",
        "    input speed: 0.4 -> 0.9",
        "+ Load_0",
        "- Charge_0",
        "- Charge_0 -> exit",
        "- Dock_0 -> Charge_0",
        "+ Dock_0 -> Load_0",
        "+ Load_0 -> exit",
        "looks only:",
        "    1 action stands elsewhere",
    ]


def test_positions_of_cards_mean_nothing_to_a_robot() -> None:
    found = _difference(_graph(), _graph(x=40))
    assert not is_same(found)
    assert is_same(without_looks(found))


def test_a_parameter_of_another_type_says_so() -> None:
    before, after = _graph(), _graph(speed="fast")
    assert '    input speed: 0.4 -> "fast"' in list(lines(_difference(before, after)))


@given(graphs())
@settings(max_examples=examples(100))
def test_a_graph_does_not_differ_from_itself_and_every_difference_has_a_line(graph: Graph) -> None:
    assert is_same(_difference(graph, graph))
    nothing = Graph(name=graph.name)
    found = _difference(nothing, graph)
    assert bool(list(lines(found))) == (not is_same(found))
