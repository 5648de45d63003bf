"""The ends of all streams at an earlier moment, and one digest of them.

Whoever can write into a database can alter an event and make the chain anew from there: the log is then
sound in itself. It has other heads, which a digest that is kept elsewhere shows.
"""

import hashlib
from collections.abc import Callable, Iterable
from typing import Final

import msgspec
from sqlalchemy import and_, func, select

from action_assistant.errors import Conflict
from action_assistant.journal.chain import NOTHING, Head, link
from action_assistant.journal.database import Branch
from action_assistant.journal.events import Event
from action_assistant.journal.reader import JournalReader
from action_assistant.journal.removal import STREAM, StreamRemoved
from action_assistant.journal.slots import Cursor, is_between, slot_of
from action_assistant.schema.editor_tables import editor_event

_event: Final = editor_event.c

#: Reads the events of a stream that was taken out, from the file that it is kept as. Raises OSError, Refused.
ReadKept = Callable[[str], Iterable[Event]]


class LogHead(msgspec.Struct, frozen=True):
    """The end of a log: the moment after its last event, and a digest over the ends of all its
    streams, in hex."""

    cursor: Cursor
    digest: str


async def head_at(
    journal: JournalReader, branch: Branch, cursor: Cursor, read_kept: ReadKept
) -> LogHead:
    """Return the end of the log of a branch at the moment `cursor`, with a digest over
    the last event of each stream at that point. `read_kept` reads the events of streams that have
    been archived in the meantime. Raise OSError or Refused if an archive cannot be read, Conflict if
    a stream that went on then was dropped."""
    return LogHead(cursor, digest_of(branch, cursor, await heads_at(journal, cursor, read_kept)))


async def heads_at(journal: JournalReader, cursor: Cursor, read_kept: ReadKept) -> dict[str, Head]:
    """Return the end (number and hash) of each stream at the moment `cursor`. `read_kept`:
    reads the events of streams that were removed since. Raise OSError or Refused if one cannot be
    read, Unavailable if the journal cannot."""
    last = (
        select(_event.stream, func.max(_event.seq).label("seq"))
        .where(is_between(_event.position, Cursor(), cursor))
        .group_by(_event.stream)
        .subquery()
    )
    ends = select(_event.stream, _event.seq, _event.chain).join(
        last, and_(_event.stream == last.c.stream, _event.seq == last.c.seq)
    )
    heads = {row.stream: Head(row.seq, bytes(row.chain)) for row in await journal.query(ends)}
    said = select(_event.position, _event.body).where(
        _event.stream == STREAM, _event.kind == StreamRemoved.kind
    )
    for row in await journal.query(said.order_by(_event.position)):
        removed = msgspec.json.decode(row.body, type=StreamRemoved)
        end = removed.end if cursor.has(row.position) else _then(removed, cursor, read_kept)
        if end.seq > heads.get(removed.stream, NOTHING).seq:
            heads[removed.stream] = end
    return heads


def _then(removed: StreamRemoved, cursor: Cursor, read_kept: ReadKept) -> Head:
    """Return the end of a stream as it was at the moment `cursor`, before it was taken out. Raise Conflict
    if it was dropped, with events on both sides of that moment, or in several slots."""
    if removed.kept:
        return _end(read_kept(removed.kept), cursor)
    if slot_of(removed.first) == slot_of(removed.last):
        if cursor.has(removed.last):
            return removed.end
        if not cursor.has(removed.first):
            return NOTHING
    raise Conflict(
        f"{removed.stream}, which went on then, was dropped for its age; only lines from before or "
        "after it can be compared."
    )


def digest_of(branch: Branch, cursor: Cursor, heads: dict[str, Head]) -> str:
    """Return the SHA-256, in hex, over a branch, a moment and the ends of all streams (`heads`). The moment
    of a log of one writer is a number."""
    position = str(cursor) if len(cursor.numbers) > 1 else cursor.end_in(0)
    parts = sorted((stream, head.seq, head.chain) for stream, head in heads.items())
    return hashlib.sha256(msgspec.msgpack.encode((branch, position, parts))).hexdigest()


def _end(events: Iterable[Event], cursor: Cursor) -> Head:
    """Return the end (number and hash) of one stream at the moment `cursor` of the log. `events`:
    all events of the stream, oldest first. Later events are ignored; if there are no others, the
    result is `NOTHING`."""
    head = NOTHING
    for event in events:
        if not cursor.has(event.position):
            break
        head = Head(event.seq, link(head.chain, event))
    return head
