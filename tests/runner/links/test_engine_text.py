"""Texts of an engine are read; foreign texts in their place are refused, with the reason."""

import json
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.runner.links.engine_text import NotAGraph, name_of, snapshot
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.kept_values import (
    KEEPER,
    NEVER,
    KeptValues,
    as_json,
    kept_outputs,
    with_keepers,
)
from action_assistant.umrf.model import Parameter
from action_assistant.umrf.pieces import piece_of
from action_assistant.umrf.semantics import Behaviour, Engine, Script
from action_assistant.umrf.semantics.printing import GraphPrinter
from runner.harness import sequence

GIVEN = {
    "a": "bools", "b": "number", "c": "string", "d": "strings", "deep/e": "bool", "z": "numbers",
}  # fmt: skip
VALUES = {
    "a": [True, False], "b": 0.1, "c": 'ä"', "d": ["", "x"], "deep::e": True, "z": [-2e300, 1.5],
}  # fmt: skip


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


def keeping(number: int = 0, state: str = "UNINITIALIZED", **inputs: Any) -> dict[str, Any]:
    leaves = {
        name: {"pvf_type": name.partition("_")[2], "pvf_value": v} for name, v in inputs.items()
    }
    return node(
        KEEPER,
        number,
        state=state,
        input_parameters={NEVER: {"pvf_type": "string"}, **leaves},
    )


def test_values_are_read_from_keepers_that_wait_which_are_no_actions_of_a_run() -> None:
    shown = text(node(), keeping(A0_number=5, A1_strings=["a", "ä"]), keeping(1, A3_bool=True))
    found = snapshot(shown, at=1, source="get")
    assert found.nodes == {"Work_0": "RUNNING"}
    assert found.run == "r1"
    values = {"0_number": "5", "1_strings": '["a","ä"]', "7_bool": "true"}
    assert found.kept == KeptValues(values)


@pytest.mark.parametrize(
    "keeper",
    [
        keeping(state="RUNNING", A0_number=5),
        keeping(state="INITIALIZED", A0_number=5),
        keeping() | {"input_parameters": {NEVER: {"pvf_type": "string", "pvf_value": "x"}}},
        keeping() | {"input_parameters": {}},
        keeping() | {"input_parameters": [5]},
    ],
    ids=["runs", "is loaded", "may run", "lacks an input", "no inputs"],
)
def test_a_keeper_that_moves_or_may_move_is_an_action_like_others(keeper: dict[str, Any]) -> None:
    found = snapshot(text(keeper), at=1, source="get")
    assert found.nodes == {f"{KEEPER}_0": keeper["state"]}
    assert found.kept == KeptValues()


@pytest.mark.parametrize(
    ("value", "why"),
    [
        ({"A0_string": 5}, "is no string"),
        ({"A0_number": True}, "is no number"),
        ({"A0_number": None}, "is no number"),
        ({"A0_bools": [True, 1]}, "is no bools"),
        ({"A0_numbers": {"a": 1}}, "is no numbers"),
        ({"A0_string": "x" * 70_000}, "larger than 64 KB"),
        ({"A0_strings": ["x" * 100] * 9_000}, "larger than 64 KB"),
    ],
)
def test_a_value_that_is_not_as_it_should_be_gives_none_and_the_reason(
    value: dict[str, Any], why: str
) -> None:
    kept = snapshot(text(node(), keeping(**value)), at=1, source="get").kept
    assert kept.values == {}
    assert why in kept.wrong


def test_an_engine_that_is_emulated_shows_kept_values_as_a_real_one() -> None:
    outputs = tuple(Parameter(name, f'{{"pvf_type": "{kind}"}}') for name, kind in GIVEN.items())
    line = sequence("g", 1)
    action = msgspec.structs.replace(line.actions[0], outputs=outputs)
    graph = msgspec.structs.replace(line, actions=(action,))
    piece = with_keepers(piece_of(graph, action), action, taken_on_false=True)
    for result, state in (("on_true", "FINISHED"), ("on_false", "RUNNING"), ("on_error", "HALTED")):
        call = Behaviour(after_s=1, result=result, outputs=VALUES)  # type: ignore[arg-type]
        engine = Engine(facts=PINNED, script=Script({"Work_0": (call,)}))
        engine.start(piece, 0)
        engine.advance(2000)
        running = engine.graphs[piece.name]
        nodes = engine.states()[piece.name].nodes
        shown = snapshot(
            GraphPrinter(running, {}).text(running.state, nodes, {}), at=1, source="get"
        )
        ended = "ERROR" if result == "on_error" else "FINISHED"
        assert (shown.state, shown.nodes) == (state, {"Work_0": ended})
        got = {each.name: shown.kept.values.get(each.key) for each in kept_outputs(action)}
        wanted = {name: None if result == "on_error" else as_json(VALUES[name]) for name in VALUES}
        assert got == wanted
