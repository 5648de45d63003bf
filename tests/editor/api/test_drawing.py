"""Drawing over HTTP: UMRF text as pieces, and rehearsals that leave no trace."""

import json
from typing import Any

import httpx

from editor.api.test_api import NAV as ODD
from editor.api.test_api import assert_problem
from editor.api.test_api import imported as imported_odd
from editor.process import Editor

#: There and back, with conditions as the engine wants them.
NAV: dict[str, Any] = json.loads(json.dumps(ODD))
NAV["actions"][1]["parents"][0]["conditions"] = ["on_true -> run", "on_error -> bypass"]


def imported(http: httpx.Client, **changes: Any) -> dict[str, Any]:
    return imported_odd(http, **{**NAV, **changes})


def rehearse(http: httpx.Client, graph: str, **wanted: Any) -> dict[str, Any]:
    answer = http.post(f"/api/graphs/{graph}/rehearsal", json=wanted)
    assert answer.status_code == 200, answer.text
    body: dict[str, Any] = answer.json()
    return body


def results(rehearsal: dict[str, Any]) -> list[tuple[str, str]]:
    return [(e["node"], e["result"]) for e in rehearsal["trace"] if e["kind"] == "node_result"]


def test_a_rehearsal_tells_what_would_happen_and_stores_nothing(editor: Editor) -> None:
    with editor.client() as http:
        graph = imported(http)
        before = http.get(f"/api/graphs/{graph['id']}/history").json()
        played = rehearse(http, graph["id"], seq=graph["seq"])
        assert played["seq"] == graph["seq"]
        assert not played["cut"]
        assert results(played) == [("Go_0", "on_true"), ("Back_0", "on_true")]
        assert played["trace"][-1]["kind"] == "node_state"
        assert http.get(f"/api/graphs/{graph['id']}").json()["seq"] == graph["seq"]
        assert http.get(f"/api/graphs/{graph['id']}/history").json() == before


def test_a_longer_script_changes_only_what_comes_after(editor: Editor) -> None:
    with editor.client() as http:
        graph = imported(http)
        plain = rehearse(http, graph["id"])["trace"]
        script = {"behaviours": {"Back_0": [{"after_s": 0.25, "result": "on_error"}]}}
        other = rehearse(http, graph["id"], script=script)["trace"]
        start = next(i for i, e in enumerate(plain) if e.get("node") == "Back_0")
        assert other[: start + 2] == plain[: start + 2]
        assert other[-1] != plain[-1]


def test_people_can_press_stop_in_a_rehearsal(editor: Editor) -> None:
    with editor.client() as http:
        graph = imported(http)
        played = rehearse(http, graph["id"], commands=[{"at_ms": 400, "verb": "stop"}])
        states = [e["state"] for e in played["trace"] if e["kind"] == "graph_state"]
        assert states[-1] == "STOPPED"


def test_a_rehearsal_begins_in_the_middle_or_plays_only_some_actions(editor: Editor) -> None:
    with editor.client() as http:
        graph = imported(http)["id"]
        assert results(rehearse(http, graph, **{"from": {"at": ["Back_0"]}})) == [
            ("Back_0", "on_true")
        ]
        only = {"at": ["Go_0"], "only": True}
        assert results(rehearse(http, graph, **{"from": only})) == [("Go_0", "on_true")]
        refused = http.post(f"/api/graphs/{graph}/rehearsal", json={"from": {"at": ["Fly_0"]}})
        assert assert_problem(refused, 400)["where"] == {"path": "/from/at"}


def test_a_rehearsal_without_end_is_cut(editor: Editor) -> None:
    loop = json.loads(json.dumps(NAV))
    loop["actions"][1]["children"] = [{"name": "Go", "instance_id": 0}]
    loop["actions"][0]["parents"] = [
        {"name": "Back", "instance_id": 0, "required": False, "conditions": ["on_true -> run"]}
    ]
    loop["graph_exit"] = []
    with editor.client() as http:
        graph = imported(http, **loop)
        played = rehearse(http, graph["id"], for_ms=86_400_000)
        assert played["cut"]
        assert len(played["trace"]) == 4_000


def test_a_refused_rehearsal_says_why(editor: Editor) -> None:
    with editor.client() as http:
        graph = imported(http)
        path = f"/api/graphs/{graph['id']}/rehearsal"
        wrong = http.post(path, json={"script": {"behaviours": {"Go_0": [{"result": "on_fire"}]}}})
        problem = assert_problem(wrong, 400)
        assert problem["where"]["path"] == "/script"
        assert "Go_0/0/result" in problem["detail"]
        assert_problem(http.post(path, json={"seq": 99}), 409)
        assert_problem(http.post(path, json={"for_ms": -1}), 400)
        assert_problem(http.post("/api/graphs/nowhere/rehearsal", json={}), 404)


def test_a_graph_that_the_engine_refuses_is_not_played(editor: Editor) -> None:
    ghost = json.loads(json.dumps(NAV))
    ghost["graph_entry"] = [{"name": "Nobody", "instance_id": 0}]
    with editor.client() as http:
        graph = imported(http, **ghost)
        problem = assert_problem(http.post(f"/api/graphs/{graph['id']}/rehearsal", json={}), 409)
        assert "The engine would refuse this graph" in problem["detail"]


def test_umrf_text_becomes_pieces_and_stores_nothing(editor: Editor) -> None:
    with editor.client() as http:
        before = len(http.get("/api/graphs").json())
        text = json.dumps(NAV).replace("5.0", "5.00")
        pieces = http.post("/api/pieces", content=text).json()
        assert pieces["name"] == "nav"
        names = {value for key, value in pieces["actions"].items() if "|" not in key}
        assert names == {"Go", "Back"}
        assert any("5.00" in str(value) for value in pieces["actions"].values())
        assert any(key.endswith("|on_error") for key in pieces["relations"])
        assert len(http.get("/api/graphs").json()) == before


def test_bad_text_says_where_it_is_wrong(editor: Editor) -> None:
    with editor.client() as http:
        problem = assert_problem(http.post("/api/pieces", content='{"actions": [,]}'), 400)
        assert problem["where"]["line"] == 1
        assert_problem(http.post("/api/pieces", content="[1, 2]"), 422)
        assert_problem(http.post("/api/pieces", content="just words"), 400)


def test_a_rehearsal_asks_for_values_and_plays_with_those_that_are_given(editor: Editor) -> None:
    first, *others = NAV["actions"]
    asking = {**first, "input_parameters": {"place": {"pvf_type": "string"}}}
    with editor.client() as http:
        graph = imported(http, actions=[asking, *others])["id"]
        before = rehearse(http, graph)
        assert [(each["action"], each["name"]) for each in before["asked"]] == [("Go_0", "place")]
        assert results(before) == []
        played = rehearse(http, graph, values={"Go_0": {"place": "here"}})
        assert results(played) == [("Go_0", "on_true"), ("Back_0", "on_true")]
        wrong = {"values": {"Go_0": {"place": 5}}}
        answer = http.post(f"/api/graphs/{graph}/rehearsal", json=wrong)
        assert (answer.status_code, answer.json()["where"]["path"]) == (400, "/values/Go_0/place")
