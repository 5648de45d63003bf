"""Slots: ranges of positions, one for each writer of a log (decision 173).

A position is `slot * 2**46 + n`; in its slot n counts from 1 without gaps. The only writer of a log
has slot 0, so n is the whole position there. Positions of different slots do not say which event
came first: only the order within a stream counts, and `LogOrder` finds an order of all events that
keeps it.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

import msgspec
from sqlalchemy import (
    Column,
    ColumnElement,
    Connection,
    Select,
    and_,
    false,
    func,
    or_,
    select,
)

#: Writers of one log at the same time, at most: all positions stay below 2**53, so JSON holds them.
SLOTS: Final = 64
_BITS: Final = 46
_MASK: Final = (1 << _BITS) - 1


def slot_of(position: int) -> int:
    """Return the slot of a position; 0 for one that is none."""
    return max(0, position >> _BITS)


def before_first(slot: int) -> int:
    """Return the position before the first event of a slot; 0 for slot 0."""
    return slot << _BITS


def newest_in(position: Column[int], slot: int) -> Select[Any]:
    """Return a query for the newest position in a slot, by the column `position`. If the slot has
    no events, that is `before_first` of it."""
    begin = before_first(slot)
    newest = func.coalesce(func.max(position), begin)
    return select(newest).where(position > begin, position < before_first(slot + 1))


def ends_of_slots(connection: Connection, position: Column[int]) -> list[int]:
    """Return the newest position in each slot that has events, the lowest slot first. The table is
    that of the column `position`."""
    ends: list[int] = []
    end = connection.execute(select(func.max(position))).scalar()
    while end is not None:
        ends.append(end)
        if slot_of(end) == 0:
            break
        lower = select(func.max(position)).where(position <= before_first(slot_of(end)))
        end = connection.execute(lower).scalar()
    return ends[::-1]


class Cursor(msgspec.Struct, frozen=True):
    """A moment of a log: the number of the last event that was seen, for each slot from 0 on. Its
    text is these numbers with dots between, without zeros at the end: `512` or `512.0.7`."""

    numbers: tuple[int, ...] = ()

    @staticmethod
    def at(ends: Sequence[int]) -> "Cursor":
        """Return the moment after events with these positions, the newest of each slot."""
        cursor = Cursor()
        for position in ends:
            cursor = cursor.after(position)
        return cursor

    @staticmethod
    def parse(text: str) -> "Cursor":
        """Read a cursor from its text. Raise ValueError for another text."""
        parts = text.split(".")
        if len(parts) > SLOTS or not all(p.isascii() and p.isdecimal() for p in parts):
            raise ValueError
        numbers = [int(part) for part in parts if len(part) <= len(str(_MASK))]
        if len(numbers) != len(parts) or max(numbers) > _MASK:
            raise ValueError
        return Cursor(_trimmed(numbers))

    def __str__(self) -> str:
        return ".".join(map(str, self.numbers)) or "0"

    @property
    def events(self) -> int:
        """Return the number of events up to this moment, with those that were deleted since."""
        return sum(self.numbers)

    def end_in(self, slot: int) -> int:
        """Return the position up to which the events of a slot were seen."""
        number = self.numbers[slot] if slot < len(self.numbers) else 0
        return before_first(slot) + number

    def has(self, position: int) -> bool:
        """Return whether the event at a position was seen."""
        return position <= self.end_in(slot_of(position))

    def covers(self, other: "Cursor") -> bool:
        """Return whether all that was seen at another moment was seen at this one."""
        return all(self.end_in(slot) >= other.end_in(slot) for slot in range(len(other.numbers)))

    def after(self, position: int) -> "Cursor":
        """Return the moment after the event at a position, if that comes later in its slot."""
        if self.has(position):
            return self
        slot = slot_of(position)
        numbers = [*self.numbers, *[0] * (slot + 1 - len(self.numbers))]
        numbers[slot] = position & _MASK
        return Cursor(_trimmed(numbers))


def is_later(position: Column[int], cursor: Cursor) -> ColumnElement[bool]:
    """Return the condition that an event (by the column `position`) comes after a moment."""
    last = max(0, len(cursor.numbers) - 1)
    between = [
        and_(position > cursor.end_in(slot), position <= before_first(slot + 1))
        for slot in range(last)
    ]
    return or_(*between, position > cursor.end_in(last))


def slot_in(position: Column[int]) -> ColumnElement[int]:
    """Return the slot of an event in a query, by the column `position`."""
    return position // (1 << _BITS)


def cursor_of(connection: Connection, position: Column[int]) -> Cursor:
    """Return the present moment of a log, by the column `position` of its events."""
    return Cursor.at(ends_of_slots(connection, position))


def order_in_time(
    connection: Connection, position: Column[int], at: Column[int], seq: Column[int]
) -> tuple[Column[int], ...]:
    """Return the columns by which events of several streams are sorted, the oldest first: the
    position in a log of one writer; else the time by the clocks of its writers, then `seq`."""
    newest = connection.execute(select(func.max(position))).scalar() or 0
    return (position,) if slot_of(newest) == 0 else (at, seq, position)


def is_between(position: Column[int], seen: Cursor, now: Cursor) -> ColumnElement[bool]:
    """Return the condition for events after the moment `seen` up to the moment `now`."""
    slots = range(len(now.numbers))
    ranges = [(seen.end_in(slot), now.end_in(slot)) for slot in slots]
    parts = [and_(position > low, position <= high) for low, high in ranges if low < high]
    return or_(false(), *parts)


def _trimmed(numbers: list[int]) -> tuple[int, ...]:
    while numbers and not numbers[-1]:
        numbers.pop()
    return tuple(numbers)


class LogOrder:
    """Puts the stored events of several slots into one order that keeps the order of each slot and
    each stream. An event that removes a stream comes after the remaining events of that stream.
    Where that leaves a choice, the older event comes first. If events are missing there is no such
    order; all are returned nevertheless.

    `removed`: returns which stream an event removes from the log, and its last seq; None for other
    events. `seen`: the last seq of each stream before the first rows, 0 where it is missing. Rows
    have the columns of an event in its order, and may have more.
    """

    def __init__(
        self,
        slots: Iterable[int],
        removed: Callable[[Sequence[Any]], tuple[str, int] | None] = lambda _: None,
        *,
        seen: Mapping[str, int] | None = None,
    ) -> None:
        self._waiting: dict[int, deque[Sequence[Any]]] = {slot: deque() for slot in slots}
        self._seen: dict[str, int] = dict(seen or {})
        self._removed = removed

    @property
    def has_ended(self) -> bool:
        """Return whether every row was taken."""
        return not self._waiting

    @property
    def needed(self) -> int | None:
        """Return a slot whose next rows have to be added before more can be taken; None if there is
        none."""
        return next((slot for slot, rows in self._waiting.items() if not rows), None)

    def add(self, slot: int, rows: Sequence[Sequence[Any]]) -> None:
        """Add the next rows of a slot, in the order of their positions; no rows at its end."""
        if rows:
            self._waiting[slot].extend(rows)
        else:
            del self._waiting[slot]

    def take(self) -> Iterator[Sequence[Any]]:
        """Yield the next rows, until rows of a slot are needed or all slots have ended."""
        while self._waiting and self.needed is None:
            if len(self._waiting) == 1:  # nothing to choose
                for rows in self._waiting.values():
                    yield from rows
                    rows.clear()
                return
            slot = min(self._waiting, key=self._rank)
            row = self._waiting[slot].popleft()
            self._seen[row[0]] = row[1]
            if (removed := self._removed(row)) is not None:
                self._seen[removed[0]] = removed[1]
            yield row

    def _rank(self, slot: int) -> tuple[int, int, int]:
        stream, seq, _, _, at = self._waiting[slot][0][:5]
        if seq != self._seen.get(stream, 0) + 1:
            return 2, at, slot
        return int(self._removed(self._waiting[slot][0]) is not None), at, slot


def pages_in_order(
    connection: Connection,
    chosen: Select[Any],
    position: Column[int],
    limit: int,
    removed: Callable[[Sequence[Any]], tuple[str, int] | None],
) -> Iterator[list[Any]]:
    """Yield the rows of all slots in the order of `LogOrder`, page by page. `chosen`: the query for
    all events, with the columns of an event in its order; `position`: their column of that name;
    `limit`: how many rows of a slot are read at once; `removed`: as for `LogOrder`."""
    ends = {slot_of(end): end for end in ends_of_slots(connection, position)}
    after = {slot: before_first(slot) for slot in ends}
    order = LogOrder(list(ends), removed)
    while (slot := order.needed) is not None:
        some = chosen.where(position > after[slot], position <= ends[slot])
        rows = connection.execute(some.order_by(position).limit(limit)).all()
        order.add(slot, rows)
        if rows:
            after[slot] = rows[-1].position
        if page := list(order.take()):
            yield page
