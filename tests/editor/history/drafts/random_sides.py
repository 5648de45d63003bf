"""Two people who go on from one document, each for themselves."""

import random
from typing import Any, Final, NamedTuple

import msgspec

from action_assistant.editor.documents.values import ends_of
from action_assistant.editor.history.key_changes import Place, exist, places_of
from editor.history.random_edits import Person

_ENDS: Final = {"entry", "exit"}


class Sides(NamedTuple):
    """The document before both sides parted, and the document of each side."""

    base: dict[Place, Any]
    ours: dict[Place, Any]
    theirs: dict[Place, Any]


def sides(seed: int, *, ours: int = 8, theirs: int = 8) -> Sides:
    """After so many edits each."""
    dice = random.Random(seed)
    first = Person("ada", dice)
    for _ in range(12):
        first.edit()
    _fields(first, dice, 4)
    state = first.doc.get_update()
    return Sides(places_of(state), _edited(state, dice, ours), _edited(state, dice, theirs))


def _edited(state: bytes, dice: random.Random, edits: int) -> dict[Place, Any]:
    one = Person("mari", dice)
    one.hear(state)
    for _ in range(edits):
        one.edit()
    _fields(one, dice, edits // 3)
    return places_of(one.doc.get_update())


def _fields(one: Person, dice: random.Random, count: int) -> None:
    """Parameters in an order, fields that nobody knows, places in orders."""
    for _ in range(count):
        if (aid := one.some_action()) is None:
            continue
        actions, path = one.map("actions"), f"p{dice.randrange(6)}"
        key = f"{aid}|in/{path}"
        known = msgspec.json.decode(actions.get(f"{aid}|in", "[]"))
        if key in actions and dice.random() < 0.5:
            del actions[key]
            names = [name for name in known if name != path]
        else:
            actions[key] = f'{{"pvf_value":{one.number()}}}'
            names = [*known, *([] if path in known else [path])]
        actions[f"{aid}|in"] = msgspec.json.encode(names).decode()
        actions[f"{aid}|x/colour"] = f'"{one.number()}"'
        actions[f"{aid}|strange"] = [one.number() * 1.0]
        one.map("meta")["x/unknown"] = str(one.number())
        one.map("positions")["w/nonsense"] = [1.0, 1.0]


def loose(places: dict[Place, Any]) -> set[str]:
    """Arrows without one of their ends."""
    there = exist(places) | _ENDS
    found = {key.partition("|")[0] for root, key in places if root == "relations"}
    return {each for each in found if (ends := ends_of(each)) and not there.issuperset(ends[:2])}
