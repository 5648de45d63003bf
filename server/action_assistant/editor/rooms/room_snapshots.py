"""Snapshots of one room: which is the newest, when the next one is made, and that nobody waits for it."""

import asyncio
import logging
from typing import Final

from action_assistant.editor.crdt.replica import Replica, ReplicaState
from action_assistant.editor.rooms.room_task import begin_room_task
from action_assistant.errors import Refused
from action_assistant.journal.journal import Journal

log: Final = logging.getLogger(__name__)

EVERY: Final = 1000  # events
_BYTES: Final = 16 << 20  # of events


class RoomSnapshots:
    """Caches what the document is. `kept`: the change after which the newest was made."""

    def __init__(self, stream: str, journal: Journal, kept: int) -> None:
        self._stream = stream
        self._journal = journal
        self._kept = kept
        self._unkept = 0  # bytes of updates since then
        self._task: asyncio.Task[None] | None = None

    def grew(self, size: int) -> None:
        """Updates of so many bytes were stored."""
        self._unkept += size

    def look(self, seq: int, replica: Replica) -> None:
        """Begin one, if it is time. All that the document holds is committed, up to `seq`."""
        if seq - self._kept >= EVERY or self._unkept >= _BYTES:
            state = self._state(seq, replica)
            self._task = asyncio.get_running_loop().create_task(self._store(seq, state))

    async def keep(self, seq: int, replica: Replica) -> None:
        """Make one, unless nothing is new; returns when it is stored, or could not be."""
        if seq != self._kept:
            await self._store(seq, self._state(seq, replica))

    def _state(self, seq: int, replica: Replica) -> bytes:
        """Of the document as it is now, and of what waits beside it: that may be for ever."""
        self._kept, self._unkept = seq, 0
        return ReplicaState.of(replica)

    async def _store(self, seq: int, state: bytes) -> None:
        begin_room_task(self._stream)
        try:
            await self._journal.keep_snapshot(self._stream, seq, state)
        except Refused as error:
            log.warning("%s: no snapshot: %s", self._stream, error.detail)
