"""The messages of a room's socket: y-protocols, and our acknowledgements.

See docs/room-protocol.md.
"""

from collections.abc import Iterable
from typing import Final, TypeAlias

import msgspec

SYNC: Final = 0
AWARENESS: Final = 1
QUERY_AWARENESS: Final = 3
ACKS: Final = 100
COMPARE: Final = 101
READ_ONLY: Final = 102
EPOCH: Final = 103
STEP_1: Final = 0
STEP_2: Final = 1
UPDATE: Final = 2
_UPDATE: Final = bytes((SYNC, UPDATE))
_AWARENESS: Final = bytes((AWARENESS,))

#: Close codes of accepted sockets, by what they mean.
UNREADABLE: Final = 1003  # a text frame
MALFORMED: Final = 1007
TOO_BIG: Final = 1009
RESTARTING: Final = 1012
TOO_SLOW: Final = 1013
SESSION_ENDED: Final = 4401
FORBIDDEN: Final = 4403
NO_SUCH_GRAPH: Final = 4404
OTHER_EPOCH: Final = 4409
FULL: Final = 4413
NOT_STORED: Final = 4503

REASONS: Final = {
    UNREADABLE: "only binary messages",
    MALFORMED: "not a message of this protocol",
    TOO_BIG: "an update may have 1 MiB",
    RESTARTING: "restarting, come again",
    TOO_SLOW: "too slow, come again",
    SESSION_ENDED: "session ended",
    FORBIDDEN: "may not change this graph",
    NO_SUCH_GRAPH: "no such graph",
    OTHER_EPOCH: "other epoch",
    FULL: "the graph is full",
    NOT_STORED: "nothing can be stored now, come again",
}

#: The reason of a close with FORBIDDEN after which a page reconnects with another client id.
OTHER_CLIENT: Final = "client id of another person"

UPDATE_LIMIT: Final = 1 << 20  # bytes
MOST_ENTRIES: Final = (
    2_000  # of an awareness message: one is the sender's own, the others are echoes
)
NOTHING_NEW: Final = b"\x00\x00"  # an update without structs and deletions
NO_CLOCKS: Final = b"\x00"  # the state vector of an empty document


class Malformed(Exception):
    """Raised for bytes that are no message of this protocol; the text gives the reason."""


class Question(msgspec.Struct, frozen=True):
    """Sync step 1 of Yjs: a client says what it has, as a state vector (a number per Yjs client),
    and asks for the rest of the document."""

    state: bytes


class Edit(msgspec.Struct, frozen=True, gc=False):
    """Sync step 2 or an update: something that the document may lack."""

    update: bytes


class PresenceEntry(msgspec.Struct, frozen=True, gc=False):
    """The awareness entry of one client. `state` is JSON text; `null` means that the client has left."""

    client: int
    clock: int
    state: bytes


class Presence(msgspec.Struct, frozen=True):
    """A message with awareness entries."""

    entries: tuple[PresenceEntry, ...]


class WhoIsThere(msgspec.Struct, frozen=True):
    """A request for all awareness entries."""


class CompareMessage(msgspec.Struct, frozen=True):
    """A fingerprint of the document that the client shows after change `seq`: its number of entries and the sum
    of their hashes."""

    seq: int
    entries: int
    total: int


Message: TypeAlias = Question | Edit | Presence | WhoIsThere | CompareMessage


