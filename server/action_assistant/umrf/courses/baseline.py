"""The course of a graph when every action ends with on_true, instant by instant, to compare others with."""

from bisect import bisect_left
from heapq import heappop, heappush
from typing import Final, Literal, NamedTuple, TypeAlias

from action_assistant.umrf.components import Mask
from action_assistant.umrf.courses.instants import DUE, Instant, State
from action_assistant.umrf.courses.network import Network
from action_assistant.umrf.semantics.transitions import RUNS

#: `stuck`: RUNNING for ever with nothing that runs; `endless`: laps without end, or longer than was
#: looked at; `never`: an entry action lacks a value, so it does not start.
Kind: TypeAlias = Literal["finished", "halted", "crashed", "locked", "stuck", "endless", "never"]

#: Ends of actions that are followed: this for each action, and some. Loops have no end.
LAPS: Final = 4
MORE: Final = 100


class Outcome(NamedTuple):
    """How a graph ends. `early`: FINISHED while something runs. Of one that is stuck: `waiting`, who
    was asked and still waits (a bit for each place); `lacking`, the parents that the exit has not
    heard of; `inputs`, whether it lacks outputs, which `last` (a place) did not give. `cut`: it was
    not followed to an end, nor into a lap that is like another. `endless`: the spontaneous actions
    that go on in a graph that is FINISHED."""

    kind: Kind
    early: bool = False
    waiting: Mask = 0
    lacking: frozenset[str] = frozenset()
    inputs: bool = False
    last: int = -1
    cut: bool = False
    endless: Mask = 0


class BaselineCourse:
    """Histories by instant: `times`, `roots` (who ended), `touched`, and sums after each. Of each place
    `instants` and `states`: when it was asked or ended, and its state then."""

    def __init__(self, net: Network) -> None:
        self.net = net
        count = len(net.nodes) + 1
        self.initial = [State(has=has) for has in net.has]
        self.times: list[float] = []
        self.roots: list[int] = []
        self.touched: list[tuple[int, ...]] = []
        self.running: list[int] = []
        self.active: list[int] = []
        self.waiting: list[Mask] = []
        self.came: list[Mask] = []
        self.last: list[int] = []
        self.instants: list[list[int]] = [[] for _ in range(count)]
        self.states: list[list[State]] = [[] for _ in range(count)]
        #: Instants that would have halted the graph if so many fewer had run.
        self.halting: dict[int, list[int]] = {}
        self._due: list[tuple[float, int]] = []
        self._waiting: Mask = 0
        self._came: Mask = 0
        self._last = -1
        #: Whether it was seen to come to the same point twice.
        self.laps = False
        #: Whether two ended at one moment: only the engine knows in which order.
        self.tied = False
        self.outcome = Outcome("never") if self._never_starts() else self._followed()

    def state(self, index: int, before: int) -> State:
        """The state of a place before an instant, by its number."""
        own = self.instants[index]
        found = len(own) if before > (own[-1] if own else -1) else bisect_left(own, before)
        return self.states[index][found - 1] if found else self.initial[index]

    def first_end(self, index: int) -> int | None:
        """The instant at which an action ends for the first time, unless that is by a stop."""
        for instant in self.instants[index]:
            if self.roots[instant] == index:
                return instant if self.state(index, instant).does == RUNS else None
        return None

    def _never_starts(self) -> bool:
        return any(
            edge is not None and self.net.wants[edge.child] & ~self.net.has[edge.child]
            for edge in self.net.entry
        )

    def _followed(self) -> Outcome:
        instant = Instant(self.net, self._now, 0.0, 0, 0)
        instant.begin()
        self._note(0.0, -1, instant)
        limit = LAPS * len(self.net.nodes) + MORE
        compared, power = self._seen(0.0), 1
        while instant.end is None and self._due and len(self.times) < limit:
            at, index = heappop(self._due)
            state = self._now(index)
            if state.does not in DUE or state.due != at:
                continue
            instant = Instant(self.net, self._now, at, self.running[-1], self.active[-1])
            instant.ends(index, "on_true")
            self._note(at, index, instant)
            if self.laps:
                continue
            if index == compared[0] and self._came == compared[1]:
                self.laps = self._seen(at) == compared
            if len(self.times) >= power:
                compared, power = self._seen(at), 2 * power
        return self._outcome(instant)

    def _outcome(self, last: Instant) -> Outcome:
        if last.end is not None:
            return Outcome(last.end, last.early)
        if any(self._now(index).does in DUE for _, index in self._due):
            return Outcome("endless", cut=not self.laps)
        ended = self._now(self.net.exit)
        return stuck(self.net, self._waiting, ended, self._last)

    def _now(self, index: int) -> State:
        own = self.states[index]
        return own[-1] if own else self.initial[index]

    def _note(self, at: float, index: int, instant: Instant) -> None:
        number = len(self.times)
        self.tied = self.tied or bool(self.times and self.times[-1] == at)
        self.times.append(at)
        self.roots.append(index)
        self.touched.append(tuple(instant.states))
        for each, state in instant.states.items():
            before = self._now(each)
            self.instants[each].append(number)
            self.states[each].append(state)
            if state.does in DUE and (state.due != before.due or state.does != before.does):
                heappush(self._due, (state.due, each))
            bit = 1 << each
            self._came |= bit
            if state.waiting != before.waiting:
                self._waiting ^= bit
        for others in dict.fromkeys(instant.others):
            self.halting.setdefault(others, []).append(number)
        self._last = instant.last if instant.last >= 0 else self._last
        self.running.append(instant.running)
        self.active.append(instant.active)
        self.waiting.append(self._waiting)
        self.came.append(self._came)
        self.last.append(self._last)

    def _seen(self, at: float) -> tuple[object, ...]:
        """What is the same at the same point of two laps: who ended, and all states, by the round."""
        start = at // self.net.round_ms * self.net.round_ms
        states = [
            state._replace(due=state.due - start) if state.does in DUE else state
            for own in self.states
            if own
            for state in own[-1:]
        ]
        return (self.roots[-1], self._came, states)


def stuck(net: Network, waiting: Mask, ended: State, last: int) -> Outcome:
    """A graph in which nothing runs any more, though it has not ended."""
    lacking = frozenset(
        name for bit, name in net.required[net.exit].items() if not ended.links & bit
    )
    inputs = bool(net.wants[net.exit] & ~ended.has)
    return Outcome("stuck", waiting=waiting, lacking=lacking, inputs=inputs, last=last)
