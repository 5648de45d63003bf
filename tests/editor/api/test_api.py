"""The editor over HTTP, as programs meet it."""

import json
import threading
from typing import Any

import httpx
import pytest

from editor.process import Editor

NAV: dict[str, Any] = {
    "graph_name": "nav",
    "graph_description": "there and back",
    "graph_entry": [{"name": "Go", "instance_id": 0}],
    "graph_exit": [{"name": "Back", "instance_id": 0}],
    "actions": [
        {
            "name": "Go",
            "instance_id": 0,
            "type": "sync",
            "input_parameters": {"speed": {"pvf_type": "number", "pvf_value": 5.0}},
            "children": [{"name": "Back", "instance_id": 0}],
        },
        {
            "name": "Back",
            "instance_id": 0,
            "type": "sync",
            "parents": [
                {
                    "name": "Go",
                    "instance_id": 0,
                    "conditions": {
                        "on_true": "run",
                        "on_false": "ignore",
                        "on_error": "bypass",
                        "on_stopped": "ignore",
                    },
                }
            ],
        },
    ],
}


def imported(http: httpx.Client, **changes: Any) -> dict[str, Any]:
    answer = http.post("/api/graphs", json={**NAV, **changes})
    assert answer.status_code == 201, answer.text
    made: dict[str, Any] = answer.json()
    assert answer.headers["location"] == f"/api/graphs/{made['id']}"
    return made


def assert_problem(answer: httpx.Response, status: int) -> dict[str, Any]:
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    body: dict[str, Any] = answer.json()
    assert body["status"] == status
    assert {"type", "title", "detail"} <= set(body)
    return body


def test_a_new_user_finds_examples(http: httpx.Client) -> None:
    names = {graph["name"] for graph in http.get("/api/graphs").json()}
    assert len(names) >= 3


def test_an_example_can_be_had_again(http: httpx.Client) -> None:
    examples = http.get("/api/examples").json()
    assert len(examples) >= 3
    made = http.post("/api/graphs", json=examples[0]["umrf"])
    assert made.json()["name"] == examples[0]["umrf"]["graph_name"]


def test_an_imported_file_is_a_graph_that_means_the_same(http: httpx.Client) -> None:
    made = imported(http)
    assert (made["name"], made["description"], made["seq"]) == ("nav", "there and back", 1)
    assert made["actions"] == 2
    assert made["reading"]["dialect"] == "D3"
    text = http.get(f"/api/graphs/{made['id']}/umrf").text
    assert '"pvf_value": 5.0' in text
    back = json.loads(text)
    assert [action["name"] for action in back["actions"]] == ["Go", "Back"]
    assert back["actions"][1]["parents"][0]["conditions"]["on_error"] == "bypass"


def test_an_empty_graph_needs_only_a_name(http: httpx.Client) -> None:
    made = http.post("/api/graphs", json={"name": " New task ", "description": "d"}).json()
    assert (made["name"], made["description"], made["actions"]) == ("New task", "d", 0)
    assert "reading" not in made


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"", 400),
        (b"{", 400),
        (b"\xff\xfe", 400),
        (b"[1]", 422),
        (b"5", 422),
        (b'{"hello": 1}', 422),
        (b'{"name": 5}', 422),
        (b'{"name": ""}', 400),
        (b'{"graph_name": "a", "graph_name": "b", "actions": []}', 400),
        (b'{"graph_name": "a", "actions": [], "x": NaN}', 400),
        (b'{"graph_name": "a", "actions": [], "x": Infinity}', 400),
        (b'{"graph_name": "a", "actions": ' + b"[" * 100_000, 400),
        (b'{"graph_name": "a", "actions": ' + b"[" * 90 + b"]" * 90 + b"}", 400),
        (b'{"graph_name": "\\ud800", "actions": []}', 400),
        (b'{"graph_name": "a", "actions": [], "x": "' + b"y" * 10_485_760 + b'"}', 413),
    ],
)
def test_a_file_that_cannot_be_read_is_refused_with_a_reason_and_nothing_is_stored(
    http: httpx.Client, body: bytes, status: int
) -> None:
    before = len(http.get("/api/graphs").json())
    assert_problem(http.post("/api/graphs", content=body), status)
    assert len(http.get("/api/graphs").json()) == before


def test_a_refusal_says_where(http: httpx.Client) -> None:
    body = assert_problem(http.post("/api/graphs", content=b'{"actions": [\n  1,\n  oops]}'), 400)
    assert (body["where"]["line"], body["where"]["column"]) == (3, 3)
    twice = b'{"graph_name": "a", "actions": [{"name": "b", "name": "c"}]}'
    body = assert_problem(http.post("/api/graphs", content=twice), 400)
    assert body["where"]["path"] == "/actions/0/name"


