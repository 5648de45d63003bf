"""A room: one document, its sockets, and the queue through which every edit enters.

Rules R1 … R16 of docs/room-protocol.md. Everything that concerns the document happens batch by batch:
apply, append, commit, and only then tell anyone. One step calls the next; a task is begun only for what
takes long (decision 87).
"""

import asyncio
import logging
import time
from collections.abc import Callable, Coroutine, Sequence
from functools import partial
from typing import Any, Final, TypeVar

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.applying import Panicked
from action_assistant.editor.crdt.loading import Loaded, load, pieces_aside
from action_assistant.editor.crdt.replica import Replica, UpdateEffect
from action_assistant.editor.crdt.trial import adds_nothing
from action_assistant.editor.crdt.updates.update_outline import UpdateOutline
from action_assistant.editor.crdt.updates.update_pieces import PIECE_BYTES
from action_assistant.editor.log.graph_events import DEFERRED, UPDATED, graph_of
from action_assistant.editor.rooms.batch import (
    LARGE,
    OBJECTIONS,
    Ask,
    Compare,
    Item,
    Look,
    NotAllowed,
    Objection,
    Offer,
    Taken,
    adds_nothing_aside,
    fail,
    next_batch,
    refuse,
    tried_first,
)
from action_assistant.editor.rooms.batch_window import BatchWindow
from action_assistant.editor.rooms.comparisons import Comparisons
from action_assistant.editor.rooms.measured_ahead import MeasuredAhead
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.presence import PresenceNews, RoomPresence
from action_assistant.editor.rooms.presence_spread import PresenceSpread
from action_assistant.editor.rooms.room_metrics import RoomMetrics
from action_assistant.editor.rooms.room_news import RoomNews, answer_all
from action_assistant.editor.rooms.room_snapshots import RoomSnapshots
from action_assistant.editor.rooms.room_task import begin_room_task
from action_assistant.errors import Conflict, Refused, Unavailable
from action_assistant.journal.events import Addition, Draft
from action_assistant.journal.journal import Journal
from action_assistant.logs.context import about
from action_assistant.web.workers.lanes import RunInWorker, run_here

log: Final = logging.getLogger(__name__)

T = TypeVar("T")

_DAMAGED: Final = "This graph can only be read: change {} of its history is damaged."
_CLOSING: Final = "This graph is being closed; try again."
_ENDS: Final = (asyncio.CancelledError, KeyboardInterrupt, SystemExit)


