"""Texts with characters of two clocks, which no change may split.

Yjs counts text in UTF-16 units, and such a character has two. Where a deletion or a struct parts the two, the
CRDT library counts one of its own texts otherwise than it says, and gives out a document at which every page
fails. Documents of graphs hold no text but in values; other clients may write some.
"""

import re
from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from itertools import accumulate
from typing import Final

from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.updates.update_outline import PairedText, UpdateOutline
from action_assistant.editor.crdt.updates.update_scan import places_parted, scanned, stored_outline

MOST_BYTES: Final = 4 << 20  # of memory for all such texts of a document
_EACH: Final = 200  # bytes of memory for one, beside its units
_MOST_SOUGHT: Final = 1 << 20  # bytes of a document in which they are sought on the loop
_OF_TWO: Final = re.compile(rb"[\xf0-\xf4][\x80-\xbf]{3}")  # such a character in UTF-8
#: Each byte that such a character has as one of two: a text is found much sooner than the pattern.
_CLASSES: Final = bytes.maketrans(
    bytes([*range(0x80, 0xC0), *range(0xF0, 0xF5)]), b"\x80" * 64 + b"\xf0" * 5
)
_AS_CLASSES: Final = b"\xf0\x80\x80\x80"


class PairedTexts:
    """The texts of one document with surrogate pairs (characters of two UTF-16 units)."""

    def __init__(self, kept: Iterable[PairedText] = ()) -> None:
        self._by_client: Final[dict[int, list[PairedText]]] = {}
        self._bytes = 0
        self._add(kept)

    def all(self) -> list[PairedText]:
        """Return all stored texts, grouped by client."""
        return [each for found in self._by_client.values() for each in found]

    def check(self, update: bytes, read: UpdateOutline, known: Mapping[int, int]) -> None:
        """Raise Malformed for an update that would split a surrogate pair, or whose new texts with
        surrogate pairs would need more memory, together with the document's, than `MOST_BYTES`.
        `read`: the outline of the update. `known`: the number of items (clock) of each Yjs client
        in the document."""
        if not self._by_client and not read.paired:
            return
        news = _new(read, known)
        if news and self._bytes + _size(news) > MOST_BYTES:
            raise Malformed("more text outside of values than is kept")
        known_ends = [
            (client, known[client])
            for client, start, end in read.brings
            if start < known.get(client, 0) < end
        ]
        fresh = PairedTexts(read.paired)
        for client, clock in [*places_parted(update), *known_ends]:
            if self._is_within(client, clock) or fresh._is_within(client, clock):
                raise Malformed("a change within one character")

    def learn(self, read: UpdateOutline, known: Mapping[int, int]) -> None:
        """Add the texts in the outline (`read`) of an update that is applied. `known`: the number
        of items (clock) of each Yjs client before that."""
        if read.paired:
            self._add(_new(read, known))

    def _add(self, texts: Iterable[PairedText]) -> None:
        added = list(texts)
        for each in added:
            self._by_client.setdefault(each.client, []).append(each)
        for client in {each.client for each in added}:
            self._by_client[client].sort(key=_start)
        self._bytes += _size(added)

    def _is_within(self, client: int, clock: int) -> bool:
        texts = self._by_client.get(client, [])
        at = bisect_right(texts, clock, key=_start) - 1
        return at >= 0 and texts[at].is_within(clock)


def has_paired_texts(bodies: Sequence[bytes]) -> bool:
    """Return whether any of these stored updates (`bodies`) has a text with surrogate pairs
    (characters of two UTF-16 units). Raise Malformed if an update cannot be read."""
    text = b"\x00".join(bodies).translate(_CLASSES)
    starts: list[int] = []
    at = text.find(_AS_CLASSES)
    while at >= 0:  # by chance in a few; in values of many, where a name has such a character
        starts = starts or list(accumulate((len(body) + 1 for body in bodies), initial=0))
        place = bisect_right(starts, at) - 1
        if stored_outline(bodies[place]).paired:
            return True
        at = text.find(_AS_CLASSES, starts[place + 1])
    return False


def paired_texts_in(state: bytes) -> list[PairedText]:
    """Search an encoded document for texts with surrogate pairs, if its snapshot does not list
    them; return an empty list if it is too large for that."""
    if len(state) <= _MOST_SOUGHT and _OF_TWO.search(state):
        with suppress(Malformed):
            return list(scanned(state, stored=True).paired)
    return []


def _start(text: PairedText) -> int:
    return text.start


def _size(texts: Iterable[PairedText]) -> int:
    return sum(len(each.units) + _EACH for each in texts)


def _new(read: UpdateOutline, known: Mapping[int, int]) -> list[PairedText]:
    return [each for each in read.paired if each.end > known.get(each.client, 0)]