def test_an_entry_that_names_no_action_is_imported_with_a_problem(http: httpx.Client) -> None:
    made = imported(http, graph_entry=[{"name": "Nowhere", "instance_id": 3}])
    assert made["problems"]["error"] >= 1
    found = http.get(f"/api/graphs/{made['id']}/problems").json()
    assert found["seq"] == 1
    assert any(problem["severity"] == "error" for problem in found["problems"])


def test_renaming_is_an_edit_of_the_document(http: httpx.Client, graph: str) -> None:
    answer = http.patch(f"/api/graphs/{graph}", json={"name": "renamed"})
    assert (answer.json()["name"], answer.json()["seq"]) == ("renamed", 2)
    assert http.get(f"/api/graphs/{graph}/umrf").json()["graph_name"] == "renamed"
    then = http.get(f"/api/graphs/{graph}/umrf", params={"at": 1})
    assert then.json()["graph_name"] == "task"
    assert http.patch(f"/api/graphs/{graph}", json={"name": "renamed"}).json()["seq"] == 2
    assert_problem(http.patch(f"/api/graphs/{graph}", json={"name": "  "}), 400)
    assert_problem(http.patch(f"/api/graphs/{graph}", json={"nmae": "x"}), 400)


def test_a_deleted_graph_is_gone_and_can_be_brought_back(http: httpx.Client, graph: str) -> None:
    assert http.delete(f"/api/graphs/{graph}").status_code == 204
    for path in ("", "/umrf", "/problems", "/history", "/versions"):
        assert_problem(http.get(f"/api/graphs/{graph}{path}"), 404)
    assert_problem(http.delete(f"/api/graphs/{graph}"), 404)
    listed = {each["id"] for each in http.get("/api/graphs").json()}
    gone = {each["id"] for each in http.get("/api/graphs?deleted=true").json()}
    assert graph not in listed
    assert graph in gone
    assert http.post(f"/api/graphs/{graph}/recover").json()["id"] == graph
    assert http.get(f"/api/graphs/{graph}").status_code == 200


def test_a_version_never_changes(http: httpx.Client) -> None:
    made = imported(http)["id"]
    answer = http.post(f"/api/graphs/{made}/versions", json={"label": " first  one "})
    version = answer.json()
    assert answer.status_code == 201
    assert answer.headers["location"] == f"/api/versions/{version['id']}"
    assert (version["label"], version["seq"], version["graph"]) == ("first one", 1, made)
    assert len(version["digest"]) == 64
    http.patch(f"/api/graphs/{made}", json={"name": "other"})
    again = http.get(f"/api/versions/{version['id']}")
    assert again.json() == version
    assert '"pvf_value": 5.0' in again.text
    stamp = version["umrf"]["gui_attributes"]["action_assistant"]
    assert (stamp["graph"], stamp["version"]) == (made, version["id"])


def test_a_version_is_what_the_graph_was_at_that_change(http: httpx.Client) -> None:
    made = imported(http)["id"]
    http.patch(f"/api/graphs/{made}", json={"description": "changed"})
    then = http.post(f"/api/graphs/{made}/versions", json={"seq": 1}).json()
    now = http.post(f"/api/graphs/{made}/versions").json()
    assert (then["seq"], now["seq"]) == (1, 2)
    assert then["umrf"]["graph_description"] == "there and back"
    assert now["umrf"]["graph_description"] == "changed"
    assert then["digest"] != now["digest"]
    same = http.post(f"/api/graphs/{made}/versions", json={"seq": 1})
    assert (same.status_code, same.json()["id"]) == (200, then["id"])
    listed = http.get(f"/api/graphs/{made}/versions").json()
    assert [each["id"] for each in listed] == [now["id"], then["id"]]
    assert "umrf" not in listed[0]


@pytest.mark.parametrize("seq", [0, -1, 2, 10**30, "x", 1.5])
def test_a_change_that_never_was_cannot_be_published(
    http: httpx.Client, graph: str, seq: Any
) -> None:
    answer = http.post(f"/api/graphs/{graph}/versions", json={"seq": seq})
    assert_problem(answer, 409 if isinstance(seq, int) else 400)
    assert http.get(f"/api/graphs/{graph}/versions").json() == []


