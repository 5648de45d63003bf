"""A room: one document, its sockets, and the queue through which every edit passes.

Rules R1 to R16 of docs/room-protocol.md. The room works batch by batch: apply the edits, append them to the
log, commit, and only then send anything. Each step calls the next one; a task is started only for slow work
(decision 87).
"""

import asyncio
import logging
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Collection, Coroutine, Iterator, Sequence
from functools import partial
from typing import Any, Final

from prometheus_client import Histogram, Metric
from prometheus_client.registry import Collector

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.applying import Panicked
from action_assistant.editor.crdt.loading import Loaded, load, pieces_aside
from action_assistant.editor.crdt.messages import Malformed, PresenceEntry
from action_assistant.editor.crdt.replica import Replica, UpdateEffect
from action_assistant.editor.crdt.trial import adds_nothing
from action_assistant.editor.crdt.updates.update_outline import UpdateOutline
from action_assistant.editor.crdt.updates.update_pieces import PIECE_BYTES
from action_assistant.editor.documents.document import name_of
from action_assistant.editor.log.graph_events import DEFERRED, UPDATED, graph_of
from action_assistant.editor.rooms.batch import (
    CLOSING,
    LARGE,
    OBJECTIONS,
    BatchOutcome,
    BatchWindow,
    ComparisonRequest,
    DocumentState,
    HeldTurn,
    NameRequest,
    NotAllowed,
    Objection,
    QueueItem,
    ReadRequest,
    StateRequest,
    SubmittedEdit,
    SyncRequest,
    adds_nothing_aside,
    fail,
    merged,
    next_batch,
    refuse,
    tried_first,
)
from action_assistant.editor.rooms.housekeeping import (
    Comparisons,
    OpeningTimeMeasurement,
    RoomSnapshots,
    begin_room_task,
)
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.presence import PresenceNews, RoomPresence
from action_assistant.editor.rooms.sittings import EditSittings
from action_assistant.errors import Conflict, Overtaken, Refused, Unavailable
from action_assistant.journal.events import Addition, Draft
from action_assistant.journal.journal import Journal
from action_assistant.logs import about
from action_assistant.web.auth.caller import origin_of
from action_assistant.web.server.direct import framed
from action_assistant.web.workers.lanes import RunInWorker, run_here

log: Final = logging.getLogger(__name__)

_ACK_BUCKETS: Final = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30)
#: Intervals that an announcement waits for an update to go along with.
_ANNOUNCEMENT_WAIT: Final = 1.5
_DAMAGED: Final = "This graph can only be read: change {} of its history is damaged."
_OVERTAKEN: Final = "Others have changed this graph meanwhile; try again."
_ENDS: Final = (asyncio.CancelledError, KeyboardInterrupt, SystemExit)


class RoomMetrics(Collector):
    """Counts edits and their delays for all rooms of a process. Not thread-safe: only the event
    loop updates it."""

    def __init__(self) -> None:
        self.opened = 0
        self.unloaded = 0
        self.refused: Final[Counter[str]] = Counter()  # edits, by reason
        self.closed: Final[Counter[int]] = Counter()  # sockets, by close code
        self._acks = Histogram(
            "action_assistant_ack_seconds",
            "Time from an edit's arrival at its room until it was durable and acknowledged.",
            buckets=_ACK_BUCKETS,
            registry=None,
        )

    def acknowledged(self, edits: Sequence[SubmittedEdit]) -> None:
        """Record how long these edits waited until they were stored, or were found to change
        nothing."""
        now = time.perf_counter()
        for edit in edits:
            self._acks.observe(now - edit.at)

    def objected(self, error: Objection) -> None:
        """Count an edit that was refused for the reason `error`."""
        self.refused[_label(error)] += 1

    def collect(self) -> Iterator[Metric]:
        """Yield the metrics, as `prometheus_client` asks a collector for them."""
        yield from self._acks.collect()


