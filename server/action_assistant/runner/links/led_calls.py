"""The performer of a led run: tells which actions the engine of the whole graph begins and stops.

The engine of a led run begins nothing itself. Each call of an action becomes a report. Whoever
conducts the run reports the end of the call with `returned`, if a robot has carried it out, or lets
the script play the call with `play`.
"""

from collections import deque
from collections.abc import Collection, Mapping
from typing import Any, Final, TypeAlias

import msgspec

from action_assistant.runner.links.port import CallBegan, CallPlayed, CallStopped
from action_assistant.umrf.model import Action, Precondition
from action_assistant.umrf.semantics import Call, Returned

_NO_CALL: Final = -1


class Played(msgspec.Struct, frozen=True):
    """The script was let play the call with this number, of the action with the full name `node`."""

    number: int
    node: str


class Stopped(msgspec.Struct, frozen=True):
    """The whole graph of the led run was stopped by a person or the runner."""


#: What brings the engine of a led run from one state to the next, apart from time.
CourseStep: TypeAlias = Returned | Played | Stopped


class LedCourse(msgspec.Struct, frozen=True, kw_only=True):
    """The course of a led run so far, from which a new engine gets to the same states.

    `began`: when the graph was started, in microseconds UTC. `steps`: in order, the ends of calls,
    the calls that the script plays and the Stop, each with its time in milliseconds after the start.
    `calls`: the full names of the actions of the calls that were reported, by number: calls that began
    within a few milliseconds may begin in another order in another engine.
    """

    began: int
    steps: tuple[tuple[float, CourseStep], ...]
    calls: Mapping[int, str] = {}


#: The reports about calls.
CallNews: TypeAlias = CallBegan | CallStopped | CallPlayed


class LedCalls:
    """Stands in for behaviours in the engine that plays a led run: collects the calls that
    are to begin until the link reports them. `led`: the full names of the actions that begin only
    when the conductor says so; the others follow the script at once.

    Calls are known by the numbers of the first engine that reported them (`expect`)."""

    takes_graphs = True
    is_killing = False
    has_returned = False

    def __init__(self, led: Collection[str]) -> None:
        self._led = frozenset(led)
        self._news: list[CallNews] = []
        self._expected = dict[str, deque[int]]()  # by full name of the action, lowest first
        self._numbers = dict[int, int]()  # as they are known, by the number in this engine
        self._free = 1  # no call has this number, or a higher one
        self._own = dict[int, int]()  # the numbers in this engine, as they are known
        #: The full names of the actions of all calls so far, by number.
        self.nodes: dict[int, str] = {}

    def expect(self, calls: Mapping[int, str]) -> None:
        """Give the calls that begin the numbers (`calls`: the full names of their actions by number) by
        which an earlier engine reported them, for each action in order. Call this before the start."""
        for number in sorted(calls):
            self._expected.setdefault(calls[number], deque()).append(number)
        self._free = max(calls, default=0) + 1

    def own(self, number: int) -> int:
        """Return the number in this engine of the call that is known by `number`; a number of no call if
        it has not begun."""
        return self._own.get(number, _NO_CALL)

    def performs(self, action: Action, *, inside: bool) -> bool:
        """Return whether the conductor lets this action begin. `inside`: it is in a sub-graph; then
        the result is False: a sub-graph begins as a whole, in the engine or on a robot."""
        return not inside and action.full_name in self._led

    def begin(self, call: Call) -> None:
        """Add the begin of a call to the news."""
        expected = self._expected.get(call.node)
        number = expected.popleft() if expected else max(self._free, call.number)
        self._free = max(self._free, number + 1)
        self._numbers[call.number], self._own[number] = number, call.number
        self.nodes[number] = call.node
        self._news.append(CallBegan(call=msgspec.structs.replace(call, number=number)))

    def stop(self, number: int) -> None:
        """Add to the news that the call `number` is to end."""
        self._news.append(CallStopped(number=self._numbers[number]))

    def pause(self, number: int) -> None:
        """Do nothing, whatever the number of the call: a led run is not paused, but held, so that
        nothing further begins."""

    def resume(self, number: int) -> None:
        """Do nothing, whatever the number of the call: a led run is not paused, but held, so that
        nothing further begins."""

    def give_up(self, number: int) -> str | None:
        """Return None and do nothing: only a proof ends a call that a robot carries out."""
        return None

    def ended(self, number: int, result: Precondition, outputs: Mapping[str, Any]) -> None:
        """Add to the news that a call which the script has played has ended."""
        known = self._numbers[number]
        self._news.append(CallPlayed(number=known, outcome=result, outputs=dict(outputs)))

    def news(self) -> list[CallNews]:
        """Return the calls that began, were stopped or were played to their end since the last time,
        oldest first."""
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
