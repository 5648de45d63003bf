"""The end of a graph when one action ends otherwise, followed only where the course differs from
the baseline.

An action's end reaches other actions only along arrows, and the time of its end depends only on
when it began. So a course with one other end equals the baseline course except for some states.
These states are kept by index, and only the instants that touch one of them are followed. If no
state differs any more, the rest is the baseline course. If a single action runs and everything
reachable from it is as at the start, the rest is as in any other course that came to this point
(decision 45).
"""

from bisect import bisect_left
from heapq import heappop, heappush
from typing import Final

from action_assistant.umrf.components import Mask
from action_assistant.umrf.courses.baseline import LAPS, MORE, BaselineCourse, Outcome, stuck
from action_assistant.umrf.courses.instants import DUE, Instant, State
from action_assistant.umrf.model import Precondition
from action_assistant.umrf.semantics.transitions import ACTIVE, IDLE, RUNS

#: The most differing states of a situation whose outcome is remembered.
_FEW: Final = 8


class SimultaneousEnds(Exception):
    """Raised if two actions end at the same moment, since only the engine knows in which order they
    end."""


_Key = tuple[int, frozenset[tuple[int, State]]]


class DeviatingCourses:
    """Computes courses in which one action ends otherwise than in the baseline course. `work`: how
    many states were examined so far, as a measure of the time taken."""

    def __init__(self, course: BaselineCourse) -> None:
        self.course = course
        self.net = course.net
        self.work = 0
        #: The outcome when only this action runs and nothing reachable from it has been touched.
        self.alone: dict[int, Outcome] = {}
        #: The outcome from a situation, and the actions that had been dropped from it before.
        self.known: dict[_Key, tuple[Outcome, Mask]] = {}
        for number, active in enumerate(course.active[:-1]):  # the last instant ended the graph
            if active == 1:
                self._note_alone(number)

    def _note_alone(self, number: int) -> None:
        """Remember, from the baseline course, that if only this one action runs and nothing that it
        can reach was touched, the graph ends as in the baseline. `number`: the number of the
        instant in the baseline whose touched actions are examined."""
        course = self.course
        for index in course.touched[number]:
            if index == self.net.exit or course.state(index, number + 1).does != RUNS:
                continue
            if index not in self.alone and not course.came[number] & self.net.reachable[index]:
                self.alone[index] = course.outcome

    def outcome(self, index: int, result: Precondition) -> Outcome:
        """Return how the graph ends if the first run of the action at `index` ends with `result`.
        Raise `SimultaneousEnds` if two actions end at the same moment."""
        instant = self.course.first_end(index)
        if instant is None:
            return self.course.outcome
        return _DeviatingCourse(self).followed(instant, result)


