"""The link to a simulated engine: `umrf.semantics` driven by the event loop's clock.

The loop's clock may be a virtual one, which tests use to live through days in a second. Every graph
that is started here keeps its name to itself, so one link serves many runs of different graphs.
"""

import math
import secrets
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Final, Protocol, assert_never

import anyio
import msgspec

from action_assistant.errors import Unavailable
from action_assistant.runner.links.behaviours.folder import BehaviourFolder
from action_assistant.runner.links.behaviours.performer import BehaviourPerformer
from action_assistant.runner.links.led_calls import CourseStep, LedCalls, LedCourse, Played, Stopped
from action_assistant.runner.links.listeners import Listeners
from action_assistant.runner.links.observations import (
    Exact,
    GraphResult,
    GraphState,
    Hazard,
    NodeResult,
    NodeState,
    Snapshot,
)
from action_assistant.runner.links.parameter_texts import Values, values_of
from action_assistant.runner.links.port import (
    Answer,
    CallBegan,
    CallPlayed,
    CallStopped,
    EngineChanged,
    EngineRefused,
    EngineState,
    Leaves,
    Link,
    NoAnswer,
    NotSent,
    Order,
    Report,
    Standing,
    Transitions,
    unwatched,
)
from action_assistant.umrf import semantics
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.files import codec
from action_assistant.umrf.kept_values import KeptValues, is_keeper, kept_in
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics import Returned, Script

#: No simulated action is quicker: a loop of instant actions would never let go of the processor.
_QUICKEST_S: Final = 0.01


_GRAIN_MS: Final = 0.01  # what is due within this time is due now
_MOST_AHEAD: Final = 1000  # engine steps for which a call of a course is waited
_SLICE: Final = 50  # engine steps between two turns of the event loop


class LeadableLink(Link, Protocol):
    """The link to a simulated engine that can play a graph whose actions robots carry out."""

    async def returned(self, returned: Returned) -> None:
        """Give the engine the end (outcome and outputs) of a call that a robot carried out. Raise
        NotSent if the engine cannot take it."""
        ...

    async def play(self, number: int) -> None:
        """Let the engine itself play the call with this number, which begins by that. Do not wait
        for its effect."""
        ...

    async def take_up(self, order: Order, course: LedCourse) -> None:
        """Start the graph in `order` and bring it to the point that an earlier engine had reached
        by the events in `course`. Only calls that are still open are reported, and those that the
        engine has played to their end. Raise EngineRefused or NotSent if that cannot be done."""
        ...


class Simulator(Protocol):
    """A factory of simulated engines."""

    def __call__(
        self,
        facts: EngineFacts,
        script: str,
        clock_us: Callable[[], int],
        behaviours: BehaviourFolder | None = None,
        led: frozenset[str] = frozenset(),
    ) -> "LeadableLink":
        """Return a link to a new simulated engine. `facts`: the engine build to simulate; `script`:
        how its actions act (JSON, "" for none); `clock_us`: returns microseconds UTC; `behaviours`:
        the folder of Python behaviours, which come before the script; `led`: full names of actions
        that robots carry out."""


def in_this_process(
    facts: EngineFacts,
    script: str,
    clock_us: Callable[[], int],
    behaviours: BehaviourFolder | None = None,
    led: frozenset[str] = frozenset(),
) -> "SimulatorLink":
    """Return a link to a simulated engine that shares the event loop, for tests in virtual time.
    `facts`: the engine build; `script`: how its actions act (JSON); `led`: full names of actions
    that robots carry out. Raise Unavailable if `behaviours` are given, which need a process."""
    if behaviours is not None:
        raise Unavailable("Behaviours need a simulated engine in a process of its own.")
    performer = LedCalls(led) if led else None
    return SimulatorLink(
        engine_of(facts, script, performer), clock_us=clock_us, performer=performer
    )


def _keeps(node: str, state: str) -> bool:
    return is_keeper(node) and state == "UNINITIALIZED"


def engine_of(
    facts: EngineFacts, script: str, performer: BehaviourPerformer | LedCalls | None = None
) -> semantics.Engine:
    """Return an engine of the build `facts` that follows a script (JSON; "" for none), which must
    have been checked before. `performer`: carries out the actions that do not follow the script."""
    chosen = slowed(semantics.script_from(msgspec.json.decode(script))) if script else None
    return semantics.Engine(facts=facts, script=chosen, performer=performer)


