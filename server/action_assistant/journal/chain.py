"""The chain through each stream, by which every change of a stored event shows."""

import itertools
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from hashlib import blake2b
from struct import Struct, pack
from typing import Any, Final, NamedTuple

import msgspec

from action_assistant.journal.events import Event
from action_assistant.journal.slots import before_first, slot_of

START: Final = bytes(16)
_PLACE: Final = Struct(">qqq").pack
_TYPES: Final = (str, int, str, str, int, bytes, int, bytes)


class Head(msgspec.Struct, frozen=True, gc=False):
    """The end of a stream: the number (`seq`) of its last event, and the chain of hashes up to it
    (16 bytes)."""

    seq: int
    chain: bytes


NOTHING: Final = Head(0, START)


class Damage(msgspec.Struct, frozen=True):
    """A fault of a stream: its events before `seq` are sound, that one is not. Without a stream:
    the file itself is damaged."""

    stream: str
    seq: int
    why: str


def link(before: bytes, event: Event) -> bytes:
    """Return the chain at an event: a digest of all its fields and of the chain before it."""
    place = _PLACE(event.seq, event.at, event.position)
    names = _names(event.stream, event.kind, event.author)
    return blake2b(b"".join((before, names, place, event.body)), digest_size=16).digest()


class StoredColumns(NamedTuple):
    """Consecutive events of one stream as the database has them, column by column."""

    seqs: Sequence[int]
    kinds: Sequence[str]
    authors: Sequence[str]
    ats: Sequence[int]
    bodies: Sequence[bytes]
    positions: Sequence[int]
    chains: Sequence[bytes]


def linked(before: bytes, stream: str, events: StoredColumns) -> int:
    """Return how many events of a stream, counted from the first, continue the chain of hashes
    whose last link is `before`. This compares the stored chain of each event with the result of
    `link`, but takes half the time."""
    told = {
        pair: _names(stream, *pair) for pair in set(zip(events.kinds, events.authors, strict=True))
    }
    names = map(told.__getitem__, zip(events.kinds, events.authors, strict=True))
    places = map(_PLACE, events.seqs, events.ats, events.positions)
    befores = itertools.chain((before,), events.chains)  # one more than there are events
    texts = map(b"".join, zip(befores, names, places, events.bodies, strict=False))
    for n, (text, written) in enumerate(zip(texts, events.chains, strict=True)):
        if blake2b(text, digest_size=16).digest() != written:
            return n
    return len(events.seqs)


@lru_cache(maxsize=1024)
def _names(*texts: str) -> bytes:
    """Encode the texts that most links of a stream share. Damaged text must not raise an error
    here: the check reports it."""
    # Damaged text has to be told, not to fail.
    encoded = [text.encode("utf-8", "surrogateescape") for text in texts]
    return b"".join(pack(">I", len(data)) + data for data in encoded)


class Inspector:
    """Checks all stored events, and collects damage. They come in the order of their positions; those of
    several slots in one that keeps the order of each slot and of each stream. `removed`:
    returns which stream an event removes from the log, and the end of that stream; None for other
    events."""

    def __init__(
        self, removed: Callable[[Event], tuple[str, Head] | None] = lambda _: None
    ) -> None:
        self.seen = 0
        self._removed = removed
        self._heads: dict[str, Head] = {}
        self._damages: dict[str, Damage] = {}
        self._position = 0  # the last one in the present slot
        self._slot = 0
        self._left: dict[int, int] = {}  # the last position in each other slot
        self._missing = 0  # positions at which there is nothing
        self._gone = 0  # events that were taken out
        self._gap: Damage | None = None  # the first

    def see(self, row: Sequence[Any]) -> None:
        """Check the next stored event. `row`: its eight columns in the database."""
        self.seen += 1
        self._position += 1
        stream = row[0] if isinstance(row[0], str) else repr(row[0])
        before = self._heads.get(stream, NOTHING)
        if tuple(map(type, row)) != _TYPES:
            self._note(stream, before.seq + 1, "it holds values of the wrong kind")
            self._heads[stream] = Head(before.seq + 1, START)
            return
        event, chain = Event(*row[:7]), row[7]
        if slot_of(event.position) != self._slot:
            self._turn_to(slot_of(event.position))
        if event.seq != before.seq + 1:
            self._note(stream, before.seq + 1, f"{event.seq} stands in its place")
        elif chain != link(before.chain, event):
            self._note(stream, event.seq, "it is not what was written")
        elif event.position < self._position and not self._damages:
            self._note(stream, event.seq, f"position {event.position} was there before")
        elif event.position > self._position:
            why = f"events before position {event.position} are missing"
            self._gap = self._gap or Damage(stream, event.seq, why)
            self._missing += event.position - self._position
        self._position = event.position
        self._heads[stream] = Head(event.seq, chain)
        if stream not in self._damages and (taken := self._removed(event)) is not None:
            self._take_out(*taken)

    def _turn_to(self, slot: int) -> None:
        """Count positions in another slot from now on. The next event was counted in the present one."""
        self._left[self._slot] = self._position - 1
        self._slot = slot
        self._position = self._left.get(slot, before_first(slot)) + 1

    def _take_out(self, stream: str, end: Head) -> None:
        """Record that a stream was removed from the log and ended at `end`. Its first events may
        still be in the log."""
        here = self._heads.get(stream, NOTHING)
        if here.seq > end.seq or (here.seq == end.seq and here.chain != end.chain):
            self._note(stream, end.seq, "it is not what was taken out")
        self._gone += max(0, end.seq - here.seq)
        self._heads[stream] = end

    @property
    def damage(self) -> Damage | None:
        """Return one damage of the events that were inspected so far; None if there is none."""
        return next(iter(self._damages.values()), None)

    def findings(self, ends: Iterable[Sequence[Any]] | None) -> list[Damage]:
        """Return the first damage of each stream. `ends`: the stored stream, seq and chain of each
        stream's end."""
        if self._missing != self._gone and self._gap is not None and not self._damages:
            self._note(self._gap.stream, self._gap.seq, self._gap.why)
        heads = self._heads if ends is None else self._written(ends)
        for stream in sorted(heads.keys() | self._heads.keys()):
            end, found = heads.get(stream, NOTHING), self._heads.get(stream, NOTHING)
            if end.seq > found.seq:
                self._note(stream, found.seq + 1, f"the stream went on to {end.seq}")
            elif end != found:
                self._note(stream, found.seq, f"the stream's end is written down as {end.seq}")
        return sorted(self._damages.values(), key=lambda each: (each.stream, each.seq))

    def _written(self, ends: Iterable[Sequence[Any]]) -> dict[str, Head]:
        """Return the end of each stream as stored in the database (`ends`: rows). A value of the
        wrong type is recorded as damage."""
        heads = {}
        for stream, seq, chain in ends:
            if (type(stream), type(seq), type(chain)) == (str, int, bytes):
                heads[stream] = Head(seq, chain)
            else:
                name = stream if isinstance(stream, str) else repr(stream)
                self._note(name, 0, "its end is written down in values of the wrong kind")
        return heads

    def _note(self, stream: str, seq: int, why: str) -> None:
        self._damages.setdefault(stream, Damage(stream, seq, why))
