"""The merge of two documents that went on from a third, key by key. Pure; for workers.

What one side alone changed is taken; where both did, people choose. An action, arrow or note that one
side removed while the other went on with it is one conflict, not one for each key. An arrow without an
end never comes to be. Where both moved a card or changed an order, what stands on our side stays: nobody
is asked about looks.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final, TypeAlias

import msgspec
from msgspec import UNSET

from action_assistant.editor.documents.document import is_same
from action_assistant.editor.documents.values import ends_of, is_aid, text_list
from action_assistant.editor.history.key_changes import (
    Place,
    arrows_of,
    by_owner,
    exist,
    is_place_of_card,
)
from action_assistant.editor.interchange.document_edits import Side, chosen
from action_assistant.umrf.model import ENTRY, EXIT

Places: TypeAlias = Mapping[Place, Any]
#: The chosen side of each conflict, by its place.
Choices: TypeAlias = Mapping[str, Side]

_ORDERS: Final = frozenset({"order", "po", "co"})
_LISTS: Final = frozenset({"in", "out", "x", "remap", "x/parents", "x/children"})
_ENDS: Final = frozenset({ENTRY, EXIT})


class FoundConflict(msgspec.Struct, frozen=True):
    """A conflict: both sides changed the key `key`, or the side `removed` removed a thing that the
    other side changed. `place`: the key by which a choice names it."""

    place: str
    owner: str
    key: Place | None = None
    removed: Side | None = None


class KeyMerge(msgspec.Struct, frozen=True):
    """The values that the side "ours" has to set so that it is merged; UNSET for a key that is
    removed. A conflict without a choice keeps the value of this side."""

    targets: dict[Place, Any]
    conflicts: tuple[FoundConflict, ...]


def merged(base: Places, ours: Places, theirs: Places, choices: Choices) -> KeyMerge:
    """Return the merge of the changes of `theirs` into `ours`, key by key; `base` is their common
    origin. `choices`: the side that counts for each conflict, by its place."""
    merge = _Merge(_plain(base), _plain(ours), _plain(theirs), choices)
    return merge.outcome()


def _plain(places: Places) -> dict[Place, Any]:
    """Return the entries that have a value, without comments, which are not merged."""
    return {p: value for p, value in places.items() if p[0] != "comments" and value is not None}


def _other(side: Side) -> Side:
    return "theirs" if side == "ours" else "ours"


class _Merge:
    """Merges two sides with a common base, key by key."""

    def __init__(
        self,
        base: dict[Place, Any],
        ours: dict[Place, Any],
        theirs: dict[Place, Any],
        choices: Choices,
    ) -> None:
        self._base = base
        self._sides: Final[dict[Side, dict[Place, Any]]] = {"ours": ours, "theirs": theirs}
        self._choices = choices
        self._was = exist(base)
        self._there: Final[dict[Side, set[str]]] = {"ours": exist(ours), "theirs": exist(theirs)}
        self._owners = by_owner({**base, **ours, **theirs})
        self._arrows = arrows_of(self._owners)
        self._conflicts: list[FoundConflict] = []
        self._whole: dict[str, Side] = {}  # what is taken from one side, every key of it
        self._result: dict[Place, Any] = {}

    def outcome(self) -> KeyMerge:
        """Merge all keys, and return the values to set and the conflicts."""
        actions = [owner for owner in sorted(self._owners) if is_aid(owner)]
        arrows = [owner for owner in sorted(self._owners) if ends_of(owner) is not None]
        self._take_whole(actions, self._is_used)
        self._choose_sides_of_arrows(actions)
        self._take_whole(arrows, self._is_changed)
        lists: list[Place] = []
        for owner, places in sorted(self._owners.items()):
            if (side := self._whole.get(owner)) is not None:
                self._take(places, side)
                continue
            for place in sorted(places):
                if _is_list(place):
                    lists.append(place)
                else:
                    self._choose(place, owner)
        for place in lists:
            self._join(place)
        self._drop(arrows)
        ours = self._sides["ours"]
        targets = {
            place: self._result.get(place, UNSET)
            for place in sorted({*ours, *self._result})
            if not is_same(ours.get(place, UNSET), self._result.get(place, UNSET))
        }
        return KeyMerge(targets, tuple(self._conflicts))

    # --- what came or went ------------------------------------------------------------------------

    def _take_whole(self, owners: Iterable[str], matters: Callable[[str, Side], bool]) -> None:
        """Decide, for each thing (`owners`: keys) that one side removed, from which side all its
        keys come: the one that removed it or, if `matters` says that the other side's changes to it
        matter, after a conflict the chosen side."""
        for owner in owners:
            there: list[Side] = [side for side in self._there if owner in self._there[side]]
            if owner in self._whole or owner not in self._was or len(there) != 1:
                continue
            keeper = there[0]
            if not matters(owner, keeper):
                self._whole[owner] = _other(keeper)
                continue
            place = f"{'relations' if '>' in owner else 'actions'}/{owner}"
            self._conflicts.append(FoundConflict(place, owner, removed=_other(keeper)))
            self._whole[owner] = self._choices.get(place, "ours")

    def _is_used(self, action: str, side: Side) -> bool:
        """Return whether a side changed an action or one of its arrows."""
        return self._is_changed(action, side) or any(
            self._is_changed(arrow, side)
            for arrow in self._arrows.get(action, ())
            if arrow in self._there[side]
        )

    def _is_changed(self, owner: str, side: Side) -> bool:
        """Return whether a side changed a thing (`owner`: its key) in more than its position."""
        now = self._sides[side]
        return any(
            not is_same(self._base.get(place, UNSET), now.get(place, UNSET))
            for place in self._owners[owner]
            if not is_place_of_card(place) and not _is_order(place)
        )

    def _choose_sides_of_arrows(self, actions: Iterable[str]) -> None:
        """Choose the side of each arrow of the given actions, which one side removed: the side that
        was chosen for the action at its end. Where both ends were, an action that stays decides."""
        whole = {action: self._whole[action] for action in actions if action in self._whole}
        stays = {action for action, side in whole.items() if action in self._there[side]}
        for action in sorted(whole, key=lambda each: (each not in stays, each)):
            for arrow in self._arrows.get(action, ()):
                self._whole.setdefault(arrow, whole[action])

    # --- key by key -------------------------------------------------------------------------------

    def _take(self, places: Iterable[Place], side: Side) -> None:
        values = self._sides[side]
        self._result.update({place: values[place] for place in places if place in values})

    def _choose(self, place: Place, owner: str) -> None:
        values = [side.get(place, UNSET) for side in (self._base, *self._sides.values())]
        side = chosen(*values)
        if side is None:
            side = self._asked(place, owner)
        self._take([place], side)

    def _asked(self, place: Place, owner: str) -> Side:
        if is_place_of_card(place) or _is_order(place):
            return "ours"
        name = "/".join(place)
        self._conflicts.append(FoundConflict(name, owner, key=place))
        return self._choices.get(name, "ours")

    def _join(self, place: Place) -> None:
        """Merge an ordered list of names at `place` (root map and key): the list of the side
        "ours", without the names that the other side removed, and with the names that it added at
        the end."""
        values = [side.get(place, UNSET) for side in (self._base, *self._sides.values())]
        if (side := chosen(*values)) is not None:
            self._take([place], side)
            return
        lists = [[] if value is UNSET else text_list(value) for value in values]
        if any(each is None for each in lists):
            self._take([place], "ours")
            return
        was, ours, theirs = ([] if each is None else each for each in lists)
        root, head = place

        def stays(name: str) -> bool:
            return (root, f"{head}/{name}") in self._result

        names = [name for name in ours if name in theirs or name not in was or stays(name)]
        names += [name for name in theirs if name not in was and name not in names]
        if names == ours:
            self._take([place], "ours")
        elif names:
            self._result[place] = msgspec.json.encode(names).decode()

    # --- arrows without ends -----------------------------------------------------------------------

    def _drop(self, arrows: Iterable[str]) -> None:
        """Remove arrows that would have lost an end by the merge; arrows without an end that the
        side "ours" had before stay."""
        alive = exist(self._result) | _ENDS
        ours, there = self._sides["ours"], self._there["ours"]
        for arrow in arrows:
            ends = ends_of(arrow)
            if ends is None or alive.issuperset(ends[:2]):
                continue
            places = self._owners[arrow]
            was_so = arrow in there and not (there | _ENDS).issuperset(ends[:2])
            for place in places:
                self._result.pop(place, None)
            if was_so:
                self._result.update({place: ours[place] for place in places if place in ours})


def _is_order(place: Place) -> bool:
    return place[1].partition("|")[2] in _ORDERS


def _is_list(place: Place) -> bool:
    root, key = place
    return root in {"actions", "relations"} and key.partition("|")[2] in _LISTS
