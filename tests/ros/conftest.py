"""Tests over real rclpy: on loopback only, each on a domain that nobody else uses."""

import fcntl
import os
import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ.pop("ROS_DOMAIN_ID", None)


@pytest.fixture
def domain() -> Iterator[int]:
    """The number of a domain of this test's own, also among other processes that run such tests."""
    folder = Path(tempfile.gettempdir()) / "action-assistant-domains"
    folder.mkdir(exist_ok=True)
    for number in random.sample(range(1, 100), 99):
        with (folder / str(number)).open("w") as taken:
            try:
                fcntl.flock(taken, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            yield number
            return
    raise RuntimeError("every domain is taken")
