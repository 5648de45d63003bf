"""Reads the outline of an update without the CRDT library and within bounds (rule R4).

The library allocates by declared counts, recurses by nesting, and loses edits when it is given
several updates that wait for an earlier one. So nothing reaches it that was not read here first. It
also takes what Yjs in a page fails at; that is refused here. Yjs update format, version 1.
"""

from collections.abc import Mapping
from typing import Final, Literal, NamedTuple, TypeAlias

from action_assistant.editor.crdt.messages import ByteReader, Malformed
from action_assistant.editor.crdt.nesting import Placed
from action_assistant.editor.crdt.updates.small_update import small_outline
from action_assistant.editor.crdt.updates.update_content import ContentReader, length
from action_assistant.editor.crdt.updates.update_outline import (
    MOST_CLIENT,
    MOST_CLIENTS,
    MOST_CLOCK,
    MOST_STRUCTS,
    PairedText,
    UpdateOutline,
)

_GC, _DELETED, _STRING, _SKIP = 0, 1, 4, 10


def outline(update: bytes) -> UpdateOutline:
    """Return the outline of an update. Raise Malformed if it cannot be read, exceeds the limits, or
    would fail in a page."""
    return small_outline(update) or scanned(update)


def stored_outline(update: bytes) -> UpdateOutline:
    """Return the outline of an update from the log, also of one that today's rules would refuse, so
    that old graphs still open. Raise Malformed if it cannot be read."""
    return small_outline(update) or scanned(update, stored=True)


def scanned(update: bytes, *, stored: bool = False) -> UpdateOutline:
    """Return the outline of an update by reading all of it, without the short cut for small
    updates. Raise Malformed if it cannot be read; with `stored`, an update that only today's
    rules refuse is accepted."""
    scan = Scan(ByteReader(update), stored=stored)
    scan.whole()
    return scan.outline()


def places_parted(update: bytes) -> list[tuple[int, int]]:
    """Return the positions (client, clock) before which this update splits a text item. Raise
    Malformed if it cannot be read."""
    scan = Scan(ByteReader(update), stored=True)
    scan.whole()
    return scan.parted


def cut_items(update: bytes, known: Mapping[int, int]) -> list[int]:
    """Return the client ids of which `known` (next clock by client) covers only the first part of
    an item of this update. Raise Malformed if it cannot be read."""
    scan = Scan(ByteReader(update), stored=True)
    scan.whole()
    return [c for c, start, end in scan.items if start < known.get(c, 0) < end]


class WrittenItem(NamedTuple):
    """An item of an update, with the clocks from `start` to `end`. `place`: the name of a root and a key in it;
    None where the item does not name them. Then they are those of the item `beside`, a client and a clock,
    if there is one. `content`: the bytes after those."""

    client: int
    start: int
    end: int
    beside: tuple[int, int] | None
    place: tuple[bytes, bytes] | None
    kind: int
    content: bytes


class WrittenUpdate(NamedTuple):
    """The items of an update in the order of their clocks, where each client's structs end, and the ranges of
    clocks that the update deletes, by client."""

    items: list[WrittenItem]
    ends: dict[int, int]
    deleted: dict[int, list[tuple[int, int]]]


def written(update: bytes) -> WrittenUpdate:
    """Read the items of an update that a room took, or of a whole document. Raises Malformed."""
    scan = Scan(ByteReader(update), stored=True, collects=True)
    scan.whole()
    ends = {client: end for client, _, end in scan.outline().brings}
    return WrittenUpdate(scan.written, ends, scan.deleted)


#: A struct that tells where this one lies, and whether inside it.
_Reference: TypeAlias = tuple[int, int, bool]
#: The kind of key that a struct may add to a root.
_Fresh: TypeAlias = Literal["none", "field", "action"]
_NONE: Final = "none"
_FIELD: Final = "field"
_ACTION: Final = "action"


