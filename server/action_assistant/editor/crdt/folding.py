"""Events put together into a document, which travels as the bytes of a snapshot. For workers."""

from collections.abc import Sequence

import msgspec

from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.replica import Panicked, Replica, ReplicaState
from action_assistant.errors import Unavailable
from action_assistant.journal.events import Event


class StreamDamage(msgspec.Struct, frozen=True):
    """A stream is sound before its event `seq`, and not at it."""

    seq: int
    why: str


class Folded(msgspec.Struct, frozen=True):
    """A document after some events, `seq` the last one; `damaged` is the one that cannot be applied."""

    document: bytes
    seq: int
    damaged: StreamDamage | None = None


def fold(document: bytes, events: Sequence[Event], learn: bool) -> Folded | None:
    """A document, as the bytes of a snapshot or nothing, after some events that follow it; None when
    these bytes are no document."""
    replica = ReplicaState.replica(document) if document else Replica()
    if replica is None:
        return None
    try:
        replica.replay(events, learn=learn)
        return Folded(ReplicaState.of(replica), events[-1].seq)
    except (Malformed, Panicked):
        return _before_the_bad(document, events, learn=learn)
    finally:
        replica.close()


def _before_the_bad(document: bytes, events: Sequence[Event], *, learn: bool) -> Folded:
    """As `fold`, up to the first event that cannot be applied. A replica in which something failed
    is not gone on with."""
    bad, why = _first_bad(document, events)
    good = events[:bad]
    damaged = StreamDamage(events[bad].seq, why)
    if not good:
        return Folded(document, events[bad].seq - 1, damaged)
    replica = ReplicaState.replica(document) if document else Replica()
    assert replica is not None
    try:
        replica.replay(good, learn=learn)
        return Folded(ReplicaState.of(replica), good[-1].seq, damaged)
    finally:
        replica.close()


def _first_bad(document: bytes, events: Sequence[Event]) -> tuple[int, str]:
    """Which of these events cannot be applied, and why."""
    replica = ReplicaState.replica(document) if document else Replica()
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
