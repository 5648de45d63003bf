"""Reads the outline of an update without the CRDT library and within bounds (rule R4).

The library allocates by declared counts, recurses by nesting, and loses edits when it is given
several updates that wait for an earlier one. So nothing reaches it that was not read here first. It
also takes what Yjs in a page fails at, and gives it out to every page that comes, so that nobody could
open the graph any more; that is refused here. Clients never write it. Yjs update format, version 1.
"""

import json
from collections.abc import Mapping
from typing import Final, Literal, NamedTuple, NoReturn, TypeAlias

from action_assistant.editor.crdt.messages import ByteReader, Malformed
from action_assistant.editor.crdt.nesting import Placed
from action_assistant.editor.crdt.updates.small_update import small_outline
from action_assistant.editor.crdt.updates.update_outline import (
    MOST_CLIENT,
    MOST_CLIENTS,
    MOST_CLOCK,
    MOST_STRUCTS,
    PairedText,
    UpdateOutline,
)

DEEPEST: Final = 64  # of arrays and objects in one value

_FIXED: Final = {127: 0, 126: 0, 124: 4, 123: 8, 122: 8, 121: 0, 120: 0}  # bytes of plain values
_WHOLE, _OBJECT, _ARRAY = 125, 118, 117
_TEXTS: Final = frozenset({119, 116})  # string, bytes
_NAMED_TYPES: Final = frozenset({3, 5})
#: Those that Yjs reads and the library gives out as they came: no hook (5), whose name it loses, and none
#: that only the library knows (9, 15).
_SHARED_TYPES: Final = frozenset({0, 1, 2, 3, 4, 6})
#: The options that Yjs and the library write for a sub-document. Its name among them would replace the real one.
_OPTIONS: Final = frozenset(
    {b"gc", b"autoLoad", b"shouldLoad", b"meta", b"collectionid", b"encoding"}
)
_MOST_WHOLE: Final = 2**53 - 1  # of a whole number, to either side
_GC, _DELETED, _STRING, _SKIP = 0, 1, 4, 10


def outline(update: bytes) -> UpdateOutline:
    """Return the outline (summary of contents) of an update. Raise Malformed if it cannot be read,
    exceeds the limits, or would fail in a page."""
    return small_outline(update) or scanned(update)


def stored_outline(update: bytes) -> UpdateOutline:
    """Return the outline (summary of contents) of an update from the log, also of one that today's
    rules would refuse, so that old graphs still open. Raise Malformed if it cannot be read."""
    return small_outline(update) or scanned(update, stored=True)


def scanned(update: bytes, *, stored: bool = False) -> UpdateOutline:
    """Return the outline (summary of contents) of an update by reading all of it, without the short
    cut for small updates. Raise Malformed if it cannot be read; with `stored`, an update that only
    today's rules refuse is accepted."""
    scan = Scan(ByteReader(update), stored=stored)
    scan.whole()
    return scan.outline()


def places_parted(update: bytes) -> list[tuple[int, int]]:
    """Return the positions, as Yjs client and clock (item number), before which this update splits
    a text item. Raise Malformed if it cannot be read."""
    scan = Scan(ByteReader(update), stored=True)
    scan.whole()
    return scan.parted


def cut_items(update: bytes, known: Mapping[int, int]) -> list[int]:
    """Return the Yjs client ids of which a document has only the first part of an item of this
    update. `known`: the next clock (item number) of each client in the document. Raise Malformed if
    the update cannot be read."""
    scan = Scan(ByteReader(update), stored=True)
    scan.whole()
    return [c for c, start, end in scan.items if start < known.get(c, 0) < end]


class WrittenItem(NamedTuple):
    """An item of an update, with the clocks (item numbers of the client) from `start` to `end`.
    `place`: the name of a root map and a key in it; None where the item does not name them. Then
    they are those of the item `beside`, a client and a clock, if there is one. `content`: the bytes
    after those."""

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
    """Read the items of an update that a room accepted, or of a whole document. Raise Malformed if
    it cannot be read."""
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
        """Return the outline of the update that `whole` has read."""
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
        """Read all structs of the next client in the update. Raise Malformed if they break a rule."""
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
        """Read one struct of `client`; return the clock (item number) that follows the struct.
        `start`: the first clock of the struct; `info`: its first byte. Raise the entries of
        `needs` (client to the number of that client's items that must be there before) for all
        items that the struct names. Raise Malformed if the struct is cut off or breaks the Yjs
        format or its order."""
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
        """Read one struct (item of the document) after its first byte, `info`. Return how many
        clocks (item numbers) it takes; the struct beside or around it that gives its position, None
        for a root; and whether its key may be that of a new action or field. `needs`: is increased,
        by client, to the clocks that must exist before. Raise Malformed if it breaks a rule."""
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


