"""Summarises the changes of edit sessions as differences of actions, arrows and notes. Runs in workers."""

from collections.abc import Iterable, Mapping, Sequence, Set
from typing import Any, Final, TypeAlias

import msgspec
from msgspec.structs import replace
from sqlalchemy import Connection

from action_assistant.editor.documents.document import Maps, read_maps
from action_assistant.editor.documents.values import ROOTS, ends_of
from action_assistant.editor.history import index_queries
from action_assistant.editor.history.key_changes import (
    LoggedChange,
    OverwrittenValue,
    Packed,
    Place,
    owner_of,
    unpacked,
)
from action_assistant.errors import TooLarge
from action_assistant.umrf.difference import (
    ActionChange,
    Difference,
    Field,
    NoteChange,
    RelationChange,
    difference,
)
from action_assistant.umrf.model import ENTRY, EXIT, Graph

State: TypeAlias = dict[Place, Packed]

_SHOWN: Final = 30  # things of one kind in one session
_ENDS: Final = {ENTRY, EXIT}


class ChangedThings(msgspec.Struct, frozen=True, omit_defaults=True):
    """A difference with at most 30 items of each kind; `more`: the number of others."""

    fields: tuple[Field, ...] = ()
    actions: tuple[ActionChange, ...] = ()
    relations: tuple[RelationChange, ...] = ()
    notes: tuple[NoteChange, ...] = ()
    more: int = 0


class Changes(ChangedThings, frozen=True, omit_defaults=True):
    """The changes of one person. `comments`: the number of threads with new comments.
    `overwritten`: the values that this person set while another, without knowing of it, set the
    values that stayed: each as the difference between what this person wanted (`before`) and what
    stayed (`after`). Of notes the text that this person wanted."""

    comments: int = 0
    overwritten: ChangedThings | None = None


class Stretch(msgspec.Struct, frozen=True, array_like=True):
    """The changes from `first` to `last`, of which those by `author` are summarised."""

    author: str
    first: int
    last: int


def told(
    base: Sequence[LoggedChange],
    changes: Sequence[LoggedChange],
    stretches: Sequence[Stretch],
    lost: Sequence[OverwrittenValue] = (),
) -> list[Changes]:
    """Return, for each stretch (a range of changes by one person), the difference that it made to
    the graph. `base`: the newest change of each touched key before `changes`; `lost`: values that
    lost against a concurrent edit, so that the graph never had them. `changes` and `lost` are in
    order of time."""
    state = state_of(base)
    gone: State = {}  # the names of actions that were deleted
    wanted: list[dict[Place, OverwrittenValue]] = [{} for _ in stretches]
    losing = _Current(stretches)
    for each in lost:
        if (mine := losing.of(each)) is not None:
            wanted[mine][each.place] = each
    own: list[dict[Place, tuple[Packed, Packed]]] = [{} for _ in stretches]
    found = [Changes() for _ in stretches]
    current = _Current(stretches)
    ends = sorted(range(len(stretches)), key=lambda n: stretches[n].last, reverse=True)
    for change in changes:
        while ends and stretches[ends[-1]].last < change.seq:
            found[ends[-1]] = _told(own[ends[-1]], wanted[ends[-1]], state, gone)
            ends.pop()
        state[change.place] = change.after
        if change.after is None and _is_name_of_action(change):
            gone[change.place] = change.before
        if (mine := current.of(change)) is not None:
            before, _ = own[mine].get(change.place, (change.before, None))
            own[mine][change.place] = before, change.after
    for n in ends:
        found[n] = _told(own[n], wanted[n], state, gone)
    return found


def state_of(changes: Iterable[LoggedChange]) -> State:
    """Return the value of each key after `changes`, which are in order of time."""
    return {change.place: change.after for change in changes}


def maps_of(state: Mapping[Place, Packed]) -> Maps:
    """Return the values of a document as its root maps; values that are no value are missing."""
    maps: Maps = {root: {} for root in ROOTS}
    for (root, key), value in state.items():
        if value is not None:
            maps[root][key] = unpacked(value)
    return maps


def document(changes: Sequence[LoggedChange]) -> bytes:
    """Return the JSON of the root maps of a document after `changes`; values that are bytes, which
    the page never writes, are missing."""
    maps = maps_of(state_of(changes))
    plain = {
        root: {key: value for key, value in fields.items() if not isinstance(value, bytes)}
        for root, fields in maps.items()
    }
    return msgspec.json.encode(plain)


def graph_of(state: Mapping[Place, Packed]) -> Graph:
    """Return the graph that the values of a document describe."""
    return read_maps(maps_of(state))


def document_at(connection: Connection, graph: str, seq: int) -> bytes:
    """Return the JSON of the root maps of a graph's document after its change `seq`."""
    return document(index_queries.at(connection, graph, seq))


def differing(connection: Connection, graph: str, then: int, now: int) -> Difference:
    """Return the difference between a graph after its change `then` and after its change `now`."""
    was, is_now = (
        graph_of(state_of(index_queries.at(connection, graph, seq))) for seq in (then, now)
    )
    return difference((then, was), (now, is_now))


def names_between(
    connection: Connection, graph: str, after: int, upto: int, limit: int
) -> tuple[str, tuple[str, ...]]:
    """Return the name of a graph after its change `upto`, and all names that its actions had since
    its change `after`. Raise TooLarge if there are more than `limit` changes in between."""
    return names(stretch_of(connection, graph, after, upto, limit, whole=True))


