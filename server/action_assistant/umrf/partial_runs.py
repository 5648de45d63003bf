"""Runs of a part of a graph: from some actions on, or only some actions.

A partial run plays a graph of its own, which is derived from the whole one. The actions outside of
the part are left out, and so are all arrows from them: what they would have reported counts as
reported, and values that they would have given become literals, if an earlier run knows them. So
such a graph is checked, sent and proven like any other. Pure.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Final

import msgspec

from action_assistant.umrf.json.text import dump, parse_small
from action_assistant.umrf.kept_values import as_json, takes
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    PRECONDITIONS,
    Action,
    Conditions,
    Graph,
    Key,
    Parameter,
    Precondition,
    Relation,
)
from action_assistant.umrf.parameters import NATIVE, fits, flat_name
from action_assistant.umrf.semantics.values import RemapUnknown, renamed, slots_of

#: The last actions of a part end it, whatever their outcome.
_ENDS: Final = Conditions(on_true="run", on_false="run", on_error="run")


class KnownOutcome(msgspec.Struct, frozen=True):
    """The newest outcome of an action in an earlier run. `at`: µs UTC; `outputs`: the values that it
    gave, by flat name."""

    outcome: Precondition
    at: int
    outputs: dict[str, Any] = {}


class AssumedOutcome(msgspec.Struct, frozen=True, omit_defaults=True):
    """An action that counts as ended although this run does not play it. `outcome`: that of the
    earlier run, "" if no run has one; `at`: when it came, in µs UTC; `by`: the person who stated it,
    "" if a robot or the simulator showed it."""

    action: str
    outcome: Precondition | str = ""
    at: int | None = None
    by: str = ""


class AssumedValue(msgspec.Struct, frozen=True, omit_defaults=True):
    """A value of an earlier run that an input begins with. `action`, `name`: the full and flat name of
    the input; `source`: the action that gave it, at `at` (µs UTC); `text`: the value as JSON."""

    action: str
    name: str
    source: str
    text: str
    at: int


class EndedBy(msgspec.Struct, frozen=True):
    """An action that an arrow of another one would stop, which is left out. Both by full name."""

    action: str
    by: str


class PartialGraph(msgspec.Struct, frozen=True, kw_only=True):
    """The graph of a partial run, and what it assumes. `begins`: the actions with which it begins, and
    `skipped`: those that it leaves out, by full name in the order of the file; `ended_by`: what would be
    stopped by one of these."""

    graph: Graph
    begins: tuple[str, ...]
    assumed: tuple[AssumedOutcome, ...] = ()
    values: tuple[AssumedValue, ...] = ()
    skipped: tuple[str, ...] = ()
    ended_by: tuple[EndedBy, ...] = ()


class NoPart(ValueError):
    """There is no such part of the graph."""


def partial_graph(
    graph: Graph, at: Sequence[str], known: Mapping[str, KnownOutcome], *, only: bool = False
) -> PartialGraph:
    """Return the graph of a run that begins with the actions `at` (full names) and plays all that may
    follow, or `only` these. `known`: the outcomes of an earlier run, by full name. Raise NoPart if an
    action is not there, or if none of them is the first."""
    actions = {each.key: each for each in graph.actions if not each.missing and not each.twin}
    keys = {each.full_name: key for key, each in actions.items()}
    for name in at:
        if name not in keys:
            raise NoPart(f"The graph has no action {name}.")
    named = dict.fromkeys(keys[name] for name in at)
    played = set(named) if only else _downstream(graph, named, actions)
    begins = _first_of(graph, list(named)) if only else list(named)
    order = [key for key in actions if key in played]
    relations = [*_entries(begins), *_kept(graph, played, frozenset(begins))]
    relations += _exits(relations, order, is_cut=only)
    arrows = list(_cut(graph, actions, played, frozenset(begins)))
    inner = [each for each in arrows if each.child != EXIT]
    values = _values(inner, actions, known)
    part = tuple(_with_literals(actions[key], values) for key in order)
    return PartialGraph(
        graph=msgspec.structs.replace(graph, actions=part, relations=tuple(relations)),
        begins=tuple(actions[key].full_name for key in begins),
        assumed=_assumed(inner if only else arrows, actions, known),
        values=tuple(values.values()),
        skipped=tuple(each.full_name for key, each in actions.items() if key not in played),
        ended_by=_ended_by(graph, actions, played),
    )


def _downstream(graph: Graph, begins: Collection[Key], actions: Collection[Key]) -> set[Key]:
    """Return the keys of these actions and of all to which arrows lead from them."""
    arrows = [each for each in graph.relations if each.child in actions]
    return _reached(arrows, begins, EXIT)


def _first_of(graph: Graph, chosen: Sequence[Key]) -> list[Key]:
    """Return those of the chosen actions to which no other chosen one leads; in a loop, those to which
    something leads from outside. Raise NoPart if there are none."""
    others = set(chosen)
    into = [each for each in graph.relations if each.child in others and each.parent != each.child]
    inner = {each.child for each in into if each.parent in others}
    outer = {each.child for each in into if each.parent not in others}
    found = [each for each in chosen if each not in inner] or [e for e in chosen if e in outer]
    if not found:
        raise NoPart("None of these actions is the first: say where to begin.")
    return found


def _entries(begins: Sequence[Key]) -> list[Relation]:
    return [
        Relation(parent=ENTRY, child=key, conditions=ENTRY_CONDITIONS, parent_order=float(number))
        for number, key in enumerate(begins)
    ]


def _kept(graph: Graph, played: Collection[Key], begins: Collection[Key]) -> Iterator[Relation]:
    """Yield the arrows within a part. What an action waits for has been reported, if it begins the part
    or nothing but that action leads there."""
    inner = [
        each
        for each in graph.relations
        if each.parent in played and (each.child in played or each.child == EXIT)
    ]
    before: dict[Key, set[Key]] = {}
    for each in inner:
        child = each.child
        if child == EXIT or not each.required:
            yield each
        else:
            if child not in before:
                before[child] = _reached(inner, begins, child)
            is_known = child in begins or each.parent not in before[child]
            yield msgspec.structs.replace(each, required=not is_known)


def _reached(arrows: Sequence[Relation], begins: Collection[Key], without: Key) -> set[Key]:
    """Return the actions to which arrows lead from those that begin, not through one action."""
    after: dict[Key, list[Key]] = {}
    for each in arrows:
        after.setdefault(each.parent, []).append(each.child)
    found = set(begins) - {without}
    left = list(found)
    while left:
        for child in after.get(left.pop(), ()):
            if child != without and child not in found:
                found.add(child)
                left.append(child)
    return found


def _exits(relations: Sequence[Relation], order: Sequence[Key], *, is_cut: bool) -> list[Relation]:
    """Return arrows to the exit from the actions after which nothing of the part follows, if it is cut
    off, or has no arrow there."""
    if not is_cut and any(each.child == EXIT for each in relations):
        return []
    followed = {each.parent for each in relations if each.parent != each.child}
    last = [key for key in order if key not in followed]
    return [
        Relation(parent=key, child=EXIT, conditions=_ENDS, child_order=float(number))
        for number, key in enumerate(last, len(relations))
    ]


def _cut(
    graph: Graph, actions: Mapping[Key, Action], played: Collection[Key], begins: Collection[Key]
) -> Iterator[Relation]:
    """Yield the arrows that count as taken: those into the actions that begin the part, and those from
    outside of it, also to the exit."""
    for each in graph.relations:
        if each.parent not in actions or each.parent == each.child:
            continue
        is_outside = each.parent not in played
        if each.child in begins or (is_outside and (each.child in played or each.child == EXIT)):
            yield each


def _is_stop(relation: Relation) -> bool:
    """Return whether an arrow can do nothing but stop or pause its child."""
    answers = {relation.conditions.answer(outcome) for outcome in PRECONDITIONS} - {"ignore"}
    return bool(answers) and answers <= {"stop", "pause"}


def _assumed(
    arrows: Sequence[Relation], actions: Mapping[Key, Action], known: Mapping[str, KnownOutcome]
) -> tuple[AssumedOutcome, ...]:
    parents = {each.parent for each in arrows if not _is_stop(each)}
    found: list[AssumedOutcome] = []
    for key, each in actions.items():
        if key in parents:
            before = known.get(each.full_name)
            found.append(
                AssumedOutcome(each.full_name)
                if before is None
                else AssumedOutcome(each.full_name, before.outcome, before.at)
            )
    return tuple(found)


def _values(
    arrows: Sequence[Relation], actions: Mapping[Key, Action], known: Mapping[str, KnownOutcome]
) -> dict[tuple[Key, str], AssumedValue]:
    """Return the newest value that arrows would have brought, by key of the action and flat name of
    its input."""
    found: dict[tuple[Key, str], AssumedValue] = {}
    for arrow in arrows:
        parent, child = actions[arrow.parent], actions[arrow.child]
        before = known.get(parent.full_name)
        if before is None or not takes(arrow, (before.outcome,)):
            continue
        outputs, inputs = slots_of(parent.outputs), slots_of(child.inputs)
        try:
            given = renamed(outputs, arrow.remap, inputs)
        except RemapUnknown:
            continue  # a problem of the graph itself
        for name, output in given.items():
            slot, value = inputs[name], before.outputs.get(output)
            is_taken = slot.updatable and slot.type in NATIVE and slot.type == outputs[output].type
            if value is None or not is_taken or not fits(slot.type, value):
                continue
            if slot.allowed and slot.type[-1] != "s" and value not in slot.allowed:
                continue
            older = found.get((child.key, name))
            if older is None or older.at <= before.at:
                text = as_json(value)
                found[child.key, name] = AssumedValue(
                    child.full_name, name, parent.full_name, text, before.at
                )
    return found


def _with_literals(action: Action, values: Mapping[tuple[Key, str], AssumedValue]) -> Action:
    if not any(key == action.key for key, _ in values):
        return action
    inputs = tuple(_literal(each, action.key, values) for each in action.inputs)
    return msgspec.structs.replace(action, inputs=inputs)


def _literal(
    parameter: Parameter, key: Key, values: Mapping[tuple[Key, str], AssumedValue]
) -> Parameter:
    value = values.get((key, flat_name(parameter.path)))
    leaf = parse_small(parameter.text)
    if value is None or not isinstance(leaf, dict) or "pvf_type" not in leaf:
        return parameter
    return Parameter(parameter.path, dump({**leaf, "pvf_value": parse_small(value.text)}))


def _ended_by(
    graph: Graph, actions: Mapping[Key, Action], played: Collection[Key]
) -> tuple[EndedBy, ...]:
    return tuple(
        dict.fromkeys(
            EndedBy(actions[each.child].full_name, actions[each.parent].full_name)
            for each in graph.relations
            if each.child in played
            and each.parent in actions
            and each.parent not in played
            and "stop" in map(each.conditions.answer, PRECONDITIONS)
        )
    )
