"""Reduces a graph to what a thumbnail of it shows, so that lists need no document to draw it."""

from hashlib import sha256
from typing import Final

import msgspec

from action_assistant.umrf.model import ENTRY, EXIT, PRECONDITIONS, Graph, Precondition, Relation

#: Of a larger graph the first ones are shown: the others would be smaller than a pixel.
_ACTIONS: Final = 150
_ARROWS: Final = 300
_LETTERS: Final = 15  # of a name; longer ones are drawn alike
_DIGITS: Final = 16


class Thumbnail(msgspec.Struct, frozen=True):
    """A graph as its thumbnail shows it. `actions`: the index of the robot in `robots`, -1 for none,
    and the length of the name; `arrows`: where each begins and ends, and the first outcome at which
    it leads on, as an index in `PRECONDITIONS`. An end of an arrow is 0 for the entry, the number
    of an action from 1, or after the last one the exit."""

    robots: tuple[str, ...]
    actions: tuple[tuple[int, int], ...]
    arrows: tuple[tuple[int, int, int], ...]


def thumbnail(graph: Graph) -> bytes:
    """Return the JSON of the `Thumbnail` of a graph; empty for a graph without actions."""
    actions = [action for action in graph.actions if not action.missing][:_ACTIONS]
    if not actions:
        return b""
    robots = sorted({action.actor for action in actions} - {""})
    ends = {ENTRY: 0, EXIT: len(actions) + 1}
    ends |= {action.key: number for number, action in enumerate(actions, start=1)}
    relations = [
        each
        for each in graph.relations
        if each.parent in ends and each.child in ends and _is_drawn(each)
    ]
    relations.sort(  # as a file lists them: of two that overlap, the later one is seen
        key=lambda each: (
            *(each.parent != ENTRY, ends[each.child], each.child_order),
            *(ends[each.parent], each.listing),
        )
    )
    arrows = [
        (ends[each.parent], ends[each.child], PRECONDITIONS.index(_first_outcome(each)))
        for each in relations
    ]
    found = Thumbnail(
        tuple(robots),
        tuple(
            (robots.index(each.actor) if each.actor else -1, min(len(each.name), _LETTERS))
            for each in actions
        ),
        tuple(arrows[:_ARROWS]),
    )
    return msgspec.json.encode(found)


def digest_of(drawn: bytes) -> str | None:
    """Return the digest of the JSON of a thumbnail; None if there is none."""
    return sha256(drawn).hexdigest()[:_DIGITS] if drawn else None


def _is_drawn(relation: Relation) -> bool:
    """Return whether a file lists the relation where an engine looks for it."""
    if relation.parent == ENTRY:
        return relation.only != "parents" and relation.child != EXIT
    return relation.only != "children"


def _first_outcome(relation: Relation) -> Precondition:
    heard = (each for each in PRECONDITIONS if relation.conditions.answer(each) != "ignore")
    return next(heard, "on_true")
