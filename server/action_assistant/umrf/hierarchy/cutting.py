"""Some actions of a graph cut out into a graph of their own, with one action left in their place.

Entry, exit and interface follow from the arrows that cross the border. Whether the two graphs do what the
one did is another matter (`extraction`).
"""

from collections.abc import Collection, Iterator, Mapping
from typing import NamedTuple

from msgspec.structs import replace

from action_assistant.umrf.hierarchy.borders import Border, answers_of, ends_within
from action_assistant.umrf.hierarchy.joint_parts import Unjoined, names_of, renaming
from action_assistant.umrf.hierarchy.reasons import FlatteningReason
from action_assistant.umrf.json.text import Json, dump, parse_small
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Key,
    Parameter,
    Position,
    Relation,
    Remap,
)
from action_assistant.umrf.parameters import flat_name
from action_assistant.umrf.semantics.parts import exit_inputs
from action_assistant.umrf.semantics.values import RemapUnknown, renamed, slots_of
from action_assistant.umrf.signatures import action_of_graph


class Plan(NamedTuple):
    """One way to cut. `closing`: ends after which nothing follows end the sub-graph, too; `all_ends`: its
    exit waits for all ends."""

    closing: bool
    all_ends: bool


class Cut(NamedTuple):
    """The graph inside, the graph around it, and the action that stands for the former in the latter."""

    inner: Graph
    outer: Graph
    action: Action


def cut(border: Border, name: str, key: Key, plan: Plan) -> Cut | tuple[FlatteningReason, ...]:
    """The two graphs, or why values cannot go through. `key`: of the new action."""
    given = _given(border)
    inner = _inner(border, name, plan, given)
    action = replace(
        action_of_graph(inner),
        key=key,
        actor=_actor(border),
        description="",
        position=middle_of(action.position for action in border.chosen.values()),
    )
    action = replace(action, inputs=tuple(_with_values(action.inputs, given)))
    against: list[FlatteningReason] = []
    into, out = list(_into(border, action, against)), list(_out(border, action, against))
    if against:
        return tuple(against)
    return Cut(inner, _outer(border, action, (*into, *out)), action)


# Inside


def _given(border: Border) -> dict[tuple[Key, str], Parameter]:
    """Inputs of entry actions that have a value and can get another from outside: those belong to the
    action that stands for the sub-graph, since what is handed to that passes by inputs with a value."""
    found: dict[tuple[Key, str], Parameter] = {}
    for relation in border.into:
        inputs = slots_of(border.chosen[relation.child].inputs)
        reached = _handed(border, relation, inputs).keys()
        for parameter in border.chosen[relation.child].inputs:
            name = flat_name(parameter.path)
            if name in reached and inputs[name].has_value():
                found[relation.child, parameter.path] = parameter
    return found


def _handed(border: Border, relation: Relation, inputs: Collection[str]) -> dict[str, str]:
    parent = next((a for a in border.graph.actions if a.key == relation.parent), None)
    if parent is None:
        return {}
    try:
        return renamed(names_of(parent.outputs), relation.remap, inputs)
    except RemapUnknown:
        return {}  # which the arrow tells


def _inner(
    border: Border, name: str, plan: Plan, given: Mapping[tuple[Key, str], Parameter]
) -> Graph:
    def without_given(action: Action) -> Action:
        inputs = (_open(p) if (action.key, p.path) in given else p for p in action.inputs)
        return replace(action, inputs=tuple(inputs))

    graph = Graph(
        name=name,
        actions=tuple(without_given(action) for action in border.chosen.values()),
        direction=border.graph.direction,
        extra=tuple(_labels(border.graph)),
    )
    entries = tuple(_entries(border))
    plain = replace(graph, relations=(*entries, *border.within, *_exits(border, plan, gives=False)))
    if not exit_inputs(plain):
        return plain
    exits = _exits(border, plan, gives=True)
    return replace(graph, relations=(*entries, *border.within, *exits))


def _entries(border: Border) -> Iterator[Relation]:
    for place, key in enumerate(border.entries):
        orders = [r.child_order for r in border.into if r.child == key]
        yield Relation(
            parent=ENTRY,
            child=key,
            conditions=ENTRY_CONDITIONS,
            parent_order=float(place),
            child_order=min(orders, default=0.0),
        )


def _exits(border: Border, plan: Plan, *, gives: bool) -> Iterator[Relation]:
    """Who hands over values outside comes last: its outputs are those of the graph."""
    ends = ends_within(border, closing=plan.closing, gives=gives)
    handing = {r.parent for r in border.out if _gives(border, r)}
    leading = {r.parent for r in border.out}
    order = sorted(ends, key=lambda key: (key in handing, key in leading))
    last = max((r.parent_order for r in border.within), default=0.0) + 1
    for place, key in enumerate(order):
        yield Relation(
            parent=key,
            child=EXIT,
            conditions=ends[key],
            required=plan.all_ends or len(order) == 1,
            parent_order=last,
            child_order=float(place),
        )


def _gives(border: Border, relation: Relation) -> bool:
    outputs = names_of(border.chosen[relation.parent].outputs)
    if relation.child == EXIT:
        return bool(outputs)
    child = next((a for a in border.graph.actions if a.key == relation.child), None)
    try:
        return child is not None and bool(renamed(outputs, relation.remap, names_of(child.inputs)))
    except RemapUnknown:
        return False