class ContentReader:
    """Reads the contents of structs, one after the other. `stored`: also accept old content that
    today's rules refuse, so that old graphs still open."""

    def __init__(self, reader: ByteReader, *, stored: bool = False) -> None:
        self._reader = reader
        self._stored = stored
        #: Text in UTF-16 of the last content that has characters of two units; the library cannot part those.
        self.paired = b""

    def content(self, kind: int) -> int:
        """Read the content of one struct of this kind, and return how many clocks (item numbers) it
        takes. Raise Malformed if it cannot be read."""
        reader = self._reader
        self.paired = b""
        match kind:
            case 1:  # deleted
                return length(reader)
            case 2:
                return self._texts_of_json()
            case 3:  # binary
                reader.text()
            case 4:
                return self._string()
            case 5:  # embed
                self._json()
            case 6:  # format
                reader.text()
                self._json()
            case 7:
                self._shared_type()
            case 8:  # any
                count = length(reader)
                for _ in range(_counted(reader, count)):
                    self._any()
                return count
            case 9:
                self._sub_document()
            case _:
                raise Malformed(f"there is no content of kind {kind}")
        return 1

    def _texts_of_json(self) -> int:
        """Skip content that only the first versions of Yjs wrote, and return how many clocks (item
        numbers) it takes. Raise Malformed for a new update, since the library counts such content
        otherwise than pages do."""
        if not self._stored:
            raise Malformed("content that only the first Yjs wrote")
        count = length(self._reader)
        for _ in range(_counted(self._reader, count)):
            self._reader.text()
        return count

    def _string(self) -> int:
        text = self._reader.text()
        try:
            characters = text.decode()
        except UnicodeDecodeError as error:
            raise Malformed("text that is no UTF-8") from error
        units = characters.encode("utf-16-le")
        if not units and not self._stored:
            raise Malformed("a struct of length 0")
        if len(units) > 2 * len(characters):
            self.paired = units
        return len(units) // 2

    def _json(self) -> None:
        text = self._reader.text()
        if self._stored:
            return
        try:
            json.loads(text.decode(), parse_constant=_no_constant)
        except (ValueError, RecursionError) as error:
            raise Malformed("text that is no JSON") from error

    def _shared_type(self) -> None:
        kind = self._reader.number()
        if kind not in _SHARED_TYPES and not self._stored:
            raise Malformed(f"there is no shared type {kind}")
        if kind in _NAMED_TYPES:
            self._reader.text()

    def _sub_document(self) -> None:
        reader = self._reader
        reader.text()
        if self._stored:
            self._any()
            return
        if reader.byte() != _OBJECT:
            raise Malformed("a sub-document without options")
        for _ in range(reader.number()):
            if reader.text() not in _OPTIONS:
                raise Malformed("an option that sub-documents do not have")
            self._any()

    def _any(self) -> None:
        """Skip one value, without recursion: a stack holds the number of members left. Raise
        Malformed if it breaks a rule."""
        reader = self._reader
        open_: list[tuple[int, bool]] = [(1, False)]
        while open_:
            left, keyed = open_.pop()
            if left == 0:
                continue
            open_.append((left - 1, keyed))
            if keyed:
                reader.text()
            kind = reader.byte()
            if kind in _FIXED:
                reader.skip(_FIXED[kind])
            elif kind == _WHOLE:
                self._whole()
            elif kind in _TEXTS:
                reader.text()
            elif kind in {_OBJECT, _ARRAY}:
                if len(open_) > DEEPEST:
                    raise Malformed("nested too deeply")
                open_.append((_counted(reader, reader.number()), kind == _OBJECT))
            else:
                raise Malformed(f"there is no value of kind {kind}")

    def _whole(self) -> None:
        if self._stored:
            self._reader.skip_signed()
        elif self._reader.magnitude() > _MOST_WHOLE:
            raise Malformed("a whole number that pages cannot read")


def length(reader: ByteReader) -> int:
    """Read the length of a struct in clocks (item numbers). Raise Malformed for 0."""
    found = reader.number()
    if found == 0:
        raise Malformed("a struct of length 0")
    return found


def _counted(reader: ByteReader, count: int) -> int:
    if count > reader.left:
        raise Malformed("more members than bytes")
    return count


def _no_constant(name: str) -> NoReturn:
    """Raise ValueError for `NaN` and the infinities (`name`), which only Python's JSON parser
    accepts."""
    raise ValueError(name)
