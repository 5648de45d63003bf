"""A sub-graph's actions put where the action stood that was it."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from hashlib import sha256
from typing import NamedTuple, TypeAlias

from msgspec.structs import replace

from action_assistant.umrf.files.writing import name_order
from action_assistant.umrf.hierarchy.drawing import Drawing, Room
from action_assistant.umrf.hierarchy.joint_parts import JoinedArrow, JoinedPlace
from action_assistant.umrf.model import ENTRY, EXIT, Action, Graph, Key, Relation

#: What decides where a relation stands among those of its parent, or of its child.
_Order: TypeAlias = tuple[object, ...]


class Inlined(NamedTuple):
    """A graph without one of its sub-graphs. `keys`: of the sub-graph's actions, by those they had."""

    graph: Graph
    keys: Mapping[Key, Key]


class _Arrow(NamedTuple):
    relation: Relation
    by_parent: _Order
    by_child: _Order


def inlined(
    around: Graph,
    own: Key,
    inside: Graph,
    found: JoinedPlace,
    kept: set[str],
    room: Room = "always",
) -> Inlined:
    """The graph with these actions in the place of one. `kept`: full names that nobody else gets; `room`:
    whether what stands around is moved away where there is room already."""
    action = next(a for a in around.actions if a.key == own)
    there = {a.key for a in around.actions}
    keys = {a.key: _fresh(there, f"{own}/{a.key}") for a in inside.actions}
    drawing = Drawing(around, action, inside, room)
    actions = [found.entries.get(a.key, a) for a in inside.actions]
    moved = [
        replace(
            a,
            key=keys[a.key],
            instance_id=_free(a, kept),
            position=drawing.inner(a),
        )
        for a in actions
    ]
    outer = [replace(a, position=drawing.outer(a.position)) for a in around.actions]
    listed = [each for a in outer for each in (moved if a.key == own else [a])]
    graph = replace(
        around,
        actions=tuple(listed),
        relations=tuple(_ranked(_arrows(around, own, inside, found, keys, drawing))),
        entry_position=drawing.outer(around.entry_position),
        exit_position=drawing.outer(around.exit_position),
        notes=(
            *((name, drawing.outer_note(text)) for name, text in around.notes),
            *_notes(around, inside, own, drawing),
        ),
    )
    return Inlined(graph, keys)


def under_keys(graph: Graph, keys: Mapping[Key, Key]) -> Graph:
    """The graph with other keys for some of its actions."""
    actions = tuple(replace(a, key=keys.get(a.key, a.key)) for a in graph.actions)
    relations = tuple(
        replace(r, parent=keys.get(r.parent, r.parent), child=keys.get(r.child, r.child))
        for r in graph.relations
    )
    return replace(graph, actions=actions, relations=relations)


def identity(parts: Iterable[str], taken: Iterable[str]) -> str:
    """Twelve letters and digits that follow from these texts alone, and are nobody else's."""
    there, text = set(taken), "\x1f".join(parts)
    while (found := sha256(text.encode()).hexdigest()[:12]) in there:
        text += "\x1f"
    return found


def _fresh(there: set[Key], key: Key) -> Key:
    while key in there or key in (ENTRY, EXIT):
        key += "/"
    return key


def _free(action: Action, kept: set[str]) -> int:
    """The number of an action if nobody has its full name, else the lowest that is free."""
    number = action.instance_id
    if action.full_name in kept:
        number = 0
        while f"{action.name}_{number}" in kept:
            number += 1
    kept.add(f"{action.name}_{number}")
    return number


def _notes(around: Graph, inside: Graph, own: Key, drawing: Drawing) -> Iterator[tuple[str, str]]:
    taken = {name for name, _ in around.notes}
    for name, text in inside.notes:
        fresh = name if name not in taken else identity((own, name), taken)
        taken.add(fresh)
        yield fresh, drawing.inner_note(text)


def _arrows(
    around: Graph,
    own: Key,
    inside: Graph,
    found: JoinedPlace,
    keys: Mapping[Key, Key],
    drawing: Drawing,
) -> Iterator[_Arrow]:
    for relation in around.relations:
        if own not in (relation.parent, relation.child):
            moved = replace(relation, waypoints=drawing.outer_ways(relation.waypoints))
            yield _Arrow(moved, _of_parent(relation), _of_child(relation))
    for relation in inside.relations:
        if relation.parent != ENTRY and relation.child != EXIT:
            moved = replace(
                relation,
                parent=keys[relation.parent],
                child=keys[relation.child],
                waypoints=drawing.inner_ways(relation.waypoints),
            )
            # Who leads in comes first among the parents, who follows last among the children.
            yield _Arrow(moved, (0, *_of_parent(relation)), (1, *_of_child(relation)))
    for arrow in found.into:
        relation = replace(arrow.relation, child=keys[arrow.relation.child])
        yield _Arrow(relation, _instead(arrow, _of_parent), (0, *_of_child(arrow.instead)))
    for arrow in found.out:
        relation = replace(arrow.relation, parent=keys[arrow.relation.parent])
        yield _Arrow(relation, (1, *_of_parent(arrow.instead)), _instead(arrow, _of_child))


def _of_parent(relation: Relation) -> _Order:
    return relation.parent_order, *name_order(relation)


def _of_child(relation: Relation) -> _Order:
    return relation.child_order, *name_order(relation)


def _instead(arrow: JoinedArrow, order: Callable[[Relation], _Order]) -> _Order:
    return *order(arrow.instead), arrow.place


def _ranked(arrows: Iterable[_Arrow]) -> Iterator[Relation]:
    """The relations with places 0, 1, 2 … as orders."""
    listed = list(arrows)
    by_parent: dict[Key, list[_Arrow]] = {}
    by_child: dict[Key, list[_Arrow]] = {}
    for arrow in listed:
        by_parent.setdefault(arrow.relation.parent, []).append(arrow)
        by_child.setdefault(arrow.relation.child, []).append(arrow)
    parent_place, child_place = dict[int, float](), dict[int, float]()
    for group in by_parent.values():
        for place, arrow in enumerate(sorted(group, key=lambda each: each.by_parent)):
            parent_place[id(arrow)] = float(place)
    for group in by_child.values():
        for place, arrow in enumerate(sorted(group, key=lambda each: each.by_child)):
            child_place[id(arrow)] = float(place)
    for arrow in listed:
        yield replace(
            arrow.relation,
            parent_order=parent_place[id(arrow)],
            child_order=child_place[id(arrow)],
        )
