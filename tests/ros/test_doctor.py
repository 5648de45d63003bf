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
    """The exit code, and the last finding of each topic."""
    command = [sys.executable, "-m", "action_assistant", "doctor", "--only", "ros", "--json"]
    answer = subprocess.run(
        [*command, "--data", str(data)],
        env={**os.environ, "ROS_DOMAIN_ID": str(domain), **more},
        capture_output=True,
        check=False,
        timeout=60,
    )
    return answer.returncode, {each["topic"]: each for each in json.loads(answer.stdout)}


@pytest.fixture
def registered(tmp_path: Path, domain: int) -> Path:
    """A data folder in which robot `ada` is registered."""
    with running(tmp_path / "data") as product, product.runner() as runner:
        ada = {"name": "ada", "domain": domain}
        runner.post("/api/robots", json=ada).raise_for_status()
        assert runner.get("/api/reach").json()["no_reach"] == ""
        return product.data


def test_what_it_says_of_a_robot_follows_the_robot(registered: Path, domain: int) -> None:
    code, found = doctor(registered, domain)
    assert (code, found["ada"]["verdict"]) == (1, "wrong")
    assert "Nobody answers on umrf_graph_get" in found["ada"]["what"]

    with engine(domain):
        code, found = doctor(registered, domain)
        assert (code, found["ada"]["verdict"]) == (0, "fine"), found
        with engine(domain):
            code, found = doctor(registered, domain)
            assert code == 1
            assert "2 engines answer" in found["ada"]["what"]
            assert "2 engines answer" in found["engines"]["what"]

    with engine(domain, deaf=True):
        code, found = doctor(registered, domain)
        assert (code, found["ada"]["what"]) == (
            1,
            "It answers, but nobody listens to start and stop.",
        )

    with engine(domain) as frozen:
        frozen.holding.set()
        code, found = doctor(registered, domain)
        assert code == 1
        assert "another middleware" in found["ada"]["advice"]

    with engine(domain, namespace="r1"):
        code, found = doctor(registered, domain)
        assert code == 1
        assert "/r1/umrf_graph_get" in found["ada"]["what"]
        assert "is not registered" in found["engines"]["what"]


def test_a_middleware_that_is_not_installed_is_named(registered: Path, domain: int) -> None:
    code, found = doctor(registered, domain, RMW_IMPLEMENTATION="rmw_cyclonedds_cpp")
    assert code == 1
    assert found["rclpy"]["what"].startswith("RMW_IMPLEMENTATION is 'rmw_cyclonedds_cpp'")


def test_a_domain_that_is_no_number_is_named(registered: Path) -> None:
    code, found = doctor(registered, 0, ROS_DOMAIN_ID="lab")
    assert code == 1
    assert found["rclpy"]["what"].startswith("ROS_DOMAIN_ID is 'lab'")
