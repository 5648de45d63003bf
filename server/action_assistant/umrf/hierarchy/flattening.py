"""Flattens a hierarchy: makes one graph that does what a graph with its sub-graphs does, or says why there is none.

`flattened` puts the actions of sub-graphs in the place of the action that is the sub-graph, from the innermost
outwards. The conditions under which the course stays the same are checked for each graph over all of its courses
(`level_courses`), and for each place over the arrows there (`joints`).

See docs/decisions/069-flatten.md.
"""

from collections.abc import Collection, Container, Iterable, Iterator, Mapping
from typing import Final, NamedTuple, TypeAlias

import msgspec
from msgspec.structs import replace

from action_assistant.umrf.checks.places import Subject
from action_assistant.umrf.checks.structure import check_structure
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.hierarchy.inlining import identity, inlined, under_keys
from action_assistant.umrf.hierarchy.joint_parts import JoinedPlace, SubGraphPlace, ends_of
from action_assistant.umrf.hierarchy.joints import joined
from action_assistant.umrf.hierarchy.level_courses import BUDGET, LevelCourses, level_courses
from action_assistant.umrf.hierarchy.reasons import (
    FlatteningCode,
    FlatteningReason,
    HierarchyLevel,
    LevelPath,
    of_trouble,
)
from action_assistant.umrf.json.text import Json, dump, parse_small
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
from action_assistant.umrf.semantics.matching import IndexedGraphs
from action_assistant.umrf.semantics.values import RemapUnknown, renamed, slots_of


def faults(graph: Graph) -> Iterator[FlatteningReason]:
    """Yield the reasons for which one graph of a hierarchy cannot be examined."""
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
                "spontaneous", "A spontaneous action stops the actions after it at any time.", at
            )
    yield from _relations(graph)


def _relations(graph: Graph) -> Iterator[FlatteningReason]:
    actions = {action.key: action for action in graph.actions}
    for relation in graph.relations:
        child = actions.get(relation.child)
        if child is None:
            continue
        at = (HierarchyLevel(graph.name, child.key, child.full_name),)
        conditions = relation.conditions
        if relation.parent != ENTRY and {"stop", "pause"} & {
            conditions.on_true, conditions.on_false, conditions.on_error, conditions.on_stopped
        }:  # fmt: skip
            yield FlatteningReason(
                "stops",
                "It can be told to stop or to pause; the courses after that are not examined.",
                at,
            )
        if relation.parent in actions and _is_choosy(actions[relation.parent], relation, child):
            yield FlatteningReason(
                "allowed-values",
                "It takes only some values, and the value that it is given is not known.",
                at,
            )


def _is_choosy(parent: Action, relation: Relation, child: Action) -> bool:
    inputs = slots_of(child.inputs)
    try:
        found = renamed(slots_of(parent.outputs), relation.remap, inputs)
    except RemapUnknown:
        return False  # the courses report it
    return any(inputs[name].allowed for name in found)


def inputs_of(graph: Graph) -> frozenset[str]:
    """Return the flat names of the inputs that a graph has as a sub-graph: the inputs of its entry
    actions that have no value."""
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
    """Return the form of a graph whose courses are examined: its entry actions have a value for
    each input that gets one from outside. `given`: the flat names of the values from outside,
    before the renamings of the arrows from the entry. If there are any, these arrows have no
    renamings in the result."""
    taken: dict[str, set[str]] = {}
    inputs = {action.key: slots_of(action.inputs) for action in graph.actions}
    for entry in ends_of(graph)[0]:
        try:
            found = renamed(given, entry.remap, inputs[entry.child])
        except RemapUnknown:
            continue  # `joined` reports it
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


#: Troubles that do not matter in the top graph, since it does the same when it is flat.
OF_INNER: Final = frozenset({"halts", "waits", "unready", "early", "beside"})
#: The most actions of one graph, as in the editor (decision 20).
MOST: Final = 5_000
#: The most reasons that are listed: they repeat wherever a graph stands, and may double with each level.
REASONS: Final = 100
#: The most levels below each other.
DEEPEST: Final = 32
_COUNTED: Final = 1_000_000_000  # a larger number of actions is not given exactly in a message


class FlatOrigin(msgspec.Struct, frozen=True):
    """The origin of an action of the flat graph: the levels from the top graph down to the action
    itself."""

    key: Key
    action: str
    levels: LevelPath


class LeftOut(msgspec.Struct, frozen=True):
    """The description and unknown fields, of an action that was a sub-graph or of that graph, that
    the flat graph lacks."""

    levels: LevelPath
    fields: tuple[str, ...]


class Flattened(msgspec.Struct, frozen=True, tag="flattened", tag_field="kind"):
    """One graph with the same course as the hierarchy. `origins`: in the order of its actions."""

    graph: Graph
    origins: tuple[FlatOrigin, ...]
    left_out: tuple[LeftOut, ...] = ()


