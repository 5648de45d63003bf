"""Trial courses of a graph: all actions end with on_true, or one of them, the first time,
otherwise.
"""

from collections.abc import Iterator
from typing import Final

import msgspec

from action_assistant.umrf.courses.course import Course, Outcome
from action_assistant.umrf.courses.deviations import Deviations, Tied
from action_assistant.umrf.courses.network import Network
from action_assistant.umrf.courses.whole import whole
from action_assistant.umrf.model import Action, Graph, Precondition

#: States that all trials of one graph may look at, so that checking takes seconds: about 2 µs each.
BUDGET: Final = 5_000_000
#: What an event of the engine counts, where a trial is gone through as a whole.
_EVENT: Final = 20
#: Above so many actions only the usual way is tried: what lies behind each takes their square in bits.
MAX_ACTIONS: Final = 20_000
_OTHERWISE: Final[tuple[Precondition, ...]] = ("on_false", "on_error")


class Trial(msgspec.Struct, frozen=True):
    """One way. `action`: who ends with `outcome` the first time; None: nobody ends otherwise."""

    action: Action | None
    outcome: str
    end: Outcome

    @property
    def when(self) -> str:
        """In words, for the beginning of a sentence."""
        if self.action is None:
            return "If all goes well"
        return f"If {self.action.full_name} ends with {self.outcome}"


class Coverage(msgspec.Struct, frozen=True, kw_only=True):
    """What was looked at. `tried` ways of `ways`; `cut`: so many of the tried were followed for four
    laps only; `first_left`: the first that was not tried."""

    ways: int = 0
    tried: int = 0
    cut: int = 0
    first_left: str = ""


class Trials:
    """All ways of one graph. `slower_first`: of what runs side by side the later is quicker."""

    def __init__(self, graph: Graph, *, slower_first: bool = False) -> None:
        self.graph = graph
        self.net = Network(graph, slower_first=slower_first)
        self.actions = {a.full_name: a for a in graph.actions if not a.missing}
        self._plainly = any(action.type == "spontaneous" for action in graph.actions)
        self._spent = 0
        self._others = self._meant()
        self._tried = 0
        self._cut = 0
        self._left = ""

    def __iter__(self) -> Iterator[Trial]:
        course = None if self._plainly else Course(self.net)
        if course is not None and course.tied:
            course = None
        usual = course.outcome if course is not None else self._whole("", "on_true")
        yield self._noted(Trial(None, "", usual))
        if usual.kind == "never":
            self._others = []
        deviations = Deviations(course) if course is not None and self._others else None
        for place, outcome in self._others:
            work = deviations.work if deviations is not None else 0
            if self._spent + work > BUDGET or len(self.net.nodes) > MAX_ACTIONS:
                self._left = f"{self.net.names[place]} with {outcome}"
                return
            end = self._deviating(deviations, place, outcome)
            yield self._noted(Trial(self.actions[self.net.names[place]], outcome, end))

    def coverage(self) -> Coverage:
        """What has been looked at, once all was asked for."""
        ways = 1 + len(self._others)
        return Coverage(ways=ways, tried=self._tried, cut=self._cut, first_left=self._left)

    def _noted(self, trial: Trial) -> Trial:
        self._tried += 1
        self._cut += trial.end.cut
        return trial

    def _deviating(
        self, deviations: Deviations | None, place: int, outcome: Precondition
    ) -> Outcome:
        if deviations is not None:
            try:
                return deviations.outcome(place, outcome)
            except Tied:
                pass  # the engine knows the order
        return self._whole(self.net.names[place], outcome)

    def _whole(self, full_name: str, outcome: Precondition) -> Outcome:
        end, events = whole(self.net, self.graph, full_name, outcome)
        self._spent += _EVENT * events
        return end

    def _meant(self) -> list[tuple[int, Precondition]]:
        """What can make a difference: children that answer otherwise, or are bypassed and pass the
        outcome on, or outputs that are missed."""
        found: list[tuple[int, Precondition]] = []
        for place, row in enumerate(self.net.edges):
            edges = [edge for edge in row if edge is not None]
            gives = any(edge.given is None or edge.given[1] for edge in edges)
            for outcome in _OTHERWISE:
                answers = [(e.responses[outcome], e.responses["on_true"]) for e in edges]
                differs = any(other != usual or other == "bypass" for other, usual in answers)
                if differs or (gives and outcome == "on_error"):
                    found.append((place, outcome))
        return found
