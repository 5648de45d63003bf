"""Every course of one graph, with each sub-graph taken for one action: what decides whether its
sub-graphs can be put in their places.

States are those of `courses.instants`; from each, every end of every action that goes on is followed
once, in any order. A sub-graph ends with what its own courses end with.
"""

from collections.abc import Iterator, Mapping
from typing import Final, Literal, NamedTuple, TypeAlias

from action_assistant.umrf.components import nodes_in
from action_assistant.umrf.courses.instants import Instant, State
from action_assistant.umrf.courses.network import EdgeQuestion, Network
from action_assistant.umrf.model import OUTCOMES, Graph, Key, Precondition
from action_assistant.umrf.semantics.transitions import RUNS

#: Places of states that are looked at for one hierarchy: about two seconds.
BUDGET: Final = 2_000_000

#: `halts`, `waits`: the graph does not reach its exit. `unready`: the exit lacks outputs. `early`: something runs when it does, `beside`:
#: who reaches it asks others as well. `ends`: it reaches it while this sub-graph runs. `again`:
#: this sub-graph is told something a second time. `crossing`: it is bypassed together with others.
#: `response`: it is told to do something else. `crash`: of the engine.
TroubleKind: TypeAlias = Literal[
    "halts", "waits", "unready", "early", "beside", "ends", "again", "crossing", "response",
    "crash", "undecided",
]  # fmt: skip


class Trouble(NamedTuple):
    """What a course comes to. `action`: the sub-graph it happens to; else nobody. `by` and `result`:
    who ended last, and how; the start where it is nobody."""

    kind: TroubleKind
    action: Key | None = None
    by: str = ""
    result: str = ""


class LevelCourses(NamedTuple):
    """What all courses of a graph have in common. `lacking`: sub-graphs that wait for an input when
    all that they wait for otherwise is there. `bypassed`: those that are bypassed, by which
    outcomes."""

    results: frozenset[Precondition] = frozenset()
    troubles: tuple[Trouble, ...] = ()
    lacking: frozenset[Key] = frozenset()
    bypassed: Mapping[Key, frozenset[Precondition]] = {}
    spent: int = 0


class _LevelState(NamedTuple):
    """A state of the graph. `begun`: sub-graphs that have begun, as a mask."""

    states: tuple[State, ...]
    running: int
    active: int
    begun: int


class _LevelInstant(Instant):
    """An instant that notes what is asked of sub-graphs, and how the exit is reached."""

    __slots__ = (
        "_watched",
        "begun",
        "beside",
        "bypassed",
        "crossing",
        "finished",
        "lacking",
        "told",
    )

    def __init__(self, net: Network, moment: _LevelState, watched: int) -> None:
        super().__init__(net, moment.states.__getitem__, 0.0, moment.running, moment.active)
        self._watched = watched
        self.begun = moment.begun
        self.told: list[tuple[TroubleKind, int]] = []
        self.lacking = 0
        self.beside = False
        self.bypassed: list[tuple[int, Precondition]] = []
        self.crossing = False
        self.finished: Precondition | None = None

    def _only_ends(self) -> bool:
        return False  # each edge shall be seen, also where it is known to lead to the exit

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
                self.told.append(("unready", child))
            return ignored
        if not self._watched >> child & 1:
            return ignored
        bit = 1 << child
        if self.begun & bit:
            self.told.append(("again", child))
        elif response == "bypass":
            self.begun |= bit
            self.bypassed.append((child, result))
        elif response != "run":
            self.told.append(("response", child))
        elif self._state(child).does == RUNS:
            self.begun |= bit
        elif not self._net.needs[child] & ~self._state(child).links:
            self.lacking |= bit
        return ignored

    def _bypass(self, index: int, child: int, result: Precondition) -> None:
        super()._bypass(index, child, result)
        self.crossing = self.crossing or len(self._tasks) > 1

    def after(self, before: _LevelState) -> _LevelState:
        """The state that follows. Times do not matter, since any order of ends is looked at; nor does
        what has become of actions to which nothing that goes on leads any more."""
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
    """All courses of a graph in which these actions are sub-graphs, with what those end with. What the
    top graph itself ends with need not be known."""
    search = _Courses(graph, inside, is_top=is_top)
    search.look(budget)
    return LevelCourses(
        frozenset(search.results),
        tuple(search.troubles.values()),
        frozenset(search.key[index] for index in nodes_in(search.lacking)),
        {key: frozenset(outcomes) for key, outcomes in search.bypassed.items()},
        search.spent,
    )


