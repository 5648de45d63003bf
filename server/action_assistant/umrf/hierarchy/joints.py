"""Finds the arrows into and out of a sub-graph once its actions stand in the place of its action.

`joined` returns them, or every reason for which no arrows do the same. See
docs/umrf-and-the-engine.md 2.3, 2.6 and 2.7, and docs/decisions/069-flatten.md.
"""

from collections.abc import Collection, Iterator, Sequence
from typing import Final, TypeVar

from msgspec.structs import replace

from action_assistant.umrf.hierarchy.joint_parts import (
    JoinedArrow,
    JoinedPlace,
    JoinRefused,
    SubGraphPlace,
    ends_of,
    in_order,
    leads_to,
    merged_extra,
    names_of,
    outputs_within,
    refuse,
    renamed_or_refused,
    renaming,
)
from action_assistant.umrf.json.text import dump, parse_small
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    OUTCOMES,
    PRECONDITIONS,
    Action,
    Conditions,
    Graph,
    Key,
    Parameter,
    Precondition,
    Relation,
    Remap,
)
from action_assistant.umrf.parameters import flat_name
from action_assistant.umrf.semantics.parts import exit_inputs
from action_assistant.umrf.semantics.values import Slot, slots_of

_TO_EXIT: Final = frozenset({"run", "stop", "pause", "restart", "ignore"})


def ways_out(place: SubGraphPlace, relations: Sequence[Relation]) -> Iterator[JoinedArrow]:
    """Yield the arrows from the ends of a sub-graph (`place`) that replace the arrows `relations`
    of its action. Raise `JoinRefused` if a flat graph cannot do the same."""
    _, exits = ends_of(place.inside)
    kind = _kind(exits)
    _check_outputs(place, exits, kind, relations)
    for relation in relations:
        incoming = [r for r in place.around.relations if r.child == relation.child]
        required = _required(relation, exits, kind, is_only=len(incoming) == 1)
        for number, end in enumerate(exits):
            arrow = replace(
                relation,
                parent=end.parent,
                conditions=_composed(end.conditions, relation.conditions),
                required=required,
                remap=_out_remap(place, end, relation),
                parents_extra=merged_extra(relation.parents_extra, end.parents_extra),
                waypoints=(),
                breakpoint="",
            )
            yield JoinedArrow(arrow, relation, number)


def _kind(exits: Sequence[Relation]) -> str:
    """Return `one` if a single action leads to the exit, `all` if the exit waits for several, `any`
    if it waits for none of them."""
    if len(exits) < 2:
        return "one"
    required = {relation.required for relation in exits}
    if len(required) > 1:
        refuse("exits", "Some of its ways to the exit are required and others are not.")
    if True not in required:
        return "any"
    if any(r.conditions.answer(end) == "bypass" for r in exits for end in OUTCOMES):
        refuse(
            "exits", "Its exit waits for several actions, and a bypass ends it without the others."
        )
    return "all"


def _required(relation: Relation, exits: Sequence[Relation], kind: str, *, is_only: bool) -> bool:
    """Return whether an action after a sub-graph waits for each of the actions that end it.
    `relation`: the arrow to that action; `exits`, `kind`: the arrows to the sub-graph's exit and
    their kind (`_kind`); `is_only`: no other arrow leads to it. Raise `JoinRefused` if a flat graph
    cannot express that."""
    answers = {relation.conditions.answer(end) for end in OUTCOMES}
    if kind == "any":
        if relation.required and not is_only:
            refuse(
                "exits", "What follows waits for it and for others, and it has several ways out."
            )
        return False
    if relation.required and not is_only and _may_go_on(exits):
        refuse("exits", "What follows waits for others too, and an end inside may be no end of it.")
    if kind == "one":
        return relation.required
    if not relation.required and not is_only:
        refuse("exits", "Its exit waits for several actions; what follows does not for it.")
    if not answers <= (_TO_EXIT if relation.child == EXIT else {"run", "ignore"}):
        refuse("exits", "Its exit waits for several actions, and what follows is not run.")
    return True


def _may_go_on(exits: Sequence[Relation]) -> bool:
    """Return whether an action at the exit can end without ending the sub-graph."""
    return any(r.conditions.answer(end) == "ignore" for r in exits for end in OUTCOMES)


def _composed(end: Conditions, following: Conditions) -> Conditions:
    """Return the conditions of an arrow that follows the sub-graph, as conditions of an arrow from
    the action that ends it."""
    answers = {
        outcome: following.answer(outcome) if end.answer(outcome) != "ignore" else "ignore"
        for outcome in PRECONDITIONS
    }
    return Conditions(**answers)


