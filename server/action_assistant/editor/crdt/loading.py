"""Loads documents from the log: a snapshot, and the events after it up to the first one that is damaged. They are
folded in a worker and applied piece by piece.
"""

import asyncio
import itertools
import logging
import struct
from collections.abc import Iterable, Sequence
from typing import Any, Final

import msgspec
from sqlalchemy import bindparam, select

from action_assistant.editor.crdt.applying import Panicked
from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.replica import EventColumns, Replica, ReplicaState
from action_assistant.editor.crdt.sound_updates import Uncertain
from action_assistant.editor.crdt.updates.update_pieces import PIECE_BYTES, pieces_of
from action_assistant.errors import Refused, Unavailable
from action_assistant.journal.chain import START, StoredColumns, linked
from action_assistant.journal.events import StreamSnapshot
from action_assistant.journal.journal import Journal
from action_assistant.kit.packing import is_packed
from action_assistant.schema import editor_tables
from action_assistant.web.workers.lanes import Crashed, OutOfTime, RunInWorker, run_here

log: Final = logging.getLogger(__name__)

SLICES: Final = (2_000, 500)  # events read at once; fewer where not all of those can be read
TOGETHER: Final = 200_000  # events, or
TOGETHER_BYTES: Final = 16 << 20  # in their bodies, after which those so far are put together
_COLUMNS: Final = ("seq", "kind", "author", "at", "body", "position", "chain")
_TYPES: Final = (int, str, str, int, bytes, int, bytes)
_event = editor_tables.editor_event.c
_ROWS: Final = (
    select(*(_event[name] for name in _COLUMNS))
    .where(
        _event.stream == bindparam("stream"),
        _event.seq > bindparam("after"),
        _event.seq <= bindparam("last"),
    )
    .order_by(_event.seq)
)
_SMALL: Final = 32 * 1024  # bytes that are put together at once: milliseconds, as a way aside takes


class StreamDamage(msgspec.Struct, frozen=True):
    """A stream is sound before its event `seq`, and not at it."""

    seq: int
    why: str


class Folded(msgspec.Struct, frozen=True):
    """A snapshot of a document after the event `seq`. `damaged`: the next event, if it cannot be
    applied."""

    document: bytes
    seq: int
    damaged: StreamDamage | None = None


def _sent_back(replica: Replica, seq: int, damaged: StreamDamage | None = None) -> Folded:
    """Return the document of a replica with `seq` and `damaged`, as it is sent from the worker
    process: compressed if large, since the event loop copies it."""
    return Folded(ReplicaState.packed(ReplicaState.of(replica)), seq, damaged)


def fold_sound(document: bytes, events: EventColumns) -> Folded | None:
    """Apply stored events to a snapshot, and return what `fold` with `learn=True` returns. This is
    faster: events are not read completely. All events must have been accepted by rooms; others
    could crash the process. If a fault shows all the same, `fold` is used. Return None if
    `document` cannot be read as a snapshot; an empty one is a new document."""
    replica = ReplicaState.replica(document) if document else Replica()
    if replica is None:
        return None
    try:
        replica.replay_sound(events)
        return _sent_back(replica, events.last)
    except (Malformed, Panicked, Uncertain):
        return fold(document, events, learn=True)


def fold(document: bytes, events: EventColumns, learn: bool) -> Folded | None:
    """Apply events to a document and return the result. `document`: the bytes of a snapshot, or
    empty bytes for a new document. `learn`: also collect what only editing needs. If an event
    cannot be applied, return the document before this event, with the damage. Return None if
    `document` is not readable as a snapshot."""
    replica = ReplicaState.replica(document) if document else Replica()
    if replica is None:
        return None
    try:
        replica.replay(events, learn=learn)
        return _sent_back(replica, events.last)
    except (Malformed, Panicked):
        return _before_the_bad(document, events, learn=learn)


def _before_the_bad(document: bytes, events: EventColumns, *, learn: bool) -> Folded:
    """Fold the events into the snapshot `document` before the first one that cannot be applied, and
    return the result with the damage. A new replica is used, since a replica in which something
    failed is unusable."""
    bad, why = _first_bad(document, events)
    damaged = StreamDamage(events.first + bad, why)
    if not bad:
        return Folded(document, events.first - 1, damaged)
    good = events.part(0, bad)
    replica = ReplicaState.replica(document) if document else Replica()
    assert replica is not None
    replica.replay(good, learn=learn)
    return _sent_back(replica, good.last, damaged)


