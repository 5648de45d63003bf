"""Sends the members of a room what is committed, what is durable, and who is where."""

import asyncio
from collections.abc import Collection, Sequence
from typing import Final

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.messages import Malformed, PresenceEntry
from action_assistant.editor.crdt.replica import Replica
from action_assistant.editor.rooms.batch import BatchOutcome, ReadRequest, SyncRequest, merged
from action_assistant.editor.rooms.batch_window import BatchWindow
from action_assistant.editor.rooms.housekeeping import Comparisons
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.presence import PresenceNews
from action_assistant.editor.rooms.room_metrics import RoomMetrics
from action_assistant.web.server.direct import framed

_PATIENCE: Final = 1.5  # intervals that an announcement waits for an update to go along with


class UpdateBroadcast:
    """Sends committed updates to the members, and acknowledgements to their authors.

    Every member also receives the newest sequence number. Members that only receive get it every
    `interval` seconds at most: in a busy room it would be half of all messages.
    """

    def __init__(self, members: Collection[Member], interval: float, metrics: RoomMetrics) -> None:
        self._members = members
        self._metrics = metrics
        self._interval = interval
        self._loop = asyncio.get_running_loop()
        self._next_announcement = 0.0
        self._timer: asyncio.TimerHandle | None = None
        self._seq = 0

    def send(self, outcome: BatchOutcome, seq: int) -> None:
        """Send the updates of a committed batch to everybody but its author, and acknowledge every edit of
        it. `seq` is the newest sequence number."""
        self._seq = seq
        authors: dict[Member, None] = {}
        for edit in outcome.handled:
            if edit.member is not None:
                authors[edit.member] = None
                edit.member.edit_handled()
            if edit.done is not None and not edit.done.done():
                edit.done.set_result(seq)
        frames = [messages.change(update) for update in merged(outcome.to_send)]
        announces = bool(outcome.to_store) and self._announces_now()
        own = {edit.member for edit, _ in outcome.to_store}
        only_author = own.pop() if len(own) == 1 and not outcome.authors_lack_some else None
        packed = b"".join(map(framed, frames))
        for member in self._members if frames or announces else authors:
            receives = member is not only_author and member.synced
            durable = seq if announces or member in authors else None
            if member.send_now(packed if receives else b"", durable):
                continue
            for frame in frames if receives else ():
                member.post(frame)
            if durable is not None:
                member.post_ack(seq)
        self._metrics.acknowledged(outcome.handled)

    def end(self) -> None:
        """Cancel the announcement that waits."""
        if self._timer is not None:
            self._timer.cancel()

    def _announces_now(self) -> bool:
        """Return whether the newest sequence number is sent along with this batch. Otherwise a timer sends it
        alone, unless another batch comes first."""
        now = self._loop.time()
        if now < self._next_announcement:
            if self._timer is None:
                wait = _PATIENCE * self._interval
                self._timer = self._loop.call_later(wait, self._announce)
            return False
        self._next_announcement = now + self._interval
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        return True

    def _announce(self) -> None:
        self._timer = None
        self._next_announcement = self._loop.time() + self._interval
        for member in self._members:
            member.post_ack(self._seq)


class PresenceBroadcast:
    """Collects the presence entries of one batch window and sends them to the members in one message."""

    def __init__(self, members: Collection[Member], window: BatchWindow) -> None:
        self._members = members
        self._window = window
        self._said: dict[int, tuple[PresenceEntry, Member]] = {}  # in this window, by client

    def add(self, entries: Sequence[PresenceEntry], speaker: Member) -> None:
        """Send these entries of a member to the others when this window opens; of each client only
        the last entry is sent."""
        if entries and not self._said:
            self._window.when_open(self._send)
        for entry in entries:
            self._said[entry.client] = entry, speaker

    def _send(self) -> None:
        said, self._said = self._said, {}
        speakers = {speaker for _, speaker in said.values()}
        # Where several spoke, all receive one message with their own entries among the others: clients
        # ignore those, and stock servers do the same.
        only_speaker = speakers.pop() if len(speakers) == 1 else None
        everything = PresenceNews([entry for entry, _ in said.values()])
        for member in self._members:
            if member is not only_speaker and not member.send_now(everything.framed):
                member.post_presence(everything)


def answer_requests(
    outcome: BatchOutcome, replica: Replica, seq: int, comparisons: Comparisons
) -> None:
    """Answer the requests of a batch, once the edits before them are committed up to `seq`."""
    for request in outcome.sync_requests:
        _send_document(request, replica, seq)
    for comparison in outcome.comparisons:
        comparisons.ask(comparison)
    for read in outcome.reads:
        _read(read, replica, seq)


def _send_document(request: SyncRequest, replica: Replica, seq: int) -> None:
    """Answer a client's sync step 1 with step 2: the updates that it lacks."""
    try:
        lacking = replica.lacking(request.state)
    except Malformed:
        request.member.refuse(messages.MALFORMED)
        return
    request.member.post_answer(messages.answer(lacking))
    request.member.synced = True
    request.member.post_ack(seq)


def _read(request: ReadRequest, replica: Replica, seq: int) -> None:
    if request.done.done():  # nobody waits any more
        return
    try:
        request.done.set_result(request.see(replica, seq))
    except Exception as error:  # noqa: BLE001 - the reader's own
        request.done.set_exception(error)
