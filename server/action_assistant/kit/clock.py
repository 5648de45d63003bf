"""The clock of the log: microseconds since 1970, UTC."""

import time
from collections.abc import Callable

ClockUs = Callable[[], int]


def utc_us() -> int:
    """Return the time of the computer in microseconds UTC."""
    return time.time_ns() // 1000
