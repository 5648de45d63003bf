"""The clock of the runner, in microseconds UTC."""

import time
from collections.abc import Callable

ClockUs = Callable[[], int]


def utc_us() -> int:
    """Return the time of the computer in microseconds UTC."""
    return time.time_ns() // 1000
