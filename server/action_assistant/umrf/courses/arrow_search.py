"""Searches for the results of actions, and the order of their ends, under which a graph takes an
arrow.

Each state that can follow from another by one end of an action is examined once; states with the
fewest arrows to the parent come first. The simulator then plays the script that was found, and
decides. A search that runs out of states proves that no results and no order of ends take the
arrow, provided that actions give their outputs and stop when they are told to.
"""

from collections.abc import Iterator, Mapping, Sequence
from heapq import heappop, heappush
from typing import Final, NamedTuple, TypeAlias

import msgspec

from action_assistant.safe_text import hold_names
from action_assistant.umrf.courses.coverage import OutcomeArrow, arrows_taken
from action_assistant.umrf.courses.instants import DUE, Instant, State
from action_assistant.umrf.courses.network import EdgeQuestion, Network
from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.model import ENTRY, EXIT, OUTCOMES, Graph, Precondition
from action_assistant.umrf.semantics.script import Behaviour, Script
from action_assistant.umrf.semantics.simulate import DAY_MS, simulate
from action_assistant.umrf.semantics.steps import MOST
from action_assistant.umrf.semantics.transitions import GIVING_UP, IDLE, RUNS, STOPS

#: The states of single actions that one search may examine: about two seconds.
BUDGET: Final = 2_000_000
#: Seconds between two ends; far less than a stop may take.
_GAP_S: Final = 0.1
_FAR: Final = 1 << 30


class ArrowReached(msgspec.Struct, frozen=True, tag_field="verdict", tag="reached"):
    """The arrow can be taken; it is taken under this script."""

    script: Script


class ArrowUnreachable(msgspec.Struct, frozen=True, tag_field="verdict", tag="unreachable"):
    """The arrow can never be taken: all states of the graph that could lead to it were examined,
    `states` in number."""

    states: int


class ArrowUndecided(msgspec.Struct, frozen=True, tag_field="verdict", tag="undecided"):
    """The search ended without a result after it had found `states` states; `why` says the reason
    in a sentence."""

    states: int
    why: str

    def __post_init__(self) -> None:
        hold_names(self, "why")


ArrowSearch: TypeAlias = ArrowReached | ArrowUnreachable | ArrowUndecided


class _End(NamedTuple):
    """The end of one action, by index. `result` counts only for an action that runs, not for one
    that is being stopped or given up."""

    action: int
    result: Precondition


class _GraphState(NamedTuple):
    """The state of the whole graph: the state of each action and of the exit, and how many are
    running and active."""

    states: tuple[State, ...]
    running: int
    active: int


class _RecordingInstant(Instant):
    """An instant that records which edges were answered with anything but to ignore the result."""

    __slots__ = ("asked",)

    def __init__(self, net: Network, moment: _GraphState) -> None:
        super().__init__(net, moment.states.__getitem__, 0.0, moment.running, moment.active)
        self.asked: set[tuple[int, int, Precondition]] = set()

    def _ask(self, index: int, edge: EdgeQuestion, result: Precondition) -> bool:
        if edge.responses[result] != "ignore":
            self.asked.add((index, edge.child, result))
        return super()._ask(index, edge, result)

    def _only_ends(self) -> bool:
        return False  # every edge is to be recorded, also one that is known to lead to the exit

    def after(self, before: _GraphState) -> _GraphState:
        """Return the state of the graph after this instant; `before`: the state before it. The
        times at which actions end are set to 0, since the search tries every order of ends."""
        states = list(before.states)
        for index, state in self.states.items():
            states[index] = state._replace(due=0.0)
        return _GraphState(tuple(states), self.running, self.active)


