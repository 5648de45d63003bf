"""Follows what one end of an action causes at its instant, over states that are plain values.

The rules are those of `semantics.core` (docs/umrf-and-the-engine.md 2.3 to 2.7): effects of responses are looked up
in the same table, a property test compares the two, and another test compares them with recordings. A state keeps
only what matters later: what the action is doing and until when, which required parents have reported, which inputs
hold a value, and whether its outputs do.
"""

from collections import deque
from collections.abc import Callable
from typing import Final, Literal, NamedTuple, TypeAlias

from action_assistant.umrf.components import Mask
from action_assistant.umrf.courses.network import EdgeQuestion, Network
from action_assistant.umrf.model import Precondition, Response
from action_assistant.umrf.semantics.transitions import (
    ACTIVE,
    EFFECTS,
    GIVING_UP,
    IDLE,
    PAUSED,
    RUNS,
    STOPS,
    THREAD_LEFT,
)

#: Activities that end by themselves, at `State.due`.
DUE: Final = frozenset({RUNS, STOPS, GIVING_UP})
#: The time after which the engine gives up on a paused action that it stops.
GIVING_UP_MS: Final = 5_000.0


class State(NamedTuple):
    """The state of one action at one moment. `does`: its activity; `due`: the time in ms at which
    this activity ends by itself, if it is one of `DUE`.

    `links`: the required parents that have reported. `has`: the inputs that hold a value. `got`:
    the inputs whose value came from a parent and is cleared after the run. `filled`: the outputs
    have values. `waiting`: the action was asked and was not ready.
    """

    does: int = IDLE
    due: float = 0.0
    links: Mask = 0
    has: Mask = 0
    got: Mask = 0
    filled: bool = False
    waiting: bool = False


#: The ends of a graph. `locked`: a bypass goes round in a circle.
End: TypeAlias = Literal["finished", "halted", "crashed", "locked"]
Reader: TypeAlias = Callable[[int], State]


