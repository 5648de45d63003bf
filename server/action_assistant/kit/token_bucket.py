"""Token buckets: how much somebody may do at once, and how much a second after that."""

import time
from collections.abc import Callable
from typing import Final

Clock = Callable[[], float]

_REMEMBERED: Final = 1000  # keys; beyond them buckets that are certainly full are dropped


class TokenBucket:
    """Holds up to `capacity` tokens and gains `rate` of them a second. It may be overdrawn, and is
    then in debt."""

    __slots__ = ("_at", "_capacity", "_clock", "_rate", "_tokens")

    def __init__(self, capacity: float, rate: float, clock: Clock = time.monotonic) -> None:
        self._capacity: Final = capacity
        self._rate: Final = rate
        self._clock: Final = clock
        self._tokens = capacity
        self._at = clock()

    def spend(self, tokens: float) -> None:
        """Take this number of tokens, even if the bucket holds fewer; then it is in debt."""
        self._refill()
        self._tokens -= tokens

    def take(self) -> bool:
        """Take one token; return False if the bucket holds less than one. A failed attempt also
        loses that part of a token, so that endless attempts never succeed."""
        self._refill()
        there = self._tokens >= 1
        self._tokens = max(0.0, self._tokens - 1)
        return there

    @property
    def is_overdrawn(self) -> bool:
        """Return whether tokens were owed after the last `spend`."""
        return self._tokens < 0

    def debt(self) -> float:
        """Return the seconds until no token is owed; 0 where none is."""
        self._refill()
        return max(0.0, -self._tokens / self._rate)

    @property
    def used_at(self) -> float:
        """Return the time of the last call, in seconds of the clock that the bucket was given."""
        return self._at

    def _refill(self) -> None:
        now = self._clock()
        self._tokens = min(self._capacity, self._tokens + (now - self._at) * self._rate)
        self._at = now


class TokenBuckets:
    """A token bucket for each key, such as a person or an address. Beyond `_REMEMBERED` keys it
    drops buckets that are certainly full again."""

    def __init__(
        self,
        capacity: float,
        rate: float,
        clock: Clock = time.monotonic,
    ) -> None:
        self._capacity: Final = capacity
        self._rate: Final = rate
        self._clock: Final = clock
        self._buckets: dict[str, TokenBucket] = {}

    def __len__(self) -> int:
        return len(self._buckets)

    def of(self, key: str) -> TokenBucket:
        """Return the bucket of a key; a new key gets a full one."""
        bucket = self._buckets.get(key)
        if bucket is None:
            bucket = self._buckets[key] = TokenBucket(self._capacity, self._rate, self._clock)
            if len(self._buckets) > _REMEMBERED:
                self._forget_full(key)
        return bucket

    def _forget_full(self, newest: str) -> None:
        since = self._clock() - self._capacity / self._rate
        self._buckets = {
            key: bucket
            for key, bucket in self._buckets.items()
            if bucket.used_at > since or key == newest
        }
