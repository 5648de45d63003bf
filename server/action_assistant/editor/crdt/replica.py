"""A Yjs document in memory that checks each update and tells its effect."""

import asyncio
import itertools
import logging
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from enum import Enum
from typing import Any, Final, Literal, TypeAlias

import msgspec
from pycrdt import Doc

from action_assistant.editor.crdt.applying import (
    Panicked,
    apply_updates,
    applying,
    check_cut_items,
    check_unchanged,
    check_whole,
    clocks,
)
from action_assistant.editor.crdt.document_quota import DocumentQuota
from action_assistant.editor.crdt.messages import NO_CLOCKS, NOTHING_NEW, ByteReader, Malformed
from action_assistant.editor.crdt.nesting import Nesting
from action_assistant.editor.crdt.opening_time import OpeningTime
from action_assistant.editor.crdt.sound_updates import Clients, check_nothing_is_missing, lies_deep
from action_assistant.editor.crdt.updates.paired_texts import (
    PairedTexts,
    has_paired_texts,
    paired_texts_in,
)
from action_assistant.editor.crdt.updates.update_outline import PairedText, UpdateOutline
from action_assistant.editor.crdt.updates.update_scan import outline, stored_outline
from action_assistant.editor.log.graph_events import DEFERRED, UPDATED
from action_assistant.journal.events import Event
from action_assistant.kit.packing import is_packed, packed, unpacked

log: Final = logging.getLogger(__name__)

#: Kind, author and body of an event.
EventRow: TypeAlias = tuple[str, str, bytes]
_BODIES: Final = msgspec.msgpack.Decoder(list[bytes])
WAITING_BYTES: Final = 4 << 20  # of one author, for something that may never come
WAITING_UPDATES: Final = 256
_KEPT_BYTES: Final = 256 * 1024
_LARGE: Final = 1 << 20  # bytes, from which on it is stored packed


class EventColumns(msgspec.Struct, frozen=True):
    """Consecutive events of one stream, column by column. `first`: the seq of the first event.

    Single values would take longer on their way to a worker than being put together.
    """

    first: int
    kinds: list[str]
    authors: list[str]
    bodies: list[bytes]

    @classmethod
    def of(cls, events: Iterable[Event]) -> "EventColumns":
        """Return events, at least one, as columns."""
        rows = [(each.seq, each.kind, each.author, each.body) for each in events]
        seqs, kinds, authors, bodies = (list(column) for column in zip(*rows, strict=True))
        return cls(seqs[0], kinds, authors, bodies)

    def __reduce__(self) -> tuple[Any, ...]:
        bodies = msgspec.msgpack.encode(self.bodies)
        return _received, (self.first, self.kinds, self.authors, bodies)

    def __len__(self) -> int:
        return len(self.kinds)

    def __iter__(self) -> Iterator[EventRow]:
        return zip(self.kinds, self.authors, self.bodies, strict=True)

    @property
    def last(self) -> int:
        """Return the sequence number (seq) of the last event."""
        return self.first + len(self) - 1

    @property
    def size(self) -> int:
        """Return the total size of the bodies of all events, in bytes."""
        return sum(map(len, self.bodies))

    def part(self, start: int, end: int) -> "EventColumns":
        """Return the events from the index `start` up to, and without, the index `end`."""
        some = slice(start, end)
        return EventColumns(
            self.first + start, self.kinds[some], self.authors[some], self.bodies[some]
        )

    def by_kind(self) -> Iterator["EventColumns"]:
        """Yield runs of consecutive events of one kind, in order."""
        if self.kinds.count(self.kinds[0]) == len(self):  # as nearly always, and at once
            yield self
            return
        start = 0
        for _, same in itertools.groupby(self.kinds):
            end = start + sum(1 for _ in same)
            yield self.part(start, end)
            start = end


def _received(first: int, kinds: list[str], authors: list[str], bodies: bytes) -> EventColumns:
    return EventColumns(first, kinds, authors, _BODIES.decode(bodies))


class UpdateEffect(Enum):
    """The effect of an update on a document."""

    NEWS = "changed it"
    NOTHING = "was known"
    WAITS = "waits for an earlier one"


