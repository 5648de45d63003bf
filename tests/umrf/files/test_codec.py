"""Graphs survive reading and writing, and unreadable texts are refused with their place."""

import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.umrf.files import codec
from action_assistant.umrf.files.codec import Stamp, Unreadable, read, write
from action_assistant.umrf.json.text import MAX_BYTES, dump, parse
from action_assistant.umrf.model import ENTRY, EXIT, Graph
from strategies import graphs, normal
from support.doses import examples
from support.growth import grows_with_its_size
from support.recordings import CORPUS, NO_CORPUS, family

OWN = Path(__file__).parents[1] / "examples"


def file_of(**fields: object) -> str:
    """A small valid file, changed in some fields (None: left out)."""
    file: dict[str, object] = {
        "graph_name": "g",
        "graph_entry": [{"name": "A", "instance_id": 0}],
        "graph_exit": [{"name": "B", "instance_id": 0}],
        "actions": [
            {"name": "A", "type": "sync", "children": [{"name": "B"}]},
            {"name": "B", "type": "sync", "parents": [{"name": "A"}]},
        ],
    }
    file |= fields
    return json.dumps({key: value for key, value in file.items() if value is not None})


# Round trips


@given(graphs())
@settings(max_examples=examples(120), deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_a_written_graph_is_read_as_the_same_graph(graph: Graph) -> None:
    reading = read(write(graph))
    assert normal(reading.graph) == normal(graph)
    assert reading.dialect == "D3"
    assert not reading.problems
    assert not reading.notes


@given(graphs())
@settings(max_examples=examples(50), deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_writing_twice_changes_nothing(graph: Graph) -> None:
    text = write(graph)
    assert write(read(text).graph) == text


def graph_files() -> list[Any]:
    """Graphs that the engine was given, and those that people keep in repositories."""
    recorded = sorted(family("engine").rglob("*.graph.json"))
    real = sorted((CORPUS / "graphs").glob("*/*.json"))
    none = pytest.param(CORPUS, marks=pytest.mark.skip(reason=NO_CORPUS))
    return [*recorded, *(real or [none])]


@pytest.mark.parametrize("path", graph_files(), ids=lambda path: path.name)
def test_every_file_of_the_corpus_is_read_and_survives(path: Path) -> None:
    first = read(path.read_bytes())
    again = read(write(first.graph))
    assert again.dialect == "D3"
    assert not again.problems
    assert normal(again.graph) == normal(first.graph)


@pytest.mark.parametrize("path", sorted(OWN.glob("*.json")), ids=lambda path: path.name)
def test_our_own_examples_are_read_and_survive(path: Path) -> None:
    first = read(path.read_bytes())
    assert normal(read(write(first.graph)).graph) == normal(first.graph)


def test_numbers_keep_their_spelling_and_unknown_fields_survive() -> None:
    text = """{"graph_name": "g", "x": [1.0, 1, 1e2, 12345678901234567890],
      "actions": [{"name": "A", "type": "sync", "mine": {"b": 1, "a": 2.50},
        "input_parameters": {"p": {"pvf_type": "number", "pvf_value": 5.0}}}]}"""
    graph = read(text).graph
    assert dict(graph.extra) == {"x": "[1.0,1,1e2,12345678901234567890]"}
    assert dict(graph.actions[0].extra) == {"mine": '{"b":1,"a":2.50}'}
    assert graph.actions[0].inputs[0].text == '{"pvf_type":"number","pvf_value":5.0}'
    assert "2.50" in write(graph)


# What a file says


def test_a_single_action_without_ends_is_its_own_entry_and_exit() -> None:
    graph = read('{"graph_name": "g", "actions": [{"name": "A", "type": "sync"}]}').graph
    assert [(r.parent, r.child) for r in graph.relations] == [(ENTRY, "a1"), ("a1", EXIT)]
    assert graph.relations[1].conditions.on_error == "bypass"


def test_conditions_that_a_file_leaves_out_are_the_engines() -> None:
    graph = read(file_of()).graph
    inner = next(r for r in graph.relations if r.child != EXIT and r.parent != ENTRY)
    assert inner.conditions == codec.read(write(graph)).graph.relations[-1].conditions
    assert inner.conditions.on_error == "bypass"
    assert inner.conditions.on_stopped == "ignore"


@pytest.mark.parametrize(
    ("text", "response"),
    [("on_true -> stop", "stop"), ("on_true->stop", "stop"), ("on_true -> stop -> run", "stop")],
)
def test_conditions_are_read_as_the_engine_reads_them(text: str, response: str) -> None:
    actions = json.loads(file_of())["actions"]
    actions[1]["parents"][0]["conditions"] = ["on_true -> run", text]
    reading = read(file_of(actions=actions))
    inner = next(r for r in reading.graph.relations if r.parent == "a1" and r.child == "a2")
    assert inner.conditions.on_true == response
    assert not inner.parents_extra


def test_a_condition_that_nobody_knows_is_kept_as_it_stands() -> None:
    actions = json.loads(file_of())["actions"]
    actions[1]["parents"][0]["conditions"] = ["on_true -> skip"]
    graph = read(file_of(actions=actions)).graph
    inner = next(r for r in graph.relations if r.parent == "a1" and r.child == "a2")
    assert dict(inner.parents_extra) == {"conditions": '["on_true -> skip"]'}
    assert json.loads(write(graph))["actions"][1]["parents"][0]["conditions"] == ["on_true -> skip"]


def test_a_known_field_that_does_not_fit_is_kept_and_wins() -> None:
    actions = json.loads(file_of())["actions"]
    actions[0] |= {"actor": 5, "instance_id": "0"}
    graph = read(file_of(actions=actions)).graph
    assert dict(graph.actions[0].extra) == {"actor": "5", "instance_id": '"0"'}
    written = json.loads(write(graph))["actions"][0]
    assert written["actor"] == 5
    assert written["instance_id"] == "0"


def test_a_name_without_an_action_becomes_a_ghost_and_is_never_written_as_one() -> None:
    actions = json.loads(file_of())["actions"]
    actions[0]["children"].append({"name": "Nobody", "instance_id": 3})
    graph = read(file_of(actions=actions)).graph
    ghost = next(action for action in graph.actions if action.missing)
    assert ghost.full_name == "Nobody_3"
    written = json.loads(write(graph))
    assert len(written["actions"]) == 2
    assert written["actions"][0]["children"][1]["name"] == "Nobody"
    assert normal(read(write(graph)).graph) == normal(graph)


def test_a_reference_to_twins_means_the_one_that_lists_back() -> None:
    actions = [
        {"name": "A", "type": "sync", "children": [{"name": "B"}]},
        {"name": "B", "type": "sync"},
        {"name": "B", "type": "sync", "parents": [{"name": "A"}]},
    ]
    graph = read(file_of(actions=actions)).graph
    assert [action.twin for action in graph.actions] == [False, False, True]
    inner = next(r for r in graph.relations if r.parent == "a1" and r.child != EXIT)
    assert (inner.child, inner.only) == ("a3", None)


def test_one_sided_and_repeated_relations_stay_as_they_are() -> None:
    actions = [
        {"name": "A", "type": "sync", "children": [{"name": "B"}]},
        {"name": "B", "type": "sync", "parents": [{"name": "A"}, {"name": "A", "required": False}]},
    ]
    graph = read(file_of(actions=actions)).graph
    inner = [r for r in graph.relations if r.parent == "a1" and r.child == "a2"]
    assert [(r.listing, r.only, r.required) for r in inner] == [
        (0, None, True),
        (1, "parents", False),
    ]
    written = json.loads(write(graph))
    assert len(written["actions"][1]["parents"]) == 2
    assert len(written["actions"][0]["children"]) == 1


def test_renamings_that_repeat_or_lack_an_end_stay_whole() -> None:
    remap = [{"from": "a", "to": "b"}, {"from": "a", "to": "c"}, {"from": "d"}]
    actions = json.loads(file_of())["actions"]
    actions[0]["children"][0]["remap"] = remap
    graph = read(file_of(actions=actions)).graph
    inner = next(r for r in graph.relations if r.parent == "a1" and r.child == "a2")
    assert inner.remap == ()
    assert json.loads(write(graph))["actions"][0]["children"][0]["remap"] == remap


def test_parameters_that_are_none_and_empty_groups_survive() -> None:
    given_ = {"a": {}, "b": {"c": {"pvf_type": "number"}, "d/e": 5}, "f": {"pvf_type": 3}}
    actions = [{"name": "A", "type": "sync", "input_parameters": given_}]
    graph = read(json.dumps({"graph_name": "g", "actions": actions})).graph
    assert [p.path for p in graph.actions[0].inputs] == ["a", "b/c", "b/d~1e", "f"]
    assert json.loads(write(graph))["actions"][0]["input_parameters"] == given_


def test_run_states_are_told_and_not_written() -> None:
    actions = json.loads(file_of())["actions"]
    actions[0]["state"] = "FINISHED"
    actions[0]["runtime"] = {"messages": []}
    reading = read(file_of(actions=actions, graph_state="RUNNING"))
    assert reading.states == {"a1": "FINISHED"}
    assert reading.graph_state == "RUNNING"
    assert "FINISHED" not in write(reading.graph)
    assert [(p.code, p.where.path) for p in reading.problems] == [("H1", "/actions/0/state")]


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"graph_name": None}, "graph-name-missing"),
        ({"graph_state": "BOGUS"}, "state-illegal"),
        ({"graph_exit": None}, "entry-exit-missing"),
        ({"graph_entry": [{"instance_id": 0}]}, "relation-unnamed"),
        ({"actions": [{"name": "A"}]}, "type-missing"),
        ({"actions": [5]}, "action-illegal"),
        ({"actions": [{"name": "A", "type": "sync", "state": "READY"}]}, "state-illegal"),
        ({"actions": [{"name": "A", "type": "sync", "runtime": {}}]}, "runtime-illegal"),
    ],
)
def test_an_error_that_the_graph_does_not_show_is_a_problem_of_the_text(
    fields: dict[str, object], code: str
) -> None:
    assert code in {problem.code for problem in read(file_of(**fields)).problems}


