"""Queries of the index of key changes, over a connection. Their results are as large as a graph: for workers."""

from collections.abc import Collection, Iterable, Sequence
from typing import Any, Final

import msgspec
from sqlalchemy import ColumnElement, Connection, Row, Select, and_, func, literal, select

from action_assistant.editor.documents.values import Root
from action_assistant.editor.history.key_changes import (
    LoggedChange,
    OverwrittenValue,
    Place,
    observed,
    owner_of,
)
from action_assistant.editor.log.graph_events import graph_stream
from action_assistant.journal.events import Event
from action_assistant.kit.packing import packed, unpacked
from action_assistant.schema.editor_tables import (
    editor_event,
    key_change,
    key_change_head,
    overwritten_value,
)

_EVENTS: Final = 1000  # observed in one go
_BYTES: Final = 4 << 20  # of them
_OWNERS: Final = 400  # that one question names
_LARGE: Final = (
    64 * 1024
)  # bytes of a document, from which on it is stored packed: storing it blocks the writer

_c = key_change.c
_CHANGE: Final = select(_c.seq, _c.author, _c.at, _c.root, _c.key, _c.before, _c.after)
_o = overwritten_value.c
_OVERWRITTEN: Final = select(*(_o[name] for name in OverwrittenValue._fields))
#: The form of indexes that have overwritten values. One of another form counts as none, and is made anew.
FORM: Final = 1
#: The columns of a row in a slice, in the order of `LoggedChange` after the first two.
COLUMNS: Final = ("graph", "owner", *LoggedChange._fields)
#: The columns of a row in a slice of overwritten values.
OVERWRITTEN_COLUMNS: Final = ("graph", *OverwrittenValue._fields)


class IndexGrowth(msgspec.Struct, frozen=True):
    """The rows that the index lacks, as slices of MessagePack, and the next head: `seq` and
    `document`.

    `slices`: slices of changes; `overwritten`: slices of values that lost against a concurrent
    edit. `after`: the present head. `leftovers`: rows after it exist from an interrupted attempt.
    `unreadable`: the document of the head is of another version, so the index must be built again.
    """

    after: int
    seq: int
    document: bytes
    slices: tuple[bytes, ...] = ()
    overwritten: tuple[bytes, ...] = ()
    damaged: bool = False
    leftovers: bool = False
    unreadable: bool = False


def growth(connection: Connection, graph: str, slice_rows: int) -> IndexGrowth | None:
    """Return the rows that the next events of a graph add to the index of its changes, with
    `slice_rows` rows in each slice. Return None if all events are in the index."""
    seq, kept = _head(connection, graph)
    document = unpacked(kept)
    leftovers = any(
        connection.execute(select(literal(1)).where(c.graph == graph, c.seq > seq).limit(1)).first()
        for c in (_c, _o)
    )
    events = _some_events(connection, graph, seq)
    if not events:
        return None
    found = observed(document, events)
    if found is None:
        return IndexGrowth(seq, 0, b"", leftovers=leftovers, unreadable=True)
    # In the order of the table's indexes: rows in any order touch as many pages as there are rows.
    changes = sorted(found.changes, key=lambda each: (each.seq, each.root, each.key))
    rows = [(graph, owner_of(each.root, each.key), *each) for each in changes]
    lost = [(graph, *each) for each in found.overwritten]
    slices, overwritten = (_slices(each, slice_rows) for each in (rows, lost))
    return IndexGrowth(
        *(seq, found.seq, packed(found.document, least=_LARGE), slices, overwritten),
        damaged=found.damaged,
        leftovers=leftovers,
    )


def between(
    connection: Connection, graph: str, after: int, upto: int, limit: int, by: str | None = None
) -> list[LoggedChange]:
    """Return the newest `limit` changes of a graph with `after < seq <= upto`, oldest first; with
    `by` only changes of the person with this id."""
    chosen = _CHANGE.where(_c.graph == graph, _c.seq > after, _c.seq <= upto)
    if by is not None:
        chosen = chosen.where(_c.author == by)
    newest_first = chosen.order_by(_c.seq.desc(), _c.root, _c.key).limit(limit)
    return _changes(connection, newest_first)[::-1]


def overwritten_between(
    connection: Connection, graph: str, after: int, upto: int, limit: int
) -> list[OverwrittenValue]:
    """Return the newest `limit` values in a graph with `after < seq <= upto` that lost against a
    concurrent edit, in order of time."""
    chosen = _OVERWRITTEN.where(_o.graph == graph, _o.seq > after, _o.seq <= upto)
    newest_first = chosen.order_by(_o.seq.desc(), _o.root, _o.key).limit(limit)
    return [OverwrittenValue._make(row) for row in connection.execute(newest_first)][::-1]


