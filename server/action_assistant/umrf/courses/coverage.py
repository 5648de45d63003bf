"""Coverage: the arrows of a graph that some courses took, and the actions that ran in them. Pure.

An arrow is taken when its parent ends with that outcome and the engine asks the child for a
response other than to ignore it, whether or not the child is ready (docs/contracts.md 5.1, `edge`).
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import Final

import msgspec

from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    PRECONDITIONS,
    Graph,
    Key,
    Precondition,
    Relation,
)
from action_assistant.umrf.semantics.parts import ENTRY_NODE, EXIT_NODE
from action_assistant.umrf.semantics.trace import EdgeEval, NodeStateEvent, Trace

#: The most arrows and actions that an answer lists.
SHOWN: Final = 2_000


class OutcomeArrow(msgspec.Struct, frozen=True, order=True):
    """One arrow together with one outcome of its parent. `parent` and `child` are keys of actions,
    or `entry` and `exit`."""

    parent: Key
    child: Key
    outcome: Precondition


class TakenArrows(msgspec.Struct, frozen=True):
    """The arrows that one course took, and the keys of the actions that ran in it."""

    arrows: frozenset[OutcomeArrow]
    actions: frozenset[Key]


class ArrowCoverage(msgspec.Struct, frozen=True, kw_only=True):
    """The coverage of a graph by some courses together, as numbers of arrows and of actions.

    `taken` of `arrows` arrows were taken, `visited` of `actions` actions have run. `untaken` and
    `unvisited` list the others in file order, at most `SHOWN` of each.
    """

    arrows: int
    taken: int
    actions: int
    visited: int
    untaken: tuple[OutcomeArrow, ...] = ()
    unvisited: tuple[Key, ...] = ()


def arrows_of(graph: Graph) -> Iterator[OutcomeArrow]:
    """Yield one `OutcomeArrow` for each outcome of each arrow of a graph that its child does not
    ignore, in file order and without repetition. Arrows at missing actions are skipped."""
    ends = {action.key for action in graph.actions if not action.missing} | {ENTRY, EXIT}
    found: dict[OutcomeArrow, None] = {}
    for relation in graph.relations:
        if not ends.issuperset((relation.parent, relation.child)):
            continue
        for outcome in outcomes_of(relation):
            found[OutcomeArrow(relation.parent, relation.child, outcome)] = None
    order = {action.key: n for n, action in enumerate(graph.actions)} | {
        ENTRY: -1,
        EXIT: len(ends),
    }
    rank = {outcome: n for n, outcome in enumerate(PRECONDITIONS)}
    return iter(sorted(found, key=lambda a: (order[a.parent], order[a.child], rank[a.outcome])))


def outcomes_of(relation: Relation) -> list[Precondition]:
    """Return the outcomes of the parent of an arrow (`relation`) that its child does not ignore."""
    if relation.parent == ENTRY:
        return ["on_true"]  # the entry reports no other outcome, whatever the conditions say
    return [o for o in PRECONDITIONS if relation.conditions.answer(o) != "ignore"]


def arrows_taken(graph: Graph, traces: Iterable[Trace]) -> TakenArrows:
    """Return the arrows of this graph that were taken and its actions that ran, according to the
    trace events of one course or run (`traces`). Events of its sub-graphs are not counted."""
    arrows: set[OutcomeArrow] = set()
    actions: set[Key] = set()
    for event in _events(graph, traces):
        if isinstance(event, OutcomeArrow):
            arrows.add(event)
        else:
            actions.add(event)
    return TakenArrows(frozenset(arrows), frozenset(actions))


def arrows_taken_opened(
    graph: Graph, tops: Mapping[str, Key], flat: Graph, traces: Iterable[Trace]
) -> TakenArrows:
    """Return the arrows of a graph that were taken, and its actions that ran, according to the trace events
    of a course with its sub-graphs opened. `flat`: the opened graph; `tops`: by the full name of each of
    its actions the key of the action of `graph` in whose place it is. An arrow after a sub-graph is
    taken with the outcome of the action that ends the sub-graph: of the last one, where several have to."""
    top = {each.key: tops[each.full_name] for each in flat.actions} | {ENTRY: ENTRY, EXIT: EXIT}
    awaited: defaultdict[tuple[Key, Key], set[Key]] = defaultdict(set)
    for relation in flat.relations:
        if relation.required:
            awaited[top[relation.parent], relation.child].add(relation.parent)
    ended: defaultdict[tuple[Key, Key], set[Key]] = defaultdict(set)
    own = frozenset(arrows_of(graph))
    arrows: set[OutcomeArrow] = set()
    actions: set[Key] = set()
    for event in _events(flat, traces):
        if not isinstance(event, OutcomeArrow):
            actions.add(top[event])
            continue
        place = top[event.parent], event.child
        if event.parent in awaited[place]:
            ended[place].add(event.parent)
            if ended[place] != awaited[place]:
                continue
            ended[place].clear()
        arrows.add(OutcomeArrow(top[event.parent], top[event.child], event.outcome))
    return TakenArrows(own.intersection(arrows), frozenset(actions))


def _events(graph: Graph, traces: Iterable[Trace]) -> Iterator[OutcomeArrow | Key]:
    """Yield each arrow of a graph as it is taken, and each action, by key, as it runs."""
    keys = {a.full_name: a.key for a in graph.actions if not a.missing}
    ends = keys | {ENTRY_NODE: ENTRY, EXIT_NODE: EXIT}
    labels = {f"{p} => {c}": (ends[p], ends[c]) for p, c in _pairs(graph, ends)}
    outcomes: dict[str, Precondition] = {outcome: outcome for outcome in PRECONDITIONS}
    for trace in traces:
        match trace:
            case EdgeEval(graph=graph.name, edge=edge, eval=answer) if edge in labels:
                result, _, response = answer.partition(" -> ")
                outcome = outcomes.get(result)
                if outcome is not None and response != "ignore":
                    yield OutcomeArrow(*labels[edge], outcome)
            case NodeStateEvent(graph=graph.name, node=node, state="RUNNING") if node in keys:
                yield keys[node]
            case _:
                pass


def _pairs(graph: Graph, ends: dict[str, Key]) -> Iterator[tuple[str, str]]:
    names = {key: name for name, key in ends.items()}
    for relation in graph.relations:
        if relation.parent in names and relation.child in names:
            yield names[relation.parent], names[relation.child]


def coverage(graph: Graph, courses: Iterable[TakenArrows]) -> ArrowCoverage:
    """Return the coverage of a graph by `courses` together: an arrow or action counts if any of
    them took or ran it."""
    took: set[OutcomeArrow] = set()
    came: set[Key] = set()
    for each in courses:
        took |= each.arrows
        came |= each.actions
    arrows = list(arrows_of(graph))
    actions = [action.key for action in graph.actions if not action.missing]
    untaken = [arrow for arrow in arrows if arrow not in took]
    unvisited = [key for key in actions if key not in came]
    return ArrowCoverage(
        arrows=len(arrows),
        taken=len(arrows) - len(untaken),
        actions=len(actions),
        visited=len(actions) - len(unvisited),
        untaken=tuple(untaken[:SHOWN]),
        unvisited=tuple(unvisited[:SHOWN]),
    )
