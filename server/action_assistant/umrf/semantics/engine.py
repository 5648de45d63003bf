"""A TeMoto Action Engine without I/O or clock: its commands, and the states that it knows.

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
    """The state of one graph in an engine. `nodes`: states by full name. `result`: None until the
    graph ended."""

    state: str
    result: str | None
    nodes: dict[str, str]


class Engine(Graphs):
    """Simulates one engine with its graphs and sub-graphs. Deterministic: the same calls give the
    same trace.

    `library`: graphs that can be sub-graphs, by name. `actor`: the engine's name; without one it
    plays the only actor that a graph names, or every actor if its `facts` say that it synchronises. `signatures`: the actions that it has; without them it
    has every action with any parameters. `performer`: carries out the actions that it names as its
    own; the script says how the others behave. `serial`: commands wait for each other as they do
    over ROS; otherwise a second stop during a stop reaches the engine and kills it. `loading_ms`:
    see `Core`. All times are ms on the caller's clock.
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

    # Commands and questions

    @property
    def due(self) -> float | None:
        """The time in ms at which the engine's next event happens without a command; None if there
        will be none."""
        if self._out or self._tasks:
            return self.now
        return self._heap[0][0] if self._heap else None

    @property
    def busy(self) -> bool:
        """True while a command is being carried out, so that the next one waits."""
        return self._busy

    def advance(self, to_ms: float) -> list[Trace]:
        """Carry out all events up to and including the time `to_ms`, and return the trace in order."""
        self._run_until(to_ms)
        return self._taken()

    def states(self) -> dict[str, GraphNow]:
        """Return the state of every graph, ended ones too, by the name under which it runs."""
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
        """Start a graph, and return the trace. Raises `GraphRefused` if the engine refuses the
        graph.

        `states`: run states that the file carries, by key of the action. `by_name`: the engine
        takes the graph from its own index, and therefore matches it at each start.
        """
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
        """Handle a get of all graphs (`umrf_graph_get`), and return the trace. The get kills the
        engine if a graph was built only in part."""
        deadly = next((graph for graph in self.graphs.values() if graph.deadly), None)
        if deadly is not None and not self.crashed:
            self._crash(deadly, "H6", "A broken graph is asked for: the engine aborts.")
        return self._taken()

    def stop(self, graph_name: str, at_ms: float) -> list[Trace]:
        """Stop, at `at_ms`, the graph that runs as `graph_name`, and return the trace up to then.
        Do nothing if no such graph runs."""
        return self._on(graph_name, at_ms, self._stop_graph)

    def pause(self, graph_name: str, at_ms: float) -> list[Trace]:
        """Pause, at `at_ms`, the graph that runs as `graph_name` if it is RUNNING, and return the
        trace up to then."""
        return self._on(graph_name, at_ms, self._pause_graph)

    def resume(self, graph_name: str, at_ms: float, continue_from: str = "") -> list[Trace]:
        """Resume, at `at_ms`, the graph that runs as `graph_name` if it is PAUSED or HALTED, and
        return the trace up to then. `continue_from`: the full name of an action to run, "" for
        none."""
        return self._on(graph_name, at_ms, partial(self._resume_graph, continue_from=continue_from))

    def modify(self, graph: Graph, at_ms: float, continue_from: str = "") -> list[Trace]:
        """Give, at `at_ms`, a running, paused or halted graph of this name a new structure and let
        it continue; return the trace up to then. `continue_from`: the full name of an action to
        run, "" for none. Raise `GraphRefused` as the engine does; a graph that was paused for the
        modify then stays PAUSED."""
        self._run_until(at_ms)
        old = self.graphs.get(graph.name)
        if old is not None and not self.crashed and not self.locked:
            self._command(partial(self._modify_graph, old, graph, continue_from))
        return self._taken()

    def returned(self, returned: Returned, at_ms: float) -> list[Trace]:
        """Process, at `at_ms`, the result of a call that the performer carried out and that has
        ended completely; return the trace up to then."""
        self._run_until(at_ms)
        if not self.crashed:
            self._performed_returns(returned)
        return self._taken()

    def play(self, number: int, at_ms: float) -> list[Trace]:
        """Let the script, from `at_ms` on, play the call with this number, which was given to the
        performer. The performer will not carry the call out, and the action begins only now. Return
        the trace up to `at_ms`."""
        self._run_until(at_ms)
        if not self.crashed:
            self._play(number)
        return self._taken()

    # Helpers of the commands

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
