"""Makes some actions of a graph a graph of their own, with one action in their place.

`extracted` returns the two graphs with all differences in their behaviour, or every reason for
which there are none. The two graphs behave alike if, made flat again (`flattening`), they are the
original graph: flattening proves what the two do, and `behaviour_differences` that nothing was lost.

See docs/decisions/072-make-and-unpack-a-sub-graph.md.
"""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from typing import Final, NamedTuple, TypeAlias

import msgspec
from msgspec.structs import replace

from action_assistant.umrf.hierarchy.cutting import (
    CutGraphs,
    CutPlan,
    Selection,
    between,
    cut,
    selection_of,
    ways_in_differ,
    ways_out_differ,
)
from action_assistant.umrf.hierarchy.flattening import Flattened, flattened
from action_assistant.umrf.hierarchy.inlining import identity, inlined, under_keys
from action_assistant.umrf.hierarchy.joint_parts import JoinedPlace, SubGraphPlace
from action_assistant.umrf.hierarchy.joints import joined
from action_assistant.umrf.hierarchy.reasons import FlatteningReason, HierarchyLevel
from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    PRECONDITIONS,
    Action,
    Conditions,
    Graph,
    Key,
    Parameter,
    Relation,
)
from action_assistant.umrf.semantics.parts import exit_inputs, exit_owner
from action_assistant.umrf.semantics.values import RemapUnknown, renamed, slots_of

_NAMES: Final = {ENTRY: "the entry", EXIT: "the exit"}
#: Names that no action can have: the engine takes them for the ends of a graph.
_RESERVED: Final = frozenset({"graph_entry", "graph_exit"})


class BehaviourDifference(NamedTuple):
    """One difference in behaviour. `about`: the action that it concerns, None for the graph."""

    about: Key | None
    message: str


class _ArrowMeaning(NamedTuple):
    """The effect of an arrow. `values`: the outputs that it hands over, by input name."""

    conditions: Conditions | None
    required: bool
    values: Mapping[str, str] | tuple[object, ...]


def behaviour_differences(graph: Graph, other: Graph) -> Iterator[BehaviourDifference]:
    """Yield each way in which `other` would behave differently from `graph`: changed actions,
    arrows and ends. Positions and descriptions do not count. The same action has the same key in
    both."""
    names = {a.key: a.full_name for a in graph.actions} | _NAMES
    mine, theirs = ({a.key: _action(a) for a in each.actions} for each in (graph, other))
    for key in sorted(mine.keys() | theirs.keys()):
        if mine.get(key) != theirs.get(key):
            yield BehaviourDifference(key, f"{names.get(key, key)} itself would change.")
    before, after = _arrows(graph), _arrows(other)
    for pair in sorted(before.keys() | after.keys()):
        parent, child = (names.get(key, key) for key in pair)
        about = pair[1] if pair[1] != EXIT else pair[0]
        match before.get(pair), after.get(pair):
            case None, _:
                yield BehaviourDifference(about, f"{parent} would lead to {child}.")
            case _, None:
                yield BehaviourDifference(about, f"{parent} would no longer lead to {child}.")
            case (_ArrowMeaning() as one, _ArrowMeaning() as two) if one != two:
                yield BehaviourDifference(about, _otherwise(one, two, parent, child))
    ends = exit_owner(graph), exit_owner(other)
    if len({end.key if end is not None else "" for end in ends}) > 1:
        yield BehaviourDifference(None, "The exit would wait for the outputs of another action.")


def _otherwise(one: _ArrowMeaning, two: _ArrowMeaning, parent: str, child: str) -> str:
    if one.values != two.values:
        return f"{parent} would hand other values to {child}."
    if one.conditions != two.conditions:
        return f"{child} would answer differently when {parent} ends."
    return f"{child} would wait differently for {parent}."


def _action(action: Action) -> tuple[object, ...]:
    sides = (action.inputs, action.outputs)
    parameters = [sorted(map(_parameter, side), key=lambda pair: pair[0]) for side in sides]
    return action.full_name, action.type, action.actor, action.missing, parameters


def _parameter(parameter: Parameter) -> tuple[str, object]:
    return parameter.path, parse_small(parameter.text)


def _arrows(graph: Graph) -> dict[tuple[Key, Key], _ArrowMeaning]:
    """Return the effects of arrows by parent and child. An arrow that is not required and ignores
    every outcome has no effect and is missing; whether a child waits for its only parent makes no
    difference."""
    relations = [r for r in graph.relations if not _is_idle(r)]
    parents = Counter(r.child for r in relations)
    by_key = {action.key: action for action in graph.actions}
    ends = exit_inputs(graph)
    found: dict[tuple[Key, Key], _ArrowMeaning] = {}
    for relation in relations:
        inputs = ends if relation.child == EXIT else {}
        if (child := by_key.get(relation.child)) is not None:
            inputs = slots_of(child.inputs)
        parent = by_key.get(relation.parent)
        outputs = {} if parent is None else slots_of(parent.outputs)
        found[relation.parent, relation.child] = _ArrowMeaning(
            None if relation.parent == ENTRY else relation.conditions,
            relation.required or parents[relation.child] == 1,
            _values(relation, outputs, inputs),
        )
    return found


def _is_idle(relation: Relation) -> bool:
    answers = {relation.conditions.answer(outcome) for outcome in PRECONDITIONS}
    return relation.parent != ENTRY and not relation.required and answers == {"ignore"}