class SimulatorLink:
    """The link to a simulated engine in this process. `clock_us`: gives microseconds UTC.
    `performer`: runs its behaviours, if any, in real time."""

    simulated: Final = True

    def __init__(
        self,
        engine: semantics.Engine,
        *,
        clock_us: Callable[[], int],
        performer: BehaviourPerformer | LedCalls | None = None,
    ) -> None:
        self._performer = performer
        self._engine = engine
        self._clock_us = clock_us
        self._origin = anyio.current_time()
        self._origin_wall = clock_us()
        self._incarnation = secrets.token_hex(8)
        self._runs: dict[str, str] = {}  # graph name -> run
        self._subscribers = Listeners[Report]()
        self._wake = anyio.Event()
        self._dead: str | None = None

    @property
    def pauses(self) -> bool:
        """True when pausing is safe on the kind of engine that is simulated."""
        return self._engine.facts.pauses_safely

    @property
    def standing(self) -> Standing:
        """The condition of the engine: answering until it has crashed or hangs."""
        if self._dead is not None:
            return Standing(state="gone", why=self._dead, incarnation=self._incarnation)
        return Standing(
            state="answering",
            incarnation=self._incarnation,
            generation="current",
            servers=1,
            indexes=False,
        )

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """Call `leaves` and start the graph in `order` now. Raise EngineRefused if the engine
        refuses it, NoAnswer if the engine has crashed or hangs."""
        self._alive()
        leaves()
        graph = _whole(order)
        before = self._runs.get(order.graph.name)
        self._runs[order.graph.name] = order.run
        self._engine.library = {**self._engine.library, **_inside(order)}
        try:
            self._tell(self._engine.start(graph, self._now()))
        except semantics.GraphRefused as refused:
            if before is not None:  # that one goes on, or is stopped, under its own identity
                self._runs[order.graph.name] = before
            self._wake.set()
            raise EngineRefused(str(refused)) from refused

    async def stop(self, graph_name: str) -> None:
        """Stop a graph now; the engine carries out a second stop after the first one. Does nothing
        after a crash."""
        if self._dead is None:
            self._tell(self._engine.stop(graph_name, self._now()))

    async def pause(self, graph_name: str) -> None:
        """Pause a graph now; does nothing if the engine has crashed or hangs."""
        if self._dead is None:
            self._tell(self._engine.pause(graph_name, self._now()))

    async def resume(
        self, graph_name: str, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Resume a paused graph now; does nothing if the engine has crashed or hangs.
        `continue_from`: the full name of an action that is started then, "" for none."""
        leaves()
        if self._dead is None:
            self._tell(self._engine.resume(graph_name, self._now(), continue_from=continue_from))

    async def modify(
        self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Replace a running graph by the one in `order` now. `continue_from`: the full name of an
        action that is started then, "" for none. Raise NotSent if the engine has crashed or hangs,
        EngineRefused if it refuses the change."""
        if self._dead is not None:
            raise NotSent(self._dead)
        leaves()
        try:
            self._tell(self._engine.modify(_whole(order), self._now(), continue_from=continue_from))
        except semantics.GraphRefused as refused:
            self._wake.set()
            raise EngineRefused(str(refused)) from refused

    async def returned(self, returned: Returned) -> None:
        """Give the engine the end (outcome and outputs) of a call that a robot carried out. Does
        nothing if the engine has crashed or hangs."""
        if self._dead is None:
            self._tell(self._engine.returned(self._owned(returned), self._now()))

    async def play(self, number: int) -> None:
        """Let the script play the call with this number from now on. Does nothing if the engine has
        crashed or hangs."""
        if self._dead is None:
            self._tell(self._engine.play(self._own(number), self._now()))

    async def take_up(self, order: Order, course: LedCourse) -> None:
        """Start the graph in `order` and bring it to the point that an earlier engine had reached
        by the events in `course`. Only calls that are still open are reported, and those that the
        script has played to their end. Raise EngineRefused if the engine refuses the graph, or
        crashes in the course."""
        name = order.graph.name
        self._runs[name] = order.run
        self._engine.library = {**self._engine.library, **_inside(order)}
        if isinstance(self._performer, LedCalls):
            self._performer.expect(course.calls)
        newest_ms = max((at_ms for at_ms, _ in course.steps), default=0.0)
        # A clock that was set back must not leave the engine behind its own past.
        elapsed_us = max(0, self._clock_us() - course.began, round(newest_ms * 1000))
        self._origin = anyio.current_time() - elapsed_us / 1e6
        self._origin_wall = course.began
        try:
            self._engine.start(_whole(order), 0.0)
        except semantics.GraphRefused as refused:
            raise EngineRefused(str(refused)) from refused
        over = {step.number for _, step in course.steps if not isinstance(step, Stopped)}
        past_ms = 0.0
        for at_ms, step in course.steps:
            self._require_call(step)
            past_ms = at_ms = max(past_ms, at_ms, self._engine.now)
            match step:
                case Returned():
                    self._engine.returned(self._owned(step), at_ms)
                case Played(number=number):
                    self._engine.play(self._own(number), at_ms)
                case Stopped():
                    self._engine.stop(name, at_ms)
        past = self._performer.news() if isinstance(self._performer, LedCalls) else []
        self._engine.advance(self._now())
        if self._engine.crashed or self._engine.locked:
            raise EngineRefused("its course ends the engine again")
        self._wake.set()
        for each in past:
            match each:
                case CallPlayed():
                    self._subscribers.tell(msgspec.structs.replace(each, is_past=True))
                case CallBegan(call=call) if call.number not in over:
                    self._subscribers.tell(each)
                case CallStopped(number=number) if number not in over:
                    self._subscribers.tell(each)
                case _:
                    pass
        for each in self._performer.news() if isinstance(self._performer, LedCalls) else ():
            self._subscribers.tell(each)

    def _own(self, number: int) -> int:
        """Return the number in this engine of a call, by the one by which it is known."""
        return self._performer.own(number) if isinstance(self._performer, LedCalls) else number

    def _owned(self, returned: Returned) -> Returned:
        return msgspec.structs.replace(returned, number=self._own(returned.number))

    def _require_call(self, step: CourseStep) -> None:
        """Let the engine go on until the call of a step of its course has begun, which a clock may
        have noted too early. Raise EngineRefused if that does not begin, or is another action's."""
        if isinstance(step, Stopped) or not isinstance(self._performer, LedCalls):
            return
        nodes = self._performer.nodes
        for _ in range(_MOST_AHEAD):
            if step.number in nodes or self._engine.due is None:
                break
            self._engine.advance(self._engine.due)
        node = nodes.get(step.number)
        if node is None or (isinstance(step, Played) and node != step.node):
            raise EngineRefused("its course cannot be repeated")

    async def get(self) -> Answer:
        """Return all graphs that the engine holds now. Raises NoAnswer, also while a behaviour is being killed,
        so that its action is not taken for ended."""
        self._alive()
        self._advance()
        if self._performer is not None and self._performer.is_killing:
            raise NoAnswer("A behaviour that did not stop is being killed.")
        at = self._clock_us()
        graphs = tuple(
            Snapshot(
                at=at,
                graph=name,
                state=now.state,
                nodes={node: state for node, state in now.nodes.items() if not _keeps(node, state)},
                asked_at=at,
                run=self._run_of(name),
                kept=self._kept(name, now.nodes),
            )
            for name, now in self._engine.states().items()
        )
        return Answer(asked_at=at, at=at, incarnation=self._incarnation, graphs=graphs)

    def _kept(self, graph: str, nodes: Mapping[str, str]) -> KeptValues:
        """Return the values that the keepers in a graph hold, as a real engine shows them. `nodes`:
        the states of its actions, by full name."""
        inside = self._engine.graphs[graph].nodes
        held: dict[int, bytes] = {}
        for node in (each for each, state in nodes.items() if _keeps(each, state)):
            slots = inside[node].inputs.items()
            leaves = {
                name: {"pvf_type": slot.type}
                | ({"pvf_value": slot.value} if slot.has_value() else {})
                for name, slot in slots
            }
            held[inside[node].instance_id] = msgspec.json.encode(leaves)
        return kept_in(held)

    async def run(self, heard: Callable[[], Awaitable[None]] | None = None) -> None:
        """Run the engine until cancelled. After each batch of reports, await `heard`, so that
        listeners can slow the engine down; without `heard`, only let other tasks run."""
        heard = heard or anyio.lowlevel.checkpoint
        while True:
            due = self._engine.due
            late = due is None or self._dead is not None
            wait = math.inf if late or due is None else max(0.0, (due - self._now()) / 1000)
            with anyio.move_on_after(wait):
                await self._wake.wait()
            while not self._advance():
                await heard()
                await anyio.lowlevel.checkpoint()
            await heard()
            self._wake = anyio.Event()
            if self._performer is not None and self._performer.has_returned:
                self._wake.set()

    def listen(self, hear: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Return a context during which `hear` is called with every report of the engine."""
        return self._subscribers.listening(hear)

    async def aclose(self) -> None:
        """End the engine, and kill the behaviours that still run."""
        self._dead = "the simulated engine was switched off"
        if isinstance(self._performer, BehaviourPerformer):
            await anyio.to_thread.run_sync(self._performer.end, abandon_on_cancel=True)

    def wake(self) -> None:
        """Wake the task that processes what is due. Call this only on the thread of the event
        loop."""
        self._wake.set()

    def _now(self) -> float:
        return (anyio.current_time() - self._origin) * 1000

    def _alive(self) -> None:
        if self._dead is not None:
            raise NoAnswer(self._dead)

    def _advance(self) -> bool:
        """Process what is due by now, at most 50 steps, and report it; return whether nothing more
        is due."""
        told: list[semantics.Trace] = []
        for returned in self._performer.taken() if self._performer is not None else ():
            told += self._engine.returned(returned, self._now())
        for _ in range(_SLICE):
            due = self._engine.due
            if self._idle(due):
                break
            assert due is not None
            told += self._engine.advance(due)
        self._tell(told)
        return self._idle(self._engine.due)

    def _idle(self, due: float | None) -> bool:
        return self._dead is not None or due is None or due > self._now() + _GRAIN_MS

    def _tell(self, traces: Sequence[semantics.Trace]) -> None:
        self._wake.set()
        per_run: dict[str, list[Exact]] = {}
        begun = self._begun(traces)
        for trace in traces:
            seen = _seen(trace, self._at(trace.t_ms), begun)
            run = self._run_of(trace.graph)
            if seen is not None and run is not None:
                per_run.setdefault(run, []).append(seen)
        for run, changes in per_run.items():
            self._subscribers.tell(Transitions(run=run, changes=tuple(changes)))
        if isinstance(self._performer, LedCalls):
            for each in self._performer.news():
                self._subscribers.tell(each)
        for trace in traces:
            if isinstance(trace, semantics.HazardEvent) and trace.effect in {"crash", "hang"}:
                self._fail(trace)

    def _begun(self, traces: Sequence[semantics.Trace]) -> dict[int, Values]:
        """Return the input values of the nodes that have begun in these traces and still run, by
        the `id` of the Python object of the trace. Nodes that have ended meanwhile have lost
        theirs."""
        last = {
            (trace.graph, trace.node): trace
            for trace in traces
            if isinstance(trace, semantics.NodeStateEvent)
        }
        found: dict[int, Values] = {}
        for (name, node), trace in last.items():
            graph = self._engine.graphs.get(name)
            if trace.state == "RUNNING" and graph is not None and node in graph.nodes:
                found[id(trace)] = values_of(graph.nodes[node].inputs.values())
        return found

    def _fail(self, hazard: semantics.HazardEvent) -> None:
        """Stop answering after a crash or a hang (`hazard`), as a real engine does, and report the
        engine as gone (crash) or busy (hang)."""
        what = "has crashed" if hazard.effect == "crash" else "hangs"
        why = f"The simulated engine {what} ({hazard.code}). {hazard.message}".rstrip()
        self._dead = why
        if hazard.effect == "crash" and self._performer is not None:
            self._performer.kill_all()  # their code ends with the engine's process
        state: EngineState = "gone" if hazard.effect == "crash" else "busy"
        self._subscribers.tell(EngineChanged(at=self._at(hazard.t_ms), state=state, why=why))

    def _at(self, t_ms: float) -> int:
        return self._origin_wall + round(t_ms * 1000)

    def _run_of(self, graph: str) -> str | None:
        """Return the id of the run to which a graph belongs; None if there is none. A sub-graph
        `GRAPH__NAME__ID` belongs to the run of the longest matching prefix."""
        if graph in self._runs:
            return self._runs[graph]
        owners = [name for name in self._runs if graph.startswith(f"{name}__")]
        return self._runs[max(owners, key=len)] if owners else None


def _whole(order: Order) -> Graph:
    return order.graph if isinstance(order.graph, Graph) else codec.read(order.umrf).graph


def _inside(order: Order) -> dict[str, Graph]:
    """Return the sub-graphs that come with an order, by name: the index of the engine for this run."""
    graphs = [codec.read(text).graph for text in order.inside]
    return {graph.name: graph for graph in graphs}


def _seen(trace: semantics.Trace, at: int, begun: Mapping[int, Values]) -> Exact | None:
    """Return the change that a trace adds to the history, at the time `at` (µs UTC); None for
    relations, which follow from results. `begun`: the inputs with which actions began, by the id of
    the trace."""
    match trace:
        case semantics.NodeStateEvent():
            inputs = begun.get(id(trace))
            return NodeState(at, trace.graph, trace.node, trace.state, inputs)
        case semantics.NodeResultEvent():
            return NodeResult(at, trace.graph, trace.node, trace.result, trace.message)
        case semantics.GraphStateEvent():
            return GraphState(at, trace.graph, trace.state)
        case semantics.GraphResultEvent():
            return GraphResult(at, trace.graph, trace.value)
        case semantics.HazardEvent():
            return Hazard(at, trace.graph, trace.code, trace.effect, trace.node, trace.message)
        case semantics.EdgeEval() | semantics.Dispatch() | semantics.NotReady():
            return None
        case _:
            assert_never(trace)


def slowed(script: Script) -> Script:
    """Return the script with every action lasting at least 10 ms, so that a graph without pauses
    does not run without end in no time."""
    behaviours = {
        key: tuple(
            msgspec.structs.replace(each, after_s=max(each.after_s, _QUICKEST_S)) for each in calls
        )
        for key, calls in script.behaviours.items()
    }
    return Script(behaviours)
