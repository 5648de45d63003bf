"""Streams that were taken out of a journal: after they were stored elsewhere, or dropped for their age.

The log says so before the first event goes, with the end of the stream and the chain up to it, so that
`verify` knows which events are missing on purpose, and what they must be where they are kept. Events
go from the newest to the oldest: what is left at any time is a sound beginning.
"""

from collections.abc import Sequence
from typing import Any, ClassVar, Final

import msgspec
from sqlalchemy import Connection, delete, func, select

from action_assistant.errors import Conflict
from action_assistant.journal.chain import Head
from action_assistant.journal.events import Event
from action_assistant.schema.editor_tables import editor_event, editor_snapshot

#: The stream of all removals.
STREAM: Final = "removed"
_SLICE: Final = 1_000  # events deleted in one transaction: others want to write, too


class StreamRemoved(msgspec.Struct, frozen=True):
    """A stream ends at `seq` with `chain` (hex) and is kept as `kept`, whose SHA-256 is `sha256`. Both
    are empty where the stream was dropped and is kept nowhere; then `first` and `last` are the
    positions of its events in the log."""

    kind: ClassVar[str] = "stream.removed.v1"

    stream: str
    seq: int
    chain: str
    kept: str
    sha256: str
    first: int = 0
    last: int = 0

    @property
    def end(self) -> Head:
        """Return the end of the stream (number and hash) at its removal."""
        return Head(self.seq, bytes.fromhex(self.chain))


def taken_out(event: Event) -> tuple[str, Head] | None:
    """Return the name of the stream that the event `event` removes from the log, and the end of
    that stream; None for an event that removes none."""
    if event.stream != STREAM or event.kind != StreamRemoved.kind:
        return None
    removed = msgspec.json.decode(event.body, type=StreamRemoved)
    return removed.stream, removed.end


def removed_by(row: Sequence[Any]) -> tuple[str, int] | None:
    """Return the name of the stream that a stored event removes from the log, and its last seq; None for
    another event. `row`: its columns in the database."""
    found = taken_out(Event(*row[:7])) if row[0] == STREAM else None
    return None if found is None else (found[0], found[1].seq)


def delete_some(connection: Connection, stream: str, by: int) -> bool:
    """Delete the newest events of a stream that was taken out, `_SLICE` of them at most, and its
    snapshots. Return whether any events of it are left. `by`: the seq of the event that records the
    removal of the stream. Raise Conflict if there is no such event or it names another stream."""
    event = editor_event.c
    said = select(event.body).where(event.stream == STREAM, event.seq == by)
    body = connection.execute(said).scalar()
    removed = None if body is None else msgspec.json.decode(body, type=StreamRemoved)
    if removed is None or removed.stream != stream:
        raise Conflict(f"Nothing says where {stream} is kept; it stays.")
    ours = event.stream == stream, event.seq <= removed.seq  # it may have gone on since
    newest = connection.execute(select(func.max(event.seq)).where(*ours)).scalar()
    first = (newest or 0) - _SLICE
    connection.execute(delete(editor_event).where(*ours, event.seq > first))
    connection.execute(delete(editor_snapshot).where(editor_snapshot.c.stream == stream))
    return first > 0