class Room:
    """The memory of one graph. `gone` is called when nobody may join any more."""

    def __init__(
        self,
        stream: str,
        journal: Journal,
        loaded: Loaded,
        gone: Callable[["Room"], None],
        window: BatchWindow,
        moments: float = 0.0,
        run_in_worker: RunInWorker = run_here,
        tried: RunInWorker = run_here,
        metrics: RoomMetrics | None = None,
    ) -> None:
        self.stream: Final = stream
        self._graph: Final = graph_of(stream) or stream
        self._metrics = metrics or RoomMetrics()
        self.seq = loaded.seq
        self.members: set[Member] = set()
        self.attendance: Final = RoomPresence()
        self._journal = journal
        self._replica = loaded.replica
        self._snapshots: Final = RoomSnapshots(stream, journal, loaded.kept)
        self.damaged: Final = loaded.damaged
        self.is_of_sure_graph = True  # nobody has begun to delete it
        self._gone = gone
        self._window = window
        self.turn_end: Final = window.turn_end
        self._run_in_worker = run_in_worker
        self._tried = tried
        self._spoken: Final = RoomNews(self.members, moments, self._metrics)
        self._spread: Final = PresenceSpread(self.members, window)
        self.comparisons: Final = Comparisons(self, run_in_worker)
        self._waiting: list[Item] = []
        self._in_hand: list[Item] = []
        self._ended = self._is_busy = False
        self._loop = asyncio.get_running_loop()
        self._quiet = asyncio.Event()
        self._quiet.set()
        self._aside: asyncio.Task[None] | None = None  # what takes long of the batch in hand
        self._measured: Final = MeasuredAhead(stream, tried)

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
        self._spread.tell(self.attendance.leave(member.presence_owner), member)

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
            case messages.Presence(entries):
                self._spread.tell(self.attendance.hear(member.presence_owner, entries), member)
            case messages.Question(state):
                if member.asks():
                    self._enter(Ask(member, state))
            case messages.CompareMessage():
                self._enter(Compare(member, message))
            case messages.WhoIsThere():
                member.post_presence(PresenceNews(self.attendance.everyone()))

    # --- what the server itself asks for --------------------------------------------------------

    async def submit(self, update: bytes, author: str) -> int:
        """An edit of the server's own (rule R9); the seq up to which the log then goes.

        Raises BadInput, Unavailable. Returns after the commit, also when nothing changed.
        """
        if self.damaged is not None:
            raise Conflict(_DAMAGED.format(self.damaged.seq))
        if self._ended:
            raise Unavailable(_CLOSING)
        done: asyncio.Future[int] = self._loop.create_future()
        self._enter(Offer(update, author, None, done))
        return await done

    async def look(self, see: Callable[[Replica, int], T]) -> T:
        """What `see(document, seq)` finds when everything that entered before is committed.

        `see` must not change the document nor keep it. Raises what `see` does, and Unavailable.
        """
        if self._ended:
            raise Unavailable(_CLOSING)
        done: asyncio.Future[T] = self._loop.create_future()
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
        if not self._ended and self.damaged is None:
            await self._snapshots.keep(self.seq, self._replica)
        if needed() or self._waiting or self._ended:
            return
        self._gone(self)  # from here on whoever comes opens another room
        await self.stop()

    async def stop(self) -> None:
        """Finish what has entered, then send everyone away."""
        await self._quiet.wait()
        if not self._ended:
            self._end(Unavailable(_CLOSING))

    # --- batch after batch ----------------------------------------------------------------------

    def _enter(self, item: Item) -> None:
        if self._ended:
            return  # whoever said it is being sent away, and will say it again
        self._waiting.append(item)
        if not self._is_busy:
            self._is_busy = True
            self._quiet.clear()
            self._window.when_open(self._act)

    def _act(self) -> None:
        """The next batch: apply it, and have it stored."""
        if self._ended:
            return
        try:
            batch, self._waiting, alone = next_batch(self._waiting, self._replica)
            self._in_hand = batch
            match batch:
                case [Offer() as offer] if alone:
                    self._do_aside(self._take_large(offer))
                case _:
                    self._store(self._take(batch))
        except BaseException as error:  # noqa: BLE001 - also a panic of the library: it is this room's alone
            self._fail(error)

    def _store(self, taken: Taken) -> None:
        if not taken.news:
            self._committed(taken)
            return
        drafts = tuple([Draft(kind, offer.author, offer.update) for offer, kind in taken.news])
        addition = Addition(self.stream, drafts, self.seq)
        self._journal.append_then(addition, partial(self._stored, taken))

    def _stored(self, taken: Taken, seq: int | None, error: BaseException | None) -> None:
        """Called after the commit, or when there is none."""
        if self._ended:
            return
        try:
            if seq is None:
                raise error or Unavailable(_CLOSING)
            self.seq = seq
            self._snapshots.grew(sum([len(offer.update) for offer, _ in taken.news]))
            self._committed(taken)
        except BaseException as failure:  # noqa: BLE001 - as in `_act`
            self._fail(failure)

    def _committed(self, taken: Taken) -> None:
        self._spoken.tell(taken, self.seq)
        if taken.panicked:
            self._do_aside(self._loaded_anew(taken))
            return
        self._answer(taken)

    async def _loaded_anew(self, taken: Taken) -> None:
        await self._reload()
        self._answer(taken)

    def _answer(self, taken: Taken) -> None:
        """What was asked for; then the batch in hand is done with."""
        answer_all(taken, self._replica, self.seq, self.comparisons)
        if taken.news:
            self._measured.look(self._replica)
            self._snapshots.look(self.seq, self._replica)
        self._in_hand = []
        if self._waiting:
            self._window.when_open(self._act)
        else:
            self._is_busy = False
            self._quiet.set()

    def _do_aside(self, work: Coroutine[Any, Any, None]) -> None:
        """What takes long, in a task; nothing else of this room is done meanwhile."""

        async def guarded() -> None:
            begin_room_task(self.stream)
            try:
                await work
            except BaseException as error:  # noqa: BLE001 - as in `_act`
                self._fail(error)

        self._aside = self._loop.create_task(guarded())

    def _fail(self, error: BaseException) -> None:
        """Whatever goes wrong closes the room; its log opens the next one. Raises what ends a task or the
        process."""
        reason = error if isinstance(error, Refused) else Unavailable(_CLOSING)
        with about("graph", self._graph):
            if isinstance(error, Refused):
                log.error("%s: an edit could not be stored: %s", self.stream, error.detail)
            elif not isinstance(error, _ENDS):
                log.error("%s: the room failed", self.stream, exc_info=error)
        self._end(reason)
        if isinstance(error, _ENDS):
            raise error

    def _take(self, batch: Sequence[Item]) -> Taken:
        """Apply a batch. After a panic the rest of it waits for a sound document."""
        taken = Taken()
        for n, item in enumerate(batch):
            match item:
                case Offer():
                    self._take_in(item, taken)
                case Ask():
                    taken.asks.append(item)
                case Compare():
                    taken.compares.append(item)
                case Look():
                    taken.looks.append(item)
            if taken.panicked:
                self._waiting = [*batch[n + 1 :], *self._waiting]
                break
        return taken

    async def _take_large(self, offer: Offer) -> None:
        """Apply one edit that was tried on a copy first: how long an update takes cannot be told from
        its size, and some end the process."""
        taken = Taken()
        member = offer.member
        try:
            if member is not None and not member.edits and len(offer.update) > LARGE:
                await self._look_at_large(offer, member, taken)
            else:
                read = None
                if member is None or (member.edits and not member.refused):
                    read = await tried_first(offer, self._replica, self._tried)
                if read is not None and len(offer.update) > PIECE_BYTES:
                    await self._take_in_pieces(offer, taken, read)
                else:
                    self._take_in(offer, taken, read)
        except OBJECTIONS as error:
            self._refuse(offer, error)
        self._store(taken)

    async def _look_at_large(self, offer: Offer, member: Member, taken: Taken) -> None:
        """Ignore one edit of somebody who may only look, or refuse it."""
        if member.refused:
            return
        state = self._replica.doc.get_state()
        if not await adds_nothing_aside(offer, state, self._tried):
            raise NotAllowed
        taken.handled.append(offer)

    def _take_in(self, offer: Offer, taken: Taken, read: UpdateOutline | None = None) -> None:
        """Apply one edit, or refuse it."""
        begun = time.thread_time()
        try:
            brought = self._brought(offer, read)
        except OBJECTIONS as error:
            taken.panicked = isinstance(error, Panicked)
            self._refuse(offer, error)
            return
        finally:
            if offer.member is not None:
                offer.member.used_cpu(time.thread_time() - begun)
        if brought is not None:
            self._note(offer, taken, brought)

    async def _take_in_pieces(self, offer: Offer, taken: Taken, read: UpdateOutline) -> None:
        """As `_take_in`, of a large edit that was tried: everybody's edits would wait for it otherwise."""
        pieces = await pieces_aside(offer.update, self._tried)
        member, holder = offer.member, self.attendance.holder
        if member is not None and member.refused:
            return
        replica = self._replica
        before = replica.pieces_s
        try:
            brought = await replica.take_in_pieces(offer.update, offer.author, holder, read, pieces)
        except OBJECTIONS as error:
            taken.panicked = isinstance(error, Panicked)
            self._refuse(offer, error)
            return
        finally:
            if member is not None:
                member.used_cpu(replica.pieces_s - before)
        self._note(offer, taken, brought)

    def _note(self, offer: Offer, taken: Taken, brought: UpdateEffect) -> None:
        """Note what an edit brought: whether it is stored, as which kind, and who is sent it."""
        taken.handled.append(offer)
        if brought is UpdateEffect.WAITS:
            taken.news.append((offer, DEFERRED))
        elif brought is UpdateEffect.NEWS:
            taken.news.append((offer, UPDATED))
            released = self._replica.released()
            taken.shown += [offer.update, *released]
            taken.for_all = taken.for_all or bool(released)

    def _refuse(self, offer: Offer, error: Objection) -> None:
        with about("graph", self._graph):
            log.warning("%s: refused an edit of %s: %s", self.stream, offer.author, error)
        self._metrics.objected(error)
        refuse(offer, error)

    def _brought(self, offer: Offer, read: UpdateOutline | None) -> UpdateEffect | None:
        """Apply one edit; None when it was refused, or comes from a socket that was."""
        member = offer.member
        if member is not None and member.refused:
            return None
        if member is not None and not member.edits:
            if not adds_nothing(self._replica.doc.get_state(), offer.update):
                raise NotAllowed
            return UpdateEffect.NOTHING
        return self._replica.take(offer.update, offer.author, self.attendance.holder, read)

    # --- memory ---------------------------------------------------------------------------------

    async def _reload(self) -> None:
        loaded = await load(self._journal, self.stream, run_in_worker=self._run_in_worker)
        self._replica, self.seq = loaded.replica, loaded.seq

    def _end(self, reason: Refused) -> None:
        """Nobody is told anything that is not stored; everyone may come again."""
        if self._ended:
            return
        self._ended = True
        for item in [*self._in_hand, *self._waiting]:
            fail(item, reason)
        self._waiting = []
        self.comparisons.cancel()
        self._measured.cancel()
        self._spoken.end()
        if self._aside is not None and self._aside is not asyncio.current_task():
            self._aside.cancel()
        self._quiet.set()
        for member in self.members:
            member.close(messages.RESTARTING)
        self._gone(self)
