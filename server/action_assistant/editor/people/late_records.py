"""Events that must take effect before the log can store them: stored as soon as it can."""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from contextvars import Context, copy_context
from typing import Final

from action_assistant.errors import Unavailable

log: Final = logging.getLogger(__name__)

_PATIENCE_S: Final = 2.0  # that a request waits for the log
_AGAIN_S: Final = 5.0


class LateRecords:
    """Runs functions that store something in the log, in order, and retries each while the log is
    Unavailable."""

    def __init__(self, what: str) -> None:
        self._what = what
        #: With the context of whoever asked, so that an event has the connection of that request.
        self._waiting: list[tuple[Callable[[], Awaitable[None]], Context]] = []
        self._task: asyncio.Task[None] | None = None

    async def add(self, store: Callable[[], Awaitable[None]]) -> None:
        """Queue a function that stores something. Wait until everything queued is stored, but at
        most 2 s: then the storing goes on in the background. While the log is Unavailable, the
        function is called again every 5 s until it succeeds. Another error is logged, and the
        function is given up."""
        self._waiting.append((store, copy_context()))
        if self._task is None or self._task.done():
            self._task = asyncio.create_task(self._store(), name=self._what)
        await asyncio.wait([self._task], timeout=_PATIENCE_S)

    async def aclose(self) -> None:
        """Cancel the storing of everything that is still queued; it is lost."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    async def _store(self) -> None:
        told = False
        while self._waiting:
            try:
                store, context = self._waiting[0]
                await asyncio.get_running_loop().create_task(_stored(store), context=context)
            except Unavailable as error:
                if not told:
                    log.warning("the log does not have %s yet: %s", self._what, error.detail)
                told = True
                await asyncio.sleep(_AGAIN_S)
                continue
            except Exception:  # the others that wait are stored all the same
                log.exception("the log cannot have one of %s", self._what)
            self._waiting.pop(0)
        if told:
            log.info("the log has %s now", self._what)


async def _stored(store: Callable[[], Awaitable[None]]) -> None:
    await store()
