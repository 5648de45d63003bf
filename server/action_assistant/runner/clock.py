"""The clock of the runner, in microseconds UTC."""

import time
from collections.abc import Callable

Clock = Callable[[], int]


def wall_clock() -> int:
    """Microseconds UTC."""
    return time.time_ns() // 1000
