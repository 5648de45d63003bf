"""Cuts some actions of a graph out into a graph of their own, with one action left in their place.

`selection_of` sorts the arrows by their relation to the chosen actions. Entry, exit, inputs and
outputs of the new graph follow from the arrows that cross the selection's border. Whether the two
graphs do the same as the one is checked by `extraction`. See docs/umrf-and-the-engine.md 2.3 and
2.6.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from msgspec.structs import replace

from action_assistant.umrf.hierarchy.joint_parts import JoinRefused, in_order, names_of, renaming
from action_assistant.umrf.hierarchy.reasons import FlatteningReason, HierarchyLevel
from action_assistant.umrf.json.text import Json, dump, parse_small
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    OUTCOMES,
    PRECONDITIONS,
    Action,
    Conditions,
    Graph,
    Key,
    Parameter,
    Position,
    Precondition,
    Relation,
    Remap,
    Response,
)
from action_assistant.umrf.parameters import flat_name
from action_assistant.umrf.semantics.parts import exit_inputs
from action_assistant.umrf.semantics.values import RemapUnknown, renamed, slots_of
from action_assistant.umrf.signatures import action_of_graph


class Selection(NamedTuple):
    """The chosen actions of a graph, and its arrows sorted by their relation to them.

    `into`, `within` and `out`: arrows that come in, stay inside and go out. `leading`: the arrows
    that come from each chosen action. `entries`: the chosen actions to which arrows from outside
    lead, or, if none comes in, those to which no arrow leads.
    """

    graph: Graph
    chosen: Mapping[Key, Action]
    into: tuple[Relation, ...]
    within: tuple[Relation, ...]
    out: tuple[Relation, ...]
    entries: tuple[Key, ...]
    leading: Mapping[Key, Sequence[Relation]]

    def at(self, key: Key) -> tuple[HierarchyLevel, ...]:
        """Return the path of levels to the chosen action `key`, for a FlatteningReason."""
        return (HierarchyLevel(self.graph.name, key, self.chosen[key].full_name),)

    def named(self, key: Key) -> str:
        """Return the words for an action, or for an end of the graph ("the entry"), in a message."""
        if key in (ENTRY, EXIT):
            return f"the {key}"
        return next((a.full_name for a in self.graph.actions if a.key == key), key)

    def answers(self, key: Key, outcome: Precondition) -> dict[Key, Response]:
        """Return the responses of actions outside to this outcome of the chosen action `key`, by
        key; those that ignore it are missing."""
        ways = (r for r in self.leading.get(key, ()) if r.child not in self.chosen)
        found = ((r.child, r.conditions.answer(outcome)) for r in ways)
        return {child: answer for child, answer in found if answer != "ignore"}

    def goes_on(self, key: Key, outcome: Precondition) -> bool:
        """Return whether another chosen action responds to this outcome of the action `key`."""
        ways = (r for r in self.leading.get(key, ()) if r.child in self.chosen)
        return any(r.conditions.answer(outcome) != "ignore" for r in ways)


def selection_of(graph: Graph, chosen: Collection[Key]) -> Selection:
    """Return the actions of a graph with the keys `chosen`, and the arrows that come in to them,
    stay among them and go out from them. Keys without an action are ignored."""
    actions = {action.key: action for action in graph.actions if action.key in chosen}
    inside, ordered = actions.keys(), in_order(graph.relations, by_parent=False)
    into = tuple(r for r in ordered if r.child in inside and r.parent not in inside)
    within = tuple(r for r in ordered if r.child in inside and r.parent in inside)
    out = tuple(
        r
        for r in in_order(graph.relations, by_parent=True)
        if r.parent in inside and r.child not in inside
    )
    leading: dict[Key, list[Relation]] = {}
    for relation in (*within, *out):
        leading.setdefault(relation.parent, []).append(relation)
    reached = {r.child for r in (into or within)}
    entries = tuple(key for key in actions if (key in reached) == bool(into))
    return Selection(graph, actions, into, within, out, entries, leading)


def between(selection: Selection) -> Iterator[FlatteningReason]:
    """Yield a reason for each action that is not chosen and lies on a path of arrows from chosen
    actions to chosen actions."""
    ahead, back = dict[Key, list[Key]](), dict[Key, list[Key]]()
    for relation in selection.graph.relations:
        ahead.setdefault(relation.parent, []).append(relation.child)
        back.setdefault(relation.child, []).append(relation.parent)
    on_paths = _reached(selection, ahead) & _reached(selection, back)
    for action in selection.graph.actions:
        if action.key in on_paths and action.key not in selection.chosen:
            at = (HierarchyLevel(selection.graph.name, action.key, action.full_name),)
            yield FlatteningReason(
                "between", "It lies between chosen actions and is not chosen.", at
            )


def _reached(selection: Selection, ways: Mapping[Key, Sequence[Key]]) -> set[Key]:
    found: set[Key] = set()
    stack = list(selection.chosen)
    while stack:
        for key in ways.get(stack.pop(), ()):
            if key not in found:
                found.add(key)
                stack.append(key)
    return found


def ways_in_differ(selection: Selection) -> Iterator[FlatteningReason]:
    """Yield the reasons for which the entries of the selection cannot be entries of one sub-graph.
    The same actions have to lead to each of them, with the same conditions."""
    if not selection.entries:
        message = "Each of these actions follows another of them, so none would begin."
        yield FlatteningReason("ways-in", message)
        return
    first = selection.entries[0]
    answers = _answers_into(selection, first)
    for key in selection.entries[1:]:
        other = _answers_into(selection, key)
        one, two = selection.named(first), selection.named(key)
        for parent in sorted(answers.keys() ^ other.keys()):
            leads, not_ = (one, two) if parent in answers else (two, one)
            subject = "The entry" if parent == ENTRY else selection.named(parent)
            message = (
                f"{subject} leads to {leads} and not to {not_}: a sub-graph begins with all "
                "of its entry actions at once."
            )
            yield FlatteningReason("ways-in", message, selection.at(key))
        for parent in sorted(answers.keys() & other.keys()):
            if answers[parent] != other[parent]:
                message = f"{one} and {two} answer differently when {selection.named(parent)} ends."
                yield FlatteningReason("ways-in", message, selection.at(key))


def _answers_into(selection: Selection, key: Key) -> dict[Key, tuple[Conditions | None, bool]]:
    """Return, by the action it comes from, the conditions of each arrow from outside to the chosen
    action `key`, and whether it is required; (None, True) for the entry."""
    ways = (r for r in selection.into if r.child == key)
    return {
        r.parent: (None, True) if r.parent == ENTRY else (r.conditions, r.required) for r in ways
    }


def ways_out_differ(selection: Selection) -> Iterator[FlatteningReason]:
    """Yield the reasons for which several ends of the selection cannot be ends of one sub-graph:
    actions outside see only its outcome, not which action ended."""
    differing: dict[tuple[Key, Key], list[Precondition]] = {}
    for outcome in PRECONDITIONS:
        known: tuple[Key, dict[Key, Response]] | None = None
        for key in selection.chosen:
            answers = selection.answers(key, outcome)
            if not answers:
                continue
            if known is None:
                known = key, answers
            elif known[1] != answers:
                differing.setdefault((known[0], key), []).append(outcome)
    for (first, key), outcomes in differing.items():
        one, two = selection.named(first), selection.named(key)
        message = (
            f"When {one} ends {' or '.join(outcomes)}, something else follows than when {two} does: "
            "outside only the outcome of the sub-graph is seen, and not who ended it."
        )
        yield FlatteningReason("ways-out", message, selection.at(key))


def answers_of(selection: Selection, child: Key) -> Conditions:
    """Return the conditions of the arrow that leads from the new action, which stands for the
    selected actions, to the action `child` outside of the selection: its response to each
    outcome."""
    found: dict[str, Response] = {}
    for outcome in PRECONDITIONS:
        for key in selection.chosen:
            answer = selection.answers(key, outcome).get(child)
            if answer is not None:
                found[outcome] = answer
    return Conditions(**found)


def ends_within(selection: Selection, *, closing: bool, gives: bool) -> dict[Key, Conditions]:
    """Return the chosen actions that end the sub-graph, with the conditions of their arrows to its
    exit. `closing`: an outcome to which no action responds also ends the sub-graph; otherwise it
    would stay HALTED without a notice. `gives`: the exit waits for values."""
    free = [o for o in OUTCOMES if not any(selection.answers(key, o) for key in selection.chosen)]
    found: dict[Key, Conditions] = {}
    for key in selection.chosen:
        conditions: dict[str, Response] = {}
        for outcome in PRECONDITIONS:
            answers = set(selection.answers(key, outcome).values())
            if answers:
                conditions[outcome] = "bypass" if answers == {"bypass"} else "run"
            elif closing and outcome in free and not selection.goes_on(key, outcome):
                conditions[outcome] = "bypass" if gives or outcome == "on_error" else "run"
        if conditions:
            found[key] = Conditions(**conditions)
    return found


class CutPlan(NamedTuple):
    """One way to cut. `closing`: ends after which nothing follows end the sub-graph, too.
    `all_ends`: its exit waits for all ends."""

    closing: bool
    all_ends: bool


class CutGraphs(NamedTuple):
    """The inner graph, the outer graph, and the action of the outer graph that stands for the inner
    one."""

    inner: Graph
    outer: Graph
    action: Action


def cut(
    selection: Selection, name: str, key: Key, plan: CutPlan
) -> CutGraphs | tuple[FlatteningReason, ...]:
    """Return the graphs that the cut of a selection makes, or the reasons for which values cannot
    pass between them. `name`: the name of the new graph; `key`: the key of the action that stands
    for it; `plan`: the way to cut."""
    given = _given(selection)
    inner = _inner(selection, name, plan, given)
    action = replace(
        action_of_graph(inner),
        key=key,
        actor=_actor(selection),
        description="",
        position=middle_of(action.position for action in selection.chosen.values()),
    )
    action = replace(action, inputs=tuple(_with_values(action.inputs, given)))
    against: list[FlatteningReason] = []
    into, out = list(_into(selection, action, against)), list(_out(selection, action, against))
    if against:
        return tuple(against)
    return CutGraphs(inner, _outer(selection, action, (*into, *out)), action)


# Inside


def _given(selection: Selection) -> dict[tuple[Key, str], Parameter]:
    """Return the inputs of entry actions that have a value and can get another one from outside, by
    key and path. They must be inputs of the action that stands for the sub-graph, since a value
    that is handed to it does not reach an inner input that has a value."""
    found: dict[tuple[Key, str], Parameter] = {}
    for relation in selection.into:
        inputs = slots_of(selection.chosen[relation.child].inputs)
        reached = _handed(selection, relation, inputs).keys()
        for parameter in selection.chosen[relation.child].inputs:
            name = flat_name(parameter.path)
            if name in reached and inputs[name].has_value():
                found[relation.child, parameter.path] = parameter
    return found


def _handed(selection: Selection, relation: Relation, inputs: Collection[str]) -> dict[str, str]:
    parent = next((a for a in selection.graph.actions if a.key == relation.parent), None)
    if parent is None:
        return {}
    try:
        return renamed(names_of(parent.outputs), relation.remap, inputs)
    except RemapUnknown:
        return {}  # the arrow's own check reports it


def _inner(
    selection: Selection, name: str, plan: CutPlan, given: Mapping[tuple[Key, str], Parameter]
) -> Graph:
    shared = _actor(selection)

    def without_given(action: Action) -> Action:
        inputs = (_open(p) if (action.key, p.path) in given else p for p in action.inputs)
        actor = "" if action.actor == shared else action.actor  # the action around it names that
        return replace(action, inputs=tuple(inputs), actor=actor)

    graph = Graph(
        name=name,
        actions=tuple(without_given(action) for action in selection.chosen.values()),
        direction=selection.graph.direction,
        extra=tuple(_labels(selection.graph)),
    )
    entries = tuple(_entries(selection))
    plain = replace(
        graph, relations=(*entries, *selection.within, *_exits(selection, plan, gives=False))
    )
    if not exit_inputs(plain):
        return plain
    exits = _exits(selection, plan, gives=True)
    return replace(graph, relations=(*entries, *selection.within, *exits))


def _entries(selection: Selection) -> Iterator[Relation]:
    for place, key in enumerate(selection.entries):
        orders = [r.child_order for r in selection.into if r.child == key]
        yield Relation(
            parent=ENTRY,
            child=key,
            conditions=ENTRY_CONDITIONS,
            parent_order=float(place),
            child_order=min(orders, default=0.0),
        )


def _exits(selection: Selection, plan: CutPlan, *, gives: bool) -> Iterator[Relation]:
    """Yield the arrows to the exit of the new graph. Actions that give values to actions outside
    come last, since the graph gets their outputs. `plan`: the way to cut; `gives`: the exit waits
    for values."""
    ends = ends_within(selection, closing=plan.closing, gives=gives)
    handing = {r.parent for r in selection.out if _gives(selection, r)}
    leading = {r.parent for r in selection.out}
    order = sorted(ends, key=lambda key: (key in handing, key in leading))
    last = max((r.parent_order for r in selection.within), default=0.0) + 1
    for place, key in enumerate(order):
        yield Relation(
            parent=key,
            child=EXIT,
            conditions=ends[key],
            required=plan.all_ends or len(order) == 1,
            parent_order=last,
            child_order=float(place),
        )


def _gives(selection: Selection, relation: Relation) -> bool:
    outputs = names_of(selection.chosen[relation.parent].outputs)
    if relation.child == EXIT:
        return bool(outputs)
    child = next((a for a in selection.graph.actions if a.key == relation.child), None)
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
    """Yield the field of the file with the labels of the graph, by which people group it, if it has
    any: the new graph gets the same."""
    attributes = parse_small(dict(graph.extra).get("gui_attributes", "null"))
    if isinstance(attributes, dict) and "labels" in attributes:
        yield "gui_attributes", dump({"labels": attributes["labels"]})


# Around


def _actor(selection: Selection) -> str:
    """Return the actor of all chosen actions; "" if they have several, or none."""
    actors = {action.actor for action in selection.chosen.values()}
    return actors.pop() if len(actors) == 1 else ""


def _with_values(
    inputs: tuple[Parameter, ...], given: Mapping[tuple[Key, str], Parameter]
) -> Iterator[Parameter]:
    texts = {path: parameter for (_, path), parameter in given.items()}
    return (texts.get(parameter.path, parameter) for parameter in inputs)


def middle_of(places: Iterator[Position | None]) -> Position | None:
    """Return the middle of the smallest rectangle around all positions. A position that is None
    does not count; return None if none is left."""
    known = [place for place in places if place is not None]
    if not known:
        return None
    xs, ys = [x for x, _ in known], [y for _, y in known]
    return (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2


def _into(
    selection: Selection, action: Action, against: list[FlatteningReason]
) -> Iterator[Relation]:
    """Yield the arrows to `action`, which stands for the selected actions, from outside: one for
    each action outside that leads to any of them, in place of all its arrows to them. Reasons why
    that would not do the same are added to `against`."""
    by_parent: dict[Key, list[Relation]] = {}
    for relation in selection.into:
        by_parent.setdefault(relation.parent, []).append(relation)
    names = names_of(action.inputs)
    for ways in by_parent.values():
        first = ways[0]
        wanted: dict[str, str] = {}
        for way in ways:
            handed = _handed(selection, way, names_of(selection.chosen[way.child].inputs))
            for name, source in handed.items():
                if wanted.setdefault(name, source) != source:
                    one = f"Entry actions take “{name}” from {selection.named(first.parent)}"
                    against.append(_values(selection, way.child, f"{one} by two outputs."))
        wanted = {name: source for name, source in wanted.items() if name in names}
        remap = _remap(selection, first, action.inputs, wanted, against)
        yield replace(
            first,
            child=action.key,
            remap=remap,
            parent_order=min(way.parent_order for way in ways),
            child_order=min(way.child_order for way in ways),
            waypoints=(),
            breakpoint="",
        )


def _out(
    selection: Selection, action: Action, against: list[FlatteningReason]
) -> Iterator[Relation]:
    """Yield, for each action outside to which the selection leads, one arrow from `action` that
    replaces the arrows from all ends to it. Reasons against it are added to `against`."""
    by_child: dict[Key, list[Relation]] = {}
    for relation in selection.out:
        by_child.setdefault(relation.child, []).append(relation)
    for child, ways in by_child.items():
        first = next((way for way in ways if _gives(selection, way)), ways[0])
        remap: tuple[Remap, ...] = ()
        if child != EXIT:
            remap = _out_remap(selection, first, action, against)
        yield replace(
            first,
            parent=action.key,
            conditions=answers_of(selection, child),
            required=any(way.required for way in ways),
            remap=remap,
            parent_order=min(way.parent_order for way in ways),
            child_order=min(way.child_order for way in ways),
            waypoints=(),
            breakpoint="",
        )


def _out_remap(
    selection: Selection, way: Relation, action: Action, against: list[FlatteningReason]
) -> tuple[Remap, ...]:
    """Return the renamings of an arrow (`way`) that goes out, now that it begins at `action`, whose
    outputs are those of the new graph. If there are none, add the reason to `against` and return
    ()."""
    child = next(a for a in selection.graph.actions if a.key == way.child)
    outputs = names_of(action.outputs)
    try:
        own = names_of(selection.chosen[way.parent].outputs)
        handed = renamed(own, way.remap, names_of(child.inputs))
        wanted = {name: source for name, source in handed.items() if source in outputs}
        return renaming(outputs, names_of(child.inputs), wanted, way.remap)
    except RemapUnknown as unknown:
        message = f"An output is renamed that does not exist: “{unknown}”."
    except JoinRefused as none:
        message = none.message
    if _answers_with_values(answers_of(selection, way.child)):
        against.append(_values(selection, way.parent, message))
    return ()


def _answers_with_values(conditions: Conditions) -> bool:
    return bool({"run", "restart", "stop", "pause"} & {
        conditions.on_true, conditions.on_false, conditions.on_error, conditions.on_stopped
    })  # fmt: skip


def _remap(
    selection: Selection,
    way: Relation,
    inputs: tuple[Parameter, ...],
    wanted: Mapping[str, str],
    against: list[FlatteningReason],
) -> tuple[Remap, ...]:
    parent = next((a for a in selection.graph.actions if a.key == way.parent), None)
    if parent is None:
        return way.remap  # from the entry
    try:
        return renaming(names_of(parent.outputs), names_of(inputs), wanted, way.remap)
    except JoinRefused as none:
        against.append(_values(selection, way.child, none.message))
        return ()


def _values(selection: Selection, key: Key, message: str) -> FlatteningReason:
    return FlatteningReason("values", message, selection.at(key))


def _outer(selection: Selection, action: Action, joined: tuple[Relation, ...]) -> Graph:
    graph, chosen = selection.graph, selection.chosen
    first = next(iter(chosen))
    actions = tuple(
        action if each.key == first else each
        for each in graph.actions
        if each.key == first or each.key not in chosen
    )
    kept = tuple(r for r in graph.relations if not {r.parent, r.child} & chosen.keys())
    return replace(graph, actions=actions, relations=(*kept, *joined))
