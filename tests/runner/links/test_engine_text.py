"""Texts of an engine are read; foreign texts in their place are refused, with the reason."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.runner.links.engine_text import NotAGraph, name_of, snapshot


def text(*actions: dict[str, Any], **more: Any) -> str:
    return json.dumps({"graph_name": "g", "graph_state": "RUNNING", "actions": actions, **more})


def node(
    name: str = "Work", number: int = 0, run: str | None = "r1", **more: Any
) -> dict[str, Any]:
    marks = {"gui_attributes": {"action_assistant": {"run": run}}} if run else {}
    return {"name": name, "instance_id": number, "state": "RUNNING", **marks, **more}


def test_a_graph_is_ours_only_if_every_action_carries_the_same_run() -> None:
    def run(*actions: dict[str, Any]) -> str | None:
        return snapshot(text(*actions), at=1, source="get").run

    assert run(node(), node(number=1)) == "r1"
    assert run(node(), node(number=1, run="r2")) is None
    assert run(node(), node(number=1, run=None)) is None
    assert run() is None


def test_foreign_fields_beside_a_node_are_ignored() -> None:
    odd = node(gui_attributes="theirs", runtime={"messages": 5})
    found = snapshot(
        text(odd, node(number=1, runtime={"messages": ["a", "b"]})), at=1, source="get"
    )
    assert found.nodes == {"Work_0": "RUNNING", "Work_1": "RUNNING"}
    assert found.messages == {"Work_1": ("a", "b")}


def test_messages_are_read_as_engines_write_them() -> None:
    said = {"messages": [{"message": "ran 1", "timestamp": 1795251734200}]}
    assert snapshot(text(node(runtime=said)), at=1, source="get").messages == {"Work_0": ("ran 1",)}


def test_values_are_those_of_actions_that_move() -> None:
    inputs = {"pose": {"x": {"pvf_type": "number", "pvf_value": 5.0}}, "to": {"pvf_type": "string"}}
    moving, waiting = node(input_parameters=inputs), node(number=1, input_parameters=inputs)
    odd = node(number=2, input_parameters=["theirs"])
    found = snapshot(text(moving, waiting | {"state": "FINISHED"}, odd), at=1, source="get")
    assert found.inputs == {"Work_0": {"pose::x": "5"}}


@pytest.mark.parametrize(
    "hostile",
    [
        "",
        "[]",
        '{"graph_name": "g"}',
        text({"name": "Work"}),
        text({"name": "Work", "state": 3}),
        text(graph_state=None),
        "[" * 100_000,
        '{"graph_name": "\ud800"}',
    ],
)
def test_texts_that_prove_nothing_are_refused(hostile: str) -> None:
    with pytest.raises(NotAGraph):
        snapshot(hostile, at=1, source="get")


def test_a_name_is_read_from_any_text() -> None:
    assert name_of(text()) == "g"
    assert name_of("no JSON") == name_of('{"graph_name": 5}') == name_of("\ud800") == ""


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.text(),
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(
                st.sampled_from(["graph_name", "graph_state", "actions", "name", "state"]), inner
            )
        ),
    )
)
def test_any_json_is_a_graph_or_refused(value: object) -> None:
    written = json.dumps(value)
    try:
        found = snapshot(written, at=1, source="feedback")
    except NotAGraph:
        return
    assert isinstance(value, dict)
    assert found.graph == value["graph_name"]
