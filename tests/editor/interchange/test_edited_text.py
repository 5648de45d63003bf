"""Edited text as changes: nothing is lost, nothing else is touched, what does not fit is refused."""

import json
from typing import Any

import httpx
import pytest
from hypothesis import given
from msgspec import UNSET
from msgspec.structs import replace
from pycrdt import Doc

from action_assistant.editor.documents import document
from action_assistant.editor.documents.contents import ReadGraph
from action_assistant.editor.documents.document import Maps
from action_assistant.editor.documents.values import relation_id
from action_assistant.editor.interchange.edited_text import TextEdit, text_edit
from action_assistant.errors import BadInput, NotUmrf
from action_assistant.umrf.difference import difference
from action_assistant.umrf.difference_text import is_same, without_looks
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from editor.api.test_api import NAV, assert_problem, imported
from strategies import graphs


def moment_of(graph: Graph) -> ReadGraph:
    doc: Doc[Any] = Doc()
    document.fill(doc, graph)
    maps = document.maps_of(doc)
    return ReadGraph(1, maps, document.read_maps(maps))


def applied(maps: Maps, answer: TextEdit) -> Graph:
    maps = {root: dict(fields) for root, fields in maps.items()}
    for change in answer.changes:
        assert maps[change.root].get(change.key, UNSET) == change.before
        if change.after is UNSET:
            del maps[change.root][change.key]
        else:
            maps[change.root][change.key] = change.after
    return document.read_maps(maps)


@given(graphs())
def test_a_text_that_was_not_edited_changes_nothing(graph: Graph) -> None:
    moment = moment_of(graph)
    assert text_edit(moment, codec.write(moment.graph).encode()).changes == ()


@given(graphs(), graphs())
def test_the_graph_equals_the_edited_text_afterwards(old: Graph, new: Graph) -> None:
    moment = moment_of(old)
    wanted = codec.write(moment_of(new).graph)
    assert codec.write(applied(moment.maps, text_edit(moment, wanted.encode()))) == wanted


def nav() -> tuple[ReadGraph, dict[str, Any]]:
    moment = moment_of(codec.read(json.dumps(NAV)).graph)
    return moment, json.loads(codec.write(moment.graph))


def keys(answer: TextEdit) -> set[str]:
    return {change.key.partition("|")[2] for change in answer.changes}


def test_only_what_was_edited_is_written_and_numbers_stay_as_they_are_spelled() -> None:
    moment, _ = nav()
    text = codec.write(moment.graph).replace('"pvf_value": 5.0', '"pvf_value": 6.50')
    [change] = text_edit(moment, text.encode()).changes
    go = moment.graph.actions[0].key
    assert (change.root, change.key) == ("actions", f"{go}|in/speed")
    assert change.after == '{"pvf_type":"number","pvf_value":6.50}'


def test_an_action_that_was_renamed_is_the_same_action() -> None:
    moment, _ = nav()
    text = codec.write(moment.graph).replace('"name": "Go"', '"name": "Move"')
    answer = text_edit(moment, text.encode())
    assert [(c.key, c.after) for c in answer.changes] == [(moment.graph.actions[0].key, "Move")]


def test_an_action_put_between_others_leaves_their_places_alone() -> None:
    moment, file = nav()
    file["actions"].insert(1, {"name": "Wait", "instance_id": 0, "type": "sync"})
    answer = text_edit(moment, json.dumps(file).encode())
    assert keys(answer) == {"", "order"}
    names = [action.name for action in applied(moment.maps, answer).actions]
    assert names == ["Go", "Wait", "Back"]


def test_an_action_that_was_deleted_leaves_nothing_behind() -> None:
    moment, file = nav()
    gone = moment.graph.actions[1].key
    file["graph_exit"] = []
    del file["actions"][1], file["actions"][0]["children"]
    left = applied(moment.maps, text_edit(moment, json.dumps(file).encode()))
    assert [action.name for action in left.actions] == ["Go"]
    answer = text_edit(moment, json.dumps(file).encode())
    stale = [key for key in moment.maps["relations"] if gone in key]
    assert {change.key for change in answer.changes} >= {*stale, gone}


def test_an_arrow_that_was_deleted_takes_its_waypoints_along() -> None:
    moment, file = nav()
    line = next(r for r in moment.graph.relations if r.child == moment.graph.actions[1].key)
    key = f"w/{relation_id(line)}|run"
    moment.maps["positions"][key] = "[[1,2]]"
    bent = ReadGraph(2, moment.maps, document.read_maps(moment.maps))
    file["graph_exit"] = []
    del file["actions"][1], file["actions"][0]["children"]
    answer = text_edit(bent, json.dumps(file).encode())
    assert (key, UNSET) in {(change.key, change.after) for change in answer.changes}
    straight = codec.write(moment.graph).encode()
    assert [change.key for change in text_edit(bent, straight).changes] == [key]


