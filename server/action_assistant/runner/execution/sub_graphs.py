"""Which sub-graphs of an answer belong to a run: they carry no mark, and outlast it. Pure.

A sub-graph runs as `GRAPH__NAME__ID`, for the node `NAME_ID` of the graph GRAPH. One of an earlier run
keeps that name until the node begins again, which puts another one in its place.
"""

from collections.abc import Sequence

from action_assistant.runner.links.observations import ACTIVE, TERMINAL, Snapshot
from action_assistant.runner.stop.proof import NEVER_BEGAN


class SubGraphs:
    """What one run has seen of its sub-graphs, look by look."""

    def __init__(self) -> None:
        self._begun: set[str] = set()  # parts whose node was seen going on in an earlier look

    def ours(self, own: Snapshot, parts: Sequence[Snapshot]) -> list[Snapshot]:
        """Those of `parts` that this run has begun, outer ones first. What the others do counts where
        it is asked whether anything moves; it is no part of the run's history."""
        held = {own.graph: own}
        for part in sorted(parts, key=lambda each: len(each.graph)):
            if self._is_ours(part, held):
                held[part.graph] = part
        return list(held.values())[1:]

    def _is_ours(self, part: Snapshot, held: dict[str, Snapshot]) -> bool:
        above, _, number = part.graph.rpartition("__")
        above, _, name = above.rpartition("__")
        while above and above not in held:  # names may have such a mark inside
            above, _, more = above.rpartition("__")
            name = f"{more}__{name}"
        state = held[above].nodes.get(f"{name}_{number}") if above in held else None
        if state is None or state in NEVER_BEGAN:
            return False
        known = part.graph in self._begun
        self._begun.add(part.graph)
        return known or state not in ACTIVE or part.state not in TERMINAL
