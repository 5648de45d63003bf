"""Finds the author and the time of the current value of each field."""

from collections.abc import Iterable, Sequence, Set
from datetime import datetime
from itertools import zip_longest
from typing import Any, Final

import msgspec
from sqlalchemy import Connection

from action_assistant.editor.documents.values import Root
from action_assistant.editor.history import index_queries
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.key_changes import (
    LoggedChange,
    OverwrittenValue,
    field_of,
    unpacked,
)
from action_assistant.editor.history.merge_origins import (
    MergedBy,
    bring_up,
    grafts_of,
    merged_by,
    originals,
)
from action_assistant.editor.log.graph_events import when
from action_assistant.editor.people.people import stored_people
from action_assistant.errors import NotFound
from action_assistant.web.auth.keys import PersonRef

_ONE_GO: Final = (
    5 * 60 * 1_000_000
)  # microseconds between two changes of a field by one person, as one
_MOST: Final = 1000  # values of one field


class FieldValue(msgspec.Struct, frozen=True, omit_defaults=True):
    """The value that a person gave a field by the change `seq`, and the value before; None is no
    value. `merged`: how the value came from a draft, where that person set it; `seq` is then the
    change of the merge. `overwritten`: the field never showed the value, since another person had set
    `before` at the same time, without either seeing the other's, and `before` stayed."""

    value: Any
    before: Any
    author: PersonRef
    at: datetime
    seq: int
    merged: MergedBy | None = None
    overwritten: bool = False


class FieldBlame(FieldValue, frozen=True, kw_only=True, omit_defaults=True):
    """The author of one field. Fields are named as in the keys of the document (docs/contracts.md
    1): `in/speed`, `on_true`, "" for the name of an action; also `position`."""

    field: str


class DocumentStep(msgspec.Struct, frozen=True, omit_defaults=True):
    """The change `seq` gave a key of a root map another value (docs/contracts.md 1). None is no value.
    `overwritten`: the value that the change brought, where another one overwrote it at once; `before` and
    `after` are then what the key went on showing."""

    seq: int
    author: str
    root: Root
    key: str
    before: Any
    after: Any
    overwritten: Any = None


class Blame:
    """Answers who changed what in a graph, from the index of changes; answers are JSON that a
    worker wrote."""

    def __init__(self, index: ChangeIndex) -> None:
        self._index = index

    async def of(self, graph: str, owner: str, seq: int | None) -> bytes:
        """Return the JSON of `FieldBlame`s: one for each field of an action, arrow or note
        (`owner`: its key) that has a value after the change `seq` (None: now), sorted by field.
        Raise NotFound if it did not exist then, Unavailable if the journal cannot be read."""
        upto = await bring_up(self._index, graph, seq)
        return await self._index.text(fields_of, graph, owner, upto if seq is None else seq)

    async def of_field(self, graph: str, owner: str, field: str, seq: int | None) -> bytes:
        """Return the JSON of all values that people gave a field of an action, arrow or note
        (`owner`: its key) up to `seq` (None: now), newest first, as `FieldValue`s; values that lost
        against a concurrent edit are among them. What one person typed in one go is one value.
        Raise Unavailable if the journal cannot be read."""
        upto = await bring_up(self._index, graph, seq)
        at = upto if seq is None else seq
        return await self._index.text(values_of, graph, owner, field, at)

    async def changes(self, graph: str, after: int, upto: int, limit: int) -> bytes:
        """Return the JSON of the newest `limit` changes of keys in a graph with `after < seq <=
        upto`, oldest first, as `DocumentStep`s. Raise Unavailable if the journal cannot be read."""
        await self._index.upto(graph, upto)
        return await self._index.text(steps, graph, after, upto, limit)


def fields_of(connection: Connection, graph: str, owner: str, at: int) -> list[FieldBlame]:
    """Return who gave each field of an action, arrow or note (`owner`: its key) the value that it
    has after the change `at`. Raise NotFound if it did not exist then."""
    found = index_queries.at(connection, graph, at, {owner})
    if not found:
        raise NotFound(f"There is nothing {owner!r} in this graph at that moment.")
    told = [
        FieldBlame(**msgspec.structs.asdict(value), field=field_of(change.root, change.key))
        for change, value in zip(found, _values(connection, graph, found), strict=True)
    ]
    return sorted(told, key=lambda each: each.field)


