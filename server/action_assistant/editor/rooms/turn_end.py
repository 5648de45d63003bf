"""The end of a turn of the event loop: what many rooms and sockets have to do then is one call of it."""

import asyncio
import logging
from collections.abc import Callable
from contextvars import Context
from typing import Final

log: Final = logging.getLogger(__name__)


class TurnEnd:
    """Of one event loop. Work is called once, in the order in which it was put here."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._context = Context()  # it is done for nobody
        self._work: list[Callable[[], None]] = []

    def do(self, work: Callable[[], None]) -> None:
        """Call this soon, behind what is on its way in this turn."""
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