class Scan:
    """Reads an update struct by struct, and collects its outline; with `collects` also its items."""

    def __init__(self, reader: ByteReader, *, stored: bool, collects: bool = False) -> None:
        self.written: Final[list[WrittenItem]] = []
        self.deleted: Final[dict[int, list[tuple[int, int]]]] = {}
        self._collects = collects
        self._place: tuple[bytes, bytes] | None = None
        self._content_left = 0  # bytes of the update from the content of the last struct on
        self.parted: Final[list[tuple[int, int]]] = []
        self.items: Final[list[tuple[int, int, int]]] = []  # of more than one clock
        self._needs: dict[int, int] = {}
        self._reader = reader
        self._contents = ContentReader(reader, stored=stored)
        self._stored = stored
        self._brings: list[tuple[int, int, int]] = []
        self._placed: list[Placed] = []
        self._paired: list[PairedText] = []
        self._seen: set[int] = set()
        self._structs = self._actions = self._fields = 0

    def whole(self) -> None:
        """Read the whole update into the attributes. Raise Malformed if it cannot be read."""
        reader = self._reader
        clients = reader.number()
        if clients > MOST_CLIENTS or clients * 3 > reader.left:
            raise Malformed("too many clients")
        for _ in range(clients):
            self._client_structs()
        self._deletions()
        if reader.left:
            raise Malformed("something follows the update")

    def outline(self) -> UpdateOutline:
        """Return the outline of the update that was read."""
        return UpdateOutline(
            tuple(self._brings),
            self._needs,
            tuple(self._placed),
            self._actions,
            self._fields,
            self._structs,
            tuple(self._paired),
        )

    def _client_structs(self) -> None:
        """Read all structs of the next client."""
        reader = self._reader
        count, client, clock = reader.number(), _client(reader), reader.number()
        if client in self._seen:
            raise Malformed("a client comes twice")
        self._seen.add(client)
        self._structs += count
        if self._structs > MOST_STRUCTS or count > reader.left:
            raise Malformed("too many structs")
        needs: dict[int, int] = {}
        for _ in range(count):
            info = reader.byte()
            if info & 31 == _SKIP:
                clock += reader.number()
                continue
            clock = self._one(client, clock, info, needs)
        if clock > MOST_CLOCK:
            raise Malformed("a clock that no client reaches")
        for other, end in needs.items():
            self._needs[other] = max(end, self._needs.get(other, 0))

    def _one(self, client: int, start: int, info: int, needs: dict[int, int]) -> int:
        """Read one struct; return the clock after it."""
        size, reference, fresh = self._struct(info, needs)
        if needs.get(client, 0) > start and not self._stored:
            raise Malformed("a struct that stands on itself or on a later one")
        clock = start + size
        if size > 1 and info & 31 != _GC:
            self.items.append((client, start, clock))
        if self._collects and info & 31 != _GC:
            beside = None if reference is None or reference[2] else reference[:2]
            content = self._reader.read_since(self._content_left)
            item = (client, start, clock, beside, self._place, info & 31, content)
            self.written.append(WrittenItem._make(item))
        self._fields += fresh is not _NONE
        self._actions += fresh is _ACTION
        if reference is not None:
            self._placed.append(Placed((client, start, clock), *reference))
        if info & 31 == _STRING and self._contents.paired:
            self._paired.append(PairedText(client, start, self._contents.paired))
        brings = self._brings
        if brings and brings[-1][0] == client and brings[-1][2] == start:
            brings[-1] = (client, brings[-1][1], clock)
        else:
            brings.append((client, start, clock))
        return clock

    def _struct(self, info: int, needs: dict[int, int]) -> tuple[int, _Reference | None, _Fresh]:
        """Read one struct. Return how many clocks it takes, the struct that gives its position, and
        the kind of key that may be new."""
        reader, kind = self._reader, info & 31
        if kind == _GC:
            return length(reader), None, _NONE
        reference: _Reference | None = None
        fresh: _Fresh = _NONE
        self._place = None
        if info & 0x80:
            client, clock = _need(reader, needs)
            reference = client, clock, False
            self.parted.append((client, clock + 1))
        if info & 0x40:
            right = _need(reader, needs)
            reference = reference or (*right, False)
            self.parted.append(right)
        if not info & 0xC0:
            parent = reader.number()
            root = b""
            if parent == 1:
                root = reader.text()
                fresh = _ACTION if root == b"actions" else _FIELD
                fresh = _NONE if kind == _DELETED else fresh
            elif parent == 0:
                reference = *_need(reader, needs), True
            else:
                raise Malformed("a struct without a parent")
            if info & 0x20:
                key = reader.text()
                fresh = _FIELD if b"|" in key and fresh is _ACTION else fresh
                self._place = (root, key) if parent == 1 else None
        self._content_left = reader.left
        return self._contents.content(kind), reference, fresh

    def _deletions(self) -> None:
        reader, needs = self._reader, self._needs
        for _ in range(reader.number()):
            client = _client(reader)
            for _ in range(reader.number()):
                start = reader.number()
                end = start + reader.number()
                if start == end and not self._stored:
                    raise Malformed("a deletion of nothing")
                if end > MOST_CLOCK:
                    raise Malformed("a clock that no client reaches")
                needs[client] = max(end, needs.get(client, 0))
                self.parted.extend(((client, start), (client, end)))
                if self._collects:
                    self.deleted.setdefault(client, []).append((start, end))


def _need(reader: ByteReader, needs: dict[int, int]) -> tuple[int, int]:
    client, clock = _client(reader), reader.number()
    if clock > MOST_CLOCK:
        raise Malformed("a clock that no client reaches")
    needs[client] = max(clock + 1, needs.get(client, 0))
    return client, clock


def _client(reader: ByteReader) -> int:
    client = reader.number()
    if client > MOST_CLIENT:
        raise Malformed("a client that cannot be")
    return client