def test_going_back_is_an_ordinary_edit(http: httpx.Client) -> None:
    made = imported(http)["id"]
    before = http.get(f"/api/graphs/{made}/umrf").text
    http.patch(f"/api/graphs/{made}", json={"name": "worse", "description": "much"})
    answer = http.post(f"/api/graphs/{made}/restore", json={"seq": 1})
    assert (answer.status_code, answer.json()["seq"]) == (200, 3)
    assert http.get(f"/api/graphs/{made}/umrf").text == before
    assert http.get(f"/api/graphs/{made}/umrf?at=2").json()["graph_name"] == "worse"
    kinds = [entry["kind"] for entry in http.get(f"/api/graphs/{made}/history").json()]
    assert kinds == ["restored", "edited", "imported"]
    assert http.post(f"/api/graphs/{made}/restore", json={"seq": 1}).json()["seq"] == 3


def test_history_tells_who_did_what(http: httpx.Client, graph: str) -> None:
    for n in range(3):
        http.patch(f"/api/graphs/{graph}", json={"name": f"name {n}"})
    version = http.post(f"/api/graphs/{graph}/versions", json={"label": "v"}).json()
    http.patch(f"/api/graphs/{graph}", json={"name": "last"})
    found = http.get(f"/api/graphs/{graph}/history").json()
    assert [entry["kind"] for entry in found] == ["edited", "published", "edited", "created"]
    assert (found[2]["from_seq"], found[2]["seq"]) == (2, 4)
    assert found[1]["version"]["id"] == version["id"]
    assert all(entry["author"]["id"] == "local" for entry in found)
    assert len(http.get(f"/api/graphs/{graph}/history?limit=1").json()) == 1
    early = http.get(f"/api/graphs/{graph}/history?before=4").json()
    assert (early[0]["from_seq"], early[0]["seq"]) == (2, 3)


def test_a_difference_names_fields_and_arrows(http: httpx.Client) -> None:
    made = imported(http)["id"]
    http.patch(f"/api/graphs/{made}", json={"name": "later"})
    found = http.get(f"/api/graphs/{made}/diff", params={"from": 1, "to": 2}).json()
    assert found["fields"] == [{"field": "name", "before": "nav", "after": "later"}]
    assert found["actions"] == found["relations"] == []
    assert http.get(f"/api/graphs/{made}/diff", params={"from": 1}).json() == found
    assert_problem(http.get(f"/api/graphs/{made}/diff"), 400)
    assert_problem(http.get(f"/api/graphs/{made}/diff?from=1&to=9"), 409)


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/api/nothing", 404),
        ("GET", "/api/graphs/none", 404),
        ("GET", "/api/versions/none", 404),
        ("PUT", "/api/graphs", 405),
        ("PATCH", "/api/graphs/none", 400),
        ("POST", "/api/graphs/none/restore", 400),
    ],
)
def test_every_refusal_has_the_same_shape(
    http: httpx.Client, method: str, path: str, status: int
) -> None:
    assert_problem(http.request(method, path, content=b"{"), status)


def test_events_are_told_from_where_one_left_off(
    editor: Editor, http: httpx.Client, graph: str
) -> None:
    heard: list[dict[str, Any]] = []
    ready = threading.Event()

    def listen(**headers: str) -> None:
        with (
            editor.client() as client,
            client.stream("GET", "/api/events?after=0", headers=headers) as stream,
        ):
            for line in stream.iter_lines():
                if line.startswith("data: "):
                    heard.append(json.loads(line[6:]))
                    ready.set()
                    ours = heard[-1].get("graph") == graph
                    if ours and heard[-1]["kind"] == "version.published.v1":
                        return

    thread = threading.Thread(target=listen)
    thread.start()
    assert ready.wait(10)
    http.patch(f"/api/graphs/{graph}", json={"name": "told"})
    http.post(f"/api/graphs/{graph}/versions", json={"label": "told"})
    thread.join(10)
    assert not thread.is_alive()
    positions = [each["position"] for each in heard]
    assert positions == list(range(1, len(heard) + 1))
    ours = [each["kind"] for each in heard if each.get("graph") == graph]
    assert ours[-1] == "version.published.v1"
    middle = positions[-3]
    heard.clear()
    listen(**{"last-event-id": str(middle)})
    assert [each["position"] for each in heard] == positions[-2:]


def test_config_leads_to_the_runner_on_the_host_that_was_asked(editor: Editor) -> None:
    for host in ("127.0.0.1", "localhost"):
        with editor.client() as client:
            url = f"http://{host}:{editor.port}/api/config"
            answer = client.get(url, headers={"host": f"{host}:{editor.port}"}).json()
        assert answer["runner_url"] == f"http://{host}:{editor.port + 1}"
        assert answer["mode"] == "local"


def test_every_route_is_described(http: httpx.Client) -> None:
    schema = http.get("/schema/openapi.json").json()
    assert {"/api/graphs", "/api/versions/{version_id}", "/api/events"} <= set(schema["paths"])
    names = [
        operation["operationId"] for path in schema["paths"].values() for operation in path.values()
    ]
    assert len(names) == len(set(names))
    assert all(
        operation.get("summary") for path in schema["paths"].values() for operation in path.values()
    )