class ByteReader:
    """Reads values in the variable-length encoding of lib0 (the library under Yjs). Raises
    Malformed past the end."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def number(self) -> int:
        """Read an unsigned number (varUint) of at most 64 bits and return it. Raise Malformed if it
        is longer or the message ends before."""
        number = shift = 0
        while True:
            if self._at >= len(self._data) or shift > 63:
                raise Malformed("a number has no end")
            byte = self._data[self._at]
            self._at += 1
            number |= (byte & 0x7F) << shift
            if byte < 0x80:
                return number
            shift += 7

    def text(self) -> bytes:
        """Read a byte string with its length (varUint8Array), or a text (varString), and return its
        bytes (UTF-8 for a text). Raise Malformed if the message ends before."""
        length = self.number()
        if length > self.left:
            raise Malformed("longer than the message")
        self._at += length
        return self._data[self._at - length : self._at]

    def byte(self) -> int:
        """Read one byte and return it. Raise Malformed at the end."""
        if self._at >= len(self._data):
            raise Malformed("the message ends early")
        self._at += 1
        return self._data[self._at - 1]

    def skip(self, count: int) -> None:
        """Skip `count` bytes. Raise Malformed past the end."""
        if count > self.left:
            raise Malformed("the message ends early")
        self._at += count

    def skip_signed(self) -> None:
        """Skip one signed number (varInt of lib0), however long."""
        while self.byte() & 0x80:
            pass

    def magnitude(self) -> int:
        """Read a signed varInt (lib0) of at most 62 bits and return its absolute value. Raise
        Malformed if the number is longer or the message ends before it does."""
        byte = self.byte()
        number, shift = byte & 0x3F, 6
        while byte & 0x80:
            if shift > 61:
                raise Malformed("a number has no end")
            byte = self.byte()
            number |= (byte & 0x7F) << shift
            shift += 7
        return number

    def read_since(self, left: int) -> bytes:
        """Return the bytes that were read since `left` bytes were left."""
        return self._data[len(self._data) - left : self._at]

    @property
    def left(self) -> int:
        """Return the number of bytes that were not read yet."""
        return len(self._data) - self._at


def parse(data: bytes) -> Message | None:
    """Parse a message of the WebSocket; return None for a kind that is not known, which is ignored.
    Raise Malformed if its content does not match its kind."""
    # Most are updates of less than 128 bytes.
    if data[:2] == _UPDATE and len(data) > 2 and data[2] <= min(0x7F, len(data) - 3):
        return Edit(data[3 : 3 + data[2]])
    if data[:1] == _AWARENESS and (entry := _one_entry(data)) is not None:
        return Presence((entry,))
    reader = ByteReader(data)
    kind = reader.number()
    if kind == SYNC:
        return _sync(reader)
    if kind == AWARENESS:
        return Presence(tuple(_entries(reader.text())))
    if kind == QUERY_AWARENESS:
        return WhoIsThere()
    if kind == COMPARE:
        return CompareMessage(reader.number(), reader.number(), reader.number())
    return None


def _sync(reader: ByteReader) -> Message:
    step = reader.number()
    if step == STEP_1:
        return Question(reader.text())
    if step in {STEP_2, UPDATE}:
        return Edit(reader.text())
    raise Malformed(f"there is no sync message {step}")


def _one_entry(data: bytes) -> PresenceEntry | None:
    """Read a presence message (Yjs awareness) with exactly one entry, as nearly all have. Return
    None for any other message, also for one that cannot be read."""
    try:
        size, at = _short(data, 1)
        end = at + size
        count, at = _short(data, at)
        client, at = _short(data, at)
        clock, at = _short(data, at)
        size, at = _short(data, at)
    except IndexError:
        return None
    if count != 1 or size < 0 or at + size != end or end > len(data):
        return None
    return PresenceEntry(client, clock, data[at:end])


def _short(data: bytes, at: int) -> tuple[int, int]:
    """Read an unsigned number (varUint) of at most five bytes at offset `at`, and return it with
    the offset of the byte after it. Raise IndexError if the data end within the number, or if it
    has more than five bytes."""
    byte = data[at]
    if byte < 128:
        return byte, at + 1
    number, shift = byte & 127, 7
    for place in range(at + 1, at + 5):
        byte = data[place]
        number |= (byte & 127) << shift
        if byte < 128:
            return number, place + 1
        shift += 7
    raise IndexError


def _entries(data: bytes) -> Iterable[PresenceEntry]:
    reader = ByteReader(data)
    count = reader.number()
    if count > MOST_ENTRIES:
        raise Malformed("too many entries")
    for _ in range(count):
        yield PresenceEntry(reader.number(), reader.number(), reader.text())


_SMALL: Final = tuple(bytes((value,)) for value in range(128))
_QUESTION, _ANSWER = (bytes((SYNC, step)) for step in (STEP_1, STEP_2))
_ACKS: Final = bytes((ACKS,))


def number(value: int) -> bytes:
    """Encode an unsigned number as a varUint of lib0."""
    if value < 128:
        return _SMALL[value]
    if value < 1 << 14:
        return bytes((0x80 | value & 0x7F, value >> 7))
    out = bytearray()
    while value > 0x7F:
        out.append(0x80 | (value & 0x7F))
        value >>= 7
    out.append(value)
    return bytes(out)


def text(value: bytes) -> bytes:
    """Encode bytes with their length (varUint8Array) or, if they are UTF-8, as a text (varString),
    which has the same form."""
    return number(len(value)) + value


def question(state: bytes) -> bytes:
    """Return the message of a sync step 1, which asks for what a state vector (what the sender has)
    lacks."""
    return _QUESTION + text(state)


def answer(update: bytes) -> bytes:
    """Return the message of a sync step 2, which answers step 1 with an update."""
    return _ANSWER + text(update)


def change(update: bytes) -> bytes:
    """Return the message that carries an update."""
    return _UPDATE + text(update)


def presence(entries: Iterable[PresenceEntry]) -> bytes:
    """Return the message that carries presence entries (Yjs awareness)."""
    packed = [number(e.client) + number(e.clock) + text(e.state) for e in entries]
    return bytes((AWARENESS,)) + text(number(len(packed)) + b"".join(packed))


def acks(messages: int, seq: int) -> bytes:
    """Return a message to a socket: the first `messages` edits that it sent are durable, and it was
    sent all changes of the log up to `seq`."""
    return _ACKS + number(messages) + number(seq)


def compared(seq: int, entries: int, total: int) -> bytes:
    """Return the message with the fingerprint of the document at `seq`: the number of its `entries`
    and the sum of their hashes (`total`)."""
    return bytes((COMPARE,)) + number(seq) + number(entries) + number(total)


def read_only(why: str) -> bytes:
    """Return the message that the document cannot be changed at all. `why`: the reason, as a
    sentence."""
    return bytes((READ_ONLY,)) + text(why.encode())


def epoch(name: str) -> bytes:
    """Return the message that names the epoch of the log (its history, a new one after a restored
    backup)."""
    return bytes((EPOCH,)) + text(name.encode())


#: Says nothing; sent so that a client which drops silent sockets does not.
BEAT: Final = presence(())
