"""Prints a difference as lines of text, and makes graphs of different origins comparable. Pure."""

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any, Final

import msgspec
from msgspec.structs import replace

from action_assistant.umrf.difference import (
    ActionChange,
    Change,
    Difference,
    Field,
    RelationChange,
)
from action_assistant.umrf.json.text import dump, parse_small
from action_assistant.umrf.model import PRECONDITIONS, Graph, Key

_SIGNS: Final[dict[Change, str]] = {"added": "+", "removed": "-", "changed": "~"}
_LOOKS: Final = ("position", "direction", "waypoints/", "gui_attributes", "breakpoint")


def by_name(graph: Graph) -> Graph:
    """Return the graph with the full name of each action as its key, so that it can be compared
    with a graph that was read from another file.

    If several actions have the same full name, the keys of the later ones get a number.
    """
    seen: Counter[str] = Counter()
    keys: dict[Key, Key] = {}
    for action in graph.actions:
        seen[action.full_name] += 1
        count = seen[action.full_name]
        keys[action.key] = action.full_name if count == 1 else f"{action.full_name}#{count}"
    return replace(
        graph,
        actions=tuple(replace(action, key=keys[action.key]) for action in graph.actions),
        relations=tuple(
            replace(
                each,
                parent=keys.get(each.parent, each.parent),
                child=keys.get(each.child, each.child),
            )
            for each in graph.relations
        ),
    )


def without_looks(found: Difference) -> Difference:
    """Return the part of a difference that can change what a robot does: without positions,
    waypoints, breakpoints, and notes and frames on the canvas."""
    actions = (replace(a, fields=_meant(a.fields)) for a in found.actions)
    relations = (replace(r, fields=_meant(r.fields)) for r in found.relations)
    return replace(
        found,
        fields=_meant(found.fields),
        actions=tuple(a for a in actions if a.fields or a.change != "changed"),
        relations=tuple(r for r in relations if r.fields or r.change != "changed"),
        notes=(),
    )


def is_same(found: Difference) -> bool:
    """Return whether a difference is empty, that is, whether the two states are equal."""
    return not (found.fields or found.actions or found.relations or found.notes)


def lines(found: Difference) -> Iterator[str]:
    """Yield the lines of text that describe a difference: first the changes that can change what a
    robot does, then the changes of the drawing."""
    meant = without_looks(found)
    if meant.fields:
        yield "~ graph"
        yield from _indented(meant.fields)
    for action in meant.actions:
        yield from _action(action)
    for relation in meant.relations:
        yield from _relation(relation)
    yield from _looks(found)


def _action(change: ActionChange) -> Iterator[str]:
    yield f"{_SIGNS[change.change]} {change.name}"
    yield from _indented(change.fields)


def _relation(change: RelationChange) -> Iterator[str]:
    yield f"{_SIGNS[change.change]} {change.parent} -> {change.child}"
    yield from _indented(change.fields)


def _indented(fields: Iterable[Field]) -> Iterator[str]:
    for field in fields:
        for name, before, after in _members(field):
            yield f"    {name}: {_value_text(before)} -> {_value_text(after)}"


def _members(field: Field) -> Iterator[tuple[str, Any, Any]]:
    """Yield (name, before, after) for each differing member of a parameter; once for a field that
    is no parameter, or that was added or removed."""
    name = _words(field.field)
    was, now = _parsed(field, field.before), _parsed(field, field.after)
    if not (isinstance(was, dict) and isinstance(now, dict)):
        yield name, _plain(was), _plain(now)
        return
    for member in dict.fromkeys([*was, *now]):
        before, after = was.get(member), now.get(member)
        if before != after:
            short = member.removeprefix("pvf_")
            yield (name if short == "value" else f"{name} ({short})"), before, after


def _parsed(field: Field, value: Any) -> Any:
    """Return the JSON value of a field that is stored as JSON text, and any other value as it is."""
    kept = field.field.startswith(("in/", "out/", "x/"))
    return parse_small(value) if kept and isinstance(value, str) else value


def _plain(value: Any) -> Any:
    """Return the value of a parameter that was added or removed; the whole parameter if it has no
    value. Anything else than a parameter is returned unchanged."""
    return value.get("pvf_value", value) if isinstance(value, dict) else value


def _value_text(value: Any) -> str:
    if value is None:
        return "(nothing)"
    if isinstance(value, tuple | float | int):  # a position; parsed texts are none of these types
        return msgspec.json.encode(value).decode()
    return dump(value)


def _words(field: str) -> str:
    side, slash, path = field.partition("/")
    if slash and side in {"in", "out"}:
        return f"{'input' if side == 'in' else 'output'} {path}"
    if side in PRECONDITIONS:
        return side.replace("_", " ")
    return field


def _looks(found: Difference) -> Iterator[str]:
    moved = sum(any(_is_look(f) for f in action.fields) for action in found.actions)
    led = sum(any(_is_look(f) for f in relation.fields) for relation in found.relations)
    changes = [
        *(
            [f"{moved} {'action stands' if moved == 1 else 'actions stand'} elsewhere"]
            * bool(moved)
        ),
        *([f"{led} {'arrow is' if led == 1 else 'arrows are'} led otherwise"] * bool(led)),
        *(["the graph is drawn otherwise"] if any(map(_is_look, found.fields)) else []),
        *(
            f"{_SIGNS[note.change]} note {dump(' '.join(note.text.split())[:60])}"
            for note in found.notes
        ),
    ]
    if changes:
        yield "looks only:"
        yield from (f"    {line}" for line in changes)


def _meant(fields: Iterable[Field]) -> tuple[Field, ...]:
    return tuple(field for field in fields if not _is_look(field))


def _is_look(field: Field) -> bool:
    return field.field.startswith(_LOOKS)
