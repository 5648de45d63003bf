"""Rate limits of rooms: bytes of each person and minute. A socket beyond them is read later; nothing is refused."""

import time
from typing import Final

from action_assistant.kit.token_bucket import Clock, TokenBuckets

PER_MINUTE: Final = 16 << 20  # bytes, of all sockets of a person
AT_ONCE: Final = 32 << 20  # bytes: a large graph after a day without a network
#: Bytes that a presence message counts for at least, so that 200 of them a second are allowed without end.
_PRESENCE: Final = PER_MINUTE // (60 * 200)


class ByteRateLimits:
    """Counts the bytes that each person sends. Without `limits` it never delays anybody."""

    def __init__(self, *, limits: bool, clock: Clock = time.monotonic) -> None:
        self._limits = limits
        self._buckets: Final = TokenBuckets(AT_ONCE, PER_MINUTE / 60, clock)

    def spend_on_presence(self, person: str, size: int) -> float:
        """Count a presence message of `size` bytes; return as `spend` does."""
        return self.spend(person, max(size, _PRESENCE))

    def spend(self, person: str, size: int) -> float:
        """Count `size` bytes that a person sent; return the seconds to wait before more of theirs is read."""
        if not self._limits:
            return 0.0
        bucket = self._buckets.of(person)
        bucket.spend(size)
        return bucket.debt()
