"""Limits of connections: how many sockets there may be, and how fast they may be opened."""

import time
from collections import Counter
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from typing import Final

import anyio

from action_assistant.errors import TooMany
from action_assistant.kit.token_bucket import Clock, TokenBuckets
from action_assistant.settings import LoadLimits

OF_A_PERSON: Final = LoadLimits().sockets
OF_AN_ADDRESS: Final = LoadLimits().address_sockets
AT_ONCE: Final = 300  # upgrades of one address
PER_MINUTE: Final = 300  # after that


class ConcurrencyLimit:
    """Limits how many requests with large bodies of one person are read at a time; the others wait
    unread."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._turns: dict[str, tuple[anyio.Semaphore, int]] = {}

    @asynccontextmanager
    async def turn(self, person: str) -> AsyncIterator[None]:
        """Return a context that waits at its beginning until fewer contexts than the limit are open
        for this person."""
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
    """Counts and limits the open sockets of this process. Without `limits` it only counts.

    With `keeps_one`, set where Stop goes over a socket, the first socket of a person is always
    admitted.
    """

    def __init__(
        self,
        *,
        limits: bool,
        load: LoadLimits = LoadLimits(),  # noqa: B008 - it is frozen
        keeps_one: bool = False,
        clock: Clock = time.monotonic,
    ) -> None:
        self._limits = limits
        self._load = load
        self._keeps_one = keeps_one
        self._people: Counter[str] = Counter()
        self._addresses: Counter[str] = Counter()
        self._upgrades = TokenBuckets(AT_ONCE, PER_MINUTE / 60, clock)

    @contextmanager
    def admitted(self, person: str, address: str) -> Iterator[None]:
        """Return a context during which an open socket of this person and address is counted. Raise
        TooMany if either of them has too many sockets open, or has opened too many in a short time.
        """
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
        if not self._upgrades.of(address).take():
            raise TooMany("Too many connections in a short time; wait some seconds.")
        if self._people[person] >= self._load.sockets:
            raise TooMany(f"You have {self._load.sockets} pages open already; close some.")
        if self._addresses[address] >= self._load.address_sockets:
            raise TooMany(f"Your address has {self._load.address_sockets} connections already.")
