"""The events of a stream as they were written, up to the first that is not."""

import logging
from collections.abc import Sequence
from typing import Any, Final

from sqlalchemy import Select, select

from action_assistant.editor.crdt.folding import StreamDamage
from action_assistant.errors import Unavailable
from action_assistant.journal.chain import START, link
from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal
from action_assistant.schema import editor_tables

log: Final = logging.getLogger(__name__)

SLICE: Final = 500  # events that are read at once
_COLUMNS: Final = (*Event.__struct_fields__, "chain")
_TYPES: Final = (str, int, str, str, int, bytes, int, bytes)


class LogTail:
    """Reads on from `after`. At the end `damaged` says whether that was the end of the stream."""

    def __init__(self, journal: Journal, stream: str, after: int, upto: int | None) -> None:
        self.seq = after
        self.damaged: StreamDamage | None = None
        self._journal = journal
        self._stream = stream
        self._upto = upto
        self._chain = START if after == 0 else None

    async def next(self) -> list[Event]:
        """The next sound events; none when there are no more. Raises Unavailable."""
        if self.damaged is not None:
            return []
        rows = await self._rows()
        events: list[Event] = []
        for row in rows:
            why = self._fault(row)
            if why is not None:
                self._stop(why)
                break
            self.seq, self._chain = row[1], row[7]
            events.append(Event(*row[:7]))
        if not rows and self.damaged is None:
            await self._check_end()
        return events

    async def _rows(self) -> Sequence[Sequence[Any]]:
        if self._chain is None:
            (before,) = await self._ask(self.seq - 1, 1)
            self._chain = before[7] if isinstance(before[7], bytes) else START
        try:
            return await self._ask(self.seq, SLICE)
        except Unavailable:
            return await self._one_by_one()

    async def _one_by_one(self) -> Sequence[Sequence[Any]]:
        """A row that the database cannot even give out: those before it. Raises Unavailable when
        that may be for another reason."""
        if self.seq:
            await self._ask(self.seq - 1, 1)
        found: list[Sequence[Any]] = []
        try:
            while rows := await self._ask(self.seq + len(found), 1):
                found += rows
                if len(found) == SLICE:
                    break
        except Unavailable as error:
            if not found:
                if await self._journal.health() is not None:
                    raise
                self._stop(error.detail)
        return found

    async def _ask(self, after: int, limit: int) -> Sequence[Sequence[Any]]:
        chosen = _rows_of(self._stream).where(editor_tables.editor_event.c.seq > after)
        if self._upto is not None:
            chosen = chosen.where(editor_tables.editor_event.c.seq <= self._upto)
        return await self._journal.query(chosen.limit(limit))

    def _fault(self, row: Sequence[Any]) -> str | None:
        if tuple(map(type, row)) != _TYPES:
            return "it holds values of the wrong kind"
        if row[1] != self.seq + 1:
            return f"{row[1]} stands in its place"
        if row[7] != link(self._chain or START, Event(*row[:7])):
            return "it is not what was written"
        return None

    async def _check_end(self) -> None:
        newest = await self._journal.newest(self._stream)
        if self._upto is None and newest > self.seq:
            # Not what was added since we looked: that comes with the next look.
            if await self._ask(self.seq, 1):
                return
            self._stop("it is missing")

    def _stop(self, why: str) -> None:
        self.damaged = StreamDamage(self.seq + 1, why)
        log.error("%s %d is damaged: %s", self._stream, self.seq + 1, why)


def _rows_of(stream: str) -> Select[Any]:
    columns = editor_tables.editor_event.c
    chosen = select(*(columns[name] for name in _COLUMNS))
    return chosen.where(columns.stream == stream).order_by(columns.seq)
