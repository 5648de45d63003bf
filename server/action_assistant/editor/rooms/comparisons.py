"""Comparisons: whether what a socket shows is what the document says (rule R14)."""

import asyncio
import logging
from typing import Final, Protocol

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.replica import Replica
from action_assistant.editor.documents.contents import shown
from action_assistant.editor.documents.fingerprint import Fingerprint
from action_assistant.editor.rooms.batch import Compare
from action_assistant.editor.rooms.room_task import begin_room_task
from action_assistant.errors import Refused
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)


class ComparedRoom(Protocol):
    """What is compared with."""

    @property
    def stream(self) -> str:
        """Which one."""
        ...

    @property
    def seq(self) -> int:
        """The last change that is committed."""
        ...

    async def quiet(self) -> Replica:
        """The document when nothing is on its way. Raises Unavailable."""
        ...


class Comparisons:
    """Those of one room. `divergences` counts sockets that showed something else."""

    def __init__(self, room: ComparedRoom, run_in_worker: RunInWorker) -> None:
        self.divergences = 0
        self._room = room
        self._run_in_worker = run_in_worker
        self._fingerprint: tuple[int, Fingerprint] | None = None
        self._waiting: list[Compare] = []
        self._task: asyncio.Task[None] | None = None

    def ask(self, compare: Compare) -> None:
        """Tell a client what it should show, if nothing has changed since it looked."""
        said = compare.shown
        if said.seq != self._room.seq:
            return
        self._waiting.append(compare)
        if self._task is None:
            self._task = asyncio.create_task(self._compare_all())

    def cancel(self) -> None:
        """Nobody is told any more."""
        if self._task is not None:
            self._task.cancel()

    async def _compare_all(self) -> None:
        """What a document shows is looked at aside: that takes a second for a large one."""
        begin_room_task(self._room.stream)
        try:
            while self._waiting:
                found = await self._shown()
                asked, self._waiting = self._waiting, []
                for compare in asked:
                    if compare.shown.seq == found[0]:
                        self._say_whether_same(compare, found[1])
        except Refused as error:
            log.warning("%s: nothing was compared: %s", self._room.stream, error.detail)
            self._waiting = []
        finally:
            self._task = None

    async def _shown(self) -> tuple[int, Fingerprint]:
        """What is shown, and at which seq. Nothing is on its way meanwhile that was not there."""
        replica = await self._room.quiet()
        seq = self._room.seq
        if self._fingerprint is None or self._fingerprint[0] != seq:
            state = replica.state()
            self._fingerprint = seq, await self._run_in_worker(shown, state)
        return self._fingerprint

    def _say_whether_same(self, compare: Compare, found: Fingerprint) -> None:
        said = compare.shown
        if (said.entries, said.total) != (found.entries, found.total):
            self.divergences += 1
            who = compare.member.person.id
            log.error("%s: %s shows something else at %d", self._room.stream, who, said.seq)
        compare.member.post(messages.compared(said.seq, found.entries, found.total))
