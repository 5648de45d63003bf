"""Notes on a file while it is read: equal ones are one, with all their places."""

from collections.abc import Iterator
from typing import Final

from action_assistant.umrf.model import Note, Where

#: Places of one note that are kept.
MAX_EACH: Final = 1_000


class Notes:
    """What was translated or left out so far, in the order in which it came first."""

    def __init__(self) -> None:
        self._places: dict[str, list[Where]] = {}
        self._times: dict[str, int] = {}

    def add(self, message: str, path: str) -> None:
        """Says that something was done with what stands at `path`."""
        places = self._places.setdefault(message, [])
        if len(places) < MAX_EACH:
            places.append(Where(path=path))
        self._times[message] = self._times.get(message, 0) + 1

    def told(self) -> tuple[Note, ...]:
        """All notes."""
        return tuple(self._all())

    def _all(self) -> Iterator[Note]:
        for message, (first, *others) in self._places.items():
            yield Note(message=message, where=first, times=self._times[message], also=tuple(others))