def _label(error: Objection) -> str:
    """Return the name of the class of an error in snake case, as labels of metrics are written."""
    name = type(error).__name__
    return "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")


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
        """Send the updates of a committed batch (`outcome`) to all members but their author, and
        acknowledge its edits. `seq` is the newest sequence number."""
        self._seq = seq
        authors: dict[Member, None] = {}
        for edit in outcome.handled:
            if edit.member is not None:
                authors[edit.member] = None
                edit.member.edit_handled()
            if edit.done is not None and not edit.done.done():
                edit.done.set_result(outcome.seq_for(edit, seq))
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
        """Cancel the announcement of a sequence number that waits."""
        if self._timer is not None:
            self._timer.cancel()

    def _announces_now(self) -> bool:
        """Return whether the newest sequence number is sent along with this batch. Otherwise a timer sends it
        alone, unless another batch comes first."""
        now = self._loop.time()
        if now < self._next_announcement:
            if self._timer is None:
                wait = _ANNOUNCEMENT_WAIT * self._interval
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
        """Send entries of a member (`speaker`) to the others when the batch window opens; of each
        client only the last entry is sent."""
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
    """Answer the requests of a batch (`outcome`) from the document (`replica`), once the edits
    before them are committed up to `seq`. `comparisons`: answers the fingerprints."""
    for request in outcome.sync_requests:
        _send_document(request, replica, seq)
    for comparison in outcome.comparisons:
        comparisons.ask(comparison)
    for read in outcome.reads:
        _answer_read(read, replica, seq)


def _send_document(request: SyncRequest, replica: Replica, seq: int) -> None:
    """Answer a client's sync step 1 with step 2: the updates that it lacks. Close its socket if it
    asks in a wrong form."""
    try:
        lacking = replica.lacking(request.state)
    except Malformed:
        request.member.refuse(messages.MALFORMED)
        return
    request.member.post_answer(messages.answer(lacking))
    request.member.synced = True
    request.member.post_ack(seq)


def _answer_read(request: ReadRequest, replica: Replica, seq: int) -> None:
    if request.done.done():  # the caller has left
        return
    match request:
        case StateRequest(done):
            done.set_result(DocumentState(seq, replica.state()))
        case NameRequest(done):
            done.set_result(name_of(replica.doc))


