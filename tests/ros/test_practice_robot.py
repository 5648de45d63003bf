"""A robot to practise with, by one press: over rclpy, with the real product."""

import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from ros.robots import RobotProcess
from support.product import Product, is_alive, running
from support.waiting import until

GRAPH = {
    "graph_name": "one",
    "graph_entry": [{"name": "A"}],
    "graph_exit": [{"name": "A"}],
    "actions": [{"name": "A", "type": "sync"}],
}


_NAMESPACE = "/action_assistant/practice"
_MARKED = {"name": "Practice", "get_service": f"{_NAMESPACE}/umrf_graph_get"}


@contextmanager
def _robot(domain: int, folder: Path, *more: str) -> Iterator[RobotProcess]:
    """A process of its own that answers to the name, and whose actions never end."""
    robot = RobotProcess(domain, folder, {"*": [{"never": True}]}, *more, name="Practice")
    try:
        yield robot
    finally:
        robot.end()


def _processes(product: Product) -> list[psutil.Process]:
    """Return the processes of practice robots that the runner has started."""
    children = product.process("runner").children()
    return [each for each in children if "simulate-robot" in each.cmdline()]


def _practice(runner: httpx.Client) -> dict[str, Any]:
    found: dict[str, Any] = runner.get("/api/robots/Practice").json()
    return found


def _refused(product: Product, runner: httpx.Client) -> str:
    """Press, and return why no robot was started."""
    answer = runner.post("/api/practice")
    assert answer.status_code == 409, answer.text
    assert not _processes(product)
    detail: str = answer.json()["detail"]
    return detail


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
            until("the robot did not answer", lambda: _practice(runner)["state"] == "answering")
            assert not _practice(runner)["practice_ended"]
        graph = product.cli("import", str(tmp_path / "one.json")).stdout.split()[0]
        ran = product.cli("run", graph, "--engine", "Practice")
        assert ran.returncode == 0, ran.stderr
        (run,) = json.loads(product.cli("runs", "--json").stdout)
        log = product.cli("runs", "log", run["id"], "--level", "info")
        assert "info           Received request to start UMRF graph: one" in log.stdout
        assert product.cli("runs", "log", run["id"], "--level", "error").stdout == ""
        (robot,) = _processes(product)
        product.kill()
        until("the process of the robot did not end", lambda: not is_alive(robot))
        product.start()
        with product.runner() as runner:
            until("its absence was not seen", lambda: _practice(runner)["practice_ended"])
            registered = _practice(runner)
            again = runner.post("/api/practice")
            assert (again.status_code, again.json()["domain"]) == (201, registered["domain"])
            until(
                "the robot did not answer again",
                lambda: _practice(runner)["state"] == "answering",
            )
            third = runner.post("/api/practice")
            assert (third.status_code, third.json()["type"]) == (409, "conflict")


@pytest.mark.timeout(240)
def test_no_emulated_robot_takes_the_place_of_one_that_only_has_its_name(
    tmp_path: Path, domain: int
) -> None:
    with (
        running(tmp_path / "data") as product,
        product.runner() as runner,
        _robot(domain, tmp_path) as robot,
    ):
        runner.post("/api/robots", json={"name": "Practice", "domain": domain}).raise_for_status()
        until("the robot did not answer", lambda: _practice(runner)["state"] == "answering")
        robot.signal(signal.SIGSTOP)
        until("its absence was not seen", lambda: _practice(runner)["state"] == "gone", seconds=60)
        assert "not known to be an emulated one" in _refused(product, runner)
        assert not _practice(runner)["practice_ended"]


@pytest.mark.timeout(300)
def test_a_practice_robot_is_not_started_again_while_it_may_be_there_or_has_a_run(
    tmp_path: Path, domain: int
) -> None:
    (tmp_path / "one.json").write_text(json.dumps(GRAPH))
    with (
        running(tmp_path / "data") as product,
        _robot(domain, tmp_path, "--namespace", _NAMESPACE) as robot,
    ):
        with product.runner() as runner:
            runner.post("/api/robots", json=_MARKED | {"domain": domain}).raise_for_status()
            until("the robot did not answer", lambda: _practice(runner)["state"] == "answering")
        product.kill()
        product.start()
        with product.runner() as runner:
            assert "Nobody knows yet whether Practice is there" in _refused(product, runner)
            until("the robot did not answer", lambda: _practice(runner)["state"] == "answering")
            graph = product.cli("import", str(tmp_path / "one.json")).stdout.split()[0]
            ran = product.cli("run", graph, "--engine", "Practice", "--no-wait")
            assert ran.returncode == 0, ran.stderr
            robot.signal(signal.SIGSTOP)
            until(
                "its absence was not seen", lambda: _practice(runner)["practice_ended"], seconds=60
            )
            assert "Run 1 goes on Practice" in _refused(product, runner)
