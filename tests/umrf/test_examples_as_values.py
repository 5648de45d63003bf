"""Examples of old files, offered as values."""

import json
from pathlib import Path
from typing import Any

import pytest

from action_assistant.umrf.check import check
from action_assistant.umrf.files.codec import Unreadable, read, write
from action_assistant.umrf.fixes import fix, with_examples
from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import Graph
from action_assistant.umrf.parameters import example_of
from support.recordings import CORPUS, NO_CORPUS

#: Parameters with what their examples are as values, for the page too.
VECTORS = Path(__file__).parents[1] / "vectors" / "examples.json"
FILES = sorted(CORPUS.rglob("*.json"))


def graph_of(**parameters: Any) -> Graph:
    """One action that starts the graph, with these inputs."""
    action = {"name": "A", "type": "sync", "input_parameters": parameters}
    return read(json.dumps({"graph_name": "g", "actions": [action]})).graph


def values_of(graph: Graph) -> dict[str, Any]:
    """Every input that has a value, with it."""
    texts = {p.path: json.loads(p.text) for action in graph.actions for p in action.inputs}
    return {path: leaf["pvf_value"] for path, leaf in texts.items() if "pvf_value" in leaf}


def offered(graph: Graph) -> list[str]:
    """Return the places at which the fix is offered."""
    return [p.where.path for p in check(graph) if p.fix == "take-example"]


@pytest.mark.parametrize(
    ("kind", "example", "value"),
    [
        ("string", "left", "left"),
        ("number", "2", 2),
        ("number", "-1.50", -1.5),
        ("number", 3, 3),
        ("bool", "true", True),
        ("bool", False, False),
        ("strings", ["a"], ["a"]),
        ("numbers", "[1, 2]", [1, 2]),
    ],
)
def test_an_example_is_offered_as_the_value_that_its_type_wants(
    kind: str, example: Any, value: Any
) -> None:
    graph = graph_of(x={"pvf_type": kind, "pvf_example": example})
    assert offered(graph) == ["/actions/0/input_parameters/x"]
    mended = fix(graph, next(p for p in check(graph) if p.fix))
    assert values_of(mended) == {"x": value}
    assert not [p for p in check(mended) if p.severity == "error"]
    assert fix(mended, next(p for p in check(graph) if p.fix)) == mended


@pytest.mark.parametrize(
    "leaf",
    [
        {"pvf_type": "number", "pvf_example": "a few"},
        {"pvf_type": "number", "pvf_example": "NaN"},
        {"pvf_type": "number", "pvf_example": True},
        {"pvf_type": "string", "pvf_example": 5},
        {"pvf_type": "bool", "pvf_example": "yes"},
        {"pvf_type": "geometry_msgs/Pose", "pvf_example": "here"},
        {"pvf_type": "numbers", "pvf_example": ["1", 2]},
        {"pvf_type": "string", "pvf_example": "left", "pvf_allowed_values": ["right"]},
        {"pvf_type": "number"},
    ],
)
def test_an_example_of_another_type_is_not_offered(leaf: Any) -> None:
    graph = graph_of(x=leaf)
    assert offered(graph) == []
    assert with_examples(graph, check(graph)) == graph


def test_one_parameter_is_mended_at_a_time_or_all_of_them() -> None:
    leaf = {"pvf_type": "string", "pvf_example": "left", "mine": 1.0}
    kept = {"pvf_type": "string", "pvf_value": "right", "pvf_example": "left"}
    free = {"pvf_type": "string", "pvf_required": False, "pvf_example": "left"}
    graph = graph_of(**{"a/b": {"x~": leaf, "y": leaf}, "z": kept, "f": free})
    second = [p for p in check(graph) if p.fix][1]
    assert values_of(fix(graph, second)) == {"a~1b/y": "left", "z": "right"}
    every = with_examples(graph, check(graph))
    assert values_of(every) == {"a~1b/x~0": "left", "a~1b/y": "left", "z": "right"}
    assert '"mine":1.0' in every.actions[0].inputs[0].text


@pytest.mark.parametrize(("parameter", "value"), json.loads(VECTORS.read_text()))
def test_examples_are_read_as_the_vectors_say(parameter: str, value: str | None) -> None:
    assert example_of(parameter) == (None if value is None else parse_small(value))


@pytest.mark.skipif(not FILES, reason=NO_CORPUS)
def test_examples_leave_no_error_about_a_missing_input_that_has_one() -> None:
    without = sound = 0
    for path in FILES:
        if "pvf_example" not in path.read_text():
            continue
        try:
            graph = read(path.read_bytes()).graph
        except Unreadable:
            continue
        mended = read(write(with_examples(graph, check(graph)))).graph
        assert not offered(mended), path
        without += not [p for p in check(graph) if p.severity == "error"]
        sound += not [p for p in check(mended) if p.severity == "error"]
    assert sound > without