class ForeignClient(Exception):
    """An update brings something in the name of a client that belongs to another person."""


class TooMuchWaits(Exception):
    """An author has sent too many updates that wait for earlier ones."""


class Replica:
    """A Yjs document.

    An update that needs a missing earlier one is held back here, since the library loses edits if
    several wait. So the library's document never has pending updates. `owners`: the person who
    first used a client id.
    """

    def __init__(self) -> None:
        self.doc: Final[Doc[Any]] = Doc()
        self.owners: dict[int, str] = {}
        self.nesting = Nesting()
        self.paired = PairedTexts()
        self.opening = OpeningTime()
        self._quota = DocumentQuota(self.doc)
        self._known: dict[int, int] = {}
        self._waiting: dict[bytes, tuple[UpdateOutline, str]] = {}
        self._released: list[bytes] = []
        self.pieces_s = 0.0  # processor time that applying pieces took
        self._state: bytes | None = (
            None  # the document as bytes, where it is large and they were asked for
        )

    def take(
        self,
        update: bytes,
        author: str,
        holder: Callable[[int], str | None] = lambda _: None,
        read: UpdateOutline | None = None,
    ) -> UpdateEffect:
        """Apply an update of `author` and return its effect. `holder` returns the person of a
        client id that has not written yet; `read` is the outline of the update if the caller has
        it. Raise Malformed, ForeignClient, QuotaExceeded or TooMuchWaits for an update that is
        refused; the document is unchanged then. Raise Panicked if the CRDT library fails; the
        replica must not be used then."""
        if self._waiting and update in self._waiting:
            return UpdateEffect.NOTHING
        read = read or outline(update)
        new = self._check(update, author, holder, read)
        return self._take(update, author, read, new, is_applied=False)

    async def take_in_pieces(
        self,
        update: bytes,
        author: str,
        holder: Callable[[int], str | None],
        read: UpdateOutline,
        pieces: Sequence[bytes],
    ) -> UpdateEffect:
        """Apply an update that was tried on a copy, as `take` does, but by its `pieces`, with
        pauses as long as each took. The caller must keep others from changing the document
        meanwhile. The other parameters and the errors are those of `take`."""
        if self._waiting and update in self._waiting:
            return UpdateEffect.NOTHING
        new = self._check(update, author, holder, read)
        is_applied = bool(new) and read.ready(self._known)
        if is_applied:
            try:
                for piece in pieces:
                    await asyncio.sleep(self.open_piece(piece))
            except Malformed as error:  # a part of it may be there
                raise Panicked(str(error)) from error
        return self._take(update, author, read, new, is_applied=is_applied)

    def _check(
        self,
        update: bytes,
        author: str,
        holder: Callable[[int], str | None],
        read: UpdateOutline,
    ) -> list[int]:
        """Return the Yjs clients of which an update has new items. Raise the error for which `take`
        refuses an update."""
        known = self._known
        new = [client for client, _, end in read.brings if end > known.get(client, 0)]
        for client in new:
            if (self.owners.get(client) or holder(client) or author) != author:
                raise ForeignClient(f"client {client} is not {author}'s")
        if new:  # what is known is echoed by stock clients, and adds nothing
            self._quota.check(update, read)
        if read.ready(known):
            self.paired.check(update, read, known)
            check_cut_items(self.doc, update, read, known)
        else:
            self._check_patience(update, author)
        return new

    def _take(
        self, update: bytes, author: str, read: UpdateOutline, new: list[int], *, is_applied: bool
    ) -> UpdateEffect:
        """Take an update that `_check` has accepted. If it needs updates that have not come yet,
        hold it back; else apply it, and those that waited for it. `is_applied`: the document has
        its contents already, so only the rest is done. `new`: the Yjs clients that nobody owned
        before; they now belong to `author`."""
        if read.ready(self._known):
            brought = self._grew(update, read, is_applied=is_applied)
            check_whole(self.doc, read)
        else:
            self._waiting[update] = read, author
            brought = UpdateEffect.WAITS
        for client in new:
            self.owners[client] = author
        return brought

    def replay(self, events: EventColumns, *, learn: bool = True) -> None:
        """Apply events of the log in order. Raise Malformed or Panicked if one cannot be applied.

        `learn`: also collect the owners of clients and the nesting depths, which a document needs
        to be edited.
        """
        for group in events.by_kind():
            kind = group.kinds[0]
            if kind not in {UPDATED, DEFERRED}:
                continue
            if learn or kind == DEFERRED or self._waiting:
                self._replay_one_by_one(group)
            else:
                self._apply(*group.bodies)
                self._known = clocks(self.doc.get_state())

    def replay_sound(self, events: EventColumns) -> None:
        """Replay events that rooms have accepted, as `replay` with `learn` does, but without
        reading each completely. The document can then only be stored as a snapshot. Raise
        Malformed, Panicked or Uncertain if that fails."""
        for group in events.by_kind():
            if group.kinds[0] == DEFERRED:
                self._replay_one_by_one(group)
            elif group.kinds[0] == UPDATED:
                at = self._until_nothing_waits(group)
                self._replay_together(group.part(at, len(group)))

    def _until_nothing_waits(self, events: EventColumns) -> int:
        """Replay events one by one until no update waits for an earlier one any more; return how
        many were replayed."""
        done = 0
        while self._waiting and done < len(events):
            self._replay_one_by_one(events.part(done, done + 1))
            done += 1
        return done

    def _replay_together(self, events: EventColumns) -> None:
        """Replay updates in one go; call it only if neither they nor earlier updates wait."""
        if self.nesting.spans or lies_deep(events.bodies) or has_paired_texts(events.bodies):
            self._replay_one_by_one(events)
            return
        clients = Clients(events.bodies, events.authors)
        self.owners = clients.authors | self.owners
        self._apply(*events.bodies)
        self._known = clocks(self.doc.get_state())
        check_nothing_is_missing(self._known, clients.ends)
        self._quota.took(events.size)

    def replay_each(self, events: Sequence[Event]) -> Iterator[Event]:
        """Replay events one by one without learning, and yield each after it was applied, for
        callers that observe the document. Raise Malformed or Panicked if one cannot be applied."""
        for event in events:
            if event.kind == UPDATED and not self._waiting:
                self._apply(event.body)
            elif event.kind in {UPDATED, DEFERRED}:
                self._known = clocks(self.doc.get_state())
                self._replay_one_by_one([(event.kind, event.author, event.body)])
            yield event
        self._known = clocks(self.doc.get_state())

    def begin(self, kept: "ReplicaState") -> None:
        """Restore this empty replica from a decoded snapshot. Raise Malformed or Panicked if it
        cannot be applied."""
        self.open_piece(kept.state)
        self.go_on(kept, kept.state)

    def open_piece(self, piece: bytes) -> float:
        """Apply a piece of a snapshot or update; return the processor time in seconds. Raise
        Malformed or Panicked if it cannot be applied."""
        begun = time.thread_time()
        self._apply(piece)
        took = time.thread_time() - begun
        self.pieces_s += took
        return took

    def go_on(self, kept: "ReplicaState", state: bytes) -> None:
        """Restore from a decoded snapshot what a replica has beside the document, after the
        document (`state`) was applied in pieces. Raise Malformed if `state` cannot be read."""
        self._state = state if len(state) > _KEPT_BYTES else None
        self.opening.opened(self.pieces_s, len(state))
        self._quota.took(len(state))
        self.owners, self.nesting = kept.owners, Nesting(kept.spans)
        self.paired = PairedTexts(paired_texts_in(state) if kept.paired is None else kept.paired)
        self._known = clocks(self.doc.get_state())
        self._waiting = {
            update: (stored_outline(update), author) for update, author in kept.waiting
        }

    def state(self) -> bytes:
        """Return the whole document as one update. A large one is cached until the next change,
        since encoding takes 4 ms for each MB."""
        if self._state is not None:
            return self._state
        state: bytes = self.doc.get_update()
        if len(state) > _KEPT_BYTES:
            self._state = state
        return state

    def _replay_one_by_one(self, events: Iterable[EventRow]) -> None:
        together: list[bytes] = []
        for kind, author, body in events:
            read = stored_outline(body)
            for client, _, _ in read.brings:
                self.owners.setdefault(client, author)
            if kind == DEFERRED or self._waiting or not read.ready(self._known):
                self._apply(*together)
                together = []
                if read.ready(self._known):
                    self._grew(body, read)
                else:
                    self._waiting[body] = read, author
            else:
                self._learn(read, len(body))
                together.append(body)
        self._apply(*together)

    def _learn(self, read: UpdateOutline, size: int) -> None:
        """Count an event of the log, of `size` bytes and with the outline `read`, for nesting,
        quota and opening time. Limits are not checked again."""
        with suppress(Malformed):
            self.nesting.learn(self.nesting.depths(read.placed, self._known))
        self._count(read, size)
        self.opening.took(read.structs)

    def _check_patience(self, update: bytes, author: str) -> None:
        sizes = [len(each) for each, (_, whose) in self._waiting.items() if whose == author]
        if len(sizes) >= WAITING_UPDATES or sum(sizes) + len(update) > WAITING_BYTES:
            raise TooMuchWaits

    def _grew(
        self, update: bytes, read: UpdateOutline, *, is_applied: bool = False
    ) -> UpdateEffect:
        """Apply an update for which nothing is missing, then the held-back updates that need
        nothing else; return the effect. `read`: its outline; `is_applied`: its pieces were applied
        already."""
        try:
            changed = self._applied(update, read, is_applied=is_applied)
        except Malformed as error:
            check_unchanged(self.doc, self._known, error)
            raise
        if not changed:
            return UpdateEffect.NOTHING
        while self._waiting and self._release():
            pass
        return UpdateEffect.NEWS

    def released(self) -> list[bytes]:
        """Return the updates that waited and were applied since the last call."""
        released, self._released = self._released, []
        return released

    def freed_by(self, read: UpdateOutline) -> list[bytes]:
        """Return the held-back updates that could be applied after the update with the outline
        `read`."""
        known = dict(self._known)
        freed: dict[bytes, None] = {}
        news = [read] if read.ready(known) else []
        while news:
            for each in news:
                for client, _, end in each.brings:
                    known[client] = max(end, known.get(client, 0))
            ready = {
                u: w for u, (w, _) in self._waiting.items() if u not in freed and w.ready(known)
            }
            freed.update(dict.fromkeys(ready))
            news = list(ready.values())
        return list(freed)

    @property
    def waits(self) -> bool:
        """Return whether any update waits for an earlier one."""
        return bool(self._waiting)

    @property
    def waiting_bytes(self) -> int:
        """The size in bytes of the updates that wait for earlier ones."""
        return sum(map(len, self._waiting))

    def held_back(self) -> list[tuple[bytes, str]]:
        """Return the updates that wait for earlier ones, each with its author, in the order of
        arrival."""
        return [(update, author) for update, (_, author) in self._waiting.items()]

    @property
    def waiting(self) -> tuple[bytes, ...]:
        """Return the updates that wait for earlier ones."""
        return tuple(self._waiting)

    def _applied(self, update: bytes, read: UpdateOutline, *, is_applied: bool = False) -> bool:
        """Apply an update for which nothing is missing, unless its pieces were applied already;
        return whether the document changed. `read`: its outline."""
        known = self._known
        self._state = None
        depths = self.nesting.depths(read.placed, known)
        if is_applied:
            changed = True
        elif any(end > known.get(client, 0) for client, _, end in read.brings):
            with applying():
                apply_updates(self.doc, update)
            changed = True
        else:
            changed = self._deletes(update)
        self.nesting.learn(depths)
        self._count(read, len(update))
        if changed:
            self.opening.took(read.structs)
        return changed

    def _deletes(self, update: bytes) -> bool:
        """Apply an update without new structs; return whether its deletions changed the document.
        The document is observed only here, since observing costs as much as applying."""
        changed = False

        def observed(event: Any) -> None:
            nonlocal changed
            changed = changed or event.update != NOTHING_NEW

        subscription = self.doc.observe(observed)
        try:
            self._apply(update)
        finally:
            self.doc.unobserve(subscription)
        return changed

    def _count(self, read: UpdateOutline, size: int) -> None:
        self._quota.took(size, read.actions, read.fields)
        self.paired.learn(read, self._known)
        for client, _, end in read.brings:
            self._known[client] = max(end, self._known.get(client, 0))

    def _release(self) -> bool:
        """Apply the held-back updates for which nothing is missing now; return whether there were
        any."""
        ready = [each for each, (read, _) in self._waiting.items() if read.ready(self._known)]
        for update in ready:
            read, _ = self._waiting.pop(update)
            try:
                self.paired.check(update, read, self._known)
                check_cut_items(self.doc, update, read, self._known)
                if self._applied(update, read):
                    self._released.append(update)
            except Malformed as error:
                log.warning("an update that waited brings nothing: %s", error)
        return bool(ready)

    def _apply(self, *updates: bytes) -> None:
        if not updates:
            return
        self._state = None
        with applying():
            if len(updates) == 1:  # of a document that may be watched
                self.doc.apply_update(updates[0])
            else:
                apply_updates(self.doc, *updates)

    def lacking(self, state: bytes) -> bytes:
        """Return the update with all that a client lacks. `state`: the client's state vector (what
        it has of each Yjs client). Raise Malformed or Panicked if it cannot be read."""
        if ByteReader(state).number() * 2 > len(state):
            raise Malformed("more clients than bytes")
        if state == NO_CLOCKS:
            return self.state()
        with applying():
            return self.doc.get_update(state)


