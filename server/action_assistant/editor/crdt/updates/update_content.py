"""Reads the content of a struct of an update, within bounds, and refuses what Yjs in a page fails at.

The CRDT library takes some of that and gives it out again to every page that comes, so that nobody could
open the graph any more. Clients never write it. Yjs update format, version 1.
"""

import json
from typing import Final, NoReturn

from action_assistant.editor.crdt.messages import ByteReader, Malformed

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


class ContentReader:
    """Reads the contents of structs, one after the other. `stored`: also accept old content that
    today's rules refuse, so that old graphs still open."""

    def __init__(self, reader: ByteReader, *, stored: bool = False) -> None:
        self._reader = reader
        self._stored = stored
        #: Text in UTF-16 of the last content that has characters of two units; the library cannot part those.
        self.paired = b""

    def content(self, kind: int) -> int:
        """Read the content of one struct of this kind, and return how many clocks it takes. Raise
        Malformed if it cannot be read."""
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
        """Read content that only the first versions of Yjs wrote, and return its clocks. It is
        refused in new updates, since the library counts it otherwise than pages do."""
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
        """Skip one value, without recursion: a stack holds the number of members left."""
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
    """Read the length of a struct in clocks. Raises Malformed for 0."""
    found = reader.number()
    if found == 0:
        raise Malformed("a struct of length 0")
    return found


def _counted(reader: ByteReader, count: int) -> int:
    if count > reader.left:
        raise Malformed("more members than bytes")
    return count


def _no_constant(name: str) -> NoReturn:
    """Refuse `NaN` and the infinities, which only Python's JSON knows. Raise ValueError always."""
    raise ValueError(name)