class Room:
    """Holds the document of one graph in memory while it is in use, and applies, stores and
    broadcasts its edits. `on_end` is called when no member may join any more. `run_in_worker` runs
    work that grows with the document, `tried` runs trials of large edits. `epoch`: how often the stream had
    changed hands when this editor took it, of several; an edit is refused once another one has it."""

    def __init__(
        self,
        stream: str,
        journal: Journal,
        loaded: Loaded,
        on_end: Callable[["Room"], None],
        window: BatchWindow,
        announcement_interval: float = 0.0,
        run_in_worker: RunInWorker = run_here,
        tried: RunInWorker = run_here,
        metrics: RoomMetrics | None = None,
        epoch: int | None = None,
    ) -> None:
        self.stream: Final = stream
        self._epoch = epoch
        self._graph: Final = graph_of(stream) or stream
        self._metrics = metrics or RoomMetrics()
        self.seq = loaded.seq
        self.members: set[Member] = set()
        self.presence: Final = RoomPresence()
        self._journal = journal
        self._replica = loaded.replica
        self._snapshots: Final = RoomSnapshots(stream, journal, loaded.kept)
        self.damaged: Final = loaded.damaged
        #: False from the moment at which the deletion of the graph begins.
        self.graph_exists = True
        self._on_end = on_end
        self._window = window
        self.turn_end: Final = window.turn_end
        self._run_in_worker = run_in_worker
        self._tried = tried
        self._sittings: Final = EditSittings()
        self._updates: Final = UpdateBroadcast(self.members, announcement_interval, self._metrics)
        self._presence_updates: Final = PresenceBroadcast(self.members, window)
        self.comparisons: Final = Comparisons(self, run_in_worker)
        self._opening_time: Final = OpeningTimeMeasurement(stream, tried)
        self._waiting: list[QueueItem] = []
        self._batch: list[QueueItem] = []  # being processed
        self._one_held_turn: Final = asyncio.Lock()  # at a time: between two, others have theirs
        self._ended = self._is_busy = False
        self._loop = asyncio.get_running_loop()
        self._idle = asyncio.Event()
        self._idle.set()
        self._slow_work: asyncio.Task[None] | None = None  # of the batch being processed

    # --- members --------------------------------------------------------------------------------

    def join(self, member: Member) -> None:
        """Add the socket of a member: ask which updates it has that the room lacks (sync step 1),
        and send it the presence of the others."""
        self.members.add(member)
        if self.damaged is not None:
            member.edits = False
            member.post_read_only(_DAMAGED.format(self.damaged.seq))
        if member.edits:
            # The state may already hold a batch that is being committed. If that fails, the room closes and
            # the client sends everything again.
            member.post(messages.question(self._replica.doc.get_state()))
        member.post_presence(PresenceNews(self.presence.everyone()))

    def leave(self, member: Member) -> None:
        """Remove the socket of a member, and its presence entry with it."""
        self.members.discard(member)
        self._presence_updates.add(self.presence.leave(member.presence_owner), member)

    def receive(self, member: Member, message: messages.Message) -> None:
        """Process a message of a member's socket. The call never waits; the answer is posted to the
        member later."""
        match message:
            case messages.Edit(update):
                member.edit_received()
                if len(update) > messages.UPDATE_LIMIT:
                    self._metrics.refused["too_big"] += 1
                    member.refuse(messages.TOO_BIG)
                    return
                self._enqueue(SubmittedEdit(update, member.person.id, member, origin=member.origin))
            case messages.Presence(entries):
                self._presence_updates.add(
                    self.presence.update(member.presence_owner, entries), member
                )
            case messages.Question(state):
                if member.begins_sync():
                    self._enqueue(SyncRequest(member, state))
            case messages.CompareMessage():
                self._enqueue(ComparisonRequest(member, message))
            case messages.WhoIsThere():
                member.post_presence(PresenceNews(self.presence.everyone()))

    # --- requests of the server itself ----------------------------------------------------------

    async def submit(self, update: bytes, author: str, expected: int | None = None) -> int:
        """Apply and store an edit (`update`) of the server itself in the name of `author` (rule
        R9), and wait for the commit. Return the number (seq) of the last committed change then,
        also if the edit changed nothing. Raise BadInput or TooLarge if the edit is refused,
        Conflict if the log is damaged, Unavailable if the room is closed or the edit cannot be
        stored. `expected`: the change after which the edit was computed. Raise Overtaken if
        it is not the last one when the turn of the edit comes; else return the number of the edit
        itself, or `expected` if it changed nothing."""
        self._require_edits()
        done: asyncio.Future[int] = self._loop.create_future()
        origin = origin_of(author)
        self._enqueue(SubmittedEdit(update, author, None, done, origin=origin, expected=expected))
        return await done

    async def submit_in_turn(
        self, author: str, compute: Callable[[bytes, int], Awaitable[bytes]]
    ) -> int:
        """Do what `submit` does with the edit that `compute` returns for the document (encoded) and
        the number of its last change. Edits of others wait meanwhile, so that none can overtake this
        one. `compute` must not ask this room. Raise what `compute` raises; Overtaken if it takes
        longer than `HELD_S` seconds."""
        async with self._one_held_turn:
            self._require_edits()
            turn = HeldTurn(author)
            self._enqueue(turn)
            return await turn.take(compute)

    async def now(self) -> DocumentState:
        """Return the document once all earlier edits are committed. Raise Unavailable if the room
        is closed."""
        request = StateRequest(self._loop.create_future())
        self._ask(request)
        return await request.done

    async def name(self) -> str:
        """Return the name of the graph once all earlier edits are committed; "" if it has none.
        Raise Unavailable if the room is closed."""
        request = NameRequest(self._loop.create_future())
        self._ask(request)
        return await request.done

    def _ask(self, request: ReadRequest) -> None:
        if self._ended:
            raise Unavailable(CLOSING)
        self._enqueue(request)

    async def quiet(self) -> Replica:
        """Wait until no edit is being stored, and return the document, which is the committed one
        until the next `await`. Raise Unavailable if the room is closed."""
        await self._idle.wait()
        if self._ended:
            raise Unavailable(CLOSING)
        return self._replica

    async def close_if_unused(self, is_needed: Callable[[], bool]) -> None:
        """Store a snapshot, then end the room unless `is_needed()` returns True by then."""
        await self._idle.wait()
        if not self._ended and self.damaged is None:
            await self._snapshots.store_now(self.seq, self._replica)
        if is_needed() or self._waiting or self._ended:
            return
        self._on_end(self)  # from here on a new socket opens another room
        await self.stop()

    async def stop(self) -> None:
        """Finish the batch being processed, then close all sockets."""
        await self._idle.wait()
        if not self._ended:
            self._end(Unavailable(CLOSING))

    def _require_edits(self) -> None:
        if self.damaged is not None:
            raise Conflict(_DAMAGED.format(self.damaged.seq))
        if self._ended:
            raise Unavailable(CLOSING)

    def end(self) -> None:
        """Close all sockets at once, so that clients connect again. Edits that are being stored are not
        acknowledged."""
        self._end(Unavailable(CLOSING))

    # --- batch after batch ----------------------------------------------------------------------

    def _enqueue(self, item: QueueItem) -> None:
        if self._ended:
            return  # the client is being disconnected, and will send it again
        self._waiting.append(item)
        if not self._is_busy:
            self._is_busy = True
            self._idle.clear()
            self._window.when_open(self._process_batch)

    def _process_batch(self) -> None:
        """Take the next batch from the queue, apply it, and have it stored."""
        if self._ended:
            return
        try:
            batch, self._waiting, needs_trial = next_batch(self._waiting, self._replica)
            self._batch = batch
            match batch:
                case [HeldTurn() as turn]:
                    self._start_slow_work(self._apply_held(turn))
                case [SubmittedEdit() as edit] if needs_trial:
                    self._start_slow_work(self._apply_after_trial(edit))
                case _:
                    self._store(self._apply_batch(batch))
        except BaseException as error:  # noqa: BLE001 - also a panic of the library: it ends this room alone
            self._fail(error)

    def _store(self, outcome: BatchOutcome) -> None:
        if not outcome.to_store:
            self._after_commit(outcome)
            return
        drafts = tuple([Draft(kind, edit.author, edit.update) for edit, kind in outcome.to_store])
        addition = Addition(self.stream, drafts, self.seq, self._epoch)
        edits = [edit for edit, _ in outcome.to_store]
        also = self._sittings.begun(self._graph, edits, self.seq + 1)
        self._journal.append_then(addition, partial(self._stored, outcome), *also)

    def _stored(self, outcome: BatchOutcome, seq: int | None, error: BaseException | None) -> None:
        """Continue with the batch `outcome` after its commit with the sequence number `seq`, or end
        the room if the commit failed with `error`."""
        if self._ended:
            return
        try:
            if seq is None:
                raise error or Unavailable(CLOSING)
            self.seq = seq
            self._snapshots.grew(sum([len(edit.update) for edit, _ in outcome.to_store]))
            self._after_commit(outcome)
        except BaseException as failure:  # noqa: BLE001 - as in `_process_batch`
            self._fail(failure)

    def _after_commit(self, outcome: BatchOutcome) -> None:
        self._updates.send(outcome, self.seq)
        if outcome.panicked:
            self._start_slow_work(self._reload_and_answer(outcome))
            return
        self._answer(outcome)

    async def _reload_and_answer(self, outcome: BatchOutcome) -> None:
        await self._reload()
        self._answer(outcome)

    def _answer(self, outcome: BatchOutcome) -> None:
        """Answer the requests of the batch `outcome`, which ends it, and begin the next one."""
        answer_requests(outcome, self._replica, self.seq, self.comparisons)
        if outcome.to_store:
            self._opening_time.measure_if_due(self._replica)
            self._snapshots.store_if_due(self.seq, self._replica)
        self._batch = []
        if self._waiting:
            self._window.when_open(self._process_batch)
        else:
            self._is_busy = False
            self._idle.set()

    def _start_slow_work(self, work: Coroutine[Any, Any, None]) -> None:
        """Run slow work on the current batch in a task; the room processes nothing else meanwhile."""

        async def guarded() -> None:
            begin_room_task(self.stream)
            try:
                await work
            except BaseException as error:  # noqa: BLE001 - as in `_process_batch`
                self._fail(error)

        self._slow_work = self._loop.create_task(guarded())

    def _fail(self, error: BaseException) -> None:
        """Log an error and end the room; the next one is loaded from the log. Raise an error again
        that ends a task or the process."""
        reason = error if isinstance(error, Refused) else Unavailable(CLOSING)
        with about("graph", self._graph):
            if isinstance(error, Refused):
                log.error("%s: an edit could not be stored: %s", self.stream, error.detail)
            elif not isinstance(error, _ENDS):
                log.error("%s: the room failed", self.stream, exc_info=error)
        is_away = isinstance(error, Unavailable)
        self._end(reason, messages.NOT_STORED if is_away else messages.RESTARTING)
        if isinstance(error, _ENDS):
            raise error

    def _apply_batch(self, batch: Sequence[QueueItem]) -> BatchOutcome:
        """Apply the edits of a batch to the document, and return what to store, send and answer.
        After a panic of the library the remaining edits wait until the document is loaded again."""
        outcome = BatchOutcome()
        for n, item in enumerate(batch):
            match item:
                case SubmittedEdit():
                    self._apply(item, outcome)
                case SyncRequest():
                    outcome.sync_requests.append(item)
                case ComparisonRequest():
                    outcome.comparisons.append(item)
                case StateRequest() | NameRequest():
                    outcome.reads.append(item)
            if outcome.panicked:
                self._waiting = [*batch[n + 1 :], *self._waiting]
                break
        return outcome

    async def _apply_held(self, turn: HeldTurn) -> None:
        """Let the server compute an edit of the document as it is, and apply that."""
        edit = await turn.begin(DocumentState(self.seq, self._replica.state()))
        if edit is None:
            self._store(BatchOutcome())
            return
        self._batch = [edit]
        await self._apply_after_trial(edit)

    async def _apply_after_trial(self, edit: SubmittedEdit) -> None:
        """Try one edit on a copy of the document, and apply it if that went well: how long an update takes
        does not follow from its size, and some updates end the process."""
        outcome = BatchOutcome()
        member = edit.member
        try:
            if self._is_overtaken(edit, outcome):
                fail(edit, Overtaken(_OVERTAKEN))
            elif member is not None and not member.edits and len(edit.update) > LARGE:
                await self._check_large_edit_of_viewer(edit, member, outcome)
            else:
                read = None
                if member is None or (member.edits and not member.refused):
                    read = await tried_first(edit, self._replica, self._tried)
                if read is not None and len(edit.update) > PIECE_BYTES:
                    await self._apply_in_pieces(edit, outcome, read)
                else:
                    self._apply(edit, outcome, read)
        except OBJECTIONS as error:
            self._refuse(edit, error)
        self._store(outcome)

    async def _check_large_edit_of_viewer(
        self, edit: SubmittedEdit, member: Member, outcome: BatchOutcome
    ) -> None:
        """Acknowledge an edit of a person who may only view, if it changes nothing: it is added to
        `outcome`. Raise NotAllowed if it changes anything."""
        if member.refused:
            return
        state = self._replica.doc.get_state()
        if not await adds_nothing_aside(edit, state, self._tried):
            raise NotAllowed
        outcome.handled.append(edit)

    def _apply(
        self, edit: SubmittedEdit, outcome: BatchOutcome, read: UpdateOutline | None = None
    ) -> None:
        """Apply one edit and add it to `outcome`, or refuse it. `read`: its outline, if the caller
        has it."""
        if self._is_overtaken(edit, outcome):
            fail(edit, Overtaken(_OVERTAKEN))
            return
        begun = time.thread_time()
        try:
            effect = self._effect_of(edit, read)
        except OBJECTIONS as error:
            outcome.panicked = isinstance(error, Panicked)
            self._refuse(edit, error)
            return
        finally:
            if edit.member is not None:
                edit.member.used_cpu(time.thread_time() - begun)
        if effect is not None:
            self._note_effect(edit, outcome, effect)

    def _is_overtaken(self, edit: SubmittedEdit, outcome: BatchOutcome) -> bool:
        """Return whether an edit expects another last change than this one. `outcome`: of the edits
        before it in its batch."""
        expected = edit.expected
        return expected is not None and (expected != self.seq or bool(outcome.to_store))

    async def _apply_in_pieces(
        self, edit: SubmittedEdit, outcome: BatchOutcome, read: UpdateOutline
    ) -> None:
        """Apply one large edit that was tried, and add it to `outcome`, or refuse it. `read`: its
        outline. Other tasks run between its pieces."""
        pieces = await pieces_aside(edit.update, self._tried)
        member, holder = edit.member, self.presence.holder
        if member is not None and member.refused:
            return
        replica = self._replica
        before = replica.pieces_s
        try:
            effect = await replica.take_in_pieces(edit.update, edit.author, holder, read, pieces)
        except OBJECTIONS as error:
            outcome.panicked = isinstance(error, Panicked)
            self._refuse(edit, error)
            return
        finally:
            if member is not None:
                member.used_cpu(replica.pieces_s - before)
        self._note_effect(edit, outcome, effect)

    def _note_effect(
        self, edit: SubmittedEdit, outcome: BatchOutcome, effect: UpdateEffect
    ) -> None:
        """Add an edit that was applied with this effect to the outcome: the event to store, and the
        updates to send."""
        outcome.handled.append(edit)
        if effect is UpdateEffect.WAITS:
            outcome.to_store.append((edit, DEFERRED))
        elif effect is UpdateEffect.NEWS:
            outcome.to_store.append((edit, UPDATED))
            released = self._replica.released()
            outcome.to_send += [edit.update, *released]
            outcome.authors_lack_some = outcome.authors_lack_some or bool(released)

    def _refuse(self, edit: SubmittedEdit, error: Objection) -> None:
        with about("graph", self._graph):
            log.warning("%s: refused an edit of %s: %s", self.stream, edit.author, error)
        self._metrics.objected(error)
        refuse(edit, error)

    def _effect_of(self, edit: SubmittedEdit, read: UpdateOutline | None) -> UpdateEffect | None:
        """Apply one edit and return its effect; None if its socket was refused before. `read`: its
        outline, if the caller has it. Raise NotAllowed if its person may only view and it changes
        anything."""
        member = edit.member
        if member is not None and member.refused:
            return None
        if member is not None and not member.edits:
            if not adds_nothing(self._replica.doc.get_state(), edit.update):
                raise NotAllowed
            return UpdateEffect.NOTHING
        return self._replica.take(edit.update, edit.author, self.presence.holder, read)

    # --- memory ---------------------------------------------------------------------------------

    async def _reload(self) -> None:
        loaded = await load(self._journal, self.stream, run_in_worker=self._run_in_worker)
        self._replica, self.seq = loaded.replica, loaded.seq

    def _end(self, reason: Refused, code: int = messages.RESTARTING) -> None:
        """End the room: fail all requests with `reason`, and close all sockets with `code`, so that
        clients reconnect."""
        if self._ended:
            return
        self._ended = True
        for item in [*self._batch, *self._waiting]:
            fail(item, reason)
        self._waiting = []
        self.comparisons.cancel()
        self._opening_time.cancel()
        self._updates.end()
        if self._slow_work is not None and self._slow_work is not asyncio.current_task():
            self._slow_work.cancel()
        self._idle.set()
        for member in self.members:
            member.close(code)
        self._on_end(self)
