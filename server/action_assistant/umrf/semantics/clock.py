"""Virtual time, states and hazards: the base on which the rules of the simulated engine stand."""

from collections import deque
from collections.abc import Callable
from heapq import heappop, heappush
from math import inf
from typing import TypeAlias

from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.semantics.parts import ACTIVE, HELD, Node, Running
from action_assistant.umrf.semantics.trace import (
    GraphStateEvent,
    HazardEvent,
    NodeStateEvent,
    Trace,
)

Task: TypeAlias = Callable[[], None]


class Clock:
    """Runs the events of a simulated engine in the order of their time, counts the states of
    actions, and collects the trace."""

    def __init__(self, facts: EngineFacts) -> None:
        self.facts = facts
        self.graphs: dict[str, Running] = {}
        self.now = 0.0
        #: The code of the hazard that ended the process; None while it lives.
        self.crashed: str | None = None
        #: True once the engine's lock is held without end: no command is answered any more.
        self.locked = False
        self._heap: list[tuple[float, int, Task]] = []
        self._order = 0
        self._tasks: deque[Task] = deque()
        self._out: list[Trace] = []
        self._touched: set[Running] = set()

    # Time

    def _at(self, t_ms: float, task: Task) -> None:
        self._order += 1
        heappush(self._heap, (t_ms, self._order, task))

    def _soon(self, task: Task) -> None:
        self._tasks.append(task)

    def _run_until(self, to_ms: float) -> None:
        self._settle()
        while self._heap and self._heap[0][0] <= to_ms:
            t_ms, _, task = heappop(self._heap)
            self.now = max(self.now, t_ms)
            task()
            self._settle()
        self.now = max(self.now, to_ms) if to_ms != inf else self.now

    def _settle(self) -> None:
        """Run all events of the present instant, also those that they cause."""
        while self._tasks:
            self._tasks.popleft()()
        for graph in self._touched:
            self._notice_stuck(graph)
        self._touched.clear()

    # States

    def _state(self, graph: Running, node: Node, state: str) -> None:
        graph.count(node.state, -1)
        graph.count(state, 1)
        node.state = state
        event = NodeStateEvent(self._t(), graph.name, node.full_name, state, graph.actor_of(node))
        self._out.append(event)
        if state not in ACTIVE or state in HELD:
            self._touched.add(graph)

    def _graph_state(self, graph: Running, state: str) -> None:
        graph.state = state
        self._out.append(GraphStateEvent(self._t(), graph.name, state))
        self._touched.add(graph)

    def _t(self) -> float:
        return round(self.now, 3)

    def _hazard(
        self, graph: Running, code: str, effect: str, message: str, node: Node | None = None
    ) -> None:
        name = node.full_name if node else None
        self._out.append(HazardEvent(self._t(), graph.name, code, effect, name, message))

    def _crash(self, graph: Running, code: str, message: str, node: Node | None = None) -> None:
        """Let the simulated engine crash, which ends all of its graphs, and report the hazard with
        this code and message at the graph or the action `node`."""
        self._hazard(graph, code, "crash", message, node)
        self.crashed = code
        self._halt_time()

    def _halt_time(self) -> None:
        self._heap.clear()
        self._tasks.clear()
        self._touched.clear()

    def _lock(self, graph: Running, code: str, message: str, node: Node | None = None) -> None:
        self._hazard(graph, code, "hang", message, node)
        self.locked = True

    def _notice_stuck(self, graph: Running) -> None:
        if graph.state != "RUNNING" or graph.stuck or graph.active > graph.held:
            return
        if graph.pausing or graph.loading or self.locked:
            return
        graph.stuck = True
        if graph.held:
            message = "Only paused actions are left; a pause and a resume of the graph wake them."
        else:
            message = "Nothing runs and nothing will: the graph stays RUNNING for ever."
        self._hazard(graph, "H8", "goes on", message)
