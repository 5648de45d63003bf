"""The events of inboxes, and the marks of edits in which persons may be mentioned.

Each person has a stream `inbox/PERSON`. Mentions stand in the comments of documents, which are Yjs
updates: an edit that may hold one is marked here, in its transaction, and read later by a worker.
"""

from collections.abc import Sequence
from typing import Any, Final

import msgspec
from sqlalchemy import Executable, delete, insert

from action_assistant.journal.events import Event
from action_assistant.schema.editor_tables import mention_due, mention_read

READ: Final = "inbox.read.v1"
#: Stands in the text of each comment with mentions, and so in the update that brings it.
MARK: Final = b'"mentions"'


class InboxRead(msgspec.Struct, frozen=True):
    """The author of the event has read the mentions with these keys."""

    keys: tuple[str, ...]


def inbox_stream(person: str) -> str:
    """Return the name of the stream with the inbox of the person with the id `person`."""
    return f"inbox/{person}"


def due(event: Event) -> Sequence[Executable]:
    """Return the statement that marks an edit of a graph, in which persons may be mentioned."""
    graph = event.stream.partition("/")[2]
    return [insert(mention_due).values(graph=graph, seq=event.seq, at=event.at)]


def read(event: Event) -> Sequence[Executable]:
    """Return the SQL statements that store which mentions the author of the event has read."""
    keys = set(msgspec.json.decode(event.body, type=InboxRead).keys)
    c = mention_read.c
    mine = delete(mention_read).where(c.person == event.author, c.key.in_(keys))
    rows: list[dict[str, Any]] = [{"person": event.author, "key": each} for each in sorted(keys)]
    return [mine, insert(mention_read).values(rows)] if rows else []
