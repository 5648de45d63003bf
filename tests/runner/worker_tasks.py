"""Tasks that tests give to workers, in a module that a worker can import."""

import os
import signal
import sys
import time
from pathlib import Path

from action_assistant.errors import Conflict
from action_assistant.umrf.files.codec import Unreadable


def pid() -> int:
    return os.getpid()


def spin(seconds: float) -> int:
    """Holds the interpreter lock of its process all the time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        pass
    return os.getpid()


def devour(megabytes: int) -> int:
    return len(bytearray(megabytes << 20))


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def write_and_die(path: str) -> None:
    """Append a line to the file `path`, and kill this process."""
    with Path(path).open("a") as file:
        file.write("once\n")
    die()


def refuse() -> None:
    raise Conflict("It cannot be.", where={"path": "/umrf"})


def stumble() -> None:
    raise Unreadable("not-umrf", "an error that cannot travel", path="/x")


def standing() -> tuple[int, int, list[str]]:
    score = int(Path("/proc/self/oom_score_adj").read_text())
    return os.nice(0), score, [name for name in sys.modules if "rclpy" in name]
