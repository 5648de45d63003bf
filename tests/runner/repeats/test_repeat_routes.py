"""Repeats over HTTP: opened, followed in a table, closed and opened again."""

import csv
import io
from typing import Any

import httpx
import msgspec

from runner.harness import order, sequence
from runner.process import RunnerProcess, body
from runner.start.test_start_values import asking
from support.waiting import until

FAST = {"*": [{"after_s": 0.02}]}


def opened(client: httpx.Client, start: Any, **more: Any) -> dict[str, Any]:
    wanted = {"start": msgspec.Raw(body(start)), **more}
    answer = client.post("/api/repeats", content=msgspec.json.encode(wanted))
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = answer.json()
    assert answer.headers["location"] == f"/api/repeats/{found['id']}"
    return found


def closed(client: httpx.Client, repeat: str) -> dict[str, Any]:
    """Wait until nothing of a repeat goes on, and return it."""

    def found() -> dict[str, Any]:
        now: dict[str, Any] = client.get(f"/api/repeats/{repeat}").json()
        return now if now["state"] == "closed" else {}

    return until("the repeat is not closed", found, 60)


def test_a_grid_is_carried_out_and_its_table_has_a_run_for_each_cell(
    process: RunnerProcess,
) -> None:
    with process.client() as client:
        start = order(asking(), graph="grid", script=FAST)
        grid = [
            {"action": "Work_1", "name": "place", "values": ["=valve", "b"]},
            {"action": "Work_1", "name": "torque", "values": [1, 2.5]},
        ]
        repeat = opened(client, start, grid=grid, seed=7, by_itself=True)
        assert repeat["total"] == 4
        done = closed(client, repeat["id"])
        assert (done["closed"]["why"], done["finished"], done["next"]) == ("complete", 4, None)
        for cell in done["cells"]:
            run = cell["run"]
            assert run["repeat"] == {"id": repeat["id"], "cell": cell["cell"]}
            assert run["values"] == cell["values"]
            assert run["digest"] == start.digest
        text = client.get(f"/api/repeats/{repeat['id']}/table").text
        rows = list(csv.DictReader(io.StringIO(text)))
        assert [row["run"] for row in rows] == [each["run"]["id"] for each in done["cells"]]
        assert {row["Work_1.place"] for row in rows} == {"'=valve", "b"}
        assert {row["result"] for row in rows} == {"on_true"}
        parquet = client.get(f"/api/repeats/{repeat['id']}/table", params={"format": "parquet"})
        assert done["parquet"] == (parquet.status_code == 200)
        if done["parquet"]:
            assert parquet.content[:4] == parquet.content[-4:] == b"PAR1"
        else:
            assert (parquet.status_code, "pip install" in parquet.text) == (503, True)
        (listed,) = client.get("/api/repeats", params={"graph": "grid"}).json()
        assert listed["id"] == repeat["id"]


def test_a_person_starts_each_run_closes_a_repeat_and_opens_it_again(
    process: RunnerProcess,
) -> None:
    with process.client() as client:
        repeat = opened(client, order(sequence(), script=FAST), times=2)
        path = f"/api/repeats/{repeat['id']}"
        assert (repeat["state"], repeat["next"]) == ("waiting", 1)
        first = client.post(f"{path}/start", json={"cell": 1})
        assert first.status_code == 201, first.text
        again = client.post(f"{path}/start", json={"cell": 1})
        assert (again.status_code, again.json()["id"]) == (200, first.json()["id"])
        shut = client.post(f"{path}/close").json()
        assert shut["closed"]["why"] == "person"
        closed(client, repeat["id"])
        refused = client.post(f"{path}/start", json={"cell": 2})
        assert refused.status_code == 409
        assert "stopped repeating" in refused.json()["detail"]
        assert client.post(f"{path}/open", json={"closings": 0}).status_code == 409
        opened_again = client.post(f"{path}/open", json={"closings": 1})
        assert opened_again.status_code == 200, opened_again.text
        assert opened_again.json()["state"] == "waiting"
        assert client.post(f"{path}/start", json={"cell": 2}).status_code == 201
        assert closed(client, repeat["id"])["closed"]["why"] == "complete"
        assert client.get("/api/repeats/nothing").status_code == 404
