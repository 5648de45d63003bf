"""Compares two graphs with the same actions by what makes a difference to their courses.

See docs/umrf-and-the-engine.md 2.3 and 2.7, and docs/decisions/072-make-and-unpack-a-sub-graph.md.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

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
    """Yield the differences of `other` from `graph`. Both have the same keys."""
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
    """Return the effects of arrows by parent and child.

    An arrow that is not required and has no response has no effect; whether a child waits for its
    only parent makes no difference.
    """
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
