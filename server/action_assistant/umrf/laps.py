"""Finds the actions of a graph that can run more than once, as far as its arrows tell.

See docs/umrf-and-the-engine.md 2.3, 2.9 and 2.10. Two observations of a running action belong to
the same run of it only if it cannot have begun again in between; an engine counts nothing.
"""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence

import msgspec
from msgspec.structs import replace

from action_assistant.umrf.model import ENTRY, PRECONDITIONS, Graph, Key, Precondition, Relation


class Laps(msgspec.Struct, frozen=True, omit_defaults=True):
    """Facts about how often the actions of one graph can run.

    `once`: full names of actions that run at most once. `barring_errors`: the actions of `once` for
    which this holds only until an action fails, since a failure is passed on past a join. `stops`:
    True if the graph itself stops or pauses actions, or runs spontaneous ones; `once` is then
    empty. `needs`: (action, parent, count) for each action that is not in `once` and that only this
    parent starts; the entry starts the action `count` times in addition. For a graph inside another
    one, which may begin again as a whole, `needs` covers the actions of `once`, too.
    """

    once: tuple[str, ...] = ()
    barring_errors: tuple[str, ...] = ()
    stops: bool = False
    needs: tuple[tuple[str, str, int], ...] = ()


def laps(graph: Graph, *, inside: bool = False) -> Laps:
    """Return how often the actions of a graph can run, as far as its arrows show; no graph makes it
    fail. `inside`: True for a graph that runs as a sub-graph of another one."""
    if _stops(graph):
        return Laps(stops=True)
    known = _walked(graph)
    names = Counter(each.full_name for each in graph.actions)
    once = {
        each.full_name: known[each.key]
        for each in graph.actions
        if each.key in known and names[each.full_name] == 1
    }
    barring = tuple(name for name, joined in once.items() if joined)
    return Laps(tuple(once), barring, needs=tuple(_needs(graph, () if inside else once, names)))


def repeated(graph: Graph) -> set[Key]:
    """Return the keys of the actions of a graph that can run more than once, as far as its arrows
    show: they are spontaneous, several parents may start them one after the other, or they lie on
    or after such actions or a loop.

    Unlike `laps`, this does not take stops for failures: a stop ends a run and begins none.
    """
    arrows = []
    for arrow in graph.relations:
        answers = {
            outcome: answer if answer in {"run", "bypass"} else "ignore"
            for outcome in PRECONDITIONS
            for answer in [arrow.conditions.answer(outcome)]
        }
        if arrow.parent == ENTRY or set(answers.values()) != {"ignore"}:
            arrows.append(replace(arrow, conditions=replace(arrow.conditions, **answers)))
    return {a.key for a in graph.actions} - _walked(replace(graph, relations=tuple(arrows))).keys()


def _needs(
    graph: Graph, once: Collection[str], names: Mapping[str, int]
) -> Iterator[tuple[str, str, int]]:
    """Yield (action, parent, count), with full names, for each action that only this one parent
    starts. The entry starts the action `count` times in addition, as in `Laps.needs`. `once`: full
    names of actions to skip. `names`: how many actions have each full name; a name that several
    actions have is skipped. So is an action that a bypass of its parent could start: the parent
    then does not run, but passes on an outcome for which the action runs."""
    called = {each.key: each.full_name for each in graph.actions if names[each.full_name] == 1}
    arriving: dict[Key, list[Relation]] = {}
    for arrow in graph.relations:
        arriving.setdefault(arrow.child, []).append(arrow)
    for child, name in called.items():
        running = [each for each in arriving.get(child, []) if _runs(each)]
        parents = {each.parent for each in running} - {ENTRY}
        if name in once or len(parents) != 1 or parents == {child}:
            continue
        (parent,) = parents
        passed_on = {
            outcome
            for each in arriving.get(parent, [])
            for outcome in PRECONDITIONS
            if each.parent != ENTRY and each.conditions.answer(outcome) == "bypass"
        }
        runs = {outcome for each in running if each.parent == parent for outcome in _runs(each)}
        if parent in called and passed_on.isdisjoint(runs):
            yield name, called[parent], sum(each.parent == ENTRY for each in running)


def _runs(arrow: Relation) -> list[Precondition]:
    """Return the outcomes of its parent to which an arrow responds by running its child."""
    if arrow.parent == ENTRY:
        return ["on_true"]
    return [each for each in PRECONDITIONS if arrow.conditions.answer(each) == "run"]


def _stops(graph: Graph) -> bool:
    answers = {
        each.conditions.answer(outcome) for each in graph.relations for outcome in PRECONDITIONS
    }
    spontaneous = any(each.type == "spontaneous" for each in graph.actions)
    return spontaneous or not answers.isdisjoint({"stop", "pause", "restart"})


def _walked(graph: Graph) -> dict[Key, bool]:
    """Return the actions that end at most once, by key; the value is True if this holds only as
    long as no action fails. Spontaneous actions, actions on a loop, and actions after either are
    not in the result."""
    lively = {each.key for each in graph.actions if each.type == "spontaneous"}
    arriving: dict[Key, list[Relation]] = {each.key: [] for each in graph.actions}
    leaving: dict[Key, list[Key]] = {}
    for arrow in graph.relations:
        arriving.setdefault(arrow.child, []).append(arrow)
        leaving.setdefault(arrow.parent, []).append(arrow.child)
    awaited = {key: len(arrows) for key, arrows in arriving.items()}
    ready: list[Key] = [ENTRY, *(key for key, arrows in awaited.items() if not arrows)]
    known: dict[Key, bool] = {}
    while ready:
        key = ready.pop()
        joined = _joined(arriving.get(key, []))
        if joined is None or key in lively:
            continue
        known[key] = joined or any(known[each.parent] for each in arriving.get(key, []))
        for child in leaving.get(key, []):
            awaited[child] -= 1
            if not awaited[child]:
                ready.append(child)
    return known


def _joined(arrows: Sequence[Relation]) -> bool | None:
    """Return whether an action waits for several parents. `arrows`: all that lead to it. None if
    they may let it end more than once."""
    live = [each for each in arrows if any(_live(each, outcome) for outcome in PRECONDITIONS)]
    if len(live) <= 1:
        return False
    if not all(each.required for each in arrows):
        return None
    past = {each.conditions.answer(outcome) for each in live for outcome in PRECONDITIONS[:2]}
    past |= {each.conditions.on_stopped for each in live}
    return None if "bypass" in past else True


def _live(arrow: Relation, outcome: str) -> bool:
    answer: str = getattr(arrow.conditions, outcome)
    return answer != "ignore"
