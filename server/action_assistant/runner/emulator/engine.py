"""The emulated engine: takes messages and returns messages, at times that its caller gives.

It has no ROS, no clock and no I/O: the same seed and the same messages give the same answers. `umrf.semantics`
runs the graphs; this module adds the node around them: one thread that a slow command blocks, topics on which
the newest message wins, a ring of snapshots that is sent twice a second, and refusals that are only logged
(docs/umrf-and-the-engine.md 4, and recordings of real nodes).
"""

import random
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from heapq import heappop, heappush
from itertools import count
from math import inf
from typing import Final, TypeAlias, assert_never

from action_assistant.runner.emulator.messages import (
    TOPICS,
    EmulatedIndex,
    EngineTraits,
    FeedbackMessage,
    GetResponse,
    Gone,
    GraphPlan,
    LogMessage,
    Message,
    Modify,
    Pause,
    Refusal,
    Resume,
    Said,
    Start,
    Stop,
    active,
    asked_for,
    engine_inside,
    graph_plan_of,
    library_of,
    refusal,
    signatures_of,
    unknown,
)
from action_assistant.runner.links.behaviours.performer import BehaviourPerformer
from action_assistant.umrf.facts import PINNED, EngineFacts
from action_assistant.umrf.semantics import (
    Engine,
    Execution,
    GraphRefused,
    GraphStateEvent,
    NodeResultEvent,
    NodeStateEvent,
    Script,
    Trace,
)
from action_assistant.umrf.semantics.parts import Running, build
from action_assistant.umrf.semantics.printing import GraphPrinter
from action_assistant.umrf.semantics.script import DEFAULT

ENDED: Final = frozenset({"FINISHED", "HALTED", "STOPPED", "ERROR"})
_SHOWN: Final = frozenset({"RUNNING", "FINISHED", "STOPPING", "ERROR"})
_MESSAGES: Final = 10  # of one action


class _Held:
    """One graph that the emulated engine holds, running or ended."""

    def __init__(self, running: Running, sheet: GraphPrinter) -> None:
        self.running = running
        self.sheet = sheet
        self.state = "UNINITIALIZED"
        self.states: dict[str, str] = {}
        self.messages: dict[str, tuple[tuple[int, str], ...]] = {}

    def text(self) -> str:
        """Return the graph as JSON, printed as the real engine prints it."""
        return self.sheet.text(self.state, self.states, self.messages)


class PublishedGraphs:
    """The graphs of an emulated engine as feedback and answers show them, and its ring buffer of
    snapshots. `taken`: the map of graphs is locked, so that no snapshot can be added."""

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
        """Replace the index, that is, the known actions and graphs."""
        self.index = index
        self._engine.library = library_of(index)
        self._engine.signatures = signatures_of(index, self._quirks)
        self.indexed = tuple(map(_printed, index.graphs.values()))
        self.plans |= index.graphs

    def take(self, traces: Sequence[Trace], now_ms: float) -> list[str]:
        """Update the shown states of graphs by events (`traces`) of the simulated engine at
        `now_ms`. Return the names of the graphs that ended, without sub-graphs."""
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
        """Return the printed text of every graph that a get lists as running."""
        keeps = self._quirks.keeps_ended
        shown = [held for _, held in sorted(self._held.items())]
        return tuple(each.text() for each in shown if keeps or each.state not in ENDED)

    def snapshot(self, name: str, at_once: int = 1) -> None:
        """Add a snapshot of the graph `name` to the ring buffer. It is not added if the map of
        graphs is locked or chance drops it: of `at_once` simultaneous snapshots about one remains.
        """
        held = self._held.get(name)
        if held is None or self.taken or self._engine.locked:
            return
        kept = (1 - self._quirks.loss) / max(1, at_once - 1)
        if not self._quirks.loss or self._chance.random() < kept:
            self._ring.appendleft(held.text())

    @property
    def waiting(self) -> bool:
        """True while the ring buffer has a snapshot."""
        return bool(self._ring)

    def drained(self) -> tuple[str, ...]:
        """Empty the ring buffer; return its snapshots, the newest first."""
        history = tuple(self._ring)
        self._ring.clear()
        return history if self._quirks.newest_first else history[::-1]

    def modified(self, name: str, plan: GraphPlan) -> None:
        """Use the new structure (`plan`) of the graph `name` from now on."""
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
        """Return the printer of a running graph. A graph loses its description when its actions are
        first matched with the index; `again`: the graph was held already and is not matched again.
        """
        plan = self.plans.get(running.own if running.home else running.name)
        whole = not self._quirks.drops_fields
        return GraphPrinter(
            running,
            plan.attributes if plan is not None else {},
            described=whole or again,
            conditioned=whole,
        )

    def _remember(self, graph: str, node: str, at: int) -> None:
        """Store the message of an action (`node`) that has ended at `at` (ms since 1970), if it
        gave one."""
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
    """Return an indexed graph as the engine prints it, with its description."""
    running = Running(plan.graph.name, plan.graph, None, None)
    build(running, {action.key: (DEFAULT,) for action in plan.graph.actions})
    return GraphPrinter(running, plan.attributes, described=True).text("UNINITIALIZED", {}, {})


