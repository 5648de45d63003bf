"""Leads one run on several robots: plays the whole graph, and sends each robot one action at a time.

The engine of the whole graph (`LeadingEngine`) says which action begins and which one has to stop; it
moves nothing. For each action that begins, the conductor sends a piece, a graph of that action
alone, to the robot that plays it. A piece is a run like any other (`OpenRun`), with its own stream,
monitor, Stop and proof. Its states tell the outcome, which goes back to the engine. Actions that no
robot plays pass the same gate; then the simulator plays them, or people are asked (`OwnSteps`).

The run sees the conductor as its link: it is started, stopped and asked like an engine. A graph that
has ended is shown as such only when no piece is open, so that the proof of rest of the run is made of
those of its pieces.

Nothing begins while the gate is closed. It is looked at in the same step of the event loop in which a
start message leaves. A Stop closes it for good before any stop message leaves.
"""

import logging
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from math import inf
from typing import Final, Literal, NoReturn

import anyio
import msgspec
from anyio.abc import TaskGroup

from action_assistant.errors import Conflict, Refused
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.execution.asked_steps import AskedSteps
from action_assistant.runner.execution.conducted_steps import (
    GRAPH,
    RUNNER,
    GoOn,
    Leading,
    LeftOpen,
    RestNews,
    Silences,
    StallWatch,
    Step,
    Word,
    outcome_shown,
    piece_to_send,
    seen_inside,
    seen_of,
)
from action_assistant.runner.execution.leading_engine import LeadingEngine
from action_assistant.runner.execution.led_gate import LedGate
from action_assistant.runner.execution.led_look import Cleared, LedLook, NotAllowed
from action_assistant.runner.execution.open_runs import OpenRuns
from action_assistant.runner.execution.own_steps import OwnSteps
from action_assistant.runner.execution.piece_values import PieceValues, returned_of
from action_assistant.runner.execution.played_steps import PlayedSteps
from action_assistant.runner.execution.run_loop import OpenRun, PieceHooks
from action_assistant.runner.links.listeners import Listeners
from action_assistant.runner.links.observations import (
    ACTIVE,
    TERMINAL,
    Exact,
    GraphResult,
    GraphState,
    NodeResult,
    NodeState,
    Snapshot,
)
from action_assistant.runner.links.port import (
    SIMULATOR,
    Answer,
    CallBegan,
    CallPlayed,
    CallStopped,
    Leaves,
    NoAnswer,
    NotSent,
    Order,
    Report,
    Standing,
    Transitions,
    unwatched,
)
from action_assistant.runner.links.simulator import LeadableLink
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import (
    AlarmRaised,
    Author,
    PieceBegan,
    PieceEnded,
    Requested,
    RunEvent,
)
from action_assistant.runner.runs.recorder import RunRecorder
from action_assistant.runner.runs.run import Run
from action_assistant.runner.start.idempotency import IdempotentStarts
from action_assistant.runner.start.piece_texts import PieceText
from action_assistant.umrf.model import Precondition
from action_assistant.web.auth.identity import Identity

log: Final = logging.getLogger(__name__)

_STORED_S: Final = 5  # for which a piece waits for the journal; later it needs a person
_UNSET_S: Final = 1.0  # a piece whose action has ended and whose graph goes on lacks an output
_FOREIGN: Final = frozenset(
    {f"foreign_{what}" for what in ("start", "stop", "pause", "modify", "other")}
)


