"""Documents read from the log: snapshot and tail, put together aside, piece by piece."""

import logging
from collections.abc import Sequence
from typing import Final

import msgspec

from action_assistant.editor.replica import Kept, Panicked, Replica
from action_assistant.editor.tail import Damaged, Tail
from action_assistant.editor.wire import Malformed
from action_assistant.errors import Unavailable
from action_assistant.journal.events import Event, Snapshot
from action_assistant.journal.journal import Journal
from action_assistant.web.workers import Aside, here

log: Final = logging.getLogger(__name__)


class Loaded(msgspec.Struct, frozen=True):
    """A document read from the log, at `seq`. `kept` is the seq of the snapshot it began from.

    `damaged`: the log goes on, and this is why the document does not.
    """

    replica: Replica
    seq: int
    kept: int
    damaged: Damaged | None = None


class Stored(msgspec.Struct, frozen=True):
    """As `Loaded`, with the document as the bytes of a snapshot; none where nothing was stored."""

    document: bytes
    seq: int
    kept: int
    damaged: Damaged | None = None


class Folded(msgspec.Struct, frozen=True):
    """A document after some events, `seq` the last one; `damaged` is the one that cannot be applied."""

    document: bytes
    seq: int
    damaged: Damaged | None = None


async def load(
    journal: Journal,
    stream: str,
    upto: int | None = None,
    *,
    learn: bool | None = None,
    aside: Aside = here,
) -> Loaded:
    """The document of a stream, now or after its event `upto`, to go on with.

    `learn`: what only editing needs; by default for a document as it is now. Raises Unavailable.
    """
    learn = upto is None if learn is None else learn
    found = await stored(journal, stream, upto, learn=learn, aside=aside)
    replica = Kept.replica(found.document) if found.document else Replica()
    if replica is None:  # a snapshot that cannot be read, and nothing after it
        found = await _followed(journal, stream, None, upto, learn=learn, aside=aside)
        replica = Kept.replica(found.document) if found.document else Replica()
    if replica is None:
        raise Unavailable(f"{stream} reads otherwise each time.")
    return Loaded(replica, found.seq, found.kept, found.damaged)


async def stored(
    journal: Journal, stream: str, upto: int | None = None, *, learn: bool, aside: Aside = here
) -> Stored:
    """The document of a stream as bytes. What depends on its size is done by `aside`.

    Raises Unavailable.
    """
    snapshot = await _snapshot(journal, stream)
    if snapshot is not None and (upto is None or snapshot.seq <= upto):
        found = await _followed(journal, stream, snapshot, upto, learn=learn, aside=aside)
        if Kept.is_form_of(found.document):
            return found
    return await _followed(journal, stream, None, upto, learn=learn, aside=aside)


async def _followed(
    journal: Journal,
    stream: str,
    snapshot: Snapshot | None,
    upto: int | None,
    *,
    learn: bool,
    aside: Aside,
) -> Stored:
    """A snapshot, or nothing, and the events after it."""
    start, document = (0, b"") if snapshot is None else (snapshot.seq, snapshot.state)
    tail = Tail(journal, stream, start, upto)
    while events := await tail.next():
        folded = await aside(fold, document, events, learn)
        if folded is None:  # not a snapshot of ours
            return await _followed(journal, stream, None, upto, learn=learn, aside=aside)
        document = folded.document
        if folded.damaged is not None:
            log.error("%s %d cannot be applied: %s", stream, folded.seq + 1, folded.damaged.why)
            return Stored(document, folded.seq, start, folded.damaged)
    return Stored(document, tail.seq, start, tail.damaged)


async def _snapshot(journal: Journal, stream: str) -> Snapshot | None:
    """The snapshot; none where it cannot even be read, since the log says all that it could."""
    try:
        return await journal.snapshot(stream)
    except Unavailable as error:
        log.warning("%s: no use of the snapshot: %s", stream, error.detail)
        return None


def fold(document: bytes, events: Sequence[Event], learn: bool) -> Folded | None:
    """A document, as the bytes of a snapshot or nothing, after some events that follow it; None when
    these bytes are no document. For workers."""
    replica = Kept.replica(document) if document else Replica()
    if replica is None:
        return None
    try:
        replica.replay(events, learn=learn)
        return Folded(Kept.of(replica), events[-1].seq)
    except (Malformed, Panicked):
        return _before_the_bad(document, events, learn=learn)
    finally:
        replica.close()


def _before_the_bad(document: bytes, events: Sequence[Event], *, learn: bool) -> Folded:
    """As `fold`, up to the first event that cannot be applied. A replica in which something failed
    is not gone on with."""
    bad, why = _first_bad(document, events)
    good = events[:bad]
    damaged = Damaged(events[bad].seq, why)
    if not good:
        return Folded(document, events[bad].seq - 1, damaged)
    replica = Kept.replica(document) if document else Replica()
    assert replica is not None
    try:
        replica.replay(good, learn=learn)
        return Folded(Kept.of(replica), good[-1].seq, damaged)
    finally:
        replica.close()


def _first_bad(document: bytes, events: Sequence[Event]) -> tuple[int, str]:
    """Which of these events cannot be applied, and why."""
    replica = Kept.replica(document) if document else Replica()
    assert replica is not None
    try:
        for n, event in enumerate(events):
            try:
                replica.replay([event])
            except (Malformed, Panicked) as error:
                return n, str(error)
    finally:
        replica.close()
    raise Unavailable(f"{events[0].stream} reads otherwise each time.")
