"""Follows every course of a small graph, to find which actions run at the same time, and which run again.

The rules are those of `courses.instants`. Every action may end with each outcome, in any order, no action waits
for a value, and no course ends at an exit that does: so what is found can only be too much. Combinations of
outcomes exclude each other here, as that of a loop which goes on and that which leads out of it; arrows alone do
not show that.
"""

from collections import Counter
from collections.abc import Mapping
from typing import Final, NamedTuple

from msgspec.structs import replace

from action_assistant.umrf.components import Mask, nodes_in
from action_assistant.umrf.courses.instants import Instant, State
from action_assistant.umrf.courses.network import Network
from action_assistant.umrf.model import EXIT, OUTCOMES, PRECONDITIONS, Graph, Key
from action_assistant.umrf.semantics.parts import exit_inputs
from action_assistant.umrf.semantics.transitions import RUNS

#: The most states of single actions that are examined: some 50 ms.
BUDGET: Final = 60_000
#: Graphs with more actions are not followed: they would need more than that, unless they are a chain.
_MOST: Final = 60
_FOLLOWED: Final = frozenset({"run", "bypass", "ignore"})


class Together(NamedTuple):
    """The actions that run while another one runs (`beside`), by key, and those that may begin again
    after they have run (`again`)."""

    beside: Mapping[Key, frozenset[Key]]
    again: frozenset[Key]


class _Moment(NamedTuple):
    """The state of a graph between two ends. `begun`: a mask of the actions that have begun and can still
    be reached."""

    states: tuple[State, ...]
    running: int
    active: int
    begun: Mask


def together(graph: Graph, budget: int = BUDGET) -> Together | None:
    """Return what runs at the same time and what runs again in some course of a graph. Return None if that
    is not followed: the graph is too large or has more courses than `budget` allows, an action of it is
    spontaneous, missing or not alone with its name, an arrow stops or pauses an action, or the engine may
    crash in one of them."""
    names = Counter(action.full_name for action in graph.actions)
    answers = {r.conditions.answer(o) for r in graph.relations for o in PRECONDITIONS}
    if (
        len(graph.actions) > _MOST
        or not answers <= _FOLLOWED
        or any(a.type == "spontaneous" or a.missing for a in graph.actions)
        or max(names.values(), default=1) > 1
    ):
        return None
    return _Courses(graph).found(budget)


def _without_values(graph: Graph) -> Graph:
    """Return a graph with all courses of this one, in which nothing waits for a value. An exit that
    takes outputs may wait for them, and the graph goes on meanwhile: it has no arrows there."""
    waits = bool(exit_inputs(graph))
    actions = tuple(replace(action, inputs=(), outputs=()) for action in graph.actions)
    relations = tuple(
        replace(relation, remap=())
        for relation in graph.relations
        if relation.child != EXIT or not waits
    )
    return replace(graph, actions=actions, relations=relations)


class _Courses:
    def __init__(self, graph: Graph) -> None:
        self._net = Network(_without_values(graph))
        self._keys = {self._net.index[a.full_name]: a.key for a in graph.actions}
        self._beside = [0] * len(self._net.nodes)
        self._again = 0

    def found(self, budget: int) -> Together | None:
        """Search every state that the graph can reach. None where the budget is used up or the engine may
        crash."""
        net = self._net
        first = _Moment(tuple(State(has=has) for has in net.has), 0, 0, 0)
        instant = Instant(net, first.states.__getitem__, 0.0, 0, 0)
        instant.begin()
        begun = self._after(instant, first)
        open_, known = [begun], {begun}
        while open_:
            moment = open_.pop()
            for index in nodes_in(_running(moment.states)):
                for result in OUTCOMES:
                    budget -= len(moment.states)
                    if budget < 0:
                        return None
                    instant = Instant(net, moment.states.__getitem__, 0.0, *moment[1:3])
                    instant.ends(index, result)
                    then = self._after(instant, moment, index)
                    if instant.end == "crashed":  # a real engine may be quick enough, and go on
                        return None
                    if instant.end is None and then not in known:
                        known.add(then)
                        open_.append(then)
        keys = self._keys
        beside = {
            keys[index]: frozenset(keys[other] for other in nodes_in(mask))
            for index, mask in enumerate(self._beside)
        }
        return Together(beside, frozenset(keys[index] for index in nodes_in(self._again)))

    def _after(self, instant: Instant, before: _Moment, ended: int = -1) -> _Moment:
        """Note what runs after an instant, at which the action `ended` has ended (-1: the graph began),
        and return the state of the graph then; `before`: its state before. Times are dropped, and so
        are states of actions that no running action can reach any more."""
        states = list(before.states)
        for index, state in instant.states.items():
            states[index] = state._replace(due=0.0, waiting=False)
        running, earlier = _running(states[:-1]), _running(before.states)
        if ended >= 0:
            earlier &= ~(1 << ended)
        began = running & ~earlier
        self._again |= began & before.begun
        for index in nodes_in(running):
            self._beside[index] |= running & ~(1 << index)
        ahead = running
        for index in nodes_in(running):
            ahead |= self._net.reachable[index]
        nothing = State()
        kept = tuple(state if ahead >> i & 1 else nothing for i, state in enumerate(states))
        return _Moment(kept, instant.running, instant.active, (before.begun | began) & ahead)


def _running(states: "tuple[State, ...] | list[State]") -> Mask:
    return sum(1 << index for index, state in enumerate(states) if state.does == RUNS)
