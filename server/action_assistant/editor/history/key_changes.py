"""Observes which keys of a document each event of its log changed. For workers."""

from collections.abc import Sequence
from functools import partial
from typing import Any, Final, NamedTuple, TypeAlias, cast

import msgspec
from pycrdt import Map

from action_assistant.editor.crdt.applying import Panicked
from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.replica import Replica, ReplicaState
from action_assistant.editor.documents.document import PLAIN, is_same
from action_assistant.editor.documents.values import ROOTS, Root
from action_assistant.editor.history.overwritten import LostValues
from action_assistant.journal.events import Event

#: A plain value of the document as MessagePack; None where there is no such key.
Packed: TypeAlias = bytes | None
Place: TypeAlias = tuple[Root, str]


class LoggedChange(NamedTuple):
    """The event `seq` of a document's log gave a key of a root map another value, or took it away.

    `at`: microseconds since 1970, UTC.
    """

    seq: int
    author: str
    at: int
    root: Root
    key: str
    before: Packed
    after: Packed

    @property
    def place(self) -> Place:
        """The root map and its key that was changed."""
        return self.root, self.key


class OverwrittenValue(NamedTuple):
    """The event `seq` brought a value of a key of a root map that another value overwrote at once: the key went
    on showing the value `stands`, None where it was deleted.

    `at`: microseconds since 1970, UTC.
    """

    seq: int
    author: str
    at: int
    root: Root
    key: str
    value: Packed
    stands: Packed

    @property
    def place(self) -> Place:
        """The root map and its key that was set."""
        return self.root, self.key


class ObservedEvents(msgspec.Struct, frozen=True):
    """The changes of keys by some events, and the snapshot of the document after the event `seq`.
    `overwritten`: the values that the events brought and that did not come to stand. `damaged`: the
    next event cannot be applied."""

    document: bytes
    seq: int
    changes: list[LoggedChange]
    overwritten: list[OverwrittenValue]
    damaged: bool = False


def observed(document: bytes, events: Sequence[Event]) -> ObservedEvents | None:
    """Apply events to a document, given as the bytes of a snapshot or empty, and return the keys that each
    changed. Return None when these bytes are no snapshot."""
    replica = ReplicaState.replica(document) if document else Replica()
    if replica is None:
        return None
    seen = _Observer(replica)
    seq = events[0].seq - 1
    changes: list[LoggedChange] = []
    overwritten: list[OverwrittenValue] = []
    damaged = False
    try:
        for event in replica.replay_each(events):
            overwritten += seen.overwritten(event)
            changes += seen.changes(event)
            seq = event.seq
    except (Malformed, Panicked):
        damaged = True
    finally:
        seen.close()
        kept = b"" if damaged else ReplicaState.of(replica)
    if damaged and seq >= events[0].seq:  # what failed may have left something behind
        again = observed(document, [event for event in events if event.seq <= seq])
        kept = document if again is None else again.document
    upto = seq if damaged else events[-1].seq
    return ObservedEvents(kept or document, upto, changes, overwritten, damaged)


def owner_of(root: Root, key: str) -> str:
    """Return the owner of a key: an action or an end by its key, a relation by its id, a note as `g/ID`, a
    thread as `c/THREAD`, the graph as ""."""
    if root == "meta":
        return ""
    if root == "comments":
        return f"c/{key.partition('/')[0]}"
    if root == "positions":
        return key.removeprefix("w/").partition("|")[0]
    return key.partition("|")[0]


def unpacked(value: Packed) -> Any:
    """Decode a stored value; None stands for no value."""
    return None if value is None else msgspec.msgpack.decode(value)


class _Observer:
    """Collects the changes of each root map until they are read."""

    def __init__(self, replica: Replica) -> None:
        self._heard: dict[Place, tuple[object, object]] = {}
        self._maps: Final = {root: _map(replica, root) for root in ROOTS}
        self._subscriptions: Final = {
            root: shared.observe(partial(self._hear, root)) for root, shared in self._maps.items()
        }
        self._set: set[Place] = set()
        self._lost: Final = LostValues(replica, self._maps)

    def overwritten(self, event: Event) -> list[OverwrittenValue]:
        """Return the values that `event` brought since the last call and that did not come to stand."""
        set_keys, self._set = len(self._set), set()
        return [
            OverwrittenValue(
                *(event.seq, each.author, event.at, each.root, each.key),
                _packed(each.value),
                _packed(_plain(self._maps[each.root].get(each.key))),
            )
            for each in self._lost.found(event, set_keys)
        ]

    def changes(self, event: Event) -> list[LoggedChange]:
        """Return the changes since the last call, which `event` made."""
        heard, self._heard = self._heard, {}
        return [
            LoggedChange(event.seq, event.author, event.at, *place, _packed(before), _packed(after))
            for place, (before, after) in heard.items()
            if not is_same(before, after)
        ]

    def close(self) -> None:
        """Let the document be freed."""
        for root, shared in self._maps.items():
            shared.unobserve(self._subscriptions[root])

    def _hear(self, root: Root, event: Any) -> None:
        for key, told in event.keys.items():
            before, after = _plain(told.get("oldValue")), _plain(told.get("newValue"))
            first, _ = self._heard.get((root, key), (before, None))
            self._heard[root, key] = first, after
            if told["action"] != "delete":
                self._set.add((root, key))


def _map(replica: Replica, root: Root) -> "Map[Any]":
    return cast("Map[Any]", replica.doc.get(root, type=Map))


def _plain(value: object) -> object:
    """Return a plain value; None for nested shared types, which our page never writes."""
    return value if isinstance(value, PLAIN) else None


def _packed(value: object) -> Packed:
    return None if value is None else msgspec.msgpack.encode(value)
