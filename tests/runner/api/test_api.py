"""The runner over HTTP, as programs and the page see it."""

import json
import threading
from typing import Any

import httpx
import msgspec
import pytest

from action_assistant.umrf.files import codec
from action_assistant.umrf.model import EXIT, Action
from runner.harness import carousel, order, sequence
from runner.process import RunnerProcess, body, over, started

FAST = {"*": [{"after_s": 0.02}]}
ENDLESS = {"*": [{"never": True}]}


def changed(asked: Any, **fields: Any) -> Any:
    return msgspec.structs.replace(asked, **fields)


def test_a_run_is_started_seen_and_kept(process: RunnerProcess) -> None:
    with process.client() as client:
        run = started(client, order(sequence(actions=2), script=FAST))
        assert run["simulated"] is True
        assert run["author"] == {"id": "local", "name": run["author"]["name"], "by": "program"}
        done = over(client, run["id"])
        assert (done["state"], done["result"]) == ("finished", "on_true")
        (visit,) = done["actions"]["Work_1"]["visits"]
        assert set(visit) == {
            *("from", "not_before", "not_after", "until", "result", "how", "inputs")
        }
        assert done["umrf"]["gui_attributes"]["action_assistant"]["run"] == run["id"]
        first = client.get("/api/runs").json()[0]
        assert first["id"] == run["id"]
        assert "actions" not in first
        assert first["state"] == "finished"


def test_the_list_can_be_filtered_and_leafed_through(process: RunnerProcess) -> None:
    with process.client() as client:
        runs = [
            started(client, order(sequence(actions=1), graph="leaf", script=FAST)) for _ in range(3)
        ]
        for run in runs:
            over(client, run["id"])
        ids = [run["id"] for run in reversed(runs)]
        listed = client.get("/api/runs", params={"graph": "leaf"}).json()
        assert [run["id"] for run in listed] == ids
        query = {"graph": "leaf", "before": ids[0], "limit": 1}
        assert [run["id"] for run in client.get("/api/runs", params=query).json()] == [ids[1]]
        lost = {"graph": "leaf", "state": "lost"}
        assert client.get("/api/runs", params=lost).json() == []


def test_the_runs_of_a_start_are_found_by_its_request_id(process: RunnerProcess) -> None:
    """A client that got no answer asks for the outcome, and sends no second start."""
    with process.client() as client:
        asked = order(sequence(actions=1), script=FAST, request_id="quitelost123")
        before = client.get("/api/starts/quitelost123").json()
        nothing = {"under_way": False, "runs": [], "queued": None}
        assert before == {"request_id": "quitelost123"} | nothing
        run = started(client, asked)
        found = client.get("/api/starts/quitelost123").json()
        assert [each["id"] for each in found["runs"]] == [run["id"]]
        assert found["runs"][0]["engine"] == "simulator"
        other = client.get("/api/starts/quitelost12").json()
        assert other["runs"] == []


def problem(answer: httpx.Response, status: int) -> dict[str, Any]:
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    found: dict[str, Any] = answer.json()
    return found


def test_a_graph_that_is_not_the_approved_one_is_refused(process: RunnerProcess) -> None:
    asked = changed(order(sequence()), digest="0" * 64)
    with process.client() as client:
        found = problem(client.post("/api/runs", content=body(asked)), 409)
        assert found["where"]["path"] == "/digest"
        assert "digest" in found["detail"]


def test_a_ghost_blocks_the_start_whatever_the_override(process: RunnerProcess) -> None:
    graph = sequence()
    ghost = Action(key="ghost0000000", name="Nowhere", missing=True)
    relation = msgspec.structs.replace(graph.relations[1], child=ghost.key)
    broken = msgspec.structs.replace(
        graph, actions=(*graph.actions, ghost), relations=(*graph.relations, relation)
    )
    text = codec.write(broken)
    asked = changed(order(codec.read(text).graph), umrf=msgspec.Raw(text.encode()))
    with process.client() as client:
        found = problem(client.post("/api/runs", content=body(asked)), 409)
        codes = [each["code"] for each in found["where"]["problems"]]
        fields = json.loads(body(asked)) | {"override": {"codes": codes, "reason": "I know"}}
        again = problem(client.post("/api/runs", json=fields), 409)
        assert "cannot be overridden" in again["detail"]
        assert client.get("/api/runs", params={"graph": "ghosts"}).json() == []


