"""Durations between two bounds, since robots are not seen at every moment.

A duration without bounds is exact. An unknown duration is no number: it is neither zero nor a
failure.
"""

import math
from collections.abc import Sequence
from typing import Final

import msgspec

from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import MOMENT_US, Visit

_EXACT_S: Final = 0.001


class DurationBounds(msgspec.Struct, frozen=True, kw_only=True):
    """A duration in seconds, between `least` and `most`; `most` is None without an upper bound."""

    least: float
    most: float | None

    @property
    def exact(self) -> float | None:
        """The value, if both bounds differ by less than a millisecond; else None."""
        known = self.most is not None and self.most - self.least <= _EXACT_S
        return self.most if known else None


def duration_bounds(least: int, most: int | None) -> DurationBounds:
    """Convert bounds in microseconds to seconds, each rounded outwards to a millisecond. `most`:
    None without an upper bound."""
    above = None if most is None else max(0, math.ceil(most / 1000) / 1000)
    return DurationBounds(least=max(0, math.floor(least / 1000) / 1000), most=above)


def of_visit(visit: Visit) -> DurationBounds | None:
    """Return the shortest and the longest time that a visit can have taken, in seconds; None while
    no end was seen."""
    return None if visit.until is None else duration_bounds(visit.least, visit.most)


def of_run(run: Run) -> DurationBounds | None:
    """Return the time from the start until nothing of the run moved, whenever that was proven; None
    for a run that was never started. It has no upper bound while the run is open or lost, or
    while an action may still run."""
    if run.started_at is None or run.end == "refused":
        return None
    visits = [visit for action in run.actions.values() for visit in action.visits]
    known = [max(visit.until or 0, visit.not_before) for visit in visits]
    least = max([run.going_at - MOMENT_US, run.started_at, *known]) - run.started_at
    open_end = run.end in {None, "lost"} or any(visit.not_after is None for visit in visits)
    if open_end or run.over_at is None:
        return duration_bounds(least, None)
    return duration_bounds(min(least, run.over_at - run.started_at), run.over_at - run.started_at)


def at_rank(spans: Sequence[DurationBounds], share: float) -> DurationBounds | None:
    """Return the percentile of durations: the smallest one that at least `share` (0 to 1) of
    `spans` do not exceed, computed for both bounds separately; None without durations."""
    if not spans:
        return None
    place = max(0, math.ceil(share * len(spans)) - 1)
    least = sorted(each.least for each in spans)[place]
    most = sorted(math.inf if each.most is None else each.most for each in spans)[place]
    return DurationBounds(least=least, most=None if math.isinf(most) else most)
