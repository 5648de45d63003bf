"""Splits one large update into small ones that can be applied one after the other. Runs in workers.

The CRDT library applies an update in one call that holds the interpreter, 45 ms for each MB. Between two small ones
the event loop does something else. Yjs update format, version 1: the bytes of a struct say the same in any update.
"""

from collections.abc import Iterator
from typing import Final

from action_assistant.editor.crdt.messages import ByteReader, Malformed, number
from action_assistant.editor.crdt.updates.update_scan import Scan

PIECE_BYTES: Final = 64 * 1024
_SKIP: Final = 10


class _Structs:
    """The structs (items) of one client: `ends` in clocks (item numbers), `offsets` in bytes, and
    the clocks of other clients that each needs."""

    def __init__(self, start: int, offset: int) -> None:
        self.ends: Final = [start]
        self.offsets: Final = [offset]
        self.needs: Final[list[tuple[tuple[int, int], ...]]] = []
        self.given = 0  # how many of them are in the pieces so far

    @property
    def reached(self) -> int:
        """The clock (item number) up to which structs are in earlier pieces."""
        return self.ends[self.given]


class _Splitter(Scan):
    """Records the offset of each struct of an update, and what it needs. Raise Malformed for an
    update with gaps."""

    def __init__(self, update: bytes) -> None:
        self._bytes_reader = ByteReader(update)
        super().__init__(self._bytes_reader, stored=True)
        self._size = len(update)
        self.of: Final[dict[int, _Structs]] = {}
        self.deletions = 0  # the offset of the deletions

    def _client_structs(self) -> None:
        reader = self._bytes_reader
        count, client, clock = reader.number(), reader.number(), reader.number()
        structs = self.of[client] = _Structs(clock, self._offset)
        for _ in range(count):
            info = reader.byte()
            if info & 31 == _SKIP:
                raise Malformed("an update with a gap")
            needs: dict[int, int] = {}
            size, _, _ = self._struct(info, needs)
            structs.ends.append(structs.ends[-1] + size)
            structs.offsets.append(self._offset)
            structs.needs.append(tuple(needs.items()))

    def _deletions(self) -> None:
        self.deletions = self._offset
        super()._deletions()

    @property
    def _offset(self) -> int:
        return self._size - self._bytes_reader.left


def pieces_of(update: bytes, size: int = PIECE_BYTES) -> list[bytes]:
    """Split an update into updates of about `size` bytes with the same result, each of which needs
    only earlier ones. Return a small or unsplittable update alone."""
    if len(update) <= size:
        return [update]
    try:
        found = _Splitter(update)
        found.whole()
        pieces = list(_packed(update, found.of, size))
    except Malformed:
        return [update]
    return [*pieces, b"\0" + update[found.deletions :]]


def _packed(update: bytes, of: dict[int, _Structs], size: int) -> Iterator[bytes]:
    """Yield pieces of an update of about `size` bytes each, as updates of their own; a piece has
    consecutive structs of each of its clients."""
    begun: dict[int, int] = {}  # the first struct of each client in this piece
    held = 0
    for client in _in_order(of):
        structs = of[client]
        last = structs.given - 1
        begun.setdefault(client, last)
        held += structs.offsets[last + 1] - structs.offsets[last]
        if held >= size:
            yield _piece(update, of, begun)
            begun, held = {}, 0
    if begun:
        yield _piece(update, of, begun)


def _in_order(of: dict[int, _Structs]) -> Iterator[int]:
    """Yield a client for each struct, meaning the next struct of that client, in an order in which
    every struct comes after the ones that it needs. Raise Malformed if structs need each other in a
    circle."""
    for first in of:
        wanted = [(first, of[first].ends[-1])]  # clients, each up to a clock; the last one first
        while wanted:
            client, upto = wanted[-1]
            structs = of[client]
            if structs.reached >= upto:
                wanted.pop()
            elif (missing := _missing(of, client, structs)) is None:
                structs.given += 1
                yield client
            elif missing in wanted:
                raise Malformed("structs that build on each other")
            else:
                wanted.append(missing)


def _missing(of: dict[int, _Structs], client: int, structs: _Structs) -> tuple[int, int] | None:
    """Return the client and clock (item number) that must come before the next struct of `client`;
    None if nothing is missing."""
    for other, clock in structs.needs[structs.given]:
        if other != client and other in of and of[other].reached < clock <= of[other].ends[-1]:
            return other, clock
    return None


def _piece(update: bytes, of: dict[int, _Structs], begun: dict[int, int]) -> bytes:
    parts = [number(len(begun))]
    for client, first in begun.items():
        structs = of[client]
        parts += [number(structs.given - first), number(client), number(structs.ends[first])]
        parts.append(update[structs.offsets[first] : structs.offsets[structs.given]])
    return b"".join((*parts, b"\0"))
