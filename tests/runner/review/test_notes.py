"""Notes at moments of a run: added, listed, found, exported, and the same after a restart."""

import json
from datetime import datetime, timedelta
from typing import Any

import httpx
import pytest

from runner.harness import order, sequence
from runner.process import RunnerProcess, over, started

FAST = {"*": [{"after_s": 0.05}]}


def ran(client: httpx.Client) -> dict[str, Any]:
    run = started(client, order(sequence("noted"), graph="noted", script=FAST))
    return over(client, run["id"])


def write(client: httpx.Client, run: str, text: str, moment: str | None = None) -> httpx.Response:
    body = {"text": text} | ({"moment": moment} if moment else {})
    return client.post(f"/api/runs/{run}/notes", json=body)


def test_notes_stand_at_their_moments_with_their_author_in_search_and_export(
    own_process: RunnerProcess,
) -> None:
    with own_process.client() as client:
        run = ran(client)
        path = f"/api/runs/{run['id']}/notes"
        assert client.get(path).json() == []
        assert write(client, run["id"], "the end looked odd").status_code == 201
        noted = write(client, run["id"], "  gripper squeaked ", run["started_at"]).json()
        assert [each["text"] for each in noted] == ["gripper squeaked", "the end looked odd"]
        assert [each["moment"] for each in noted] == [run["started_at"], run["ended_at"]]
        assert all(each["author"]["id"] and each["at"] >= run["ended_at"] for each in noted)
    own_process.kill()
    own_process.start()
    with own_process.client() as client:
        assert client.get(path).json() == noted
        for words in ("SQUEAKED", "looked odd"):
            listed = client.get("/api/runs", params={"text": words}).json()
            assert [each["id"] for each in listed] == [run["id"]]
        assert client.get("/api/runs", params={"text": "squeaked not"}).json() == []
        form = {"format": "jsonl"}
        lines = client.get(f"/api/runs/{run['id']}/export", params=form).text.splitlines()
        kinds = [json.loads(line)["kind"] for line in lines]
        assert kinds[-2:] == ["run.noted.v1"] * 2
        body = json.loads(lines[-1])["body"]
        assert body["text"] == "gripper squeaked"
        assert client.get(f"/api/runs/{run['id']}").json()["ended_at"] == run["ended_at"]


def test_a_note_that_is_sent_again_with_its_request_id_is_stored_once(
    own_process: RunnerProcess,
) -> None:
    def send(client: httpx.Client, text: str, request: str) -> httpx.Response:
        return client.post(path, json={"text": text, "request_id": request})

    with own_process.client() as client:
        path = f"/api/runs/{ran(client)['id']}/notes"
        noted = send(client, "it squeaked", "one").json()
        assert send(client, " it squeaked", "one").json() == noted
        refused = send(client, "it did not squeak", "one")
        assert (refused.status_code, refused.json()["where"]) == (409, {"path": "/request_id"})
        assert send(client, "x", "x" * 201).status_code == 400
    own_process.kill()
    own_process.start()
    with own_process.client() as client:
        assert send(client, "it squeaked", "one").json() == noted
        assert len(send(client, "it squeaked", "two").json()) == 2
        assert len(send(client, "it squeaked", "").json()) == 3
        assert len(send(client, "it squeaked", "").json()) == 4


@pytest.mark.long
def test_a_run_has_a_bounded_number_of_notes(process: RunnerProcess) -> None:
    with process.client() as client:
        path = f"/api/runs/{ran(client)['id']}/notes"
        for number in range(500):
            assert client.post(path, json={"text": f"note {number}"}).status_code == 201
        refused = client.post(path, json={"text": "one more"})
        assert (refused.status_code, refused.json()["detail"]) == (
            409,
            "A run has 500 notes at most.",
        )
        assert len(client.get(path).json()) == 500


def test_a_note_outside_of_the_run_or_without_a_text_is_refused_with_its_place(
    process: RunnerProcess,
) -> None:
    with process.client() as client:
        run = ran(client)
        day = timedelta(days=1)
        for moment in (
            datetime.fromisoformat(run["requested_at"]) - day,
            datetime.fromisoformat(run["ended_at"]) + day,
        ):
            answer = write(client, run["id"], "late", moment.isoformat())
            assert answer.status_code == 400
            assert answer.json()["where"] == {"path": "/moment"}
        for text in ("", "   ", "x" * 2_001):
            assert write(client, run["id"], text).status_code == 400
        assert write(client, "nowhere", "lost").status_code == 404
        assert client.get("/api/runs/nowhere/notes").status_code == 404
        assert client.get(f"/api/runs/{run['id']}/notes").json() == []


def test_a_note_about_a_run_that_goes_on_may_be_a_little_ahead_of_the_runners_clock(
    process: RunnerProcess,
) -> None:
    slow = {"*": [{"after_s": 60}]}
    with process.client() as client:
        run = started(client, order(sequence("slow"), graph="slow", script=slow))
        now = datetime.fromisoformat(run["requested_at"])
        ahead = (now + timedelta(minutes=5)).isoformat()
        (note,) = write(client, run["id"], "it begins", ahead).json()
        assert run["requested_at"] <= note["moment"] < ahead
        client.post(f"/api/runs/{run['id']}/stop")