class Instant:
    """Follows everything that happens at one moment. `states`: the new states of actions that were
    asked or ended, by index.

    `running` and `active`: how many actions run and are active, kept up to date. `end`: how the
    graph ended; None if it did not. `early`: it is FINISHED while an action runs. `last`: the index
    of the last action that asked the exit without ending the graph; -1 if none did. `others`: for
    each end that all children ignored, how many other actions ran; the graph is halted if none did.
    """

    __slots__ = ("_bypassed", "_net", "_now", "_read", "_returning", "_tasks", "active", "early", "end",
                 "last", "others", "running", "states")  # fmt: skip

    def __init__(self, net: Network, read: Reader, now_ms: float, running: int, active: int):
        self._net = net
        self._read = read
        self._now = now_ms
        self._tasks: deque[tuple[int, Precondition]] = deque()
        self._bypassed: set[tuple[int, Precondition]] = set()
        self.states: dict[int, State] = {}
        self.running = running
        self.active = active
        self.end: End | None = None
        self.early = False
        self._returning = -1
        self.last = -1
        self.others: list[int] = []

    def begin(self) -> None:
        """Start the graph: the entry gives its children the result `on_true`. All that follows from
        it at the same moment is done before the call returns."""
        self._inform(-1, "on_true", self._net.entry)
        self._settle()

    def ends(self, index: int, result: Precondition) -> None:
        """End the action at this index. An action that runs ends with `result`; one that is being
        stopped ends with on_stopped, and one that did not stop in time with on_error."""
        state = self._state(index)
        match state.does:
            case 1:
                self._returns(index, state, result)
            case 2:
                self._returns(index, state, "on_stopped")
            case _:
                self._put(index, state._replace(does=THREAD_LEFT, due=0.0))
                self._inform(index, "on_error", self._net.edges[index])
        self._settle()

    def _returns(self, index: int, state: State, result: Precondition) -> None:
        failed = result == "on_error"
        does = IDLE if failed else state.does
        self._put(index, state._replace(does=does, filled=state.filled or not failed))
        self._returning = index
        self._inform(index, result, self._net.edges[index])
        self._returning = -1
        if self.end == "crashed":
            return
        state = self._state(index)
        does = state.does if failed else IDLE  # one that failed may have begun anew
        due = state.due if does else 0.0
        self._put(index, state._replace(does=does, due=due, has=state.has & ~state.got, got=0))

    def _state(self, index: int) -> State:
        state = self.states.get(index)
        return self._read(index) if state is None else state

    def _put(self, index: int, state: State) -> None:
        old = self._state(index).does
        if old != state.does:
            self.running += (state.does == RUNS) - (old == RUNS)
            self.active += (state.does in ACTIVE) - (old in ACTIVE)
        self.states[index] = state

    def _settle(self) -> None:
        if self._tasks and self._only_ends():
            self.end = "finished"
            self.early = self.active > 0
            return
        while self._tasks and self.end is None:
            index, result = self._tasks.popleft()
            self._inform(index, result, self._net.edges[index])
        if self.end is None and self._bypassed:
            circling = self._net.circling
            if any(circling[result] >> index & 1 for index, result in self._bypassed):
                self.end = "locked"

    def _only_ends(self) -> bool:
        """Return whether the pending bypasses lead to the exit and do nothing else, however far
        they go."""
        plain, ends = self._net.plain, self._net.ends
        if not any(ends[result] >> index & 1 for index, result in self._tasks):
            return False
        if any(not plain[result] >> index & 1 for index, result in self._tasks):
            return False
        # An action with an arrow to the exit may be running itself, and is not one of the others then.
        return not self.active or not any(
            self._state(index).does in ACTIVE for index in self._net.last
        )

    def _inform(self, index: int, result: Precondition, edges: list[EdgeQuestion | None]) -> None:
        ignored = 0
        for edge in edges:
            if edge is None:
                self.end = "crashed"
                return
            ignored += self._ask(index, edge, result)
            if self.end is not None:
                return
        own = index >= 0 and self._state(index).does == RUNS
        if ignored == len(edges):
            self.others.append(self.running - own)
            if self.running == own:
                self.end = "halted"

    def _ask(self, index: int, edge: EdgeQuestion, result: Precondition) -> bool:
        """Ask one child, over an edge of the action `index`, for its response to a result. Return
        whether it ignores the result."""
        child, net = edge.child, self._net
        before = state = self._state(child)
        if edge.link & ~state.links:
            state = state._replace(links=state.links | edge.link)
        response = edge.responses[result]
        if response == "ignore" or response == "bypass":
            if state is not before or child not in self.states:
                self.states[child] = state
            if response == "bypass":
                self._bypass(index, child, result)
            return response == "ignore"
        if edge.given is None:
            self.end = "crashed"
            return False
        given = edge.given[index >= 0 and self._state(index).filled]
        ready = not net.needs[child] & ~state.links and not net.wants[child] & ~(state.has | given)
        if given or state.waiting == ready:
            has, got = state.has | given, state.got | given
            state = state._replace(has=has, got=got, waiting=not ready)
        self.states[child] = state
        if child == net.exit:
            if ready:
                self._finish(index)
            else:
                self.last = index
        elif ready:
            self._dispatch(child, state, response)
        return False

    def _bypass(self, index: int, child: int, result: Precondition) -> None:
        """Let the action `index`, which ended or was bypassed with `result`, bypass its child and
        pass the result on. The same bypass is done once in an instant, since another path to it
        changes nothing."""
        if child == self._net.exit:
            self._finish(index)
        elif (child, result) not in self._bypassed:
            self._bypassed.add((child, result))
            self._tasks.append((child, result))

    def _finish(self, index: int) -> None:
        self.end = "finished"
        # An action that was bypassed while it runs continues to run.
        own = index == self._returning >= 0 and self._state(index).does in ACTIVE
        self.early = self.active > own

    def _dispatch(self, child: int, state: State, response: Response) -> None:
        if response == "run" and not self._net.able[child]:
            return
        match EFFECTS[response][state.does]:
            case "runs":
                due = self._net.due(child, self._now)
                self._put(child, state._replace(does=RUNS, due=due))
            case "stops" if state.does == PAUSED:
                due = self._now + GIVING_UP_MS
                self._put(child, state._replace(does=GIVING_UP, due=due))
            case "stops":
                due = min(state.due, self._now + self._net.stopping_ms[child])
                self._put(child, state._replace(does=STOPS, due=due))
            case "pauses":
                self._put(child, state._replace(does=PAUSED, due=0.0))
            case "aborts":
                self.end = "crashed"
            case "nothing":
                pass
