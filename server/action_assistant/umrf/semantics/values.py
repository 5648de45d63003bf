"""Parameters at run time: the values that actions hold, and the values that a parent hands to a
child.

See docs/umrf-and-the-engine.md 2.7.
"""

from collections.abc import Collection, Iterable, Sequence
from functools import lru_cache
from typing import Any, Final

import msgspec

from action_assistant.umrf.json.text import Json, Number, parse_small
from action_assistant.umrf.model import Parameter, Remap
from action_assistant.umrf.parameters import flat_name

NEUTRAL: Final[dict[str, Any]] = {
    "string": "", "strings": [], "number": 0.0, "numbers": [], "bool": False, "bools": [],
}  # fmt: skip
_CHECKED: Final = {"string", "number", "bool"}


class Opaque(msgspec.Struct, frozen=True):
    """A value of a type that is not native to the engine, so that only the actions know what it
    holds."""

    type: str


class Missing:
    """The value that stands for no value; `MISSING` is its only instance."""

    def __repr__(self) -> str:
        return "no value"


MISSING: Final = Missing()


class Slot:
    """One input or output of an action while its graph runs, with its current value."""

    __slots__ = ("allowed", "name", "own", "received", "required", "type", "updatable", "value")

    def __init__(self, name: str, leaf: dict[str, Json]) -> None:
        kind = leaf.get("pvf_type")
        allowed = leaf.get("pvf_allowed_values")
        self.name = name
        self.type = kind if isinstance(kind, str) else ""
        self.own: Any = plain(leaf["pvf_value"]) if "pvf_value" in leaf else MISSING
        self.value: Any = self.own
        self.required = leaf.get("pvf_required") is not False
        self.updatable = leaf.get("pvf_updatable") is not False
        listed = allowed if isinstance(allowed, list) else [] if allowed is None else [allowed]
        self.allowed = [plain(value) for value in listed]
        self.received = False

    def has_value(self) -> bool:
        """Return whether the parameter holds a value now."""
        return self.value is not MISSING

    def default(self) -> Any:
        """Return the value that an output gets if its action gives none: the value of the file,
        else the first allowed value, else the neutral value of the type.

        Generated packages begin with the same value.
        """
        if self.own is not MISSING:
            return self.own
        return self.allowed[0] if self.allowed else NEUTRAL.get(self.type, Opaque(self.type))

    def receive(self, kind: str, value: Any) -> None:
        """Take a value of type `kind` from a parent, unless the types differ, the slot is locked,
        or the value is not among the allowed ones."""
        if value is MISSING or kind != self.type or not self.updatable:
            return
        if self.allowed and kind in _CHECKED and value not in self.allowed:
            return
        self.value = value
        self.received = True

    def clear(self) -> None:
        """Drop the value, as the engine does with the outputs of an action that has ended."""
        self.value = MISSING

    def end_of_run(self) -> None:
        """Clear the value if it came from a parent. The value of the file does not return."""
        if self.received:
            self.value = MISSING
            self.received = False


class RemapUnknown(Exception):
    """Raised for a renaming whose source is not found among the parent's outputs; the engine aborts
    in this case."""


def slots_of(parameters: Iterable[Parameter]) -> dict[str, Slot]:
    """Return one slot for each of these parameters (inputs or outputs of an action), by flat name
    and sorted as in the engine. Parameters without a `pvf_type` have none."""
    found: dict[str, Slot] = {}
    for parameter in parameters:
        leaf = parse_small(parameter.text)
        if isinstance(leaf, dict) and "pvf_type" in leaf:
            name = flat_name(parameter.path)
            found.setdefault(name, Slot(name, leaf))
    return dict(sorted(found.items()))


def fill_outputs(outputs: dict[str, Slot], given: dict[str, Any] | None) -> None:
    """Set the outputs of an action that has run. Each gets its value in `given` (by flat name), or
    its default if `given` is None or has none."""
    for name, slot in outputs.items():
        value = (given or {}).get(name)
        if value is None:
            value = slot.default()
        slot.value = float(value) if type(value) is int else value


def hand_over(outputs: dict[str, Slot], remap: Sequence[Remap], inputs: dict[str, Slot]) -> None:
    """Copy a parent's outputs into the child's inputs: `remap` renames outputs first, then equal
    names meet.

    Raises `RemapUnknown` if a renamed output is not found.
    """
    for name, place in renamed(outputs, remap, inputs).items():
        source = outputs[place]
        inputs[name].receive(source.type, source.value)


def renamed(
    outputs: Collection[str], remap: Sequence[Remap], inputs: Collection[str]
) -> dict[str, str]:
    """Return which output of the parent each input of the child gets its value from: input name →
    output name. Inputs that get no value are missing. The outputs are renamed by `remap`, one
    rename after the other. The result imitates a fault of the engine: it renames within a sorted
    tree without restoring the order, and afterwards fails to find some of the other outputs. Raise
    `RemapUnknown` if the output to be renamed is not found."""
    if not remap:
        fewer, more = sorted((inputs, outputs), key=len)
        return {name: name for name in fewer if name in more}
    own = sorted(outputs)
    names, shape = list(own), _shape(len(own))
    for rename in remap:
        place = shape.find(names, rename.source)
        if place is None:
            raise RemapUnknown(rename.source)
        names[place] = rename.target
    places = {name: shape.find(names, name) for name in dict.fromkeys(names) if name in inputs}
    return {name: own[place] for name, place in places.items() if place is not None}


def plain(value: Json) -> Any:
    """Return a JSON value with its numbers as doubles."""
    match value:
        case Number():
            return value.value
        case list():
            return [plain(member) for member in value]
        case dict():
            return {key: plain(member) for key, member in value.items()}
        case _:
            return value


class _Tree:
    """The shape of a red-black tree into which sorted names were inserted one by one, like
    `std::set`.

    The shape depends only on how many names there are.
    """

    def __init__(self, count: int) -> None:
        self.left: list[int | None] = [None] * count
        self.right: list[int | None] = [None] * count
        self.parent: list[int | None] = [None] * count
        self.red = [True] * count
        self.root: int | None = None
        for index in range(count):
            self._insert_greatest(index)

    def find(self, names: Sequence[str], name: str) -> int | None:
        """Search the tree as if the names were still sorted, and return the index of `name` among
        `names`; None if this search does not find it."""
        place, best = self.root, None
        while place is not None:
            if names[place] < name:
                place = self.right[place]
            else:
                best, place = place, self.left[place]
        return best if best is not None and not name < names[best] else None

    def _insert_greatest(self, new: int) -> None:
        above = new - 1 if new else None
        self.parent[new] = above
        if above is None:
            self.root = new
        else:
            self.right[above] = new
        while (above := self.parent[new]) is not None and self.red[above]:
            top = self.parent[above]
            assert top is not None
            uncle = self.left[top]
            if uncle is not None and self.red[uncle]:
                self.red[above] = self.red[uncle] = False
                self.red[top] = True
                new = top
            else:
                self.red[above], self.red[top] = False, True
                self._turn_left(top)
        assert self.root is not None
        self.red[self.root] = False

    def _turn_left(self, top: int) -> None:
        up = self.right[top]
        assert up is not None
        inner, above = self.left[up], self.parent[top]
        self.right[top] = inner
        if inner is not None:
            self.parent[inner] = top
        self.parent[up] = above
        if above is None:
            self.root = up
        else:
            self.right[above] = up
        self.left[up] = top
        self.parent[top] = up


@lru_cache(maxsize=64)
def _shape(count: int) -> _Tree:
    return _Tree(count)