def values_of(
    connection: Connection, graph: str, owner: str, field: str, at: int
) -> list[FieldValue]:
    """Return all values of a field of an action, arrow or note (`owner`: its key) up to the change
    `at`, newest first. The value that stayed comes before the values that it overwrote."""
    changes: list[LoggedChange] = []
    lost: list[OverwrittenValue] = []
    for root, key in keys_of(owner, field):
        changes += index_queries.of_key(connection, graph, root, key, at)
        lost += index_queries.overwritten_of_key(connection, graph, root, key, at)
    alone = grafts_of(connection, graph).keys()
    found = _values(connection, graph, in_one_go(changes, alone)[::-1][:_MOST])
    latest = found[0].seq if found else 0
    found += _overwritten(connection, lost)
    newest_first = sorted(found, key=lambda each: each.seq, reverse=True)
    return sorted(newest_first, key=lambda each: each.seq != latest or each.overwritten)[:_MOST]


def steps(
    connection: Connection, graph: str, after: int, upto: int, limit: int
) -> list[DocumentStep]:
    """Return the newest `limit` changes of keys in a graph, and values that lost against a
    concurrent edit, with `after < seq <= upto`, oldest first."""
    found = [
        DocumentStep(c.seq, c.author, c.root, c.key, unpacked(c.before), unpacked(c.after))
        for c in index_queries.between(connection, graph, after, upto, limit)
    ]
    for each in index_queries.overwritten_between(connection, graph, after, upto, limit):
        stands = unpacked(each.stands)
        of = (each.seq, each.author, each.root, each.key)
        found.append(DocumentStep(*of, stands, stands, unpacked(each.value)))
    return sorted(found, key=lambda step: step.seq)[-limit:]


def _values(
    connection: Connection, graph: str, changes: Sequence[LoggedChange]
) -> list[FieldValue]:
    """Return the values that `changes` gave fields, with who did so. A merged value keeps the
    person who gave it in the draft."""
    person = stored_people(connection)
    return [
        FieldValue(
            unpacked(change.after),
            unpacked(change.before),
            person(original.change.author),
            when(original.change.at),
            change.seq,
            merged_by(change, original, person),
        )
        for change, original in zip(changes, originals(connection, graph, changes), strict=True)
    ]


def _overwritten(connection: Connection, lost: Sequence[OverwrittenValue]) -> list[FieldValue]:
    """Return the values of a field that lost against a concurrent edit (`lost`); of several that
    one person typed in one go, only the last."""
    person = stored_people(connection)
    last = [
        each
        for each, after in zip_longest(lost, lost[1:])
        if after is None or after.author != each.author or after.at - each.at >= _ONE_GO
    ]
    return [
        FieldValue(
            unpacked(each.value),
            unpacked(each.stands),
            person(each.author),
            when(each.at),
            each.seq,
            overwritten=True,
        )
        for each in last
    ]


def keys_of(owner: str, field: str) -> Sequence[tuple[Root, str]]:
    """Return the places (root map and key) that may hold a field of an action, arrow or note
    (`owner`: its key)."""
    if owner == "":
        return [("meta", field)]
    if field == "position":
        return [("positions", owner)]
    if field.startswith("waypoints/"):
        return [("positions", f"w/{owner}|{field.partition('/')[2]}")]
    key = f"{owner}|{field}" if field else owner
    return [("relations" if ">" in owner else "actions", key)]


def in_one_go(changes: Iterable[LoggedChange], alone: Set[int] = frozenset()) -> list[LoggedChange]:
    """Return changes with consecutive ones of one key by one person combined, unless they are in
    `alone` (numbers of changes). A change that was undone soon is dropped."""
    found: list[LoggedChange] = []
    for change in changes:
        last = found[-1] if found else None
        parts = last is None or last.author != change.author or change.at - last.at >= _ONE_GO
        if last is None or parts or not alone.isdisjoint({last.seq, change.seq}):
            found.append(change)
        elif last.before == change.after:
            found.pop()
        else:
            found[-1] = change._replace(before=last.before)
    return found
