"""Opens the sub-graphs of a graph for a led run, whose steps are then the actions inside of them.

The opened graph is the flat graph (docs/decisions/069-flatten.md) under the name of the graph itself. It
remembers in which sub-graphs its actions stand, and takes the breakpoints of the graph and of the graphs
inside. Pure. See docs/decisions/153-levels-are-opened-at-the-start.md and
docs/decisions/154-breakpoints-inside-are-named-by-the-start.md.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Final, NamedTuple, TypeAlias

import msgspec
from msgspec.structs import replace

from action_assistant.umrf.breakpoints import (
    TOLD,
    Breakpoint,
    NoSuchPlace,
    Told,
    bypasses,
    goes_on,
    pinned,
)
from action_assistant.umrf.hierarchy.flattening import FlatOrigin, Flattened, flattened
from action_assistant.umrf.hierarchy.reasons import LevelPath
from action_assistant.umrf.model import ENTRY, EXIT, Graph
from action_assistant.umrf.questions import is_asked

#: The full names of the actions that stand for the sub-graphs around an action, the outermost first.
Levels: TypeAlias = tuple[str, ...]

_BUDGET: Final = 200_000  # states that are examined for one start


class CannotOpen(ValueError):
    """No graph without graphs inside is known to do the same; the text says why."""


class OpenedGraph(msgspec.Struct, frozen=True):
    """A graph whose sub-graphs are opened. `levels`: of each action from a sub-graph, by full name;
    `paths`: of each action, by full name, its levels from the graph down to the action itself."""

    graph: Graph
    levels: dict[str, Levels]
    paths: dict[str, LevelPath]


def opened(graph: Graph, inside: Mapping[str, Graph]) -> OpenedGraph:
    """Return the graph with the actions of its sub-graphs in place of the actions that stand for these.
    `inside`: the sub-graphs by name. Raise CannotOpen if that is not known to do the same."""
    flat = flattened(graph, inside, budget=_BUDGET)
    if not isinstance(flat, Flattened):
        first = flat.reasons[0]
        place = f"{' › '.join(each.action for each in first.at)}: " if first.at else ""
        raise CannotOpen(
            "The actions inside cannot be led one by one, since that is not known to do the same. "
            f"{place}{first.message}"
        )
    levels = {
        each.action: tuple(one.action for one in each.levels[:-1])
        for each in flat.origins
        if len(each.levels) > 1
    }
    own = {each.key: _own_actor(each, inside) for each in flat.origins if len(each.levels) > 1}
    actions = tuple(
        replace(each, actor=own[each.key]) if each.key in own and is_asked(each) else each
        for each in flat.graph.actions
    )
    paths = {each.action: each.levels for each in flat.origins}
    return OpenedGraph(replace(flat.graph, name=graph.name, actions=actions), levels, paths)


def _own_actor(origin: FlatOrigin, inside: Mapping[str, Graph]) -> str:
    """Return the actor that an action inside names itself: people are asked as nobody else's robot."""
    last = origin.levels[-1]
    return next(each.actor for each in inside[last.graph].actions if each.key == last.key)


def opened_breakpoints(
    found: OpenedGraph, breakpoints: Iterable[Breakpoint], inside: Mapping[str, Graph]
) -> tuple[Breakpoint, ...]:
    """Return breakpoints for an opened graph, one for each place. `inside`: the sub-graphs by name.

    One before an action that is opened counts before each action with which that begins, and one at its
    end at the end of each with which it ends, or by which the last ones are bypassed. One of a sub-graph
    counts wherever that stands; at its exit it counts at the end of the action, wherever the arrows around
    lead. Visits and values of an action that is opened, and visits in a sub-graph, which counts them anew
    each time, are no condition: the run waits more often, never less. Raise NoSuchPlace for a breakpoint
    for which nothing stands."""
    given = tuple(breakpoints)
    top = _Places(found, ())
    wanted: list[tuple[Breakpoint, Sequence[_Places]]] = [
        (each, (top,)) for each in given if not each.inside
    ]
    for name in sorted({each.inside for each in given} - {""}):
        own = [replace(each, inside="") for each in given if each.inside == name]
        standing = _standing(found, name)
        wanted += [(replace(each, inside=name), standing) for each in _placed(inside, name, own)]
    kept: dict[tuple[str, str, bool], Breakpoint] = {}
    for each, places in wanted:
        by_place = [tuple(one.translated(each)) for one in places]
        if not all(by_place) or not by_place:
            raise NoSuchPlace(
                f"With its sub-graphs opened, the graph has no place for a breakpoint {each.words()}."
            )
        for one in (one for translated in by_place for one in translated):
            place = (one.action, one.to, one.is_at_end)
            kept[place] = _either(kept[place], one) if place in kept else one
    return tuple(kept.values())