def _first_bad(document: bytes, events: EventColumns) -> tuple[int, str]:
    """Return the index of the first event that cannot be applied to the snapshot `document`, and
    the reason. Raise Unavailable if all can."""
    replica = ReplicaState.replica(document) if document else Replica()
    assert replica is not None
    for n in range(len(events)):
        try:
            replica.replay(events.part(n, n + 1))
        except (Malformed, Panicked) as error:
            return n, str(error)
    raise Unavailable("A log reads otherwise each time.")


class LogTail:
    """Reads the events of a stream after the event `after`. At the end, `damaged` is the damage
    that ended it, None if that was the end of the stream."""

    def __init__(self, journal: Journal, stream: str, after: int, upto: int | None) -> None:
        self.seq = after
        self.damaged: StreamDamage | None = None
        self._journal = journal
        self._stream = stream
        self._upto = upto
        self._chain = START if after == 0 else None
        self._unchecked: list[StoredColumns] = []
        self._ended = False

    async def next(self) -> EventColumns | None:
        """Return the next events, in a batch of limited count and size; None when there are no
        more. `sound` says which of them are undamaged. Raise Unavailable if the log cannot be
        read."""
        slices: list[StoredColumns] = []
        count = size = 0
        while not self._ended and count < TOGETHER and size < TOGETHER_BYTES:
            more = self._in_place(await self._rows())
            if more is not None:
                slices.append(more)
                count += len(more.seqs)
                size += sum(map(len, more.bodies))
            elif self.damaged is None:
                await self._check_end()
            if more is None or self.damaged is not None:
                self._ended = True
        self._unchecked = slices
        return _columns(slices) if slices else None

    async def sound(self) -> int:
        """Check the chain of the events that `next` returned last. Return how many of them, counted
        from the first, are undamaged. At a damaged event the tail ends."""
        slices, self._unchecked = self._unchecked, []
        good = await asyncio.to_thread(_linked, self._chain or START, self._stream, slices)
        if good < sum(len(each.seqs) for each in slices):
            self._ended = True
            self.seq = slices[0].seqs[0] + good - 1
            self._stop("it is not what was written")
        elif slices:
            self._chain = slices[-1].chains[-1]
        return good

    def _in_place(self, rows: Sequence[Sequence[Any]]) -> StoredColumns | None:
        """Return, as columns, the rows before the first row that is not the next event; None if
        there are no such rows. Only sequence numbers and types of the bodies are checked here;
        the chain check finds wrong types in other columns."""
        if not rows:
            return None
        columns = StoredColumns(*zip(*rows, strict=True))
        expected = range(self.seq + 1, self.seq + 1 + len(rows))
        if columns.seqs == tuple(expected) and set(map(type, columns.bodies)) == {bytes}:
            self.seq += len(rows)
            return columns
        return self._in_place(rows[: self._good(rows)])

    def _good(self, rows: Sequence[Sequence[Any]]) -> int:
        """Return the number of rows before the first one with a wrong type or seq, and record that
        row as damage."""
        for n, row in enumerate(rows):
            if tuple(map(type, row)) != _TYPES:
                self._stop("it holds values of the wrong kind", n)
                return n
            if row[0] != self.seq + 1 + n:
                self._stop(f"{row[0]} stands in its place", n)
                return n
        return len(rows)

    async def _rows(self) -> Sequence[Sequence[Any]]:
        if self._chain is None:
            before = await self._ask(self.seq - 1, 1)
            self._chain = before[0][6] if before and isinstance(before[0][6], bytes) else START
        for limit in SLICES:
            try:
                return await self._ask(self.seq, limit)
            except Unavailable:
                continue
        return await self._one_by_one()

    async def _one_by_one(self) -> Sequence[Sequence[Any]]:
        """Return the rows before a row that the database cannot read. Raise Unavailable if the
        failure may have another cause."""
        if self.seq:
            await self._ask(self.seq - 1, 1)
        found: list[Sequence[Any]] = []
        try:
            while rows := await self._ask(self.seq + len(found), 1):
                found += rows
                if len(found) == SLICES[-1]:
                    break
        except Unavailable as error:
            if not found:
                if await self._journal.health() is not None:
                    raise
                self._stop(error.detail)
        return found

    async def _ask(self, after: int, limit: int) -> Sequence[Sequence[Any]]:
        last = after + limit  # without it Postgres may sort all that follows, for each slice anew
        if self._upto is not None:
            last = min(last, self._upto)
        place = {"stream": self._stream, "after": after, "last": last}
        return await self._journal.plain_rows(_ROWS, place)

    async def _check_end(self) -> None:
        newest = await self._journal.newest(self._stream)
        if (newest if self._upto is None else min(newest, self._upto)) > self.seq:
            # Without the events that were added meanwhile: the next call returns them.
            if await self._ask(self.seq, 1):
                return
            self._stop("it is missing")

    def _stop(self, why: str, after: int = 0) -> None:
        self.damaged = StreamDamage(self.seq + after + 1, why)
        log.error("%s %d is damaged: %s", self._stream, self.damaged.seq, why)


