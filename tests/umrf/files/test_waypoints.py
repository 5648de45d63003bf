"""Waypoints in files refer to actions by name, so that they survive new keys."""

import json
from typing import Any

import pytest

from action_assistant.editor.documents import document
from action_assistant.umrf.files.codec import Stamp, read, write
from action_assistant.umrf.model import Graph

POINTS = [[120, -40], [240, -40]]
FILE: dict[str, Any] = {
    "graph_name": "g",
    "graph_entry": [{"name": "A", "instance_id": 0}],
    "graph_exit": [],
    "actions": [
        {"name": "A", "type": "sync", "children": [{"name": "B"}]},
        {"name": "B", "type": "sync", "parents": [{"name": "A"}]},
    ],
}
BEND = {"parent": "A_0", "child": "B_0", "response": "run", "points": POINTS}


def having(*waypoints: object, **fields: object) -> str:
    ours = {"action_assistant": {"waypoints": list(waypoints)}}
    return json.dumps(FILE | fields | {"gui_attributes": ours})


def said(graph: Graph) -> dict[str, object]:
    """Return the waypoints of each arrow, by the names of its ends."""
    names = {action.key: action.full_name for action in graph.actions}
    return {
        f"{names.get(r.parent, r.parent)}>{names.get(r.child, r.child)};{r.listing} {response}": (
            json.loads(text)
        )
        for r in graph.relations
        for response, text in r.waypoints
    }


def test_waypoints_survive_a_document_with_new_keys_and_a_stamp() -> None:
    graph = document.with_aids(read(having(BEND)).graph)
    shown = document.read_maps(document.flatten(graph))
    again = read(write(shown, Stamp(run="R"))).graph
    assert said(again) == said(graph) == {"A_0>B_0;0 run": POINTS}
    ours = json.loads(write(shown))["gui_attributes"]["action_assistant"]
    assert ours == {"waypoints": [BEND]}


def test_a_file_without_waypoints_says_nothing_of_them() -> None:
    assert "gui_attributes" not in write(read(having()).graph)


def test_the_ends_of_the_graph_have_names_of_their_own() -> None:
    bends = [
        {"parent": "entry", "child": "A_0", "response": "run", "points": POINTS},
        {"parent": "B_0", "child": "exit", "response": "run", "points": POINTS},
    ]
    graph = read(having(*bends, graph_exit=[{"name": "B"}])).graph
    assert said(graph) == {"entry>A_0;0 run": POINTS, "B_0>exit;0 run": POINTS}
    assert said(read(write(graph)).graph) == said(graph)


def test_relations_listed_twice_have_waypoints_of_their_own() -> None:
    actions = [
        {"name": "A", "type": "sync", "children": [{"name": "B"}, {"name": "B"}]},
        {"name": "B", "type": "sync", "parents": [{"name": "A"}, {"name": "A"}]},
    ]
    second = BEND | {"listing": 1, "points": [[7, 7]]}
    graph = read(having(BEND, second, actions=actions)).graph
    assert said(graph) == {"A_0>B_0;0 run": POINTS, "A_0>B_0;1 run": [[7, 7]]}
    assert said(read(write(graph)).graph) == said(graph)


@pytest.mark.parametrize(
    "odd",
    [
        7,
        {},
        BEND | {"parent": "Nobody_0"},
        BEND | {"response": "jump"},
        BEND | {"response": ["run"]},
        BEND | {"listing": 1e300},
        BEND | {"listing": 0.5, "parent": 3},
        {key: value for key, value in BEND.items() if key != "points"},
    ],
)
def test_waypoints_that_fit_no_relation_are_left_out(odd: object) -> None:
    assert said(read(having(odd, BEND)).graph) == {"A_0>B_0;0 run": POINTS}
    assert said(read(having(odd)).graph) == {}


def test_waypoints_that_are_no_list_are_left_out() -> None:
    file = FILE | {"gui_attributes": {"action_assistant": {"waypoints": {"a": BEND}}}}
    assert said(read(json.dumps(file)).graph) == {}
