"""A token bucket: how much somebody may do at once, and how much a second after that."""

import time
from collections.abc import Callable
from typing import Final


class TokenBucket:
    """Holds up to `capacity` tokens and gains `rate` of them a second. It may be overdrawn: then it is in
    debt until enough tokens have come."""

    __slots__ = ("_at", "_capacity", "_clock", "_rate", "_tokens")

    def __init__(
        self, capacity: float, rate: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._capacity: Final = capacity
        self._rate: Final = rate
        self._clock: Final = clock
        self._tokens = capacity
        self._at = clock()

    def spend(self, tokens: float) -> None:
        """Take tokens, also where there are fewer than that."""
        self._refill()
        self._tokens -= tokens

    @property
    def is_overdrawn(self) -> bool:
        """Tell whether tokens were owed after the last `spend`."""
        return self._tokens < 0

    def debt(self) -> float:
        """Return the seconds until no token is owed; 0 where none is."""
        self._refill()
        return max(0.0, -self._tokens / self._rate)

    def _refill(self) -> None:
        now = self._clock()
        self._tokens = min(self._capacity, self._tokens + (now - self._at) * self._rate)
        self._at = now
