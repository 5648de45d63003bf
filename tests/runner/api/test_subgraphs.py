"""Graphs inside of a run, over HTTP: started, shown, expected again."""

import msgspec

from action_assistant.umrf.files import codec
from runner.api.test_api import FAST, changed, problem
from runner.harness import sequence
from runner.process import RunnerProcess, body, over, started
from runner.start.test_subgraph_starts import sent, start


def test_a_run_shows_what_happens_inside_and_what_was_sent(process: RunnerProcess) -> None:
    asked = start(sent(sequence("round", 2)), script=FAST)
    with process.client() as client:
        run = over(client, started(client, asked)["id"])
        assert (run["state"], run["result"]) == ("finished", "on_true")
        assert {"round_0", "tour__round__0/Work_0", "tour__round__0/Work_1"} == set(run["actions"])
        (inner,) = run["subgraphs"]
        assert (inner["name"], inner["version"], inner["graph"]) == ("round", "v2", "g2")
        assert inner["umrf"]["graph_name"] == "round"
        assert run["tree_digest"] == asked.tree_digest
        plain = over(
            client,
            started(client, changed(asked, subgraphs=(), tree_digest=None, request_id="plain"))[
                "id"
            ],
        )
        assert (plain["subgraphs"], plain["tree_digest"]) == ([], None)
        assert set(plain["actions"]) == {"round_0"}
        lines = client.get(f"/api/runs/{run['id']}/export", params={"format": "jsonl"})
        assert lines.status_code == 200
        assert asked.tree_digest in lines.text


def test_another_graph_inside_starts_nothing(process: RunnerProcess) -> None:
    asked = start(sent(sequence("round", 2)))
    other = msgspec.Raw(codec.write(sequence("round", 3)).encode())
    altered = changed(asked.subgraphs[0], umrf=other)
    with process.client() as client:
        before = len(client.get("/api/runs").json())
        answer = client.post("/api/runs", content=body(changed(asked, subgraphs=(altered,))))
        assert problem(answer, 409)["where"]["path"] == "/subgraphs/0/digest"
        lacking = client.post("/api/runs", content=body(changed(asked, subgraphs=())))
        assert problem(lacking, 409)["where"]["path"] == "/tree_digest"
        assert len(client.get("/api/runs").json()) == before


def test_an_expected_course_goes_on_inside(process: RunnerProcess) -> None:
    inner = sequence("round", 2)
    asked = start(sent(inner), script=FAST, graph="inside")
    with process.client() as client:
        run = over(client, started(client, asked)["id"])
        saved = client.post("/api/expectations", json={"name": "inside", "run": run["id"]})
        assert saved.status_code == 201, saved.text
        graphs = {step["graph"] for step in saved.json()["course"]}
        assert "tour__round__0" in graphs
        umrf = msgspec.json.decode(asked.umrf)
        check = {"graph": "inside", "umrf": umrf}
        (same,) = client.post("/api/expectations/check", json=check).json()["courses"]
        assert same["same"] is True
        longer = [{"name": "round", "umrf": codec.write(sequence("round", 3))}]
        (other,) = client.post(
            "/api/expectations/check", json=check | {"subgraphs": longer}
        ).json()["courses"]
        assert (other["same"], "Work_" in other["why"]) == (False, True)
        client.delete("/api/expectations/inside")
