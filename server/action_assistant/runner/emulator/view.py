"""The graphs of an emulated engine as it publishes them: a little late and incomplete, as engines do."""

import random
from collections import deque
from collections.abc import Sequence
from typing import Final

from action_assistant.runner.emulator.messages import (
    EmulatedIndex,
    EngineTraits,
    GraphPlan,
    library_of,
    signatures_of,
)
from action_assistant.umrf.semantics import (
    Engine,
    GraphStateEvent,
    NodeResultEvent,
    NodeStateEvent,
    Trace,
)
from action_assistant.umrf.semantics.parts import Running, build
from action_assistant.umrf.semantics.printing import GraphPrinter
from action_assistant.umrf.semantics.script import DEFAULT

ENDED: Final = frozenset({"FINISHED", "HALTED", "STOPPED", "ERROR"})
_SHOWN: Final = frozenset({"RUNNING", "FINISHED", "STOPPING", "ERROR"})
_MESSAGES: Final = 10  # of one action


class _Held:
    """One graph that the engine holds."""

    def __init__(self, running: Running, sheet: GraphPrinter) -> None:
        self.running = running
        self.sheet = sheet
        self.state = "UNINITIALIZED"
        self.states: dict[str, str] = {}
        self.messages: dict[str, tuple[tuple[int, str], ...]] = {}

    def text(self) -> str:
        """Return the graph as the engine prints it."""
        return self.sheet.text(self.state, self.states, self.messages)


class PublishedGraphs:
    """The graphs of an engine as feedback and answers show them, and the ring of snapshots.

    `taken`: the map of graphs is locked, so that no snapshot can be added.
    """

    def __init__(
        self,
        engine: Engine,
        index: EmulatedIndex,
        quirks: EngineTraits,
        chance: random.Random,
        epoch_ms: int,
    ) -> None:
        self.taken = False
        self.plans: dict[str, GraphPlan] = dict(index.graphs)
        self.indexed = tuple(map(_printed, index.graphs.values()))
        self._engine = engine
        self.index = index
        self._quirks = quirks
        self._chance = chance
        self._epoch_ms = epoch_ms
        self._held: dict[str, _Held] = {}
        self._ring: deque[str] = deque(maxlen=quirks.ring)

    def reindex(self, index: EmulatedIndex) -> None:
        """Replace the index of actions and graphs."""
        self.index = index
        self._engine.library = library_of(index)
        self._engine.signatures = signatures_of(index, self._quirks)
        self.indexed = tuple(map(_printed, index.graphs.values()))
        self.plans |= index.graphs

    def take(self, traces: Sequence[Trace], now_ms: float) -> list[str]:
        """Process traces of the engine; return the names of the graphs that ended, without
        sub-graphs."""
        ended: list[str] = []
        seen = _as_threads_do(traces)
        at_once = sum(isinstance(each, NodeStateEvent) and each.state in _SHOWN for each in seen)
        for trace in seen:
            if isinstance(trace, NodeResultEvent):
                self._remember(trace.graph, trace.node, round(self._epoch_ms + now_ms))
        for trace in seen:
            if isinstance(trace, NodeStateEvent):
                self._node(trace, at_once)
            elif isinstance(trace, GraphStateEvent) and (held := self._of(trace.graph)):
                held.state = trace.state
                if trace.state == "UNINITIALIZED":  # another graph has taken the place of this name
                    held.states.clear()
                    held.messages.clear()
                if trace.state in ENDED and held.running.home is None:
                    ended.append(trace.graph)
        return ended

    def running(self) -> tuple[str, ...]:
        """Return every graph that a get lists as running, printed."""
        keeps = self._quirks.keeps_ended
        shown = [held for _, held in sorted(self._held.items())]
        return tuple(each.text() for each in shown if keeps or each.state not in ENDED)

    def snapshot(self, name: str, at_once: int = 1) -> None:
        """Add a snapshot to the ring, unless the map of graphs is locked or chance drops it: of
        `at_once` simultaneous snapshots about one is kept."""
        held = self._held.get(name)
        if held is None or self.taken or self._engine.locked:
            return
        kept = (1 - self._quirks.loss) / max(1, at_once - 1)
        if not self._quirks.loss or self._chance.random() < kept:
            self._ring.appendleft(held.text())

    @property
    def waiting(self) -> bool:
        """True while the ring has a snapshot."""
        return bool(self._ring)

    def drained(self) -> tuple[str, ...]:
        """Empty the ring; return its snapshots, the newest first."""
        history = tuple(self._ring)
        self._ring.clear()
        return history if self._quirks.newest_first else history[::-1]

    def modified(self, name: str, plan: GraphPlan) -> None:
        """Note the new structure of a graph."""
        held, known = self._held.get(name), self.plans.get(name)
        if held is not None:
            before = known.attributes if known is not None else {}
            self.plans[name] = GraphPlan(plan.graph, before | plan.attributes)
            held.sheet = self._sheet(held.running)

    def _node(self, trace: NodeStateEvent, at_once: int) -> None:
        held = self._of(trace.graph)
        if held is None or trace.state == "INITIALIZED":
            return
        before = held.states.get(trace.node, "UNINITIALIZED")
        held.states[trace.node] = trace.state
        resumed = before in {"PAUSED", "PAUSE_REQUESTED"} and trace.state == "RUNNING"
        if trace.state in _SHOWN and not resumed:
            self.snapshot(trace.graph, at_once)

    def _of(self, name: str) -> _Held | None:
        running = self._engine.graphs.get(name)
        held = self._held.get(name)
        if running is not None and (held is None or held.running is not running):
            again = held is not None and running.home is None and name not in self.index.graphs
            held = self._held[name] = _Held(running, self._sheet(running, again=again))
        return held

    def _sheet(self, running: Running, *, again: bool = False) -> GraphPrinter:
        """Return the printer of a graph. Matching its actions with the index, which is not repeated
        for a graph that is held already (`again`), loses its description."""
        plan = self.plans.get(running.own if running.home else running.name)
        whole = not self._quirks.drops_fields
        return GraphPrinter(
            running,
            plan.attributes if plan is not None else {},
            described=whole or again,
            conditioned=whole,
        )

    def _remember(self, graph: str, node: str, at: int) -> None:
        """Store the message of an action that has ended."""
        held = self._held.get(graph)
        found = held.running.nodes.get(node) if held is not None else None
        if held is not None and found is not None and found.call.message:
            told = (at, found.call.message)
            held.messages[node] = (*held.messages.get(node, ()), told)[-_MESSAGES:]


def _as_threads_do(traces: Sequence[Trace]) -> list[Trace]:
    """Sort the traces of one instant as a real engine shows them: ends before begins, since actions
    begin on threads of their own."""
    last = {(e.graph, e.node): e for e in traces if isinstance(e, NodeStateEvent)}

    def begins(trace: Trace) -> bool:
        return (
            isinstance(trace, NodeStateEvent)
            and trace.state == "RUNNING"
            and last[(trace.graph, trace.node)] is trace
        )

    return [e for e in traces if not begins(e)] + [e for e in traces if begins(e)]


def _printed(plan: GraphPlan) -> str:
    """Return an indexed graph as the engine prints it; it keeps its description."""
    running = Running(plan.graph.name, plan.graph, None, None)
    build(running, {action.key: (DEFAULT,) for action in plan.graph.actions})
    return GraphPrinter(running, plan.attributes, described=True).text("UNINITIALIZED", {}, {})