@pytest.mark.parametrize(
    ("fields", "status", "path"),
    [
        ({"version": 1}, 400, "/version"),
        ({"digest": None}, 400, "/digest"),
        ({"request_id": ""}, 400, "/request_id"),
        ({"surprise": 1}, 400, None),
        ({"umrf": [1]}, 422, "/umrf"),
        ({"engine": "Nobody"}, 400, "/engine"),
        ({"script": {"behaviours": {"*": []}}}, 400, "/script"),
        ({"override": {"codes": ["x"], "reason": " "}}, 400, "/override/reason"),
    ],
)
def test_a_malformed_start_is_told_where(
    process: RunnerProcess, fields: dict[str, Any], status: int, path: str | None
) -> None:
    asked = json.loads(body(order(sequence()))) | fields
    with process.client() as client:
        found = problem(client.post("/api/runs", json=asked), status)
        if path is not None:
            assert found["where"]["path"] == path


def as_text(content: bytes) -> bytes:
    """Return the same body with its graph as a string, as the page sends it."""
    fields = msgspec.json.decode(content, type=dict[str, msgspec.Raw])
    text = msgspec.json.encode(bytes(fields["umrf"]).decode())
    return msgspec.json.encode(fields | {"umrf": msgspec.Raw(text)})


def test_a_graph_as_object_and_as_text_are_the_same_run(process: RunnerProcess) -> None:
    graph = sequence(actions=2)
    text = codec.write(graph).replace(
        '"type": "sync",',
        '"type": "sync", "input_parameters": {"x": {"pvf_type": "number", "pvf_value": 5.0}},',
        1,
    )
    asked = [order(codec.read(text).graph, script=ENDLESS) for _ in range(2)]
    assert b"5.0" in bytes(asked[0].umrf)
    bodies = [body(asked[0]), as_text(body(asked[1]))]
    with process.client() as client:
        runs = [client.post("/api/runs", content=each).json() for each in bodies]
        assert runs[0]["digest"] == runs[1]["digest"]
        sent = [client.get(f"/api/runs/{run['id']}/umrf").content for run in runs]
        assert sent[0].replace(runs[0]["id"].encode(), runs[1]["id"].encode()) == sent[1]
        assert b'"pvf_value": 5.0' in sent[1]
        again = client.post("/api/runs", content=as_text(bodies[0]))
        assert (again.status_code, again.json()["id"]) == (200, runs[0]["id"])
        umrf = bytes(asked[0].umrf)
        change = b'{"version":"v2","digest":"%b","umrf":%b}' % (asked[0].digest.encode(), umrf)
        look = b'{"engines":["simulator"],"umrf":%b}' % umrf
        for path, content, status in [
            (f"/api/runs/{runs[0]['id']}/modify", change, 202),
            (f"/api/runs/{runs[0]['id']}/script", b'{"umrf":%b}' % umrf, 200),
            ("/api/preflight", look, 200),
        ]:
            told = [client.post(path, content=each) for each in (content, as_text(content))]
            assert [each.status_code for each in told] == [status, status], told[1].text
            if status == 200:
                assert told[0].content == told[1].content
        client.post("/api/stop")


@pytest.mark.parametrize(
    ("umrf", "status", "where"),
    [
        ("{", 400, {"path": "/umrf", "line": 1, "column": 2}),
        ("[]", 422, {"path": "/umrf", "line": 1, "column": 1}),
        (" " * 2_200_000, 413, None),
    ],
)
def test_a_text_that_is_no_graph_is_refused_with_its_place(
    process: RunnerProcess, umrf: str, status: int, where: dict[str, Any] | None
) -> None:
    asked = json.loads(body(order(sequence()))) | {"umrf": umrf}
    with process.client() as client:
        found = problem(client.post("/api/runs", json=asked), status)
        assert found.get("where") == where
        if status == 413:
            assert found["detail"] == "At most 2 MB are read."


def test_escapes_of_a_text_do_not_make_a_body_too_large(process: RunnerProcess) -> None:
    content = body(order(sequence(), script=FAST))
    text = "\n" * 1_900_000
    with process.client() as client:
        fields = json.loads(content)
        spaced = json.dumps(fields["umrf"]) + text
        run = client.post("/api/runs", json=fields | {"umrf": spaced})
        assert run.status_code == 201, run.text
        as_object = content.replace(b'"umrf":{', b'"umrf":' + text.encode() + b" " * 250_000 + b"{")
        assert problem(client.post("/api/runs", content=as_object), 413)


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"\xff", b"[" * 100_000])
def test_a_body_that_is_no_start_is_refused(process: RunnerProcess, content: bytes) -> None:
    with process.client() as client:
        problem(client.post("/api/runs", content=content), 400)


