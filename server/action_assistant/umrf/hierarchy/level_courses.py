"""Follows every course of one graph, with each sub-graph taken for one action, to decide whether
the sub-graphs can be flattened.

States are those of `courses.instants`. From each state every end of every running action is
followed once, in any order. A sub-graph ends with the results with which its own courses end.
"""

from collections.abc import Iterator, Mapping
from typing import Final, Literal, NamedTuple, TypeAlias

from action_assistant.umrf.components import nodes_in
from action_assistant.umrf.courses.instants import Instant, State
from action_assistant.umrf.courses.network import EdgeQuestion, Network
from action_assistant.umrf.model import OUTCOMES, Graph, Key, Precondition
from action_assistant.umrf.semantics.transitions import RUNS

#: The most states of single actions that are examined for one hierarchy: about two seconds.
BUDGET: Final = 2_000_000

#: `halts`, `waits`: the graph does not reach its exit. `unready`: the exit lacks outputs. `early`: an action runs when
#: the exit is reached. `beside`: the action that reaches the exit asks others as well. `ends`: the exit is reached while
#: this sub-graph runs. `again`: this sub-graph is asked a second time. `crossing`: it is bypassed together with others.
#: `response`: it is asked for another response than run or bypass. `crash`: the engine aborts.
TroubleKind: TypeAlias = Literal[
    "halts", "waits", "unready", "early", "beside", "ends", "again", "crossing", "response",
    "crash", "undecided",
]  # fmt: skip


class Trouble(NamedTuple):
    """A property of a course that prevents flattening. `action`: the sub-graph that it concerns, if
    any.

    `by` and `result`: the action that ended last, and its result; empty at the start.
    """

    kind: TroubleKind
    action: Key | None = None
    by: str = ""
    result: str = ""


class LevelCourses(NamedTuple):
    """A summary of all courses of a graph. `results`: the outcomes with which it can end.

    `lacking`: sub-graphs that wait for an input when everything else that they wait for is there.
    `bypassed`: sub-graphs that are bypassed, with the outcomes. `spent`: how many states of single
    actions were examined.
    """

    results: frozenset[Precondition] = frozenset()
    troubles: tuple[Trouble, ...] = ()
    lacking: frozenset[Key] = frozenset()
    bypassed: Mapping[Key, frozenset[Precondition]] = {}
    spent: int = 0


class _LevelState(NamedTuple):
    """The state of a graph. `begun`: a mask of the sub-graphs that have begun."""

    states: tuple[State, ...]
    running: int
    active: int
    begun: int


class _LevelInstant(Instant):
    """An instant that records what sub-graphs are asked, and how the exit is reached."""

    __slots__ = (
        "_watched",
        "begun",
        "beside",
        "bypassed",
        "crossing",
        "finished",
        "lacking",
        "noted",
    )

    def __init__(self, net: Network, moment: _LevelState, watched: int) -> None:
        super().__init__(net, moment.states.__getitem__, 0.0, moment.running, moment.active)
        self._watched = watched
        self.begun = moment.begun
        self.noted: list[tuple[TroubleKind, int]] = []
        self.lacking = 0
        self.beside = False
        self.bypassed: list[tuple[int, Precondition]] = []
        self.crossing = False
        self.finished: Precondition | None = None

    def _only_ends(self) -> bool:
        return False  # every edge is to be recorded, also one that is known to lead to the exit

    def _inform(self, index: int, result: Precondition, edges: list[EdgeQuestion | None]) -> None:
        super()._inform(index, result, edges)
        if self.end == "finished" and self.finished is None:
            self.finished = result
            asked = [e for e in edges if e is not None and e.responses[result] != "ignore"]
            self.beside = len(asked) > 1 or bool(self._tasks)

    def _ask(self, index: int, edge: EdgeQuestion, result: Precondition) -> bool:
        child, response = edge.child, edge.responses[result]
        ignored = super()._ask(index, edge, result)
        if response == "ignore":
            return ignored
        if child == self._net.exit:
            if self.end is None and not self._net.needs[child] & ~self._state(child).links:
                self.noted.append(("unready", child))
            return ignored
        if not self._watched >> child & 1:
            return ignored
        bit = 1 << child
        if self.begun & bit:
            self.noted.append(("again", child))
        elif response == "bypass":
            self.begun |= bit
            self.bypassed.append((child, result))
        elif response != "run":
            self.noted.append(("response", child))
        elif self._state(child).does == RUNS:
            self.begun |= bit
        elif not self._net.needs[child] & ~self._state(child).links:
            self.lacking |= bit
        return ignored

    def _bypass(self, index: int, child: int, result: Precondition) -> None:
        super()._bypass(index, child, result)
        self.crossing = self.crossing or len(self._tasks) > 1

    def after(self, before: _LevelState) -> _LevelState:
        """Return the state of the graph once everything of this instant has happened; `before`: its
        state before. Times are dropped, since actions may end in any order, and so are states of
        actions that no running action can reach any more."""
        states = list(before.states)
        for index, state in self.states.items():
            states[index] = state._replace(due=0.0, waiting=False)
        ahead = 0
        for index, state in enumerate(states[:-1]):
            if state.does == RUNS:
                ahead |= self._net.reachable[index] | 1 << index
        nothing = State()
        kept = tuple(state if ahead >> index & 1 else nothing for index, state in enumerate(states))
        return _LevelState(kept, self.running, self.active, self.begun & ahead)