def overwritten_of_key(
    connection: Connection, graph: str, root: Root, key: str, upto: int
) -> list[OverwrittenValue]:
    """Return the values of one key (in the map `root`) of a graph, up to the change `upto`, that
    lost against a concurrent edit, in order of time."""
    same = (_o.graph == graph, _o.root == root, _o.key == key, _o.seq <= upto)
    chosen = _OVERWRITTEN.where(*same).order_by(_o.seq)
    return [OverwrittenValue._make(row) for row in connection.execute(chosen)]


def at(
    connection: Connection, graph: str, seq: int, owners: Collection[str] | None = None
) -> list[LoggedChange]:
    """Return, for each key of a graph that has a value after the change `seq`, the change that gave
    it; only for keys of `owners` (actions, arrows …), None for all."""
    if owners is None:
        return _changes(connection, _last(graph, seq).where(_c.after.is_not(None)))
    return [each for each in latest(connection, graph, seq, owners) if each.after is not None]


def latest(
    connection: Connection, graph: str, seq: int, owners: Collection[str]
) -> list[LoggedChange]:
    """Return the last change of each key of a graph up to the change `seq`, also of keys that no
    longer exist. Only keys of `owners` count; an owner is the thing that a key describes, such as
    an action or a relation (`owner_of`)."""
    wanted = sorted(owners)
    found: list[LoggedChange] = []
    for start in range(0, len(wanted), _OWNERS):
        some = _c.owner.in_(wanted[start : start + _OWNERS])
        found += _changes(connection, _last(graph, seq, some))
    return found


def latest_since(connection: Connection, graph: str, seq: int) -> dict[Place, int]:
    """Return, for each key of a graph that was changed at or after the change `seq`, the number of
    the last change of that key."""
    head, _ = _head(connection, graph)
    newest = select(_c.root, _c.key, func.max(_c.seq).label("seq"))
    chosen = newest.where(_c.graph == graph, _c.seq >= seq, _c.seq <= head)
    rows = connection.execute(chosen.group_by(_c.root, _c.key))
    return {(row.root, row.key): row.seq for row in rows}


def of_key(
    connection: Connection, graph: str, root: Root, key: str, upto: int
) -> list[LoggedChange]:
    """Return all changes of one key (in the map `root`) of a graph up to `upto`, oldest first."""
    same = (_c.graph == graph, _c.root == root, _c.key == key, _c.seq <= upto)
    return _changes(connection, _CHANGE.where(*same).order_by(_c.seq))


def _slices(rows: Sequence[tuple[Any, ...]], most: int) -> tuple[bytes, ...]:
    parts = (rows[start : start + most] for start in range(0, len(rows), most))
    return tuple(map(msgspec.msgpack.encode, parts))


def _head(connection: Connection, graph: str) -> tuple[int, bytes]:
    head = key_change_head.c
    row = connection.execute(
        select(head.seq, head.document).where(head.graph == graph, head.form == FORM)
    ).first()
    return (row.seq, row.document) if row is not None else (0, b"")


def _some_events(connection: Connection, graph: str, after: int) -> list[Event]:
    event = editor_event.c
    chosen = (
        select(*(event[name] for name in Event.__struct_fields__))
        .where(event.stream == graph_stream(graph), event.seq > after)
        .order_by(event.seq)
        .limit(_EVENTS)
    )
    events: list[Event] = []
    size = 0
    for row in connection.execute(chosen):
        events.append(Event(*row))
        size += len(row.body)
        if size > _BYTES:
            break
    return events


def _changes(connection: Connection, chosen: Select[Any]) -> list[LoggedChange]:
    rows: Iterable[Row[Any]] = connection.execute(chosen)
    return [LoggedChange._make(row) for row in rows]


def _last(graph: str, seq: int, *also: ColumnElement[bool]) -> Select[Any]:
    """Return the query for the last change of each key of a graph up to `seq`, with the further
    conditions `also`."""
    newest = (
        select(_c.root, _c.key, func.max(_c.seq).label("seq"))
        .where(_c.graph == graph, _c.seq <= seq, *also)
        .group_by(_c.root, _c.key)
        .subquery()
    )
    same = and_(
        _c.graph == graph,
        _c.root == newest.c.root,
        _c.key == newest.c.key,
        _c.seq == newest.c.seq,
    )
    return _CHANGE.select_from(key_change.join(newest, same))
