"""A room: one document, its sockets, and the queue through which every edit enters.

Rules R1 … R16 of docs/room-protocol.md. Everything that concerns the document happens in one task,
batch by batch: apply, append, commit, and only then tell anyone.
"""

import asyncio
import logging
import time
from collections.abc import Callable, Sequence
from typing import Final, TypeVar

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.loading import Loaded, load
from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.replica import Panicked, Replica, ReplicaState, UpdateEffect
from action_assistant.editor.crdt.update_outline import UpdateOutline
from action_assistant.editor.log.graph_events import DEFERRED, UPDATED
from action_assistant.editor.rooms.batch import (
    OBJECTIONS,
    Ask,
    Compare,
    Item,
    Look,
    NotAllowed,
    Objection,
    Offer,
    Taken,
    fail,
    merged,
    next_batch,
    refuse,
    tried_first,
)
from action_assistant.editor.rooms.batch_window import BatchWindow
from action_assistant.editor.rooms.comparisons import Comparisons
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.presence import PresenceNews, RoomPresence
from action_assistant.editor.rooms.presence_spread import PresenceSpread
from action_assistant.editor.rooms.room_metrics import RoomMetrics
from action_assistant.errors import Conflict, Refused, Unavailable
from action_assistant.journal.events import Draft
from action_assistant.journal.journal import Journal
from action_assistant.logs.context import begin
from action_assistant.web.auth.caller import done_for_nobody
from action_assistant.web.workers.lanes import RunInWorker, run_here

log: Final = logging.getLogger(__name__)

T = TypeVar("T")

SNAPSHOT_EVERY: Final = 1000  # events
SNAPSHOT_BYTES: Final = 16 << 20  # of events
_DAMAGED: Final = "This graph can only be read: change {} of its history is damaged."
_CLOSING: Final = "This graph is being closed; try again."


