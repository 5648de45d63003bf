"""Simulates the life of graphs in an engine: build, start, stop, pause, resume and modify.

See docs/umrf-and-the-engine.md 2.
"""

from collections import deque
from collections.abc import Mapping
from functools import partial

from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.model import Graph, Signature
from action_assistant.umrf.semantics.clock import Task
from action_assistant.umrf.semantics.core import Core
from action_assistant.umrf.semantics.matching import IndexedGraphs, has_action, unresolved
from action_assistant.umrf.semantics.parts import (
    ENTRY_NODE,
    EXIT_NODE,
    RESERVED,
    Node,
    Outcome,
    Running,
    build,
    restructure,
)
from action_assistant.umrf.semantics.performing import PERFORMED, Performer
from action_assistant.umrf.semantics.script import Script
from action_assistant.umrf.semantics.trace import HazardEvent, NodeStateEvent


class GraphRefused(Exception):
    """Raised if the engine throws an exception instead of starting or modifying a graph.

    The next call of the engine returns the trace up to that moment.
    """

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.message = message


class Graphs(Core):
    """Runs commands on graphs and sub-graphs one after the other. `Engine` decides when each
    command comes."""

    def __init__(
        self,
        facts: EngineFacts,
        script: Script,
        library: Mapping[str, Graph],
        actor: str,
        signatures: Mapping[str, Signature] | None,
        performer: Performer | None = None,
    ) -> None:
        super().__init__(facts, script, library, actor, performer)
        self.signatures = signatures
        self._busy = False
        self._waiting: deque[Task] = deque()

    # The command queue

    def _command(self, command: Task) -> None:
        if self._busy:
            self._waiting.append(command)
        else:
            command()

    def _free(self) -> None:
        """Run the commands that have waited for another command, which has now ended."""
        self._busy = False
        while self._waiting and not self._busy and not self.crashed and not self.locked:
            try:
                self._waiting.popleft()()
            except GraphRefused as e:
                self._out.append(HazardEvent(self._t(), "", "refused", "goes on", None, e.message))
            self._settle()

    # Start

    def _built(self, name: str, graph: Graph, above: Node | None, home: Running | None) -> Running:
        running = Running(name, graph, above, home)
        behaviours = {
            a.key: (PERFORMED,)
            if self._performed.performs(a, inside=above is not None)
            else self.script.calls_of(name, graph.name, a.full_name, a.name)
            for a in graph.actions
        }
        build(running, behaviours)
        taken = running.own_names()
        indexed = IndexedGraphs(self.library)
        for node in running.nodes.values():
            known = (self.signatures or {}).get(node.name)
            if known is not None:
                for slot in node.inputs.values():
                    slot.required = slot.name not in known.optional
                continue
            if node.call is PERFORMED and self._performed.takes_graphs:
                continue
            if node.name not in taken:
                node.subgraph = indexed.fitting(node.name, node.inputs.keys(), node.outputs.keys())
        return running

    def _fitting(self, graph: Running, node: Node) -> Graph | None:
        """Return the sub-graph that an action of a graph stands for; None for an action with code."""
        if node.name in graph.own_names():
            return None
        names = node.inputs.keys(), node.outputs.keys()
        return IndexedGraphs(self.library).fitting(node.name, *names)

    def _resolves(self, graph: Running) -> bool:
        """Return whether the engine can resolve every action that it has to run itself, as an
        action or as a sub-graph."""
        known = self.signatures or {}
        if next(unresolved(graph.graph, self.library, known, self.actor), None) is not None:
            return False
        if self.signatures is None:
            return True
        own = {"", self.actor}
        return all(
            node.subgraph is not None
            or node.actor not in own
            or node.name in RESERVED
            or has_action(node, self.signatures.get(node.name))
            for node in graph.nodes.values()
        )

    def _not_built(self, graph: Running, *, matched: bool) -> tuple[Node, bool] | None:
        """Return the first action that the engine cannot build, and whether it is the first of all;
        None if it can build all. `matched`: the engine has looked the actions up in its index. It
        goes through a matched graph by full name and through others in file order. It takes an
        action that it has not matched for one with a library of its own."""
        nodes = list(graph.nodes.values())
        if matched:
            nodes.sort(key=lambda node: node.full_name.encode())
        for place, node in enumerate(nodes):
            unknown = self.signatures is not None and node.name not in self.signatures
            own = node.actor in {"", self.actor or node.actor}
            lost = node.subgraph is not None or unknown if not matched else False
            if lost or (own and node.subgraph is None and node.behaviours[0].no_library):
                return node, place == 0
        return None

    def _refuse_broken(self, graph: Running, *, matched: bool) -> None:
        """Raise `GraphRefused` if an action of the graph cannot be built. The graph then stays in
        the engine, without that action and the following ones. If other actions stand before it, a
        get kills the engine. `matched`: the engine has looked the actions up in its index."""
        found = self._not_built(graph, matched=matched)
        if found is None:
            return
        node, is_first = found
        self.graphs[graph.name] = graph
        failed = NodeStateEvent(self._t(), "", node.full_name, "ERROR")
        self._out.append(failed)
        self._graph_state(graph, "UNINITIALIZED")
        if is_first:
            self._out.append(failed)
        graph.broken, graph.deadly = True, not is_first
        why = "its library is not there" if matched else "a graph that is held is not matched again"
        message = f"{node.full_name} cannot be built ({why}): a broken graph stays in the engine."
        self._hazard(graph, "H6", "goes on", message, node)
        raise GraphRefused("map::at")

    def _clear(self, old: Running) -> None:
        if old.broken:
            return
        if old.state == "HALTED":  # it is stopped first, like a running graph
            self._graph_state(old, "STOPPING")
            self._graph_state(old, "STOPPED")
        self._graph_state(old, "CLEARING")
        self._graph_state(old, "UNINITIALIZED")

    def _again(self, old: Running, new: Running, *, matched: bool) -> None:
        """Start the graph `new` although the engine holds one of that name (`old`), which has
        ended. `matched`: the engine has looked the actions up in its index."""
        if any(node.holds_thread(self.now) for node in old.nodes.values()):
            self._command(partial(self._replace, old, new, matched))
            return
        self._clear(old)
        self._refuse_broken(new, matched=matched)
        self._begin_graph(new)

    def _replace(self, old: Running, new: Running, matched: bool) -> None:
        """Start a graph again although actions of the finished one (`old`) still run: they are
        stopped first. `matched`: the engine has looked the actions up in its index."""
        self._graph_state(old, "CLEARING")
        left_over = [node for node in old.nodes.values() if node.holds_thread(self.now)]
        self._busy = True
        for node in left_over:
            if node.active and node.state != "STOPPING":
                self._stop_node(old, node)

        def then() -> None:
            self._graph_state(old, "UNINITIALIZED")
            try:
                self._refuse_broken(new, matched=matched)
                self._begin_graph(new)
            except GraphRefused:
                return
            finally:
                self._free()

        def is_active() -> bool:
            return any(node.holds_thread(self.now) for node in left_over)

        self._wait(is_active, self.facts.stop_poll_ms, then)

    def _begin_graph(self, graph: Running) -> None:
        self.graphs[graph.name] = graph
        self._graph_state(graph, "UNINITIALIZED")
        doubled = len(graph.nodes) < sum(not action.missing for action in graph.graph.actions)
        if doubled or not {ENTRY_NODE, EXIT_NODE}.isdisjoint(graph.nodes):
            message = (
                "Two actions have one full name, or one that of an end: the engine throws and keeps "
                "a broken graph."
            )
            self._hazard(graph, "H6", "goes on", message)
            graph.broken = graph.deadly = True
            raise GraphRefused("map::at")
        named = {node.actor for node in graph.nodes.values() if node.actor}
        remote = named - {self.actor} if self.actor or len(named) > 1 else set()
        if remote and not self.facts.synchronises:
            raise GraphRefused(
                f"Cannot execute UMRF graph '{graph.name}': actor synchronizer not initialized."
            )
        if self._lacks_inputs(graph):
            return
        self._graph_state(graph, "RUNNING")
        self._inform(graph, graph.entry, "on_true")

    def _lacks_inputs(self, graph: Running) -> bool:
        """Return whether an entry action lacks a required value, in which case the engine silently
        does not start the graph."""
        from_outside = {name: slot.value for name, slot in graph.entry.outputs.items()}
        for edge in graph.entry.children:
            if edge.child is None:
                continue
            renamed = {r.source: r.target for r in edge.remap}
            given = {renamed.get(name, name) for name in from_outside}
            for slot in edge.child.inputs.values():
                if slot.required and not slot.has_value() and slot.name not in given:
                    message = (
                        f"The input “{slot.name}” has no value: the graph silently never starts."
                    )
                    self._hazard(graph, "H7", "goes on", message, edge.child)
                    return True
        return False

    # Stop, pause, resume

    def _stop_graph(self, graph: Running) -> None:
        if graph.state == "STOPPING" and not self.serial:
            message = "A second stop reaches a graph that is stopping: the engine aborts."
            self._crash(graph, "H4", message)
            return
        if graph.state not in ("RUNNING", "PAUSED", "HALTED"):
            return
        self._graph_state(graph, "STOPPING")
        nodes = [n for n in graph.nodes.values() if n.active and n.state != "STOPPING"]
        graph.stop_failed = False
        for node in nodes:
            self._stop_node(graph, node)
            if self.crashed:
                return
        if not nodes:
            self._graph_stopped(graph)
            return
        hold = self.serial and graph.home is None
        self._busy = self._busy or hold

        def then() -> None:
            self._graph_stopped(graph)
            if hold:
                self._free()

        self._wait(lambda: any(n.active for n in nodes), self.facts.stop_poll_ms, then)

    def _graph_stopped(self, graph: Running) -> None:
        graph.result = "on_error" if graph.stop_failed else "on_stopped"
        state = "ERROR" if graph.stop_failed else "STOPPED"
        self._graph_state(graph, state)
        self._left_loading(graph, state)
        result: Outcome = "on_error" if graph.stop_failed else "on_stopped"
        self._soon(partial(self._sub_ended, graph, result))

    def _pause_graph(self, graph: Running, then: Task | None = None) -> None:
        if graph.state != "RUNNING":
            return
        nodes = [node for node in graph.nodes.values() if node.state == "RUNNING"]
        unpaused = [node for node in nodes if not self._pause_node(graph, node)]
        if unpaused:
            message = "The pause never completes: the engine answers no command any more."
            self._lock(graph, "H5", message, unpaused[0])
            return
        if not nodes:
            self._graph_state(graph, "PAUSED")
            if then is not None:
                then()
            return
        self._busy = graph.pausing = True

        def paused_now() -> None:
            graph.pausing = False
            if graph.state == "RUNNING":
                self._graph_state(graph, "PAUSED")
            if then is not None:
                then()
            self._free()

        self._at(self.now + self.facts.pause_poll_ms, paused_now)

    def _resume_graph(self, graph: Running, continue_from: str = "") -> None:
        if graph.state not in ("PAUSED", "HALTED"):
            return
        graph.stuck = False
        graph.result = None
        self._graph_state(graph, "RUNNING")
        for node in list(graph.nodes.values()):
            if node.state != "PAUSED":
                continue
            self._state(graph, node, "RUNNING")
            if node.pending is not None:
                result, node.pending = node.pending, None
                self._soon(partial(self._ended, graph, node, result))
            elif node.rest_ms is not None:
                self._let_run(graph, node, node.rest_ms)
                node.rest_ms = None
                self._performed.resume(node)
        if node_to_run := graph.nodes.get(continue_from):
            self._run(graph, node_to_run)

    def _modify_graph(self, old: Running, new: Graph, continue_from: str) -> None:
        if old.state not in ("RUNNING", "PAUSED", "HALTED"):
            raise GraphRefused(
                f"Cannot modify graph '{old.name}' because it is not in PAUSED state. "
                f"Current state: '{old.state}'"
            )
        changed = self._built(old.name, new, None, None)
        built = self._built_names(changed)
        kept = built if built is not None else changed.nodes.keys()
        lost = next((n for n in old.nodes.values() if n.active and n.full_name not in kept), None)

        def then() -> None:
            if lost is None:
                if built is None:
                    restructure(old, changed)
                old.broken = old.deadly = built is not None
                self._resume_graph(old, continue_from)

        if old.state == "RUNNING":
            self._pause_graph(old, then)
        else:
            then()
        if lost is not None:
            raise GraphRefused(
                f"Cannot modify graph '{old.name}': Action '{lost.full_name}' cannot be deleted, "
                f"because it is in an active state ({lost.state})"
            )

    def _built_names(self, changed: Running) -> set[str] | None:
        """Return the full names of the actions of a modified graph up to the first that the engine
        cannot build; None if it can build all."""
        if self.facts.restart_matches:
            return None
        found = self._not_built(changed, matched=False)
        names = list(changed.nodes)
        return None if found is None else set(names[: names.index(found[0].full_name)])

    # Sub-graphs

    def _start_sub(self, graph: Running, node: Node, sub: Graph) -> None:
        name = f"{graph.name}__{node.name}__{node.instance_id}"
        if old := self.graphs.get(name):
            self._clear(old)
        running = self._built(name, sub, node, graph)
        node.sub = running
        running.entry.outputs = dict(node.inputs)
        if running.has_ghost_ends:
            self._ended(graph, node, "on_error")
            return
        try:
            self._begin_graph(running)
        except GraphRefused:
            self._ended(graph, node, "on_error")

    def _stop_sub(self, node: Node) -> None:
        if node.sub is not None:
            self._stop_graph(node.sub)

    def _sub_ended(self, graph: Running, result: Outcome) -> None:
        above, home = graph.above, graph.home
        if above is None or home is None or above.sub is not graph:
            return
        for name, slot in graph.exit.inputs.items():
            if target := above.outputs.get(name):
                target.receive(slot.type, slot.value)
        above.sub = None
        if above.state in ("RUNNING", "STOPPING", "PAUSED", "PAUSE_REQUESTED"):
            self._ended(home, above, result)
