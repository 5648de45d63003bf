"""The opened sub-graphs of a led start, and the places of its breakpoints. Pure."""

from collections.abc import Collection, Mapping, Sequence
from typing import Final

from action_assistant.errors import BadInput, Conflict
from action_assistant.umrf.breakpoints import Breakpoint, NoSuchPlace, pinned
from action_assistant.umrf.files import codec
from action_assistant.umrf.hierarchy.opening import (
    CannotOpen,
    Levels,
    opened,
    opened_breakpoints,
)
from action_assistant.umrf.model import Graph

_BREAKPOINTS: Final[dict[str, object]] = {"path": "/breakpoints"}


def opened_levels(
    graph: Graph, inside: Mapping[str, Graph], *, is_whole: bool
) -> tuple[Graph, dict[str, Levels]]:
    """Return a graph with its sub-graphs opened, and the sub-graphs around each of its actions. Raise
    BadInput unless the start leads the graph from its entry (`is_whole`), Conflict if the opened graph
    is not known to do the same."""
    where: dict[str, object] = {"path": "/levels"}
    if not is_whole:
        text = (
            "Only a run that is led step by step from its entry opens sub-graphs; it is continued as it "
            "was led."
        )
        raise BadInput(text, where=where)
    try:
        found = opened(graph, inside)
    except CannotOpen as why:
        raise Conflict(f"{why} Nothing was started.", where=where) from why
    return found.graph, found.levels


def pinned_opened(
    graph: Graph,
    breakpoints: Sequence[Breakpoint],
    version: Graph,
    inside: Mapping[str, Graph],
    levels: Mapping[str, Levels],
) -> tuple[Breakpoint, ...]:
    """Return the breakpoints for a run of an opened graph (`graph`, with the sub-graphs around each of its
    actions in `levels`). `version`: the graph with its sub-graphs closed, `inside` these by name. Raise
    BadInput for a breakpoint that has no place there, Conflict if the sub-graphs would be opened in another
    way today, so that nobody can say where one stands."""
    if not breakpoints:
        return ()
    try:
        found = opened(version, inside)
    except CannotOpen:
        found = None
    if found is None or found.levels != levels:
        text = "The sub-graphs of that run are opened in another way today. Start it without breakpoints."
        raise Conflict(text, where=_BREAKPOINTS)
    try:
        return pinned(graph, opened_breakpoints(found, breakpoints, inside))
    except NoSuchPlace as why:
        raise BadInput(str(why), where=_BREAKPOINTS) from why


def pinned_in(
    graph: Graph, breakpoints: Sequence[Breakpoint], *, skipped: Collection[str] = ()
) -> tuple[Breakpoint, ...]:
    """Return the breakpoints for a run of a graph. `skipped`: actions that the run leaves out, so that
    nobody waits there. Raise BadInput for a breakpoint that has no place there."""
    gone = set(skipped)
    wanted = (each for each in breakpoints if each.inside or not {each.action, each.to} & gone)
    try:
        return pinned(graph, wanted)
    except NoSuchPlace as why:
        raise BadInput(str(why), where=_BREAKPOINTS) from why


def pinned_for_text(umrf: str, breakpoints: Sequence[Breakpoint]) -> tuple[Breakpoint, ...]:
    """Return the breakpoints for a run of the graph in a UMRF text. For workers. Raise BadInput for one
    that has no place there."""
    return pinned_in(codec.read(umrf).graph, breakpoints)