def search_arrow(
    graph: Graph,
    wanted: OutcomeArrow,
    budget: int = BUDGET,
    inside: Mapping[str, Graph] | None = None,
) -> ArrowSearch:
    """Search for a script under which the arrow `wanted` is taken.

    `inside`: the graphs that can be sub-graphs, by name. How a sub-graph ends is not searched: it
    is assumed that it can end with any result, and the simulator then proves whether the script
    works. `budget`: how many states of single actions are examined at most.
    """
    net = Network(graph)
    indices = {action.key: net.index.get(action.full_name, -2) for action in graph.actions}
    indices |= {ENTRY: -1, EXIT: net.exit}
    parent, child = indices.get(wanted.parent, -2), indices.get(wanted.child, -2)
    if -2 in (parent, child):
        return ArrowUnreachable(0)
    search = _Search(net, (parent, child, wanted.outcome), budget)
    ends = search.found()
    if ends is None:
        if search.spent >= budget:
            return ArrowUndecided(search.looked, "There are more states than are examined.")
        if any(action.type == "spontaneous" for action in graph.actions):
            return ArrowUndecided(search.looked, "Spontaneous actions may end at any time.")
        return ArrowUnreachable(search.looked)
    script = search.script(ends)
    traces = simulate(
        graph,
        script=script,
        library=inside,
        facts=SIMULATED,
        until_ms=DAY_MS,
        max_events=MOST,
    )
    if wanted in arrows_taken(graph, traces).arrows:
        return ArrowReached(script)
    return ArrowUndecided(search.looked, "The simulator does not follow the course that was found.")


class _Search:
    """The search for one arrow. `looked`: how many graph states were found; `spent`: how much of
    the budget was used."""

    def __init__(self, net: Network, wanted: tuple[int, int, Precondition], budget: int) -> None:
        self.looked = 0
        self.spent = 0
        self._net = net
        self._wanted = wanted
        self._budget = budget
        self._far = _distances(net, wanted[0])
        self._results = [self._results_of(row) for row in net.edges]

    def found(self) -> tuple[_End, ...] | None:
        """Search for a course in which the wanted arrow is taken. Return the ends of actions, with
        their results, that lead to it, in the order in which they happen; the tuple is empty if
        the arrow is taken at the start. Return None if no course was found within the budget."""
        first = _first(self._net)
        instant = _RecordingInstant(self._net, first)
        instant.begin()
        if self._wanted in instant.asked:
            return ()
        if instant.end is not None:
            return None
        known: dict[_GraphState, tuple[_GraphState, _End] | None] = {instant.after(first): None}
        open_: list[tuple[int, int, int, _GraphState]] = []
        self._push(open_, next(iter(known)), 0)
        while open_ and self.spent < self._budget:
            _, depth, _, moment = heappop(open_)
            for end in self._ends(moment):
                self.spent += len(moment.states)
                instant = _RecordingInstant(self._net, moment)
                instant.ends(end.action, end.result)
                if self._wanted in instant.asked:
                    return (*_way(known, moment), end)
                if instant.end is None and (then := instant.after(moment)) not in known:
                    known[then] = moment, end
                    self._push(open_, then, depth + 1)
        return None

    def _push(
        self, open_: list[tuple[int, int, int, _GraphState]], moment: _GraphState, depth: int
    ) -> None:
        self.looked += 1
        active = (n for n, state in enumerate(moment.states) if state.does in DUE)
        far = min((self._far[index] for index in active), default=_FAR)
        if far < _FAR:  # otherwise no active action leads to the arrow
            heappush(open_, (2 * far + depth, depth, self.looked, moment))

    def _ends(self, moment: _GraphState) -> Iterator[_End]:
        for index, state in enumerate(moment.states):
            match state.does:
                case 1:
                    yield from (_End(index, result) for result in self._results[index])
                case 2:
                    yield _End(index, "on_stopped")
                case 4:
                    yield _End(index, "on_error")
                case _:
                    pass

    def _results_of(self, row: Sequence[EdgeQuestion | None]) -> list[Precondition]:
        """Return the results of an action that can make a difference, given its edges (`row`; None
        for an edge at which the engine aborts). A failed action gives no outputs and may begin
        again, and a bypass passes the result itself on."""
        if any(edge is None or "bypass" in edge.responses.values() for edge in row):
            return list(OUTCOMES)
        found: dict[tuple[object, ...], Precondition] = {}
        for result in OUTCOMES:
            answers = tuple(edge.responses[result] for edge in row if edge is not None)
            own = result if result in {"on_error", self._wanted[2]} else ""
            found.setdefault((own, *answers), result)
        return list(found.values())

    def script(self, ends: Sequence[_End]) -> Script:
        """Return the script under which actions end in the order and with the results of `ends`."""
        visits: dict[int, list[_Visit]] = {}
        before = _first(self._net)
        for step, end in enumerate((None, *ends)):
            instant = _RecordingInstant(self._net, before)
            if end is None:
                instant.begin()
            else:
                instant.ends(end.action, end.result)
                own = visits[end.action]
                own[-1] = own[-1]._replace(ended=step, result=end.result)
            after = instant.after(before)
            for index, state in instant.states.items():
                own = visits.setdefault(index, [])
                is_ended = end is not None and end.action == index
                was = IDLE if is_ended else before.states[index].does
                if state.does == RUNS and was != RUNS:
                    own.append(_Visit(step))
                elif state.does in (STOPS, GIVING_UP) and was not in (STOPS, GIVING_UP):
                    own[-1] = own[-1]._replace(stopped=step)
            before = after
        last = len(ends)
        names = self._net.names
        return Script(
            {names[p]: tuple(_behaviours(own, last)) for p, own in sorted(visits.items()) if own}
        )


