"""A quick look at the newest events of a journal: whether each is what was written."""

import time
from collections.abc import Sequence
from typing import Any, Final

from sqlalchemy import Connection, func, inspect, select, text

from action_assistant.journal.chain import NOTHING, Head, link
from action_assistant.journal.database import Database
from action_assistant.journal.events import Event
from action_assistant.schema.editor_tables import editor_event, editor_head, graph

_EVENTS: Final = 2000
_SECONDS: Final = 1.5
_TYPES: Final = (str, int, str, str, int, bytes, int, bytes)
_event, _head = editor_event.c, editor_head.c  # both databases have these tables


def newest_at(connection: Connection) -> int | None:
    """When the last events were written, in microseconds since 1970; None when there are none."""
    newest = select(_event.at).order_by(_event.position.desc()).limit(50)
    return max((row.at for row in connection.execute(newest) if type(row.at) is int), default=None)


def oldest_at(connection: Connection) -> int | None:
    """When the first event was written, in microseconds since 1970; None when there is none."""
    oldest = select(_event.at).order_by(_event.position).limit(1)
    return connection.execute(oldest).scalar()


def has_events(connection: Connection) -> bool:
    """Whether there is any."""
    if not inspect(connection).has_table(editor_event.name):
        return False
    return connection.execute(select(_event.position).limit(1)).first() is not None


def first_damage(database: Database, connection: Connection) -> str:
    """What is wrong with one of the newest events, in a clause; empty where nothing is. Looks at some
    thousand, for a second or two at most."""
    until = time.monotonic() + _SECONDS
    heads: dict[str, Head] = {}
    after = _last(connection) - _EVENTS
    while time.monotonic() < until:
        rows, further = database.scan(connection, after)
        for row in rows:
            if wrong := _wrong(connection, heads, row):
                return wrong
        if not rows or further == after:
            return _wrong_ends(connection, heads)
        after = further
    return ""


def _last(connection: Connection) -> int:
    """Where `scan` ends: it goes by rows in a file, by positions on a server."""
    if connection.dialect.name == "sqlite":
        return connection.execute(text("SELECT max(rowid) FROM event NOT INDEXED")).scalar() or 0
    return connection.execute(select(func.max(_event.position))).scalar() or 0


def _wrong(connection: Connection, heads: dict[str, Head], row: Sequence[Any]) -> str:
    """What is wrong with an event, given those before it."""
    stream, seq = row[0], row[1]
    if tuple(map(type, row)) != _TYPES:
        return f"one of {stream!r} holds values of the wrong kind"
    before = heads.get(stream) or _before(connection, stream, seq)
    heads[stream] = Head(seq, row[7])
    if before is None:
        return ""
    if seq != before.seq + 1:
        return f"of {stream}, {seq} stands in the place of {before.seq + 1}"
    if row[7] != link(before.chain, Event(*row[:7])):
        return f"event {seq} of {stream} was altered"
    return ""


def _before(connection: Connection, stream: str, seq: int) -> Head | None:
    """The chain before an event; None where that event is not here (any more)."""
    if seq == 1:
        return NOTHING
    chosen = select(_event.chain).where(_event.stream == stream, _event.seq == seq - 1)
    chain = connection.execute(chosen).scalar()
    return None if chain is None else Head(seq - 1, bytes(chain))


def _wrong_ends(connection: Connection, heads: dict[str, Head]) -> str:
    """Whether streams end where the database says that they end."""
    names = list(heads)[:500]
    chosen = select(_head.stream, _head.seq, _head.chain).where(_head.stream.in_(names))
    for row in connection.execute(chosen):
        if Head(row.seq, bytes(row.chain)) != heads[row.stream]:
            return f"{row.stream} is written down to end at {row.seq}, and ends at {heads[row.stream].seq}"
    return _cut_off(connection)


def _cut_off(connection: Connection) -> str:
    """A stream of graphs whose last event is not there. Those of runs may be in archives."""
    if not inspect(connection).has_table(graph.name):
        return ""
    last = select(_event.seq).where(_event.stream == _head.stream, _event.seq == _head.seq)
    found = connection.execute(
        select(_head.stream, _head.seq).where(~last.exists()).limit(1)
    ).first()
    return (
        f"{found.stream} is written down to end at {found.seq}, which is missing" if found else ""
    )