class _DeviatingCourse:
    """One course that differs from the baseline. `apart`: the states that differ, by index; `mask`:
    their indices. `dropped`: actions that are not followed because no arrow reaches them any more;
    `forgotten`: those of them that wait."""

    def __init__(self, all_: DeviatingCourses) -> None:
        self.all = all_
        self.course = all_.course
        self.net = all_.net
        self.apart: dict[int, State] = {}
        self.mask: Mask = 0
        self.forgotten: Mask = 0
        self.dropped: Mask = 0
        self.last = -1
        self._sums: dict[int, tuple[int, int]] = {}
        self._running = 0
        self._active = 0
        self._queue: list[tuple[float, int]] = []
        self._passed: list[int] = []
        self._met: list[tuple[_Key, Mask, Mask]] = []
        self._is_over = False
        self._steps = 0
        self._power = 1
        self._point: tuple[int, dict[int, State]] = (-1, {})
        self._since = 0  # instants since states were last dropped

    def followed(self, instant: int, result: Precondition) -> Outcome:
        """Follow the course from the instant with this number, at which its action ends with
        `result`, and return how the graph ends. Raise SimultaneousEnds if two actions end at the
        same moment."""
        found = self._at(self.course.times[instant], self.course.roots[instant], result)
        if instant < len(self.course.times) - 1:
            self._push(len(self.course.times) - 1)
        limit = LAPS * len(self.net.nodes) + MORE
        while found is None:
            limit -= 1
            if not limit:
                found = Outcome("endless", cut=True)
                break
            if not self._queue:
                found = self._quiet(len(self.course.times))
                break
            at = self._queue[0][0]
            root = -1
            while self._queue and self._queue[0][0] == at:
                index = heappop(self._queue)[1]
                if index >= 0 and self._is_due(index, at):
                    if root not in (-1, index):
                        raise SimultaneousEnds
                    root = index
            found = self._at(at, root, "on_true")
            if found is None and root >= 0 and self._is_over and self._is_lap(at, root):
                found = Outcome("endless")
        return self._remembered(found)

    def _is_lap(self, at: float, root: int) -> bool:
        """Return whether the course, after the end of the baseline course, has come to an earlier
        situation again. `at`: now, in ms; `root`: the index of the action that has ended."""
        self._steps += 1
        again = root == self._point[0] and self._differing(at) == self._point[1]
        if self._steps >= self._power:
            self._power *= 2
            self._point = root, self._differing(at)
        return again

    def _differing(self, at: float) -> dict[int, State]:
        start = at // self.net.round_ms * self.net.round_ms
        return {
            index: state._replace(due=state.due - start) if state.does in DUE else state
            for index, state in self.apart.items()
        }

    def _is_due(self, index: int, at: float) -> bool:
        state = self.apart.get(index)
        return state is not None and state.does in DUE and state.due == at

    def _push(self, instant: int) -> None:
        heappush(self._queue, (self.course.times[instant], -1))

    # One instant

    def _at(self, at: float, root: int, result: Precondition) -> Outcome | None:
        """Follow the events at the time `at`, both in this deviating course and in the baseline
        course. `root` is the index of the action that ends then with `result`, negative for
        none. Return the graph's end once it is decided, None while the course continues."""
        course = self.course
        here = bisect_left(course.times, at)
        usual = here < len(course.times) and course.times[here] == at
        if usual:
            root = self._root(course.roots[here], root)
        elif root < 0:
            return None
        states: dict[int, State] = {}
        if root >= 0:
            before = here - 1
            running = course.running[before] + self._running
            instant = Instant(
                self.net, lambda index: self._state(index, here), at, running,
                course.active[before] + self._active,
            )  # fmt: skip
            instant.ends(root, result)
            states = instant.states
            self.last = instant.last if instant.last >= 0 else self.last
            self.all.work += 1 + len(states)
            if instant.end is not None:
                return Outcome(instant.end, instant.early)
        after = here + usual
        touched = course.touched[here] if usual else ()
        for index in states.keys() | touched:
            own = states.get(index)
            self._compare(index, own if own is not None else self._state(index, here), after)
        self.all.work += 1 + len(touched)
        self._await_halt(after)
        if course.active[after - 1] + self._active == 0:
            return self._quiet(after)
        if after == len(course.times):
            return self._beyond()
        self._since += 1
        if self._since >= len(self.apart) - _FEW:
            self._since = 0
            return self._forget(after)
        return None

    def _root(self, usually: int, root: int) -> int:
        """Return the index of the action that ends at a moment of the baseline course. `usually`:
        that of the baseline; `root`: the one that ends here, -1 for none. Raise `SimultaneousEnds`
        if two do."""
        if usually in self.apart:
            return root
        if root not in (-1, usually):
            raise SimultaneousEnds
        return usually

    def _state(self, index: int, before: int) -> State:
        own = self.apart.get(index)
        return own if own is not None else self.course.state(index, before)

    def _compare(self, index: int, state: State, after: int) -> None:
        """Record if the new `state` of an action differs from that in the baseline course. `after`:
        the number of the following instant."""
        usual = self.course.state(index, after)
        running, active = self._sums.pop(index, (0, 0))
        self._running -= running
        self._active -= active
        if state == usual and not (self._is_over and state.does in DUE):
            if self.apart.pop(index, None) is not None:
                self.mask ^= 1 << index
            return
        if index not in self.apart:
            self.mask |= 1 << index
        self._own(index, state)
        sums = (
            (state.does == RUNS) - (usual.does == RUNS),
            (state.does in ACTIVE) - (usual.does in ACTIVE),
        )
        if sums != (0, 0):
            self._sums[index] = sums
            self._running += sums[0]
            self._active += sums[1]
        instants = self.course.instants[index]
        following = bisect_left(instants, after)
        if following < len(instants):
            self._push(instants[following])

    def _await_halt(self, after: int) -> None:
        """Queue, if fewer actions run in this course than in the baseline, the next instant of the
        baseline at which the graph would have halted with so few. `after`: the number of the first
        instant that counts."""
        if self._running < 0:
            halting = self.course.halting.get(-self._running, ())
            following = bisect_left(halting, after)
            if following < len(halting):
                self._push(halting[following])

    def _own(self, index: int, state: State) -> None:
        old = self.apart.get(index)
        self.apart[index] = state
        if state.does in DUE and (old is None or old.due != state.due or old.does != state.does):
            heappush(self._queue, (state.due, index))

    def _beyond(self) -> Outcome | None:
        """Continue after the end of the baseline course, or after the point up to which it was
        followed. Return the outcome if it is decided by that, else None."""
        course = self.course
        end = len(course.times)
        if course.outcome.kind == "endless":
            indices = range(len(self.net.nodes))
            due = any(self._state(index, end).does in DUE for index in indices)
            return Outcome("endless", cut=True) if due else self._quiet(end)
        if not self._is_over:
            self._is_over = True
            for index in range(len(self.net.nodes)):
                state = course.state(index, end)
                if index not in self.apart and state.does in DUE:
                    self.mask |= 1 << index
                    self._own(index, state)
        return self._as_before(end)

    # Situations that are known

    def _forget(self, after: int) -> Outcome | None:
        """Drop the states of actions that cannot influence the course any more. Return the outcome
        of the course if no state is left, or if an earlier course came to the same states and its
        outcome is known; else None. `after`: the number of the following instant of the baseline.
        """
        course = self.course
        lively: Mask = 0
        idle: list[int] = []
        for index, state in self.apart.items():
            instants = course.instants[index]
            if state.does in ACTIVE or (instants and instants[-1] >= after):
                lively |= self._behind(index)
            elif index != self.net.exit and course.state(index, after).does == IDLE:
                idle.append(index)
        self.all.work += len(self.apart)
        for index in idle:
            if not lively >> index & 1:
                self._drop(index)
        if not self.apart:
            return self._joined(
                course.outcome, self.forgotten | course.outcome.waiting & ~self.dropped
            )
        return self._as_before(after)

    def _behind(self, index: int) -> Mask:
        return 0 if index == self.net.exit else self.net.reachable[index]

    def _drop(self, index: int) -> None:
        state = self.apart.pop(index)
        self.mask ^= 1 << index
        self.dropped |= 1 << index
        if state.waiting:
            self.forgotten |= 1 << index

    def _as_before(self, after: int) -> Outcome | None:
        """Return the outcome of another course that came to the same states of all actions, since
        this course then ends in the same way; None if no course did. `after`: the number of the
        following instant of the baseline."""
        if self.course.active[after - 1] + self._active == 1:
            alone = [index for index, state in self.apart.items() if state.does == RUNS]
            if alone and self._is_fresh(alone[0], after):
                known = self.all.alone.get(alone[0])
                if known is not None:
                    return self._came_alone(alone[0], known, after)
                self._passed.append(alone[0])
        if len(self.apart) <= _FEW:
            key = (after, frozenset(self.apart.items()))
            met = self.all.known.get(key)
            if met is not None:
                return self._met_again(*met, after)
            self._met.append((key, self.forgotten, self.dropped))
        return None

    def _is_fresh(self, index: int, after: int) -> bool:
        """Return whether all actions reachable from the running action `index` are as at the start.
        `after`: the number of the following instant of the baseline."""
        behind = self.net.reachable[index]
        if self.course.came[after - 1] & behind & ~self.mask:
            return False
        initial = self.course.initial
        return all(
            state == initial[each] for each, state in self.apart.items() if behind >> each & 1
        )

    def _waiting(self, after: int) -> Mask:
        own = sum(1 << index for index, state in self.apart.items() if state.waiting)
        usual = self.course.waiting[after - 1] & ~(self.mask | self.dropped)
        return usual | own | self.forgotten

    # The end

    def _quiet(self, after: int) -> Outcome:
        """Return the outcome of a graph in which no event is left: it is stuck. `after`: the number
        of the following instant of the baseline."""
        return stuck(
            self.net, self._waiting(after), self._state(self.net.exit, after), self._last()
        )

    def _came_alone(self, index: int, known: Outcome, after: int) -> Outcome:
        """Return the outcome of a situation in which only the action `index` runs, from the outcome
        of an equal one (`known`). Actions that it cannot reach stay as they are."""
        behind = self.net.reachable[index]
        waiting = self._waiting(after) | known.waiting & behind
        if known.kind == "stuck" and not behind >> self.net.exit & 1:
            return self._quiet(after)._replace(waiting=waiting)
        return self._joined(known, waiting)

    def _met_again(self, known: Outcome, dropped: Mask, after: int) -> Outcome:
        """Return the outcome of this situation from that of an earlier course that met it
        (`known`). `dropped`: the actions that the earlier course did not follow, which may be as in
        the baseline course here."""
        usual = self.course.waiting[after - 1] & dropped & ~(self.dropped | self.mask)
        return self._joined(known, self.forgotten | known.waiting & ~self.dropped | usual)

    def _joined(self, known: Outcome, waiting: Mask) -> Outcome:
        """Return the outcome `known` with `waiting` as the actions that wait in the end."""
        if known.kind != "stuck":
            return known
        last = known.last if known.last >= 0 else self._last()
        return known._replace(waiting=waiting, last=last)

    def _last(self) -> int:
        return self.last if self.last >= 0 else self.course.last[-1]

    def _remembered(self, found: Outcome) -> Outcome:
        for index in self._passed:
            self.all.alone.setdefault(index, found)
        for key, forgotten, dropped in self._met:
            kept = found._replace(waiting=found.waiting & ~forgotten)
            self.all.known.setdefault(key, (kept, dropped))
        return found
