"""When rooms act: a millisecond after the first edit, then once per window for all that came since.

One window for all rooms of a process: what happens within it becomes one transaction, one broadcast
of each room, and one write to each socket. How long it is follows from how busy the event loop is: short
while there is time, so that nobody waits; longer the less there is, since what goes together costs less.
"""

import asyncio
import time
from collections.abc import Callable
from typing import Final

from action_assistant.editor.rooms.turn_end import TurnEnd

LONGEST: Final = 0.01  # seconds; nobody sees it, and a busy room needs a fifth of the work
SHORTEST: Final = 0.001  # seconds in which what people do at the same time arrives
_BUSY: Final = 0.5  # share of its processor that the loop works, from which on windows are longest
_MEMORY: Final = 0.1  # seconds over which that is looked at


class BatchWindow:
    """Opens at most once in `longest` seconds, or more often where there is time; always, where that is 0."""

    def __init__(self, longest: float = LONGEST) -> None:
        self._longest = longest
        self._shortest = min(SHORTEST, longest)
        self._loop = asyncio.get_running_loop()
        self._next = 0.0
        #: Where what a window opens for is done, and what comes of it is sent.
        self.turn_end: Final = TurnEnd()
        self._waiting: list[Callable[[], None]] = []
        self._looked_at = self._loop.time()
        self._worked = time.thread_time()
        self._length = self._shortest

    def when_open(self, work: Callable[[], None]) -> None:
        """Call `work` soon, with all others who wait."""
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
            self._look(now)
        self._next = now + self._length
        waiting, self._waiting = self._waiting, []
        for work in waiting:
            self.turn_end.do(work)

    def _look(self, now: float) -> None:
        """How long windows are from here on."""
        worked = time.thread_time()
        busy = (worked - self._worked) / (now - self._looked_at)
        self._worked, self._looked_at = worked, now
        self._length = max(self._shortest, self._longest * min(1.0, busy / _BUSY))