class Unflattenable(msgspec.Struct, frozen=True, tag="unflattenable", tag_field="kind"):
    """The reasons for which no graph is known to have the same course: the first `REASONS` that
    were found."""

    reasons: tuple[FlatteningReason, ...]


Flattening: TypeAlias = Flattened | Unflattenable


def flattened(
    graph: Graph,
    graphs: Mapping[str, Graph],
    known: Container[str] = frozenset(),
    *,
    budget: int | None = None,
) -> Flattening:
    """Return one graph without sub-graphs that runs the same actions in the same order with the
    same values, and ends in the same way; or the reasons why no such graph was found. `graphs`: the
    graphs that the engine has indexed, by name. `known`: names of actions, which take precedence
    over graphs of the same name. `budget`: the most states that are examined, None for `BUDGET`."""
    hierarchy = _Hierarchy(graphs, known, BUDGET if budget is None else budget)
    if not any(hierarchy.is_sub(action) for action in graph.actions):
        return Flattened(graph, tuple(_plain(graph)))
    actions = hierarchy.actions_of(graph)
    if actions > MOST:
        count = f"{actions:,}" if actions <= _COUNTED else f"more than {_COUNTED:,}"
        message = f"One graph would have {count} actions; {MOST:,} are the most."
        return _unflattenable([FlatteningReason("too-large", message)])
    found = hierarchy.level(graph, ())
    return _unflattenable(found.reasons) if found.flat is None else _named(found.flat)


def _unflattenable(reasons: Iterable[FlatteningReason]) -> Unflattenable:
    """Return the result for these reasons, each once."""
    return Unflattenable(tuple(dict.fromkeys(reasons)))


class _Flat(NamedTuple):
    """One graph of the hierarchy made flat. `origins`: the levels from this graph down, by key."""

    graph: Graph
    origins: Mapping[Key, LevelPath]
    results: frozenset[Precondition]
    left_out: tuple[LeftOut, ...]


class _Found(NamedTuple):
    """The result for one graph of the hierarchy. `flat` is None if there are reasons."""

    flat: _Flat | None
    reasons: tuple[FlatteningReason, ...]


class _Hierarchy:
    """Flattens the graphs of a hierarchy, each only once, wherever it stands."""

    def __init__(self, graphs: Mapping[str, Graph], known: Container[str], budget: int) -> None:
        self.graphs = graphs
        self.known = known
        self.budget = budget
        self._indexed = IndexedGraphs(graphs)
        self._found: dict[str, _Found] = {}

    def is_sub(self, action: Action) -> bool:
        """Return whether an action stands for a graph: it has the name of an indexed graph, and not
        that of a library action (`known`)."""
        return not action.missing and action.name in self.graphs and action.name not in self.known

    def actions_of(self, graph: Graph) -> int:
        """Return how many actions the flat graph would have.

        This is computed before any graph is made, since the number may double with each level. A
        graph that contains itself or lies too deep counts once and is refused later.
        """
        counts: dict[str, int] = {}

        def count(of: Graph, above: tuple[str, ...]) -> int:
            return sum(one(action, above) for action in of.actions)

        def one(action: Action, above: tuple[str, ...]) -> int:
            name = action.name
            if not self.is_sub(action) or name in above or len(above) > DEEPEST:
                return 1
            if name not in counts:
                counts[name] = count(self.graphs[name], (*above, name))
            return counts[name]

        return count(graph, (graph.name,))

    def level(self, graph: Graph, above: tuple[str, ...]) -> _Found:
        """Return the flat graph of one graph and all graphs inside it, or the reasons against it.
        `above`: the names of the graphs around it."""
        reasons = list(faults(graph))
        inside: dict[Key, _Found] = {}
        for action in graph.actions:
            if not self.is_sub(action):
                continue
            at = (HierarchyLevel(graph.name, action.key, action.full_name),)
            inside[action.key] = found = self._sub(action, (*above, graph.name))
            left = found.reasons[: max(0, REASONS - len(reasons))]
            reasons += [replace(reason, at=at + reason.at) for reason in left]
        if reasons:
            return _Found(None, tuple(reasons))
        flats = {key: found.flat for key, found in inside.items() if found.flat is not None}
        given = inputs_of(graph) if above else frozenset[str]()
        seen = level_courses(
            courses_graph(graph, given),
            {key: flat.results for key, flat in flats.items()},
            self.budget,
            is_top=not above,
        )
        self.budget -= seen.spent
        reasons += _troubles(graph, seen, is_top=not above)
        return self._together(graph, flats, seen, given, reasons)

    def _sub(self, action: Action, above: tuple[str, ...]) -> _Found:
        """Return the flat graph of the sub-graph for which an action stands, or the reasons against
        it. `above`: the names of the graphs around it."""
        graph = self.graphs[action.name]
        if graph.name in above or action.name in above:
            return _refused("recursion", "The sub-graph contains itself, or the graph it is in.")
        if len(above) > DEEPEST:
            return _refused("too-large", f"There are more than {DEEPEST} levels.")
        names = slots_of(action.inputs).keys(), slots_of(action.outputs).keys()
        if self._indexed.fitting(action.name, *names) is None:
            return _refused(
                "signature",
                f"The graph “{action.name}” takes or gives other parameters than this action: the "
                "engine takes it for something else, or for nothing.",
            )
        if action.name not in self._found:
            self._found[action.name] = self.level(graph, above)
        return self._found[action.name]

    def _together(
        self,
        graph: Graph,
        flats: Mapping[Key, _Flat],
        seen: LevelCourses,
        given: frozenset[str],
        reasons: list[FlatteningReason],
    ) -> _Found:
        """Replace each action that stands for a sub-graph by its flat graph (`flats`, by key),
        unless there is a reason against it; these are in the result. `seen`: a summary of the
        graph's courses; `given`: flat names of inputs that get values from outside."""
        kept = {a.full_name for a in graph.actions if a.key not in flats}
        flat = _Flat(graph, dict(_origins(graph, flats)), seen.results, _unknown(graph, flats))
        for key, inner in flats.items():
            action = next(a for a in graph.actions if a.key == key)
            at = HierarchyLevel(graph.name, key, action.full_name)
            size = len(flat.graph.actions) + len(inner.graph.actions)
            if size > MOST:
                message = f"One graph would have more than {MOST:,} actions."
                return _Found(None, (*reasons, FlatteningReason("too-large", message, (at,))))
            lacks, bypassed = key in seen.lacking, seen.bypassed.get(key, frozenset())
            place = joined(SubGraphPlace(flat.graph, action, inner.graph, given, lacks, bypassed))
            if isinstance(place, JoinedPlace):
                flat = _put(flat, at, inner, place, kept)
            else:
                reasons += [FlatteningReason(each.code, each.message, (at,)) for each in place]
        return _Found(None if reasons else flat, tuple(reasons))


