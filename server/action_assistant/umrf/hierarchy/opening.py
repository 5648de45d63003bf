"""Opens the sub-graphs of a graph for a led run, whose steps are then the actions inside of them.

The opened graph is the flat graph (docs/decisions/069-flatten.md) under the name of the graph itself. It
remembers in which sub-graphs its actions stand, and takes the breakpoints of the graph. Pure. See
docs/decisions/153-levels-are-opened-at-the-start.md.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Final, TypeAlias

import msgspec
from msgspec.structs import replace

from action_assistant.umrf.breakpoints import Breakpoint, goes_on
from action_assistant.umrf.hierarchy.flattening import FlatOrigin, Flattened, flattened
from action_assistant.umrf.model import ENTRY, EXIT, Graph
from action_assistant.umrf.parameters import flat_name
from action_assistant.umrf.questions import is_asked

#: The full names of the actions that stand for the sub-graphs around an action, the outermost first.
Levels: TypeAlias = tuple[str, ...]

_BUDGET: Final = 200_000  # states that are examined for one start


class CannotOpen(ValueError):
    """No graph without graphs inside is known to do the same; the text says why."""


class OpenedGraph(msgspec.Struct, frozen=True):
    """A graph whose sub-graphs are opened. `levels`: of each action from a sub-graph, by full name."""

    graph: Graph
    levels: dict[str, Levels]


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
    return OpenedGraph(replace(flat.graph, name=graph.name, actions=actions), levels)


def _own_actor(origin: FlatOrigin, inside: Mapping[str, Graph]) -> str:
    """Return the actor that an action inside names itself: people are asked as nobody else's robot."""
    last = origin.levels[-1]
    return next(each.actor for each in inside[last.graph].actions if each.key == last.key)


def opened_breakpoints(
    found: OpenedGraph, breakpoints: Iterable[Breakpoint]
) -> tuple[Breakpoint, ...]:
    """Return breakpoints for an opened graph. One before an action that is opened counts before each
    action with which that begins, and one at its end at the end of each with which it ends. A value
    that such an action does not have is no condition any more, so that the run waits more often, never
    less."""
    places = _Places(found)
    translated = [one for each in breakpoints for one in places.translated(each)]
    first: dict[tuple[str, str, bool], Breakpoint] = {}
    for each in translated:
        first.setdefault((each.action, each.to, each.is_at_end), each)
    return tuple(first.values())


class _Places:
    """Finds the places of an opened graph that stand for a place of the graph."""

    def __init__(self, found: OpenedGraph) -> None:
        self._actions = {each.full_name: each for each in found.graph.actions}
        names = {each.key: each.full_name for each in found.graph.actions}
        names |= {ENTRY: ENTRY, EXIT: EXIT}
        self._arrows = [
            (names[each.parent], names[each.child], frozenset(goes_on(each)))
            for each in found.graph.relations
        ]
        self._within: dict[str, set[str]] = {}
        for name, levels in found.levels.items():
            self._within.setdefault(levels[0], set()).add(name)

    def translated(self, each: Breakpoint) -> Iterator[Breakpoint]:
        """Yield the breakpoints that stand for one of the graph."""
        own, other = (self._within.get(name, {name}) for name in (each.action, each.to))
        if own == {each.action} and other == {each.to}:
            yield each
        elif each.to:
            yield from self._on_arrows(each, own, other)
        elif each.is_at_end:
            for name in sorted(self._last(own)):
                yield self._at(each, name)
        else:
            firsts = {to for by, to, _ in self._arrows if to in own and by not in own}
            for name in sorted(firsts):
                yield self._at(each, name)

    def _on_arrows(self, each: Breakpoint, own: set[str], other: set[str]) -> Iterator[Breakpoint]:
        for by, to, outcomes in self._arrows:
            if by in own and to in other and outcomes & set(each.outcomes or outcomes):
                yield self._at(each, by, to)

    def _last(self, own: set[str]) -> set[str]:
        return {by for by, to, outcomes in self._arrows if by in own and to not in own and outcomes}

    def _at(self, each: Breakpoint, action: str, to: str = "") -> Breakpoint:
        value, there = each.value, self._actions[action]
        if value is not None:
            slots = there.outputs if each.is_at_end else there.inputs
            if value.name not in {flat_name(one.path) for one in slots}:
                value = None
        return replace(each, action=action, to=to, value=value)
