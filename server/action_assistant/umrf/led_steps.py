"""Finds actions of one robot that would go as one step of a led run, if somebody made a sub-graph of
them.

That is said beside what it would take away: two actions of one robot at once, and an action that is
loaded anew for each visit. It is said only if the sub-graph is proven to do the same
(docs/decisions/072-make-and-unpack-a-sub-graph.md). Pure.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from action_assistant.umrf.checks.actors import led_problems
from action_assistant.umrf.components import components
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.hierarchy.extraction import Extracted, extracted
from action_assistant.umrf.model import Action, Graph, Key, Problem

_LARGEST: Final = 60  # actions of a graph in which such actions are looked for
_MOST: Final = 12  # actions that are made one step
_TRIED: Final = 4  # problems of each kind, and sets of actions in all, that are looked at
_BUDGET: Final = 50_000  # states that are examined for one set of actions
_NAME: Final = "\N{SYMBOL FOR NULL}"  # of the sub-graph that is tried: no graph has it
_KEY: Final = "\N{SYMBOL FOR NULL}"


def as_one_step(graph: Graph, problems: Sequence[Problem], facts: EngineFacts) -> dict[str, str]:
    """Return sentences that propose to move some actions into a sub-graph, by the code of a
    problem. Moving the actions that a sentence names would solve at least the first problem with
    that code. A code is missing if no such actions were found. `graph`: has the robot of each
    action as its actor; `problems`: the result of `led_problems`; `facts`: the engine build."""
    found: dict[str, str] = {}
    if len(graph.actions) > _LARGEST:
        return found
    for code in ("two-at-once", "loaded-anew"):
        listed = [each for each in problems if each.code == code and each.where.aid is not None]
        tried: set[frozenset[Key]] = set()
        for problem in listed[:_TRIED]:
            for chosen in _candidates(graph, problem):
                if chosen in tried or len(tried) == _TRIED:
                    continue
                tried.add(chosen)
                if code not in found and _helps(graph, chosen, code, facts):
                    found[code] = _sentence(graph, chosen)
    return found


def _candidates(graph: Graph, problem: Problem) -> Iterator[frozenset[Key]]:
    """Yield sets of actions of one robot which, as one step, may not have this problem, small sets
    first."""
    actions = {each.key: each for each in graph.actions if not each.missing}
    keys = [each for each in (problem.where.aid, *(w.aid for w in problem.also)) if each in actions]
    robot = actions[keys[0]].actor if keys else ""
    own = {key for key, each in actions.items() if each.actor == robot}
    around = set[Key]().union(*(each for each in _neighbours(graph, own) if each & set(keys)))
    if problem.code == "two-at-once":
        sets = [frozenset(keys), frozenset(around)] if own.issuperset(keys) else []
    else:
        circles = (each for each in _circles(graph, actions) if keys and keys[0] in each)
        circle = next(circles, set[Key]())
        sets = [frozenset(circle), frozenset(around)] if circle <= own else []
    for each in sets:
        if 1 < len(each) <= _MOST and each.issuperset(keys):
            yield each


def _circles(graph: Graph, actions: Mapping[Key, Action]) -> Iterator[set[Key]]:
    """Yield the sets of actions (by key) that lie on a loop together; an action on no loop is a set
    alone."""
    keys = list(actions)
    place = {key: number for number, key in enumerate(keys)}
    ways: list[list[int]] = [[] for _ in keys]
    for each in graph.relations:
        if each.parent in place and each.child in place:
            ways[place[each.parent]].append(place[each.child])
    for circle in components(ways):
        yield {keys[number] for number in circle}


def _neighbours(graph: Graph, own: set[Key]) -> Iterator[set[Key]]:
    """Yield the sets of those actions in `own` that arrows connect, directly or over other actions
    in `own`."""
    left = set(own)
    while left:
        seen, open_ = set[Key](), [left.pop()]
        while open_:
            key = open_.pop()
            seen.add(key)
            ends = [(each.parent, each.child) for each in graph.relations]
            beside = {b for a, b in ends if a == key} | {a for a, b in ends if b == key}
            open_ += beside & left
            left -= beside
        yield seen


def _helps(graph: Graph, chosen: frozenset[Key], code: str, facts: EngineFacts) -> bool:
    """Return whether the graph does the same with the actions `chosen` in a sub-graph, and the
    action that stands for that has no problem with this code. `facts`: the engine build."""
    found = extracted(graph, chosen, _NAME, _KEY, budget=_BUDGET)
    if not isinstance(found, Extracted) or found.differences:
        return False
    left = [each for each in led_problems(found.outer, facts) if each.code == code]
    return not any(_KEY in {each.where.aid, *(w.aid for w in each.also)} for each in left)


def _sentence(graph: Graph, chosen: frozenset[Key]) -> str:
    *names, last = [each.full_name for each in graph.actions if each.key in chosen]
    return f"Make a sub-graph of {', '.join(names)} and {last}: then they go as one step."
