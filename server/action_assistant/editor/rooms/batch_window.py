"""Decides when rooms act: a millisecond after the first edit, then once per window for all edits since.

One window for all rooms of a process: what happens within it becomes one transaction, one broadcast
of each room, and one write to each socket. How long it is follows from how busy the event loop is: short
while there is time, so that nobody waits; longer the less there is, since what goes together costs less. It
goes by the square, so that half a processor to spare is spent on answers, not saved.
"""

import asyncio
import logging
import time
from collections.abc import Callable
from contextvars import Context
from typing import Final

log: Final = logging.getLogger(__name__)

LONGEST: Final = 0.01  # seconds; nobody sees it, and a busy room needs a fifth of the work
SHORTEST: Final = 0.001  # seconds in which what people do at the same time arrives
_BUSY: Final = 0.7  # share of its processor that the loop works, from which on windows are longest
_MEMORY: Final = 0.1  # seconds over which that is looked at


class TurnEnd:
    """Calls functions of many rooms and sockets together at the end of a turn of the event loop, in
    the order of registration."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._context = Context()  # it is done for nobody
        self._work: list[Callable[[], None]] = []

    def do(self, work: Callable[[], None]) -> None:
        """Call this function at the end of the present turn of the event loop."""
        if not self._work:
            self._loop.call_soon(self._all, context=self._context)
        self._work.append(work)

    def _all(self) -> None:
        work, self._work = self._work, []
        for each in work:
            try:
                each()
            except Exception:  # that one's; all others have their turn
                log.exception("something failed at the end of a turn")


class BatchWindow:
    """Opens at most once in `longest` seconds, or more often while there is time; at every turn of
    the event loop if `longest` is 0."""

    def __init__(self, longest: float = LONGEST) -> None:
        self._longest = longest
        self._shortest = min(SHORTEST, longest)
        self._loop = asyncio.get_running_loop()
        self._next = 0.0
        #: Runs the work of a window, and what is sent because of it.
        self.turn_end: Final = TurnEnd()
        self._waiting: list[Callable[[], None]] = []
        self._looked_at = self._loop.time()
        self._worked = time.thread_time()
        self._length = self._shortest

    def when_open(self, work: Callable[[], None]) -> None:
        """Call `work` when the window opens next, together with all other waiting functions."""
        if not self._longest:
            self.turn_end.do(work)
            return
        if not self._waiting:
            at = max(self._next, self._loop.time() + self._shortest)
            self._loop.call_at(at, self._open)
        self._waiting.append(work)

    def _open(self) -> None:
        now = self._loop.time()
        if now - self._looked_at > _MEMORY:
            self._adapt_length(now)
        self._next = now + self._length
        waiting, self._waiting = self._waiting, []
        for work in waiting:
            self.turn_end.do(work)

    def _adapt_length(self, now: float) -> None:
        """Set the length of windows by the share of the time that the loop has worked lately."""
        worked = time.thread_time()
        busy = (worked - self._worked) / (now - self._looked_at)
        self._worked, self._looked_at = worked, now
        self._length = max(self._shortest, self._longest * min(1.0, busy / _BUSY) ** 2)
