"""The events of a journal, and the snapshots of its streams."""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, TypeAlias

import msgspec

if TYPE_CHECKING:  # workers read events too, and need no database
    from sqlalchemy import Executable


class Event(msgspec.Struct, frozen=True, gc=False):
    """A fact of the log. It is never changed and never deleted.

    `seq` counts the events of a stream from 1 without gaps; `position` orders what one writer has
    stored (`journal/slots.py`). `kind` is in the past tense with a version (`graph.updated.v1`). `at` is in
    microseconds since 1970, UTC: for people, never for ordering.
    """

    stream: str
    seq: int
    kind: str
    author: str
    at: int
    body: bytes
    position: int


#: An event of a stream most of whose events are of one kind, without what need not be said: its body,
#: and where it is of another kind, that and `at`. To make the rest takes longer than to read it.
BareEvent: TypeAlias = tuple[bytes, str | None, int | None]


class Draft(msgspec.Struct, frozen=True, gc=False):
    """An event that is to be stored: the journal gives it a number, a position and a time."""

    kind: str
    author: str
    body: bytes


class Addition(msgspec.Struct, frozen=True):
    """Drafts for one stream. `expected`: the newest `seq` that the caller knows; None to append in
    any case. `epoch`: how often the stream had changed hands when the caller came to own it; None where
    streams have no owners."""

    stream: str
    drafts: tuple[Draft, ...]
    expected: int | None = None
    epoch: int | None = None


def bare(events: Iterable[Event], usual: str) -> list[BareEvent]:
    """Return (body, kind, time) of each event; kind and time are None for events of the kind
    `usual`."""
    return [(e.body, *((None, None) if e.kind == usual else (e.kind, e.at))) for e in events]


class StreamSnapshot(msgspec.Struct, frozen=True):
    """The state of a stream at `seq`. It is a cache: it may vanish at any time."""

    stream: str
    seq: int
    state: bytes


#: Returns the statements by which an event changes the tables. Pure; they run in the transaction of the event.
Fold: TypeAlias = "Callable[[Event], Sequence[Executable]]"


def nothing(_: Event) -> "Sequence[Executable]":
    """Return no statements: the fold of a journal without tables."""
    return ()
