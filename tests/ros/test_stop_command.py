"""Stop on the command line with a robot that does not obey: over rclpy, with the real product."""

import json
import signal
import time
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from ros.robots import RobotProcess, started_by_others
from support.product import Product, running

STUBBORN: dict[str, Any] = {"*": [{"never": True, "ignores_stop": True}]}
GRAPH = {
    "graph_name": "pair",
    "graph_entry": [{"name": "A"}],
    "graph_exit": [{"name": "A"}],
    "actions": [{"name": "A", "type": "sync"}],
}


def _answering(product: Product) -> None:
    with product.runner() as runner:
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            robots = {each["name"]: each for each in runner.get("/api/robots").json()}
            if robots.get("David", {}).get("state") == "answering":
                return
            time.sleep(0.1)
    raise AssertionError(robots)


@pytest.mark.timeout(240)
def test_stop_says_unconfirmed_and_exits_1_until_somebody_has_looked(
    domain: int, tmp_path: Path
) -> None:
    david = RobotProcess(domain, tmp_path, STUBBORN)
    (tmp_path / "pair.json").write_text(json.dumps(GRAPH))
    try:
        with running(tmp_path / "data") as product:
            with product.runner() as runner:
                runner.post("/api/robots", json={"name": "David", "domain": domain})
            _answering(product)
            graph = product.cli("import", str(tmp_path / "pair.json")).stdout.split()[0]
            run = product.cli("run", graph, "--engine", "David", "--no-wait").stdout.strip()
            told = product.cli("stop", run)
            assert (told.returncode, told.stdout) == (1, "")
            assert "STOP UNCONFIRMED" in told.stderr
            assert "A_0 did not obey within 5 s" in told.stderr

            product.kill()
            product.start()
            _answering(product)
            again = product.cli("run", graph, "--engine", "David", "--no-wait")
            assert again.returncode == 1
            assert "Somebody has to see it at rest" in again.stderr
            assert product.cli("stop", "--all").returncode == 1

            looked = product.cli("runs", "at-rest", run, "--how", "I stand beside it.")
            assert (looked.returncode, looked.stdout) == (0, "run 1 of pair is over: error\n")
            assert product.cli("stop", "--all").returncode == 0
    finally:
        david.end()


@pytest.mark.timeout(240)
def test_stop_exits_1_while_an_action_may_be_loading_and_0_once_it_has_run(
    domain: int, tmp_path: Path
) -> None:
    david = RobotProcess(domain, tmp_path, {"*": [{"load_s": 15.0, "after_s": 0.5}]})
    (tmp_path / "pair.json").write_text(json.dumps(GRAPH))
    try:
        with running(tmp_path / "data") as product, product.runner() as runner:
            runner.post("/api/robots", json={"name": "David", "domain": domain})
            _answering(product)
            graph = product.cli("import", str(tmp_path / "pair.json")).stdout.split()[0]
            run = product.cli("run", graph, "--engine", "David", "--no-wait").stdout.strip()
            told = product.cli("stop", run)
            assert (told.returncode, told.stdout) == (1, "")
            assert "STOP UNCONFIRMED for run 1 of pair" in told.stderr
            assert (
                "A is still loading; it can begin to move the robot as soon as it has loaded"
                in told.stderr
            )
            assert runner.get(f"/api/runs/{run}").json()["proof_at"] is None
            deadline = time.monotonic() + 60
            while (told := product.cli("stop", run)).returncode == 1:
                assert time.monotonic() < deadline, told
            ended = runner.get(f"/api/runs/{run}").json()
            assert (ended["state"], ended["actions"]["A_0"]["state"]) == ("stopped", "FINISHED")
            assert ended["proof_at"] is not None
    finally:
        david.end()


def _moving(product: Product) -> None:
    """Wait until the runner shows that the graph of others moves."""
    with product.runner() as runner:
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            robots = runner.get("/api/robots").json()
            if any(held["active"] for robot in robots for held in robot["holds"]):
                return
            time.sleep(0.1)
    raise AssertionError("nothing moves")


@pytest.mark.timeout(240)
@pytest.mark.parametrize(
    ("script", "code", "said"),
    [
        ({"*": [{"never": True}]}, 0, "stopped\n"),
        (STUBBORN, 1, "STOP UNCONFIRMED for pair on David: "),
    ],
)
def test_stop_all_waits_for_proof_of_what_others_started_too(
    domain: int, tmp_path: Path, script: dict[str, Any], code: int, said: str
) -> None:
    david = RobotProcess(domain, tmp_path, script)
    try:
        with running(tmp_path / "data") as product:
            with product.runner() as runner:
                runner.post("/api/robots", json={"name": "David", "domain": domain})
            _answering(product)
            with started_by_others(domain, GRAPH):
                _moving(product)
                told = product.cli("stop", "--all", "--wait", "10")
                assert told.returncode == code, told
                assert said in told.stdout + told.stderr
    finally:
        david.end()


@pytest.mark.timeout(240)
def test_a_robot_that_does_not_answer_proves_nothing(domain: int, tmp_path: Path) -> None:
    david = RobotProcess(domain, tmp_path, {})
    try:
        with running(tmp_path / "data") as product:
            with product.runner() as runner:
                runner.post("/api/robots", json={"name": "David", "domain": domain})
            _answering(product)
            assert product.cli("stop", "--all").stdout == "nothing was running\n"
            david.signal(signal.SIGSTOP)
            deadline = time.monotonic() + 30
            while (told := product.cli("stop", "--all")).returncode == 0:
                assert time.monotonic() < deadline, told
            assert "NOT KNOWN what David runs: " in told.stderr
            david.signal(signal.SIGCONT)
    finally:
        david.end()
