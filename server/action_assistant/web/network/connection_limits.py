"""Limits of connections: how many sockets there may be, and how fast they may be opened."""

import time
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from typing import Final

import anyio

from action_assistant.errors import TooMany

OF_A_PERSON: Final = 100  # sockets at a time
OF_AN_ADDRESS: Final = 200
AT_ONCE: Final = 300  # upgrades of one address
PER_MINUTE: Final = 300  # after that
_REMEMBERED: Final = 1000  # addresses

Clock = Callable[[], float]


class RateLimit:
    """So many at once for each address, and so many a minute after that."""

    def __init__(self, at_once: int, per_minute: int, clock: Clock = time.monotonic) -> None:
        self._at_once = at_once
        self._per_minute = per_minute
        self._clock = clock
        self._left: dict[str, tuple[float, float]] = {}  # what is left, and when that was

    def takes(self, address: str) -> bool:
        """Count one; false when it was one too many."""
        now = self._clock()
        left, then = self._left.get(address, (self._at_once, now))
        left = min(self._at_once, left + (now - then) * self._per_minute / 60)
        self._left[address] = max(0.0, left - 1), now
        if len(self._left) > _REMEMBERED:
            full = self._at_once * 60 / self._per_minute  # seconds after which all is forgiven
            self._left = {a: each for a, each in self._left.items() if now - each[1] < full}
        return left >= 1


class ConcurrencyLimit:
    """So many requests with large bodies of each person at a time; the others wait unread."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._turns: dict[str, tuple[anyio.Semaphore, int]] = {}

    @asynccontextmanager
    async def turn(self, person: str) -> AsyncIterator[None]:
        """Wait for one of the person's turns, and hold it inside the block."""
        turn, waiting = self._turns.get(person, (anyio.Semaphore(self._most), 0))
        self._turns[person] = turn, waiting + 1
        try:
            async with turn:
                yield
        finally:
            turn, waiting = self._turns.pop(person)
            if waiting > 1:
                self._turns[person] = turn, waiting - 1


class ConnectionLimits:
    """The sockets of this process. Without `limits` it only counts.

    Where the way for Stop leads over a socket, `keeps_one` keeps one for everybody: the first of a
    person is admitted however many others there are, and however fast they came.
    """

    def __init__(
        self,
        *,
        limits: bool,
        keeps_one: bool = False,
        clock: Clock = time.monotonic,
    ) -> None:
        self._limits = limits
        self._keeps_one = keeps_one
        self._people: Counter[str] = Counter()
        self._addresses: Counter[str] = Counter()
        self._upgrades = RateLimit(AT_ONCE, PER_MINUTE, clock)

    @contextmanager
    def admitted(self, person: str, address: str) -> Iterator[None]:
        """One socket, as long as you are inside. Raises TooMany."""
        if self._limits and not (self._keeps_one and not self._people[person]):
            self._check(person, address)
        self._people[person] += 1
        self._addresses[address] += 1
        try:
            yield
        finally:
            for counter, key in ((self._people, person), (self._addresses, address)):
                counter[key] -= 1
                if not counter[key]:
                    del counter[key]

    def _check(self, person: str, address: str) -> None:
        if not self._upgrades.takes(address):
            raise TooMany("Too many connections in a short time; wait some seconds.")
        if self._people[person] >= OF_A_PERSON:
            raise TooMany(f"You have {OF_A_PERSON} pages open already; close some.")
        if self._addresses[address] >= OF_AN_ADDRESS:
            raise TooMany(f"Your address has {OF_AN_ADDRESS} connections already.")
