"""A start asks for values, and runs the graph with those that people give."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.editor.documents import document
from action_assistant.umrf.check import check
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from action_assistant.umrf.start_values import WrongValue, asked_inputs, with_values


def _leaf(kind: str, **members: object) -> dict[str, object]:
    return {"pvf_type": kind, **{f"pvf_{name}": each for name, each in members.items()}}


def _text(*, marks: object = None, **inputs: object) -> str:
    first = {
        "name": "Go",
        "instance_id": 0,
        "type": "sync",
        "input_parameters": inputs,
        "output_parameters": {"found": _leaf("string")},
        "children": [{"name": "Look", "instance_id": 0}],
    }
    if marks is not None:
        first["gui_attributes"] = {"ask_at_start": marks, "colour": "red"}
    then = {
        "name": "Look",
        "instance_id": 0,
        "type": "sync",
        "input_parameters": {"found": _leaf("string"), "speed": _leaf("number")},
        "parents": [{"name": "Go", "instance_id": 0, "required": True}],
    }
    return json.dumps(
        {
            "graph_name": "g",
            "actions": [first, then],
            "graph_entry": [{"name": "Go", "instance_id": 0}],
            "graph_exit": [{"name": "Look", "instance_id": 0}],
        }
    )


def graph(**parts: object) -> Graph:
    return codec.read(_text(**parts)).graph


def _names(of: Graph) -> list[str]:
    return [f"{each.action}.{each.name}" for each in asked_inputs(of)]


def test_what_the_graph_leaves_open_is_asked_for_and_what_an_arrow_brings_is_not() -> None:
    assert _names(graph(place=_leaf("string"), often=_leaf("number", value=2))) == [
        "Go_0.place",
        "Look_0.speed",
    ]


def test_what_its_author_marks_is_asked_for_with_its_value_and_bounds() -> None:
    marked = graph(marks={"torque": {"least": 0, "most": 60}}, torque=_leaf("number", value=5))
    torque, _ = asked_inputs(marked)
    assert (torque.name, torque.value, torque.least, torque.most, torque.open) == (
        "torque",
        5.0,
        0.0,
        60.0,
        False,
    )


def test_a_mark_changes_no_digest_and_survives_file_and_document() -> None:
    parts: dict[str, Any] = {"torque": _leaf("number", value=5)}
    plain, marked = graph(**parts), graph(marks={"torque": {"most": 60}}, **parts)
    assert digest(plain) == digest(marked)
    again = document.read_maps(document.flatten(document.with_aids(marked)))
    assert again.actions[0].asks == marked.actions[0].asks == (("torque", '{"most":60}'),)
    written = json.loads(codec.write(again))
    assert written["actions"][0]["gui_attributes"] == {
        "colour": "red",
        "ask_at_start": {"torque": {"most": 60}},
    }


@pytest.mark.parametrize("marks", [7, [], ["torque"], {"torque": True}, {}])
def test_marks_of_another_form_are_kept_as_they_are(marks: object) -> None:
    other = graph(marks=marks, torque=_leaf("number", value=5))
    assert other.actions[0].asks == ()
    written = json.loads(codec.write(other))
    assert written["actions"][0]["gui_attributes"]["ask_at_start"] == marks


@pytest.mark.parametrize(
    ("given_value", "why"),
    [
        ({"Go_0": {"torque": 61.0}}, "at most"),
        ({"Go_0": {"torque": -0.5}}, "at least"),
        ({"Go_0": {"torque": float("nan")}}, "a finite number"),
        ({"Go_0": {"torque": "5"}}, "is a number"),
        ({"Go_0": {"torque": True}}, "is a number"),
        ({"Go_0": {"mode": "slow"}}, "is one of"),
        ({"Go_0": {"fixed": 1.0}}, "does not ask"),
        ({"Go_0": {"nothing": 1.0}}, "no input"),
        ({"Look_0": {"found": "x"}}, "An arrow brings"),
        ({"Gone_0": {}}, "no action"),
        ({"Go_0": {"names": "x"}}, "is a strings"),
        ({"Go_0": {"names": ("x" * 70_000,)}}, "bytes"),
    ],
)
def test_a_value_that_an_input_cannot_have_is_refused_with_its_place(
    given_value: dict[str, dict[str, Any]], why: str
) -> None:
    wanted = graph(
        marks={"torque": {"least": 0, "most": 60}, "mode": {}, "names": {}},
        torque=_leaf("number", value=5),
        mode=_leaf("string", value="fast", allowed_values=["fast", "careful"]),
        names=_leaf("strings", value=[]),
        fixed=_leaf("number", value=1),
    )
    with pytest.raises(WrongValue, match=why):
        with_values(wanted, given_value)


def test_the_values_stand_in_the_graph_and_take_its_problem_away() -> None:
    wanted = graph(place=_leaf("string", description="which valve"))
    assert {"H7", "H8"} <= {each.code for each in check(wanted)}
    filled = with_values(wanted, {"Go_0": {"place": "valve_8"}, "Look_0": {"speed": 0.5}})
    assert not {"H7", "H8"} & {each.code for each in check(filled)}
    written = json.loads(codec.write(filled))
    assert written["actions"][0]["input_parameters"]["place"] == _leaf(
        "string", description="which valve", value="valve_8"
    )
    assert digest(filled) != digest(wanted)
    assert asked_inputs(filled) == ()


_VALUES = {
    "string": st.text(max_size=20),
    "number": st.floats(allow_nan=False, allow_infinity=False, width=32),
    "bool": st.booleans(),
    "strings": st.lists(st.text(max_size=5), max_size=3).map(tuple),
    "numbers": st.lists(st.floats(0, 9), max_size=3).map(tuple),
}


@given(st.data())
def test_only_what_was_given_differs_whatever_is_given(data: st.DataObject) -> None:
    kinds = data.draw(st.lists(st.sampled_from(sorted(_VALUES)), min_size=1, max_size=5))
    inputs = {f"p{number}": _leaf(kind) for number, kind in enumerate(kinds)}
    wanted = graph(**inputs)
    values = {
        f"p{number}": data.draw(_VALUES[kind])
        for number, kind in enumerate(kinds)
        if data.draw(st.booleans())
    }
    filled = with_values(wanted, {"Go_0": values} if values else {})
    left = [each.name for each in asked_inputs(filled) if each.action == "Go_0"]
    assert left == [name for name in inputs if name not in values]
    assert filled.actions[1:] == wanted.actions[1:]
    before, after = json.loads(codec.write(wanted)), json.loads(codec.write(filled))
    for name, value in values.items():
        leaf = after["actions"][0]["input_parameters"][name]
        assert leaf.pop("pvf_value") == (list(value) if isinstance(value, tuple) else value)
    assert before == after
