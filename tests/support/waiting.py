"""Waits for what tells nobody when it happens: real processes, threads, databases."""

import time
from collections.abc import Callable
from typing import TypeVar

import anyio

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


async def wait_until(holds: Callable[[], object], seconds: float = 60) -> None:
    """Ask until `holds` returns something true. Raise TimeoutError after `seconds`."""
    with anyio.fail_after(seconds):
        while not holds():  # noqa: ASYNC110 - nobody tells
            await anyio.sleep(0.01)
