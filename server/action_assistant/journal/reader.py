"""Reading a journal: events by stream or in order, the tables, what was cached."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypeVar, cast
from urllib.parse import quote

from sqlalchemy import (
    BindParameter,
    Connection,
    CursorResult,
    NullPool,
    Row,
    Select,
    bindparam,
    case,
    create_engine,
    func,
    select,
)
from sqlalchemy.exc import DatabaseError

from action_assistant.errors import Unavailable
from action_assistant.journal.chain import NOTHING, Head
from action_assistant.journal.database import cause_of
from action_assistant.journal.events import BareEvent, Event, StreamSnapshot
from action_assistant.journal.slots import Cursor, LogOrder, cursor_of
from action_assistant.schema.editor_tables import editor_event, editor_head, editor_snapshot

T = TypeVar("T")

_PAGE: Final = 500  # events that are read at once

# The tables of the log are the same for both branches.
_event, _head, _snapshot = editor_event.c, editor_head.c, editor_snapshot.c
#: A query for all stored events.
EVENTS: Final = select(*(_event[name] for name in Event.__struct_fields__))
_STREAM: Final[BindParameter[str]] = bindparam("stream")
_NEWEST: Final = select(_head.seq).where(_head.stream == _STREAM)
_BODY: Final = select(_event.body).where(_event.stream == _STREAM, _event.seq == bindparam("seq"))
_USUAL: Final[BindParameter[str]] = bindparam("usual")
_BARE: Final = (
    select(
        _event.body,
        func.nullif(_event.kind, _USUAL),
        case((_event.kind != _USUAL, _event.at)),
    )
    .where(
        _event.stream == _STREAM, _event.seq > bindparam("after"), _event.seq <= bindparam("upto")
    )
    .order_by(_event.seq)
)
_KEPT: Final = select(_snapshot.seq, _snapshot.proof, _snapshot.state).where(
    _snapshot.stream == _STREAM
)


class JournalReader:
    """Reads events from a database. Subclasses decide, by `_ask`, how a question reaches it."""

    async def _ask(self, question: Callable[[Connection], T]) -> T:
        """Call `question` with a connection, and return its result; subclasses define this. Raise
        Unavailable if the database cannot be read."""
        raise NotImplementedError

    async def read(
        self, stream: str, *, after: int = 0, upto: int | None = None, limit: int | None = None
    ) -> list[Event]:
        """Return the events of a stream with `after < seq <= upto`, in order. `limit`: at most so
        many, the oldest ones."""
        chosen = EVENTS.where(_event.stream == stream, _event.seq > after)
        if upto is not None:
            chosen = chosen.where(_event.seq <= upto)
        return await self._events(chosen.order_by(_event.seq).limit(limit))

    async def bare(self, stream: str, usual: str, *, after: int, upto: int) -> list[BareEvent]:
        """Return the events of a stream with `after < seq <= upto`, in order, as (body, kind, at).
        Kind and time are None for events of the kind `usual`. The list is shorter than `upto -
        after` if events are missing."""
        place = {"stream": stream, "usual": usual, "after": after, "upto": upto}
        return cast("list[BareEvent]", await self.plain_rows(_BARE, place))

    async def read_all(self, *, after: int = 0, limit: int = _PAGE) -> list[Event]:
        """Return the first `limit` events of all streams with `position > after`, in order of their
        positions."""
        return await self._events(following(after, limit))

    async def read_since(self, moment: Cursor, limit: int = _PAGE) -> list[Event]:
        """Return up to about `limit` events of all streams after a moment; each stream is in its order. An
        empty list: there are no others."""
        return await self._ask(lambda connection: _read_since(connection, moment, limit))

    async def cursor(self) -> Cursor:
        """Return the present moment of the log."""
        return await self._ask(lambda connection: cursor_of(connection, _event.position))

    async def newest(self, stream: str) -> int:
        """Return the sequence number of the last event of a stream; 0 if the stream is empty."""
        return await self._number(_NEWEST, {"stream": stream})

    async def position(self) -> int:
        """Return the position of the newest event of all streams; 0 if there are no events."""
        return await self._number(select(func.max(_event.position)))

    async def query(
        self, statement: Select[Any], values: Mapping[str, Any] | None = None
    ) -> list[Row[Any]]:
        """Return the rows of a query. `values`: for the parameters of a prepared statement, since
        building one takes longer than running it."""
        return await self._ask(lambda connection: list(connection.execute(statement, values).all()))

    async def plain_rows(
        self, statement: Select[Any], values: Mapping[str, Any] | None = None
    ) -> list[Sequence[Any]]:
        """Return the rows of a query as the driver returns them, which is quicker for many rows.
        `values`: for the parameters of a prepared statement."""
        return await self._ask(lambda connection: _plain(connection.execute(statement, values)))

    async def snapshot(self, stream: str) -> StreamSnapshot | None:
        """Return the cached state of a stream. Return None if none is stored, or if its seal does
        not match the event after which it was made."""

        def find(connection: Connection) -> StreamSnapshot | None:
            row = connection.execute(_KEPT, {"stream": stream}).first()
            if row is None:
                return None
            seal = seal_of(body_of(connection, stream, row.seq), row.state)
            return StreamSnapshot(stream, row.seq, row.state) if seal == row.proof else None

        return await self._ask(find)

    async def end(self, stream: str) -> Head:
        """Return the sequence number of the last event of a stream, and its chain value; NOTHING if
        the stream is empty."""
        chosen = select(_head.seq, _head.chain).where(_head.stream == stream)
        row = await self._ask(lambda connection: connection.execute(chosen).first())
        return Head(*row) if row is not None else NOTHING

    async def _events(self, chosen: Select[Any]) -> list[Event]:
        return await self._ask(lambda c: [Event(*row) for row in _plain(c.execute(chosen))])

    async def _number(self, chosen: Select[Any], values: Mapping[str, Any] | None = None) -> int:
        found: int | None = await self._ask(lambda c: c.execute(chosen, values).scalar())
        return found or 0


class FileJournalReader(JournalReader):
    """Reads the SQLite file of a journal that another process writes; waits for each answer. Never
    changes it, nor holds up its writer."""

    def __init__(self, path: Path) -> None:
        self._engine = create_engine(
            f"sqlite:///file:{quote(str(path))}?mode=ro&uri=true",
            poolclass=NullPool,  # nothing of ours stays open between two questions
            isolation_level="AUTOCOMMIT",
        )

    async def _ask(self, question: Callable[[Connection], T]) -> T:
        try:
            with self._engine.connect() as connection:
                return question(connection)
        except DatabaseError as error:
            raise Unavailable(f"The journal cannot be read: {cause_of(error)}.") from error


def _plain(result: CursorResult[Any]) -> list[Sequence[Any]]:
    assert result.cursor is not None
    rows = list(result.cursor.fetchall())
    result.close()
    return rows


def following(position: int, limit: int) -> Select[Any]:
    """Return a query for the first `limit` events of all streams after a position, in order."""
    return EVENTS.where(_event.position > position).order_by(_event.position).limit(limit)


def _read_since(connection: Connection, seen: Cursor, limit: int) -> list[Event]:
    now = cursor_of(connection, _event.position)
    pages: dict[int, list[Sequence[Any]]] = {}
    for slot in range(len(now.numbers)):
        low, high = seen.end_in(slot), now.end_in(slot)
        if low < high:
            chosen = following(low, limit).where(_event.position <= high)
            pages[slot] = _plain(connection.execute(chosen))
    rows = next(iter(pages.values()), []) if len(pages) < 2 else _ordered(pages, limit)
    return [Event(*row) for row in rows]


def _ordered(pages: Mapping[int, Sequence[Sequence[Any]]], limit: int) -> list[Sequence[Any]]:
    """Return events of several slots (`pages`: their columns) in an order that keeps each stream's, up to
    where the first page of `limit` events ends: its slot may go on."""
    before: dict[str, int] = {}
    for page in pages.values():
        for stream, seq, *_ in page:
            before[stream] = min(seq - 1, before.get(stream, seq))
    order = LogOrder(pages, seen=before)
    for slot, page in pages.items():
        order.add(slot, page)
    found: list[Sequence[Any]] = []
    while not order.has_ended:
        found += order.take()
        if (ended := order.needed) is not None:
            if len(pages[ended]) >= limit:
                break
            order.add(ended, [])
    return found


def body_of(connection: Connection, stream: str, seq: int) -> bytes:
    """Return the body of the event `seq` of a stream; empty bytes if there is no such event."""
    return connection.execute(_BODY, {"stream": stream, "seq": seq}).scalar() or b""


def seal_of(event: bytes, state: bytes) -> bytes:
    """Return a digest that ties a snapshot to its own bytes (`state`) and to the body of the event
    after which it was made (`event`)."""
    return hashlib.sha256(hashlib.sha256(event).digest() + state).digest()
