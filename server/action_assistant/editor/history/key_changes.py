"""Tells to which thing each key of a document belongs, and which keys each event changed. Runs in workers."""

from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from operator import attrgetter
from typing import Any, Final, NamedTuple, TypeAlias, cast

import msgspec
from pycrdt import Doc, Map

from action_assistant.editor.crdt.applying import Panicked, applying, clocks
from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.replica import Replica, ReplicaState
from action_assistant.editor.crdt.updates.update_scan import WrittenItem, WrittenUpdate, written
from action_assistant.editor.documents import document
from action_assistant.editor.documents.document import PLAIN, is_same
from action_assistant.editor.documents.values import ROOTS, Root, ends_of
from action_assistant.journal.events import Event
from action_assistant.umrf.model import PRECONDITIONS

_DELETED: Final = 1  # the kind of an item whose content is gone
_VALUES: Final = frozenset({3, 8})  # the kinds of items that hold plain values
_ROOTS: Final = {root.encode(): root for root in ROOTS}
#: A plain value of the document as MessagePack; None where there is no such key.
Packed: TypeAlias = bytes | None
Place: TypeAlias = tuple[Root, str]
_OUTCOMES: Final = frozenset(PRECONDITIONS)


class LostValue(NamedTuple):
    """A value that `author` gave a key, and that lost against a concurrent edit."""

    author: str
    root: Root
    key: str
    value: object


class LostValues:
    """Follows a document whose log is replayed, and finds the lost values of each event.

    Two people set one key without knowing of each other: Yjs keeps one of the two values. If the
    kept one was there first, the other is deleted as it is applied, and no map event shows it.
    Only the bytes of its update hold it.
    """

    def __init__(self, replica: Replica, maps: "Mapping[Root, Map[Any]]") -> None:
        self._replica = replica
        self._maps = maps
        self._known = clocks(replica.doc.get_state())
        self._waiting = dict(replica.held_back())
        self._places: _Places | None = None  # they are read when the first value is lost

    def found(self, event: Event, set_keys: int) -> list[LostValue]:
        """Return the values that were lost when `event` was applied, at most one for each key.
        `set_keys`: the number of keys for which the maps showed a new value. Raise Malformed if an
        update cannot be read."""
        lost: dict[tuple[Root, str], LostValue] = {}
        updates = [(written(body), author) for body, author in self._applied(event)]
        deleted = _Ranges(update for update, _ in updates)
        fresh = [(item, who) for each, who in updates for item in self._live(each, deleted)]
        if len(fresh) > set_keys:
            self._places = self._places or _Places(written(self._replica.state()).items)
            for item, author in fresh:
                value = self._lost(item, author)
                if value is not None:
                    lost[value.root, value.key] = value
        for update, _ in updates:
            if self._places is not None:
                self._places.add(update.items)
            for client, end in update.ends.items():
                self._known[client] = max(end, self._known.get(client, 0))
        return list(lost.values())

    def _applied(self, event: Event) -> list[tuple[bytes, str]]:
        """Return the updates that were applied with an event, and their authors: its own, unless
        that waits for an earlier one, and updates that had waited for it."""
        replica, waited = self._replica, self._waiting
        self._waiting = dict(replica.held_back()) if replica.waits else {}
        own = [] if event.body in self._waiting else [(event.body, event.author)]
        return own + [(body, waited.get(body, event.author)) for body in replica.released()]

    def _live(self, update: WrittenUpdate, deleted: "_Ranges") -> list[WrittenItem]:
        """Return the new items of an update that its author had not deleted again."""
        return [
            item
            for item in update.items
            if item.kind != _DELETED
            and item.end > self._known.get(item.client, 0)
            and not deleted.has(item.client, item.end - 1)
        ]

    def _lost(self, item: WrittenItem, author: str) -> LostValue | None:
        assert self._places is not None
        place = self._places.of(item)
        if place is None or item.kind not in _VALUES or place[0] not in _ROOTS:
            return None
        root, key = _ROOTS[place[0]], place[1].decode(errors="replace")
        value = _value_of(item)
        if not isinstance(value, PLAIN) or value is None:
            return None
        return (
            None
            if is_same(value, self._maps[root].get(key))
            else LostValue(author, root, key, value)
        )


class _Ranges:
    """The items that some updates delete, as ranges of clocks (item numbers) by Yjs client."""

    def __init__(self, updates: Iterable[WrittenUpdate]) -> None:
        self._of: dict[int, list[tuple[int, int]]] = {}
        for update in updates:
            for client, ranges in update.deleted.items():
                self._of.setdefault(client, []).extend(ranges)
        for client, ranges in self._of.items():
            apart: list[tuple[int, int]] = []
            for start, end in sorted(ranges):
                if apart and start <= apart[-1][1]:
                    start, end = apart[-1][0], max(end, apart.pop()[1])
                apart.append((start, end))
            self._of[client] = apart

    def has(self, client: int, clock: int) -> bool:
        """Return whether the item with this clock (number) of a Yjs client is deleted."""
        ranges = self._of.get(client, [])
        n = bisect_right(ranges, clock, key=lambda each: each[0]) - 1
        return n >= 0 and clock < ranges[n][1]


