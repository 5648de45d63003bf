"""Measures how long a document takes to be opened while edits go on, before one would have to wait for it."""

import asyncio
import logging
from typing import Final

from action_assistant.editor.crdt.applying import Panicked
from action_assistant.editor.crdt.messages import NOTHING_NEW, Malformed
from action_assistant.editor.crdt.replica import Replica
from action_assistant.editor.crdt.trial import TooSlow, tried
from action_assistant.editor.rooms.room_task import begin_room_task
from action_assistant.errors import Refused
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_AGAIN: Final = 30.0  # seconds until another attempt, where one failed
_SHARE: Final = 20  # times as long as it took it is not measured again


class MeasuredAhead:
    """Of one room. Where nothing comes of it, the edit that raises a doubt is tried first, as ever."""

    def __init__(self, stream: str, run_in_worker: RunInWorker) -> None:
        self._stream = stream
        self._run_in_worker = run_in_worker
        self._loop = asyncio.get_running_loop()
        self._not_before = 0.0
        self._task: asyncio.Task[None] | None = None

    def look(self, replica: Replica) -> None:
        """Begin to measure, if that is due. Everything in the document is committed."""
        if replica.opening.is_due and self._task is None and self._loop.time() >= self._not_before:
            self._task = self._loop.create_task(self._measure(replica))

    def cancel(self) -> None:
        """It does not matter any more."""
        if self._task is not None:
            self._task.cancel()

    async def _measure(self, replica: Replica) -> None:
        begin_room_task(self._stream)
        came, state = replica.opening.came, replica.state()
        try:
            found = await self._run_in_worker(tried, state, NOTHING_NEW, ())
        except (Refused, Malformed, Panicked, TooSlow) as error:
            log.warning("%s: how long it takes to be opened is not known: %r", self._stream, error)
            self._not_before = self._loop.time() + _AGAIN
        else:
            replica.opening.opened(found.opening, len(state), came)
            self._not_before = self._loop.time() + _SHARE * found.opening
        finally:
            self._task = None
