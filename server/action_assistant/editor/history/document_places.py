"""Maps the keys of a document to the actions, arrows and notes that they belong to. For workers."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import Any, Final

from pycrdt import Doc

from action_assistant.editor.documents import document
from action_assistant.editor.documents.values import ROOTS, Root, ends_of
from action_assistant.editor.history.key_changes import Place, owner_of
from action_assistant.umrf.model import PRECONDITIONS

_OUTCOMES: Final = frozenset(PRECONDITIONS)


def places_of(state: bytes) -> dict[Place, Any]:
    """Return the values of a document by their place (root and key)."""
    doc: Doc[Any] = Doc()
    doc.apply_update(state)
    maps = document.maps_of(doc)
    return {(root, key): value for root in ROOTS for key, value in maps[root].items()}


def field_of(root: Root, key: str) -> str:
    """Return the name of the field that a key of the document stores, within the action, arrow or
    note that `owner_of` returns for this key.

    `root` is the top-level map that has the key. The field of `ID|type` is `type`; the field of
    `ID` alone in `actions` is an empty text.
    """
    if root == "meta":
        return key
    if root == "positions":
        return f"waypoints/{key.partition('|')[2]}" if key.startswith("w/") else "position"
    return key.partition("|")[2]


def proves(place: Place) -> bool:
    """Return whether the owner of a key exists because of this key."""
    root, key = place
    match root:
        case "actions":
            return "|" not in key
        case "relations":
            return key.partition("|")[2] in _OUTCOMES
        case _:
            return root == "positions" and key.startswith("g/")


def is_place_of_card(place: Place) -> bool:
    """Return whether a key holds the position of a card or of a line."""
    root, key = place
    return root == "positions" and not key.startswith("g/")


def by_owner(places: Iterable[Place]) -> dict[str, list[Place]]:
    """Group keys of a document by the action, arrow or note that they describe."""
    found: dict[str, list[Place]] = defaultdict(list)
    for place in places:
        found[owner_of(*place)].append(place)
    return found


def arrows_of(owners: Iterable[str]) -> dict[str, set[str]]:
    """Return the arrows of each action."""
    found: dict[str, set[str]] = defaultdict(set)
    for owner in owners:
        for end in (ends_of(owner) or ())[:2]:
            found[str(end)].add(owner)
    return found


def exist(places: Mapping[Place, Any]) -> set[str]:
    """Return the actions, arrows and notes that exist in these values."""
    return {owner_of(*place) for place in places if proves(place)}
