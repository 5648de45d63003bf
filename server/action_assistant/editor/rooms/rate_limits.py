"""Rate limits of rooms: bytes per person and minute. Whoever sends more waits; nobody else does."""

import time
from collections.abc import Callable
from typing import Final

PER_MINUTE: Final = 16 << 20  # bytes, of all sockets of a person
AT_ONCE: Final = 32 << 20  # bytes: a large graph after a day without a network
_REMEMBERED: Final = 1000  # people
#: What a word about oneself costs at least: so that two hundred a second may go on for ever.
_WORD: Final = PER_MINUTE // (60 * 200)


class ByteRateLimits:
    """What each person may still bring. Nothing is refused: the socket is read later."""

    def __init__(self, *, limits: bool, clock: Callable[[], float] = time.monotonic) -> None:
        self._limits = limits
        self._clock = clock
        self._left: dict[str, tuple[float, float]] = {}  # bytes, and when that was

    def speak(self, person: str, size: int) -> float:
        """Somebody said so many bytes about themselves: as `spend`."""
        return self.spend(person, max(size, _WORD))

    def spend(self, person: str, size: int) -> float:
        """Somebody brought so many bytes: the seconds to wait before more of theirs is read."""
        if not self._limits:
            return 0.0
        now = self._clock()
        left, then = self._left.get(person, (float(AT_ONCE), now))
        left = min(AT_ONCE, left + (now - then) * PER_MINUTE / 60) - size
        self._left[person] = left, now
        if len(self._left) > _REMEMBERED:
            full = AT_ONCE * 60 / PER_MINUTE  # seconds after which all is forgiven
            self._left = {p: each for p, each in self._left.items() if now - each[1] < full}
        return max(0.0, -left * 60 / PER_MINUTE)
