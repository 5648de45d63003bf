"""Counters of rooms for Prometheus. They are few, since they are updated for each edit."""

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Final

from prometheus_client import Histogram, Metric
from prometheus_client.registry import Collector

from action_assistant.editor.rooms.batch import Objection, SubmittedEdit

_BUCKETS: Final = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30)


class RoomMetrics(Collector):
    """Counts for all rooms of a process. Not thread-safe: only the event loop updates it."""

    def __init__(self) -> None:
        self.opened = 0
        self.unloaded = 0
        self.refused: Final[Counter[str]] = Counter()  # edits, by reason
        self.closed: Final[Counter[int]] = Counter()  # sockets, by close code
        self._acks = Histogram(
            "action_assistant_ack_seconds",
            "Time from an edit's arrival at its room until it was durable and acknowledged.",
            buckets=_BUCKETS,
            registry=None,
        )

    def acknowledged(self, edits: Sequence[SubmittedEdit]) -> None:
        """Observe how long edits waited that are durable now, or that changed nothing."""
        now = time.perf_counter()
        for edit in edits:
            self._acks.observe(now - edit.at)

    def objected(self, error: Objection) -> None:
        """Count an edit that was refused for this reason."""
        self.refused[_name(error)] += 1

    def collect(self) -> Iterator[Metric]:
        """Yield the metrics, as `prometheus_client` asks a collector for them."""
        yield from self._acks.collect()


def _name(error: Objection) -> str:
    """Return the name of a reason in snake case, as labels are written."""
    name = type(error).__name__
    return "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")
