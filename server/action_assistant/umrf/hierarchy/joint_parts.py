"""Values and helpers for the place of a sub-graph: the arrows that join it, and the reasons against
them.

See docs/umrf-and-the-engine.md 2.7.
"""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from action_assistant.umrf.files.writing import name_order
from action_assistant.umrf.hierarchy.reasons import FlatteningCode
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    Action,
    Graph,
    Key,
    Parameter,
    Precondition,
    Relation,
    Remap,
)
from action_assistant.umrf.semantics.values import RemapUnknown, renamed, slots_of


class JoinRefused(Exception):
    """Raised when no arrow in a flat graph does the same as one of the sub-graph's action."""

    def __init__(self, code: FlatteningCode, message: str) -> None:
        super().__init__(message)
        self.code = code
        self.message = message


def refuse(code: FlatteningCode, message: str) -> None:
    """Raise `JoinRefused` with this code and message: a flat graph would not do the same."""
    raise JoinRefused(code, message)


class JoinedArrow(NamedTuple):
    """An arrow into or out of a sub-graph. `instead`: the arrow of the outer graph that it
    replaces; `place`: its number among the replacements of that arrow."""

    relation: Relation
    instead: Relation
    place: int


class SubGraphPlace(NamedTuple):
    """A sub-graph `inside`, its `action`, and the graph `around`, in which other sub-graphs are
    inlined already.

    `given`: inputs that `around` gets from its own outer graph. `lacks`: an input can be missing
    when the action's parents have all ended. `bypassed`: outcomes by which the action can be
    bypassed.
    """

    around: Graph
    action: Action
    inside: Graph
    given: frozenset[str]
    lacks: bool
    bypassed: frozenset[Precondition]


class JoinedPlace(NamedTuple):
    """The arrows that join a sub-graph. `entries`: its entry actions with the values that they
    get."""

    into: tuple[JoinedArrow, ...]
    out: tuple[JoinedArrow, ...]
    entries: Mapping[Key, Action]


def in_order(relations: Collection[Relation], *, by_parent: bool) -> list[Relation]:
    """Return relations in the order of their parent's children, or of their child's parents."""
    ordered = sorted(relations, key=name_order)
    return sorted(ordered, key=lambda r: r.parent_order if by_parent else r.child_order)


def ends_of(graph: Graph) -> tuple[list[Relation], list[Relation]]:
    """Return the relations of a graph at the entry, and those at the exit, in order."""
    entries = [r for r in graph.relations if r.parent == ENTRY]
    exits = [r for r in graph.relations if r.child == EXIT]
    return in_order(entries, by_parent=True), in_order(exits, by_parent=False)


def renaming(
    outputs: Collection[str],
    inputs: Collection[str],
    wanted: Mapping[str, str],
    usual: tuple[Remap, ...],
) -> tuple[Remap, ...]:
    """Return renamings by which exactly the inputs in `wanted` get exactly the outputs that it
    names for them. `usual`: renamings to try first. Raise `JoinRefused` if no renamings do. The
    engine renames inside a sorted tree, so each candidate is tried (docs/umrf-and-the-engine.md
    2.7)."""
    least = tuple(Remap(source, name) for name, source in sorted(wanted.items()) if source != name)
    for remap in ((), usual, least):
        sources = {each.source for each in remap}
        fits = len(sources) == len(remap) and sources <= set(outputs)
        if fits and renamed(outputs, remap, inputs) == wanted:
            return remap
    raise JoinRefused(
        "renaming", "No renaming hands over exactly the values that go through the sub-graph."
    )


def renamed_or_refused(
    outputs: Collection[str], remap: tuple[Remap, ...], inputs: Collection[str]
) -> dict[str, str]:
    """Return, by input, the output that reaches it through the renamings `remap`
    (`values.renamed`). Raise `JoinRefused` for an unknown output."""
    try:
        return renamed(outputs, remap, inputs)
    except RemapUnknown as unknown:
        message = f"An output is renamed that does not exist: “{unknown}”."
        raise JoinRefused("renaming", message) from None


def outputs_within(graph: Graph, parent: Key) -> Collection[str]:
    return names_of(next(a for a in graph.actions if a.key == parent).outputs)


def names_of(parameters: Sequence[Parameter]) -> Collection[str]:
    return slots_of(parameters).keys()


def merged_extra(
    outer: tuple[tuple[str, str], ...], inner: tuple[tuple[str, str], ...]
) -> tuple[tuple[str, str], ...]:
    known = {field for field, _ in outer}
    return (*outer, *(each for each in inner if each[0] not in known))


def leads_to(graph: Graph, start: Key, goal: Key) -> bool:
    """Return whether a path of arrows leads from the action `start` to the action `goal`; to itself
    only by a loop."""
    children: dict[Key, list[Key]] = {}
    for relation in graph.relations:
        children.setdefault(relation.parent, []).append(relation.child)
    seen: set[Key] = set()
    stack = list(children.get(start, ()))
    while stack:
        key = stack.pop()
        if key == goal:
            return True
        if key not in seen:
            seen.add(key)
            stack += children.get(key, ())
    return False
