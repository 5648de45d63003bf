"""Which sub-graphs of an answer belong to a run: they carry no mark, and outlast it. Pure.

A sub-graph runs as `GRAPH__NAME__ID`, for the node `NAME_ID` of the graph GRAPH. One of an earlier run
keeps that name until the node begins again, which puts another one in its place.
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple

from action_assistant.runner.links.observations import ACTIVE, TERMINAL, Snapshot
from action_assistant.umrf.triggers import NEVER_BEGAN


class LastLook(NamedTuple):
    """When an answer came, and when it had been asked for; None: there was none."""

    at: int | None = None
    asked: int | None = None


class SubGraphs:
    """What one run has seen of its sub-graphs, look by look. A look at one of which it is not known
    whose it is says nothing, so it is no proof either that its actions had not begun by then."""

    def __init__(self) -> None:
        self._begun: set[str] = set()  # parts whose node was seen going on in an earlier look
        self._last = LastLook()  # the newest look so far
        self._passed_over: dict[
            str, LastLook
        ] = {}  # the newest look before those that were left out

    def ours(self, own: Snapshot, parts: Sequence[Snapshot]) -> list[Snapshot]:
        """Those of `parts` that this run has begun, outer ones first. What the others do counts where
        it is asked whether anything moves; it is no part of the run's history."""
        held = {own.graph: own}
        for part in sorted(parts, key=lambda each: len(each.graph)):
            whose = self._whose(part, held)
            if whose == "ours":
                held[part.graph] = part
            elif whose == "unsure":
                self._passed_over.setdefault(part.graph, self._last)
            else:
                self._passed_over.pop(part.graph, None)
        self._last = LastLook(own.at, own.asked_at)
        return list(held.values())[1:]

    def last_look(self, part: str, usual: LastLook) -> LastLook:
        """The newest look that proves anything of a part that is noted now."""
        return self._passed_over.pop(part, usual)

    def _whose(
        self, part: Snapshot, held: dict[str, Snapshot]
    ) -> Literal["ours", "others", "unsure"]:
        above, _, number = part.graph.rpartition("__")
        above, _, name = above.rpartition("__")
        while above and above not in held:  # names may have such a mark inside
            above, _, more = above.rpartition("__")
            name = f"{more}__{name}"
        if above not in held:
            return "unsure"
        state = held[above].nodes.get(f"{name}_{number}")
        if state is None:  # it stands below one that is not held itself
            return "unsure"
        if state in NEVER_BEGAN:
            return "others"
        known = part.graph in self._begun
        self._begun.add(part.graph)
        is_ours = known or state not in ACTIVE or part.state not in TERMINAL
        return "ours" if is_ours else "unsure"
