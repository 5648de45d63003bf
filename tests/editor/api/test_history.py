"""The past of a graph over HTTP: what was done, who set what, what it was, and the ways back."""

import json
from typing import Any

import httpx

PAIR = {
    "graph_name": "pair",
    "graph_entry": [{"name": "Dock"}],
    "graph_exit": [{"name": "Charge"}],
    "actions": [
        {
            "name": "Dock",
            "type": "sync",
            "input_parameters": {"speed": {"pvf_type": "number", "pvf_value": 0.4}},
            "children": [{"name": "Charge"}],
        },
        {"name": "Charge", "type": "sync", "parents": [{"name": "Dock"}]},
    ],
}


def _imported(http: httpx.Client) -> str:
    made: str = http.post("/api/graphs", content=json.dumps(PAIR)).json()["id"]
    return made


def _document(http: httpx.Client, graph: str, at: int) -> dict[str, Any]:
    answer = http.get(f"/api/graphs/{graph}/document", params={"at": at})
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def _key_of(http: httpx.Client, graph: str, name: str) -> str:
    actions = _document(http, graph, 1)["actions"]
    return next(key for key, value in actions.items() if value == name and "|" not in key)


def test_an_entry_tells_what_was_changed(http: httpx.Client) -> None:
    graph = _imported(http)
    http.patch(f"/api/graphs/{graph}", json={"name": "later"})
    edited, imported = http.get(f"/api/graphs/{graph}/history").json()
    assert edited["changes"]["fields"] == [{"field": "name", "before": "pair", "after": "later"}]
    assert (imported["kind"], imported.get("changes")) == ("imported", None)


def test_a_document_is_shown_as_it_was(http: httpx.Client) -> None:
    graph = _imported(http)
    http.patch(f"/api/graphs/{graph}", json={"name": "later"})
    assert _document(http, graph, 1)["meta"]["name"] == "pair"
    assert _document(http, graph, 2)["meta"]["name"] == "later"
    answer = http.get(f"/api/graphs/{graph}/document", params={"at": 3})
    assert (answer.status_code, answer.json()["where"]) == (409, {"path": "/at"})


def test_steps_lead_from_one_document_to_another(http: httpx.Client) -> None:
    graph = _imported(http)
    for name in ("second", "third"):
        http.patch(f"/api/graphs/{graph}", json={"name": name})
    found = http.get(f"/api/graphs/{graph}/changes", params={"after": 1, "upto": 9}).json()
    assert [(step["seq"], step["key"], step["before"], step["after"]) for step in found] == [
        (2, "name", "pair", "second"),
        (3, "name", "second", "third"),
    ]


def test_each_field_has_somebody_who_set_it(http: httpx.Client) -> None:
    graph = _imported(http)
    dock = _key_of(http, graph, "Dock")
    found = http.get(f"/api/graphs/{graph}/blame", params={"of": dock}).json()
    fields = {each["field"]: each for each in found}
    assert fields[""]["value"] == "Dock"
    assert json.loads(fields["in/speed"]["value"])["pvf_value"] == 0.4
    assert {(each["author"]["id"], each["seq"]) for each in found} == {("local", 1)}
    assert http.get(f"/api/graphs/{graph}/blame", params={"of": "nobody"}).status_code == 404


def test_the_values_of_a_field_are_told_newest_first(http: httpx.Client) -> None:
    graph = _imported(http)
    http.patch(f"/api/graphs/{graph}", json={"description": "to the dock"})
    asked = {"of": "", "field": "description"}
    (value,) = http.get(f"/api/graphs/{graph}/blame/values", params=asked).json()
    assert (value["value"], value["before"], value["seq"]) == ("to the dock", None, 2)


def test_a_sitting_is_taken_back_and_the_history_says_so(http: httpx.Client) -> None:
    graph = _imported(http)
    http.patch(f"/api/graphs/{graph}", json={"name": "later"})
    edits = {"author": "local", "from_seq": 2, "seq": 2}
    answer = http.post(f"/api/graphs/{graph}/revert", json=edits)
    assert (answer.status_code, answer.json()) == (200, {"seq": 3, "left": []})
    assert http.get(f"/api/graphs/{graph}/umrf").json()["graph_name"] == "pair"
    newest = http.get(f"/api/graphs/{graph}/history").json()[0]
    assert newest["kind"] == "reverted"
    assert (newest["reverted"]["from_seq"], newest["reverted"]["author"]["id"]) == (2, "local")


def test_one_action_goes_back_alone(http: httpx.Client) -> None:
    graph = _imported(http)
    dock = _key_of(http, graph, "Dock")
    http.patch(f"/api/graphs/{graph}", json={"name": "later"})
    answer = http.post(f"/api/graphs/{graph}/restore", json={"seq": 1, "of": dock})
    assert (answer.status_code, answer.json()["seq"]) == (200, 2)  # it is as it was
    assert http.get(f"/api/graphs/{graph}/umrf").json()["graph_name"] == "later"


def test_no_edit_is_named_if_none_changes_the_course(http: httpx.Client) -> None:
    graph = _imported(http)
    http.patch(f"/api/graphs/{graph}", json={"description": "to the dock"})
    asked = {"good": 1, "script": {"behaviours": {}}}
    found = http.post(f"/api/graphs/{graph}/since", json=asked).json()
    assert (found["same"], found["partings"]) == (True, [])
    wrong = http.post(f"/api/graphs/{graph}/since", json={"good": 9, "script": {}})
    assert (wrong.status_code, wrong.json()["where"]) == (400, {"path": "/good"})
    wrong = http.post(f"/api/graphs/{graph}/since", json={"good": 1, "script": {"what": 1}})
    assert (wrong.status_code, wrong.json()["where"]) == (400, {"path": "/script"})