class _Visit(NamedTuple):
    """One run of an action: the numbers of the steps at which it begins, is stopped and ends. -1
    stands for never."""

    begun: int
    stopped: int = -1
    ended: int = -1
    result: Precondition = "on_true"


def _behaviours(visits: Sequence[_Visit], last: int) -> Iterator[Behaviour]:
    """Yield one behaviour for each visit of an action, then the default one for all further visits.
    A visit whose end the search did not reach ends after the step `last`, with on_true unless it is
    stopped."""
    for visit in visits:
        if visit.stopped >= 0:
            ended = visit.ended if visit.ended >= 0 else last + 1
            stop_s = max(1, ended - visit.stopped) * _GAP_S
            yield Behaviour(never=True, stop_s=round(stop_s, 3))
        else:
            ended = visit.ended if visit.ended >= 0 else last + 1
            after_s = round((ended - visit.begun) * _GAP_S, 3)
            yield Behaviour(after_s=after_s, result=visit.result)
    yield Behaviour()


def _first(net: Network) -> _GraphState:
    return _GraphState(tuple(State(has=has) for has in net.has), 0, 0)


def _way(
    known: dict[_GraphState, tuple[_GraphState, _End] | None], moment: _GraphState
) -> tuple[_End, ...]:
    found: list[_End] = []
    before = known[moment]
    while before is not None:
        moment, end = before
        found.append(end)
        before = known[moment]
    return tuple(reversed(found))


def _distances(net: Network, to: int) -> list[int]:
    """Return for each action, by index, the least number of arrows from it to the action with the
    index `to`; a large number if no path leads there."""
    above: dict[int, list[int]] = {}
    for index, row in enumerate(net.edges):
        for edge in row:
            answers = edge is not None and set(edge.responses.values()) != {"ignore"}
            if edge is not None and answers:
                above.setdefault(edge.child, []).append(index)
    far = [_FAR] * (len(net.nodes) + 1)
    if to < 0:
        return far  # the entry reports at the start only
    far[to] = 0
    border = [to]
    while border:
        border = [p for index in border for p in above.get(index, ()) if _nearer(far, p, index)]
    return far


def _nearer(far: list[int], index: int, child: int) -> bool:
    if far[index] <= far[child] + 1:
        return False
    far[index] = far[child] + 1
    return True