class _Courses:
    """The search through all states. The first trouble of a kind is kept for each sub-graph."""

    def __init__(
        self, graph: Graph, inside: Mapping[Key, frozenset[Precondition]], *, is_top: bool
    ) -> None:
        self.net = net = Network(graph)
        self.key = {net.index[action.full_name]: action.key for action in graph.actions}
        self.watched = sum(1 << index for index, key in self.key.items() if key in inside)
        self.ends = [
            self._telling(index, inside.get(self.key[index], frozenset(OUTCOMES)), is_top=is_top)
            for index in range(len(net.nodes))
        ]
        self.results: set[Precondition] = set()
        self.troubles: dict[tuple[TroubleKind, Key | None], Trouble] = {}
        self.lacking = 0
        self.bypassed: dict[Key, set[Precondition]] = {}
        self.spent = 0

    def _telling(
        self, index: int, results: frozenset[Precondition], *, is_top: bool
    ) -> list[Precondition]:
        """The results of an action that can make a difference: a failed one gives nothing and may
        begin anew, and what a bypass hands on, or an inner exit, is the result itself."""
        told = [edge for edge in self.net.edges[index] if edge is not None]
        ending = any(edge.child == self.net.exit for edge in told) and not is_top
        if ending or any("bypass" in edge.responses.values() for edge in told):
            return [result for result in OUTCOMES if result in results]
        gives = bool(self.net.nodes[index].outputs) or any(e.child == index for e in told)
        found: dict[tuple[object, ...], Precondition] = {}
        for result in OUTCOMES:
            if result in results:
                answers = tuple(edge.responses[result] for edge in told)
                found.setdefault((gives and result == "on_error", *answers), result)
        return list(found.values())

    def look(self, budget: int) -> None:
        """Goes through all of them."""
        net = self.net
        first = _LevelState(tuple(State(has=has) for has in net.has), 0, 0, 0)
        instant = _LevelInstant(net, first, self.watched)
        instant.begin()
        open_ = [then] if (then := self._seen(instant, first, -1, "")) is not None else []
        known = set(open_)
        while open_:
            moment = open_.pop()
            for index, result in self._ends(moment):
                self.spent += len(moment.states)
                if self.spent > budget:
                    self._tell(Trouble("undecided"))
                    return
                instant = _LevelInstant(net, moment, self.watched)
                instant.ends(index, result)
                then = self._seen(instant, moment, index, result)
                if then is not None and then not in known:
                    known.add(then)
                    open_.append(then)

    def _ends(self, moment: _LevelState) -> Iterator[tuple[int, Precondition]]:
        for index, state in enumerate(moment.states[:-1]):
            if state.does == RUNS:
                yield from ((index, result) for result in self.ends[index])

    def _tell(self, trouble: Trouble) -> None:
        self.troubles.setdefault((trouble.kind, trouble.action), trouble)

    def _seen(
        self, instant: _LevelInstant, before: _LevelState, index: int, result: str
    ) -> _LevelState | None:
        """Notes what came of an instant. The state after it, if the graph goes on."""
        by = self.net.names[index] if index >= 0 else ""
        for kind, child in instant.told:
            self._tell(Trouble(kind, self.key.get(child), by, result))
        for child, outcome in instant.bypassed:
            self.bypassed.setdefault(self.key[child], set()).add(outcome)
            if instant.crossing:
                self._tell(Trouble("crossing", self.key[child], by, result))
        self.lacking |= instant.lacking
        then = instant.after(before)
        match instant.end:
            case "finished":
                self._finished(instant, then, by, result, index)
                return None
            case "halted":
                self._tell(Trouble("halts", None, by, result))
                return None
            case "crashed" | "locked":
                self._tell(Trouble("crash", None, by, result))
                return None
            case None if not any(state.does == RUNS for state in then.states):
                self._tell(Trouble("waits", None, by, result))
                return None
            case _:
                return then

    def _finished(
        self, instant: _LevelInstant, then: _LevelState, by: str, result: str, index: int
    ) -> None:
        if instant.finished is not None:
            self.results.add(instant.finished)
        if instant.early:
            self._tell(Trouble("early", None, by, result))
        if instant.beside:
            self._tell(Trouble("beside", None, by, result))
        for other in nodes_in(self.watched):
            if other != index and then.states[other].does == RUNS:
                self._tell(Trouble("ends", self.key[other], by, result))
