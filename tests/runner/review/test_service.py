"""Stored runs can be found, marked, summed up, exported and expected again: over HTTP."""

import csv
import io
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import msgspec
import pytest
from mcap.reader import make_reader

from action_assistant.cli import main
from action_assistant.umrf.files import codec
from action_assistant.umrf.semantics import script_from
from runner.harness import order, sequence
from runner.process import RunnerProcess, over, started

GOOD = {"*": [{"after_s": 0.02}]}
BAD = {"Work_1": [{"after_s": 0.02, "result": "on_error", "message": "gripper jammed"}]} | GOOD


@pytest.fixture(scope="module")
def two_runs(shared_process: RunnerProcess) -> list[dict[str, Any]]:
    """One that went well and one that did not, both over."""
    with shared_process.client() as client:
        runs = [
            started(client, order(sequence("reviewed"), graph="reviewed", script=script))
            for script in (GOOD, BAD)
        ]
        done = [over(client, run["id"]) for run in runs]
        eventually(lambda: found(client, text="gripper jammed", graph="reviewed"))
        return done


def eventually(look: Callable[[], Any], patience: float = 20) -> Any:
    deadline = time.monotonic() + patience
    while not (seen := look()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return seen


def found(client: httpx.Client, **query: Any) -> list[str]:
    answer = client.get("/api/runs", params=query)
    assert answer.status_code == 200, answer.text
    return [run["id"] for run in answer.json()]


def test_runs_are_found_by_what_was_said_in_them(
    process: RunnerProcess, two_runs: list[dict[str, Any]]
) -> None:
    good, bad = (run["id"] for run in two_runs)
    with process.client() as client:
        assert found(client, text="GRIPPER", graph="reviewed") == [bad]
        assert found(client, text="100%", graph="reviewed") == []
        assert found(client, text="work_1", graph="reviewed") == [bad, good]
        assert found(client, graph="reviewed", state="finished,error,halted") == [bad, good]
        assert found(client, graph="reviewed", person="nobody") == []
        assert found(client, graph="reviewed", version=two_runs[0]["digest"][:12]) == [bad, good]
        assert found(client, graph="reviewed", since="2999-01-01T00:00:00Z") == []
        assert client.get("/api/runs", params={"state": "merry"}).status_code == 400


def test_pins_notes_and_labels_stay_and_can_be_filtered_by(
    process: RunnerProcess, two_runs: list[dict[str, Any]]
) -> None:
    good = two_runs[0]["id"]
    with process.client() as client:
        path = f"/api/runs/{good}/marks"
        assert client.patch(path, json={"pinned": True, "labels": ["demo", "lab 2"]}).json() == {
            "pinned": True,
            "note": "",
            "labels": ["demo", "lab 2"],
        }
        client.patch(path, json={"note": "the one for the fair"})
        assert found(client, label="demo", graph="reviewed") == [good]
        assert found(client, pinned=True, graph="reviewed") == [good]
        assert found(client, text="for the fair", graph="reviewed") == [good]
        (listed,) = client.get("/api/runs", params={"label": "lab 2"}).json()
        assert (listed["pinned"], listed["note"]) == (True, "the one for the fair")
        assert "demo" in client.get("/api/labels").json()
        client.patch(path, json={"pinned": False, "labels": []})
        assert found(client, label="demo") == []
        assert client.get(path).json()["note"] == "the one for the fair"
        assert client.patch("/api/runs/nowhere/marks", json={"pinned": True}).status_code == 404
        assert client.patch(path, json={"labels": [" padded"]}).status_code == 400


def test_statistics_tell_how_often_and_how_long(
    process: RunnerProcess, two_runs: list[dict[str, Any]]
) -> None:
    with process.client() as client:
        told = client.get("/api/statistics", params={"graph": "reviewed"}).json()
        assert (told["judged"], told["succeeded"]) == (2, 2)  # its graph goes on after the error
        action = next(each for each in told["actions"] if each["action"] == "Work_1")
        assert action["results"] == {"true": 1, "error": 1}
        assert action["timed"] == 2
        assert action["p50"] <= action["p99"] <= action["longest"]
        assert client.get("/api/statistics", params={"graph": "none"}).json()["runs"] == []


def test_two_runs_are_compared_over_http(
    process: RunnerProcess, two_runs: list[dict[str, Any]]
) -> None:
    good, bad = (run["id"] for run in two_runs)
    with process.client() as client:
        answer = client.get("/api/comparison", params={"a": good, "b": bad}).json()
        assert answer["parting"]["step"]["action"] == "Work_1"
        assert answer["parting"]["messages_b"] == ["gripper jammed"]


def test_a_run_can_be_handed_over_in_three_forms(
    process: RunnerProcess, two_runs: list[dict[str, Any]]
) -> None:
    run = two_runs[1]["id"]
    with process.client() as client:
        files = {
            form: client.get(f"/api/runs/{run}/export", params={"format": form})
            for form in ("jsonl", "csv", "mcap")
        }
        assert all(each.status_code == 200 for each in files.values())
        events = [json.loads(line) for line in files["jsonl"].text.splitlines()]
        assert [event["seq"] for event in events] == list(range(1, len(events) + 1))
        assert events[0]["kind"] == "run.requested.v1"
        rows = list(csv.DictReader(io.StringIO(files["csv"].text)))
        assert [row["action"] for row in rows[:2]] == ["Work_0", "Work_1"]
        assert rows[1]["result"] == "error"
        reader = make_reader(io.BytesIO(files["mcap"].content))
        heard = [
            (channel.topic, json.loads(message.data))
            for _, channel, message in reader.iter_messages()
        ]
        assert ("/log", "gripper jammed") in [(t, b.get("message")) for t, b in heard]
        assert "/actions/reviewed/Work_1" in {topic for topic, _ in heard}
        assert client.get(f"/api/runs/{run}/export", params={"format": "xls"}).status_code == 400


def test_a_run_becomes_a_script_that_repeats_it(
    process: RunnerProcess, two_runs: list[dict[str, Any]]
) -> None:
    bad = two_runs[1]
    with process.client() as client:
        recorded = client.get(f"/api/runs/{bad['id']}/script").json()
        script_from({"behaviours": recorded["behaviours"]})  # the simulator takes it
        again = started(
            client,
            order(sequence("reviewed"), graph="again", script=recorded["behaviours"]),
        )
        done = over(client, again["id"])
        assert done["actions"]["Work_1"]["visits"][0]["result"] == "error"
        assert done["actions"]["Work_1"]["messages"][0]["text"] == "gripper jammed"
        hang = {"action": "Work_0", "fault": "hang"}
        faulty = client.get(f"/api/runs/{bad['id']}/script", params=hang).json()
        assert faulty["behaviours"]["Work_0"] == [{"never": True, "ignores_stop": True}]


def test_a_run_is_saved_as_what_is_expected_and_can_be_retired(
    process: RunnerProcess, two_runs: list[dict[str, Any]]
) -> None:
    good = two_runs[0]["id"]
    with process.client() as client:
        saved = client.post("/api/expectations", json={"run": good, "name": "reviewed goes well"})
        assert saved.status_code == 201, saved.text
        (listed,) = client.get("/api/expectations").json()
        assert listed == saved.json()
        assert codec.read(json.dumps(listed["umrf"]).encode()).graph.name == "reviewed"
        assert {"graph": "reviewed", "node": "", "what": "ends", "how": "on_true"} in listed[
            "course"
        ]
        assert client.delete("/api/expectations/reviewed goes well").status_code == 204
        assert client.get("/api/expectations").json() == []
        assert client.delete("/api/expectations/reviewed goes well").status_code == 404


def kept_run(process: RunnerProcess) -> dict[str, Any]:
    """A run with a note, summed up."""
    with process.client() as client:
        run = over(client, started(client, order(sequence("kept"), graph="kept", script=BAD))["id"])
        client.patch(f"/api/runs/{run['id']}/marks", json={"note": "look here"})
        eventually(lambda: found(client, text="gripper"))
    return run


def moved_archive(process: RunnerProcess) -> Path:
    """The only file of the archive, taken out of it."""
    (file,) = (process.data / "archive").glob("runs/*/*.gz")
    return file.rename(process.data / file.name)


def comes_back(process: RunnerProcess, run: str, moved: Path) -> None:
    """A run whose archive is gone says so, and is there again when the file is."""
    process.start()
    with process.client() as client:
        gone = client.get(f"/api/runs/{run}")
        assert (gone.status_code, gone.json()["title"]) == (
            410,
            "The run is in an archive that is not here",
        )
        assert client.get("/api/statistics", params={"graph": "kept"}).json()["judged"] == 1
        assert main(["runs", "restore", str(moved), "--data", str(process.data)]) == 0
        assert client.get(f"/api/runs/{run}").status_code == 200
    assert main(["runs", "archive", "--check", "--data", str(process.data)]) == 0
    assert main(["runs", "restore", str(process.data / "runner.db")]) == 1


def test_sums_marks_and_archives_are_the_same_after_restarts(
    own_process: RunnerProcess,
) -> None:
    run = kept_run(own_process)
    own_process.kill()
    own_process.start()
    with own_process.client() as client:
        assert found(client, text="look here") == [run["id"]]
        assert found(client, text="gripper") == [run["id"]]
        whole = client.get(f"/api/runs/{run['id']}").json()
        assert msgspec.json.encode(whole["actions"]) == msgspec.json.encode(run["actions"])
        replay = client.get(f"/api/runs/{run['id']}/film").json()
        assert replay["frames"][-1]["head"]["state"] == run["state"]
        assert whole["archived"] is None
        export = client.get(f"/api/runs/{run['id']}/export", params={"format": "jsonl"}).text
        assert client.post("/api/archive", json={"runs": 1}).json()["runs"] == 0
        swept = client.post("/api/archive", json={"runs": 0}).json()
        assert (swept["runs"], swept["problems"]) == (1, [])
        assert client.get("/api/runs").json()[0]["archived"]["file"].startswith("runs/")
        after = client.get(f"/api/runs/{run['id']}").json()
        assert after.pop("archived") is not None
        assert after == {name: value for name, value in whole.items() if name != "archived"}
        assert client.get(f"/api/runs/{run['id']}/film").json() == replay
        path = f"/api/runs/{run['id']}/export"
        assert client.get(path, params={"format": "jsonl"}).text == export
        raw = client.get(f"/api/runs/{run['id']}/raw").json()
        assert (raw["hours"], raw["text"]) == ([], "A simulated engine sends no messages.")
        moved = moved_archive(own_process)
    own_process.end()
    comes_back(own_process, run["id"], moved)
    own_process.end()
    assert main(["verify", "--data", str(own_process.data)]) == 0
