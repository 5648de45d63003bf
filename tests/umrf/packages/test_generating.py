"""The contents of an action package, compared with packages that people have reviewed."""

import json
from pathlib import Path

import pytest
from jinja2 import UndefinedError

from action_assistant.umrf.files import codec
from action_assistant.umrf.packages.bases import BASE_NAME
from action_assistant.umrf.packages.choosing import disagreements, distinct_actions
from action_assistant.umrf.packages.escapes import ACCEPTED, XmlText
from action_assistant.umrf.packages.generating import (
    ImpossiblePackage,
    environment,
    package_files,
)
from action_assistant.umrf.packages.naming import snake_case
from umrf.packages.sources import compile_errors, described

GOLDEN = Path(__file__).parent / "golden"
DESCRIBED = sorted(GOLDEN.glob("*.umrf.json"))


@pytest.mark.turns
@pytest.mark.parametrize("path", DESCRIBED, ids=lambda path: path.name.partition(".")[0])
def test_packages_are_as_they_were_looked_at(path: Path) -> None:
    """`action-assistant package FILE --output tests/umrf/packages/golden` makes them anew; what it keeps
    for the next time is not looked at."""
    action = codec.read_action(path.read_bytes()).action
    folder = GOLDEN / snake_case(action.name)
    there = {
        each.relative_to(folder).as_posix(): each.read_bytes()
        for each in folder.rglob("*")
        if each.is_file() and each.name != BASE_NAME
    }
    assert package_files(action) == there
    assert compile_errors(folder) == ""


def test_headers_of_parameters_are_there_where_there_are_any() -> None:
    one = {"x": {"pvf_type": "number"}}
    sides = {
        (): described(),
        ("input",): described(input_parameters=one),
        ("output",): described(output_parameters=one),
        ("input", "output"): described(input_parameters=one, output_parameters=one),
    }
    for expected, action in sides.items():
        files = package_files(action)
        found = [
            side for side in ("input", "output") if f"include/ta_try/{side}_parameters.hpp" in files
        ]
        assert tuple(found) == expected


def test_the_description_is_installed_without_what_belongs_to_a_graph() -> None:
    action = described(
        instance_id=7,
        actor="David",
        effect="none",
        gui_attributes={"position": {"x": 1, "y": 2}},
        children=[{"name": "B"}],
        input_parameters={"x": {"pvf_type": "number", "pvf_value": 5.0}},
    )
    written = json.loads(package_files(action)["ta_try.umrf.json"])
    assert written["input_parameters"] == {"x": {"pvf_type": "number", "pvf_value": 5.0}}
    assert written["effect"] == "none"
    assert not {"instance_id", "actor", "gui_attributes", "children", "parents"} & written.keys()


def test_the_installed_description_gives_the_same_package() -> None:
    action = described(
        description="A", input_parameters={"g": {"a b": {"pvf_type": "string", "pvf_value": "*/"}}}
    )
    files = package_files(action)
    assert package_files(codec.read_action(files["ta_try.umrf.json"]).action) == files


@pytest.mark.parametrize("language", ACCEPTED)
def test_no_plain_text_gets_into_a_template(language: str) -> None:
    for value in ("text", 7, None, ["x"]):
        with pytest.raises(TypeError, match="in a template of"):
            environment(language).from_string("{{ value }}").render(value=value)
    with pytest.raises(TypeError):
        environment(language).from_string("{{ a ~ a }}").render(a=XmlText("x"))
    with pytest.raises((TypeError, UndefinedError)):
        environment(language).from_string("{{ nothing }}").render()


