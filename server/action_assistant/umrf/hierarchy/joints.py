"""Where a sub-graph is joined to the graph around it: which arrows lead in and out when its actions
stand in its place, and why there are none that say the same.

See docs/umrf-and-the-engine.md 2.3, 2.6 and 2.7, and docs/decisions/069-flatten.md.
"""

from collections.abc import Collection, Iterator, Sequence
from typing import TypeVar

from msgspec.structs import replace

from action_assistant.umrf.hierarchy.joint_parts import (
    JoinedArrow,
    JoinedPlace,
    SubGraphPlace,
    Unjoined,
    ends_of,
    in_order,
    merged_extra,
    names_of,
    outputs_within,
    refuse,
    renamed_or_refused,
    renaming,
)
from action_assistant.umrf.hierarchy.ways_out import ways_out
from action_assistant.umrf.json.text import dump, parse_small
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    Action,
    Graph,
    Key,
    Parameter,
    Precondition,
    Relation,
)
from action_assistant.umrf.parameters import flat_name
from action_assistant.umrf.semantics.values import Slot, slots_of

_Part = TypeVar("_Part")


def joined(place: SubGraphPlace) -> JoinedPlace | tuple[Unjoined, ...]:
    """The arrows into and out of a sub-graph's actions; all that speaks against it, if anything
    does."""
    relations = place.around.relations
    own = place.action.key
    if any(r.parent == own == r.child for r in relations):
        return (Unjoined("loop", "It leads to itself."),)
    into = in_order([r for r in relations if r.child == own], by_parent=False)
    out = in_order([r for r in relations if r.parent == own], by_parent=True)
    against = [
        Unjoined(
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


def _got(parts: Iterator[_Part], against: list[Unjoined]) -> Iterator[_Part]:
    try:
        yield from parts
    except Unjoined as none:
        against.append(none)


def _lets_through(inside: Graph, outcome: Precondition) -> bool:
    """Whether a bypass of the entry goes to the exit by bypasses, one by one, and nowhere else."""
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
            )
            yield JoinedArrow(arrow, relation, number)


def _entry_actions(place: SubGraphPlace) -> Iterator[tuple[Key, Action]]:
    """The entry actions of the sub-graph, with the values that the file gives to its action."""
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
    """A value that goes through both is taken by both or by neither."""
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
