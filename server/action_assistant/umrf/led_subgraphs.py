"""Sub-graphs in a graph that robots are led through: who plays them, and how they end.

A sub-graph whose actions one robot plays is sent to it as one piece, under a name of its own per
visit: an engine survives no second start of a name with a sub-graph (docs/decisions/026-names-that-are-held.md). An action
that stands for a graph is FINISHED also after an error inside, so that the states of the piece alone
do not tell false from error; those of the actions inside often do. See docs/decisions/113-led-runs.md. Pure.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Final, TypeAlias

import msgspec

from action_assistant.umrf.hierarchy.flattening import Flattened, flattened
from action_assistant.umrf.laps import repeated
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    PRECONDITIONS,
    Action,
    Graph,
    Key,
    Precondition,
)
from action_assistant.umrf.pieces import Obstacle, outcome_of

#: The graphs for which actions stand, by name, at any depth.
Inside: TypeAlias = Mapping[str, Graph]

_ANY: Final[frozenset[Precondition]] = frozenset(PRECONDITIONS)
_NONE: Final[frozenset[Precondition]] = frozenset()
_NAMED: Final = 3  # robots, and actions of each, in one sentence
_DEEPEST: Final = 32  # levels whose states are read
_BUDGET: Final = 200_000  # states that are examined for a refusal


class StatesInside(msgspec.Struct, frozen=True):
    """The states of the graphs that run inside of a piece, and of their actions. `graphs`: by
    running name; `actions`: by the running name of their graph, a slash and their full name."""

    graphs: Mapping[str, str]
    actions: Mapping[str, str]


# --- who plays them ---------------------------------------------------------------------------------


def actors_of(action: Action, inside: Inside) -> frozenset[str]:
    """Return the actors that carry out an action: its own, or those of the actions inside for which
    it stands. `inside`: all graphs by name. An action inside that names no actor belongs to the
    actor of the action around it; "" stands for an actor that is not named at all."""
    found = frozenset(each for each, _ in _played(action, inside))
    return found or frozenset({action.actor})


def _played(action: Action, inside: Inside) -> Iterator[tuple[str, str]]:
    """Yield the actor and the full name of each action with code of its own, from an action
    inwards. `inside`: all graphs by name. A graph that stands at several positions is read once for
    each actor around it."""
    read: set[tuple[str, str]] = set()  # graphs, each with the actor around it
    left = [(action, "")]
    while left:
        each, around = left.pop()
        actor = each.actor or around
        graph = inside.get(each.name)
        if graph is None:
            yield actor, each.full_name
        elif (each.name, actor) not in read:
            read.add((each.name, actor))
            left += [(child, actor) for child in reversed(graph.actions) if not child.missing]


def actors_in(graph: Graph, inside: Inside) -> frozenset[str]:
    """Return the actors of a graph and of the graphs inside, "" for actions without one."""
    real = (action for action in graph.actions if not action.missing)
    return frozenset[str]().union(*(actors_of(action, inside) for action in real))


def players(graph: Graph, inside: Inside, robots: Mapping[str, str]) -> dict[str, str]:
    """Return the robot of each action of a graph by full name. `robots`: the robot of each actor;
    `inside`: the sub-graphs by name. An action that stands for actions of several robots is
    missing."""
    found: dict[str, str] = {}
    for action in graph.actions:
        chosen = (
            {robots[actor] for actor in actors_of(action, inside)} if not action.missing else ()
        )
        if len(chosen) == 1:
            (found[action.full_name],) = chosen
    return found


def graphs_within(action: Action, inside: Inside) -> frozenset[str]:
    """Return the names of all graphs inside of an action; empty if it stands for no graph."""
    found: set[str] = set()
    left = [action.name]
    while left:
        name = left.pop()
        if name in inside and name not in found:
            found.add(name)
            left += [each.name for each in inside[name].actions if not each.missing]
    return frozenset(found)


def subgraph_obstacles(
    graph: Graph, inside: Inside, robots: Mapping[str, str]
) -> tuple[Obstacle, ...]:
    """Return the reasons why sub-graphs of a graph cannot run as pieces: several robots play their
    actions. `robots`: the robot of each actor; `inside`: the sub-graphs by name."""
    shared = [
        action
        for action in graph.actions
        if not action.missing and len({robots[each] for each in actors_of(action, inside)}) > 1
    ]
    if not shared:
        return ()
    remedy = _remedy(graph, inside)
    return tuple(
        Obstacle(
            code="subgraph-across",
            text=f"{action.full_name} is a sub-graph of several robots: "
            f"{_who(action, inside, robots)}. {remedy}",
            aid=action.key,
        )
        for action in shared
    )


def _who(action: Action, inside: Inside, robots: Mapping[str, str]) -> str:
    """Return, for a sentence, which robot plays which actions inside of an action."""
    names: dict[str, list[str]] = {}
    for robot, name in dict.fromkeys((robots[by], name) for by, name in _played(action, inside)):
        names.setdefault(robot, []).append(name)
    parts = [
        f"{robot} ({', '.join(own[:_NAMED])}{' …' if len(own) > _NAMED else ''})"
        for robot, own in sorted(names.items())
    ]
    more = f" and {len(parts) - _NAMED} more" if len(parts) > _NAMED else ""
    return f"{', '.join(parts[:_NAMED])}{more}"


def _remedy(graph: Graph, inside: Inside) -> str:
    """Return the sentence that says what to do about sub-graphs of several robots: flatten the
    graph, if that is possible."""
    flat = flattened(graph, inside, budget=_BUDGET)
    if isinstance(flat, Flattened):
        return "Open the sub-graphs for this start, or make one graph without graphs inside: it does the same."
    first = flat.reasons[0]
    place = f"{' › '.join(each.action for each in first.at)}: " if first.at else ""
    return (
        "That one graph without graphs inside does the same is not known: give all of it to one "
        "robot, or unpack it. "
        f"{place}{first.message}"
    )


# --- how they end -----------------------------------------------------------------------------------


def outcome_of_subgraph(
    piece: str,
    action: Action,
    states: tuple[str | None, str],
    seen: StatesInside,
    inside: Inside,
) -> Precondition | None:
    """Return the outcome of a piece that is a sub-graph; None where its states do not show it.
    `piece`: the name under which it ran; `states`: the states of the piece and of its action;
    `seen`: the states of the graphs and actions inside; `inside`: the graphs by name. The result of
    a graph is the result of the action which reached its exit. Which one did is unknown, so the
    outcome counts only if every action that may have done so has the same one."""
    by_states = outcome_of(*states)
    may_be = _results_of(_part_of(piece, action), action.name, seen, inside, 0)
    match by_states:
        case "on_true":
            return by_states if by_states in may_be else None
        case "on_false":
            left = may_be - {"on_true"}
            return next(iter(left - {"on_stopped"}), None) if len(left) == 1 else None
        case _:
            return by_states


def _part_of(around: str, action: Action) -> str:
    return f"{around}__{action.name}__{action.instance_id}"


def _results_of(
    part: str, name: str, seen: StatesInside, inside: Inside, depth: int
) -> frozenset[Precondition]:
    """Return the results that the graph `name`, which ran as `part`, can have had by the states
    `seen`. `inside`: the graphs by name; `depth`: the number of graphs around."""
    match seen.graphs.get(part):
        case "FINISHED" if depth < _DEEPEST:
            pass
        case "STOPPED":
            return frozenset({"on_stopped"})
        case _:
            return _ANY
    graph = inside[name]
    if any(each.only or each.listing for each in graph.relations):
        return _ANY
    again = repeated(graph)
    stops = any("stop" in map(each.conditions.answer, PRECONDITIONS) for each in graph.relations)
    ends = {
        action.key: _ends_of(part, action, seen, inside, depth, stops=stops)
        for action in graph.actions
        if not action.missing
    }
    passed = _with_bypassed(graph, ends, again)
    return frozenset(
        outcome
        for each in graph.relations
        if each.child == EXIT and each.parent != ENTRY
        for outcome in passed.get(each.parent, _NONE)
        if each.conditions.answer(outcome) != "ignore"
    )


def _ends_of(
    part: str, action: Action, seen: StatesInside, inside: Inside, depth: int, *, stops: bool
) -> frozenset[Precondition]:
    """Return the outcomes that the last visit of an action in the graph that ran as `part` can have
    had, by its state at the end (`seen`). `stops`: an arrow of the graph stops actions."""
    if action.type == "spontaneous":
        return _ANY
    match seen.actions.get(f"{part}/{action.full_name}"):
        case "FINISHED" if action.name in inside:
            return _results_of(_part_of(part, action), action.name, seen, inside, depth + 1)
        case "FINISHED":
            return frozenset({"on_true", "on_false", *(("on_stopped",) if stops else ())})
        case "ERROR":
            return frozenset({"on_error"})
        case "UNINITIALIZED":
            return _NONE
        case _:
            return _ANY


def _with_bypassed(
    graph: Graph, ends: Mapping[Key, frozenset[Precondition]], again: Collection[Key]
) -> dict[Key, frozenset[Precondition]]:
    """Return the outcomes that each action can have passed on: its own (`ends`, by key), and those
    by which it was bypassed. An action in a loop (`again`) can have had any outcome before its last
    one."""
    passed = dict(ends)
    arrows = [
        (each.parent, each.child, outcome)
        for each in graph.relations
        if each.parent in passed and each.child in passed
        for outcome in PRECONDITIONS
        if each.conditions.answer(outcome) == "bypass"
    ]
    is_changed = True
    while is_changed:
        is_changed = False
        for parent, child, outcome in arrows:
            passes = outcome in passed[parent] or parent in again
            if passes and outcome not in passed[child]:
                passed[child] |= {outcome}
                is_changed = True
    return passed