def _columns(slices: Sequence[StoredColumns]) -> EventColumns:
    same: dict[str, str] = {}  # of equal texts one: they travel as such
    kinds, authors, bodies = list[str](), list[str](), list[bytes]()
    for each in slices:
        kinds += map(same.setdefault, each.kinds, each.kinds)
        authors += map(same.setdefault, each.authors, each.authors)
        bodies += each.bodies
    return EventColumns(slices[0].seqs[0], kinds, authors, bodies)


def _linked(chain: bytes, stream: str, slices: Sequence[StoredColumns]) -> int:
    """Return how many events, counted from the first, continue the hash chain of a stream from
    `chain`. `slices`: the events, in parts."""
    count = 0
    for each in slices:
        good = _linked_of_one(chain, stream, each)
        count += good
        if good < len(each.seqs):
            break
        chain = each.chains[-1]
    return count


def _linked_of_one(chain: bytes, stream: str, events: StoredColumns) -> int:
    try:
        return linked(chain, stream, events)
    except (AttributeError, TypeError, struct.error):  # a value has a wrong type
        rows: Iterable[Sequence[Any]] = zip(*events, strict=True)
        typed = list(itertools.takewhile(lambda row: tuple(map(type, row)) == _TYPES, rows))
        return linked(chain, stream, StoredColumns(*zip(*typed, strict=True))) if typed else 0


class Loaded(msgspec.Struct, frozen=True):
    """A document read from the log up to `seq`. `kept`: the seq of the snapshot that it was read
    from; `damaged`: why the document ends before the log does."""

    replica: Replica
    seq: int
    kept: int
    damaged: StreamDamage | None = None


class Stored(msgspec.Struct, frozen=True):
    """A document read from the log up to `seq`, as the bytes of a snapshot; empty if nothing was
    stored. `kept`: the seq of the stored snapshot that it was read from; `damaged`: why it ends
    before the log does."""

    document: bytes
    seq: int
    kept: int
    damaged: StreamDamage | None = None


async def load(
    journal: Journal,
    stream: str,
    upto: int | None = None,
    *,
    learn: bool | None = None,
    run_in_worker: RunInWorker = run_here,
) -> Loaded:
    """Load the document of a stream as it is now, or after its event `upto`. `learn`: also collect
    what only editing needs; by default (None) only if `upto` is None. Raise Unavailable if the log
    cannot be read."""
    learn = upto is None if learn is None else learn
    found = await stored(journal, stream, upto, learn=learn, run_in_worker=run_in_worker)
    replica = await _opened(found.document, run_in_worker)
    if replica is None:  # a snapshot that cannot be read, and nothing after it
        found = await _followed(
            journal, stream, None, upto, learn=learn, run_in_worker=run_in_worker
        )
        replica = await _opened(found.document, run_in_worker)
    if replica is None:
        raise Unavailable(f"{stream} reads otherwise each time.")
    return Loaded(replica, found.seq, found.kept, found.damaged)


async def _opened(document: bytes, run_in_worker: RunInWorker) -> Replica | None:
    """Make a replica from the bytes of a snapshot; a large one is applied in pieces, so that other
    tasks run in between. Return an empty replica for empty bytes, None if the bytes are no
    snapshot."""
    if not document:
        return Replica()
    kept = await ReplicaState.read_aside(document)
    if kept is None:
        return None
    replica = Replica()
    try:
        for piece in await pieces_aside(kept.state, run_in_worker):
            # The writer's thread needs the interpreter, too: a turn of the loop alone would not be enough.
            await asyncio.sleep(replica.open_piece(piece))
        replica.go_on(kept, kept.state)
    except (Malformed, Panicked):
        return None
    return replica


async def pieces_aside(update: bytes, run_in_worker: RunInWorker) -> list[bytes]:
    """Split a large update into pieces in a worker process; return it alone if it is small or the
    worker fails."""
    if run_in_worker is run_here or len(update) <= PIECE_BYTES:
        return [update]
    try:
        return await run_in_worker(pieces_of, update)
    except Refused as error:
        log.warning("%d bytes are applied at once: %s", len(update), error.detail)
        return [update]


