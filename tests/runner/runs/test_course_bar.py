"""The course of a run in a list shows how its visits ended, and never more than was seen."""

import msgspec
import pytest

from action_assistant.runner.analysis import annotations
from action_assistant.runner.runs.course_bar import CoursePart, course_bar, stored_course
from action_assistant.runner.runs.events import Ended, Published
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import ActionRun, Outcome, Visit
from runner.runs.test_runs import REQUESTED

BEGIN, S = 1_000, 1_000_000


def over(actions: dict[str, ActionRun]) -> Run:
    """Return a run of 60 s with these actions."""
    found = replay([REQUESTED, Published(BEGIN, "life"), Ended(BEGIN + 60 * S, "finished", None)])
    assert found is not None
    return msgspec.structs.replace(found, actions=actions, started_at=BEGIN, over_at=BEGIN + 60 * S)


def visit(begin: float, end: float | None, result: Outcome | None) -> Visit:
    """Return a visit between these seconds of the run."""
    start = BEGIN + int(begin * S)
    until = None if end is None else BEGIN + int(end * S)
    return Visit(start=start, not_before=start, until=until, not_after=until, result=result)


@pytest.mark.parametrize(
    ("visits", "course"),
    [
        ([(0, 20, "true"), (20, 60, "error")], [("true", 20), ("error", 40)]),
        ([(0, 60, "true"), (10, 30, "false")], [("true", 10), ("false", 20), ("true", 30)]),
        ([(30, 30.1, "error")], [("none", 30), ("error", 1), ("none", 29)]),
        ([(0, 30, None), (30, None, None)], [("done", 30), ("unknown", 30)]),
        ([(59.9, 75, "stopped")], [("none", 59), ("stopped", 1)]),
        ([], []),
    ],
)
def test_each_part_shows_the_worst_of_its_visits(
    visits: list[tuple[float, float | None, Outcome | None]], course: list[tuple[str, int]]
) -> None:
    actions = {
        f"Work_{number}": ActionRun(visits=(visit(*each),)) for number, each in enumerate(visits)
    }
    assert [(part.shows, part.steps) for part in course_bar(over(actions))] == course


def test_a_time_whose_visits_are_not_listed_any_more_is_no_time_without_any() -> None:
    run = over({"Work_0": ActionRun(older=7, visits=(visit(40, 60, "true"),))})
    assert course_bar(run) == (CoursePart("done", 40), CoursePart("true", 20))


def test_the_sum_of_a_run_keeps_its_course() -> None:
    run = over({"Work_0": ActionRun(visits=(visit(0, 60, "true"),))})
    assert annotations.sum_of(run, None, 0).course == (CoursePart("true", 60),)


@pytest.mark.parametrize(
    "value", [[{"shows": "paused", "steps": 60}], [{"steps": 3}], "none", None]
)
def test_a_course_of_an_unknown_form_hides_no_list_of_runs(value: object) -> None:
    assert stored_course(value) == ()
    assert stored_course([{"shows": "true", "steps": 60}]) == (CoursePart("true", 60),)