def _values(
    relation: Relation, outputs: Mapping[str, object], inputs: Mapping[str, object]
) -> Mapping[str, str] | tuple[object, ...]:
    if relation.parent == ENTRY:
        return relation.remap  # the values from outside are not known here
    if all(relation.conditions.answer(end) in ("ignore", "bypass") for end in PRECONDITIONS):
        return ()
    try:
        return renamed(
            list(outputs), () if relation.child == EXIT else relation.remap, list(inputs)
        )
    except RemapUnknown:
        return relation.remap


class Extracted(msgspec.Struct, frozen=True, tag="extracted", tag_field="kind"):
    """The new graph `inner`, and the old one, `outer`, in which the action `key` stands for it.
    `differences`: ways in which the two may behave differently from the old graph; if empty,
    they behave the same."""

    inner: Graph
    outer: Graph
    key: Key
    differences: tuple[FlatteningReason, ...] = ()


class Unextractable(msgspec.Struct, frozen=True, tag="unextractable", tag_field="kind"):
    """The reasons for which no sub-graph can be made of the chosen actions: all that were found."""

    reasons: tuple[FlatteningReason, ...]


Extraction: TypeAlias = Extracted | Unextractable


def extracted(
    graph: Graph, chosen: Collection[Key], name: str, key: Key, *, budget: int | None = None
) -> Extraction:
    """Move the `chosen` actions into a new graph of this name. Return both graphs, or the reasons
    for which that is impossible. `key`: the key of the action that will stand for it. `budget`: the
    most states that are examined for each way to cut, as many as `flattened` does without one."""
    reasons = [*_unfit_names(graph, name), *_unfit(graph, chosen)]
    selection = selection_of(graph, chosen)
    if selection.chosen:
        against = [*ways_in_differ(selection), *ways_out_differ(selection)]
        reasons += [*between(selection), *against] if against else []
    if reasons:
        return Unextractable(tuple(dict.fromkeys(reasons)))
    best: Extracted | None = None
    uncut: tuple[FlatteningReason, ...] = ()
    for plan in _plans(selection):
        found = cut(selection, name, key, plan)
        if not isinstance(found, CutGraphs):
            uncut = uncut or found
            continue
        differences = _differences(graph, found, budget)
        if best is None or len(differences) < len(best.differences):
            best = Extracted(found.inner, found.outer, key, differences)
        if not differences or any(each.code == "undecided" for each in differences):
            break
    return best or Unextractable(tuple(dict.fromkeys(uncut)))


def _unfit_names(graph: Graph, name: str) -> Iterator[FlatteningReason]:
    if not name.strip() or name in _RESERVED:
        yield FlatteningReason("name", "No action can have this name.")
    elif name == graph.name:
        message = "This graph has that name, so an action of that name cannot stand for a graph inside it."
        yield FlatteningReason("name", message)
    elif any(action.name == name for action in graph.actions):
        message = f"“{name}” is an action of this graph; it would stand for the new one."
        yield FlatteningReason("name", message)


def _unfit(graph: Graph, chosen: Collection[Key]) -> Iterator[FlatteningReason]:
    actions = {action.key: action for action in graph.actions}
    if not chosen:
        yield FlatteningReason("selection", "No action is chosen.")
    if not set(chosen) <= actions.keys():
        yield FlatteningReason("selection", "Some of the chosen actions are not there any more.")
    for key in actions:
        if key in chosen and actions[key].missing:
            at = (HierarchyLevel(graph.name, key, actions[key].full_name),)
            yield FlatteningReason("selection", "There is no such action.", at)
    for relation in graph.relations:
        if {relation.parent, relation.child} & set(chosen) and (relation.only or relation.listing):
            key = relation.child if relation.child in chosen else relation.parent
            at = (HierarchyLevel(graph.name, key, actions[key].full_name),)
            message = "An arrow of it is listed by one side only, or is there twice."
            yield FlatteningReason("selection", message, at)


def _plans(selection: Selection) -> Iterator[CutPlan]:
    """Yield ways to cut the selection out, the most promising first."""
    waiting: dict[Key, int] = {}
    for relation in selection.out:
        waiting[relation.child] = waiting.get(relation.child, 0) + relation.required
    if any(count > 1 for count in waiting.values()):
        yield CutPlan(closing=False, all_ends=True)
    yield CutPlan(closing=True, all_ends=False)
    yield CutPlan(closing=False, all_ends=False)


def _differences(
    graph: Graph, found: CutGraphs, budget: int | None
) -> tuple[FlatteningReason, ...]:
    """Return the ways in which the two new graphs (`found`) together may behave differently from
    the old graph; () if none are possible. `budget`: the most states that are examined, None for
    the default."""
    flat = flattened(found.outer, {found.inner.name: found.inner}, budget=budget)
    if not isinstance(flat, Flattened):
        return flat.reasons
    keys = {origin.key: origin.levels[-1].key for origin in flat.origins}
    names = {action.key: action.full_name for action in graph.actions}
    return tuple(
        FlatteningReason(
            "otherwise",
            each.message,
            ()
            if each.about is None
            else (HierarchyLevel(graph.name, each.about, names.get(each.about, "")),),
        )
        for each in behaviour_differences(graph, under_keys(flat.graph, keys))
    )


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
    reasons = tuple(dict.fromkeys(_prevents_unpacking(graph, action, inside)))
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


def _prevents_unpacking(graph: Graph, action: Action, inside: Graph) -> Iterator[FlatteningReason]:
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
    """Return a name that no action in these graphs has."""
    taken = "\n".join(action.name for graph in graphs for action in graph.actions)
    name = "Unpacked"
    while name in taken:
        name += "_"
    return name