# The designer's dialect


def test_the_designers_ends_and_positions_and_large_numbers_are_translated() -> None:
    reading = read((OWN / "designer.umrf.graph.json").read_bytes())
    assert reading.dialect == "D3-designer"
    assert reading.graph.entry_position == (0.0, -150.0)
    assert [a.full_name for a in reading.graph.actions] == ["Drive_0", "Look_1", "Look_0"]
    assert all(r.only is None for r in reading.graph.relations)
    assert len(reading.notes) == 3
    assert {p.code for p in reading.problems} == {"dialect-old"}
    assert read(write(reading.graph)).dialect == "D3"


# Stamps


def test_a_stamp_names_graph_version_run_and_every_action() -> None:
    graph = read(file_of()).graph
    text = write(graph, Stamp(graph="G", version="V", run="R"))
    assert codec.stamp_of(text) == Stamp(graph="G", version="V", run="R")
    attributes = json.loads(text)["actions"][0]["gui_attributes"]["action_assistant"]
    assert attributes == {"aid": "a1", "version": "V", "run": "R"}
    assert normal(read(text).graph) == normal(graph)


def test_keys_come_from_the_file_when_they_are_ours_and_unique() -> None:
    aid = {"action_assistant": {"aid": "AbcdEF123456"}}
    actions = [
        {"name": name, "type": "sync", "gui_attributes": aid | {"position": {"x": 1, "y": 2.5}}}
        for name in ("A", "B")
    ]
    graph = read(file_of(actions=actions)).graph
    assert [action.key for action in graph.actions] == ["AbcdEF123456", "a2"]
    assert graph.actions[0].position == (1.0, 2.5)
    assert graph.actions[0].extra == ()


