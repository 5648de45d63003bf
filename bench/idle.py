"""Sockets that only stand there, against Hocuspocus, in turn: memory, and what it costs to come."""

from collections.abc import Iterator
from typing import Final

from rooms import RUNS, in_turn, median
from table import Table

TITLE = "Idle sockets"
_SOCKETS: Final = 1000


def tables() -> Iterator[Table]:
    """One row for each server."""
    found = in_turn("idle", {"people": _SOCKETS, "graphs": 100}, RUNS)
    rows = [
        [name, f"{median(runs, 'memory_mb'):.1f} MB", f"{median(runs, 'connect_ms'):.2f} ms"]
        for name, runs in found.items()
    ]
    yield Table([f"{_SOCKETS:,} idle sockets", "memory", "CPU per connection"], rows)
