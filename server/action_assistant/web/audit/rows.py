"""Pages of the audit: rows that are read from the log of one process, the newest first. In facts `at` is
microseconds UTC.
"""

import heapq
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from typing import Annotated, Any, Final, Literal, TypeAlias, get_args

import msgspec
from sqlalchemy import ColumnElement, Connection, Select, and_, func, select

from action_assistant.journal.database import Branch
from action_assistant.journal.events import Event
from action_assistant.journal.slots import before_first, ends_of_slots, slot_of
from action_assistant.kit.moments import moment
from action_assistant.schema.editor_tables import editor_event
from action_assistant.web.audit.events import KEEPING, AuditDropped
from action_assistant.web.auth.caller import Origin, origin_in
from action_assistant.web.auth.keys import PersonRef

#: The kinds of rows, by which they are filtered.
AuditKind: TypeAlias = Literal[
    "edits",  # changes of documents: graphs and actions of the library
    "graphs",  # made, renamed, deleted, published, drafts, proposals
    "starts",  # and pause, resume, change, go on, words of people about runs
    "refused",  # starts that were refused
    "stops",
    "robots",  # registrations, rights, batons, words about engines
    "sessions",  # sign-ins, ended sessions
    "people",  # links, persons, groups, tokens, names
    "strangers",  # refused requests without valid credentials
    "other",
]
AUDIT_KINDS: Final = get_args(AuditKind)

_SLICE: Final = 2_000  # positions that are looked at in one query
_MOST: Final = 50_000  # positions for one page; then the reader asks on
_DAY_US: Final = 24 * 3600 * 1_000_000  # by which the clock may have gone back
_event: Final = editor_event.c
_EVENTS: Final = select(*(_event[name] for name in Event.__struct_fields__))


class AuditFilter(msgspec.Struct, frozen=True, kw_only=True):
    """The rows that are asked for. `before`: the cursor of an earlier page: only events of the log before
    this position, or where several editors have written before this time (µs UTC). `since`,
    `until`: microseconds UTC. `text`: a part of the row in any case."""

    before: int | None = None
    limit: Annotated[int, msgspec.Meta(ge=1, le=1000)] = 100
    person: str = ""
    robot: str = ""
    graph: str = ""
    kinds: tuple[AuditKind, ...] = ()
    since: int | None = None
    until: int | None = None
    text: str = ""


class Fact(msgspec.Struct, frozen=True, kw_only=True):
    """An event in words. `text` follows the name of the person. `seq`: the moment of the graph.
    `person`: the name that the event itself gives its author; `origin`: where an older event has it."""

    kind: AuditKind
    text: str
    graph: str = ""
    graph_name: str = ""
    seq: int | None = None
    run: str = ""
    run_number: int | None = None
    robots: tuple[str, ...] = ()
    person: PersonRef | None = None
    origin: Origin | None = None
    at: int | None = None  # where it differs from the time of the event
    is_of_program: bool = False  # this program did it by itself
    times: int = 1  # how often, where repetitions have one event


class AuditRow(
    msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True, rename={"origin": "from"}
):
    """One fact of the audit. `id`: `editor` or `runner`, and the position in its log. `person`: none
    for strangers. `from`: the connection of the person; none where it was not recorded. `times`: how
    often it happened, where repetitions have one row."""

    id: str
    position: int
    at: datetime
    kind: AuditKind
    event: str
    text: str
    person: PersonRef | None = None
    origin: Origin | None = None
    graph: str = ""
    graph_name: str = ""
    seq: int | None = None
    run: str = ""
    run_number: int | None = None
    robots: tuple[str, ...] = ()
    times: int = 1


class DroppedRows(msgspec.Struct, frozen=True):
    """Rows up to `until` that only the audit had were dropped `at` this time, since they were older
    than `days`."""

    until: datetime
    at: datetime
    days: float


class AuditPage(msgspec.Struct, frozen=True):
    """Rows, the newest first. `before`: the cursor of the next page; null once the begin of the log is
    reached. A page may be empty and have a cursor, since one answer looks at a part of the log.
    `back_to`: the time of the oldest event that was looked at; `dropped`: the newest rows that were
    dropped because of their age; null if none were."""

    rows: tuple[AuditRow, ...]
    before: int | None
    back_to: datetime | None
    dropped: DroppedRows | None = None


#: Says an event in words; None for events that are no facts about people.
Describe: TypeAlias = Callable[[Event], Fact | None]


