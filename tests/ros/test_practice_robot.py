"""A robot to practise with, by one press: over rclpy, with the real product."""

import json
from pathlib import Path

import httpx
import psutil
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from support.product import Product, is_alive, running
from support.waiting import until

GRAPH = {
    "graph_name": "one",
    "graph_entry": [{"name": "A"}],
    "graph_exit": [{"name": "A"}],
    "actions": [{"name": "A", "type": "sync"}],
}


def _process_of_robot(product: Product) -> psutil.Process:
    (found,) = [
        each for each in product.process("runner").children() if "simulate-robot" in each.cmdline()
    ]
    return found


def _states(runner: httpx.Client) -> dict[str, str]:
    return {each["name"]: each["state"] for each in runner.get("/api/robots").json()}


@pytest.mark.timeout(240)
def test_a_practice_robot_is_started_once_ends_with_the_runner_and_is_started_again(
    tmp_path: Path,
) -> None:
    (tmp_path / "one.json").write_text(json.dumps(GRAPH))
    with running(tmp_path / "data") as product:
        with product.runner() as runner:
            made = runner.post("/api/practice")
            assert (made.status_code, made.json()["name"]) == (201, "Practice")
            again = runner.post("/api/practice")
            assert (again.status_code, again.json()["type"]) == (409, "conflict")
            until(
                "the robot did not answer", lambda: _states(runner).get("Practice") == "answering"
            )
        graph = product.cli("import", str(tmp_path / "one.json")).stdout.split()[0]
        ran = product.cli("run", graph, "--engine", "Practice")
        assert ran.returncode == 0, ran.stderr
        (run,) = json.loads(product.cli("runs", "--json").stdout)
        log = product.cli("runs", "log", run["id"], "--level", "info")
        assert "info           Received request to start UMRF graph: one" in log.stdout
        assert product.cli("runs", "log", run["id"], "--level", "error").stdout == ""
        robot = _process_of_robot(product)
        product.kill()
        until("the process of the robot did not end", lambda: not is_alive(robot))
        product.start()
        with product.runner() as runner:
            until("its absence was not seen", lambda: _states(runner).get("Practice") == "gone")
            registered = runner.get("/api/robots/Practice").json()
            again = runner.post("/api/practice")
            assert (again.status_code, again.json()["domain"]) == (201, registered["domain"])
            until(
                "the robot did not answer again",
                lambda: _states(runner).get("Practice") == "answering",
            )
            third = runner.post("/api/practice")
            assert (third.status_code, third.json()["type"]) == (409, "conflict")
