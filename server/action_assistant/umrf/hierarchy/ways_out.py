"""The arrows out of a sub-graph, when its actions stand in its place.

See docs/umrf-and-the-engine.md 2.3 and 2.6, and docs/decisions/069-flatten.md.
"""

from collections.abc import Collection, Iterator, Sequence
from typing import Final

from msgspec.structs import replace

from action_assistant.umrf.hierarchy.joint_parts import (
    JoinedArrow,
    SubGraphPlace,
    ends_of,
    leads_to,
    merged_extra,
    names_of,
    outputs_within,
    refuse,
    renamed_or_refused,
    renaming,
)
from action_assistant.umrf.model import (
    EXIT,
    PRECONDITIONS,
    Conditions,
    Graph,
    Precondition,
    Relation,
    Remap,
)
from action_assistant.umrf.semantics.parts import exit_inputs
from action_assistant.umrf.semantics.values import slots_of

#: How an action ends that nobody stops.
_ENDS: Final[tuple[Precondition, ...]] = ("on_true", "on_false", "on_error")
_TO_EXIT: Final = frozenset({"run", "stop", "pause", "restart", "ignore"})


def ways_out(place: SubGraphPlace, relations: Sequence[Relation]) -> Iterator[JoinedArrow]:
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
            )
            yield JoinedArrow(arrow, relation, number)


def _kind(exits: Sequence[Relation]) -> str:
    """`one` way out, `all` of several, or `any` of them."""
    if len(exits) < 2:
        return "one"
    required = {relation.required for relation in exits}
    if len(required) > 1:
        refuse("exits", "Some of its ways to the exit are required and others are not.")
    if True not in required:
        return "any"
    if any(r.conditions.answer(end) == "bypass" for r in exits for end in _ENDS):
        refuse(
            "exits", "Its exit waits for several actions, and a bypass ends it without the others."
        )
    return "all"


def _required(relation: Relation, exits: Sequence[Relation], kind: str, *, is_only: bool) -> bool:
    """Whether the child of a sub-graph waits for each of those that stand for it."""
    told = {relation.conditions.answer(end) for end in _ENDS}
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
    if not told <= (_TO_EXIT if relation.child == EXIT else {"run", "ignore"}):
        refuse("exits", "Its exit waits for several actions, and what follows is not run.")
    return True


def _may_go_on(exits: Sequence[Relation]) -> bool:
    """Whether an action at the exit can end without that it ends the sub-graph."""
    return any(r.conditions.answer(end) == "ignore" for r in exits for end in _ENDS)


def _composed(end: Conditions, following: Conditions) -> Conditions:
    """What follows the sub-graph, as an answer to the action that ends it."""
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
    """Whoever ends the sub-graph hands over what the exit waits for, or ends it with an error, or in a
    way after which nobody is handed anything."""
    said = end.conditions
    empty: list[Precondition] = [o for o in _ENDS[:2] if said.answer(o) == "bypass"]
    empty += ["on_error"] if said.on_error not in ("bypass", "ignore") else []
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
