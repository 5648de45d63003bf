"""A TeMoto Action Engine without I/O or clock: its commands and what it knows.

See docs/umrf-and-the-engine.md 2.
"""

from collections.abc import Callable, Mapping
from functools import partial
from math import inf
from typing import Final, TypeAlias

import msgspec

from action_assistant.umrf.facts import SIMULATED, EngineFacts
from action_assistant.umrf.model import Graph, Key, Signature
from action_assistant.umrf.semantics.graphs import GraphRefused, Graphs
from action_assistant.umrf.semantics.parts import Running
from action_assistant.umrf.semantics.performing import Performer, Returned
from action_assistant.umrf.semantics.script import Script
from action_assistant.umrf.semantics.trace import GraphStateEvent, Trace

_Command: TypeAlias = Callable[[Running], None]

_BUSY: Final = frozenset({"RUNNING", "PAUSED", "STOPPING", "CLEARING"})


class GraphNow(msgspec.Struct, frozen=True):
    """What an engine knows of one graph: states by full name; the result once it ended."""

    state: str
    result: str | None
    nodes: dict[str, str]


class Engine(Graphs):
    """One engine with its graphs and sub-graphs. Deterministic: same calls, same trace.

    `library`: graphs that can be sub-graphs, by name. `actor`: the engine's name; without one it
    plays the only actor that a graph names. `signatures`: the actions that it has; without them it
    has every action with any parameters. `performer`: carries out the actions that it says are its
    own; the script says what the others do. `serial`: commands wait for each other as they do over
    ROS; otherwise a second stop during a stop reaches the engine and kills it. `loading_ms`: see
    `Core`.
    """

    def __init__(
        self,
        *,
        facts: EngineFacts = SIMULATED,
        script: Script | None = None,
        library: Mapping[str, Graph] | None = None,
        actor: str = "",
        signatures: Mapping[str, Signature] | None = None,
        serial: bool = True,
        loading_ms: float = 0.0,
        performer: Performer | None = None,
    ) -> None:
        super().__init__(facts, script or Script(), library or {}, actor, signatures, performer)
        self.loading_ms = loading_ms
        self.serial = serial

    # What callers ask

    @property
    def due(self) -> float | None:
        """When something happens next by itself, in ms; None if nothing will."""
        if self._out or self._tasks:
            return self.now
        return self._heap[0][0] if self._heap else None

    @property
    def busy(self) -> bool:
        """Whether a command is still being carried out, so that the next one waits."""
        return self._busy

    def advance(self, to_ms: float) -> list[Trace]:
        """Everything due up to and including `to_ms`, in order."""
        self._run_until(to_ms)
        return self._taken()

    def states(self) -> dict[str, GraphNow]:
        """All graphs by the name they run under, ended ones too."""
        return {
            name: GraphNow(g.state, g.result, {n.full_name: n.state for n in g.nodes.values()})
            for name, g in self.graphs.items()
        }

    def start(
        self,
        graph: Graph,
        at_ms: float,
        states: Mapping[Key, str] | None = None,
        *,
        by_name: bool = False,
    ) -> list[Trace]:
        """Starts a graph. `states`: run states that its file carries. `by_name`: the engine takes
        it from its own index, and matches it each time. Raises `GraphRefused`."""
        self._run_until(at_ms)
        old = self.graphs.get(graph.name)
        if self.crashed or self.locked:
            return self._taken()
        if old is not None and old.state in _BUSY:
            active = old.state
            self._out.append(GraphStateEvent(self._t(), graph.name, "UNINITIALIZED"))
            self._command(partial(self._stop_graph, old))
            raise GraphRefused(
                f"Cannot execute UMRF graph '{graph.name}' because it's already active ({active})"
            )
        running = self._built(graph.name, graph, None, None)
        if running.has_ghost_ends:
            raise GraphRefused(f"An end of graph '{graph.name}' names an action that is not there")
        for node in running.nodes.values():
            state = (states or {}).get(node.key, "UNINITIALIZED")
            running.count(state, 1)
            node.state = state
        if old is None:
            if not self._resolves(running):
                raise GraphRefused(f"Could not resolve graph '{graph.name}'")
            self._refuse_broken(running, matched=True)
            self._begin_graph(running)
        elif any(node.busy_until == inf for node in old.nodes.values()):
            self._graph_state(old, "CLEARING")
            message = (
                "A thread of the graph's last run never ended: the engine waits for it for ever."
            )
            self._lock(old, "H5", message)
        else:
            self._again(old, running, matched=by_name or self.facts.restart_matches)
        return self._taken()

    def asked(self) -> list[Trace]:
        """Somebody asks for all graphs (`umrf_graph_get`): one that was built in part kills the
        engine."""
        deadly = next((graph for graph in self.graphs.values() if graph.deadly), None)
        if deadly is not None and not self.crashed:
            self._crash(deadly, "H6", "A broken graph is asked for: the engine aborts.")
        return self._taken()

    def stop(self, graph_name: str, at_ms: float) -> list[Trace]:
        """Stops a graph; nothing happens to one that does not run."""
        return self._on(graph_name, at_ms, self._stop_graph)

    def pause(self, graph_name: str, at_ms: float) -> list[Trace]:
        """Pauses a RUNNING graph."""
        return self._on(graph_name, at_ms, self._pause_graph)

    def resume(self, graph_name: str, at_ms: float, continue_from: str = "") -> list[Trace]:
        """Resumes a PAUSED or HALTED graph; `continue_from` is the full name of a node to run."""
        return self._on(graph_name, at_ms, partial(self._resume_graph, continue_from=continue_from))

    def modify(self, graph: Graph, at_ms: float, continue_from: str = "") -> list[Trace]:
        """Gives a running, paused or halted graph of this name a new structure and lets it go on.
        Raises `GraphRefused`; a graph that was paused for it then stays PAUSED."""
        self._run_until(at_ms)
        old = self.graphs.get(graph.name)
        if old is not None and not self.crashed and not self.locked:
            self._command(partial(self._modify_graph, old, graph, continue_from))
        return self._taken()

    def returned(self, returned: Returned, at_ms: float) -> list[Trace]:
        """A call that the performer was given has ended, all of it."""
        self._run_until(at_ms)
        if not self.crashed:
            self._performed_returns(returned)
        return self._taken()

    # How commands come in

    def _taken(self) -> list[Trace]:
        self._settle()
        taken, self._out = self._out, []
        return taken

    def _on(self, graph_name: str, at_ms: float, command: _Command) -> list[Trace]:
        self._run_until(at_ms)
        graph = self.graphs.get(graph_name)
        if graph is not None and not self.crashed and not self.locked:
            self._command(partial(command, graph))
        return self._taken()
