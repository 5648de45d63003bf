"""Queues committed events for one reader that follows the journal."""

import asyncio
from collections import deque
from collections.abc import Sequence
from typing import Final

from action_assistant.journal.events import Event

_HELD: Final = 1000  # events that wait for a follower in memory; after that it reads them


class Follower:
    """The bounded queue of committed events for one reader."""

    def __init__(self) -> None:
        self._waiting: deque[Event] = deque()
        self._missed = False
        self._ended = False
        self._news = asyncio.Event()

    def hear(self, events: Sequence[Event]) -> None:
        """Queue events that were just committed; a full queue is dropped, and the reader reads the
        log instead."""
        if not events or self._missed:
            return
        if len(self._waiting) + len(events) > _HELD:
            self._waiting.clear()
            self._missed = True
        else:
            self._waiting.extend(events)
        self._news.set()

    def wake(self) -> None:
        """Empty the queue of events, and have the reader read the events from the log instead."""
        self._waiting.clear()
        self._missed = True
        self._news.set()

    def end(self) -> None:
        """End the queue: no event will come any more."""
        self._ended = True
        self._news.set()

    async def next(self) -> list[Event] | None:
        """Wait for events and return them; return [] if the log has to be read, None at the end."""
        await self._news.wait()
        found = list(self._waiting)
        if self._ended and not found and not self._missed:
            return None
        self._waiting.clear()
        self._missed = False
        if not self._ended:
            self._news.clear()
        return found
