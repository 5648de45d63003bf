"""Collects problems and notes about one graph or file, with a limit on how many of one kind are kept."""

from collections import Counter
from collections.abc import Iterator
from typing import Final

from action_assistant.umrf.model import Note, Problem, Severity, Where

#: Problems of one severity and code that are kept, and places of one problem or note. More would help nobody and
#: could fill the memory.
MAX_EACH: Final = 1_000


class ProblemList:
    """Keeps the first `MAX_EACH` problems of each severity and code, in the order in which they
    were found."""

    def __init__(self) -> None:
        self.found: list[Problem] = []
        self._reported: Counter[tuple[Severity, str]] = Counter()

    def has_room(self, severity: Severity, code: str) -> bool:
        """Count one more problem of this severity and code, and return whether the caller shall
        keep it."""
        self._reported[severity, code] += 1
        return self._reported[severity, code] <= MAX_EACH


class Notes:
    """Collects remarks on values that were translated or left out while a file was read. Remarks
    with the same message become one note with several places."""

    def __init__(self) -> None:
        self._places: dict[str, list[Where]] = {}
        self._times: Counter[str] = Counter()

    def add(self, message: str, path: str) -> None:
        """Add the remark `message` about the value at `path`, a JSON pointer."""
        places = self._places.setdefault(message, [])
        if len(places) < MAX_EACH:
            places.append(Where(path=path))
        self._times[message] += 1

    def all(self) -> tuple[Note, ...]:
        """Return all remarks in the order in which their messages first occurred."""
        return tuple(self._all())

    def _all(self) -> Iterator[Note]:
        for message, (first, *others) in self._places.items():
            yield Note(message=message, where=first, times=self._times[message], also=tuple(others))
