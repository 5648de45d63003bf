"""The actions of one sub-graph put in the place of the action that stands for it: one step of `flattening`.

See docs/decisions/072-make-and-unpack-a-sub-graph.md.
"""

from collections.abc import Iterator
from typing import TypeAlias

import msgspec
from msgspec.structs import replace

from action_assistant.umrf.hierarchy.flattening import Flattened, flattened
from action_assistant.umrf.hierarchy.inlining import identity, inlined, under_keys
from action_assistant.umrf.hierarchy.joint_parts import JoinedPlace, SubGraphPlace
from action_assistant.umrf.hierarchy.joints import joined
from action_assistant.umrf.hierarchy.reasons import FlatteningReason, HierarchyLevel
from action_assistant.umrf.model import Action, Graph, Key


class Unpacked(msgspec.Struct, frozen=True, tag="unpacked", tag_field="kind"):
    """The graph with the actions `keys` in place of one action.

    `differences`: ways in which it may behave differently; if empty, it behaves the same.
    `left_out`: fields of the replaced action that are lost.
    """

    graph: Graph
    keys: tuple[Key, ...]
    differences: tuple[FlatteningReason, ...] = ()
    left_out: tuple[str, ...] = ()


class Unpackable(msgspec.Struct, frozen=True, tag="unpackable", tag_field="kind"):
    """All reasons found for which no arrows of a flat graph do the same as the arrows of the
    action."""

    reasons: tuple[FlatteningReason, ...]


Unpacking: TypeAlias = Unpacked | Unpackable


def unpacked(graph: Graph, key: Key, inside: Graph) -> Unpacking:
    """Return the graph with the actions of `inside` in the place of the action `key`. Other
    sub-graphs stay as they are.

    New actions keep the keys that they have inside, so that an action which was extracted and
    unpacked again is the same. Where a key is taken, the new one follows from the existing ones.
    """
    action = next(a for a in graph.actions if a.key == key)
    reasons = tuple(dict.fromkeys(_differences(graph, action, inside)))
    if not inside.actions or any(reason.code == "signature" for reason in reasons):
        empty = FlatteningReason("signature", "No action is in it.", _at(graph, action))
        return Unpackable(reasons or (empty,))
    place = joined(SubGraphPlace(graph, action, inside, frozenset(), False, frozenset()))
    if not isinstance(place, JoinedPlace):
        against = (FlatteningReason(each.code, each.message, _at(graph, action)) for each in place)
        return Unpackable(tuple(dict.fromkeys((*against, *reasons))))
    kept = {a.full_name for a in graph.actions if a.key != key}
    found = inlined(graph, key, inside, place, kept, room="needed")
    taken = {a.key for a in graph.actions}
    fresh: dict[Key, Key] = {}
    for old, new in found.keys.items():
        fresh[new] = identity((key, old), taken) if old in taken else old
        taken.add(fresh[new])
    left = (["description"] if action.description else []) + [name for name, _ in action.extra]
    return Unpacked(under_keys(found.graph, fresh), tuple(fresh.values()), reasons, tuple(left))


def _at(graph: Graph, action: Action) -> tuple[HierarchyLevel, ...]:
    return (HierarchyLevel(graph.name, action.key, action.full_name),)


def _differences(graph: Graph, action: Action, inside: Graph) -> Iterator[FlatteningReason]:
    """Yield the reasons why the graph may behave differently once the sub-graph `inside` is
    unpacked in place of `action`. All other sub-graphs are taken to stay as they are."""
    name = _unused(graph, inside)
    alone = tuple(replace(a, name=name) if a.key == action.key else a for a in graph.actions)
    found = flattened(replace(graph, actions=alone), {name: replace(inside, name=name)})
    if isinstance(found, Flattened):
        return
    for reason in found.reasons:
        yield replace(
            reason,
            message=reason.message.replace(name, action.name),
            at=tuple(
                HierarchyLevel(
                    level.graph.replace(name, inside.name),
                    level.key,
                    level.action.replace(name, action.name),
                )
                for level in reason.at
            ),
        )


def _unused(*graphs: Graph) -> str:
    """Return a name that no action has."""
    taken = "\n".join(action.name for graph in graphs for action in graph.actions)
    name = "Unpacked"
    while name in taken:
        name += "_"
    return name
