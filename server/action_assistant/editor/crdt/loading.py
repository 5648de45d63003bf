"""Loads documents from the log: snapshot and tail, folded in a worker, piece by piece."""

import asyncio
import logging
from typing import Final

import msgspec

from action_assistant.editor.crdt.applying import Panicked
from action_assistant.editor.crdt.event_columns import EventColumns
from action_assistant.editor.crdt.folding import Folded, StreamDamage, fold, fold_sound
from action_assistant.editor.crdt.log_tail import LogTail
from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.replica import Replica, ReplicaState
from action_assistant.editor.crdt.updates.update_pieces import PIECE_BYTES, pieces_of
from action_assistant.errors import Refused, Unavailable
from action_assistant.journal.events import StreamSnapshot
from action_assistant.journal.journal import Journal
from action_assistant.web.workers.lanes import Crashed, OutOfTime, RunInWorker, run_here

log: Final = logging.getLogger(__name__)

_SMALL: Final = 32 * 1024  # bytes that are put together at once: milliseconds, as a way aside takes


class Loaded(msgspec.Struct, frozen=True):
    """A document read from the log, at `seq`. `kept` is the seq of the snapshot it began from.

    `damaged`: the log goes on, and this is why the document does not.
    """

    replica: Replica
    seq: int
    kept: int
    damaged: StreamDamage | None = None


class Stored(msgspec.Struct, frozen=True):
    """A document read from the log as the bytes of a snapshot, empty where nothing was stored. The other fields
    are those of `Loaded`."""

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
    what only editing needs; the default is to do so only if `upto` is None. Raise Unavailable if
    the log cannot be read."""
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
    """Make the document of a snapshot, a large one in pieces with turns of the loop between them. Return an
    empty one where nothing was stored, and None when these bytes are no snapshot of ours."""
    if not document:
        return Replica()
    kept = ReplicaState.read(document)
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
    """Split a large update in a worker. Return it as it is where that fails."""
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
    """Return the document of a stream as bytes, as it is now or after its event `upto`. Work that
    grows with the document is done by `run_in_worker`. Raise Unavailable if the log cannot be
    read."""
    snapshot = await _snapshot(journal, stream)
    if snapshot is not None and (upto is None or snapshot.seq <= upto):
        found = await _followed(
            journal, stream, snapshot, upto, learn=learn, run_in_worker=run_in_worker
        )
        if ReplicaState.is_form_of(found.document):
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
    """Apply the events after a snapshot to it; without a snapshot, apply all events of the stream
    to an empty document. A snapshot that turns out to be unreadable is ignored."""
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
    result. `learn`: also collect what only editing needs. In this process no event is applied
    before its hash was checked; a worker may begin earlier, and its result is thrown away if a
    hash does not match: the events before that one are then folded again. Return None if `fold`
    returns None."""
    if run_in_worker is run_here or len(document) + events.size <= _SMALL:
        return _fold(document, events.part(0, await tail.sound()), learn)
    folding = asyncio.ensure_future(_folded_aside(document, events, learn, run_in_worker))
    folding.add_done_callback(_heard)
    try:
        await asyncio.sleep(0)  # it is sent before checking takes turns with that
        good = await tail.sound()  # while it works
        if good == len(events):
            return await folding
    finally:
        folding.cancel()
    some = events.part(0, good)
    if not good or len(document) + some.size <= _SMALL:
        return _fold(document, some, learn)
    return await _folded_aside(document, some, learn, run_in_worker)


def _heard(folding: "asyncio.Future[Folded | None]") -> None:
    """Ignore the result for events whose hash does not match; the chain check reports them."""
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
    """Return the snapshot of a stream. Return None if there is none or if it cannot be read, since
    the log has all that a snapshot has."""
    try:
        return await journal.snapshot(stream)
    except Unavailable as error:
        log.warning("%s: no use of the snapshot: %s", stream, error.detail)
        return None
