"""One graph of a hierarchy: what it takes from the graph around it, and what in it has no counterpart
in one graph, or has courses that nobody can look at.
"""

from collections.abc import Collection, Iterator

from msgspec.structs import replace

from action_assistant.umrf.checks.places import Subject
from action_assistant.umrf.checks.structure import check_structure
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.hierarchy.joint_parts import ends_of
from action_assistant.umrf.hierarchy.reasons import FlatteningReason, HierarchyLevel
from action_assistant.umrf.json.text import Json, dump, parse_small
from action_assistant.umrf.model import ENTRY, EXIT, Action, Graph, Parameter, Relation
from action_assistant.umrf.parameters import flat_name
from action_assistant.umrf.semantics.values import RemapUnknown, renamed, slots_of


def faults(graph: Graph) -> Iterator[FlatteningReason]:
    """What keeps one graph of a hierarchy from being looked at."""
    subject = Subject(graph, PINNED)
    check_structure(subject)
    for problem in subject.problems:
        if problem.severity == "error":
            yield FlatteningReason("faulty", f"{graph.name}: {problem.message}")
    if any(r.only or r.listing or (r.parent == ENTRY and r.child == EXIT) for r in graph.relations):
        message = (
            f"{graph.name}: arrows that only one side lists, that are there twice, or that lead "
        )
        yield FlatteningReason("faulty", message + "from the entry to the exit.")
    for action in graph.actions:
        at = (HierarchyLevel(graph.name, action.key, action.full_name),)
        if action.missing:
            yield FlatteningReason("faulty", "There is no such action.", at)
        if action.type == "spontaneous":
            yield FlatteningReason(
                "spontaneous", "A spontaneous action stops what follows as it pleases.", at
            )
    yield from _relations(graph)


def _relations(graph: Graph) -> Iterator[FlatteningReason]:
    actions = {action.key: action for action in graph.actions}
    for relation in graph.relations:
        child = actions.get(relation.child)
        if child is None:
            continue
        at = (HierarchyLevel(graph.name, child.key, child.full_name),)
        said = relation.conditions
        if relation.parent != ENTRY and {"stop", "pause"} & {
            said.on_true, said.on_false, said.on_error, said.on_stopped
        }:  # fmt: skip
            yield FlatteningReason(
                "stops", "It can be told to stop or to pause; how that ends is not looked at.", at
            )
        if relation.parent in actions and _is_choosy(actions[relation.parent], relation, child):
            yield FlatteningReason(
                "allowed-values", "It takes only some values; what it is given is not known.", at
            )


def _is_choosy(parent: Action, relation: Relation, child: Action) -> bool:
    inputs = slots_of(child.inputs)
    try:
        found = renamed(slots_of(parent.outputs), relation.remap, inputs)
    except RemapUnknown:
        return False  # which the courses tell
    return any(inputs[name].allowed for name in found)


def inputs_of(graph: Graph) -> frozenset[str]:
    """What a graph takes as a sub-graph: the inputs of its entry actions that have no value."""
    actions = {action.key: action for action in graph.actions}
    entries, _ = ends_of(graph)
    return frozenset(
        name
        for entry in entries
        if entry.child in actions
        for name, slot in slots_of(actions[entry.child].inputs).items()
        if not slot.has_value()
    )


def courses_graph(graph: Graph, given: Collection[str]) -> Graph:
    """The graph as if its entry actions had the values that it is given, and nothing were renamed on
    the way to them."""
    taken: dict[str, set[str]] = {}
    inputs = {action.key: slots_of(action.inputs) for action in graph.actions}
    for entry in ends_of(graph)[0]:
        try:
            found = renamed(given, entry.remap, inputs[entry.child])
        except RemapUnknown:
            continue  # which the joint tells
        taken.setdefault(entry.child, set()).update(found)
    actions = tuple(
        replace(a, inputs=tuple(_filled(p, taken[a.key]) for p in a.inputs))
        if taken.get(a.key)
        else a
        for a in graph.actions
    )
    relations = (
        replace(r, remap=()) if r.parent == ENTRY and given else r for r in graph.relations
    )
    return replace(graph, actions=actions, relations=tuple(relations))


def _filled(parameter: Parameter, taken: Collection[str]) -> Parameter:
    leaf: Json = parse_small(parameter.text)
    if flat_name(parameter.path) not in taken or not isinstance(leaf, dict):
        return parameter
    return Parameter(parameter.path, dump({"pvf_value": None, **leaf}))
