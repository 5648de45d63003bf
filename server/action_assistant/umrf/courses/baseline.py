"""The course of a graph in which every action ends with on_true, instant by instant. Other courses
are compared with it."""

from bisect import bisect_left
from heapq import heappop, heappush
from typing import Final, Literal, NamedTuple, TypeAlias

from action_assistant.umrf.components import Mask
from action_assistant.umrf.courses.instants import DUE, Instant, State
from action_assistant.umrf.courses.network import Network
from action_assistant.umrf.semantics.transitions import RUNS

#: `stuck`: the graph stays RUNNING while no action runs. `endless`: it runs laps without end, or longer than it was
#: followed. `never`: it does not start, since an entry action lacks a value.
Kind: TypeAlias = Literal["finished", "halted", "crashed", "locked", "stuck", "endless", "never"]

#: A course is followed for `LAPS` ends of each action and `MORE` in addition, since loops have no end.
LAPS: Final = 4
MORE: Final = 100


class Outcome(NamedTuple):
    """The end of a graph. `early`: it is FINISHED while an action runs.

    For a stuck graph: `waiting`, the actions that were asked and still wait (a mask by index);
    `lacking`, the names of required parents that have not reported to the exit; `inputs`, whether
    the exit lacks values, which the action `last` did not give. `cut`: the course was followed
    neither to its end nor into a repeated lap. `endless`: the spontaneous actions that continue in
    a FINISHED graph (a mask).
    """

    kind: Kind
    early: bool = False
    waiting: Mask = 0
    lacking: frozenset[str] = frozenset()
    inputs: bool = False
    last: int = -1
    cut: bool = False
    endless: Mask = 0


class BaselineCourse:
    """The course in which every action ends with on_true, with its history. An instant is a moment
    at which an action ends. By number of the instant: `times` in ms, `roots` (the index of the
    action that ended; -1 for the entry), `touched` (the actions whose state was set), and counts
    after the instant. By index of the action: `instants`, at which it was asked or ended, and
    `states`, its state after each of them."""

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
        #: The instants that would have halted the graph if this many fewer actions had run.
        self.halting: dict[int, list[int]] = {}
        self._due: list[tuple[float, int]] = []
        self._waiting: Mask = 0
        self._came: Mask = 0
        self._last = -1
        #: True if the course came to the same point twice.
        self.laps = False
        #: True if two actions ended at one moment: only the engine knows in which order.
        self.tied = False
        self.outcome = Outcome("never") if self._never_starts() else self._followed()

    def state(self, index: int, before: int) -> State:
        """Return the state of the action `index` just before the instant with the number `before`."""
        own = self.instants[index]
        found = len(own) if before > (own[-1] if own else -1) else bisect_left(own, before)
        return self.states[index][found - 1] if found else self.initial[index]

    def first_end(self, index: int) -> int | None:
        """Return the number of the instant at which the action `index` first ends by itself; None
        if it does not."""
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
        """Return a value that is equal for two situations from which the course goes on in the same
        way: the action that ended last, and all states, with times relative to their round. `at`:
        now, in ms."""
        start = at // self.net.round_ms * self.net.round_ms
        states = [
            state._replace(due=state.due - start) if state.does in DUE else state
            for own in self.states
            if own
            for state in own[-1:]
        ]
        return (self.roots[-1], self._came, states)


def stuck(net: Network, waiting: Mask, ended: State, last: int) -> Outcome:
    """Return the outcome of a graph in which no action runs any more although it has not ended.
    `net`: the graph as numbers. `waiting`: the actions that wait, as a mask. `ended`: the state of
    the exit. `last`: the index of the last action that asked the exit."""
    lacking = frozenset(
        name for bit, name in net.required[net.exit].items() if not ended.links & bit
    )
    inputs = bool(net.wants[net.exit] & ~ended.has)
    return Outcome("stuck", waiting=waiting, lacking=lacking, inputs=inputs, last=last)