class Room:
    """The memory of one graph. `gone` is called when nobody may join any more."""

    def __init__(
        self,
        stream: str,
        journal: Journal,
        loaded: Loaded,
        gone: Callable[["Room"], None],
        window: BatchWindow,
        moments: BatchWindow,
        run_in_worker: RunInWorker = run_here,
        tried: RunInWorker = run_here,
        metrics: RoomMetrics | None = None,
    ) -> None:
        self.stream: Final = stream
        self._metrics = metrics or RoomMetrics()
        self.seq = loaded.seq
        self.members: set[Member] = set()
        self.attendance: Final = RoomPresence()
        self._journal = journal
        self._replica = loaded.replica
        self._kept = loaded.kept
        self.damaged: Final = loaded.damaged
        self._gone = gone
        self._window = window
        self._moments = moments
        self._run_in_worker = run_in_worker
        self._tried = tried
        self._unkept = 0  # bytes of updates since the last snapshot
        self._naming = False
        self._spread: Final = PresenceSpread(self.members, window)
        self.comparisons: Final = Comparisons(self, run_in_worker)
        self._waiting: list[Item] = []
        self._in_hand: list[Item] = []
        self._ended = False
        self._news = asyncio.Event()
        self._quiet = asyncio.Event()
        self._quiet.set()
        self._task = asyncio.create_task(self._run(), name=f"room {stream}")

    # --- people ---------------------------------------------------------------------------------

    def join(self, member: Member) -> None:
        """Let a socket in: it is asked what it has, and told who is there."""
        self.members.add(member)
        if self.damaged is not None:
            member.edits = False
            member.post_read_only(_DAMAGED.format(self.damaged.seq))
        if member.edits:
            # Not from a batch that is being committed: an older state only asks for more.
            member.post(messages.question(self._replica.doc.get_state()))
        member.post_presence(PresenceNews(self.attendance.everyone()))

    def leave(self, member: Member) -> None:
        """A socket is gone, and what it said about itself with it."""
        self.members.discard(member)
        self._spread.tell(self.attendance.leave(member.seat), member)

    def hear(self, member: Member, message: messages.Message) -> None:
        """Something that a socket says. Never blocks; the answer comes through the member."""
        match message:
            case messages.Edit(update):
                member.heard_edit()
                if len(update) > messages.UPDATE_LIMIT:
                    self._metrics.refused["too_big"] += 1
                    member.refuse(messages.TOO_BIG)
                    return
                self._enter(Offer(update, member.person.id, member))
            case messages.Question(state):
                if member.asks():
                    self._enter(Ask(member, state))
            case messages.CompareMessage():
                self._enter(Compare(member, message))
            case messages.Presence(entries):
                self._spread.tell(self.attendance.hear(member.seat, entries), member)
            case messages.WhoIsThere():
                member.post_presence(PresenceNews(self.attendance.everyone()))

    # --- the door -------------------------------------------------------------------------------

    async def submit(self, update: bytes, author: str) -> int:
        """An edit of the server's own (rule R9); the seq up to which the log then goes.

        Raises BadInput, Unavailable. Returns after the commit, also when nothing changed.
        """
        if self.damaged is not None:
            raise Conflict(_DAMAGED.format(self.damaged.seq))
        if self._ended:
            raise Unavailable(_CLOSING)
        done: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        self._enter(Offer(update, author, None, done))
        return await done

    async def look(self, see: Callable[[Replica, int], T]) -> T:
        """What `see(document, seq)` finds when everything that entered before is committed.

        `see` must not change the document nor keep it. Raises what `see` does, and Unavailable.
        """
        if self._ended:
            raise Unavailable(_CLOSING)
        done: asyncio.Future[T] = asyncio.get_running_loop().create_future()
        self._enter(Look(see, done))
        return await done

    async def quiet(self) -> Replica:
        """The document when nothing is on its way: what it holds until you await is committed."""
        await self._quiet.wait()
        if self._ended:
            raise Unavailable(_CLOSING)
        return self._replica

    async def rest(self, needed: Callable[[], bool]) -> None:
        """Keep a snapshot and be freed, unless somebody needs the room by then."""
        await self._quiet.wait()
        if not self._ended:
            await self._keep_snapshot()
        if needed() or self._waiting or self._ended:
            return
        self._gone(self)  # from here on whoever comes opens another room
        await self.stop()

    async def stop(self) -> None:
        """Finish what has entered, then send everyone away."""
        await self._quiet.wait()
        self._task.cancel()
        await asyncio.wait([self._task])

    def _enter(self, item: Item) -> None:
        if self._ended:
            return  # whoever said it is being sent away, and will say it again
        self._waiting.append(item)
        self._quiet.clear()
        self._news.set()

    async def _run(self) -> None:
        """Batch after batch. Whatever goes wrong closes the room; its log opens the next one."""
        reason: Refused = Unavailable(_CLOSING)
        done_for_nobody()  # whoever came first may leave
        begin({"graph": self.stream.rpartition("/")[2]})
        try:
            while True:
                await self._news.wait()
                await self._window.open()
                await self._handle()
                if not self._waiting:
                    self._news.clear()
                    self._quiet.set()
        except Refused as error:
            log.error("%s: an edit could not be stored: %s", self.stream, error.detail)
            reason = error
        except Exception:
            log.exception("%s: the room failed", self.stream)
        finally:
            self._end(reason)

    async def _handle(self) -> None:
        batch, self._waiting, alone = next_batch(self._waiting, self._replica)
        self._in_hand = batch
        match batch:
            case [Offer() as offer] if alone:
                taken = await self._take_large(offer)
            case _:
                taken = self._take(batch)
        if taken.news:
            drafts = [Draft(kind, offer.author, offer.update) for offer, kind in taken.news]
            self.seq = await self._journal.append(self.stream, drafts, expected=self.seq)
            self._unkept += sum(len(draft.body) for draft in drafts)
        self._in_hand = []
        self._tell(taken)
        if taken.panicked:
            await self._reload()
        for ask in taken.asks:
            self._answer(ask)
        for compare in taken.compares:
            self.comparisons.ask(compare)
        for look in taken.looks:
            self._show(look)
        if self.seq - self._kept >= SNAPSHOT_EVERY or self._unkept >= SNAPSHOT_BYTES:
            await self._keep_snapshot()
        if not taken.news:
            await asyncio.sleep(0)  # nothing was awaited; others want a turn

    def _take(self, batch: Sequence[Item]) -> Taken:
        """Apply a batch. After a panic the rest of it waits for a sound document."""
        taken = Taken()
        for n, item in enumerate(batch):
            match item:
                case Ask():
                    taken.asks.append(item)
                case Compare():
                    taken.compares.append(item)
                case Look():
                    taken.looks.append(item)
                case Offer():
                    self._take_in(item, taken)
            if taken.panicked:
                self._waiting = [*batch[n + 1 :], *self._waiting]
                break
        return taken

    async def _take_large(self, offer: Offer) -> Taken:
        """Apply one edit that was tried on a copy first: how long an update takes cannot be told from
        its size, and some end the process."""
        taken = Taken()
        member = offer.member
        try:
            read = None
            if member is None or (member.edits and not member.refused):
                read = await tried_first(offer, self._replica, self._tried)
        except OBJECTIONS as error:
            self._refuse(offer, error)
            return taken
        self._take_in(offer, taken, read)
        return taken

    def _take_in(self, offer: Offer, taken: Taken, read: UpdateOutline | None = None) -> None:
        """Apply one edit, or refuse it."""
        begun = time.perf_counter()
        try:
            brought = self._brought(offer, read)
        except OBJECTIONS as error:
            taken.panicked = isinstance(error, Panicked)
            self._refuse(offer, error)
            return
        finally:
            if offer.member is not None:
                offer.member.cost(time.perf_counter() - begun)
        if brought is None:
            return
        taken.handled.append(offer)
        if brought is UpdateEffect.WAITS:
            taken.news.append((offer, DEFERRED))
        elif brought is UpdateEffect.NEWS:
            taken.news.append((offer, UPDATED))
            released = self._replica.released()
            taken.shown += [offer.update, *released]
            taken.for_all = taken.for_all or bool(released)

    def _refuse(self, offer: Offer, error: Objection) -> None:
        log.warning("%s: refused an edit of %s: %s", self.stream, offer.author, error)
        self._metrics.objected(error)
        refuse(offer, error)

    def _brought(self, offer: Offer, read: UpdateOutline | None) -> UpdateEffect | None:
        """Apply one edit; None when it was refused, or comes from a socket that was."""
        member = offer.member
        if member is not None and member.refused:
            return None
        if member is not None and not member.edits:
            if not self._replica.adds_nothing(offer.update):
                raise NotAllowed
            return UpdateEffect.NOTHING
        return self._replica.take(offer.update, offer.author, self.attendance.holder, read)

    # --- telling --------------------------------------------------------------------------------

    def _tell(self, taken: Taken) -> None:
        """What is committed: to the others as news, to those who sent it as an acknowledgement."""
        frames = [messages.change(update) for update in merged(taken.shown)]
        own = {offer.member for offer, _ in taken.news}
        for member in self.members:
            if member.synced and (taken.for_all or own != {member}):
                for frame in frames:
                    member.post(frame)
        for offer in taken.handled:
            if offer.member is not None:
                offer.member.edit_handled()
            if offer.done is not None and not offer.done.done():
                offer.done.set_result(self.seq)
        for author in {offer.member for offer in taken.handled}:
            if author is not None:
                author.post_ack(self.seq)
        self._metrics.acknowledged(taken.handled)
        if taken.news and not self._naming:
            self._naming = True
            self._moments.when_open(self._name_moment)

    def _name_moment(self) -> None:
        """Tell those who only listen which moment they show. They hear it less often than what
        changed: half of all messages of a busy room would say nothing else."""
        self._naming = False
        for member in self.members:
            member.post_ack(self.seq)

    def _answer(self, ask: Ask) -> None:
        """Sync step 2: what the client lacks."""
        try:
            lacking = self._replica.lacking(ask.state)
        except Malformed:
            ask.member.refuse(messages.MALFORMED)
            return
        ask.member.post_answer(messages.answer(lacking))
        ask.member.synced = True
        ask.member.post_ack(self.seq)

    def _show(self, look: Look) -> None:
        if look.done.done():  # nobody waits any more
            return
        try:
            look.done.set_result(look.see(self._replica, self.seq))
        except Exception as error:  # noqa: BLE001 - the looker's own
            look.done.set_exception(error)

    # --- memory ---------------------------------------------------------------------------------

    async def _reload(self) -> None:
        self._replica.close()
        loaded = await load(self._journal, self.stream, run_in_worker=self._run_in_worker)
        self._replica, self.seq, self._kept = loaded.replica, loaded.seq, loaded.kept

    async def _keep_snapshot(self) -> None:
        """Cache the document, and what waits beside it: that may be for ever."""
        if self._kept == self.seq or self.damaged is not None:
            return
        seq, state = self.seq, ReplicaState.of(self._replica)
        try:
            await self._journal.keep_snapshot(self.stream, seq, state)
        except Refused as error:
            log.warning("%s: no snapshot: %s", self.stream, error.detail)
        self._kept, self._unkept = seq, 0

    def _end(self, reason: Refused) -> None:
        """Nobody is told anything that is not stored; everyone may come again."""
        self._ended = True
        for item in [*self._in_hand, *self._waiting]:
            fail(item, reason)
        self._waiting = []
        self.comparisons.cancel()
        self._quiet.set()
        for member in self.members:
            member.close(messages.RESTARTING)
        self._replica.close()
        self._gone(self)
