"""Finds the place of each action of a run among its levels: an engine names actions inside
`OUTER__NAME__ID/ACTION`. Pure.

See docs/umrf-and-the-engine.md 2.6 and docs/decisions/073-a-run-by-its-levels.md. The page follows
the same rule (`frontend/src/status/level-places.ts`), and tests/vectors/levels.json tests both.
"""

from collections import defaultdict, deque
from collections.abc import Collection, Iterable
from typing import Final

import msgspec

from action_assistant.runner.runs.run import Run

#: Separator of levels in texts for people.
INTO: Final = " › "


class LevelPlace(msgspec.Struct, frozen=True):
    """The place of an action in the hierarchy of a run. `levels`: the full names of the actions
    around it, outermost first; `name`: its own. `known`: false if its name fits no level; it then
    counts as top level."""

    levels: tuple[str, ...]
    name: str
    known: bool = True

    @property
    def way(self) -> tuple[str, ...]:
        """The full names from the outermost action down to this one."""
        return (*self.levels, self.name)


def part_of(graph: str, action: str) -> str:
    """Return the running name of the sub-graph that an action of `graph` stands for."""
    name, _, number = action.rpartition("_")
    return f"{graph}__{name}__{number}"


def places(graph: str, own: Collection[str], names: Iterable[str]) -> dict[str, LevelPlace]:
    """Return the place in the hierarchy of each of the action names `names`, in a run of `graph`,
    whose own actions are `own`. Names are matched level by level from the top, so that marks inside
    of names do not mislead; every name gets a place."""
    found = {name: LevelPlace((), name, name in own or "/" not in name) for name in names}
    parts = _by_part(graph, (name for name, place in found.items() if not place.known))
    held = [place for place in found.values() if place.known]
    lacking = [LevelPlace((), name) for name in own if name not in found]
    open_ = deque((graph, place) for place in (*held, *lacking))
    while open_ and parts:
        above, place = open_.popleft()
        part = part_of(above, place.name)
        for name in parts.pop(part, ()):
            if found[name].known:
                continue
            found[name] = LevelPlace(place.way, name[len(part) + 1 :])
            open_.append((part, found[name]))
    return found


def places_of(run: Run) -> dict[str, LevelPlace]:
    """Return the place of each action of a run among the levels of its hierarchy, by the name of
    the action in the run."""
    own = {name for name, action in run.actions.items() if action.aid is not None}
    return places(run.graph_name, own, run.actions)


def within(found: dict[str, LevelPlace], action: str) -> list[str]:
    """Return the names of the actions directly inside of `action`. `found`: the place of each
    action by name."""
    way = found[action].way
    return [name for name, place in found.items() if place.levels == way]


def _by_part(graph: str, names: Iterable[str]) -> dict[str, list[str]]:
    """Return the given names of actions by each prefix that may be the running name of their
    sub-graph. Several prefixes of one name may, since names of sub-graphs and actions can both
    contain a slash."""
    parts: dict[str, list[str]] = defaultdict(list)
    for name in names:
        at = name.find("/", len(graph)) if name.startswith(f"{graph}__") else -1
        while at >= 0:
            parts[name[:at]].append(name)
            at = name.find("/", at + 1)
    return parts
