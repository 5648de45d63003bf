"""Counts how often each action of a run ran, as far as that is known. Pure.

An engine counts nothing: it shows states, and an action that runs again between two snapshots is
seen once. So a number of visits is a lower bound (`ActionRun.proven`), except where transitions
were seen, or where the graph rules out that the action runs more than once. Arrows force some of
the missed visits: an action that only one other one can start ran no more often than that one.

See docs/decisions/099-visits-that-were-missed.md.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Mapping

import msgspec

from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import ActionRun
from action_assistant.umrf.laps import Laps


class VisitCount(msgspec.Struct, frozen=True):
    """An action ran `least` times, with `at_least` perhaps more often. `seen`: the number of visits
    with times of their own."""

    least: int
    at_least: bool
    seen: int


def visit_counts(run: Run) -> dict[str, VisitCount]:
    """Return how often each action of a run ran, by its name in the run, counting visits that were
    not seen but must have happened."""
    seen = {name: each.older + len(each.visits) for name, each in run.actions.items()}
    exact = {name for name, each in run.actions.items() if _is_exact(run, name, each)}
    inside = tuple(_inside(run)) if run.inner else ()
    for name, around, laps in inside:  # outer ones first
        node = name.rpartition("/")[2]
        if around in exact and node in laps.once and node not in laps.barring_errors:
            exact.add(name)
    needs = () if run.reshaped else (*run.needs, *_needs_inside(inside))
    proven = {
        name: number if name in exact else max(number, run.actions[name].proven)
        for name, number in seen.items()
    }
    least = _forced(proven, needs) if needs else proven
    return {
        name: VisitCount(least[name], name not in exact, number) for name, number in seen.items()
    }


def _is_exact(run: Run, name: str, action: ActionRun) -> bool:
    """Return whether every visit of this action was seen for certain. `name`: the name of the
    action in the run, with a "/" inside of a sub-graph."""
    if "/" in name and run.led is not None:
        return False  # a robot shows what is inside of a piece, and may miss visits
    if action.by == "" and action.visits:
        return True  # shown by transitions
    if "/" in name:
        return False
    if not action.visits and action.state == "UNINITIALIZED":
        return True  # no action of a graph goes back to that
    return action.once and not run.reshaped and not (action.joined and run.failed)


def _inside(run: Run) -> Iterator[tuple[str, str, Laps]]:
    """Yield the actions inside of sub-graphs, those of outer sub-graphs first. Each item: the name
    in the run, the name of the action around it, and the `Laps` of its graph (which of its actions
    run only once)."""
    inside: dict[str, list[str]] = {}
    for name in run.actions:
        part, mark, node = name.rpartition("/")
        if mark:
            inside.setdefault(part, []).append(node)
    known = deque((run.graph_name, name, name) for name in run.actions if "/" not in name)
    while known and inside:
        above, node, name = known.popleft()
        graph, _, number = node.rpartition("_")
        part = f"{above}__{graph}__{number}"
        for each in inside.pop(part, ()):
            key = f"{part}/{each}"
            if graph in run.inner:
                yield key, name, run.inner[graph]
            known.append((part, each, key))


def _needs_inside(inside: Iterable[tuple[str, str, Laps]]) -> Iterator[tuple[str, str, int]]:
    """Yield, for actions in sub-graphs, the actions that must run for them to run, as (action,
    needed action, visits possible without it). The needed action is the only parent, or the action
    around the sub-graph. `inside`: as `_inside` yields."""
    needs: dict[str, Mapping[str, str]] = {}
    for name, around, laps in inside:
        part, _, node = name.rpartition("/")
        alone = needs.get(part)
        if alone is None:
            alone = {child: parent for child, parent, besides in laps.needs if not besides}
            needs[part] = alone
        if node in laps.once and node not in laps.barring_errors:
            yield name, around, 0
        if node in alone:
            yield name, f"{part}/{alone[node]}", 0


def _forced(proven: Mapping[str, int], needs: Iterable[tuple[str, str, int]]) -> dict[str, int]:
    """Return the least number of visits of each action. `proven`: the numbers that observations
    prove; `needs`: items (action, parent, count): the action ran at most `count` times more often
    than its parent, so that a visit of it may prove one of the parent."""
    least = dict(proven)
    parents: dict[str, list[tuple[str, int]]] = {}
    for child, parent, besides in needs:
        parents.setdefault(child, []).append((parent, besides))
    raised = list(parents)
    while raised:
        child = raised.pop()
        for parent, besides in parents.get(child, ()):
            if parent in least and least[parent] < least.get(child, 0) - besides:
                least[parent] = least[child] - besides
                raised.append(parent)
    return least
