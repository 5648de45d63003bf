"""Who hears of events as they are committed."""

import asyncio
from collections import deque
from collections.abc import Sequence
from typing import Final

from action_assistant.journal.events import Event

_HELD: Final = 1000  # events that wait for a follower in memory; after that it reads them


class Follower:
    """What waits for one follower."""

    def __init__(self) -> None:
        self._waiting: deque[Event] = deque()
        self._missed = False
        self._ended = False
        self._news = asyncio.Event()

    def hear(self, events: Sequence[Event]) -> None:
        """What was committed just now."""
        if not events or self._missed:
            return
        if len(self._waiting) + len(events) > _HELD:
            self._waiting.clear()
            self._missed = True
        else:
            self._waiting.extend(events)
        self._news.set()

    def wake(self) -> None:
        """There is more to read."""
        self._waiting.clear()
        self._missed = True
        self._news.set()

    def end(self) -> None:
        """Nothing will come any more."""
        self._ended = True
        self._news.set()

    async def next(self) -> list[Event] | None:
        """What came; empty when something was missed and has to be read; None at the end."""
        await self._news.wait()
        found = list(self._waiting)
        if self._ended and not found and not self._missed:
            return None
        self._waiting.clear()
        self._missed = False
        if not self._ended:
            self._news.clear()
        return found