def test_a_text_of_one_language_is_none_of_another() -> None:
    environment("xml").from_string("{{ 'x'|xml }}").render()
    for filter_ in ("cmake", "markdown", "cpp_comment", "cpp_string", "cpp_name"):
        with pytest.raises(TypeError):
            environment("xml").from_string(f"{{{{ 'x'|{filter_} }}}}").render()


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        (
            {"a b": {"pvf_type": "number"}, "a_b": {"pvf_type": "number"}},
            "“a_b” and “a b” would both",
        ),
        ({"a b": {"x": {"pvf_type": "bool"}}, "a-b": {"y": {"pvf_type": "bool"}}}, "would both be"),
        ({"a:b": {"pvf_type": "number"}}, "colon"),
        ({"": {"pvf_type": "number"}}, "empty"),
        ({"a\x00": {"pvf_type": "number"}}, "NUL"),
        ({"a": 5}, "`pvf_type`"),
        ({"a": {"pvf_type": 5}}, "`pvf_type`"),
        ({"a": {"pvf_type": "geometry_msgs/Pose", "pvf_value": 5}}, "reads no value of the type"),
        ({"a": {"pvf_type": "Pose", "pvf_allowed_values": [5]}}, "reads no value of the type"),
        ({"a": {"pvf_type": "number", "pvf_value": "5"}}, "a value that is no number"),
        ({"a": {"pvf_type": "bool", "pvf_allowed_values": [True, 1]}}, "a value that is no bool"),
    ],
)
def test_impossible_parameters_are_named_with_the_reason(
    parameters: dict[str, object], words: str
) -> None:
    for side in ("input_parameters", "output_parameters"):
        with pytest.raises(ImpossiblePackage) as error:
            package_files(described(**{side: parameters}))
        (refusal,) = error.value.refusals
        assert refusal.place.startswith(f"TaTry/{side}/")
        assert words in refusal.reason


@pytest.mark.parametrize(
    ("kind", "allowed", "initial"),
    [
        ("string", ['*/ "yes"', "no"], '{"*/ \\"yes\\""}'),
        ("string", ["ends \x00 in C++", "whole"], '{"whole"}'),
        ("number", [2, 0.1], "{2.0}"),
        ("number", [-1e300], "{-1e+300}"),
        ("bool", [True], "{true}"),
        ("string", [], "{}"),
        ("strings", [], "{}"),
    ],
)
def test_an_output_is_its_first_allowed_value_until_the_action_says_otherwise(
    kind: str, allowed: list[object], initial: str
) -> None:
    both = {"x": {"pvf_type": kind, "pvf_allowed_values": allowed}}
    files = package_files(described(input_parameters=both, output_parameters=both))
    assert f" x{initial};" in files["include/ta_try/output_parameters.hpp"].decode()
    assert " x{};" in files["include/ta_try/input_parameters.hpp"].decode()


@pytest.mark.parametrize(
    ("kind", "value", "initial"),
    [
        ("string", "b", '{"b"}'),
        ("number", 3, "{3.0}"),
        ("bool", False, "{false}"),
        ("strings", ['a "q"', ""], '{"a \\"q\\"", ""}'),
        ("numbers", [1, -2.5], "{1.0, -2.5}"),
        ("bools", [True, False], "{true, false}"),
        ("strings", ["cut \x00 off"], "{}"),
        ("numbers", [], "{}"),
    ],
)
def test_an_output_with_a_value_has_it_until_the_action_says_otherwise(
    kind: str, value: object, initial: str
) -> None:
    outputs = {"x": {"pvf_type": kind, "pvf_value": value}}
    files = package_files(described(output_parameters=outputs))
    assert f" x{initial};" in files["include/ta_try/output_parameters.hpp"].decode()


def test_a_list_with_allowed_values_is_no_output() -> None:
    listed = {"a": {"pvf_type": "numbers", "pvf_allowed_values": [[1.5]]}}
    assert package_files(described(input_parameters=listed))
    with pytest.raises(ImpossiblePackage, match="no list as an output"):
        package_files(described(output_parameters=listed))


def graph(*actions: dict[str, object]) -> str:
    """A graph with these actions and nothing between them."""
    listed = [{"type": "sync", **action} for action in actions]
    return json.dumps({"graph_name": "g", "graph_entry": [], "graph_exit": [], "actions": listed})


def test_a_graph_has_one_package_for_each_name_and_keeps_no_values() -> None:
    value = {"x": {"pvf_type": "number", "pvf_value": 5.0}}
    reading = codec.read(
        graph(
            {"name": "A", "input_parameters": value},
            {"name": "B"},
            {"name": "A", "instance_id": 1, "input_parameters": value},
        )
    )
    found = distinct_actions(reading.graph)
    assert [action.name for action in found] == ["A", "B"]
    assert "pvf_value" not in found[0].inputs[0].text
    assert disagreements(reading.graph) == ()


def test_actions_of_one_name_with_different_parameters_are_told() -> None:
    reading = codec.read(
        graph(
            {"name": "A", "input_parameters": {"x": {"pvf_type": "number"}}},
            {"name": "A", "instance_id": 1},
        )
    )
    (refusal,) = disagreements(reading.graph)
    assert refusal.place == "A"
    assert "“A_0” and “A_1”" in refusal.reason
