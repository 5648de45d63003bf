"""The queue over HTTP: put there, shown by the rights of the reader, looked at and started."""

from typing import Any
from urllib.parse import quote

import httpx
import msgspec

from runner.harness import order, sequence
from runner.process import RunnerProcess, body
from support.waiting import until

FAST = {"*": [{"after_s": 0.02}]}


def put(client: httpx.Client, name: str, **more: Any) -> dict[str, Any]:
    """Put a start in the simulator into the queue, and return its entry."""
    start = order(sequence(name), script=FAST)
    wanted = {"start": msgspec.Raw(body(start)), **more}
    answer = client.post("/api/queue", content=msgspec.json.encode(wanted))
    assert answer.status_code == 201, answer.text
    if not more:
        again = client.post("/api/queue", content=msgspec.json.encode(wanted))
        assert again.status_code == 200, again.text
    entries = {each["id"]: each for each in answer.json()["entries"]}
    found: dict[str, Any] = entries[answer.headers["location"].removeprefix("/api/queue/")]
    return found


def test_a_person_looks_and_starts_what_waits_in_its_order(process: RunnerProcess) -> None:
    with process.client() as client:
        first, second = put(client, "first"), put(client, "second")
        assert (first["state"], second["state"]) == ("ready", "waiting")
        assert second["waits"][0]["text"] == "It is behind 1 other for the simulator."
        path = f"/api/queue/{first['id']}"
        assert client.post(f"{path}/start", json={"look": "nothing"}).status_code == 409
        look = client.post(f"{path}/look", json={}).json()
        assert look["differs"] == []
        assert {each["engine"] for each in look["looks"]} == {"simulator"}
        made = client.post(f"{path}/start", json={"look": look["look"]})
        assert made.status_code == 201, made.text
        again = client.post(f"{path}/start", json={"look": look["look"]})
        assert (again.status_code, again.json()["id"]) == (200, made.json()["id"])
        assert [each["id"] for each in client.get("/api/queue").json()["entries"]] == [second["id"]]

        def ready() -> bool:
            queue: dict[str, Any] = client.get("/api/queue").json()
            return queue["entries"][0]["state"] == "ready"

        until("the second one is not ready", ready)
        removed = client.post(f"/api/queue/{second['id']}/remove")
        assert removed.json() == {"entries": [], "robots": []}
        assert client.post(f"/api/queue/{second['id']}/look", json={}).status_code == 404
        assert client.post(f"/api/queue/{second['id']}/start", json={"look": ""}).status_code == 404


def test_what_a_start_without_an_answer_has_become_is_found_in_the_queue(
    process: RunnerProcess,
) -> None:
    """A page that got no answer asks by the request id, also by that of the start at the turn."""
    with process.client() as client:

        def found(request_id: str) -> tuple[Any, list[str]]:
            answer = client.get(f"/api/starts/{quote(request_id, safe='')}").json()
            assert answer["request_id"] == request_id
            return answer["queued"], [each["id"] for each in answer["runs"]]

        start = order(sequence("lost"), script=FAST, request_id="lost in the queue")
        assert found("lost in the queue") == (None, [])
        wanted = msgspec.json.encode({"start": msgspec.Raw(body(start))})
        entry = client.post("/api/queue", content=wanted).json()["entries"][0]["id"]
        assert found("lost in the queue") == ({"entry": entry, "waits": True}, [])
        look = client.post(f"/api/queue/{entry}/look", json={}).json()["look"]
        run = client.post(f"/api/queue/{entry}/start", json={"look": look}).json()["id"]
        assert found("lost in the queue") == ({"entry": entry, "waits": False}, [run])
        assert found(f"queue/{entry}") == (None, [run])
        until("it is not over", lambda: client.get(f"/api/runs/{run}").json()["ended_at"])


def test_a_stop_closes_the_queue_and_a_person_opens_it_again(process: RunnerProcess) -> None:
    with process.client() as client:
        put(client, "first")
        assert client.post("/api/stop").is_success
        queue = client.get("/api/queue").json()
        closed = queue["robots"][0]["closed"]
        assert (closed["why"], queue["entries"][0]["state"]) == ("stop", "closed")
        path = "/api/queue/robots/simulator"
        assert client.post(f"{path}/open", json={"closing": "1"}).status_code == 409
        opened = client.post(f"{path}/open", json={"closing": closed["closing"]})
        assert opened.status_code == 200, opened.text
        assert opened.json()["entries"][0]["state"] == "ready"
        closed = client.post(f"{path}/close").json()["robots"][0]["closed"]
        assert closed["why"] == "person"
        entry = queue["entries"][0]["id"]
        assert client.post(f"/api/queue/{entry}/move", json={"before": "no"}).status_code == 404
        assert client.post(f"/api/queue/{entry}/remove").is_success
        assert client.post("/api/queue/robots/David/close").status_code == 404


def test_what_starts_by_itself_leaves_the_queue_as_a_run(process: RunnerProcess) -> None:
    with process.client() as client:
        put(client, "by itself", by_itself=True)
        until("it does not start", lambda: not client.get("/api/queue").json()["entries"])
        (run,) = client.get("/api/runs", params={"graph": "by itself"}).json()
        assert run["graph_name"] == "by itself"
