"""Reads what an update consists of, without the CRDT library and within bounds (rule R4).

The library allocates by declared counts, recurses by nesting, and loses edits when it is given
several updates that wait for an earlier one. So nothing reaches it that was not read here first.
Yjs update format, version 1.
"""

from typing import Final, Literal, TypeAlias

from action_assistant.editor.crdt.messages import ByteReader, Malformed
from action_assistant.editor.crdt.nesting import Placed
from action_assistant.editor.crdt.small_update import small_outline
from action_assistant.editor.crdt.update_outline import (
    MOST_CLIENT,
    MOST_CLIENTS,
    MOST_CLOCK,
    MOST_STRUCTS,
    UpdateOutline,
)

DEEPEST: Final = 64  # of arrays and objects in one value

_GC, _DELETED, _JSON, _BINARY, _STRING, _EMBED, _FORMAT, _TYPE, _ANY, _DOC, _SKIP = range(11)
_FIXED: Final = {127: 0, 126: 0, 124: 4, 123: 8, 122: 8, 121: 0, 120: 0}  # bytes of plain values
_NAMED_TYPES: Final = frozenset({3, 5})


def outline(update: bytes) -> UpdateOutline:
    """Read an update. Raises Malformed for what is none, or beyond the bounds."""
    return small_outline(update) or scanned(update)


def scanned(update: bytes) -> UpdateOutline:
    """Read an update of any kind: `outline` without its short cut. Raises Malformed."""
    reader = ByteReader(update)
    brings: list[tuple[int, int, int]] = []
    needs: dict[int, int] = {}
    placed: list[Placed] = []
    seen: set[int] = set()
    clients = reader.number()
    if clients > MOST_CLIENTS or clients * 3 > reader.left:
        raise Malformed("too many clients")
    structs = actions = fields = 0
    for _ in range(clients):
        count, client, clock = reader.number(), _client(reader), reader.number()
        if client in seen:
            raise Malformed("a client comes twice")
        seen.add(client)
        structs += count
        if structs > MOST_STRUCTS or count > reader.left:
            raise Malformed("too many structs")
        for _ in range(count):
            start = clock
            info = reader.byte()
            if info & 31 == _SKIP:
                clock += reader.number()
                continue
            length, reference, fresh = _struct(reader, info, needs)
            clock += length
            fields += fresh is not _NONE
            actions += fresh is _ACTION
            if reference is not None:
                placed.append(Placed((client, start, clock), *reference))
            if brings and brings[-1][0] == client and brings[-1][2] == start:
                brings[-1] = (client, brings[-1][1], clock)
            else:
                brings.append((client, start, clock))
        if clock > MOST_CLOCK:
            raise Malformed("a clock that no client reaches")
    _deletions(reader, needs)
    if reader.left:
        raise Malformed("something follows the update")
    return UpdateOutline(tuple(brings), needs, tuple(placed), actions, fields, structs)


def _client(reader: ByteReader) -> int:
    client = reader.number()
    if client > MOST_CLIENT:
        raise Malformed("a client that cannot be")
    return client


def _deletions(reader: ByteReader, needs: dict[int, int]) -> None:
    for _ in range(reader.number()):
        client = _client(reader)
        for _ in range(reader.number()):
            end = reader.number() + reader.number()
            if end > MOST_CLOCK:
                raise Malformed("a clock that no client reaches")
            needs[client] = max(end, needs.get(client, 0))


#: A struct that tells where this one lies, and whether inside it.
_Reference: TypeAlias = tuple[int, int, bool]
#: What kind of key in a root a struct may add.
_Fresh: TypeAlias = Literal["none", "field", "action"]
_NONE: Final = "none"
_FIELD: Final = "field"
_ACTION: Final = "action"


def _struct(
    reader: ByteReader, info: int, needs: dict[int, int]
) -> tuple[int, _Reference | None, _Fresh]:
    """One struct; how many clocks it takes, and which key may be new with it."""
    kind = info & 31
    if kind == _GC:
        return _length(reader), None, _NONE
    reference: _Reference | None = None
    fresh: _Fresh = _NONE
    if info & 0x80:
        reference = *_need(reader, needs), False
    if info & 0x40:
        right = *_need(reader, needs), False
        reference = reference or right
    if not info & 0xC0:
        parent = reader.number()
        if parent == 1:
            fresh = _ACTION if reader.text() == b"actions" else _FIELD
            fresh = _NONE if kind == _DELETED else fresh
        elif parent == 0:
            reference = *_need(reader, needs), True
        else:
            raise Malformed("a struct without a parent")
        if info & 0x20:
            fresh = _FIELD if b"|" in reader.text() and fresh is _ACTION else fresh
    return _content(reader, kind), reference, fresh


def _need(reader: ByteReader, needs: dict[int, int]) -> tuple[int, int]:
    client, clock = _client(reader), reader.number()
    if clock > MOST_CLOCK:
        raise Malformed("a clock that no client reaches")
    needs[client] = max(clock + 1, needs.get(client, 0))
    return client, clock


def _content(reader: ByteReader, kind: int) -> int:
    match kind:
        case 1:  # deleted
            return _length(reader)
        case 2:  # JSON
            count = _length(reader)
            for _ in range(_counted(reader, count)):
                reader.text()
            return count
        case 3 | 5:  # binary, embed
            reader.text()
        case 4:
            return _utf16(reader.text())
        case 6:  # format
            reader.text()
            reader.text()
        case 7:
            if reader.number() in _NAMED_TYPES:
                reader.text()
        case 8:  # any
            count = _length(reader)
            for _ in range(_counted(reader, count)):
                _any(reader)
            return count
        case 9:  # sub-document
            reader.text()
            _any(reader)
        case _:
            raise Malformed(f"there is no content of kind {kind}")
    return 1


def _any(reader: ByteReader) -> None:
    """One value, without recursion: a stack of how many members are still to come."""
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
        elif kind == 125:
            reader.skip_signed()
        elif kind in {119, 116}:  # string, bytes
            reader.text()
        elif kind in {118, 117}:  # object, array
            if len(open_) > DEEPEST:
                raise Malformed("nested too deeply")
            open_.append((_counted(reader, reader.number()), kind == 118))
        else:
            raise Malformed(f"there is no value of kind {kind}")


def _length(reader: ByteReader) -> int:
    length = reader.number()
    if length == 0:
        raise Malformed("a struct of length 0")
    return length


def _counted(reader: ByteReader, count: int) -> int:
    if count > reader.left:
        raise Malformed("more members than bytes")
    return count


def _utf16(text: bytes) -> int:
    """The length of UTF-8 text in UTF-16 units, as Yjs counts it."""
    try:
        return len(text.decode().encode("utf-16-le")) // 2
    except UnicodeDecodeError as error:
        raise Malformed("text that is no UTF-8") from error
