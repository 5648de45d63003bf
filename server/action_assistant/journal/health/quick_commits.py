"""Whether commits are quick enough for the event loop to wait for them itself (decision 94)."""

import time
from collections import deque
from typing import Final

_REMEMBERED: Final = 100  # commits
_KNOWN: Final = 20  # of them, before anything follows from how long they took
_SLOW_S: Final = 0.02  # of which nobody sees anything
_MOST_SLOW: Final = 5  # of those remembered
_FAR_TOO_SLOW_S: Final = 0.1
#: Of the time, that commits may take: a loop that does more than that has better things to do meanwhile.
_SHARE: Final = 1 / 6


class QuickCommits:
    """Decides from the last hundred commits whether a commit may run on the event loop.

    At most five of them may have taken longer than 20 ms and none longer than 100 ms, and all
    together at most a sixth of the time in which they came. The first twenty commits never run
    there.
    """

    def __init__(self) -> None:
        self._last: deque[tuple[float, float]] = deque(maxlen=_REMEMBERED)  # seconds, and when
        self._all = 0.0  # seconds
        self._slow = self._far_too_slow = 0

    def took(self, seconds: float) -> None:
        """Note the duration of a commit in seconds."""
        if len(self._last) == _REMEMBERED:
            self._count(self._last[0][0], -1)
        self._last.append((seconds, time.monotonic()))
        self._count(seconds, 1)

    def _count(self, seconds: float, by: int) -> None:
        self._all += by * seconds
        if seconds > _SLOW_S:
            self._slow += by
            self._far_too_slow += by * (seconds > _FAR_TOO_SLOW_S)

    @property
    def are_quick(self) -> bool:
        """Return whether the next commit may run on the event loop."""
        if len(self._last) < _KNOWN or self._slow > _MOST_SLOW or self._far_too_slow:
            return False
        return self._all <= _SHARE * (time.monotonic() - self._last[0][1])
