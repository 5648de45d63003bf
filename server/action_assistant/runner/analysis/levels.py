"""Where each fact of a run belongs: an engine tells what runs inside as `OUTER__NAME__ID/ACTION`. Pure.

See docs/umrf-and-the-engine.md 2.6 and docs/decisions/073-a-run-by-its-levels.md. The page places by the same
rule (`frontend/src/status/level-places.ts`), and both are held to tests/vectors/levels.json.
"""

from collections import defaultdict, deque
from collections.abc import Collection, Iterable
from typing import Final

import msgspec

from action_assistant.runner.runs.run import Run

#: Between the levels, as people read them.
INTO: Final = " › "


class LevelPlace(msgspec.Struct, frozen=True):
    """Of an action in a run. `levels`: the actions that it is inside of, outermost first, by their full
    names; `name`: its own. `known`: false where its name fits nowhere; then it stands at the top."""

    levels: tuple[str, ...]
    name: str
    known: bool = True

    @property
    def way(self) -> tuple[str, ...]:
        """From the outermost action down to itself."""
        return (*self.levels, self.name)


def part_of(graph: str, action: str) -> str:
    """How an engine calls the graph that an action of `graph` stands for."""
    name, _, number = action.rpartition("_")
    return f"{graph}__{name}__{number}"


def places(graph: str, own: Collection[str], names: Iterable[str]) -> dict[str, LevelPlace]:
    """The place of each of these names in a run of `graph`, whose own actions are `own`. Level by level
    from the top, so that marks inside of names mean nothing; nothing is left out."""
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
    """Those of all actions of a run."""
    own = {name for name, action in run.actions.items() if action.aid is not None}
    return places(run.graph_name, own, run.actions)


def within(found: dict[str, LevelPlace], action: str) -> list[str]:
    """The actions right inside of one, by the names of `found`."""
    way = found[action].way
    return [name for name, place in found.items() if place.levels == way]


def _by_part(graph: str, names: Iterable[str]) -> dict[str, list[str]]:
    """Names by all that may be the graph in front of the action: both may have the mark inside."""
    parts: dict[str, list[str]] = defaultdict(list)
    for name in names:
        at = name.find("/", len(graph)) if name.startswith(f"{graph}__") else -1
        while at >= 0:
            parts[name[:at]].append(name)
            at = name.find("/", at + 1)
    return parts
