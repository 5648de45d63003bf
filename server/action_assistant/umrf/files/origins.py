"""Places of problems and notes in the text that was given (docs/umrf-and-the-engine.md 1.5).

Problems and notes name places of the graph's canonical text, or of a file that was translated. `Origins` lead
from there to the given text, where the place is looked up.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias, TypeVar

from msgspec.structs import replace

from action_assistant.umrf.json.places import places_of
from action_assistant.umrf.model import Note, Problem, Where

#: One step of a translation: a pointer after it → the pointer before it. A value that is not named came with the value
#: around it.
Origins: TypeAlias = Mapping[str, str]
#: The steps that lead back to the given text, one after the other.
Steps: TypeAlias = Sequence[Origins]

Located = TypeVar("Located", Problem, Note)


def origin(origins: Origins, path: str) -> str:
    """Return the pointer that a value had before one step of a translation. `path` is the pointer
    of the value after the step, `origins` the map of this step. If no entry of the map covers
    the value, its pointer is the same before and after."""
    head = path
    while head not in origins:
        cut = head.rfind("/")
        if cut < 0:
            return path
        head = head[:cut]
    return origins[head] + path[len(head) :]


def placed(problems: Iterable[Problem], text: str, steps: Steps = ()) -> list[Problem]:
    """Return the problems with lines and columns in `text`, the original. `steps` lead from the
    problems' pointers to those in the original."""
    return located(text, [moved(problem, steps) for problem in problems])[0]


def moved(item: Located, steps: Steps) -> Located:
    """Return a problem or remark with pointers into the original text, to which `steps` lead."""

    def lead(where: Where) -> Where:
        path = where.path
        for origins in steps:
            path = origin(origins, path)
        return replace(where, path=path)

    where, also = lead(item.where), tuple(map(lead, item.also))
    return replace(item, where=where, also=also)


def located(
    text: str, problems: Sequence[Problem], notes: Sequence[Note] = ()
) -> tuple[list[Problem], tuple[Note, ...]]:
    """Return problems and remarks whose pointers are into this text with lines and columns. A value
    that is missing has the place of the value in which it would be. With the text "" they stay as
    they are."""
    every = [where for problem in problems for where in (problem.where, *problem.also)]
    every += [where for note in notes for where in (note.where, *note.also)]
    if not text or not every:
        return list(problems), tuple(notes)
    places = places_of(text, {where.path for where in every})

    def find(where: Where) -> Where:
        place = places[where.path]
        return replace(where, path=place.path, line=place.line, column=place.column)

    def all_found(item: Located) -> Located:
        where, also = find(item.where), tuple(map(find, item.also))
        return replace(item, where=where, also=also)

    return [all_found(problem) for problem in problems], tuple(all_found(note) for note in notes)