def _refused(code: FlatteningCode, message: str) -> _Found:
    return _Found(None, (FlatteningReason(code, message),))


def _troubles(graph: Graph, seen: LevelCourses, *, is_top: bool) -> Iterator[FlatteningReason]:
    """Yield, as reasons, the troubles of a graph's courses (`seen`) that the flat graph would not
    have. `is_top`: it is no sub-graph, so that some troubles do not matter."""
    names = {action.key: action.full_name for action in graph.actions}
    for trouble in seen.troubles:
        if is_top and trouble.kind in OF_INNER:
            continue
        key = trouble.action
        at = (HierarchyLevel(graph.name, key, names[key]),) if key is not None else ()
        yield of_trouble(trouble, at)


def _put(
    flat: _Flat, at: HierarchyLevel, inner: _Flat, place: JoinedPlace, kept: set[str]
) -> _Flat:
    found = inlined(flat.graph, at.key, inner.graph, place, kept)
    below = {found.keys[key]: (at, *levels) for key, levels in inner.origins.items()}
    left = tuple(LeftOut((at, *each.levels), each.fields) for each in inner.left_out)
    return flat._replace(
        graph=found.graph, origins={**flat.origins, **below}, left_out=flat.left_out + left
    )


def _origins(graph: Graph, subs: Container[Key]) -> Iterator[tuple[Key, LevelPath]]:
    for action in graph.actions:
        if action.key not in subs:
            yield action.key, (HierarchyLevel(graph.name, action.key, action.full_name),)


def _unknown(graph: Graph, flats: Mapping[Key, _Flat]) -> tuple[LeftOut, ...]:
    """Return the descriptions and unknown fields, which a flat graph cannot have, of the actions
    that were sub-graphs (`flats`, by key) and of these graphs."""
    found = []
    for action in graph.actions:
        if (flat := flats.get(action.key)) is not None:
            fields = ["description"] if action.description or flat.graph.description else []
            fields += [field for field, _ in (*action.extra, *flat.graph.extra)]
            at = (HierarchyLevel(graph.name, action.key, action.full_name),)
            found += [LeftOut(at, tuple(dict.fromkeys(fields)))] if fields else []
    return tuple(found)


def _plain(graph: Graph) -> Iterator[FlatOrigin]:
    for action in graph.actions:
        at = HierarchyLevel(graph.name, action.key, action.full_name)
        yield FlatOrigin(action.key, action.full_name, (at,))


def _named(flat: _Flat) -> Flattened:
    """Return the flat graph with a key of twelve characters for each action that comes from a
    sub-graph."""
    keys: dict[Key, Key] = {key: key for key, levels in flat.origins.items() if len(levels) == 1}
    for key, levels in flat.origins.items():
        if key not in keys:
            keys[key] = identity((level.key for level in levels), keys.values())
    paths = {keys[key]: each for key, each in flat.origins.items()}
    graph = under_keys(flat.graph, keys)
    origins = tuple(FlatOrigin(a.key, a.full_name, paths[a.key]) for a in graph.actions)
    return Flattened(graph, origins, flat.left_out)
