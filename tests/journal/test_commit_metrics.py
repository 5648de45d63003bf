"""Metrics of commits are reported as a registry of Prometheus has them."""

import pytest
from prometheus_client import CollectorRegistry

from action_assistant.journal import commit_metrics
from action_assistant.journal.commit_metrics import CommitMetrics
from action_assistant.journal.events import Event

EVENT = Event("a", 1, "kind", "ada", 0, b"", 1)


def test_commits_are_counted_by_how_long_they_took(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr(commit_metrics.time, "monotonic", lambda: now)
    metrics, registry = CommitMetrics(), CollectorRegistry()
    registry.register(metrics)
    for took in (0.0005, 0.3, 40.0):  # at a bound, between two, and beyond all
        metrics.submitted(1)
        metrics.begins()
        now += took
        metrics.over(1, [[EVENT, EVENT]])
    metrics.submitted(2)
    metrics.begins()
    metrics.failed(1, "full")

    def told(name: str, **labels: str) -> float | None:
        return registry.get_sample_value(f"action_assistant_{name}", labels)

    counts = [
        told("commit_seconds_bucket", le=bound) for bound in ("0.0005", "0.25", "0.5", "30.0")
    ]
    assert counts == [1, 1, 2, 2]
    assert told("commit_seconds_bucket", le="+Inf") == told("commit_seconds_count") == 3
    assert told("commit_seconds_sum") == pytest.approx(40.3005)
    assert (told("events_stored_total"), told("commit_failures_total")) == (6, 1)
    assert (told("writer_waiting"), told("writer_failing")) == (1, 1)
