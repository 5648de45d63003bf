"""Commits count as quick by the last hundred of them."""

import pytest

from action_assistant.journal import commit_metrics
from action_assistant.journal.commit_metrics import QuickCommits


class Clock:
    """Stands still until somebody moves it, seconds."""

    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(commit_metrics, "time", clock)
    return clock


def after(clock: Clock, *seconds: float, every: float = 1.0) -> bool:
    """Return whether commits are quick after these commits, one after the other."""
    commits = QuickCommits()
    for each in seconds:
        clock.now += every
        commits.took(each)
    return commits.are_quick


def test_commits_do_not_count_as_quick_before_twenty_are_known(clock: Clock) -> None:
    assert not after(clock, *[0.001] * 19)
    assert after(clock, *[0.001] * 20)


def test_five_of_a_hundred_may_be_slow(clock: Clock) -> None:
    assert after(clock, *[0.001] * 95, *[0.03] * 5)
    assert not after(clock, *[0.001] * 94, *[0.03] * 6)
    assert not after(clock, *[0.001] * 15, *[0.03] * 6)


def test_a_very_slow_commit_counts_until_a_hundred_more_are_done(
    clock: Clock,
) -> None:
    assert not after(clock, *[0.001] * 50, 0.11, *[0.001] * 99)
    assert after(clock, *[0.001] * 50, 0.11, *[0.001] * 100)


def test_a_disk_that_becomes_quick_is_trusted_again(clock: Clock) -> None:
    assert not after(clock, *[0.03] * 100, *[0.001] * 94)
    assert after(clock, *[0.03] * 100, *[0.001] * 95)


def test_commits_may_take_a_sixth_of_the_time_together(clock: Clock) -> None:
    assert after(clock, *[0.001] * 100, every=0.007)
    assert not after(clock, *[0.001] * 100, every=0.005)