def _either(one: Breakpoint, other: Breakpoint) -> Breakpoint:
    """Return a breakpoint for the place of these two that waits wherever one of them does."""
    both = {*one.outcomes, *other.outcomes} if one.outcomes and other.outcomes else set[Told]()
    return replace(
        one,
        visit=one.visit if one.visit == other.visit else 0,
        outcomes=tuple(each for each in TOLD if each in both),
        value=one.value if one.value == other.value else None,
    )


class _Arrow(NamedTuple):
    """An arrow by the full names of its ends. `goes_on`, `bypasses`: the outcomes by which it does."""

    by: str
    to: str
    goes_on: Collection[Told]
    bypasses: Collection[Told]


def _standing(found: OpenedGraph, name: str) -> tuple["_Places", ...]:
    """Return the places of the sub-graph `name`, for each time that it stands in an opened graph."""
    around = (
        path[:depth]
        for path in found.paths.values()
        for depth in range(1, len(path))
        if path[depth].graph == name
    )
    return tuple(_Places(found, each) for each in dict.fromkeys(around))


def _placed(
    inside: Mapping[str, Graph], name: str, own: Sequence[Breakpoint]
) -> tuple[Breakpoint, ...]:
    """Return the breakpoints `own` of the sub-graph `name`, with the outcomes of their arrows. Raise
    NoSuchPlace for one that has no place there."""
    if name not in inside:
        raise NoSuchPlace(f"There is no sub-graph {name}.")
    try:
        return pinned(inside[name], own)
    except NoSuchPlace as why:
        raise NoSuchPlace(f"In {name}: {why}") from None


class _Places:
    """Finds the places of an opened graph that stand for a place of one of its graphs. `around`: the
    levels down to that graph, none for the graph itself."""

    def __init__(self, found: OpenedGraph, around: LevelPath) -> None:
        names = {each.key: each.full_name for each in found.graph.actions}
        names |= {ENTRY: ENTRY, EXIT: EXIT}
        self._arrows = [
            _Arrow(names[each.parent], names[each.child], goes_on(each), bypasses(each))
            for each in found.graph.relations
        ]
        self._is_top = not around
        self._plain: dict[str, str] = {}
        self._within: dict[str, set[str]] = {}
        depth = len(around)
        for name, path in found.paths.items():
            if path[:depth] != around:
                continue
            if len(path) > depth + 1:
                self._within.setdefault(path[depth].action, set()).add(name)
            else:
                self._plain[path[depth].action] = name

    def translated(self, each: Breakpoint) -> Iterator[Breakpoint]:
        """Yield the breakpoints that stand for one of the graph."""
        if not self._is_top:
            each = replace(each, inside="", visit=0, to="" if each.to == EXIT else each.to)
        own = self._within.get(each.action)
        if own is None:
            yield from self._from_plain(each)
            return
        other = self._within.get(each.to, {self._plain.get(each.to, each.to)})
        at = replace(each, visit=0, value=None)
        if not each.is_at_end:
            into = {one.to for one in self._arrows if one.to in own and one.by not in own}
            for name in sorted(into):
                yield replace(at, action=name)
            return
        out = [one for one in self._arrows if one.by in own and one.to not in own]
        if each.to:
            out = [one for one in out if one.to in other]
            for one in out:
                if set(one.goes_on) & set(each.outcomes or TOLD):
                    yield replace(at, action=one.by, to=one.to)
        else:
            for name in sorted({one.by for one in out}):
                yield replace(at, action=name)
        for told in each.outcomes or TOLD:
            last = {one.by for one in out if not each.to or told in one.goes_on}
            for name in sorted(self._bypassing(own, last, told)):
                yield replace(at, action=name, to="", outcomes=(told,))

    def _from_plain(self, each: Breakpoint) -> Iterator[Breakpoint]:
        """Yield what stands for a breakpoint of an action that is not opened."""
        action = self._plain.get(each.action, each.action)
        other = self._within.get(each.to)
        if other is None:
            yield replace(each, action=action, to=self._plain.get(each.to, each.to))
            return
        for one in self._arrows:
            is_there = one.by == action and one.to in other
            if is_there and set(one.goes_on) & set(each.outcomes or TOLD):
                yield replace(each, action=action, to=one.to)

    def _bypassing(self, own: set[str], last: set[str], told: Told) -> set[str]:
        """Return the actions inside (of `own`) that end it by an end `told` of theirs, since that
        bypasses what follows them, up to one of `last`."""
        found: set[str] = set()
        while (
            more := {
                one.by
                for one in self._arrows
                if one.by in own and one.to in found | last and told in one.bypasses
            }
            - found
        ):
            found |= more
        return found