async def stored(
    journal: Journal,
    stream: str,
    upto: int | None = None,
    *,
    learn: bool,
    run_in_worker: RunInWorker = run_here,
) -> Stored:
    """Return the document of a stream as the bytes of a snapshot, as it is now or after its event
    `upto`. `learn`: also collect what only editing needs. Work that grows with the document is done
    by `run_in_worker`. Raise Unavailable if the log cannot be read."""
    snapshot = await _snapshot(journal, stream)
    if snapshot is not None and (upto is None or snapshot.seq <= upto):
        found = await _followed(
            journal, stream, snapshot, upto, learn=learn, run_in_worker=run_in_worker
        )
        is_ours = found.document is not snapshot.state
        if is_ours or await ReplicaState.read_aside(found.document) is not None:
            return found
    return await _followed(journal, stream, None, upto, learn=learn, run_in_worker=run_in_worker)


async def _followed(
    journal: Journal,
    stream: str,
    snapshot: StreamSnapshot | None,
    upto: int | None,
    *,
    learn: bool,
    run_in_worker: RunInWorker,
) -> Stored:
    """Return the document of a stream: its snapshot, or an empty document without one, after the
    events that follow up to the event `upto` (None: all). A snapshot that turns out to be
    unreadable is ignored. `learn`: also collect what only editing needs."""
    start, document = (0, b"") if snapshot is None else (snapshot.seq, snapshot.state)
    tail = LogTail(journal, stream, start, upto)
    while events := await tail.next():
        folded = await _folded(tail, document, events, learn, run_in_worker)
        if folded is None:  # not a snapshot of ours
            return await _followed(
                journal, stream, None, upto, learn=learn, run_in_worker=run_in_worker
            )
        document = folded.document
        if folded.damaged is not None:
            log.error("%s %d cannot be applied: %s", stream, folded.seq + 1, folded.damaged.why)
            return Stored(document, folded.seq, start, folded.damaged)
    return Stored(document, tail.seq, start, tail.damaged)


async def _folded(
    tail: LogTail, document: bytes, events: EventColumns, learn: bool, run_in_worker: RunInWorker
) -> Folded | None:
    """Apply to `document` the events before the first one whose hash does not match, and return the
    result. `tail`: checks the hashes; `learn`: also collect what only editing needs. In this
    process no event is applied before its hash was checked; a worker may begin earlier, and its
    result is thrown away if a hash does not match: the events before that one are then folded
    again. Return None if `fold` returns None."""
    if run_in_worker is run_here or _is_small(document, events):
        return _fold(document, events.part(0, await tail.sound()), learn)
    folding = asyncio.ensure_future(_folded_aside(document, events, learn, run_in_worker))
    folding.add_done_callback(_fetch_exception)
    try:
        await asyncio.sleep(0)  # it is sent before checking takes turns with that
        good = await tail.sound()  # while it works
        if good == len(events):
            return await folding
    finally:
        folding.cancel()
    some = events.part(0, good)
    if not good or _is_small(document, some):
        return _fold(document, some, learn)
    return await _folded_aside(document, some, learn, run_in_worker)


def _is_small(document: bytes, events: EventColumns) -> bool:
    """Return whether it takes only milliseconds to fold events into the snapshot `document`. A
    compressed snapshot is large."""
    return not is_packed(document) and len(document) + events.size <= _SMALL


def _fetch_exception(folding: "asyncio.Future[Folded | None]") -> None:
    """Read the error of a fold that was cancelled or no longer needed, so that asyncio does not log
    it."""
    if not folding.cancelled():
        folding.exception()


async def _folded_aside(
    document: bytes, events: EventColumns, learn: bool, run_in_worker: RunInWorker
) -> Folded | None:
    if not learn:
        return await run_in_worker(fold, document, events, learn)
    try:
        return await run_in_worker(fold_sound, document, events)
    except OutOfTime:
        raise
    except Crashed:
        return await run_in_worker(fold, document, events, learn)


def _fold(document: bytes, events: EventColumns, learn: bool) -> Folded | None:
    return fold(document, events, learn) if len(events) else Folded(document, events.first - 1)


async def _snapshot(journal: Journal, stream: str) -> StreamSnapshot | None:
    """Return the snapshot of a stream. Return None if none is stored or it cannot be read, since
    the log has all that a snapshot has."""
    try:
        return await journal.snapshot(stream)
    except Unavailable as error:
        log.warning("%s: no use of the snapshot: %s", stream, error.detail)
        return None