def audit_page(
    connection: Connection,
    branch: Branch,
    wanted: AuditFilter,
    describe: Describe,
    never: Collection[str],
) -> AuditPage:
    """Return a page of the audit of one log (`branch`): the rows for which `wanted` asks.
    `describe`: returns an event in words; `never`: kinds of events that are no facts about people,
    most of a log."""
    dropped = drops(connection)
    ends = {each.stream: each.seq for _, each in dropped}
    page = _page(connection, branch, wanted, describe, never, ends)
    return msgspec.structs.replace(page, dropped=_newest(dropped))


def _page(
    connection: Connection,
    branch: Branch,
    wanted: AuditFilter,
    describe: Describe,
    never: Collection[str],
    gone: Mapping[str, int],
) -> AuditPage:
    """Return a page. `gone`: streams that were dropped, each with its end then; events up to that may
    be in the log for some moments more."""
    end: int = connection.execute(select(func.max(_event.position))).scalar() or 0
    if slot_of(end) > 0:
        return _page_by_time(connection, branch, wanted, describe, never, gone)
    cursor = end + 1 if wanted.before is None else min(wanted.before, end + 1)
    last = max(1, cursor - _MOST)
    rows: list[AuditRow] = []
    back_to: int | None = None
    while cursor > last and len(rows) < wanted.limit:
        low = max(last, cursor - _SLICE)
        for event in _events(connection, wanted, never, low, cursor):
            cursor = event.position
            if event.seq <= gone.get(event.stream, 0):
                continue
            row = _row(branch, event, wanted, describe)
            if row is not None:
                rows.append(row)
                back_to = event.at
                if len(rows) == wanted.limit:
                    break
        else:
            cursor = low
            newest, oldest = _times(connection, low)
            back_to = oldest if oldest is not None else back_to
            if wanted.since is not None and newest is not None and newest < wanted.since - _DAY_US:
                return AuditPage(tuple(rows), None, _when(back_to))
    return AuditPage(tuple(rows), cursor if cursor > 1 else None, _when(back_to))


def _page_by_time(
    connection: Connection,
    branch: Branch,
    wanted: AuditFilter,
    describe: Describe,
    never: Collection[str],
    gone: Mapping[str, int],
) -> AuditPage:
    """Return a page of a log of several writers, by the times of its events; the cursor is a time, too. All
    rows of one time are on one page."""
    until = wanted.before if wanted.before is not None else 1 << 62
    is_wanted = _is_wanted(wanted, never)
    merged = heapq.merge(
        *(
            _slot_by_time(connection, end, until, is_wanted)
            for end in ends_of_slots(connection, _event.position)
        ),
        key=lambda found: -found[0].at,
    )
    rows: list[AuditRow] = []
    back_to: int | None = None
    for looked, (event, may_count) in enumerate(merged):
        if event.at != back_to and (len(rows) >= wanted.limit or looked >= _MOST):
            return AuditPage(tuple(rows), back_to, _when(back_to))
        back_to = event.at
        if wanted.since is not None and event.at < wanted.since - _DAY_US:
            break
        if not may_count or event.seq <= gone.get(event.stream, 0):
            continue
        row = _row(branch, event, wanted, describe)
        if row is not None:
            rows.append(row)
    return AuditPage(tuple(rows), None, _when(back_to))


def _slot_by_time(
    connection: Connection, end: int, until: int, is_wanted: ColumnElement[bool]
) -> Iterator[tuple[Event, bool]]:
    """Yield the events of a slot from before the time `until`, the newest first, each with the value of
    `is_wanted`. `end`: the last position of the slot. The clock of its writer may have gone back by a
    day."""
    begin = before_first(slot_of(end))
    low, high = begin, end
    while low < high:  # the last event that is not surely later
        middle = (low + high + 1) // 2
        there = select(_event.at).where(_event.position >= middle, _event.position <= end)
        at = connection.execute(there.order_by(_event.position).limit(1)).scalar()
        if at is not None and at >= until + _DAY_US:
            high = middle - 1
        else:
            low = middle
    chosen = _EVENTS.add_columns(is_wanted).where(_event.position > begin)
    chosen = chosen.order_by(_event.position.desc())
    while page := connection.execute(chosen.where(_event.position <= high).limit(_SLICE)).all():
        for row in page:
            if row.at < until:
                yield Event(*row[:-1]), bool(row[-1])
        high = page[-1].position - 1


def _events(
    connection: Connection, wanted: AuditFilter, never: Collection[str], low: int, high: int
) -> Iterator[Event]:
    chosen: Select[Any] = _EVENTS.where(
        _event.position >= low, _event.position < high, _is_wanted(wanted, never)
    )
    for row in connection.execute(chosen.order_by(_event.position.desc())):
        yield Event(*row)


