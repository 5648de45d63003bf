"""Waits in tests that follow real processes, which tell nobody when they are ready."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def until(
    what: str, seen: Callable[[], T], seconds: float = 40, shown: Callable[[], object] = lambda: ""
) -> T:
    """Ask until `seen` returns something true, and return that. Raise AssertionError after `seconds`,
    with `what` has not happened, and what is `shown` then."""
    deadline = time.monotonic() + seconds
    while not (found := seen()):
        assert time.monotonic() < deadline, f"{what} {shown()}"
        time.sleep(0.05)
    return found