def test_attributes_of_others_stay_beside_ours() -> None:
    attributes = {"color": "red", "position": {"x": 1, "y": 2, "z": 3}}
    actions = [{"name": "A", "type": "sync", "gui_attributes": attributes}]
    text = write(read(json.dumps({"graph_name": "g", "actions": actions})).graph, Stamp(run="R"))
    written = json.loads(text)["actions"][0]["gui_attributes"]
    assert written == attributes | {"action_assistant": {"aid": "a1", "run": "R"}}


# What is refused


@pytest.mark.parametrize(
    ("text", "code", "path"),
    [
        ("{ nope", "not-json", ""),
        ("", "not-json", ""),
        ("[]", "not-umrf", ""),
        ("{}", "not-umrf", ""),
        ('{"graph_name": NaN}', "not-json", ""),
        ('{"graph_name": "g", "x": 1e999}', "number-too-big", "/x"),
        ('{"graph_name": "g", "a": {"b/c": [{"k": 1, "k": 2}]}}', "double-key", "/a/b~1c/0/k"),
        ('{"graph_name": "\\ud800"}', "lone-surrogate", "/graph_name"),
        ("[" * 65 + "]" * 65, "too-deep", ""),
        ("[" * 2_000_000, "too-large", ""),
        ('{"graph_name": "' + "x" * MAX_BYTES + '"}', "too-large", ""),
    ],
    ids=lambda value: str(value)[:30],
)
def test_an_unreadable_text_is_refused_with_its_place(text: str, code: str, path: str) -> None:
    with pytest.raises(Unreadable) as caught:
        read(text)
    assert (caught.value.code, caught.value.path) == (code, path)
    assert caught.value.message