def _open(parameter: Parameter) -> Parameter:
    leaf = parse_small(parameter.text)
    assert isinstance(leaf, dict)  # it has a value
    kept: Json = {field: value for field, value in leaf.items() if field != "pvf_value"}
    return Parameter(parameter.path, dump(kept))


def _labels(graph: Graph) -> Iterator[tuple[str, str]]:
    """What people sort the graph under, they sort the new one under, too."""
    attributes = parse_small(dict(graph.extra).get("gui_attributes", "null"))
    if isinstance(attributes, dict) and "labels" in attributes:
        yield "gui_attributes", dump({"labels": attributes["labels"]})


# Around


def _actor(border: Border) -> str:
    actors = {action.actor for action in border.chosen.values()}
    return actors.pop() if len(actors) == 1 else ""


def _with_values(
    inputs: tuple[Parameter, ...], given: Mapping[tuple[Key, str], Parameter]
) -> Iterator[Parameter]:
    texts = {path: parameter for (_, path), parameter in given.items()}
    return (texts.get(parameter.path, parameter) for parameter in inputs)


def middle_of(places: Iterator[Position | None]) -> Position | None:
    """The middle of what is taken up by those that stand somewhere."""
    there = [place for place in places if place is not None]
    if not there:
        return None
    xs, ys = [x for x, _ in there], [y for _, y in there]
    return (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2


def _into(border: Border, action: Action, against: list[FlatteningReason]) -> Iterator[Relation]:
    """One arrow for those from one action to all entries."""
    by_parent: dict[Key, list[Relation]] = {}
    for relation in border.into:
        by_parent.setdefault(relation.parent, []).append(relation)
    names = names_of(action.inputs)
    for ways in by_parent.values():
        first = ways[0]
        wanted: dict[str, str] = {}
        for way in ways:
            handed = _handed(border, way, names_of(border.chosen[way.child].inputs))
            for name, source in handed.items():
                if wanted.setdefault(name, source) != source:
                    one = f"Entry actions take “{name}” from {border.named(first.parent)}"
                    against.append(_values(border, way.child, f"{one} by two outputs."))
        wanted = {name: source for name, source in wanted.items() if name in names}
        remap = _remap(border, first, action.inputs, wanted, against)
        yield replace(
            first,
            child=action.key,
            remap=remap,
            parent_order=min(way.parent_order for way in ways),
            child_order=min(way.child_order for way in ways),
            waypoints=(),
        )


def _out(border: Border, action: Action, against: list[FlatteningReason]) -> Iterator[Relation]:
    """One arrow for those from all ends to one action."""
    by_child: dict[Key, list[Relation]] = {}
    for relation in border.out:
        by_child.setdefault(relation.child, []).append(relation)
    for child, ways in by_child.items():
        first = next((way for way in ways if _gives(border, way)), ways[0])
        remap: tuple[Remap, ...] = ()
        if child != EXIT:
            remap = _out_remap(border, first, action, against)
        yield replace(
            first,
            parent=action.key,
            conditions=answers_of(border, child),
            required=any(way.required for way in ways),
            remap=remap,
            parent_order=min(way.parent_order for way in ways),
            child_order=min(way.child_order for way in ways),
            waypoints=(),
        )


def _out_remap(
    border: Border, way: Relation, action: Action, against: list[FlatteningReason]
) -> tuple[Remap, ...]:
    """Renamings for what goes out: names stay, but the outputs are those of the graph."""
    child = next(a for a in border.graph.actions if a.key == way.child)
    outputs = names_of(action.outputs)
    try:
        own = names_of(border.chosen[way.parent].outputs)
        handed = renamed(own, way.remap, names_of(child.inputs))
        wanted = {name: source for name, source in handed.items() if source in outputs}
        return renaming(outputs, names_of(child.inputs), wanted, way.remap)
    except RemapUnknown as unknown:
        message = f"An output is renamed that does not exist: “{unknown}”."
    except Unjoined as none:
        message = none.message
    if _answers_with_values(answers_of(border, way.child)):
        against.append(_values(border, way.parent, message))
    return ()


def _answers_with_values(said: Conditions) -> bool:
    return bool({"run", "restart", "stop", "pause"} & {
        said.on_true, said.on_false, said.on_error, said.on_stopped
    })  # fmt: skip


def _remap(
    border: Border,
    way: Relation,
    inputs: tuple[Parameter, ...],
    wanted: Mapping[str, str],
    against: list[FlatteningReason],
) -> tuple[Remap, ...]:
    parent = next((a for a in border.graph.actions if a.key == way.parent), None)
    if parent is None:
        return way.remap  # from the entry
    try:
        return renaming(names_of(parent.outputs), names_of(inputs), wanted, way.remap)
    except Unjoined as none:
        against.append(_values(border, way.child, none.message))
        return ()


def _values(border: Border, key: Key, message: str) -> FlatteningReason:
    return FlatteningReason("values", message, border.at(key))


def _outer(border: Border, action: Action, joined: tuple[Relation, ...]) -> Graph:
    graph, chosen = border.graph, border.chosen
    first = next(iter(chosen))
    actions = tuple(
        action if each.key == first else each
        for each in graph.actions
        if each.key == first or each.key not in chosen
    )
    kept = tuple(r for r in graph.relations if not {r.parent, r.child} & chosen.keys())
    return replace(graph, actions=actions, relations=(*kept, *joined))
