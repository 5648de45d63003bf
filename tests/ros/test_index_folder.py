"""A robot lacks a graph inside of a task, is written it by the runner, indexes it, and runs it; over real rclpy."""

import json
from pathlib import Path
from typing import Any

import httpx
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.umrf.files import codec
from ros.robots import RobotProcess
from runner.harness import sequence
from support.product import running
from support.real_engine import answers, browser
from support.waiting import until

OUTER = json.loads(codec.write(sequence("tour", 1)).replace('"Work"', '"leg"'))
LEG = json.loads(codec.write(sequence("leg", 2)))
OTHER = codec.write(sequence("leg", 3))
SCRIPT = {"*": [{"after_s": 0.1}]}

pytestmark = pytest.mark.timeout(180)


def order_of(editor: httpx.Client, graph: str) -> dict[str, Any]:
    version = editor.post(f"/api/graphs/{graph}/versions", json={}).json()
    parts = {key: version[key] for key in ("digest", "umrf", "tree_digest")}
    parts["subgraphs"] = [
        {key: each[key] for key in ("name", "digest", "umrf")} for each in version["subgraphs"]
    ]
    return {"version": version["id"], "graph": graph, **parts}


def looked(runner: httpx.Client, order: dict[str, Any]) -> dict[str, Any]:
    (look,) = runner.post("/api/preflight", json=order | {"engines": ["David"]}).json()
    found: dict[str, Any] = {each["code"]: each for each in look["items"]}
    return found


def state(runner: httpx.Client, order: dict[str, Any]) -> str:
    """Return the verdict on the robot's inner graphs; "" while the robot does not answer."""
    verdict: str = looked(runner, order).get("subgraphs", {}).get("verdict", "")
    return verdict


def ran(runner: httpx.Client, order: dict[str, Any], request: str) -> dict[str, Any]:
    start = order | {"engine": "David", "request_id": request}
    answer = runner.post("/api/runs", json=start)
    assert answer.status_code == 201, answer.text
    path = f"/api/runs/{answer.json()['id']}"
    until("it has ended", lambda: runner.get(path).json()["ended_at"] is not None)
    run: dict[str, Any] = runner.get(path).json()
    return run


def gives_it_back(
    ada: httpx.Client, order: dict[str, Any], wish: dict[str, Any], path: Path
) -> None:
    """Give the robot another graph of that name, then write the version's graph in its place
    again."""
    path.write_text(OTHER)
    until("David has indexed that", lambda: state(ada, order) == "blocked")
    assert looked(ada, order)["subgraphs"]["codes"] == ["subgraph-differs"]
    assert ada.post("/api/robots/David/index", json=wish).status_code == 409
    answer = ada.post("/api/robots/David/index", json=wish | {"replace": ["leg"]})
    (replaced,) = answer.json()["replaced"]
    assert (path.parent / replaced["kept"]).read_text() == OTHER
    until("David has indexed it again", lambda: state(ada, order) == "passed")
    kinds = [each["kind"] for each in ada.get("/api/robots/David/events").json()]
    assert kinds.count("index_written") == 2


def test_a_graph_that_a_robot_lacks_is_written_indexed_and_run_inside(
    domain: int, tmp_path: Path
) -> None:
    index = tmp_path / "index"
    action = index / "work" / "work.umrf.json"
    action.parent.mkdir(parents=True)
    action.write_text(json.dumps({"name": "Work", "type": "sync", "instance_id": 0}))
    robot = RobotProcess(domain, tmp_path, SCRIPT, "--actions", str(index), "--quirk", "loss=0")
    try:
        with (
            running(tmp_path / "data", "--index-folder", f"David={index}") as product,
            browser(product, "Ada") as ada,
        ):
            with product.editor() as editor:
                editor.post("/api/graphs", json=LEG)
                order = order_of(editor, editor.post("/api/graphs", json=OUTER).json()["id"])
            assert ada.post("/api/robots", json={"name": "David", "domain": domain}).is_success
            until("David answers", lambda: answers(ada, "David"))
            item = looked(ada, order)["subgraphs"]
            assert (item["verdict"], item["folder"]["path"]) == ("blocked", str(index))
            assert item["folder"]["writable"] == [{"graph": "leg", "replaces": ""}]
            start = order | {"engine": "David", "request_id": "too soon"}
            assert ada.post("/api/runs", json=start).status_code == 409

            wish = {key: order[key] for key in ("digest", "tree_digest", "subgraphs")}
            answer = ada.post("/api/robots/David/index", json=wish)
            assert answer.is_success, answer.text
            (file,) = answer.json()["written"]
            until("David has indexed it", lambda: state(ada, order) == "passed")
            run = ran(ada, order, "nested")
            assert run["state"] == "finished"
            inside = {name for name in run["actions"] if name.startswith("tour__leg__0/")}
            assert inside == {"tour__leg__0/Work_0", "tour__leg__0/Work_1"}

            gives_it_back(ada, order, wish, index / file["path"])
    finally:
        robot.end()


@pytest.mark.long
def test_an_engine_that_looks_only_at_its_start_goes_on_lacking_it(
    domain: int, tmp_path: Path
) -> None:
    index = tmp_path / "index"
    index.mkdir()
    (index / "work.umrf.json").write_text('{"name": "Work", "type": "sync", "instance_id": 0}')
    flags = ("--actions", str(index), "--indexing-rate", "0", "--quirk", "loss=0")
    robot = RobotProcess(domain, tmp_path, SCRIPT, *flags)
    try:
        with (
            running(tmp_path / "data", "--index-folder", f"David={index}") as product,
            browser(product, "Ada") as ada,
        ):
            with product.editor() as editor:
                editor.post("/api/graphs", json=LEG)
                order = order_of(editor, editor.post("/api/graphs", json=OUTER).json()["id"])
            assert ada.post("/api/robots", json={"name": "David", "domain": domain}).is_success
            until("David answers", lambda: answers(ada, "David"))
            wish = {key: order[key] for key in ("digest", "tree_digest", "subgraphs")}
            assert ada.post("/api/robots/David/index", json=wish).is_success
            for _ in range(3):
                item = looked(ada, order)["subgraphs"]
                assert item["verdict"] == "blocked"
                assert item["folder"]["waiting"] == ["leg"]
            robot.end()
            robot = RobotProcess(domain, tmp_path, SCRIPT, *flags)
            until("David answers again", lambda: state(ada, order) == "passed")
    finally:
        robot.end()
