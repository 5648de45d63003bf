"""Folds events into a document, which is returned as the bytes of a snapshot. For workers."""

import msgspec

from action_assistant.editor.crdt.applying import Panicked
from action_assistant.editor.crdt.event_columns import EventColumns
from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.replica import Replica, ReplicaState
from action_assistant.editor.crdt.sound_updates import Uncertain
from action_assistant.errors import Unavailable


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


def _folded(replica: Replica, seq: int, damaged: StreamDamage | None = None) -> Folded:
    """Return a document as it is sent from the worker: packed where it is large, since the event loop copies it."""
    return Folded(ReplicaState.packed(ReplicaState.of(replica)), seq, damaged)


def fold_sound(document: bytes, events: EventColumns) -> Folded | None:
    """Fold events that rooms have accepted, with the result of `fold` with `learn`, but without
    reading every event completely. Return None if `document` is not readable as a snapshot. Other
    events could crash the process."""
    replica = ReplicaState.replica(document) if document else Replica()
    if replica is None:
        return None
    try:
        replica.replay_sound(events)
        return _folded(replica, events.last)
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
        return _folded(replica, events.last)
    except (Malformed, Panicked):
        return _before_the_bad(document, events, learn=learn)


def _before_the_bad(document: bytes, events: EventColumns, *, learn: bool) -> Folded:
    """Fold the events before the first one that cannot be applied. A new replica is used, since a
    replica in which something failed is unusable."""
    bad, why = _first_bad(document, events)
    damaged = StreamDamage(events.first + bad, why)
    if not bad:
        return Folded(document, events.first - 1, damaged)
    good = events.part(0, bad)
    replica = ReplicaState.replica(document) if document else Replica()
    assert replica is not None
    replica.replay(good, learn=learn)
    return _folded(replica, good.last, damaged)


def _first_bad(document: bytes, events: EventColumns) -> tuple[int, str]:
    """Return the index of the first of these events that cannot be applied, and the reason."""
    replica = ReplicaState.replica(document) if document else Replica()
    assert replica is not None
    for n in range(len(events)):
        try:
            replica.replay(events.part(n, n + 1))
        except (Malformed, Panicked) as error:
            return n, str(error)
    raise Unavailable("A log reads otherwise each time.")