@pytest.mark.parametrize("name", ["evil%n%s", "new\nline", ""])
def test_names_that_no_engine_should_see_are_refused(process: RunnerProcess, name: str) -> None:
    with process.client() as client:
        assert client.post("/api/runs", content=body(order(sequence(name)))).status_code == 409


def test_equal_requests_at_once_are_one_run(process: RunnerProcess) -> None:
    asked = body(order(sequence(actions=1), script=FAST))
    answers: list[httpx.Response] = []

    def ask() -> None:
        with process.client() as client:
            answers.append(client.post("/api/runs", content=asked))

    threads = [threading.Thread(target=ask) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(each.status_code for each in answers) == [200] * 7 + [201]
    assert len({each.json()["id"] for each in answers}) == 1


def test_stop_is_answered_at_once_and_proven_soon(process: RunnerProcess) -> None:
    with process.client() as client:
        run = started(client, order(sequence(), script=ENDLESS))
        answer = client.post(f"/api/runs/{run['id']}/stop", json={"stop_id": "s"})
        assert answer.status_code == 202
        told = answer.json()
        assert (told["type"], told["stop_id"], told["runs"]) == ("stopping", "s", [run["id"]])
        done = over(client, run["id"])
        assert (done["state"], done["stopped_by"]["id"]) == ("stopped", "local")
        assert done["proof_at"] is not None
        assert client.post(f"/api/runs/{run['id']}/stop").json()["runs"] == []
        listed = client.get("/api/runs").json()[0]
        assert (listed["desired"], listed["proof_at"]) == ("stopped", done["proof_at"])


def test_stop_takes_any_body(process: RunnerProcess) -> None:
    with process.client() as client:
        run = started(client, order(sequence(), script=ENDLESS))
        answer = client.post(f"/api/runs/{run['id']}/stop", content=b"\xff{{")
        assert answer.json()["runs"] == [run["id"]]


def test_stop_all_stops_all(process: RunnerProcess) -> None:
    with process.client() as client:
        runs = [started(client, order(sequence(), script=ENDLESS))["id"] for _ in range(3)]
        assert set(client.post("/api/stop").json()["runs"]) >= set(runs)
        assert [over(client, run)["state"] for run in runs] == ["stopped"] * 3


def test_pause_and_resume(process: RunnerProcess) -> None:
    with process.client() as client:
        run = started(client, order(sequence(), script={"*": [{"after_s": 0.5}]}))
        assert client.post(f"/api/runs/{run['id']}/pause").status_code == 202
        problem(client.post(f"/api/runs/{run['id']}/pause"), 409)
        assert client.post(f"/api/runs/{run['id']}/resume").status_code == 202
        problem(client.post(f"/api/runs/{run['id']}/modify"), 400)
        assert over(client, run["id"])["state"] == "finished"


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/api/runs/nothing"),
        ("POST", "/api/runs/nothing/stop"),
        ("POST", "/api/runs/nothing/pause"),
        ("GET", "/api/runs/nothing/events"),
        ("GET", "/api/robots/nobody"),
        ("GET", "/api/robots/nobody/known/Work"),
    ],
)
def test_unknown_resources_are_not_found(process: RunnerProcess, method: str, path: str) -> None:
    with process.client() as client:
        problem(client.request(method, path), 404)


def test_a_robot_can_be_registered_and_says_that_it_has_no_link(process: RunnerProcess) -> None:
    with process.client() as client:
        asked = {"name": "David", "domain": 7, "profile": {"commit": "5819055"}}
        answer = client.post("/api/robots", json=asked)
        assert answer.status_code == 201
        names = {each["name"]: each for each in client.get("/api/robots").json()}
        assert names["simulator"]["state"] == "answering"
        assert (names["David"]["state"], names["David"]["domain"]) == ("no_link", 7)
        start = order(sequence(), engine="David")
        found = problem(client.post("/api/runs", content=body(start)), 409)
        assert "No link" in found["detail"]
        problem(client.post("/api/robots", json={"name": "simulator"}), 409)
        problem(client.post("/api/robots", json={"name": "a b"}), 400)
        problem(client.post("/api/robots", json={"name": "Eve", "domain": 999}), 400)


def test_stopping_everything_tells_of_which_robots_nothing_is_known(process: RunnerProcess) -> None:
    with process.client() as client:
        assert client.post("/api/robots", json={"name": "Farah", "domain": 8}).status_code == 201
        answer = client.post("/api/stop", json={"stop_id": "s9"}).json()
        assert client.delete("/api/robots/Farah").status_code == 204
    assert (answer["stop_id"], answer["graphs"]) == ("s9", {})
    assert answer["unknown"]["Farah"].startswith("No link: ")


