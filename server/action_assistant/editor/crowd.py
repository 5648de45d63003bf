"""How many sockets there may be, and how fast they may come."""

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from action_assistant.errors import TooMany

OF_A_PERSON: Final = 100  # sockets at a time
OF_AN_ADDRESS: Final = 200
AT_ONCE: Final = 300  # upgrades of one address
PER_MINUTE: Final = 300  # after that
_REMEMBERED: Final = 1000  # addresses


class Crowd:
    """The sockets of this process. Without `limits` it only counts."""

    def __init__(self, *, limits: bool, clock: Callable[[], float] = time.monotonic) -> None:
        self._limits = limits
        self._clock = clock
        self._people: Counter[str] = Counter()
        self._addresses: Counter[str] = Counter()
        self._upgrades: dict[str, tuple[float, float]] = {}  # what is left, and when that was

    @contextmanager
    def admitted(self, person: str, address: str) -> Iterator[None]:
        """One socket, as long as you are inside. Raises TooMany."""
        if self._limits:
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
        if not self._has_upgrade(address):
            raise TooMany("Too many connections in a short time; wait some seconds.")
        if self._people[person] >= OF_A_PERSON:
            raise TooMany(f"You have {OF_A_PERSON} graphs open already; close some.")
        if self._addresses[address] >= OF_AN_ADDRESS:
            raise TooMany(f"Your address has {OF_AN_ADDRESS} connections already.")

    def _has_upgrade(self, address: str) -> bool:
        now = self._clock()
        left, then = self._upgrades.get(address, (AT_ONCE, now))
        left = min(AT_ONCE, left + (now - then) * PER_MINUTE / 60)
        self._upgrades[address] = max(0.0, left - 1), now
        if len(self._upgrades) > _REMEMBERED:
            full = AT_ONCE * 60 / PER_MINUTE  # seconds after which all is forgiven
            self._upgrades = {a: u for a, u in self._upgrades.items() if now - u[1] < full}
        return left >= 1