_GETS: Final = 10  # requests that wait, by the depth of a service


class Inbox:
    """The messages that wait for the engine. It returns them in the order of their topics, then
    gets. A full queue drops its oldest message. `depth`: how many messages of one topic wait; 0 for
    any number."""

    def __init__(self, depth: int) -> None:
        self._depth = depth
        self._messages: dict[str, deque[Message]] = {topic: deque() for topic in TOPICS}
        self._gets: deque[int] = deque(maxlen=_GETS)

    def put(self, message: Message) -> None:
        """Add a command. If too many of its topic wait, the oldest is dropped."""
        waiting = self._messages[message.topic]
        if self._depth and len(waiting) >= self._depth:
            waiting.popleft()
        waiting.append(message)

    def put_get(self, ticket: int) -> None:
        """Add a get. `ticket`: the number that its answer carries."""
        self._gets.append(ticket)

    def taken(self) -> Message | int | None:
        """Remove and return the next message: a command, or the ticket (number) of a get; None when
        no message waits."""
        waiting = next((each for each in self._messages.values() if each), None)
        if waiting is not None:
            return waiting.popleft()
        return self._gets.popleft() if self._gets else None

    def clear(self) -> None:
        """Drop all messages and gets that wait."""
        for waiting in self._messages.values():
            waiting.clear()
        self._gets.clear()


_NEXT_MS: Final = 0.2  # between two messages that wait
_TOLD_MS: Final = 10.0  # from the end of a stop to the line that says so
_TAIL_MS: Final = 1_500.0  # an idle engine that was told to quit takes so long
_FORWARD: Final = "   fwd [in modifyGraph]: forwarding\n"
_BUSY: Final = frozenset({"RUNNING", "PAUSED", "STOPPING", "CLEARING"})
_Command: TypeAlias = Callable[[str, float], list[Trace]]


