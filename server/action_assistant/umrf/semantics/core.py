"""The engine's clockwork: what one action's end sets in motion (SPEC 2.3, 2.4, 2.9)."""

from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from heapq import heappop, heappush
from math import inf
from typing import TypeAlias

from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics.parts import (
    ACTIVE,
    HELD,
    Edge,
    Link,
    Node,
    Outcome,
    Running,
    linked_nodes,
)
from action_assistant.umrf.semantics.script import OUTCOMES, Script
from action_assistant.umrf.semantics.trace import (
    Dispatch,
    EdgeEval,
    GraphResult,
    GraphState,
    Hazard,
    NodeResult,
    NodeState,
    NotReady,
    Trace,
)
from action_assistant.umrf.semantics.values import RemapUnknown, fill_outputs, hand_over

Task: TypeAlias = Callable[[], None]

#: A node that starts so often at one instant runs in a loop without time.
INSTANT_LAPS = 3
#: So many bypasses at one instant, and ten for each action, are a circle.
BYPASSES = 1_000

_OUTCOMES: dict[str, Outcome] = {
    "on_true": "on_true", "on_false": "on_false", "on_error": "on_error",
}  # fmt: skip
assert set(_OUTCOMES) == set(OUTCOMES)


class Core:
    """Time, states, and the propagation of results. `Engine` adds the commands."""

    def __init__(
        self, facts: EngineFacts, script: Script, library: Mapping[str, Graph], actor: str
    ) -> None:
        self.facts = facts
        self.script = script
        self.library = library
        self.actor = actor
        self.graphs: dict[str, Running] = {}
        self.now = 0.0
        #: Code of the hazard that ended the process, if one did.
        self.crashed: str | None = None
        #: Whether the engine's lock is held for ever: no command is answered any more.
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
        """Carries out everything that happens at this instant."""
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
        self._out.append(NodeState(self._t(), graph.name, node.full_name, state))
        if state not in ACTIVE or state in HELD:
            self._touched.add(graph)

    def _graph_state(self, graph: Running, state: str) -> None:
        graph.state = state
        self._out.append(GraphState(self._t(), graph.name, state))
        self._touched.add(graph)

    def _t(self) -> float:
        return round(self.now, 3)

    def _hazard(
        self, graph: Running, code: str, effect: str, message: str, node: Node | None = None
    ) -> None:
        name = node.full_name if node else None
        self._out.append(Hazard(self._t(), graph.name, code, effect, name, message))

    def _crash(self, graph: Running, code: str, message: str, node: Node | None = None) -> None:
        """The engine's process ends here, with every graph in it."""
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
        if graph.pausing or self.locked:
            return
        graph.stuck = True
        if graph.held:
            message = "Only paused actions are left; a pause and a resume of the graph wake them."
        else:
            message = "Nothing runs and nothing will: the graph stays RUNNING for ever."
        self._hazard(graph, "H8", "goes on", message)

    # Results

    def _inform(self, graph: Running, node: Node, result: Outcome) -> None:
        """`startChildNodes`: asks every child what it does now that `node` ended."""
        if graph.state != "RUNNING":
            return
        ignored = 0
        for edge in node.children:
            child = edge.child
            link = child.links.get(node.full_name) if child else None
            if child is None or link is None:
                what = "does not exist" if child is None else "does not list it as a parent"
                message = f"The child in “{edge.label}” {what}: the engine aborts."
                self._crash(graph, "H2", message, node)
                return
            answer = self._ask(graph, node, edge, child, link, result)
            if answer == "done":
                return
            ignored += answer == "ignored"
        others = graph.running - (node.state == "RUNNING")
        if ignored == len(node.children) and others == 0:
            graph.result = "on_halted"
            self._graph_state(graph, "HALTED")
            self._sub_halted(graph)

    def _ask(
        self, graph: Running, node: Node, edge: Edge, child: Node, link: Link, result: Outcome
    ) -> str:
        """One relation. `done` ends the round, `ignored` counts for HALTED, `` neither."""
        child.receive(link)
        response = link.conditions.answer(result)
        self._out.append(EdgeEval(self._t(), graph.name, edge.label, f"{result} -> {response}"))
        if response == "bypass":
            if child is graph.exit:
                self._finish(graph, node, result)
                return "done"
            self._bypass(graph, child, result)
            return ""
        if response == "ignore":
            return "ignored"
        try:
            hand_over(node.outputs, edge.remap, child.inputs)
        except RemapUnknown as e:
            message = (
                f"“{edge.label}” renames the output “{e}”, which does not exist: the engine aborts."
            )
            self._crash(graph, "H2", message, node)
            return "done"
        if not self._is_ready(graph, child):
            return ""
        if child is graph.exit:
            self._finish(graph, node, result)
            return "done"
        self._out.append(Dispatch(self._t(), graph.name, child.full_name, response))
        match response:
            case "run":
                self._run(graph, child)
            case "stop":
                self._stop_node(graph, child)
            case "pause":
                self._pause_by_response(graph, child)
            case "restart":
                pass
        return "done" if self.crashed else ""

    def _is_ready(self, graph: Running, child: Node) -> bool:
        has_inputs = child.has_inputs()
        if has_inputs and not child.waiting_links:
            return True
        inputs = "ok" if has_inputs else "missing"
        parents = "missing" if child.waiting_links else "ok"
        why = f"inputs={inputs} parents={parents}"
        self._out.append(NotReady(self._t(), graph.name, child.full_name, why))
        return False

    def _bypass(self, graph: Running, child: Node, result: Outcome) -> None:
        if not self.facts.bypass_fixed or self.facts.simulated:
            message = "A bypass to an action reads freed memory: the engine may abort here."
            self._hazard(graph, "H3", "goes on", message, child)
        graph.bypasses = graph.bypasses + 1 if graph.bypassed_ms == self.now else 0
        graph.bypassed_ms = self.now
        if graph.bypasses > BYPASSES + 10 * len(graph.nodes):
            message = "A bypass goes round in circles: the engine starts threads without end."
            self._lock(graph, "H3", message, child)
            self._halt_time()
            return
        self._soon(partial(self._inform, graph, child, result))

    def _finish(self, graph: Running, last: Node, result: Outcome) -> None:
        graph.result = result
        self._graph_state(graph, "FINISHED")
        self._out.append(GraphResult(self._t(), graph.name, result))
        if graph.active - last.active > 0:
            message = "The graph is FINISHED while actions still run; a stop does not reach them."
            self._hazard(graph, "H12", "goes on", message)
        self._soon(partial(self._sub_ended, graph, result))

    # The life of an action

    def _run(self, graph: Running, node: Node) -> None:
        if node.state == "RUNNING":
            return
        if node.subgraph is None and not node.loaded and node.state != "UNINITIALIZED":
            if not node.failed_to_load:
                self._soon(partial(self._run_unloaded, graph, node))
                return
        elif node.active or node.busy_until > self.now:
            message = (
                f"“run” reaches {node.full_name}, whose thread still lives: the engine aborts."
            )
            self._crash(graph, "H4", message, node)
            return
        node.again = node.again + 1 if node.started_ms == self.now else 0
        node.started_ms = self.now
        if node.again >= INSTANT_LAPS:
            message = "Actions without duration in a loop: the engine blocks itself."
            self._lock(graph, "H5", message, node)
            self._halt_time()
            return
        node.token += 1
        node.call = node.behaviours[min(node.calls, len(node.behaviours) - 1)]
        if node.subgraph is not None:
            node.calls += 1
            self._state(graph, node, "RUNNING")
            self._soon(partial(self._start_sub, graph, node, node.subgraph))
        elif self._load(graph, node):
            self._begin(graph, node)

    def _run_unloaded(self, graph: Running, node: Node) -> None:
        if not node.active:
            self._state(graph, node, "RUNNING")
        message = "The file carried a state, so the action was never loaded: the engine aborts."
        self._crash(graph, "H1", message, node)

    def _load(self, graph: Running, node: Node) -> bool:
        if node.loaded:
            return True
        if node.call.init_error:
            node.calls += 1
            node.failed_to_load = True
            self._state(graph, node, "ERROR")
            self._state(graph, node, "ERROR")
            self._result(graph, node, "on_error")
            self._soon(partial(self._inform, graph, node, "on_error"))
            return False
        node.loaded = True
        self._state(graph, node, "INITIALIZED")
        return True

    def _begin(self, graph: Running, node: Node) -> None:
        node.calls += 1
        node.rest_ms = None
        self._state(graph, node, "RUNNING")
        duration = node.call.after_s * 1000
        if node.type == "spontaneous":
            duration = max(duration, 1.0)
        self._let_run(graph, node, inf if node.call.never else duration)

    def _let_run(self, graph: Running, node: Node, duration_ms: float) -> None:
        node.due_ms = self.now + duration_ms
        if node.due_ms < inf:
            self._at(node.due_ms, partial(self._returns, graph, node, node.token))

    def _returns(self, graph: Running, node: Node, token: int) -> None:
        if node.token == token:
            self._ended(graph, node, _OUTCOMES[node.call.result])

    def _ended(self, graph: Running, node: Node, result: Outcome) -> None:
        """`onRun` returned, or threw (`on_error`)."""
        if node.state in HELD:
            node.pending = result
            return
        if node.state == "STOPPING":
            result = "on_stopped"
        node.token += 1
        node.returning = True
        node.due_ms = None
        if node.subgraph is None and result in ("on_true", "on_false"):
            fill_outputs(node.outputs, node.call.outputs)
        self._result(graph, node, result)
        failed = result == "on_error" and node.subgraph is None
        if failed:
            self._state(graph, node, "ERROR")
        if node.type == "spontaneous":
            self._stop_downstream(graph, node, partial(self._after, graph, node, result, failed))
        else:
            self._after(graph, node, result, failed)

    def _after(self, graph: Running, node: Node, result: Outcome, failed: bool) -> None:
        self._inform(graph, node, result)
        if self.crashed:
            return
        again = node.type == "spontaneous" and node.state == "RUNNING"
        if not failed:
            self._state(graph, node, "FINISHED")
        node.returning = False
        for slot in node.inputs.values():
            slot.end_of_run()
        if again:
            self._run(graph, node)

    def _result(self, graph: Running, node: Node, result: str) -> None:
        said = node.call.message if result != "on_stopped" else None
        self._out.append(NodeResult(self._t(), graph.name, node.full_name, result, said))

    # Stop and pause of one action

    def _stop_node(self, graph: Running, node: Node) -> None:
        if node.state == "STOPPING":
            message = (
                f"“stop” reaches {node.full_name}, which is stopping already: the engine aborts."
            )
            self._crash(graph, "H4", message, node)
            return
        if not node.active:
            return
        if not node.loaded and node.subgraph is None:
            self._state(graph, node, "STOPPING")
            message = "The file carried a state, so the action was never loaded: the engine aborts."
            self._crash(graph, "H1", message, node)
            return
        held = node.state in HELD
        self._state(graph, node, "STOPPING")
        if node.returning:
            return
        node.token += 1
        timeout = self.now + self.facts.stop_timeout_ms
        self._at(timeout, partial(self._stop_timed_out, graph, node, node.token))
        if held and not self.facts.pauses_safely:
            message = "A paused action cannot be stopped: ERROR after 5 s, and its thread stays."
            self._hazard(graph, "H5", "goes on", message, node)
            node.busy_until = inf
        elif node.subgraph is not None:
            self._soon(partial(self._stop_sub, node))
        else:
            self._ask_to_stop(graph, node, held)

    def _ask_to_stop(self, graph: Running, node: Node, held: bool) -> None:
        ends = self.now + node.rest_ms if held and node.rest_ms is not None else node.due_ms
        if ends is None:
            ends = inf
        if not node.call.ignores_stop:
            ends = min(ends, self.now + node.call.stop_s * 1000)
        if ends < inf:
            self._at(ends, partial(self._stopped, graph, node, node.token))
        node.busy_until = ends

    def _stopped(self, graph: Running, node: Node, token: int) -> None:
        if node.token == token:
            self._ended(graph, node, "on_stopped")

    def _stop_timed_out(self, graph: Running, node: Node, token: int) -> None:
        if node.token != token or node.state != "STOPPING":
            return
        node.token += 1
        graph.stop_failed = True
        self._state(graph, node, "ERROR")
        self._result(graph, node, "on_error")
        self._inform(graph, node, "on_error")

    def _stop_downstream(self, graph: Running, node: Node, then: Task) -> None:
        """What a spontaneous action does to everything that it leads to before it informs."""
        if graph.state != "RUNNING":
            then()
            return
        linked = linked_nodes(graph, node)
        if linked is None:
            message = "A spontaneous action leads into a loop: the engine recurses until it dies."
            self._crash(graph, "H9", message, node)
            return
        if not any(other.active for other in linked):
            then()
            return
        for other in linked:
            if other.active and other.state != "STOPPING":
                self._stop_node(graph, other)
        self._wait(linked, self.facts.stop_poll_ms, then)

    def _wait(self, nodes: list[Node], poll_ms: int, then: Task) -> None:
        """Asks every `poll_ms` whether none of these is active any more."""

        def look() -> None:
            if any(node.active for node in nodes):
                self._at(self.now + poll_ms, look)
            else:
                then()

        self._at(self.now + poll_ms, look)

    def _pause_by_response(self, graph: Running, node: Node) -> None:
        if not self._pause_node(graph, node):
            message = f"{node.full_name} handles no pause: it never leaves PAUSE_REQUESTED."
            self._hazard(graph, "H5", "goes on", message, node)

    def _pause_node(self, graph: Running, node: Node) -> bool:
        """Whether the action is paused, or was not running."""
        if node.state != "RUNNING":
            return True
        self._state(graph, node, "PAUSE_REQUESTED")
        if node.subgraph is not None or not node.call.pauses:
            return False
        self._state(graph, node, "PAUSED")
        if node.due_ms is not None:
            node.rest_ms = node.due_ms - self.now
            node.token += 1
        return True

    # Sub-graphs; `Engine` knows how graphs start and stop

    def _start_sub(self, graph: Running, node: Node, sub: Graph) -> None:
        raise NotImplementedError

    def _stop_sub(self, node: Node) -> None:
        raise NotImplementedError

    def _sub_ended(self, graph: Running, result: Outcome) -> None:
        raise NotImplementedError

    def _sub_halted(self, graph: Running) -> None:
        if graph.above is not None and graph.home is not None:
            message = "The sub-graph is HALTED, which nobody hears: this action runs for ever."
            self._hazard(graph.home, "H8", "goes on", message, graph.above)
