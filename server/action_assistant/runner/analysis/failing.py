"""The visit to which the bad end of a run goes back: as deep inside of graphs as it is known. Pure."""

from collections.abc import Iterable, Mapping
from typing import TypeAlias

from action_assistant.runner.analysis.levels import LevelPlace, places_of, within
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import Visit

#: When it had ended, its action, and itself.
Ended: TypeAlias = tuple[int, str, Visit]


def failing_visit(run: Run) -> Ended | None:
    """The first that ended in error; of a run that ended false, the last that did. What went wrong
    inside of an action that ended true all the same was made good there: it is the last to be thought of."""
    found = places_of(run)
    ended = _ended(run, found, run.actions)
    errors = [each for each in ended if each[2].result == "error"]
    own = {place.way: name for name, place in found.items()}
    wrong = next((each for each in errors if not _made_good(run, found, own, each)), None)
    if wrong is None and run.result == "on_false":
        top = [each for each in ended if each[2].result == "false" and not found[each[1]].levels]
        wrong = next(reversed(top), None)
    wrong = wrong or next(iter(errors), None)
    return wrong and _inmost(run, found, wrong)


def _ended(run: Run, found: Mapping[str, LevelPlace], names: Iterable[str]) -> list[Ended]:
    """Visits that have ended, in that order; of what ended at one moment, the inner ones first."""
    visits = [
        (visit.not_after or visit.start, name, visit)
        for name in names
        for visit in run.actions[name].visits
        if visit.until is not None
    ]
    return sorted(visits, key=lambda each: (each[0], -len(found[each[1]].levels), each[1]))


def _made_good(
    run: Run, found: Mapping[str, LevelPlace], own: Mapping[tuple[str, ...], str], wrong: Ended
) -> bool:
    levels = found[wrong[1]].levels
    around = (own.get(levels[:depth]) for depth in range(1, len(levels) + 1))
    return any(
        visit.result == "true" and _holds(visit, wrong[2])
        for name in around
        if name is not None
        for visit in run.actions[name].visits
    )


def _inmost(run: Run, found: dict[str, LevelPlace], wrong: Ended) -> Ended:
    """The visit inside of it that ended in the same way, and so on down."""
    _, name, around = wrong
    inside = [
        each
        for each in _ended(run, found, within(found, name))
        if each[2].result == around.result and _holds(around, each[2])
    ]
    if not inside:
        return wrong
    return _inmost(run, found, inside[0] if around.result == "error" else inside[-1])


def _holds(around: Visit, visit: Visit) -> bool:
    """Whether one visit can have gone on within another."""
    ended = around.not_after
    return visit.start >= around.not_before and (ended is None or visit.not_before <= ended)
