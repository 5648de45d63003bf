"""Simulates the core of the engine: what the end of one action causes, and the life of one action.

See docs/umrf-and-the-engine.md 2.3, 2.4 and 2.9.
"""

from collections.abc import Callable, Mapping
from functools import partial
from math import inf

from msgspec.structs import replace

from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.model import PRECONDITIONS, Graph
from action_assistant.umrf.semantics.clock import Clock, Task
from action_assistant.umrf.semantics.parts import (
    HELD,
    RESERVED,
    Edge,
    Execution,
    Node,
    NodeLink,
    Outcome,
    Running,
    linked_nodes,
)
from action_assistant.umrf.semantics.performing import (
    PERFORMED,
    PerformedCalls,
    Performer,
    Returned,
)
from action_assistant.umrf.semantics.script import Script
from action_assistant.umrf.semantics.trace import (
    Dispatch,
    EdgeEval,
    GraphResultEvent,
    NodeResultEvent,
    NodeStateEvent,
    NotReady,
)
from action_assistant.umrf.semantics.transitions import EFFECTS
from action_assistant.umrf.semantics.values import MISSING, RemapUnknown, fill_outputs, hand_over

#: An action that starts this many times at one instant runs in a loop that takes no time.
INSTANT_LAPS = 3
#: More bypasses than this at one instant, plus ten for each action, mean that they go round in a circle.
BYPASSES = 1_000

_OUTCOMES: dict[str, Outcome] = {outcome: outcome for outcome in PRECONDITIONS}


