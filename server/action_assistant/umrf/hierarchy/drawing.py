"""Where everything is drawn when a sub-graph's actions stand where its action stood.

The sub-graph keeps its own drawing, with its middle where the action was; what lay beyond the action on
one side is moved away by as much as that needs there.
"""

from collections.abc import Callable, Sequence
from typing import Final, Literal, TypeAlias

from action_assistant.umrf.json.text import Json, Number, dump, number, parse_small
from action_assistant.umrf.model import Action, Graph, JsonText, Key, Position, Response

#: Between actions of a sub-graph that nobody has drawn: along what follows, and beside each other.
ALONG: Final = 280.0
ASIDE: Final = 140.0

#: What a card takes up on the page, and a little around it.
WIDE: Final = 240.0
HIGH: Final = 110.0

#: Whether what stands around a sub-graph is moved away, or only where something would lie upon it.
Room: TypeAlias = Literal["always", "needed"]

_Ways: TypeAlias = tuple[tuple[Response, JsonText], ...]
_Moved: TypeAlias = Callable[[Json], Json]


class Drawing:
    """Puts the actions of one sub-graph where its action stands, and makes room for them."""

    def __init__(self, around: Graph, action: Action, inside: Graph, room: Room = "always") -> None:
        self._at = action.position
        self._places = _drawn(inside, right=around.direction == "right")
        self._middle, self._half = _box(list(self._places.values()))
        if room == "needed" and not self._lies_upon(around, action):
            self._half = (0.0, 0.0)

    def _lies_upon(self, around: Graph, action: Action) -> bool:
        """Whether an action of the sub-graph would cover something around it."""
        if self._at is None:
            return False
        there = [a.position for a in around.actions if a.key != action.key]
        there += [around.entry_position, around.exit_position]
        own = [self._inner(place) for place in self._places.values()]
        return any(
            abs(x - place[0]) < WIDE and abs(y - place[1]) < HIGH
            for place in there
            if place is not None
            for x, y in own
        )

    def inner(self, action: Action) -> Position | None:
        """The place of an action of the sub-graph; none where its action had none."""
        place = self._places.get(action.key)
        return self._inner(place) if place is not None and self._at is not None else None

    def outer(self, position: Position | None) -> Position | None:
        """The place of what stands around it."""
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
        """A note or frame of the sub-graph."""
        return _noted(text, self._shifted_inner)

    def outer_note(self, text: JsonText) -> JsonText:
        """A note or frame around it."""
        return _noted(text, self._shifted_outer)

    def inner_ways(self, ways: _Ways) -> _Ways:
        """Waypoints of a line of the sub-graph."""
        return tuple((each, _each_point(text, self._shifted_inner)) for each, text in ways)

    def outer_ways(self, ways: _Ways) -> _Ways:
        """Waypoints of a line around it."""
        return tuple((each, _each_point(text, self._shifted_outer)) for each, text in ways)

    def _shifted_inner(self, point: Json) -> Json:
        place = _place(point)
        return point if place is None or self._at is None else _json(self._inner(place))

    def _shifted_outer(self, point: Json) -> Json:
        place = _place(point)
        moved = self.outer(place)
        return point if moved is None or moved == place else _json(moved)


def _drawn(graph: Graph, *, right: bool) -> dict[Key, Position]:
    """The places of a graph's actions; in rows by how far they are from the start, where one of
    them has none."""
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
    """The middle of these places, and half of what they take up."""
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
