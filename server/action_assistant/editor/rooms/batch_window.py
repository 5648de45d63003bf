"""When rooms act: at once for the first edit, then once per window for all that came since.

One window for all rooms of a process: what happens within it becomes one transaction, one broadcast
of each room, and one write to each socket.
"""

import asyncio
from collections.abc import Callable
from typing import Final

LENGTH: Final = 0.01  # seconds; nobody sees it, and a busy room needs a fifth of the work


class BatchWindow:
    """Opens at most once in `length` seconds."""

    def __init__(self, length: float = LENGTH) -> None:
        self._length = length
        self._loop = asyncio.get_running_loop()
        self._next = 0.0
        self._waiting: list[Callable[[], None]] = []

    def when_open(self, work: Callable[[], None]) -> None:
        """Call `work` soon: in this turn of the loop, or with all others who wait."""
        now = self._loop.time()
        if not self._waiting and now >= self._next:
            self._next = now + self._length
            self._loop.call_soon(work)
            return
        if not self._waiting:
            self._loop.call_at(self._next, self._open)
        self._waiting.append(work)

    async def open(self) -> None:
        """Wait until it is."""
        opened = self._loop.create_future()
        self.when_open(lambda: None if opened.done() else opened.set_result(None))
        await opened

    def _open(self) -> None:
        self._next = self._loop.time() + self._length
        waiting, self._waiting = self._waiting, []
        for work in waiting:
            work()
