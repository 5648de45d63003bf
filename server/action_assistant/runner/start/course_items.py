"""The item of a pre-flight about expected courses. It warns, and stands in nobody's way. Pure."""

from typing import Final

from action_assistant.runner.analysis.course_checks import CheckedCourses
from action_assistant.runner.start.preflight import Item

_TOLD: Final = 3  # in a sentence


def of_courses(found: CheckedCourses) -> tuple[Item, ...]:
    """Whether the graph goes as it is expected to; nothing where nothing is expected."""
    courses = found.courses
    if not courses:
        return ()
    other = [each for each in courses if each.same is False]
    unknown = sum(each.same is None for each in courses)
    if not other and not unknown:
        text = f"It goes as expected: {_count(len(courses))}."
        return (Item(code="courses", verdict="passed", text=text),)
    told = [f"{each.name}: {each.why}" for each in other[:_TOLD]]
    if len(other) > _TOLD:
        told.append(f"{len(other) - _TOLD} more go another way.")
    if unknown:
        told.append(f"{_count(unknown)} could not be looked at in time.")
    if other:
        of = _count(len(courses))
        told.insert(0, f"It does not go as expected, in {len(other)} of {of}.")
    return (Item(code="courses", verdict="warned", text=" ".join(told)),)


def of_unknown_courses(why: str) -> Item:
    """Whether it goes as expected is not known."""
    text = f"Whether it goes as expected is not known. {why}"
    return Item(code="courses", verdict="warned", text=text)


def _count(number: int) -> str:
    return "1 expected course" if number == 1 else f"{number} expected courses"
