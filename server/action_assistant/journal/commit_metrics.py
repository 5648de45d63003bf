"""Metrics of the commits of a journal, and whether commits are quick enough for the event loop (decision 94).

Updated by the thread that commits, read by the loop.
"""

import time
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Final

from prometheus_client import Histogram, Metric
from prometheus_client.core import CounterMetricFamily
from prometheus_client.registry import Collector

from action_assistant.journal.events import Event

_BUCKETS: Final = (
    0.0005,
    0.001,
    0.0025,
    0.005,
    0.01,
    0.025,
    0.05,
    0.1,
    0.25,
    0.5,
    1,
    2.5,
    5,
    10,
    30,
)

_REMEMBERED: Final = 100  # commits
_KNOWN: Final = 20  # of them, before anything follows from how long they took
_SLOW_S: Final = 0.02  # too short to be noticed
_MOST_SLOW: Final = 5  # of those remembered
_FAR_TOO_SLOW_S: Final = 0.1
#: The share of the time that commits on the loop may take; beyond it the thread commits.
_SHARE: Final = 1 / 6


class QuickCommits:
    """Decides from the last hundred commits whether a commit may run on the event loop.

    At most five of them may have taken longer than 20 ms and none longer than 100 ms, and all
    together at most a sixth of the time in which they came. The first twenty commits never run on
    the loop.
    """

    def __init__(self) -> None:
        self._last: deque[tuple[float, float]] = deque(maxlen=_REMEMBERED)  # seconds, and when
        self._all = 0.0  # seconds
        self._slow = self._far_too_slow = 0

    def took(self, seconds: float) -> None:
        """Count a commit that took so many seconds."""
        if len(self._last) == _REMEMBERED:
            self._count(self._last[0][0], -1)
        self._last.append((seconds, time.monotonic()))
        self._count(seconds, 1)

    def _count(self, seconds: float, by: int) -> None:
        self._all += by * seconds
        if seconds > _SLOW_S:
            self._slow += by
            self._far_too_slow += by * (seconds > _FAR_TOO_SLOW_S)

    @property
    def are_quick(self) -> bool:
        """Return whether the next commit may run on the event loop."""
        if len(self._last) < _KNOWN or self._slow > _MOST_SLOW or self._far_too_slow:
            return False
        return self._all <= _SHARE * (time.monotonic() - self._last[0][1])


class CommitMetrics(Collector):
    """A collector for a registry of Prometheus. `failing`: why the newest transaction was not
    stored; None if it was."""

    def __init__(self) -> None:
        self.failing: str | None = None
        self.quick: Final = QuickCommits()
        self._submitted = self._done = 0  # jobs; each is counted by one thread
        self._busy_since: float | None = None
        self._seconds = Histogram(
            "action_assistant_commit_seconds",
            "Time that a transaction took, from its first statement to the end of its commit.",
            buckets=_BUCKETS,
            registry=None,
        )
        self._events = self._failures = 0
        self._last = 0.0  # seconds since 1970

    def submitted(self, jobs: int) -> None:
        """Count `jobs` more jobs that wait for the writer."""
        self._submitted += jobs

    def begins(self) -> None:
        """Record that a transaction begins now."""
        self._busy_since = time.monotonic()

    def over(self, jobs: int, stored: Sequence[Sequence[Event]]) -> None:
        """Record the end of a transaction of `jobs` jobs. `stored`: the events of each job that was
        not refused. If all were refused, nothing was written, so that the disk's speed is not
        measured."""
        if stored and self._busy_since is not None:
            took = time.monotonic() - self._busy_since
            self._seconds.observe(took)
            self.quick.took(took)
            self.failing = None
            self._last = time.time()
            self._events += sum(map(len, stored))
        self._ended(jobs)

    def failed(self, jobs: int, why: str) -> None:
        """Count a transaction of `jobs` jobs that failed for the reason `why`."""
        self.failing = why
        self.quick.took(self.busy_s)
        self._failures += 1
        self._ended(jobs)

    def _ended(self, jobs: int) -> None:
        self._busy_since = None
        self._done += jobs

    @property
    def waiting(self) -> int:
        """The number of submitted jobs that have no outcome yet."""
        return self._submitted - self._done

    @property
    def busy_s(self) -> float:
        """The age of the present transaction in seconds; 0 without one."""
        since = self._busy_since
        return 0.0 if since is None else time.monotonic() - since

    def collect(self) -> Iterator[Metric]:
        """Yield the metrics that a Prometheus registry asks for."""
        yield from self._seconds.collect()
        yield CounterMetricFamily(
            "action_assistant_commit_failures",
            "Transactions that were not stored, or of which that is not known.",
            self._failures,
        )
        yield CounterMetricFamily(
            "action_assistant_events_stored", "Events that were stored.", self._events
        )
        yield _gauge(
            "last_commit_timestamp_seconds",
            "When something was stored last; 0 if nothing was since this process began.",
            self._last,
        )
        yield _gauge(
            "writer_waiting", "Jobs that wait for the writer of the journal.", self.waiting
        )
        yield _gauge(
            "writer_busy_seconds",
            "For how long the transaction lasts that is under way; 0 without one.",
            self.busy_s,
        )
        yield _gauge(
            "writer_failing",
            "1 while the newest transaction is one that was not stored.",
            self.failing is not None,
        )


def _gauge(name: str, documentation: str, value: float) -> Metric:
    metric = Metric(f"action_assistant_{name}", documentation, "gauge")
    metric.add_sample(metric.name, {}, float(value))
    return metric