def _is_wanted(wanted: AuditFilter, never: Collection[str]) -> ColumnElement[bool]:
    """Return the condition for events that may be rows, by what the log knows of them."""
    parts: list[ColumnElement[bool]] = [_event.kind.not_in(never)]
    if wanted.person:
        parts.append(_event.author == wanted.person)
    if wanted.since is not None:
        parts.append(_event.at >= wanted.since)
    if wanted.until is not None:
        parts.append(_event.at < wanted.until)
    return and_(*parts)


def drops(connection: Connection) -> list[tuple[int, AuditDropped]]:
    """Return what was dropped, oldest first, each with its time (µs UTC)."""
    chosen = select(_event.at, _event.body).where(
        _event.stream == KEEPING, _event.kind == AuditDropped.kind
    )
    rows = connection.execute(chosen.order_by(_event.seq)).all()
    return [(row.at, msgspec.json.decode(row.body, type=AuditDropped)) for row in rows]


def _newest(found: Sequence[tuple[int, AuditDropped]]) -> DroppedRows | None:
    if not found:
        return None
    at, dropped = max(found, key=lambda each: each[1].until)
    return DroppedRows(moment(dropped.until), moment(at), dropped.days)


def _times(connection: Connection, position: int) -> tuple[int | None, int | None]:
    """Return the time of the newest of the events up to a position of the log, and the time of the
    event there (µs UTC); None if there is none."""
    chosen = select(_event.at).where(_event.position <= position)
    times = list(connection.scalars(chosen.order_by(_event.position.desc()).limit(_SLICE)))
    return (max(times), times[0]) if times else (None, None)


def _row(branch: Branch, event: Event, wanted: AuditFilter, describe: Describe) -> AuditRow | None:
    origin = origin_in(event.body)
    fact = _described(event, describe, origin)
    if fact is None or (wanted.kinds and fact.kind not in wanted.kinds):
        return None
    if wanted.robot and wanted.robot not in fact.robots:
        return None
    if wanted.graph and wanted.graph not in {fact.graph, fact.graph_name}:
        return None
    # Who has only signed in has no stored name yet: the connection has the one that they gave.
    named = fact.person if fact.person is not None and fact.person.name else None
    person = None if fact.is_of_program else named or _person(event, origin)
    found = AuditRow(
        id=f"{branch}:{event.position}",
        position=event.position,
        at=moment(event.at if fact.at is None else fact.at),
        kind=fact.kind,
        event=event.kind,
        text=fact.text,
        person=person,
        origin=origin or fact.origin,
        graph=fact.graph,
        graph_name=fact.graph_name,
        seq=fact.seq,
        run=fact.run,
        run_number=fact.run_number,
        robots=fact.robots,
        times=fact.times,
    )
    return found if not wanted.text or _holds(found, wanted.text) else None


def _described(event: Event, describe: Describe, origin: Origin | None) -> Fact | None:
    """Return an event in words, by `describe`; None for an event that is no fact about people. An
    event of an unknown kind that has the origin of a person is shown by its kind, so that no newer
    kind is left out."""
    try:
        fact = describe(event)
    except (ValueError, TypeError, KeyError, RecursionError):
        return Fact(kind="other", text=f"{event.kind} (it cannot be read)")
    if fact is None and origin is not None:
        return Fact(kind="other", text=event.kind)
    return fact


def _person(event: Event, origin: Origin | None) -> PersonRef | None:
    if not event.author:
        return None
    return PersonRef(event.author, origin.name if origin is not None else "")


def _holds(row: AuditRow, text: str) -> bool:
    """Return whether a row has each word of a text somewhere, in any case."""
    parts = [row.text, row.event, row.graph_name, row.run, *row.robots]
    if row.person is not None:
        parts += [row.person.name, row.person.id]
    if row.origin is not None:
        parts += [row.origin.address, row.origin.session, row.origin.token]
    whole = "\n".join(parts).casefold()
    return all(word in whole for word in text.casefold().split())


def _when(at: int | None) -> datetime | None:
    return None if at is None else moment(at)


def kinds_of(names: Iterable[str]) -> tuple[AuditKind, ...]:
    """Return the kinds of the audit with these names, in their order. Raise ValueError for an
    unknown name."""
    by_name = {kind: kind for kind in AUDIT_KINDS}
    asked = tuple(names)
    for name in asked:
        if name not in by_name:
            raise ValueError(
                f"{name!r} is no kind of the audit; there are {', '.join(AUDIT_KINDS)}"
            )
    return tuple(by_name[name] for name in asked)
