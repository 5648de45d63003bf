"""Computes the difference of two graphs, action by action and arrow by arrow."""

from collections.abc import Iterable, Mapping
from typing import Any, Final, Literal, TypeAlias

import msgspec

from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import ENTRY, EXIT, Action, Graph, JsonText, Key, Relation

Change: TypeAlias = Literal["added", "removed", "changed"]


#: The members of a note for its position and size.
_NOTE_PLACE: Final = {"at", "size"}


class Field(msgspec.Struct, frozen=True):
    """A field that has another value than before. `before` or `after` is None if the field had no
    value then."""

    field: str
    before: Any
    after: Any


class ActionChange(msgspec.Struct, frozen=True):
    """An action that was added, removed or changed. `name`: its full name after the change, or
    before it if the action was removed."""

    change: Change
    aid: str
    name: str
    fields: tuple[Field, ...] = ()


class RelationChange(msgspec.Struct, frozen=True):
    """An arrow that was added, removed or changed. `parent` and `child` are full names of actions,
    or `entry` and `exit`.

    `ends`: the keys of parent and child. `when`: pairs of outcome and response of an arrow that was
    added or removed.
    """

    change: Change
    parent: str
    child: str
    fields: tuple[Field, ...] = ()
    ends: tuple[Key, Key] = ("", "")
    when: tuple[tuple[str, str], ...] = ()


class NoteChange(msgspec.Struct, frozen=True):
    """A note or frame that was added, removed or changed. `text`: its text after the change, or
    before it if the note was removed.

    `moved`: True if only its position or size has changed.
    """

    change: Change
    id: str
    text: str
    moved: bool = False


class Difference(msgspec.Struct, frozen=True):
    """The difference between two states of one graph. `before` and `after` are the numbers of the
    document's changes at which the graph was in these states."""

    before: int
    after: int
    fields: tuple[Field, ...]
    actions: tuple[ActionChange, ...]
    relations: tuple[RelationChange, ...]
    notes: tuple[NoteChange, ...] = ()


def difference(before: tuple[int, Graph], after: tuple[int, Graph]) -> Difference:
    """Return what changed in a graph from `before` to `after`. Each is a pair: the number of a
    change of the graph's document, and the graph after that change."""
    (old_seq, old), (new_seq, new) = before, after
    return Difference(
        old_seq,
        new_seq,
        tuple(_fields(_graph_says(old), _graph_says(new))),
        tuple(_actions(old, new)),
        tuple(_relations(old, new)),
        tuple(_notes(old, new)),
    )


def _actions(old: Graph, new: Graph) -> Iterable[ActionChange]:
    was = {action.key: action for action in old.actions}
    now = {action.key: action for action in new.actions}
    for key in dict.fromkeys([*now, *was]):
        a, b = was.get(key), now.get(key)
        fields = tuple(_fields(_action_says(a), _action_says(b))) if a and b else ()
        shown = b or a
        if shown is not None and (fields or not (a and b)):
            yield ActionChange(_change(a, b), key, shown.full_name, fields)


def _relations(old: Graph, new: Graph) -> Iterable[RelationChange]:
    was, now = _by_ends(old), _by_ends(new)
    names = _names(old) | _names(new)
    for ends in sorted(was.keys() | now.keys()):
        a, b = was.get(ends), now.get(ends)
        fields = tuple(_fields(_relation_says(a), _relation_says(b))) if a and b else ()
        if fields or not (a and b):
            parent, child, _ = ends
            yield RelationChange(
                _change(a, b),
                names.get(parent, parent),
                names.get(child, child),
                fields,
                (parent, child),
                () if a and b else _when(b or a),
            )


def _when(relation: Relation | None) -> tuple[tuple[str, str], ...]:
    """Return pairs of outcome and response of an arrow, except for responses that ignore the
    outcome; () for None or an arrow from the entry."""
    if relation is None or relation.parent == ENTRY:
        return ()
    says: dict[str, str] = msgspec.structs.asdict(relation.conditions)
    return tuple(each for each in says.items() if each[1] != "ignore")


def _notes(old: Graph, new: Graph) -> Iterable[NoteChange]:
    was, now = dict(old.notes), dict(new.notes)
    for note in sorted(was.keys() | now.keys()):
        a, b = was.get(note), now.get(note)
        if a != b:
            moved = a is not None and b is not None and _but_place(a) == _but_place(b)
            yield NoteChange(_change(a, b), note, _note_text(b or a or ""), moved)


def _note_text(note: JsonText) -> str:
    """Return the text that people read in a note or frame on the canvas, given its JSON text; "" if
    it has none."""
    found = parse_small(note)
    text = found.get("text") if isinstance(found, dict) else None
    return text if isinstance(text, str) else ""


def _but_place(note: JsonText) -> dict[str, Any] | JsonText:
    """Return the members of a note on the canvas (JSON text) without its position and size; a note
    that is no JSON object is returned unchanged."""
    found = parse_small(note)
    if not isinstance(found, dict):
        return note
    return {name: value for name, value in found.items() if name not in _NOTE_PLACE}


def _change(a: object, b: object) -> Change:
    if a is None:
        return "added"
    return "removed" if b is None else "changed"


def _fields(was: Mapping[str, Any], now: Mapping[str, Any]) -> Iterable[Field]:
    for name in sorted(was.keys() | now.keys()):
        if was.get(name) != now.get(name):
            yield Field(name, was.get(name), now.get(name))


def _names(graph: Graph) -> dict[str, str]:
    return {ENTRY: ENTRY, EXIT: EXIT} | {a.key: a.full_name for a in graph.actions}


def _by_ends(graph: Graph) -> dict[tuple[str, str, int], Relation]:
    return {(r.parent, r.child, r.listing): r for r in graph.relations}


def _graph_says(graph: Graph) -> dict[str, Any]:
    says = {
        "name": graph.name,
        "description": graph.description,
        "direction": graph.direction,
    }
    return says | dict(graph.extra)


def _action_says(action: Action) -> dict[str, Any]:
    says: dict[str, Any] = {
        "name": action.full_name,
        "type": action.type,
        "actor": action.actor,
        "description": action.description,
        "position": action.position,
    }
    says |= {f"in/{p.path}": p.text for p in action.inputs}
    says |= {f"out/{p.path}": p.text for p in action.outputs}
    says |= {f"ask/{path}": mark for path, mark in action.asks}
    return says | _breakpoint_of(action) | dict(action.extra)


def _relation_says(relation: Relation) -> dict[str, Any]:
    conditions: dict[str, Any] = msgspec.structs.asdict(relation.conditions)
    remaps = {f"remap/{remap.source}": remap.target for remap in relation.remap}
    waypoints = {f"waypoints/{response}": text for response, text in relation.waypoints}
    extra = {f"parents/{field}": text for field, text in relation.parents_extra}
    extra |= {f"children/{field}": text for field, text in relation.children_extra}
    held = _breakpoint_of(relation)
    return conditions | {"required": relation.required} | remaps | waypoints | held | extra


def _breakpoint_of(thing: Action | Relation) -> dict[str, Any]:
    return {"breakpoint": thing.breakpoint} if thing.breakpoint else {}