class Core(Clock):
    """Simulates how results pass along the arrows and how actions begin and end. `Graphs` adds the
    life of graphs and sub-graphs, and `Engine` the commands."""

    def __init__(
        self,
        facts: EngineFacts,
        script: Script,
        library: Mapping[str, Graph],
        actor: str,
        performer: Performer | None = None,
    ) -> None:
        super().__init__(facts)
        self._performed = PerformedCalls(performer)
        self.script = script
        self.library = library
        self.actor = actor
        #: True if each command waits until the one before it is done.
        self.serial = True
        #: The least time from the trigger of an action to its first RUNNING (dlopen, onInit); a behaviour may
        #: say more. An action that loads does not count as active, and a stop does not reach it (recording
        #: engine_frozen.2).
        self.loading_ms = 0.0
        self._executions: list[Execution] = []

    def executing(self, at_ms: float) -> list[Execution]:
        """Return the calls of actions' own code that have not returned by this time, in ms.

        This is what really moves, apart from the states that the engine shows. Empty once the
        process has ended.
        """
        return [] if self.crashed else [e for e in self._executions if e.ends_ms > at_ms]

    # Results

    def _inform(self, graph: Running, node: Node, result: Outcome) -> None:
        """Ask every child for its response, now that `node` has ended with `result` (the engine's
        `startChildNodes`). The graph is HALTED if every child ignores the result and no other
        action runs."""
        if graph.state != "RUNNING":
            return
        if graph.deadly:
            self._crash(graph, "H6", "What follows is not in the broken graph: the engine aborts.")
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
            self._left_loading(graph, "HALTED")
            self._sub_halted(graph)

    def _ask(
        self, graph: Running, node: Node, edge: Edge, child: Node, link: NodeLink, result: Outcome
    ) -> str:
        """Ask one child of `node`, over the edge between them, for its response to a result, and
        carry the response out. `link`: what the child stores of this parent. Return `done` if no
        further child is to be asked, `ignored` if the child ignores the result, else an empty text.
        """
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
        actor = graph.actor_of(child)
        self._out.append(Dispatch(self._t(), graph.name, child.full_name, response, actor))
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
            message = (
                "A bypass to an action reads freed memory: the engine may abort here, or hang."
            )
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
        self._out.append(GraphResultEvent(self._t(), graph.name, result))
        others = graph.active - (last.active and last.returning) > 0 or graph.loading > 0
        if others or (last.returning and self._begins_again(last)):
            message = "The graph is FINISHED while actions still run; a stop does not reach them."
            self._hazard(graph, "H12", "goes on", message)
        if self.locked and not self.serial and graph.above is not None:
            graph.blocked = (
                last  # commands that wait for the pause hold the lock that its report needs
            )
            return
        self._soon(partial(self._sub_ended, graph, result))

    def _left_loading(self, graph: Running, state: str) -> None:
        """Report (hazard H14) each action that still loads and will run although the graph has
        ended in `state`."""
        for node in graph.nodes.values():
            if node.loading:
                message = (
                    f"{node.full_name} still loads, and runs then although the graph is {state}."
                )
                self._hazard(graph, "H14", "goes on", message, node)

    # The life of an action

    @staticmethod
    def _begins_again(node: Node) -> bool:
        """Return whether an action that has returned starts again by itself: a spontaneous one
        does, even after an error."""
        return node.type == "spontaneous" and node.state in ("RUNNING", "ERROR")

    def _run(self, graph: Running, node: Node) -> None:
        effect = EFFECTS["run"][node.activity(self.now)]
        if effect == "nothing" or node.name in RESERVED:
            return
        if node.subgraph is None and not node.loaded and node.state != "UNINITIALIZED":
            if not node.failed_to_load:
                self._soon(partial(self._run_unloaded, graph, node))
                return
        elif effect == "aborts":
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
        if node.call is PERFORMED:
            node.subgraph = None  # of an earlier call that the script has played
        if node.subgraph is not None:
            node.calls += 1
            self._state(graph, node, "RUNNING")
            self._soon(partial(self._start_sub, graph, node, node.subgraph))
        elif not node.loaded and (takes := max(self.loading_ms, node.call.load_s * 1000)):
            node.loading = True
            graph.loading += 1
            self._at(self.now + takes, partial(self._loaded, graph, node))
        elif self._load(graph, node):
            self._begin(graph, node)

    def _loaded(self, graph: Running, node: Node) -> None:
        """Begin an action (`node`) that has finished loading, also if `graph` has ended meanwhile;
        do nothing if the engine no longer holds this graph, or holds another one by the same name."""
        node.loading = False
        graph.loading -= 1
        if self.graphs.get(graph.name) is graph and not node.loaded and self._load(graph, node):
            self._begin(graph, node)

    def _run_unloaded(self, graph: Running, node: Node) -> None:
        if node.state in (
            "INITIALIZED",
            "FINISHED",
            "ERROR",
        ):  # from other states it does not begin
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
        node.execution = Execution(graph.name, node.full_name, self.now)
        self._executions = [*self.executing(self.now), node.execution]
        if node.call is PERFORMED:
            self._performed.begin(graph, node)
        duration = self._takes_ms(node)
        if node.type == "spontaneous":
            duration = max(duration, 1.0)
        self._let_run(graph, node, inf if node.call.never else duration)

    def _takes_ms(self, node: Node) -> float:
        """Return how long the current call of an action takes, in ms."""
        return node.call.after_s * 1000

    def _stops_ms(self, node: Node) -> float:
        """Return how long the action's code continues after a stop, in ms."""
        return node.call.stop_s * 1000

    def _let_run(self, graph: Running, node: Node, duration_ms: float) -> None:
        node.due_ms = self.now + duration_ms
        if node.execution is not None:
            node.execution.ends_ms = node.due_ms
        if node.due_ms < inf:
            self._at(node.due_ms, partial(self._returns, graph, node, node.token))

    def _returns(self, graph: Running, node: Node, token: int) -> None:
        if node.token == token:
            self._ended(graph, node, _OUTCOMES[node.call.result])

    def _performed_returns(self, returned: Returned) -> None:
        """End a call that a performer (not the script) carried out: none of its code runs any more.
        `returned`: its result and outputs."""
        found = self._performed.take(returned.number)
        if found is None:
            return
        graph, node, execution = found
        execution.ends_ms = self.now
        if node.execution is not execution or self.graphs.get(graph.name) is not graph:
            return
        if node.rest_ms is not None and node.state not in HELD and not self.facts.pauses_safely:
            return  # it was paused when it was stopped: the engine waits for its thread without end
        if node.busy_until == inf:
            node.busy_until = self.now
        if node.active:
            node.call = replace(
                PERFORMED,
                result=returned.result,
                outputs=returned.outputs | dict.fromkeys(returned.unset, MISSING),
                message=returned.message,
            )
            self._ended(graph, node, _OUTCOMES[returned.result])

    def _play(self, number: int) -> None:
        """Let the script play a call that was given to a performer, which does not carry it out. Do
        nothing if there is no such call. An action that got a stop meanwhile ends without having
        begun."""
        found = self._performed.play(number)
        if found is None:
            return
        graph, node, execution = found
        execution.began_ms = execution.ends_ms = self.now
        if node.execution is not execution or self.graphs.get(graph.name) is not graph:
            return
        if node.busy_until == inf:
            node.busy_until = self.now
        if node.state != "RUNNING":
            if node.active:
                self._ended(graph, node, "on_stopped")
            return
        calls = self.script.calls_of(graph.name, graph.own, node.full_name, node.name)
        node.call = calls[min(node.calls, len(calls)) - 1]
        node.subgraph = self._fitting(graph, node)
        actor = graph.actor_of(node)
        self._out.append(NodeStateEvent(self._t(), graph.name, node.full_name, "RUNNING", actor))
        if node.subgraph is not None:
            self._soon(partial(self._start_sub, graph, node, node.subgraph))
        elif node.call.init_error or node.call.no_library:
            self._ended(graph, node, "on_error")
        else:
            loads_ms = node.call.load_s * 1000 if node.calls == 1 else 0.0
            self._let_run(graph, node, inf if node.call.never else loads_ms + self._takes_ms(node))

    def _ended(self, graph: Running, node: Node, result: Outcome) -> None:
        """Handle the return of an action's `onRun` with `result`, or the exception that it threw
        (`on_error`): show its state, fill its outputs and inform its children."""
        if node.state in HELD:
            node.pending = result
            return
        if node.state == "STOPPING":
            result = "on_stopped"
        node.token += 1
        node.returning = True
        node.due_ms = None
        if node.subgraph is None and result != "on_error":  # also after a stop
            fill_outputs(node.outputs, node.call.outputs)
        self._result(graph, node, result)
        self._performed.ended(node, result)
        failed = result == "on_error" and node.subgraph is None
        if failed:
            self._state(graph, node, "ERROR")
        if node.type == "spontaneous":
            self._stop_downstream(graph, node, partial(self._after, graph, node, result, failed))
        else:
            self._after(graph, node, result, failed)

    def _after(self, graph: Running, node: Node, result: Outcome, failed: bool) -> None:
        self._inform(graph, node, result)
        if self.crashed or graph.blocked is node:
            return
        again = self._begins_again(node)
        if not failed or again:
            self._state(graph, node, "FINISHED")
        node.returning = False
        for slot in node.inputs.values():
            slot.end_of_run()
        for slot in node.outputs.values():
            slot.clear()
        if again:
            self._run(graph, node)

    def _result(self, graph: Running, node: Node, result: str) -> None:
        scripted = node.execution is None or not node.execution.number
        said = node.call.message if result != "on_stopped" or not scripted else None
        actor = graph.actor_of(node)
        self._out.append(
            NodeResultEvent(self._t(), graph.name, node.full_name, result, said, actor)
        )

    # Stop and pause of one action

    def _stop_node(self, graph: Running, node: Node) -> None:
        effect = EFFECTS["stop"][node.activity(self.now)]
        if effect == "aborts":
            message = (
                f"“stop” reaches {node.full_name}, which is stopping already: the engine aborts."
            )
            self._crash(graph, "H4", message, node)
            return
        if effect == "nothing":
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
        self._at(timeout, partial(self._stop_failed, graph, node, node.token))
        if held and not self.facts.pauses_safely:
            message = "A paused action cannot be stopped: ERROR after 5 s, and its thread stays."
            self._hazard(graph, "H5", "goes on", message, node)
            self._stop_code(node, held)
            node.busy_until = inf  # also when its code has returned: it waits to be resumed
        elif node.subgraph is not None:
            self._soon(partial(self._stop_sub, node))
        else:
            node.busy_until = ends = self._stop_code(node, held)
            if ends < inf:
                self._at(ends, partial(self._stopped, graph, node, node.token))
        if node.call.stop_error and node.subgraph is None:
            self._soon(partial(self._stop_failed, graph, node, node.token))

    def _stop_code(self, node: Node, held: bool) -> float:
        """Call `onStop` of an action. Return the time (ms) at which the code of its `onRun`
        returns; inf if it never does. `held`: the action is paused, so that the remainder of its
        call counts from now."""
        self._performed.stop(node)
        ends = self.now + node.rest_ms if held and node.rest_ms is not None else node.due_ms
        if ends is None:
            ends = inf
        if not node.call.ignores_stop:
            ends = min(ends, self.now + self._stops_ms(node))
        if node.execution is not None and node.execution.ends_ms > self.now:
            node.execution.ends_ms = ends
        return ends

    def _stopped(self, graph: Running, node: Node, token: int) -> None:
        if node.token == token:
            self._ended(graph, node, "on_stopped")

    def _stop_failed(self, graph: Running, node: Node, token: int) -> None:
        """Show ERROR after `onStop` threw or the stop timeout passed, while the code of the action
        continues. When that code returns, the children are informed as of any other result.
        `token`: the token of the stop; do nothing if the action has changed since."""
        if node.token != token or node.state != "STOPPING":
            return
        node.token += 1
        graph.stop_failed = True
        if said := self._performed.give_up(node):
            node.call = replace(node.call, message=said)
        self._state(graph, node, "ERROR")
        self._result(graph, node, "on_error")
        self._inform(graph, node, "on_error")
        if self.now < node.busy_until < inf:
            self._at(node.busy_until, partial(self._returned_late, graph, node, node.token))

    def _returned_late(self, graph: Running, node: Node, token: int) -> None:
        if node.token == token and self.graphs.get(graph.name) is graph:
            self._after(graph, node, _OUTCOMES[node.call.result], failed=True)

    def _stop_downstream(self, graph: Running, node: Node, then: Task) -> None:
        """Stop every active action downstream of the spontaneous action `node`, as the engine does
        before it informs the children; call `then` once they have stopped."""
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
        self._wait(lambda: any(n.active for n in linked), self.facts.stop_poll_ms, then)

    def _wait(self, is_active: Callable[[], bool], poll_ms: int, then: Task) -> None:
        """Call `then` once `is_active` returns False; it is polled every `poll_ms`."""

        def poll() -> None:
            if is_active():
                self._at(self.now + poll_ms, poll)
            else:
                then()

        self._at(self.now + poll_ms, poll)

    def _pause_by_response(self, graph: Running, node: Node) -> None:
        if not self._pause_node(graph, node):
            message = f"{node.full_name} handles no pause: it never leaves PAUSE_REQUESTED."
            self._hazard(graph, "H5", "goes on", message, node)

    def _pause_node(self, graph: Running, node: Node) -> bool:
        """Pause an action. Return True if it is paused now or was not running, False if it cannot
        be paused."""
        if EFFECTS["pause"][node.activity(self.now)] == "nothing":
            return True
        self._state(graph, node, "PAUSE_REQUESTED")
        if node.subgraph is not None or not node.call.pauses:
            return False
        self._state(graph, node, "PAUSED")
        self._performed.pause(node)
        if node.due_ms is not None:
            node.rest_ms = node.due_ms - self.now
            node.token += 1
            if node.execution is not None:
                node.execution.ends_ms = inf
        return True

    # Sub-graphs; `Engine` knows how graphs start and stop

    def _fitting(self, graph: Running, node: Node) -> Graph | None:
        raise NotImplementedError

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