def level_courses(
    graph: Graph,
    inside: Mapping[Key, frozenset[Precondition]],
    budget: int = BUDGET,
    *,
    is_top: bool = False,
) -> LevelCourses:
    """Return a summary of all courses of a graph in which the actions with the keys of `inside` are
    sub-graphs that can end with these results. `budget`: the most states of single actions that are
    examined; `is_top`: it is no sub-graph, so that its own results do not matter."""
    search = _Courses(graph, inside, is_top=is_top)
    search.run(budget)
    return LevelCourses(
        frozenset(search.results),
        tuple(search.troubles.values()),
        frozenset(search.key[index] for index in nodes_in(search.lacking)),
        {key: frozenset(outcomes) for key, outcomes in search.bypassed.items()},
        search.spent,
    )


class _Courses:
    """The search through all states. The first trouble of each kind is kept for each sub-graph."""

    def __init__(
        self, graph: Graph, inside: Mapping[Key, frozenset[Precondition]], *, is_top: bool
    ) -> None:
        self.net = net = Network(graph)
        self.key = {net.index[action.full_name]: action.key for action in graph.actions}
        self.watched = sum(1 << index for index, key in self.key.items() if key in inside)
        self.ends = [
            self._results_of(index, inside.get(self.key[index], frozenset(OUTCOMES)), is_top=is_top)
            for index in range(len(net.nodes))
        ]
        self.results: set[Precondition] = set()
        self.troubles: dict[tuple[TroubleKind, Key | None], Trouble] = {}
        self.lacking = 0
        self.bypassed: dict[Key, set[Precondition]] = {}
        self.spent = 0

    def _results_of(
        self, index: int, results: frozenset[Precondition], *, is_top: bool
    ) -> list[Precondition]:
        """Return those of the results of the action `index` that can make a difference. A failed
        action gives no outputs and may begin again, and a bypass or an inner exit passes the result
        itself on. `is_top`: the graph is no sub-graph."""
        edges = [edge for edge in self.net.edges[index] if edge is not None]
        ending = any(edge.child == self.net.exit for edge in edges) and not is_top
        if ending or any("bypass" in edge.responses.values() for edge in edges):
            return [result for result in OUTCOMES if result in results]
        gives = bool(self.net.nodes[index].outputs) or any(e.child == index for e in edges)
        found: dict[tuple[object, ...], Precondition] = {}
        for result in OUTCOMES:
            if result in results:
                answers = tuple(edge.responses[result] for edge in edges)
                found.setdefault((gives and result == "on_error", *answers), result)
        return list(found.values())

    def run(self, budget: int) -> None:
        """Follow all courses from the start of the graph, and collect their results and troubles.
        If more than `budget` states of single actions would be examined, add the trouble
        `undecided` and end."""
        net = self.net
        first = _LevelState(tuple(State(has=has) for has in net.has), 0, 0, 0)
        instant = _LevelInstant(net, first, self.watched)
        instant.begin()
        open_ = [then] if (then := self._after(instant, first, -1, "")) is not None else []
        known = set(open_)
        while open_:
            moment = open_.pop()
            for index, result in self._ends(moment):
                self.spent += len(moment.states)
                if self.spent > budget:
                    self._note(Trouble("undecided"))
                    return
                instant = _LevelInstant(net, moment, self.watched)
                instant.ends(index, result)
                then = self._after(instant, moment, index, result)
                if then is not None and then not in known:
                    known.add(then)
                    open_.append(then)

    def _ends(self, moment: _LevelState) -> Iterator[tuple[int, Precondition]]:
        for index, state in enumerate(moment.states[:-1]):
            if state.does == RUNS:
                yield from ((index, result) for result in self.ends[index])

    def _note(self, trouble: Trouble) -> None:
        self.troubles.setdefault((trouble.kind, trouble.action), trouble)

    def _after(
        self, instant: _LevelInstant, before: _LevelState, index: int, result: str
    ) -> _LevelState | None:
        """Record the events of an instant, at which the action `index` (-1 for the entry) has ended
        with `result`; return the state after it, None if the graph has ended. `before`: the state
        before it."""
        by = self.net.names[index] if index >= 0 else ""
        for kind, child in instant.noted:
            self._note(Trouble(kind, self.key.get(child), by, result))
        for child, outcome in instant.bypassed:
            self.bypassed.setdefault(self.key[child], set()).add(outcome)
            if instant.crossing:
                self._note(Trouble("crossing", self.key[child], by, result))
        self.lacking |= instant.lacking
        then = instant.after(before)
        match instant.end:
            case "finished":
                self._finished(instant, then, by, result, index)
                return None
            case "halted":
                self._note(Trouble("halts", None, by, result))
                return None
            case "crashed" | "locked":
                self._note(Trouble("crash", None, by, result))
                return None
            case None if not any(state.does == RUNS for state in then.states):
                self._note(Trouble("waits", None, by, result))
                return None
            case _:
                return then

    def _finished(
        self, instant: _LevelInstant, then: _LevelState, by: str, result: str, index: int
    ) -> None:
        if instant.finished is not None:
            self.results.add(instant.finished)
        if instant.early:
            self._note(Trouble("early", None, by, result))
        if instant.beside:
            self._note(Trouble("beside", None, by, result))
        for other in nodes_in(self.watched):
            if other != index and then.states[other].does == RUNS:
                self._note(Trouble("ends", self.key[other], by, result))
