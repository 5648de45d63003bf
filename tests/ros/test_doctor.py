"""`doctor` on robots and ROS 2 environments that are broken for real."""

import sqlite3
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from ros.test_ros2_link import engine
from support.doctor import asked
from support.product import running


def doctor(data: Path, domain: int, **more: str) -> tuple[int, dict[str, dict[str, Any]]]:
    """The exit code, and what is wrong by its place."""
    code, found = asked(data, "--only", "ros", ROS_DOMAIN_ID=str(domain), **more)
    return code, {each["where"]: each for each in found}


def registered(folder: Path, robots: list[dict[str, object]]) -> Path:
    """A data folder in whose registry these robots are."""
    with running(folder / "data") as product, product.runner() as runner:
        assert runner.get("/api/reach").json()["no_reach"] == "", "serve has found this Python"
        for each in robots:
            runner.post("/api/robots", json=each).raise_for_status()
        return product.data


def test_the_faults_of_each_robot_are_told_apart(tmp_path: Path, domains: list[int]) -> None:
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
        for _ in range(3):  # on a busy machine it may not have waited for an answer for long enough
            code, found = doctor(data, one)
            if found["frozen"]["message"] != "It has not answered yet.":
                break
    assert code == 1
    assert "sound" not in found
    assert "Engines answer on /sound/umrf_graph_get, /stranger" in found["elsewhere"]["message"]
    assert found["deaf"]["message"] == "It answers, but nobody listens to start and stop."
    assert found["frozen"]["message"] == "It is there, but does not answer."
    assert "RMW_IMPLEMENTATION" in found["foreign"]["message"]
    assert "2 engines answer" in found["twin"]["message"]
    assert {name: each["code"] for name, each in found.items() if not name.startswith("/")} == {
        "elsewhere": "robot-silent",
        "twin": "robot-silent",
        "deaf": "robot-deaf",
        "frozen": "robot-silent",
        "foreign": "robot-middleware",
    }
    others = {each["code"] for name, each in found.items() if name.startswith("/")}
    assert others == {"engine-unregistered"}, "of the twins it is said once, with their robot"


@pytest.mark.long
def test_an_engine_on_another_domain_than_its_robot_is_registered_on_is_named(
    tmp_path: Path, domains: list[int]
) -> None:
    right, wrong, *_ = domains
    data = registered(tmp_path, [{"name": "David", "domain": right}])
    with engine(wrong):
        code, found = doctor(data, wrong)
    assert (code, found["David"]["code"]) == (1, "robot-elsewhere")
    assert f"registered on domain {right}" in found["David"]["message"]
    assert f"one answers on domain {wrong}" in found["David"]["message"]
    assert f"ROS_DOMAIN_ID={right}" in found["David"]["remedy"]
    with engine(right):
        assert doctor(data, right) == (0, {})


@pytest.mark.parametrize(
    ("setting", "value", "code"),
    [
        ("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp", "middleware-broken"),
        pytest.param("ROS_DOMAIN_ID", "lab", "domain-wrong", marks=pytest.mark.long),
        ("ROS_DOMAIN_ID", "120", "domain-high"),
        pytest.param("ROS_VERSION", "1", "ros1-sourced", marks=pytest.mark.long),
    ],
)
def test_a_setting_that_cannot_be_is_named(
    tmp_path: Path, setting: str, value: str, code: str
) -> None:
    _, found = asked(tmp_path, "--only", "ros", **{"ROS_DOMAIN_ID": "1", setting: value})
    assert [(each["code"], each["where"]) for each in found] == [(code, setting)]


def test_a_profile_that_cannot_be_is_named(tmp_path: Path, domains: list[int]) -> None:
    data = registered(tmp_path, [{"name": "Ada", "domain": domains[0]}])
    with sqlite3.connect(data / "runner.db") as database:
        database.execute("UPDATE robot SET profile = ?", ('{"nonsense": 5}',))
    database.close()
    _, found = doctor(data, domains[0])
    assert found["Ada"]["code"] == "robot-profile"
