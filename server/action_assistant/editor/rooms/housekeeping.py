"""Runs the background work of one room: snapshots, measurements of opening time, and comparisons with pages.

Nobody waits for any of it, and an edit is never refused because it failed.
"""

import asyncio
import logging
from typing import Final, Protocol

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.applying import Panicked
from action_assistant.editor.crdt.messages import NOTHING_NEW, Malformed
from action_assistant.editor.crdt.replica import Replica, ReplicaState
from action_assistant.editor.crdt.trial import TooSlow, tried
from action_assistant.editor.documents.contents import shown
from action_assistant.editor.documents.fingerprint import Fingerprint
from action_assistant.editor.log.graph_events import graph_of
from action_assistant.editor.rooms.batch import ComparisonRequest
from action_assistant.errors import Refused
from action_assistant.journal.journal import Journal
from action_assistant.logs import begin
from action_assistant.web.auth.caller import detach_from_request
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

SNAPSHOT_EVENTS: Final = 1000  # after which a snapshot is made
_SNAPSHOT_BYTES: Final = 16 << 20  # of events, likewise
_RETRY_S: Final = 30.0  # until the next measurement after one that failed
_MEASURING_SHARE: Final = 20  # a measurement is not repeated for so many times as long as it took


def begin_room_task(stream: str) -> None:
    """Detach the current task from the request that began it, and label its log lines with the graph of
    this stream. Without this the task would be cancelled when that client disconnects."""
    detach_from_request()
    begin({"graph": graph_of(stream) or stream})


class RoomSnapshots:
    """Decides when the next snapshot of a room is due, and stores it in the background. `kept` is the sequence
    number of the newest snapshot."""

    def __init__(self, stream: str, journal: Journal, kept: int) -> None:
        self._stream = stream
        self._journal = journal
        self._kept = kept
        self._unkept = 0  # bytes of updates since then
        self._task: asyncio.Task[None] | None = None

    def grew(self, size: int) -> None:
        """Count `size` bytes of updates that were stored since the last snapshot."""
        self._unkept += size

    def store_if_due(self, seq: int, replica: Replica) -> None:
        """Start to store a snapshot of the document if one is due; do not wait for it. The document
        must be committed up to `seq`."""
        if seq - self._kept >= SNAPSHOT_EVENTS or self._unkept >= _SNAPSHOT_BYTES:
            state = self._state(seq, replica)
            self._task = asyncio.get_running_loop().create_task(self._store(seq, state))

    async def store_now(self, seq: int, replica: Replica) -> None:
        """Store a snapshot of the document unless the newest one is of `seq`, and wait for it. A
        failure is not raised."""
        if seq != self._kept:
            await self._store(seq, self._state(seq, replica))

    def _state(self, seq: int, replica: Replica) -> bytes:
        """Return a snapshot of the document as it is now, in bytes, with the updates that wait for
        earlier ones. From now on `seq` counts as the change up to which a snapshot is stored."""
        self._kept, self._unkept = seq, 0
        return ReplicaState.of(replica)

    async def _store(self, seq: int, state: bytes) -> None:
        begin_room_task(self._stream)
        try:
            packed = await ReplicaState.packed_aside(state)
            await self._journal.keep_snapshot(self._stream, seq, packed)
        except Refused as error:
            log.warning("%s: no snapshot: %s", self._stream, error.detail)


class OpeningTimeMeasurement:
    """Measures in a worker how long the document of a room takes to be opened, before an edit has to wait
    for that answer (decision 92)."""

    def __init__(self, stream: str, run_in_worker: RunInWorker) -> None:
        self._stream = stream
        self._run_in_worker = run_in_worker
        self._loop = asyncio.get_running_loop()
        self._not_before = 0.0
        self._task: asyncio.Task[None] | None = None

    def measure_if_due(self, replica: Replica) -> None:
        """Start a measurement in the background if one is due. Everything in the document
        (`replica`) must be committed."""
        if replica.opening.is_due and self._task is None and self._loop.time() >= self._not_before:
            self._task = self._loop.create_task(self._measure(replica))

    def cancel(self) -> None:
        """Cancel the measurement that is under way, if any."""
        if self._task is not None:
            self._task.cancel()

    async def _measure(self, replica: Replica) -> None:
        begin_room_task(self._stream)
        came, state = replica.opening.came, replica.state()
        try:
            found = await self._run_in_worker(tried, state, NOTHING_NEW, ())
        except (Refused, Malformed, Panicked, TooSlow) as error:
            log.warning("%s: how long it takes to be opened is not known: %r", self._stream, error)
            self._not_before = self._loop.time() + _RETRY_S
        else:
            replica.opening.opened(found.opening, len(state), came)
            self._not_before = self._loop.time() + _MEASURING_SHARE * found.opening
        finally:
            self._task = None


class ComparedRoom(Protocol):
    """The part of a room that a comparison reads."""

    @property
    def stream(self) -> str:
        """The stream in which the edits of the room are stored."""
        ...

    @property
    def seq(self) -> int:
        """The sequence number of the room's last committed change."""
        ...

    async def quiet(self) -> Replica:
        """Wait until no edit is being stored, and return the document. Raise Unavailable if the
        room is closed."""
        ...


class Comparisons:
    """Compares what pages show with the document of a room (rule R14). `divergences`: the number of
    pages that differed."""

    def __init__(self, room: ComparedRoom, run_in_worker: RunInWorker) -> None:
        self.divergences = 0
        self._room = room
        self._run_in_worker = run_in_worker
        self._fingerprint: tuple[int, Fingerprint] | None = None
        self._waiting: list[ComparisonRequest] = []
        self._task: asyncio.Task[None] | None = None

    def ask(self, compare: ComparisonRequest) -> None:
        """Have the fingerprint of the document computed in the background, and sent to a client. No
        answer is sent if the document gets, or already has, a change after the one
        (`compare.shown.seq`) at which the client made its own fingerprint."""
        if compare.shown.seq != self._room.seq:
            return
        self._waiting.append(compare)
        if self._task is None:
            self._task = asyncio.create_task(self._compare_all())

    def cancel(self) -> None:
        """Cancel all answers to clients that still wait."""
        if self._task is not None:
            self._task.cancel()

    async def _compare_all(self) -> None:
        """Answer all clients that wait. The fingerprint is made in a worker: a large document takes a second."""
        begin_room_task(self._room.stream)
        try:
            while self._waiting:
                found = await self._current_fingerprint()
                asked, self._waiting = self._waiting, []
                for compare in asked:
                    if compare.shown.seq == found[0]:
                        self._answer(compare, found[1])
        except Refused as error:
            log.warning("%s: nothing was compared: %s", self._room.stream, error.detail)
            self._waiting = []
        finally:
            self._task = None

    async def _current_fingerprint(self) -> tuple[int, Fingerprint]:
        """Return the fingerprint of the committed document, and its sequence number."""
        replica = await self._room.quiet()
        seq = self._room.seq
        if self._fingerprint is None or self._fingerprint[0] != seq:
            self._fingerprint = seq, await self._run_in_worker(shown, replica.state())
        return self._fingerprint

    def _answer(self, compare: ComparisonRequest, found: Fingerprint) -> None:
        said = compare.shown
        if (said.entries, said.total) != (found.entries, found.total):
            self.divergences += 1
            who = compare.member.person.id
            log.error("%s: %s shows something else at %d", self._room.stream, who, said.seq)
        compare.member.post(messages.compared(said.seq, found.entries, found.total))