class Conductor:
    """Leads a led run. To that run it is the link to one engine.
    `first`: the first event of the run; `texts`: the pieces by full name of their action; `engine`
    plays the whole graph, and `make_engine` makes another one if it fails; `left`: how far an
    earlier process led the run; `lead`: for whom it is led, None until somebody lets it go on after a
    restart."""

    simulated: Final = False
    pauses: Final = False

    def __init__(
        self,
        first: Requested,
        texts: Mapping[str, PieceText],
        engine: LeadableLink,
        *,
        make_engine: Callable[[], LeadableLink],
        robots: Robots,
        look: LedLook,
        runs: OpenRuns,
        claims: IdempotentStarts,
        clock_us: ClockUs,
        left: "LeftOpen | None" = None,
        lead: Identity | None = None,
    ) -> None:
        assert first.led is not None
        self._first = first
        self._led = first.led
        self._texts = texts
        self._values = PieceValues(texts, first.led.keeping)
        self._robots = robots
        self._look = look
        self._runs = runs
        self._claims = claims
        self._clock_us = clock_us
        self.gate: Final = LedGate(first, lead, robots, look, clock_us, self._tell)
        if left is not None:
            self.gate.take_up(left)
        self._engine = LeadingEngine(
            first,
            engine,
            make_engine,
            clock_us,
            hold=self.gate.hold_run,
            give_up=self._give_up,
            left=left,
        )
        self._played = PlayedSteps(first, self.gate, self._engine, self._tell, clock_us, left)
        shown = self._show_begun
        self.asked = AskedSteps(first, self.gate, shown, self._tell, clock_us, left)
        self._leading: Leading | None = None
        self._steps: dict[int, Step] = {}
        self._turns = {name: anyio.Lock() for name in self._led.robots.values()}
        self._pieces = left.sent if left is not None else 0
        self._left_pieces = dict(left.pieces) if left is not None else {}
        self._subscribers = Listeners[Report]()
        self._tasks: TaskGroup | None = None
        self._waiting: list[Exact] = []  # the end of the graph, while pieces are open
        self._state = "UNINITIALIZED"  # of the graph, as it was reported
        #: The states of the actions that robots play.
        self._states = dict[str, str]()
        self._others = dict[str, str]()  # those of the other actions, as they were reported
        for name, state in left.states.items() if left is not None else ():
            (self._states if name in self._led.players else self._others)[name] = state
        self._unproven = left.unproven if left is not None else None  # rests by what was seen
        self._stopped_by = GRAPH
        self._again: dict[str, OpenRun] = {}  # pieces that had ended and move again
        self._stalls = StallWatch(clock_us)
        self._own = OwnSteps(
            self.gate,
            self._played,
            self.asked,
            self._stalls,
            self._has_stored_causes,
            lambda step: self._steps.pop(step.call.number, None),
            self._pass_on,
            lambda step: self._finish(step, "on_stopped", "unsent"),
            clock_us,
        )
        self._silences = Silences(robots)
        self._unstored: set[RunRecorder] = set()  # of pieces that have ended
        self._rests = RestNews(lambda event: self._run.tell(event), clock_us)

    def leads(self, leading: Leading) -> None:
        """Set the callbacks that record events. Call this once, before the run is driven."""
        self._leading = leading
        self.gate.stop_run = lambda: leading.stop(RUNNER)
        self._engine.listen(self._hear)

    # --- the link -----------------------------------------------------------------------------

    @property
    def standing(self) -> Standing:
        """The condition of the engine. Its incarnation is the id of the run, as engines change."""
        return self._engine.standing

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """Start the whole graph. `leaves` is called right before that. Raise EngineRefused if the
        engine that plays it refuses it, NotSent or NoAnswer if it cannot be started."""
        await self._engine.start(order, leaves)

    async def stop(self, graph_name: str) -> None:
        """Stop the whole graph. Nothing begins any more, and every piece gets a Stop that is repeated
        until it is proven."""
        self._stop_pieces(self._stopped_by, is_press=False)
        await self._engine.stop(graph_name)

    def close(self, author: Author) -> None:
        """Let nothing begin any more, and begin to stop every piece; never wait."""
        self._stopped_by = author
        self._stop_pieces(author, is_press=True)

    def _stop_pieces(self, author: Author, *, is_press: bool) -> None:
        """Let no piece begin any more, and begin to stop the open ones. One that is being stopped
        already is stopped again only if a person pressed Stop (`is_press`)."""
        self.gate.close()
        for step in self._steps.values():
            step.end()
        self.asked.stop()
        for piece in (*(step.piece for step in self._steps.values()), *self._again.values()):
            if piece and piece.run.end is None and (is_press or piece.run.desired != "stopped"):
                piece.stop(author, "")

    async def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise NotSent("a led run is held, not paused, and its graph cannot be changed")

    pause = resume = modify = _refuse

    async def get(self) -> Answer:
        """Return the whole graph with the states that the robots showed for its actions. Raise
        NoAnswer while its engine has ended and no other one has taken its place."""
        if self._engine.is_past_help:
            return self._answer_without_engine()
        answer = await self._engine.get()
        return msgspec.structs.replace(
            answer,
            incarnation=self._first.run,
            graphs=tuple(self._as_shown(each) for each in answer.graphs),
        )

    def _answer_without_engine(self) -> Answer:
        """Return the whole graph without an engine: stopped when no piece is or becomes open."""
        at, is_over = self._clock_us(), self.gate.is_final and not self._is_going
        ended = {name: state for name, state in self._others.items() if state not in ACTIVE}
        nodes = dict.fromkeys(self._first.actions, "UNINITIALIZED") | ended | self._states
        if is_over and self._unproven is not None:
            self._run.rests(self._unproven)
        state = self._state if self._state in TERMINAL else "STOPPED" if is_over else "RUNNING"
        shown = Snapshot(at, self._first.graph_name, state, nodes, asked_at=at, run=self._first.run)
        return Answer(asked_at=at, at=at, incarnation=self._first.run, graphs=(shown,))

    def _as_shown(self, graph: Snapshot) -> Snapshot:
        state = self._state if self._is_going and graph.state in TERMINAL else graph.state
        nodes = {name: self._state_of(graph.graph, name, own) for name, own in graph.nodes.items()}
        return msgspec.structs.replace(graph, state=state, nodes=nodes)

    def _state_of(self, graph: str, node: str, own: str) -> str:
        """Return the state of an action as people are shown it. `own`: as the engine has it."""
        if graph != self._first.graph_name:  # inside of an action that the simulator plays
            return own
        if node in self._led.players:
            return self._states.get(node, "UNINITIALIZED")
        shown = self._others.get(node, "UNINITIALIZED")
        self._others[node] = self._played.state(node, own, shown)
        return self._others[node]

    async def run(self) -> None:
        """Send the pieces, and pass their outcomes to the engine, until cancelled."""
        async with anyio.create_task_group() as tasks:
            self._tasks = tasks
            tasks.start_soon(self._engine.run)
            for step in self._steps.values():  # begun before this task
                tasks.start_soon(self._lead, step)
            tasks.start_soon(self._stalls.run, self.gate.hold_run)

    def listen(self, hear: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Return a context during which `hear` is called with every change of the whole graph."""
        return self._subscribers.listening(hear)

    async def aclose(self) -> None:
        """End the engine of the whole graph. Pieces that are still open go on as runs."""
        await self._engine.aclose()

    # --- the engine of the whole graph --------------------------------------------------------

    def _hear(self, report: Report) -> None:
        match report:
            case CallBegan(call=call) if call.number not in self._steps:
                asked = self.asked.actions.get(call.node)
                other = SIMULATOR if asked is None else asked.by
                robot = self._led.players.get(call.node, other)
                step = self._steps[call.number] = Step(call, robot)
                if self._tasks is not None:
                    self._tasks.start_soon(self._lead, step)
            case CallStopped(number=number) if number in self._steps:
                self._end_step(self._steps[number], GRAPH)
            case Transitions(run=run, changes=changes):
                self._show(run, changes)
            case CallPlayed():
                self._played.end(report)
            case _:
                return

    def _give_up(self) -> None:
        text = "What leads this run has failed too often, and is not begun again: stop the run."
        self._alarm("led_failed", text)

    def _show(self, run: str, changes: tuple[Exact, ...]) -> None:
        """Pass on what the engine of the whole graph reports, except for states of actions that
        robots carry out, or that wait. If `changes` end the graph, stop the open pieces."""
        shown: list[Exact] = []
        for each in changes:
            is_robots = (
                isinstance(each, NodeState | NodeResult)
                and each.graph == self._first.graph_name
                and each.node in self._led.players
            )
            if not is_robots and self._played.shows(each):
                shown.append(each)
                if isinstance(each, NodeState) and each.graph == self._first.graph_name:
                    self._others[each.node] = each.state
        self._waiting += shown
        self._show_what_may_be(run)
        if self._ends(self._waiting) and not self.gate.is_final:  # nothing may go on
            for step in self._steps.values():
                self._end_step(step, GRAPH)

    @staticmethod
    def _ends(changes: list[Exact]) -> bool:
        return any(isinstance(each, GraphState) and each.state in TERMINAL for each in changes)

    def _show_what_may_be(self, run: str) -> None:
        """Report the waiting changes. Those from the end of the graph wait for all open pieces."""
        ready: list[Exact] = []
        while self._waiting:
            first = self._waiting[0]
            is_end = isinstance(first, GraphResult) or self._ends([first])
            if is_end and self._is_going:
                break
            if is_end and self.gate.is_final and self._unproven is not None:
                self._run.rests(self._unproven)
            ready.append(self._waiting.pop(0))
            if isinstance(first, GraphState) and first.graph == self._first.graph_name:
                self._state = first.state
        if ready:
            self._subscribers.tell(Transitions(run=run, changes=tuple(ready)))

    @property
    def _is_going(self) -> bool:
        moving = any(piece.run.end is None for piece in self._again.values())
        return moving or any(step.is_going for step in self._steps.values())

    # --- one step -----------------------------------------------------------------------------

    async def _lead(self, step: Step) -> None:
        """Lead one step to its outcome: send its piece when its robot is free, and wait for the end. One
        that the simulator plays is led until it begins."""
        self._take_up_piece(step)
        try:
            if step.node not in self._led.players:
                await self._own.lead(step)
                return
            async with anyio.Lock() if self._led.together else self._turns[step.engine]:
                await self._lead_in_turn(step)
        except Exception as error:  # the other steps go on; nothing further begins
            log.exception("run %s: %s cannot be led", self._first.run, step.node)
            self.gate.hold_run(f"The runner has a fault at {step.node}: {error!r}")
        step.is_led = False
        self._show_what_may_be(self._first.run)

    def _show_begun(self, step: Step) -> None:
        """Show people that a step which people answer, or for which the runner waits, has begun."""
        if (began := self._played.begin_asked(step)) is not None:
            self._others[step.node] = began.state
            self._subscribers.tell(Transitions(run=self._first.run, changes=(began,)))

    async def _lead_in_turn(self, step: Step) -> None:
        while True:
            while step.run is None and not step.is_stopped:
                with step.waiting():
                    await self._hand_over(step)
            if step.run is None:
                await self._finish(step, "on_stopped", "unsent")
                return
            async with anyio.create_task_group() as watching:
                watching.start_soon(self._end_without_output, step)
                await step.over.wait()
                watching.cancel_scope.cancel()
            outcome = self._outcome(step)
            if outcome is not None:
                is_shown = step.run.at_rest is None
                await self._finish(step, outcome, "shape" if is_shown else "word")
                return
            if not step.has_not_left:  # a Stop or the word of a person ends it
                await step.decided.wait()
                if step.word is not None:
                    await self._finish(step, step.word.outcome, "word")
                else:
                    await self._finish(step, "on_stopped", "word")
                return
            step.renew()  # nothing has left: a person may let it go on

    async def _hand_over(self, step: Step) -> None:
        """Send the piece of a step once the gate is open, if its robot may begin it; otherwise hold
        or stop the run, as the starter chose."""
        await self.gate.admit(step)
        began = anyio.current_time()
        if not await self._has_stored_causes(step):
            return
        robot = self._robots.reachable(step.engine)
        try:
            self.gate.hold_to_limits(step, self._texts[step.node])
            cleared = await self._look.before_piece(
                robot, self._first, self.gate.person, self.gate.claim
            )
        except NotSent:
            return
        except NotAllowed as why:  # whatever the starter has chosen, this stops nothing
            if not self.gate.is_waiting:
                self.gate.hold_run(str(why))
            return
        except NoAnswer as why:
            self._trouble(step, "silent", f"{step.engine} was not given {step.node}: {why}", began)
            return
        with anyio.CancelScope(shield=True):
            self._pieces += 1
            piece, at = f"{self._first.run}.{self._pieces}", self._clock_us()
            text, umrf = self._texts[step.node], self._values.text(step, piece)
            requested, order = piece_to_send(self._first, step, piece, text, umrf, at)
            try:
                run = await self._claims.store(requested)
            except Refused as refused:
                self._trouble(step, "unstored", refused.detail)
                return
            hooks = PieceHooks(
                changed=lambda piece: self._piece_changed(step, piece),
                may_leave=lambda: self._may_leave(step, cleared),
            )
            step.piece = self._runs.open(run, robot, owns_link=False, seq=1, piece=hooks)
            step.run = run
            at = self._clock_us()
            self._run.tell(
                PieceBegan(
                    at=at, call=step.call.number, node=step.node, engine=step.engine, piece=run.id
                )
            )
            if step.is_stopped:
                step.piece.stop(self._stopped_by, "")
            self._runs.drive(step.piece, order, cleared.life)

    async def _has_stored_causes(self, step: Step) -> bool:
        """Wait until everything that a step follows from is in the journal, and return whether it is.
        If not, act as the starter chose."""
        began = anyio.current_time()
        try:
            with anyio.fail_after(_STORED_S):
                await self._run.stored()
                for recorder in tuple(self._unstored):
                    await recorder.flushed()
                    self._unstored.discard(recorder)
        except TimeoutError:
            self._trouble(step, "unstored", f"Nothing could be stored for {_STORED_S} s.", began)
            return False
        return True

    def _take_up_piece(self, step: Step) -> None:
        """Follow the piece that an earlier process has sent for a step, if there is one."""
        found = self._left_pieces.pop(step.call.number, None)
        if found is None:
            return
        run, seq = found
        if run.end is not None:
            self._run_changed(step, run)
            return
        hooks = PieceHooks(
            changed=lambda piece: self._piece_changed(step, piece), may_leave=unwatched
        )
        link = self._robots.link(step.engine)
        step.piece = self._runs.open(run, link, owns_link=False, seq=seq, piece=hooks)
        self._run_changed(step, run)
        if step.is_stopped:
            step.piece.stop(self._stopped_by, "")
        self._runs.drive(step.piece)

    def _may_leave(self, step: Step, cleared: Cleared) -> None:
        """Raise NotSent if a piece that is about to leave may not begin. The call does not wait."""
        if self.gate.is_open and (why := self.gate.why_not_allowed(step.engine)):
            self.gate.hold_run(why)
        self.gate.halt_before(step)
        if self.gate.is_open and (why := self.asked.why_too_old(step.engine)):
            self.gate.hold_run(why)
        if not self.gate.lets(step) or step.is_stopped:
            step.was_held_back = True
            raise NotSent("the run was held or stopped before it left")
        if self._stalls.stands_still:
            raise NotSent("the runner stood still before it left")
        cleared.require_still()
        self.gate.hold_to_limits(step, self._texts[step.node])

    def _piece_changed(self, step: Step, piece: OpenRun) -> None:
        """Record what a robot shows of the piece of a step, and act on its end and on faults."""
        if step.piece is not piece:  # it had not left, and another one was sent
            return
        if step.over.is_set() and piece.run.end is None:
            self.moves_again(piece)
        if piece.run.end is not None and not step.over.is_set():
            self._unstored.add(piece.recorder)
        self._run_changed(step, piece.run)

    def _run_changed(self, step: Step, run: Run) -> None:
        step.run, action = run, run.actions[step.node]
        # Where a person has seen rest, the last state that the robot showed may be one of motion.
        unseen = run.end is not None and action.state in ACTIVE
        state = "ERROR" if unseen else action.state
        if action is not step.shown or state != self._states.get(step.node):
            step.shown = action
            self._states[step.node] = state
            self._run.tell(seen_of(step, action, state, self._clock_us()))
        self._rests.show(run)
        if run.incarnation is not None:
            self.gate.passed(step)
        for event in seen_inside(step, self._first.graph_name, self._clock_us()):
            self._run.tell(event)
        if run.end is None:
            self._find_trouble(step, run)
            if step.has_rested:
                step.rested.set()
            return
        step.over.set()
        self._note_end(run)

    def _tell(self, event: RunEvent, author: str = "", /) -> None:
        self._run.tell(event, author)

    def _note_end(self, piece: Run) -> None:
        """Report the end of the whole graph if that waited for the end of this piece."""
        self._unproven = piece if piece.at_rest is not None else self._unproven
        self._show_what_may_be(self._first.run)

    def _find_trouble(self, step: Step, run: Run) -> None:
        where = f"{step.node} on {step.engine}"
        if run.unknown_since is not None:
            self._trouble(step, "silent", f"{where}: the robot does not answer.")
        else:
            step.troubles.discard("silent")
        if run.lost or run.unconfirmed:
            self._trouble(step, "lost", f"{where}: {run.lost or run.unconfirmed}")
        for alarm in run.alarms:
            if (alarm.code, alarm.text) in step.alarms:
                continue
            step.alarms.add((alarm.code, alarm.text))
            if alarm.code in _FOREIGN:
                self._trouble(step, alarm.code, f"{where}: {alarm.text}")
            else:
                self._alarm(alarm.code, f"{where}: {alarm.text}")

    async def _end_without_output(self, step: Step) -> None:
        """Wait until the action of a step has ended though its piece goes on, then stop the piece."""
        while True:
            await step.rested.wait()
            if not self._values.tells_false_by_rest(step):
                await anyio.sleep(_UNSET_S)
            if step.piece is not None and step.has_rested:
                step.lacks_output = not step.is_stopped
                step.piece.stop(GRAPH, "")
                return
            step.rested = anyio.Event()

    def _outcome(self, step: Step) -> Precondition | None:
        """Return the outcome of the ended piece of a step. Return None, after raising an alarm or
        acting as the starter chose, if its states show no outcome or it was refused."""
        assert step.run is not None
        run = step.run
        outcome = outcome_shown(run, self._texts[step.node])
        if step.is_stopped:
            return outcome or "on_stopped"
        where = f"{step.node} on {step.engine}"
        if run.end == "refused":
            step.has_not_left = True
            if self.gate.is_open and not (step.was_held_back or self._stalls.stands_still):
                self._trouble(step, "refused", f"{where} was not begun: {run.detail}")
            return None
        if outcome == "on_stopped" and step.lacks_output:
            outcome = "on_false" if self._values.tells_false_by_rest(step) else "on_true"
        if outcome is None or outcome == "on_stopped":
            ended = f"{where} has ended without an outcome: {run.state}. {run.detail}"
            self._trouble(step, "ended", ended.rstrip())
            if not step.is_stopped:
                self._rests.show(run, asks=True)
        elif why := self._values.why_unknown(step):
            self._trouble(step, "ended", f"What {where} has given is not known: {why}.")
            self._rests.show(run, asks=True)
        else:
            return outcome
        return None

    async def _finish(
        self, step: Step, outcome: Precondition, how: Literal["shape", "word", "unsent"]
    ) -> None:
        """Record the outcome of a step, and pass it to the engine. `how`: it was told by states of
        the robot ("shape"), by a person ("word"), or no piece was sent ("unsent")."""
        told = self._values.ended(step, outcome, how, self._clock_us())
        await self._pass_on(step, told)

    async def _pass_on(self, step: Step, told: PieceEnded) -> None:
        self._steps.pop(step.call.number, None)
        self.gate.passed(step)
        step.tell_end(self._run.tell, told)
        if lacking := self._values.lacking(told):
            self._alarm("led_unset", f"{step.node} on {step.engine} {lacking}")
        returned = returned_of(told)
        self.gate.halt_after(step, told.outcome, returned.outputs)
        if self.gate.is_final and told.outcome == "on_stopped":
            # Else the engine could take the end of its last action for the end of the graph.
            await self._engine.stop_first(self._first.graph_name)
        await self._engine.returned(returned)

    def _end_step(self, step: Step, author: Author) -> None:
        """Begin to stop the piece of a step in the name of `author`, or never send it."""
        if step.is_stopped:
            return
        step.end()
        if step.is_open and step.piece is not None:
            step.piece.stop(author, "")

    # --- trouble ------------------------------------------------------------------------------

    def _trouble(self, step: Step, code: str, why: str, since: float = inf) -> None:
        """Report a fault of a step once, and act as the starter chose. Do nothing if the runner
        stood still after `since` (seconds of the event loop). A silence is one of the robot."""
        if code in step.troubles or step.is_stopped or self._stalls.stood_still_since(since):
            return
        step.troubles.add(code)
        if code == "silent" and self._silences.is_told(step.engine):
            code = ""
        self._act_on(why, code and f"led_{code}")

    def _act_on(self, why: str, code: str) -> None:
        if code:
            self._alarm(code, why)
        if self._led.lost == "stop":
            self._run.stop(RUNNER)
        else:
            self.gate.hold_run(why)

    def _alarm(self, code: str, text: str) -> None:
        self._run.tell(AlarmRaised(self._clock_us(), code, text))

    # --- the gate -----------------------------------------------------------------------------

    async def go_on(self, press: GoOn) -> None:
        """Let a held run go on, once every robot that has a step of it has answered. Raise Conflict if
        no engine leads the run, and as `LedGate.go_on` does."""
        self._engine.require()
        names = {step.engine for step in self._steps.values() if not step.over.is_set()}
        names &= self.gate.robots
        names |= {piece.run.engine for piece in self._again.values() if piece.run.end is None}
        await self.gate.go_on(press, names)
        for step in self._steps.values():
            step.troubles &= {"ended"}

    def give_word(self, node: str, word: Word) -> anyio.Event:
        """Take the outcome of an action (`node`) that a person states; return an event that is set
        once the run has it. Raise Conflict if the action waits for none, or as `Step.take_word`."""
        step = next((each for each in self._steps.values() if each.node == node), None)
        if step is None or step.run is None:
            raise Conflict(f"{node} waits for no outcome.", where={"path": "/action"})
        step.take_word(word)
        return step.told

    def moves_again(self, piece: OpenRun) -> None:
        """Follow a piece that had ended and moves again, until it has ended: raise an alarm, and
        hold or stop the run, as the starter chose."""
        again = piece.run
        for step in self._steps.values():  # it may still wait for the word of a person
            if step.run is not None and step.run.id == again.id:
                step.piece, step.run = piece, again
        if again.id in self._again or again.end is None:
            self._rests.show(again)
        if again.end is not None:
            if again.id in self._again:
                self._note_end(again)
            return
        is_known, self._again[again.id] = again.id in self._again, piece
        if self.gate.is_final and again.desired != "stopped":
            piece.stop(self._stopped_by, "")
        if not is_known:
            self._act_on(f"{again.graph_name} moves again on {again.engine}.", "moves_again")

    @property
    def _run(self) -> Leading:
        assert self._leading is not None
        return self._leading
