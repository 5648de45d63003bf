"""Reads updates that rooms have accepted only as far as a document needs it.

A room reads every update as a whole before it is stored, and the chain proves that it is still the same.
Opening a graph need not do that again: it asks whose the clients are, whether anything may lie deeper
than in a root, and afterwards whether anything is missing. The target for opening 100,000 changes, 0.5 s, needs
that: a worker folds them in 0.27 s, and in 1.01 s where it reads each. For workers: what a room never took may
end them.

Rooms tell what waits, deletions too, as such, and did so before there was any data to keep. So the others
build on what came before them, and those of one client come in their order: where one were missing, so would
be the end of that client's last.
"""

import bisect
import itertools
import re
from collections.abc import Mapping, Sequence
from typing import Final

from action_assistant.editor.crdt.messages import ByteReader
from action_assistant.editor.crdt.updates.update_scan import stored_outline

#: The beginning of an update with structs of one client: how many, whose.
_ONE_CLIENT: Final = re.compile(rb"\x01[\x01-\x7f]([\x80-\xff]*[\x00-\x7f])")
#: Matches every struct that lies in another one: its kind without neighbours, then a 0.
_MAY_LIE_INSIDE: Final = re.compile(rb"[\x01-\x09\x21-\x29]\x80*\x00")
_APART: Final = b"\xff"  # ends nothing that looks so
_KIND: Final = b"\x01"
#: Each byte that may be such a kind as one of them: two texts are found much sooner than the pattern.
_KINDS: Final = bytes.maketrans(bytes([*range(1, 10), *range(0x21, 0x2A)]), _KIND * 18)
_ENDS: Final = (_KIND + b"\x00", b"\x80\x00")


class Uncertain(Exception):
    """The quick reading of these updates is not enough; they have to be read completely."""


class Clients:
    """The Yjs client ids in some updates. `authors`: the first author of each; `ends`: the number
    of its items (clock) after the updates."""

    def __init__(self, bodies: Sequence[bytes], authors: Sequence[str]) -> None:
        """Read the client ids of updates (`bodies`) and their authors. Raise Malformed if an update
        cannot be read."""
        self.authors: Final[dict[int, str]] = {}
        self.ends: Final[dict[int, int]] = {}
        last: dict[bytes, bytes] = {}  # of each client that is alone in an update
        for body, author in zip(bodies, authors, strict=True):
            begins = _ONE_CLIENT.match(body)
            if begins is None:
                if body[:1] != b"\x00":  # it has more than deletions
                    self._add(body, author)
                continue
            client_bytes = begins[1]
            if client_bytes not in last:
                self.authors.setdefault(ByteReader(client_bytes).number(), author)
            last[client_bytes] = body
        for body in last.values():
            self._add(body, "")

    def _add(self, body: bytes, author: str) -> None:
        for client, _, end in stored_outline(body).brings:
            self.authors.setdefault(client, author)
            self.ends[client] = max(end, self.ends.get(client, 0))


def lies_deep(bodies: Sequence[bytes]) -> bool:
    """Return whether any struct (item) of these updates lies inside another one instead of in a
    root map. Raise Malformed if an update cannot be read."""
    return any(
        any(each.inside for each in stored_outline(body).placed)
        for body in map(bodies.__getitem__, _doubtful(bodies))
        if _MAY_LIE_INSIDE.search(body, 0, len(body) - 1)  # the last 0 says: nothing was deleted
    )


def _doubtful(bodies: Sequence[bytes]) -> list[int]:
    """Return the indices of the updates whose bytes suggest that a struct lies inside another one.
    All updates with such a struct are among them, and some without."""
    text = _APART.join([body[:-1] for body in bodies]).translate(_KINDS)
    found: set[int] = set()
    starts: list[int] = []
    for end in _ENDS:
        at = text.find(end)
        while at >= 0:
            starts = starts or _starts(bodies)
            place = bisect.bisect_right(starts, at) - 1
            found.add(place)
            at = text.find(end, starts[place + 1])
    return sorted(found)


def _starts(bodies: Sequence[bytes]) -> list[int]:
    """Return the offset in bytes at which each update begins in the joined updates, and their whole
    length. Joining replaces the last byte of each update by a separator; so an empty update counts
    one byte."""
    return list(itertools.accumulate((len(body) or 1 for body in bodies), initial=0))


def check_nothing_is_missing(known: Mapping[int, int], ends: Mapping[int, int]) -> None:
    """Raise Uncertain if a document lacks Yjs items that its updates contain. `known`: the number
    of items of each client in the document (its clock); `ends`: the number after the updates."""
    if any(known.get(client, 0) < end for client, end in ends.items()):
        raise Uncertain