class ReplicaState(msgspec.Struct, frozen=True, array_like=True):
    """The content of a snapshot: the document, the waiting updates with their authors, and the
    owners of clients.

    `form` was the number 1 before waiting updates were stored, so that an old program refuses a
    newer snapshot.
    """

    form: Literal["with what waits"] | int
    owners: dict[int, str]
    spans: dict[int, list[tuple[int, int, int]]]
    state: bytes
    waiting: list[tuple[bytes, str]] = []
    paired: list[PairedText] | None = (
        None  # those of a snapshot from before they were kept are sought
    )

    @classmethod
    def of(cls, replica: Replica) -> bytes:
        """Return the bytes of a snapshot of a replica."""
        state = replica.state()
        spans, waiting = replica.nesting.spans, replica.held_back()
        kept = cls("with what waits", replica.owners, spans, state, waiting, replica.paired.all())
        return msgspec.msgpack.encode(kept)

    @classmethod
    def replica(cls, kept: bytes) -> Replica | None:
        """Return the replica of an encoded snapshot; None if the bytes are no snapshot."""
        found = cls.read(kept)
        if found is None:
            return None
        replica = Replica()
        try:
            replica.begin(found)
        except (Malformed, Panicked):
            return None
        return replica

    @classmethod
    def state_of(cls, kept: bytes) -> bytes:
        """Return the document of an encoded snapshot as one update; an empty update if the bytes
        are no snapshot."""
        found = cls.read(kept)
        return NOTHING_NEW if found is None else found.state

    @classmethod
    def read(cls, kept: bytes) -> "ReplicaState | None":
        """Decode a snapshot, compressed or not; return None if the bytes are no snapshot."""
        try:
            return msgspec.msgpack.decode(unpacked(kept), type=cls)
        except (msgspec.DecodeError, UnicodeDecodeError):
            return None

    @staticmethod
    def packed(kept: bytes) -> bytes:
        """Return a large encoded snapshot compressed, since all edits wait while the writer stores
        it. Slow: call it on a thread or in a worker."""
        return packed(kept, least=_LARGE)

    @staticmethod
    async def packed_aside(kept: bytes) -> bytes:
        """Compress a large encoded snapshot as `packed` does, on a thread; return a small one at
        once."""
        return kept if len(kept) < _LARGE else await asyncio.to_thread(ReplicaState.packed, kept)

    @classmethod
    async def read_aside(cls, kept: bytes) -> "ReplicaState | None":
        """Decode a snapshot as `read` does; a compressed one on a thread, so that the event loop is
        not blocked. Return None if the bytes are no snapshot."""
        return await asyncio.to_thread(cls.read, kept) if is_packed(kept) else cls.read(kept)
