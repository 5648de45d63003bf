"""`doctor` on robots and ROS 2 environments that are broken for real."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from ros.test_ros2_link import engine
from support.product import running


def doctor(data: Path, domain: int, **more: str) -> tuple[int, dict[str, dict[str, Any]]]:
    """The exit code, and one finding of each topic: what is wrong before anything else."""
    command = [sys.executable, "-m", "action_assistant", "doctor", "--only", "ros", "--json"]
    answer = subprocess.run(
        [*command, "--data", str(data)],
        env={**os.environ, "ROS_DOMAIN_ID": str(domain), **more},
        capture_output=True,
        check=False,
        timeout=60,
    )
    found = sorted(json.loads(answer.stdout), key=lambda each: bool(each["verdict"] == "wrong"))
    return answer.returncode, {each["topic"]: each for each in found}


def registered(folder: Path, robots: list[dict[str, object]]) -> Path:
    """A data folder in whose registry these robots are."""
    with running(folder / "data") as product, product.runner() as runner:
        assert runner.get("/api/reach").json()["no_reach"] == "", "serve has found this Python"
        for each in robots:
            runner.post("/api/robots", json=each).raise_for_status()
        return product.data


def test_what_is_wrong_with_each_robot_is_told_apart(tmp_path: Path, domains: list[int]) -> None:
    one, two, three, four = domains
    robots: list[dict[str, object]] = [
        {"name": "sound", "domain": one, "get_service": "/sound/umrf_graph_get"},
        {"name": "elsewhere", "domain": one},
        {"name": "twin", "domain": two},
        {"name": "deaf", "domain": three},
        {"name": "frozen", "domain": four},
        {"name": "foreign", "domain": one, "rmw": "rmw_cyclonedds_cpp"},
    ]
    data = registered(tmp_path, robots)
    with (
        engine(one, namespace="sound"),
        engine(one, namespace="stranger"),
        engine(two),
        engine(two),
        engine(three, deaf=True),
        engine(four) as frozen,
    ):
        frozen.holding.set()
        code, found = doctor(data, one)
    assert code == 1
    assert (found["sound"]["verdict"], found["deaf"]["verdict"]) == ("fine", "wrong")
    assert "Engines answer on /sound/umrf_graph_get, /stranger" in found["elsewhere"]["what"]
    assert "2 engines answer" in found["twin"]["what"]
    assert found["deaf"]["what"] == "It answers, but nobody listens to start and stop."
    assert found["frozen"]["what"] == "It is there, but does not answer."
    assert "RMW_IMPLEMENTATION" in found["foreign"]["what"]
    assert "2 engines answer" in found["engines"]["what"]


@pytest.mark.parametrize(
    ("setting", "value", "said"),
    [
        ("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp", "RMW_IMPLEMENTATION is 'rmw_cyclonedds_cpp'"),
        ("ROS_DOMAIN_ID", "lab", "ROS_DOMAIN_ID is 'lab'"),
    ],
)
def test_a_setting_that_cannot_be_is_named(
    tmp_path: Path, setting: str, value: str, said: str
) -> None:
    _, found = doctor(tmp_path, 1, **{setting: value})
    assert found["rclpy"]["what"].startswith(said)
