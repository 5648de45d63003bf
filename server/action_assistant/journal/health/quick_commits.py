"""Whether commits are quick enough for the event loop to wait for them itself (decision 94)."""

from collections import deque
from typing import Final

_REMEMBERED: Final = 100  # commits
_KNOWN: Final = 20  # of them, before anything follows from how long they took
_SLOW_S: Final = 0.02  # of which nobody sees anything
_MOST_SLOW: Final = 5  # of those remembered
_FAR_TOO_SLOW_S: Final = 0.1


class QuickCommits:
    """Of the last hundred commits no more than five took longer than 20 ms, and none longer than 100 ms; of
    the first twenty nothing is known yet."""

    def __init__(self) -> None:
        self._last: deque[float] = deque(maxlen=_REMEMBERED)
        self._slow = self._far_too_slow = 0

    def took(self, seconds: float) -> None:
        """Another one is over, wherever it was done."""
        if len(self._last) == _REMEMBERED:
            self._count(self._last[0], -1)
        self._last.append(seconds)
        self._count(seconds, 1)

    def _count(self, seconds: float, by: int) -> None:
        if seconds > _SLOW_S:
            self._slow += by
            self._far_too_slow += by * (seconds > _FAR_TOO_SLOW_S)

    @property
    def are_quick(self) -> bool:
        """Whether the next one may hold up the loop."""
        enough = len(self._last) >= _KNOWN
        return enough and self._slow <= _MOST_SLOW and not self._far_too_slow
