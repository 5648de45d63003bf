"""The performer of a led run: tells which actions the engine of the whole graph begins and stops.

The engine of a led run carries out nothing itself. Each call of an action becomes a report,
and whoever conducts the run reports the end of the call with `returned`.
"""

from collections.abc import Collection
from typing import Literal

import msgspec

from action_assistant.runner.links.port import CallBegan, CallStopped
from action_assistant.umrf.model import Action
from action_assistant.umrf.semantics import Call, Returned


class LedCourse(msgspec.Struct, frozen=True, kw_only=True):
    """The course of a led run so far, from which a new engine gets to the same states.

    `began`: when the graph was started, in microseconds UTC. `steps`: in order, the ends of calls
    and the Stop, each with its time in milliseconds after the start.
    """

    began: int
    steps: tuple[tuple[float, Returned | Literal["stop"]], ...]


class LedCalls:
    """Stands in for behaviours in the engine that plays a led run: collects the calls that
    robots carry out until the link reports them. `led`: the full names of these actions; the script
    says how the others behave."""

    takes_graphs = True
    is_killing = False
    has_returned = False

    def __init__(self, led: Collection[str]) -> None:
        self._led = frozenset(led)
        self._news: list[CallBegan | CallStopped] = []

    def performs(self, action: Action, *, inside: bool) -> bool:
        """Return whether a robot carries out this action. `inside`: it is in a sub-graph; then the
        result is False: either the engine plays the sub-graph, or a robot carries it out as a
        whole."""
        return not inside and action.full_name in self._led

    def begin(self, call: Call) -> None:
        """Add the begin of a call to the news."""
        self._news.append(CallBegan(call=call))

    def stop(self, number: int) -> None:
        """Add to the news that the call `number` is to end."""
        self._news.append(CallStopped(number=number))

    def pause(self, number: int) -> None:
        """Do nothing, whatever the number of the call: a led run is not paused, but held, so that
        nothing further begins."""

    def resume(self, number: int) -> None:
        """Do nothing, whatever the number of the call: a led run is not paused, but held, so that
        nothing further begins."""

    def give_up(self, number: int) -> str | None:
        """Return None and do nothing: only a proof ends a call that a robot carries out."""
        return None

    def news(self) -> list[CallBegan | CallStopped]:
        """Return the calls that began or were stopped since the last time, oldest first."""
        news, self._news = self._news, []
        return news

    def taken(self) -> list[Returned]:
        """Return an empty list: the ends of calls come as commands of the conductor."""
        return []

    def kill_all(self) -> None:
        """Do nothing: robots that carry out calls go on, and each is stopped by the Stop of its
        piece."""

    def end(self) -> None:
        """Do nothing: robots that carry out calls go on, and each is stopped by the Stop of its
        piece."""