def events(client: httpx.Client, run: str, last: int | None = None) -> list[dict[str, Any]]:
    headers = {} if last is None else {"last-event-id": str(last)}
    with client.stream("GET", f"/api/runs/{run}/events", headers=headers) as answer:
        if answer.status_code == 204:
            return []
        assert answer.headers["content-type"].startswith("text/event-stream")
        return [
            json.loads(line.removeprefix("data: "))
            for line in answer.iter_lines()
            if line.startswith("data: ")
        ]


def test_events_of_a_run_can_be_followed_to_its_end_and_taken_up_again(
    process: RunnerProcess,
) -> None:
    with process.client() as client:
        run = started(client, order(sequence(actions=2), script={"*": [{"after_s": 0.2}]}))
        all_of_them = events(client, run["id"])  # while it goes on
        assert [each["seq"] for each in all_of_them] == list(range(1, len(all_of_them) + 1))
        assert all_of_them[0]["kind"] == "run.requested.v1"
        assert all_of_them[-1]["kind"] == "run.ended.v1"
        assert events(client, run["id"], 3) == all_of_them[3:]
        assert events(client, run["id"], len(all_of_them)) == []


def test_a_program_whose_connection_breaks_after_every_event_misses_none(
    process: RunnerProcess,
) -> None:
    with process.client() as client:
        run = started(client, order(sequence(actions=2), script={"*": [{"after_s": 0.2}]}))
        path, seen = f"/api/runs/{run['id']}/events", list[int]()
        while True:
            headers = {"last-event-id": str(seen[-1])} if seen else {}
            with client.stream("GET", path, headers=headers) as answer:
                if answer.status_code == 204:
                    break
                ids = (line for line in answer.iter_lines() if line.startswith("id: "))
                seen.append(int(next(ids).removeprefix("id: ")))
        assert seen == [each["seq"] for each in events(client, run["id"])]


def test_a_loop_goes_on_until_it_is_stopped(process: RunnerProcess) -> None:
    with process.client() as client:
        run = started(client, order(carousel(), script={"*": [{"after_s": 0.0}]}))
        with process.live() as socket:
            for text in socket:
                message = json.loads(text)
                if message["type"] == "run" and message["run"]["id"] == run["id"]:
                    action = message["run"]["actions"]["Work_0"]
                    if action["older"] + len(action["visits"]) > 10:
                        break
        client.post(f"/api/runs/{run['id']}/stop")
        assert over(client, run["id"])["state"] == "stopped"


def test_the_end_of_a_graph_is_the_graphs_own_result(process: RunnerProcess) -> None:
    fails = {"*": [{"after_s": 0.02, "result": "on_error", "message": "gripper jammed"}]}
    with process.client() as client:
        graph = sequence(actions=1)
        assert graph.relations[-1].child == EXIT
        run = started(client, order(graph, script=fails))
        done = over(client, run["id"])
        assert done["result"] == "on_error"
        assert done["actions"]["Work_0"]["messages"][0]["text"] == "gripper jammed"
        assert done["actions"]["Work_0"]["visits"][0]["result"] == "error"


def test_the_routes_are_described(process: RunnerProcess) -> None:
    with process.client() as client:
        answer = client.get("/schema/openapi.json")
        assert answer.status_code == 200, answer.text
        paths = answer.json()["paths"]
        assert "post" in paths["/api/runs"]
        assert "requestBody" in paths["/api/runs"]["post"]
        visit = answer.json()["components"]["schemas"]["VisitShown"]["properties"]
        assert "from" in visit


def test_health_and_measures(process: RunnerProcess) -> None:
    with process.client() as client:
        assert client.get("/readyz").json()["ready"] is True
        assert "action_assistant_runs_open" in client.get("/metrics").text


def test_a_date_that_no_calendar_holds_is_refused_and_robots_stay_listed(
    process: RunnerProcess,
) -> None:
    with process.client() as client:
        client.post("/api/robots", json={"name": "Dated", "domain": 186})
        for until in ("0001-01-01T00:00:00+14:00", "9999-12-31T23:59:59-14:00"):
            wanted = {"operators": [{"id": "ann", "until": until}]}
            refused = client.put("/api/robots/Dated/rights", json=wanted)
            assert (refused.status_code, refused.json()["type"]) == (400, "bad-input")
            assert client.get("/api/robots").status_code == 200
        assert client.delete("/api/robots/Dated").status_code == 204
