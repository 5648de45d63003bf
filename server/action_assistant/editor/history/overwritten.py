"""Finds values that arrived when another value of their key stood already and kept standing. For workers.

Two people set one key without knowing of each other: Yjs keeps one of the two values. If the kept one was there
first, the other is deleted as it is applied, and no map event shows it. Only the bytes of its update hold it.
"""

from bisect import bisect_right
from collections.abc import Iterable, Mapping
from operator import attrgetter
from typing import Any, Final, NamedTuple, cast

from pycrdt import Doc, Map

from action_assistant.editor.crdt.applying import applying, clocks
from action_assistant.editor.crdt.replica import Replica
from action_assistant.editor.crdt.updates.update_scan import WrittenItem, WrittenUpdate, written
from action_assistant.editor.documents.document import PLAIN, is_same
from action_assistant.editor.documents.values import ROOTS, Root
from action_assistant.journal.events import Event

_DELETED: Final = 1  # the kind of an item whose content is gone
_VALUES: Final = frozenset({3, 8})  # the kinds of items that hold plain values
_ROOTS: Final = {root.encode(): root for root in ROOTS}


class LostValue(NamedTuple):
    """A value that `author` gave a key, and that another one overwrote at once."""

    author: str
    root: Root
    key: str
    value: object


class LostValues:
    """Follows a document whose log is replayed, and finds the lost values of each event."""

    def __init__(self, replica: Replica, maps: "Mapping[Root, Map[Any]]") -> None:
        self._replica = replica
        self._maps = maps
        self._known = clocks(replica.doc.get_state())
        self._waiting = dict(replica.held_back())
        self._places: _Places | None = None  # they are read when the first value is lost

    def found(self, event: Event, set_keys: int) -> list[LostValue]:
        """Return the values that were lost when `event` was applied, at most one for each key. `set_keys`: the
        number of keys for which the maps showed a new value. Raises Malformed."""
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
        """Return the updates that were applied with an event, and their authors: its own, unless that waits for
        an earlier one, and those that had waited for it."""
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
    """The clocks that some updates delete."""

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
        """Tell whether this clock of a client is deleted."""
        ranges = self._of.get(client, [])
        n = bisect_right(ranges, clock, key=lambda each: each[0]) - 1
        return n >= 0 and clock < ranges[n][1]


class _Places:
    """The root and the key of each item of a document. Most items only name the item that stood there before."""

    def __init__(self, items: Iterable[WrittenItem]) -> None:
        self._of: dict[int, list[WrittenItem]] = {}
        self.add(items)

    def add(self, items: Iterable[WrittenItem]) -> None:
        """Take over the items that are new, in the order of the clocks of each client."""
        for item in items:
            mine = self._of.setdefault(item.client, [])
            if not mine or item.end > mine[-1].end:
                mine.append(item)

    def of(self, item: WrittenItem | None) -> tuple[bytes, bytes] | None:
        """Return the place of an item; None where it lies in no key of a root."""
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
