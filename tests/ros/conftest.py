"""Tests over real rclpy: on loopback only, each on a domain that nobody else uses."""

import fcntl
import importlib.util
import os
import random
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

#: Domains that one test may take.
AT_ONCE = 4

if not os.environ.get("TEST_ENGINE_NAME"):  # a real engine may be on another computer
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ.pop("ROS_DOMAIN_ID", None)


@pytest.fixture(autouse=True)
def soon_settled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten discovery: on loopback a second is enough, and a test knows which nodes will come."""
    if importlib.util.find_spec("rclpy"):
        from action_assistant.runner.links.ros2 import domain as ros2_domain

        monkeypatch.setattr(ros2_domain, "DISCOVERY_S", 0.5)


@pytest.fixture
def domains() -> Iterator[list[int]]:
    """Numbers of domains of this test's own, also among other processes that run such tests."""
    folder = Path(tempfile.gettempdir()) / "action-assistant-domains"
    folder.mkdir(exist_ok=True)
    with ExitStack() as held:
        found: list[int] = []
        for number in random.sample(range(1, 100), 99):
            taken = (folder / str(number)).open("w")
            try:
                fcntl.flock(taken, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                taken.close()
                continue
            held.enter_context(taken)
            found.append(number)
            if len(found) == AT_ONCE:
                break
        if not found:
            raise RuntimeError("every domain is taken")
        yield found


@pytest.fixture
def domain(domains: list[int]) -> int:
    """Return one of the domains."""
    return domains[0]
