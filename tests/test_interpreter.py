"""The runner runs under a Python that can speak ROS 2, where there is one."""

import hashlib
import sys
from pathlib import Path

import pytest

from action_assistant import interpreter, paths
from action_assistant.errors import CannotStart
from action_assistant.interpreter import for_runner, rclpy_fits
from support.product import Product, running

pytestmark = pytest.mark.usefixtures("new_interpreters")

HERE = Path(sys.executable)


def wheels_of(checkout: Path, made_for: bytes) -> Path:
    """A checkout whose `make ros` was made for these requirements."""
    (checkout / ".venv-ros" / "bin").mkdir(parents=True)
    (checkout / "requirements").mkdir()
    (checkout / "requirements" / "ros.txt").write_bytes(b"rclpy==1\n")
    (checkout / ".venv-ros" / "bin" / "python").symlink_to(HERE)
    (checkout / ".venv-ros" / ".done").write_text(hashlib.sha256(made_for).hexdigest())
    return checkout / ".venv-ros"


@pytest.mark.skipif(rclpy_fits(), reason="this Python speaks ROS 2 by itself")
def test_the_environment_of_make_ros_is_taken_where_it_is_current(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wheels = wheels_of(tmp_path, b"rclpy==1\n")
    monkeypatch.setattr(paths, "wheels", lambda: wheels)
    found = for_runner({})
    assert (found.origin, found.path, found.remark) == ("wheels", wheels / "bin" / "python", "")


@pytest.mark.skipif(rclpy_fits(), reason="this Python speaks ROS 2 by itself")
def test_a_stale_environment_is_left_alone_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wheels = wheels_of(tmp_path, b"rclpy==0\n")
    monkeypatch.setattr(paths, "wheels", lambda: wheels)
    found = for_runner({})
    assert (found.origin, found.path) == ("this", HERE)
    assert "`make ros` renews it" in found.remark


def test_a_named_interpreter_is_used_and_must_be_a_program(tmp_path: Path) -> None:
    assert for_runner({interpreter.VARIABLE: str(HERE)}).origin == "named"
    with pytest.raises(CannotStart, match="is no program"):
        for_runner({interpreter.VARIABLE: str(tmp_path)})


def test_the_wheels_do_not_see_a_sourced_ros() -> None:
    sourced = {
        "AMENT_PREFIX_PATH": "/opt/ros/jazzy",
        "PYTHONPATH": "/opt/ros/jazzy/lib",
        "LD_LIBRARY_PATH": "/opt/ros/jazzy/lib",
        "ROS_DOMAIN_ID": "7",
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
    }
    wheels = interpreter.Interpreter(path=HERE, origin="wheels")
    assert wheels.environment(sourced) == {"ROS_DOMAIN_ID": "7"}
    this = interpreter.Interpreter(path=HERE, origin="this")
    assert this.environment(sourced) == sourced


@pytest.mark.long
@pytest.mark.skipif(rclpy_fits(), reason="this Python speaks ROS 2 by itself")
def test_without_rclpy_everything_else_works_and_the_reason_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(interpreter.VARIABLE, sys.executable)
    with running(tmp_path / "data") as product, product.runner() as runner:
        reach = runner.get("/api/reach").json()
        assert [each["name"] for each in reach["engines"]] == ["simulator"]
        assert reach["no_reach"].startswith("rclpy is not there for this Python")


def test_a_named_program_that_is_none_is_one_clear_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(interpreter.VARIABLE, str(tmp_path / "nothing"))
    answer = Product(tmp_path).process_of("serve", "--data", str(tmp_path), "--no-open")
    assert answer.returncode == 2
    assert answer.stderr.splitlines() == [
        f"action-assistant: {interpreter.VARIABLE} is {str(tmp_path / 'nothing')!r}, which is no "
        "program."
    ]