def test_a_preview_says_what_a_file_would_become_and_stores_nothing(http: httpx.Client) -> None:
    before = http.get("/api/graphs").json()
    answer = http.post("/api/graphs", params={"preview": "true"}, json=NAV)
    assert answer.status_code == 200
    found = answer.json()
    assert (found["name"], found["actions"], found["dialect"]) == ("nav", 2, "D3")
    assert {problem["code"] for problem in found["problems"]} >= {"H3"}
    assert found["notes"] == []
    assert http.get("/api/graphs").json() == before
    for body, status in ((b"oops", 400), (b'{"hello": 1}', 422)):
        assert_problem(http.post("/api/graphs?preview=true", content=body), status)


def direction_of(http: httpx.Client, graph: dict[str, Any]) -> str | None:
    """Return the direction that the file of a graph has."""
    umrf = http.get(f"/api/graphs/{graph['id']}/umrf").json()
    found: str | None = umrf.get("gui_attributes", {}).get("action_assistant", {}).get("direction")
    return found


def test_a_graph_without_positions_goes_to_the_right(http: httpx.Client) -> None:
    blank = http.post("/api/graphs", json={"name": "blank"}).json()
    assert direction_of(http, blank) == direction_of(http, imported(http)) == "right"


def test_a_graph_with_positions_keeps_its_direction(http: httpx.Client) -> None:
    placed = {"gui_attributes": {"position": {"x": 0, "y": 160}}}
    actions = [{**NAV["actions"][0], **placed}, NAV["actions"][1]]
    assert direction_of(http, imported(http, actions=actions)) is None
    for said, kept in (("right", "right"), ("down", None), ("sideways", None)):
        ours = {"action_assistant": {"direction": said}}
        graph = imported(http, actions=actions, gui_attributes=ours)
        assert direction_of(http, graph) == kept


def test_problems_of_a_preview_have_places_in_the_sent_file(http: httpx.Client) -> None:
    go = '{"name": "Go", "id": 7, "effect": "synchronous", "parents": [5, {"name": "No", "id": 0}]}'
    text = '{"graph_name": "old",\n "umrf_actions": [5,\n  ' + go + "]}"
    found = http.post("/api/graphs", params={"preview": "true"}, content=text.encode()).json()
    ghost = next(each for each in found["problems"] if each["code"] == "ghost")
    assert (ghost["where"]["path"], ghost["where"]["line"]) == ("/umrf_actions/1/parents/1", 3)
    assert text.split("\n")[2][ghost["where"]["column"] - 1 :].startswith('{"name": "No"')
    number = next(each for each in found["remarks"] if "“id”" in each["message"])
    assert (number["where"]["path"], number["where"]["line"]) == ("/umrf_actions/1/id", 3)
    assert len(found["remarks"]) == len(found["notes"])


def test_the_problems_of_a_graph_have_their_places_in_its_text(http: httpx.Client) -> None:
    made = imported(http)
    [text, found] = (http.get(f"/api/graphs/{made['id']}/{what}") for what in ("umrf", "problems"))
    lines = text.text.split("\n")
    for problem in found.json()["problems"]:
        where = problem["where"]
        if key := where.get("path", "").rpartition("/")[2]:
            here = lines[where["line"] - 1][where["column"] - 1 :]
            assert here.startswith(f'"{key}"') or key.isdigit()


def test_the_file_of_an_action_is_no_graph_but_can_be_pasted(http: httpx.Client) -> None:
    action = {"name": "TaMove", "effect": "synchronous", "parents": [{"name": "A", "id": 0}]}
    before = http.get("/api/graphs").json()
    for query in ("", "?preview=true"):
        refused = http.post(f"/api/graphs{query}", json=action)
        problem = assert_problem(refused, 422)
        assert "one action, TaMove" in problem["detail"]
        assert "paste" in problem["detail"]
        assert problem["where"]["code"] == "action-file"
    assert http.get("/api/graphs").json() == before
    pieces = http.post("/api/pieces", json=action).json()
    assert [value for key, value in pieces["actions"].items() if "|" not in key] == ["TaMove"]


def test_the_library_is_there_to_be_asked(http: httpx.Client) -> None:
    made = imported(http)
    go = next(each for each in http.get("/api/actions").json() if each["name"] == "Go")
    assert made["id"] in go["used_in"]
    speed = {
        "path": "speed",
        "pvf_type": "number",
        "required": True,
        "text": '{"pvf_type":"number"}',
    }
    assert speed in go["inputs"]