def _check_outputs(
    place: SubGraphPlace, exits: Sequence[Relation], kind: str, following: Sequence[Relation]
) -> None:
    given = exit_inputs(place.inside)
    own = slots_of(place.action.outputs)
    if not given:
        return
    if kind == "all":
        refuse("outputs", "It gives values, and its exit waits for several actions.")
    actions = {action.key: action for action in place.inside.actions}
    for end in exits:
        action = actions[end.parent]
        _check_end(place.inside, end, following)
        for name, slot in slots_of(action.outputs).items():
            if name not in given:
                continue
            pair = given[name], own[name]
            plain = all(s.updatable and not s.allowed for s in (slot, *pair))
            if slot.has_value() or own[name].has_value() or not plain:
                refuse(
                    "outputs", f"The output “{name}” of {action.full_name} is restricted by files."
                )
            if any((s.type, s.required) != (slot.type, slot.required) for s in pair):
                refuse("outputs", f"The output “{name}” of {action.full_name} has two types.")


def _check_end(inside: Graph, end: Relation, following: Sequence[Relation]) -> None:
    """Raise `JoinRefused` if the action that ends a sub-graph (`end`: its arrow to the exit) is
    part of a loop, or can end it without the values of the exit (by a bypass or an error) while a
    following action takes values. `following`: the arrows after the sub-graph."""
    conditions = end.conditions
    empty: list[Precondition] = [o for o in OUTCOMES[:2] if conditions.answer(o) == "bypass"]
    empty += ["on_error"] if conditions.on_error not in ("bypass", "ignore") else []
    if any(r.conditions.answer(o) not in ("ignore", "bypass") for o in empty for r in following):
        refuse(
            "outputs", "It gives values, and can end without them: by a bypass, or with an error."
        )
    if leads_to(inside, end.parent, end.parent):
        refuse("loop", "Who ends it, and gives its values, is part of a loop.")


def _out_remap(place: SubGraphPlace, end: Relation, relation: Relation) -> tuple[Remap, ...]:
    given = exit_inputs(place.inside)
    outputs = outputs_within(place.inside, end.parent)
    own = names_of(place.action.outputs)
    to_exit = renamed_or_refused(outputs, (), given)
    if relation.child == EXIT:
        inputs: Collection[str] = exit_inputs(place.around)
        taken = renamed_or_refused(own, (), inputs)
    else:
        child = next(a for a in place.around.actions if a.key == relation.child)
        inputs = names_of(child.inputs)
        taken = renamed_or_refused(own, relation.remap, inputs)
    wanted = {name: to_exit[source] for name, source in taken.items() if source in to_exit}
    if relation.child == EXIT and renamed_or_refused(outputs, (), inputs) == wanted:
        return ()
    if relation.child == EXIT:
        refuse("renaming", "Who ends it gives values that the graph around it would take.")
    return renaming(outputs, inputs, wanted, relation.remap)


_Part = TypeVar("_Part")


def joined(place: SubGraphPlace) -> JoinedPlace | tuple[JoinRefused, ...]:
    """Return the arrows into and out of a sub-graph's actions that replace those of its action, or
    all reasons against them."""
    relations = place.around.relations
    own = place.action.key
    if any(r.parent == own == r.child for r in relations):
        return (JoinRefused("loop", "It leads to itself."),)
    into = in_order([r for r in relations if r.child == own], by_parent=False)
    out = in_order([r for r in relations if r.parent == own], by_parent=True)
    against = [
        JoinRefused(
            "bypass",
            f"It can be bypassed with {outcome}, which goes on without any of its actions; no chain of "
            "bypasses from its entry to its exit would do the same.",
        )
        for outcome in sorted(place.bypassed)
        if not _lets_through(place.inside, outcome)
    ]
    found = JoinedPlace(
        tuple(_got(_into(place, into), against)),
        tuple(_got(ways_out(place, out), against)),
        dict(_got(_entry_actions(place), against)),
    )
    return tuple(against) or found


def _got(parts: Iterator[_Part], against: list[JoinRefused]) -> Iterator[_Part]:
    try:
        yield from parts
    except JoinRefused as none:
        against.append(none)