def test_an_unknown_field_is_kept_and_can_be_edited() -> None:
    moment = moment_of(codec.read(json.dumps({**NAV, "vendor": {"a": [1, 2.0]}})).graph)
    text = codec.write(moment.graph)
    assert text_edit(moment, text.encode()).changes == ()
    [change] = text_edit(moment, text.replace("2.0", "2.00").encode()).changes
    assert (change.root, change.key, change.after) == ("meta", "x/vendor", '{"a":[1,2.00]}')


@pytest.mark.parametrize(
    ("old", "new", "path"),
    [
        ('"name": "Back"', '"name": "Black"', None),
        ('"name": "Back",', '"nam": "Back",', None),
        ('"type": "sync"', '"kind": "sync"', "/actions/0"),
        ('"graph_name"', '"name"', None),
        ('"graph_exit": [', '"graph_exit": [5, ', "/graph_exit/0"),
    ],
)
def test_text_that_an_import_would_mend_or_leave_out_is_refused(
    old: str, new: str, path: str | None
) -> None:
    moment, _ = nav()
    text = codec.write(moment.graph)
    assert old in text
    with pytest.raises(BadInput) as refusal:
        text_edit(moment, text.replace(old, new, 1).encode())
    assert path is None or (refusal.value.where or {})["path"] == path


def test_half_a_renaming_is_refused_where_the_old_name_stands() -> None:
    moment, file = nav()
    file["actions"][1]["name"] = "Return"
    with pytest.raises(NotUmrf, match="no action Back with the number 0") as refusal:
        text_edit(moment, json.dumps(file).encode())
    where = refusal.value.where or {}
    assert (where["path"], where["line"]) == ("/graph_exit/0", 1)
    assert json.dumps(file)[int(str(where["column"])) - 1 :].startswith('{"name"')


def test_errors_that_come_with_the_edit_are_told_before_it_is_made() -> None:
    moment, file = nav()
    file["actions"].append({"name": "Wait", "instance_id": -1, "type": "sync"})
    answer = text_edit(moment, json.dumps(file).encode())
    assert {problem.severity for problem in answer.problems} == {"error"}
    assert text_edit(moment, codec.write(moment.graph).encode()).problems == ()


def test_the_route_stores_nothing_and_names_the_line(http: httpx.Client) -> None:
    made = imported(http)
    route = f"/api/graphs/{made['id']}/rewriting"
    text = http.get(f"/api/graphs/{made['id']}/umrf").text
    edited = text.replace('"there and back"', '"there"')
    answer = http.post(route, params={"seq": 1}, content=edited).json()
    assert answer["changes"] == [
        {"root": "meta", "key": "description", "before": "there and back", "after": "there"}
    ]
    broken = text.replace('"graph_exit"', '"graph_exit', 1)
    problem = assert_problem(http.post(route, params={"seq": 1}, content=broken), 400)
    assert problem["where"]["line"] >= 4
    assert_problem(http.post(route, params={"seq": 7}, content=text), 409)
    assert http.get(f"/api/graphs/{made['id']}").json()["seq"] == 1


def test_an_edited_text_leaves_breakpoints_where_they_are() -> None:
    moment, file = nav()
    go, back = (action.key for action in moment.graph.actions[:2])
    moment.maps["actions"][f"{go}|breakpoint"] = '{"visit":2}'
    moment.maps["actions"][f"{back}|breakpoint"] = "{}"
    marked = ReadGraph(2, moment.maps, document.read_maps(moment.maps))
    text = codec.write(marked.graph)
    renamed = applied(
        marked.maps, text_edit(marked, text.replace('"name": "Go"', '"name": "Move"').encode())
    )
    assert [(each.name, each.breakpoint) for each in renamed.actions] == [
        ("Move", '{"visit":2}'),
        ("Back", "{}"),
    ]
    file["graph_exit"] = []
    del file["actions"][1], file["actions"][0]["children"]
    answer = text_edit(marked, json.dumps(file).encode())
    assert [each.breakpoint for each in applied(marked.maps, answer).actions] == ['{"visit":2}']
    assert (f"{back}|breakpoint", UNSET) in {(each.key, each.after) for each in answer.changes}


def test_a_breakpoint_is_in_no_file_and_no_digest_and_changes_nothing_that_a_robot_does() -> None:
    plain = nav()[0].graph
    action, *others = plain.actions
    marked = replace(plain, actions=(replace(action, breakpoint="{}"), *others))
    assert codec.write(marked) == codec.write(plain)
    assert digest(marked) == digest(plain)
    found = difference((1, plain), (2, marked))
    assert [field.field for field in found.actions[0].fields] == ["breakpoint"]
    assert is_same(without_looks(found))