def test_a_mistake_in_the_json_has_line_and_column() -> None:
    with pytest.raises(Unreadable) as caught:
        read('{"graph_name": "g",\n "actions": [,]}')
    assert (caught.value.line, caught.value.column) == (2, 14)


def test_bytes_that_are_no_utf_8_are_refused() -> None:
    with pytest.raises(Unreadable, match="not UTF-8"):
        read(b'{"graph_name": "\xff"}')


@pytest.mark.parametrize(
    ("begin", "again", "end", "count"),
    [
        ("", "[", "", 900_000),
        ("", '"\\"', "", 3_000_000),
        ("{", '"a":1,', "", 100_000),
        pytest.param(
            *('{"graph_name":"g","actions":[{"name":"A"}', ',{"name":"A"}', "]}", 40_000),
            marks=pytest.mark.long,
        ),
        ('{"graph_name":"g","graph_entry":[{"name":"A"}', ',{"name":"A"}', "]}", 40_000),
    ],
)
def test_hostile_texts_cost_no_more_than_their_size(
    begin: str, again: str, end: str, count: int
) -> None:
    def reading(size: int) -> Callable[[], None]:
        text = begin + again * size + end

        def work() -> None:
            with suppress(Unreadable):
                read(text)

        return work

    grows_with_its_size(reading, count)


@given(st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from([
        "graph_name", "graph_entry", "graph_exit", "actions", "name", "instance_id", "type",
        "parents", "children", "conditions", "required", "remap", "from", "to", "gui_attributes",
        "position", "x", "y", "action_assistant", "aid", "notes", "input_parameters", "pvf_type",
        "state", "runtime", "messages", "entry", "umrf_actions", "id", "effect", "waypoints", "parent",
        "child", "response", "listing", "points",
    ]), inner, max_size=6),
    max_leaves=40,
))  # fmt: skip
@settings(max_examples=examples(300), deadline=None)
def test_any_json_is_read_or_refused(value: object) -> None:
    text = json.dumps(value)
    try:
        text = json.dumps(value, ensure_ascii=False)
        text.encode()
    except UnicodeEncodeError:
        text = json.dumps(value)
    try:
        reading = read(text)
    except Unreadable:
        return
    again = read(write(reading.graph))
    assert write(again.graph) == write(reading.graph)


@given(st.text())
def test_json_text_is_spelled_back(text: str) -> None:
    value = {"k": [text]} if text.isprintable() else {"k": []}
    assert json.loads(dump(parse(json.dumps(value)))) == value


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('{"a": "NaN",\n "b": NaN}', (2, 7)),
        ('{"graph_name": "g", "x": -Infinity}', (1, 26)),
        ('{"a":\n 1e999}', (2, 2)),
        ('{"[[[": ' + "[" * 70, (1, 72)),
    ],
)
def test_a_value_that_json_cannot_hold_is_refused_with_its_place(
    text: str, place: tuple[int, int]
) -> None:
    with pytest.raises(Unreadable) as refused:
        read(text)
    assert (refused.value.line, refused.value.column) == place
