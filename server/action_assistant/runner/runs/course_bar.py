"""The course of a run as a short bar for lists: in which part of its time something ran, and how that ended."""

import itertools
from collections.abc import Iterator
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import Outcome

_STEPS: Final = 60
#: What a step shows, from the least to the most important one: of visits at the same time the last wins.
_RANKS: Final[tuple["Shown", ...]] = (
    "none", "true", "done", "unknown", "false", "stopped", "error",
)  # fmt: skip

Shown: TypeAlias = Outcome | Literal["none", "done", "unknown"]


class CoursePart(msgspec.Struct, frozen=True):
    """A part of the time of a run, in sixtieths of it. `shows`: the result of the visits in it, the
    worst one where there are several; "done": they ended with a result that nobody saw, or that is
    not listed any more; "unknown": no end was seen; "none": no action was seen running."""

    shows: Shown
    steps: int


def course_bar(run: Run) -> tuple[CoursePart, ...]:
    """Return the course of a run that is over, from its start until nothing of it moved; () where it
    never started or nothing of it was seen."""
    begin, end = run.started_at, run.over_at or run.ended_at
    if begin is None or end is None or end <= begin:
        return ()
    steps = [0] * _STEPS
    for start, until, shows in _spans(run, begin, end):
        first, past = ((at - begin) * _STEPS // (end - begin) for at in (start, until))
        first = min(max(first, 0), _STEPS - 1)
        for step in range(first, min(max(past, first + 1), _STEPS)):
            steps[step] = max(steps[step], _RANKS.index(shows))
    if not any(steps):
        return ()
    return tuple(
        CoursePart(_RANKS[rank], len(list(same))) for rank, same in itertools.groupby(steps)
    )


def stored_course(value: object) -> tuple[CoursePart, ...]:
    """Return a course as a summary keeps it; () for one of an unknown form, as a newer version of the
    program may have stored it."""
    try:
        return msgspec.convert(value, tuple[CoursePart, ...])
    except msgspec.ValidationError:
        return ()


def _spans(run: Run, begin: int, end: int) -> Iterator[tuple[int, int, Shown]]:
    """Return begin and end of all visits, and of the times whose visits are not listed any more."""
    for action in run.actions.values():
        if action.older and action.visits:
            yield begin, action.visits[0].start, "done"
        for visit in action.visits:
            if visit.until is None:
                yield visit.start, end, visit.result or "unknown"
            else:
                yield visit.start, visit.until, visit.result or "done"