def stretch_of(
    connection: Connection, graph: str, after: int, upto: int, limit: int, *, whole: bool = False
) -> list[LoggedChange]:
    """Return the changes of keys of a graph with `after < seq <= upto`; with `whole`, precede them
    by the changes that make up the state at `after`. Raise TooLarge if there are more than `limit`.
    """
    found = index_queries.between(connection, graph, after, upto, limit + 1)
    if len(found) > limit:
        raise TooLarge("That is too long ago; name a later moment that was good.")
    return [*index_queries.at(connection, graph, after), *found] if whole else found


def names(changes: Iterable[LoggedChange]) -> tuple[str, tuple[str, ...]]:
    """Return the last name of a graph, and all names that its actions had, from changes in order of
    time."""
    own, uses = "", set[str]()
    for change in changes:
        is_name = change.place == ("meta", "name")
        if change.after is None or not (is_name or _is_name_of_action(change)):
            continue
        name = unpacked(change.after)
        if not isinstance(name, str):
            continue
        if is_name:
            own = name
        elif name:
            uses.add(name)
    return own, tuple(sorted(uses))


def _is_name_of_action(change: LoggedChange) -> bool:
    """Return whether a change sets the name of an action, which is stored under its bare key."""
    return change.root == "actions" and "|" not in change.key


class _Current:
    """Finds the stretch to which a change belongs. The stretches of one person do not overlap."""

    def __init__(self, stretches: Sequence[Stretch]) -> None:
        self._of: dict[str, list[tuple[int, Stretch]]] = {}
        for n, stretch in sorted(enumerate(stretches), key=lambda each: each[1].first):
            self._of.setdefault(stretch.author, []).append((n, stretch))

    def of(self, change: LoggedChange | OverwrittenValue) -> int | None:
        """Return the index of the stretch to which a change belongs; None for no stretch. Call it
        with changes in order of time."""
        mine = self._of.get(change.author, [])
        while mine and mine[0][1].last < change.seq:
            mine.pop(0)
        return mine[0][0] if mine and mine[0][1].first <= change.seq else None


def _told(
    own: Mapping[Place, tuple[Packed, Packed]],
    lost: Mapping[Place, OverwrittenValue],
    state: State,
    gone: State,
) -> Changes:
    """Return the difference that one person made to the things they touched, without later changes
    by others. `own`: the old and new value of each key; `lost`: their values that lost against a
    concurrent edit; `state`: all values after the changes; `gone`: the last names of deleted
    actions."""
    owners = {owner_of(*place) for place in own}
    around = _around(owners, state)
    before = around | {place: old for place, (old, _) in own.items()}
    after = around | {place: new for place, (_, new) in own.items()}
    found = difference((0, graph_of(before)), (0, graph_of(after)))
    told = shortened(found, owners)
    return replace(told, overwritten=_overwritten(lost, state, gone)) if lost else told


def _around(owners: Set[str], state: State) -> State:
    """Return the values in `state` of the actions and arrows with these keys, and the names of the
    actions at the ends of the arrows."""
    names = {("actions", key) for owner in owners for key in _ends(owner)}
    return {p: value for p, value in state.items() if owner_of(*p) in owners or p in names}


def _overwritten(
    lost: Mapping[Place, OverwrittenValue], state: State, gone: State
) -> ChangedThings | None:
    """Return the values that were lost as differences to the values that stayed; None where that
    shows no difference, as for comments. An action that was deleted meanwhile is called by its last
    name (`gone`)."""
    owners = {owner_of(*place) for place in lost}
    around = _around(owners, gone) | {
        p: v for p, v in _around(owners, state).items() if v is not None
    }
    wanted = graph_of(around | {place: each.value for place, each in lost.items()})
    stayed = graph_of(
        around
        | {place: each.stands for place, each in lost.items() if each.stands or place not in gone}
    )
    found = shortened(difference((0, wanted), (0, stayed)), owners)
    notes = difference((0, stayed), (0, wanted)).notes[:_SHOWN]
    things = ChangedThings(found.fields, found.actions, found.relations, notes, found.more)
    return None if things == ChangedThings() else things


def _ends(owner: str) -> set[str]:
    """Return the actions at the ends of an arrow; an empty set for other owners."""
    ends = ends_of(owner)
    return set() if ends is None else {ends.parent, ends.child} - _ENDS


def shortened(found: Difference, owners: Set[str]) -> Changes:
    """Return a difference with at most 30 items of each kind, and only the actions with keys in
    `owners`: others changed only as a consequence, such as by a new number after a name was taken.
    """
    actions = tuple(change for change in found.actions if change.aid in owners)
    comments = sum(owner.startswith("c/") for owner in owners)
    kinds: tuple[tuple[Any, ...], ...] = (actions, found.relations, found.notes)
    return Changes(
        found.fields,
        _most(actions),
        found.relations[:_SHOWN],
        found.notes[:_SHOWN],
        sum(max(0, len(kind) - _SHOWN) for kind in kinds),
        comments,
    )


def _most(actions: Sequence[ActionChange]) -> tuple[ActionChange, ...]:
    """Return at most 30 changes of actions, mere changes of the position last."""

    def moved_only(change: ActionChange) -> bool:
        return change.change == "changed" and all(f.field == "position" for f in change.fields)

    return tuple(sorted(actions, key=moved_only)[:_SHOWN])