def _lets_through(inside: Graph, outcome: Precondition) -> bool:
    """Return whether the actions in `inside` would hand a bypass on like the sub-graph does: if
    its first action is bypassed with `outcome`, a single chain of bypasses leads to the exit, and
    no action runs. False if several actions begin it, or its exit waits for several."""
    entries, exits = ends_of(inside)
    if len(entries) != 1 or (len(exits) > 1 and any(r.required for r in exits)):
        return False
    seen: set[Key] = set()
    key = entries[0].child
    while key not in seen:
        seen.add(key)
        asked = [
            relation
            for relation in inside.relations
            if relation.parent == key and relation.conditions.answer(outcome) != "ignore"
        ]
        if len(asked) != 1:
            return False
        if asked[0].child == EXIT:
            return True
        if asked[0].conditions.answer(outcome) != "bypass":
            return False
        key = asked[0].child
    return False


# Into the sub-graph


def _into(place: SubGraphPlace, relations: Sequence[Relation]) -> Iterator[JoinedArrow]:
    actions = {action.key: action for action in place.inside.actions}
    entries, _ = ends_of(place.inside)
    for relation in relations:
        outputs = _outputs_of(place, relation.parent)
        to_sub = renamed_or_refused(outputs, relation.remap, names_of(place.action.inputs))
        for number, entry in enumerate(entries):
            inputs = slots_of(actions[entry.child].inputs)
            taken = renamed_or_refused(names_of(place.action.inputs), entry.remap, inputs)
            wanted = {name: to_sub[own] for name, own in taken.items() if own in to_sub}
            remap = renaming(outputs, inputs, wanted, relation.remap)
            arrow = replace(
                relation,
                child=entry.child,
                remap=remap,
                children_extra=merged_extra(relation.children_extra, entry.children_extra),
                waypoints=(),
                breakpoint="",
            )
            yield JoinedArrow(arrow, relation, number)


def _entry_actions(place: SubGraphPlace) -> Iterator[tuple[Key, Action]]:
    """Yield the entry actions of the sub-graph by key, with the values that the action which stands
    for it has in the file. Raise `JoinRefused` if an entry action would begin at another time or
    with other values."""
    actions = {action.key: action for action in place.inside.actions}
    own = slots_of(place.action.inputs)
    texts = {flat_name(p.path): p for p in place.action.inputs}
    needed = {name for name, slot in own.items() if slot.required and not slot.has_value()}
    for entry in ends_of(place.inside)[0]:
        action = actions[entry.child]
        slots = slots_of(action.inputs)
        taken = renamed_or_refused(own, entry.remap, slots)
        if place.lacks and not needed <= set(taken.values()):
            refuse(
                "entries",
                f"It can lack an input when all else is there; {action.full_name} in it needs none "
                "of that and would begin.",
            )
        for name, slot in slots.items():
            if slot.required and not slot.has_value() and name not in taken:
                refuse("inputs", f"Nothing gives “{name}” of {action.full_name} a value.")
        for name, source in taken.items():
            _check_same(own[source], slots[name], action)
        if taken and any(
            r.child == action.key != r.parent != ENTRY for r in place.inside.relations
        ):
            refuse(
                "loop",
                f"{action.full_name} begins with values from outside, and arrows lead to it in the "
                "sub-graph as well: these values are gone after its first run.",
            )
        given = {name: texts[source] for name, source in taken.items() if own[source].has_value()}
        inputs = tuple(_with_value(p, given.get(flat_name(p.path))) for p in action.inputs)
        yield action.key, replace(action, inputs=inputs)


def _check_same(outer: Slot, inner: Slot, action: Action) -> None:
    """Raise `JoinRefused` unless an input of the sub-graph's action (`outer`) and the input of the
    entry action (`action`) that it reaches (`inner`) take the same values."""
    place = f"“{outer.name}” and “{inner.name}” of {action.full_name}"
    if inner.has_value():
        refuse("inputs", f"{place}: both have a value in their files.")
    if outer.type != inner.type or outer.required != inner.required:
        refuse("inputs", f"{place} differ in type, or in whether they are required.")
    if not (outer.updatable and inner.updatable) or outer.allowed or inner.allowed:
        refuse("inputs", f"{place} do not take every value.")


def _with_value(parameter: Parameter, given: Parameter | None) -> Parameter:
    leaf = parse_small(parameter.text)
    value = parse_small(given.text) if given is not None else None
    if not isinstance(leaf, dict) or not isinstance(value, dict):
        return parameter
    return Parameter(parameter.path, dump({**leaf, "pvf_value": value["pvf_value"]}))


def _outputs_of(place: SubGraphPlace, parent: Key) -> Collection[str]:
    return place.given if parent == ENTRY else outputs_within(place.around, parent)
