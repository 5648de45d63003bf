"""Puts the actions of a sub-graph in the place of the action that stood for it, with their arrows
and drawing.

The sub-graph keeps its own drawing, with its middle where the action was. Everything beyond the
action on one side is moved away by as much as the sub-graph needs there.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from hashlib import sha256
from typing import Final, Literal, NamedTuple, TypeAlias

from msgspec.structs import replace

from action_assistant.umrf.files.writing import name_order
from action_assistant.umrf.hierarchy.joint_parts import JoinedArrow, JoinedPlace
from action_assistant.umrf.json.text import Json, Number, dump, number, parse_small
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    Action,
    Graph,
    JsonText,
    Key,
    Position,
    Relation,
    Response,
)

#: The distance between actions of a sub-graph without a drawing: along the arrows, and beside each other.
ALONG: Final = 280.0
ASIDE: Final = 140.0

#: The size of a card on the page with a margin.
WIDE: Final = 240.0
HIGH: Final = 110.0

#: The graph around a sub-graph is moved away always, or only if something would overlap.
Room: TypeAlias = Literal["always", "needed"]

_Ways: TypeAlias = tuple[tuple[Response, JsonText], ...]
_Moved: TypeAlias = Callable[[Json], Json]


class Drawing:
    """Draws the actions of one sub-graph at the place of its action, and makes room for them."""

    def __init__(self, around: Graph, action: Action, inside: Graph, room: Room = "always") -> None:
        self._at = action.position
        self._places = _drawn(inside, right=around.direction == "right")
        self._middle, self._half = _box(list(self._places.values()))
        if room == "needed" and not self._lies_upon(around, action):
            self._half = (0.0, 0.0)

    def _lies_upon(self, around: Graph, action: Action) -> bool:
        """Return whether an action of the sub-graph would overlap something around it."""
        if self._at is None:
            return False
        others = [a.position for a in around.actions if a.key != action.key]
        others += [around.entry_position, around.exit_position]
        own = [self._inner(place) for place in self._places.values()]
        return any(
            abs(x - place[0]) < WIDE and abs(y - place[1]) < HIGH
            for place in others
            if place is not None
            for x, y in own
        )

    def inner(self, action: Action) -> Position | None:
        """Return the position of an action of the sub-graph; None if the sub-graph's action had
        none."""
        place = self._places.get(action.key)
        return self._inner(place) if place is not None and self._at is not None else None

    def outer(self, position: Position | None) -> Position | None:
        """Return the position of a thing around the sub-graph, moved outwards to make room; None
        for None."""
        if position is None or self._at is None:
            return position
        x, y = (
            value + (value > at) * half - (value < at) * half
            for value, at, half in zip(position, self._at, self._half, strict=True)
        )
        return x, y

    def _inner(self, position: Position) -> Position:
        assert self._at is not None
        x, y = (
            value - middle + at
            for value, middle, at in zip(position, self._middle, self._at, strict=True)
        )
        return x, y

    def inner_note(self, text: JsonText) -> JsonText:
        """Return a note or frame of the sub-graph (JSON text) at its new position."""
        return _noted(text, self._shifted_inner)

    def outer_note(self, text: JsonText) -> JsonText:
        """Return a note or frame around the sub-graph (JSON text) at its new position."""
        return _noted(text, self._shifted_outer)

    def inner_ways(self, ways: _Ways) -> _Ways:
        """Return the waypoints (bends) of an arrow of the sub-graph at their new positions."""
        return tuple((each, _each_point(text, self._shifted_inner)) for each, text in ways)

    def outer_ways(self, ways: _Ways) -> _Ways:
        """Return the waypoints (bends) of an arrow that lies outside of the sub-graph, moved
        outwards to make room for the actions of the sub-graph."""
        return tuple((each, _each_point(text, self._shifted_outer)) for each, text in ways)

    def _shifted_inner(self, point: Json) -> Json:
        place = _place(point)
        return point if place is None or self._at is None else _json(self._inner(place))

    def _shifted_outer(self, point: Json) -> Json:
        place = _place(point)
        moved = self.outer(place)
        return point if moved is None or moved == place else _json(moved)


def _drawn(graph: Graph, *, right: bool) -> dict[Key, Position]:
    """Return the positions of a graph's actions. If any has none, all are put in rows by their
    distance from the entry. `right`: the rows follow each other to the right, else downwards."""
    drawn = {a.key: a.position for a in graph.actions if a.position is not None}
    if len(drawn) == len(graph.actions):
        return drawn
    rows: list[list[Key]] = [["entry"]]
    seen: set[Key] = {"entry"}
    while rows[-1]:
        below = [r.child for key in rows[-1] for r in graph.relations if r.parent == key]
        rows.append([key for key in dict.fromkeys(below) if key not in seen and key != "exit"])
        seen.update(rows[-1])
    rows[-1] = [a.key for a in graph.actions if a.key not in seen]
    found: dict[Key, Position] = {}
    for depth, row in enumerate(rows[1:]):
        for place, key in enumerate(row):
            along, aside = depth * ALONG, (place - (len(row) - 1) / 2) * ASIDE
            found[key] = (along, aside) if right else (aside, along)
    return found


def _box(places: Sequence[Position]) -> tuple[Position, Position]:
    """Return the middle of the positions, and half of the width and height that they cover; zeros
    without positions."""
    if not places:
        return (0.0, 0.0), (0.0, 0.0)
    xs, ys = [x for x, _ in places], [y for _, y in places]
    middle = (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2
    return middle, (max(xs) - middle[0], max(ys) - middle[1])


def _place(point: Json) -> Position | None:
    match point:
        case [Number() as x, Number() as y]:
            return x.value, y.value
        case _:
            return None


def _json(place: Position) -> Json:
    return [number(place[0]), number(place[1])]


def _noted(text: JsonText, moved: _Moved) -> JsonText:
    note = parse_small(text)
    if not isinstance(note, dict) or "at" not in note:
        return text
    at = moved(note["at"])
    return text if at is note["at"] else dump({**note, "at": at})


def _each_point(text: JsonText, moved: _Moved) -> JsonText:
    points = parse_small(text)
    return dump([moved(point) for point in points]) if isinstance(points, list) else text


#: A sort key for the position of a relation among those of its parent, or of its child.
_Order: TypeAlias = tuple[object, ...]


class Inlined(NamedTuple):
    """A graph without one of its sub-graphs. `keys`: the new keys of the sub-graph's actions by
    their old ones."""

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
    """Return the graph `around` with the actions of `inside` in place of the action `own`. `found`:
    the arrows that join it; `kept`: full names that no moved action may get. `room`: move the
    actions of `around` away always, or only if something would overlap. Actions of `inside` that
    name no actor get that of `own`, which performed them."""
    action = next(a for a in around.actions if a.key == own)
    taken = {a.key for a in around.actions}
    keys = {a.key: _fresh(taken, f"{own}/{a.key}") for a in inside.actions}
    drawing = Drawing(around, action, inside, room)
    actions = [found.entries.get(a.key, a) for a in inside.actions]
    moved = [
        replace(
            a,
            key=keys[a.key],
            instance_id=_free(a, kept),
            actor=a.actor or action.actor,
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
    """Return the graph with other keys for some of its actions."""
    actions = tuple(replace(a, key=keys.get(a.key, a.key)) for a in graph.actions)
    relations = tuple(
        replace(r, parent=keys.get(r.parent, r.parent), child=keys.get(r.child, r.child))
        for r in graph.relations
    )
    return replace(graph, actions=actions, relations=relations)


def identity(parts: Iterable[str], taken: Iterable[str]) -> str:
    """Return an id of twelve hexadecimal digits that depends only on the texts `parts` and is not
    in `taken`."""
    used, text = set(taken), "\x1f".join(parts)
    while (found := sha256(text.encode()).hexdigest()[:12]) in used:
        text += "\x1f"
    return found


def _fresh(taken: set[Key], key: Key) -> Key:
    while key in taken or key in (ENTRY, EXIT):
        key += "/"
    return key


def _free(action: Action, kept: set[str]) -> int:
    """Return the number of an action if its full name is not in `kept`, else the lowest free
    number; add the resulting full name to `kept`."""
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
            # Arrows into the sub-graph come first among the parents, arrows out of it last among the children.
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
    """Yield the relations of these arrows with new order numbers 0, 1, 2 …: among all relations of
    their parent in the order of `by_parent`, and among all of their child in the order of
    `by_child`."""
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
