"""The outcome of one course of a graph, found by the simulated engine from start to end.

Used for graphs with spontaneous actions, which stop others at any time, and in tests as the
reference for `deviations`.
"""

from action_assistant.umrf.components import Mask
from action_assistant.umrf.courses.baseline import LAPS, MORE, Kind, Outcome
from action_assistant.umrf.courses.network import Network
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics.engine import Engine
from action_assistant.umrf.semantics.graphs import GraphRefused
from action_assistant.umrf.semantics.parts import EXIT_NODE, Node, Running
from action_assistant.umrf.semantics.parts import Outcome as Result
from action_assistant.umrf.semantics.script import Behaviour, Script
from action_assistant.umrf.semantics.trace import (
    Dispatch,
    EdgeEval,
    GraphStateEvent,
    HazardEvent,
    NodeStateEvent,
    NotReady,
    Trace,
)


class _Timed(Engine):
    """An engine whose actions end at the times of a network, and that bypasses an action once for
    each result in an instant."""

    def __init__(self, net: Network, script: Script) -> None:
        super().__init__(script=script, serial=False)
        self.net = net
        self.circles = False
        self._bypassed: set[tuple[str, str]] = set()
        self._instant = -1.0

    def _takes_ms(self, node: Node) -> float:
        return self.net.due(self.net.index[node.full_name], self.now) - self.now

    def _stops_ms(self, node: Node) -> float:
        return self.net.stopping_ms[self.net.index[node.full_name]]

    def _bypass(self, graph: Running, child: Node, result: Result) -> None:
        if self._instant != self.now:
            self._instant = self.now
            self._bypassed.clear()
        index = self.net.index[child.full_name]
        self.circles = self.circles or bool(self.net.circling[result] >> index & 1)
        if (child.full_name, result) not in self._bypassed:
            self._bypassed.add((child.full_name, result))
            super()._bypass(graph, child, result)


def simulated_outcome(
    net: Network, graph: Graph, full_name: str, result: str
) -> tuple[Outcome, int]:
    """Simulate a graph in which the first run of the action `full_name` ends with `result`, and
    every other run with on_true. `net`: the graph as numbers, with its times. Return how the graph
    ends, and the number of trace events of the simulation. If `full_name` is empty, every run ends
    with on_true."""
    calls: dict[str, tuple[Behaviour, ...]] = {}
    if full_name:
        calls[full_name] = (Behaviour(result=result), Behaviour())
    engine = _Timed(net, Script(calls))
    seen = _TraceReader(net)
    try:
        traces = engine.start(graph, 0.0)
    except GraphRefused:  # the graph does not begin, however its actions end
        return Outcome("never", seen.early, cut=False), 0
    events = len(traces)
    kind = seen.take(traces)
    left = LAPS * len(net.nodes) + MORE
    while kind is None and not engine.crashed and not engine.circles:
        due = engine.due
        if due is None or left <= 0:
            break
        traces = engine.advance(due)
        events += len(traces)
        left -= any(
            isinstance(t, NodeStateEvent) and t.state in ("FINISHED", "ERROR") for t in traces
        )
        kind = seen.take(traces)
    if kind in (None, "stuck") and (engine.crashed or engine.locked or engine.circles):
        kind = "crashed" if engine.crashed else "locked"
    if kind is None:
        kind = "endless" if engine.graphs[graph.name].state == "RUNNING" else "never"
    if kind != "stuck":
        endless = _going_on(net, engine, graph.name) if kind == "finished" else 0
        return Outcome(kind, seen.early, cut=kind == "endless", endless=endless), events
    running = engine.graphs[graph.name]
    ended = running.exit
    lacking = frozenset(n for n, link in ended.links.items() if link.required and not link.received)
    inputs = not ended.has_inputs()
    return Outcome(kind, seen.early, seen.waiting, lacking, inputs, seen.last), events


def _going_on(net: Network, engine: Engine, name: str) -> Mask:
    """Return, as a mask, the spontaneous actions that still run in the graph `name` of this engine."""
    return sum(
        1 << net.index[node.full_name]
        for node in engine.graphs[name].nodes.values()
        if node.type == "spontaneous" and node.state == "RUNNING"
    )


class _TraceReader:
    """Reads trace events, and keeps which actions wait and how the graph ends."""

    def __init__(self, net: Network) -> None:
        self.net = net
        self.waiting = 0
        self.early = False
        self.last = -1
        self._asked = -1

    def take(self, traces: list[Trace]) -> Kind | None:
        """Read the next trace events, and return how the graph ends if one of them shows its end;
        None otherwise."""
        kind: Kind | None = None
        for trace in traces:
            match trace:
                case EdgeEval(edge=edge):
                    self._asked = self.net.index.get(edge.partition(" => ")[0], -1)
                case NotReady(node=node):
                    self.waiting |= 1 << self._index_of(node)
                    if node == EXIT_NODE:
                        self.last = self._asked
                case Dispatch(node=node):
                    self.waiting &= ~(1 << self._index_of(node))
                case GraphStateEvent(state="FINISHED"):
                    kind = "finished"
                case GraphStateEvent(state="HALTED"):
                    kind = "halted"
                case HazardEvent(code="H12"):
                    self.early = True
                case HazardEvent(code="H8"):
                    kind = "stuck"
                case _:
                    pass
        return kind

    def _index_of(self, node: str) -> int:
        return self.net.exit if node == EXIT_NODE else self.net.index[node]