class EmulatedEngine:
    """One process of one emulated engine, from its start to its end. `hear` and `ask` pass messages
    to it, `advance` returns its own. `born_ms`: the time of its start, from which the period of its
    feedback counts; `epoch_ms`: its 0 ms in milliseconds since 1970. `performer`: runs its
    behaviours in real time. Times `at_ms` are on its clock."""

    def __init__(
        self,
        name: str,
        *,
        index: EmulatedIndex = EmulatedIndex(),  # noqa: B008 - frozen
        script: Script = Script(),  # noqa: B008 - frozen
        facts: EngineFacts = PINNED,
        quirks: EngineTraits = EngineTraits(),  # noqa: B008 - frozen
        extra_wake_words: Sequence[str] = (),
        seed: int = 0,
        born_ms: float = 0.0,
        epoch_ms: int = 0,
        performer: BehaviourPerformer | None = None,
    ) -> None:
        self.performer = performer
        self.wake_words = frozenset({name, *extra_wake_words})
        first = extra_wake_words[0] if extra_wake_words and quirks.extra_is_actor else name
        self.actor = first
        self.quirks = quirks
        self.gone = ""  # why its process has ended
        self._facts = facts
        self._engine = engine_inside(index, quirks, facts, script, first, performer)
        self._now = self._tick = born_ms
        self._out: list[Said] = []
        self._tasks: list[tuple[float, int, Callable[[], None]]] = []
        self._order = count()
        self._view = PublishedGraphs(self._engine, index, quirks, random.Random(seed), epoch_ms)
        self._drains = False
        self._inbox = Inbox(quirks.depth)
        self._works = False  # True while a turn of the thread is planned
        self._under_way: list[Callable[[], None]] = []
        self._lingers = 0
        self._frozen, self._frozen_ms = False, born_ms
        self._deaf = False
        self._log("The Action Engine is initialized.")

    # --- what callers do ----------------------------------------------------------------------

    @property
    def due(self) -> float | None:
        """The time of its next own action, in ms; None if nothing is planned."""
        if self._out or (self.performer is not None and self.performer.has_returned):
            return self._now
        if self._frozen or self.gone:
            return None
        found = min(self._next())
        return found if found < inf else None

    @property
    def moving(self) -> tuple[str, ...]:
        """The running names of graphs in which the code of an action really goes on, whatever states the
        engine shows."""
        return tuple(dict.fromkeys(each.graph for each in self.executing))

    @property
    def executing(self) -> tuple[Execution, ...]:
        """The calls of actions' code that have not returned. Calls in a frozen engine go on when it
        thaws."""
        return () if self.gone else tuple(self._engine.executing(self._awake_ms))

    def hear(self, message: Message, at_ms: float) -> None:
        """Receive a command at `at_ms` (ms on the clock of the emulator). The command may wait in
        the queue of its topic, and is dropped if too many newer commands of that topic come."""
        self._pass(at_ms)
        if isinstance(message, Start) and self.quirks.late_ms:
            self._later(self.quirks.late_ms, partial(self._arrive, message))
        else:
            self._arrive(message)

    def _arrive(self, message: Message) -> None:
        if self._deaf or self.gone:
            return
        self._inbox.put(message)
        self._plan_work(self.quirks.reaction_ms)

    def ask(self, ticket: int, at_ms: float) -> None:
        """Receive the get with the number `ticket` at `at_ms` (ms on the clock of the emulator).
        The answer, if any, carries the same number."""
        self._pass(at_ms)
        if not self._deaf and not self.gone:
            self._inbox.put_get(ticket)
            self._plan_work(self.quirks.reaction_ms)

    def advance(self, to_ms: float) -> list[Said]:
        """Return all messages that the engine sends up to and including this moment, in order."""
        self._pass(to_ms)
        said, self._out = self._out, []
        return said

    def reindex(self, index: EmulatedIndex) -> None:
        """Replace the index, as when the engine reads its folder again. Running graphs stay as they are."""
        self._view.reindex(index)

    def freeze(self, at_ms: float) -> None:
        """Suspend the process at `at_ms` (SIGSTOP): the engine does nothing, and messages wait."""
        self._pass(at_ms)
        self._frozen, self._frozen_ms = True, self._now

    def thaw(self, at_ms: float) -> None:
        """Let the process continue at `at_ms` (SIGCONT); what was due during the freeze happens
        now."""
        self._frozen = False
        self._now = self._engine.now = self._tick = at_ms
        self._take(self._engine.advance(at_ms))  # threads of actions wake before the one that hears
        self._pass(at_ms)

    def quit(self, at_ms: float) -> None:
        """Ask the process to end at `at_ms` (SIGINT): it neither receives nor sends any more, and
        runs its graphs to their end."""
        self._pass(at_ms)
        self._deaf = True
        self._inbox.clear()
        self._view.drained()
        self._leave_if_idle()

    def kill(self, why: str = "killed") -> None:
        """End the process at once (SIGKILL), and the code of all actions with it. `why`: the reason
        that is reported."""
        self.gone = self.gone or why

    # --- time ---------------------------------------------------------------------------------

    def _pass(self, to_ms: float) -> None:
        while not self._frozen and not self.gone:
            own, engine = self._next()
            at = min(own, engine)
            if at > to_ms:
                break
            self._now = max(self._now, at)
            if own <= at:
                heappop(self._tasks)[2]()
            else:
                self._take(self._engine.advance(self._now))
        self._now = max(self._now, to_ms)
        if self.performer is not None and not self._frozen and not self.gone:
            for returned in self.performer.taken():
                self._take(self._engine.returned(returned, self._now))

    def _next(self) -> tuple[float, float]:
        """Return when the node, and when the engine inside it, have something to do next, in ms;
        infinity for never."""
        engine = self._engine.due
        return self._tasks[0][0] if self._tasks else inf, inf if engine is None else engine

    @property
    def _awake_ms(self) -> float:
        return self._frozen_ms if self._frozen else self._now

    def _later(self, wait_ms: float, task: Callable[[], None]) -> None:
        heappush(self._tasks, (self._now + wait_ms, next(self._order), task))

    # --- its one thread -----------------------------------------------------------------------

    @property
    def _blocked(self) -> bool:
        return self._engine.locked or (
            self.quirks.blocks and bool(self._under_way or self._lingers)
        )

    def _plan_work(self, wait_ms: float) -> None:
        if not self._works:
            self._works = True
            self._later(wait_ms, self._work)

    def _work(self) -> None:
        """Handle the next waiting message: commands in the order of their topics, then gets."""
        self._works = False
        if self._blocked or self._deaf:
            return
        match self._inbox.taken():
            case None:
                return
            case int() as ticket:
                self._answer(ticket)
            case message:
                self._obey(message)
        self._plan_work(_NEXT_MS)

    def _hold(self, then: Callable[[], None]) -> None:
        """Call `then` once the emulated engine has carried out its present command; until then it
        handles no further message. The call itself does not wait."""
        self._under_way.append(then)
        self._see_to_it()

    def _see_to_it(self) -> None:
        if self._engine.busy or self._engine.locked or self._engine.crashed:
            return
        done, self._under_way = self._under_way, []
        for then in done:
            then()
        if done:
            self._plan_work(_NEXT_MS)

    def _linger(self, wait_ms: float, then: Callable[[], None]) -> None:
        """Block the engine's thread for `wait_ms` after a command, then call `then`."""
        self._lingers += 1

        def leave() -> None:
            self._lingers -= 1
            then()
            self._plan_work(_NEXT_MS)

        self._later(wait_ms, leave)

    # --- commands -----------------------------------------------------------------------------

    def _obey(self, message: Message) -> None:
        self._log(f"Received request to {message.topic} UMRF graph: {message.graph_name}")
        if not self.wake_words & set(message.targets):
            what = "UMRF graph" if isinstance(message, Start) else message.topic
            self._log(f"The {what} message was not targeted at this Action Engine.")
            return
        match message:
            case Start():
                self._start(message)
            case Stop(graph_name=name):
                self._command(name, "Stopping", "stop", self._engine.stop, "stopped", _TOLD_MS)
            case Pause(graph_name=name):
                self._command(name, "Pausing", "pause", self._engine.pause, "paused", _TOLD_MS)
            case Resume(graph_name=name):
                self._command(name, "Resuming", "resume", self._engine.resume, "resumed", 0.0)
            case Modify():
                self._modify(message)
            case _:
                assert_never(message)

    def _start(self, message: Start) -> None:
        name = message.graph_name
        try:
            plan = asked_for(message, self._view.index, self._engine.graphs)
        except Refusal as refused:
            self._log(str(refused))
            return
        name, held = plan.graph.name, self._engine.graphs.get(plan.graph.name)
        if held is not None and held.state in _BUSY and not self.quirks.restart_stops:
            self._log(refusal(active(name, held.state), message))
            return
        self._view.plans[name] = plan
        try:
            by_name = not message.graph_json
            self._take(self._engine.start(plan.graph, self._now, plan.states, by_name=by_name))
        except GraphRefused as refused:
            self._view.taken = True
            self._take(self._engine.advance(self._now))
            why = refused.message
            stops = "Cannot execute" in why

            def then() -> None:
                self._view.taken = False
                if stops:
                    self._snapshot(name)
                self._log(refusal(why, message))

            self._hold(then)
        else:
            self._hold(lambda: None)

    def _command(
        self, name: str, doing: str, verb: str, command: _Command, done: str, told_ms: float
    ) -> None:
        self._log(f"{doing} UMRF graph '{name}' ...")
        if name not in self._engine.graphs:
            self._log(unknown(verb, name))
            return
        self._take(command(name, self._now))

        def tell() -> None:
            if verb == "stop" or not self.quirks.quiet_pause:
                self._snapshot(name)
            self._log(f"UMRF graph '{name}' {done}.")

        self._hold(lambda: self._linger(told_ms, tell))

    def _modify(self, message: Modify) -> None:
        self._log(f"Modifying UMRF graph '{message.graph_name}' ...")
        why = ""
        try:
            plan = graph_plan_of(message.modified_graph)
            name = plan.graph.name
            self._take(self._engine.modify(plan.graph, self._now, message.continue_from))
        except Refusal as refused:
            self._log(str(refused))
            return
        except GraphRefused as refused:
            why = refused.message
            self._take(self._engine.advance(self._now))

        def then() -> None:
            if not why:
                self._view.modified(name, plan)
            told = f"UMRF graph '{message.graph_name}' modified."
            text = f"origin [in modifyGraph]: {why}\n{_FORWARD}" if why else told
            self._linger(_TOLD_MS, lambda: self._log(text))

        self._hold(then)

    def _answer(self, ticket: int) -> None:
        view = self._view
        self._take(self._engine.asked())
        self._say(
            GetResponse(self._now, ticket, self._view.index.texts, view.indexed, view.running())
        )

    # --- what its graphs do -------------------------------------------------------------------

    def _take(self, traces: Sequence[Trace]) -> None:
        for name in self._view.take(traces, self._now):
            self._log(f"Graph '{name}' finished.")
        if self._engine.crashed:
            self._leave(f"crashed ({self._engine.crashed})")
        self._keep_time()
        self._see_to_it()
        self._leave_if_idle()

    def _snapshot(self, name: str) -> None:
        self._view.snapshot(name)
        self._keep_time()

    def _keep_time(self) -> None:
        """Plan feedback for the next period, if the ring has a snapshot."""
        if self._view.waiting and not self._drains:
            self._drains = True
            period = self._facts.feedback_period_ms
            passed = (self._now - self._tick) // period + 1
            self._later(self._tick + passed * period - self._now, self._drain)

    def _drain(self) -> None:
        self._drains = False
        if history := self._view.drained():
            self._say(FeedbackMessage(self._now, self.actor, history))

    # --- words --------------------------------------------------------------------------------

    def _say(self, said: Said) -> None:
        if not self._deaf and not self.gone:
            self._out.append(said)

    def _log(self, text: str) -> None:
        if self.quirks.narrates:
            self._say(LogMessage(self._now, text))

    def _leave_if_idle(self) -> None:
        if self._deaf and not self.gone and not any(g.active for g in self._engine.graphs.values()):
            self._later(_TAIL_MS, lambda: self._leave("it was told to end"))

    def _leave(self, why: str) -> None:
        if not self.gone:
            self._out.append(Gone(self._now, why))
            self.gone = why