class _Places:
    """Finds the root map and the key of each item of a document. Most items only name the item that
    was there before."""

    def __init__(self, items: Iterable[WrittenItem]) -> None:
        self._of: dict[int, list[WrittenItem]] = {}
        self.add(items)

    def add(self, items: Iterable[WrittenItem]) -> None:
        """Add those of the items that are new, in the order of the clocks (item numbers) of each
        client."""
        for item in items:
            mine = self._of.setdefault(item.client, [])
            if not mine or item.end > mine[-1].end:
                mine.append(item)

    def of(self, item: WrittenItem | None) -> tuple[bytes, bytes] | None:
        """Return the root map and key of an item; None where it lies in no key of a root map."""
        while item is not None and item.place is None and item.beside is not None:
            item = self._at(*item.beside)
        return None if item is None else item.place

    def _at(self, client: int, clock: int) -> WrittenItem | None:
        mine = self._of.get(client, [])
        n = bisect_right(mine, clock, key=attrgetter("start")) - 1
        return mine[n] if n >= 0 and clock < mine[n].end else None


def _value_of(item: WrittenItem) -> object:
    """Return the value of an item: the CRDT library reads it from an update that holds nothing else."""
    doc: Doc[Any] = Doc()
    shared = cast("Map[Any]", doc.get("m", type=Map))
    one = bytes((1, 1, 1, 0, item.kind | 0x20, 1))  # one client with one struct, in a key of a root
    with applying():
        doc.apply_update(one + b"\x01m\x01v" + item.content + b"\x00")
    return shared.get("v")


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
    """The event `seq` brought a value for a key of a root map, and this value lost against a
    concurrent edit: the key kept the value `stands`, None where it was deleted.

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
    """Apply events to a document (`document`: the bytes of a snapshot, or empty), and return the
    changes of keys by each. Return None if the bytes are no snapshot."""
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
    """Return the owner of a key in the map `root`, that is, what it describes: an action or an end
    by its key, a relation by its id, a note as `g/ID`, a thread as `c/THREAD`, the graph as ""."""
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
        """Stop observing, so that the document can be freed."""
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
    """Return a plain value; None for nested shared types, which the page never writes."""
    return value if isinstance(value, PLAIN) else None


def _packed(value: object) -> Packed:
    return None if value is None else msgspec.msgpack.encode(value)


def places_of(state: bytes) -> dict[Place, Any]:
    """Return the values of a document by their place (root map and key). `state`: the document as
    one Yjs update."""
    doc: Doc[Any] = Doc()
    doc.apply_update(state)
    maps = document.maps_of(doc)
    return {(root, key): value for root in ROOTS for key, value in maps[root].items()}


def field_of(root: Root, key: str) -> str:
    """Return the name of the field that a key of the document stores, within the action, arrow or
    note that `owner_of` returns for this key. `root` is the root map that has the key. The field of
    `ID|type` is `type`; the field of `ID` alone in `actions` is an empty text."""
    if root == "meta":
        return key
    if root == "positions":
        return f"waypoints/{key.partition('|')[2]}" if key.startswith("w/") else "position"
    return key.partition("|")[2]


def proves(place: Place) -> bool:
    """Return whether the action, arrow or note to which a key belongs exists because of this key."""
    root, key = place
    match root:
        case "actions":
            return "|" not in key
        case "relations":
            return key.partition("|")[2] in _OUTCOMES
        case _:
            return root == "positions" and key.startswith("g/")


def is_place_of_card(place: Place) -> bool:
    """Return whether a key stores the position of an action's card or of a line."""
    root, key = place
    return root == "positions" and not key.startswith("g/")


def by_owner(places: Iterable[Place]) -> dict[str, list[Place]]:
    """Return places (root map and key) grouped by the action, arrow or note that they describe
    (`owner_of`)."""
    found: dict[str, list[Place]] = defaultdict(list)
    for place in places:
        found[owner_of(*place)].append(place)
    return found


def arrows_of(owners: Iterable[str]) -> dict[str, set[str]]:
    """Return the arrows at each action, by the action's key. `owners`: keys of actions and arrows."""
    found: dict[str, set[str]] = defaultdict(set)
    for owner in owners:
        for end in (ends_of(owner) or ())[:2]:
            found[str(end)].add(owner)
    return found


def exist(places: Mapping[Place, Any]) -> set[str]:
    """Return the keys of the actions, arrows and notes that exist according to these values."""
    return {owner_of(*place) for place in places if proves(place)}
