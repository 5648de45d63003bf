"""A run that is not over: starts it, watches it, and stops it until that is proven.

What the engine says goes one way: the link gives a message or an answer, the monitor returns the changes
that follow from it (`Monitor`), they are folded into the run, stored, and shown to everybody. One task
listens, one asks, one stops, one writes. None of them waits for another: a stop leaves while a get hangs,
and everything goes on while the journal is down.
"""

import logging
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Final

import anyio
import msgspec

from action_assistant.errors import OutcomeUnknown, Refused
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.execution.monitor import STOOD_S, Job, Monitor
from action_assistant.runner.execution.run_changes import RunChanges
from action_assistant.runner.links.engine_process import has_ended
from action_assistant.runner.links.engine_text import run_in
from action_assistant.runner.links.port import (
    EngineChanged,
    EngineLog,
    EngineRefused,
    Feedback,
    ForeignCommand,
    Leaves,
    Link,
    NoAnswer,
    NotSent,
    Order,
    Report,
    Transitions,
    graph_outline,
    unwatched,
)
from action_assistant.runner.robots.robot_events import alarm_of
from action_assistant.runner.runs.events import (
    AtRest,
    Author,
    End,
    Ended,
    EngineSaid,
    ModifyRefused,
    ModifyRequested,
    MovesAgain,
    PauseRequested,
    Published,
    ResumeRequested,
    RunEvent,
    Silent,
    StopSent,
)
from action_assistant.runner.runs.fold import follow
from action_assistant.runner.runs.history import newest_sent_text
from action_assistant.runner.runs.recorder import RunRecorder, Store
from action_assistant.runner.runs.run import Run
from action_assistant.runner.stop.doubtful_errors import DoubtfulErrors
from action_assistant.runner.stop.loading import LoadingTimes
from action_assistant.runner.stop.proof import SET_GOING, send_stop
from action_assistant.runner.stop.stop_loop import StopLoop
from action_assistant.umrf.limits import NO_LIMITS, Limits
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_HAND_OVER_S: Final = 5.0
_UNCONFIRMED_S: Final = 2.0
_SWITCH_OFF_S: Final = 10.0  # a simulated engine that does not obey harms no one
_GET_S: Final = 1.0  # an engine that is not busy answers within milliseconds
_NO_TURN: Final = (
    "It was not sent: its turn among the starts on its domain did not come within 5 seconds."
)
_STOPPED_BEFORE: Final = "Stopped before anything was sent."
_LINES: Final = 2_000  # of the engine's log, kept with one run
_LONGEST_LINE: Final = 2_000  # characters


class _HeldBack(NotSent):
    """A Stop was pressed before the start message left."""


class PieceHooks(msgspec.Struct, frozen=True, kw_only=True):
    """The tie of a piece to its led run. `changed` is called after each change of the piece;
    `may_leave` right before its start message leaves, and raises NotSent if it may not leave any
    more."""

    changed: "Callable[[OpenRun], None]"
    may_leave: Callable[[], None]


class OpenRun:
    """Drives a run that is not over: sends its start and its stops, asks its engine, and stores its
    events. `changed` is called after every visible change, and must not change a run."""

    def __init__(
        self,
        run: Run,
        *,
        link: Link,
        owns_link: bool,
        store: Store,
        seq: int,
        clock_us: ClockUs,
        run_in_worker: RunInWorker,
        changed: "Callable[[OpenRun], None]",
        loading_times: LoadingTimes | None = None,
        piece: PieceHooks | None = None,
        pressed: Callable[[Author], None] | None = None,
        may_leave: Leaves = unwatched,
    ) -> None:
        self.run = run
        self._piece = piece
        self._may_leave = may_leave
        self._pressed = pressed
        self.revision = 0
        self.published = anyio.Event()
        self._store = store
        self.recorder = RunRecorder(store, run.id, seq, self._touch)
        self._link = link
        self._owns_link = owns_link
        self._clock_us = clock_us
        self._run_in_worker = run_in_worker
        self._doubts = DoubtfulErrors(
            reached=seq > 1 and not owns_link
        )  # what a stop reached before is not known
        self._loading_times = loading_times or LoadingTimes()
        self.watch = self._watched()
        self._asks = anyio.Event()
        self._lines = 0
        self._sent_at: int | None = None  # when its start left; None: an earlier process sent it
        self._changed = changed
        self._over = anyio.Event()
        self._again = anyio.Event()
        self._is_left = False
        self._handing = anyio.CancelScope()  # while the start is handed over
        self._stopping = StopLoop(run, clock_us)
        self._early: list[Report] = []

    @property
    def is_led(self) -> bool:
        """True for a piece that a conductor leads: people are shown its run instead."""
        return self._piece is not None

    # --- what people want ---------------------------------------------------------------------

    def stop(self, author: Author, stop_id: str) -> None:
        """Record that `author` wants the run stopped, and send stop messages until the run has
        ended. The call never waits. If it fails by a fault of the runner, stops are sent all the
        same, and each of them also stops the pieces that this call has not stopped. `stop_id`: the
        id of the press, by which a repeated press is recognised."""
        pressed = self._stopping.press(author, stop_id)
        self._handing.cancel()
        try:
            if self._pressed is not None:
                self._pressed(author)
            else:
                self._doubts.reach()
        finally:
            if pressed:
                self.tell(pressed, author.id)

    @property
    def failed(self) -> frozenset[tuple[str, str]]:
        """The actions that the engine shows in ERROR, as pairs of the graph's running name and the
        full name."""
        return self._doubts.places

    async def pause(self, author: Author) -> None:
        """Record that `author` wants the run paused, and send that to the engine. Do not wait for
        its effect. Raise NotSent if the message could not be sent."""
        self._doubts.reach()
        self.tell(PauseRequested(self._clock_us(), author), author.id)
        await self._link.pause(self.run.graph_name)
        self.look()

    async def resume(
        self, author: Author, watching: tuple[str, ...] = (), may_leave: Leaves = unwatched
    ) -> None:
        """Send the engine that the run goes on, and record in the moment in which that leaves that
        `author` wants it. `watching`: the robots that they watch; `may_leave`: raises NotSent if the
        message may not leave any more. Do not wait for its effect. Raise NotSent if the message could
        not be sent."""
        check = self._unless_stopped(may_leave)

        def leave() -> None:
            check()
            self.tell(ResumeRequested(self._clock_us(), author, watching), author.id)

        await self._link.resume(self.run.graph_name, leaves=leave)
        self.look()

    async def modify(
        self,
        author: Author,
        order: Order,
        version: str,
        digest: str,
        continue_from: str,
        watching: tuple[str, ...] = (),
        limits: Limits = NO_LIMITS,
        may_leave: Leaves = unwatched,
    ) -> None:
        """Record that `author` gave the run another graph, and send it (`order`) to the engine.
        `version` and `digest`: the version and digest of the new graph; `continue_from`: the full
        name of an action to start then, "" for none; `watching`: the robots that they watch;
        `limits`: the limits in force on the robot; `may_leave`: as for `resume`. Raise NotSent if it
        could not be sent,
        EngineRefused if the engine refuses it, and OutcomeUnknown if it cannot be known whether the
        engine runs it."""
        asked = ModifyRequested(
            at=self._clock_us(),
            author=author,
            version=version,
            digest=digest,
            actions=graph_outline(order.graph).actions,
            umrf=order.umrf,
            continue_from=continue_from,
            watching=watching,
            limits=dict(limits),
        )
        self._doubts.reach()
        before = self.run
        self.tell(asked, author.id)
        try:
            await self._link.modify(order, continue_from, self._unless_stopped(may_leave))
        except (NotSent, EngineRefused) as why:
            self.tell(
                ModifyRefused(
                    at=self._clock_us(),
                    version=before.version,
                    digest=before.digest,
                    actions={name: action.aid for name, action in before.actions.items()},
                    why=str(why),
                    limits=before.limits,
                )
            )
            raise
        except Exception as error:  # also a deadline: the message may have left
            log.exception("run %s: the change may or may not have left", before.id)
            text = f"Nobody knows whether the graph was changed on {before.engine}: {error!r}"
            self.alarm("modify_unknown", text)
            self._compare_change(order, continue_from)
            raise OutcomeUnknown(text) from error
        self._compare_change(order, continue_from)

    def _unless_stopped(self, may_leave: Leaves) -> Leaves:
        """Return the check of a message that lets the run go on, right before it leaves: it raises
        NotSent if a Stop was pressed by now, or as `may_leave` does."""

        def leave() -> None:
            if self.run.desired == "stopped":
                raise NotSent("The run is being stopped.")
            may_leave()

        return leave

    def _compare_change(self, order: Order, continue_from: str) -> None:
        """Have the next answer of the engine compared with a changed graph (`order`) that was or
        may have been sent. `continue_from`: the action that is started with it, "" for none."""
        self.watch.sends(order.umrf, beside=bool(continue_from))
        self.look()

    @property
    def pauses(self) -> bool:
        """True if pausing is safe on the engine of the run."""
        return self._link.pauses

    def hear_of(self, command: ForeignCommand) -> None:
        """Process a command that another program has sent to the robot of this run: later proofs
        allow for it, and people get an alarm if it concerns the run."""
        if self._is_ours(command.graph):
            self._doubts.reach()
        if command.command in SET_GOING and command.graph == self.run.graph_name:
            ours = command.command != "start" or run_in(command.umrf) == self.run.id
            self.watch.disturbed(meddles=ours)
        if command.command == "start":
            self.watch.started_by_others()
        alarm = alarm_of(command, self.run.engine, self.run.graph_name)
        if alarm is not None:
            self.alarm(*alarm)
            self.look()

    # --- what happens -------------------------------------------------------------------------

    def tell(self, event: RunEvent, author: str = "") -> None:
        """Show an event to people at once, and store it as soon as the journal can. `author`: the
        id of a person, "" for the engine."""
        with self._changing() as changes:
            changes.tell(event, author)

    @contextmanager
    def _changing(self) -> Iterator[RunChanges]:
        """Return a context whose value collects changes of the run; they are applied at its end,
        also after an exception in it."""
        changes = RunChanges(self.run, self._clock_us)
        try:
            yield changes
        finally:
            self._apply(changes)

    def _apply(self, changes: RunChanges) -> None:
        """Apply and store changes that were derived from the present state of the run."""
        known = self.run
        for event, author, after in changes:
            # An earlier watcher of this change may have stopped the run: that is kept.
            self.run = known = after if self.run is known else follow(self.run, event)
            self.recorder.put(event, author or self.run.engine)
            if self.run.end is not None:
                self._over.set()
            if isinstance(event, Ended) and self._sent_at is not None:
                self._loading_times.learn(self.run, self._sent_at)
                self._sent_at = None
            self._stopping.notice(self.run)
            self._touch()

    def _touch(self) -> None:
        self.revision += 1
        if self._piece is not None:
            self._piece.changed(self)
        self._changed(self)

    async def drive(self, order: Order | None, incarnation: str = "") -> None:
        """Drive the run until it is over and stored. With an order, the start message is sent
        first, exactly once, and recorded with `incarnation`, the id of the engine process that was
        checked for it; without one, continue from the present state of the run."""
        async with anyio.create_task_group() as outer:
            outer.start_soon(self.recorder.run)
            if order is None:
                outer.start_soon(self._recall)
            with self._link.listen(self._hear):
                if order is not None:
                    await self._publish(order, incarnation)
                self._let_early_ones_in()
                await self._live()
            if self._owns_link:
                await self._link.aclose()
            while await self._opens_again():
                with self._link.listen(self._hear):
                    await self._live()
            outer.cancel_scope.cancel()

    async def _recall(self) -> None:
        """Give the monitor the graph that an earlier process has sent, in the background: it is
        needed only to name what the run waits for."""
        try:
            umrf = await newest_sent_text(self._store, self.run)
        except (Refused, msgspec.DecodeError):
            log.warning("the graph of run %s cannot be read", self.run.id)
        else:
            if umrf is not None:
                self.watch.recalls(umrf)

    def moves_again(self, event: MovesAgain) -> bool:
        """Reopen the run, which had ended and moves, and return True. Return False, without a
        change, if its end is stored and its task has ended."""
        if self._is_left or self.run.end is None:
            return not self._is_left
        umrf, self.watch = self.watch.umrf, self._watched()
        if umrf is not None:
            self.watch.recalls(umrf)
        self._over = anyio.Event()
        self.tell(event)
        self._again.set()
        return True

    def _watched(self) -> Monitor:
        return Monitor(
            self.run,
            exact=self._owns_link,
            clock_us=self._clock_us,
            doubts=self._doubts,
            loading_times=self._loading_times,
            rested_at=self.run.ended_at,
        )

    async def _opens_again(self) -> bool:
        """Wait until all events of the run are stored, or until the run moves again after its end.
        Return True if the run moves again and must be driven on, False if it can be closed."""
        async with anyio.create_task_group() as tasks:

            async def wait_until_stored() -> None:
                await self.recorder.flushed()
                tasks.cancel_scope.cancel()

            tasks.start_soon(wait_until_stored)
            await self._again.wait()
            tasks.cancel_scope.cancel()
        self._again = anyio.Event()
        self._is_left = self.run.end is not None
        return not self._is_left

    async def _live(self) -> None:
        async with anyio.create_task_group() as tasks:
            if self._owns_link:
                tasks.start_soon(self._steadily, self._link.run)
            tasks.start_soon(self._steadily, self._ask)
            tasks.start_soon(self._steadily, self._send_stops)
            await self._over.wait()
            tasks.cancel_scope.cancel()

    async def _send_stops(self) -> None:
        """Send stop messages from the first press on, again and again, until cancelled. A simulated
        engine that does not obey in time is switched off, and its run ends as lost."""
        async for attempt in self._stopping.attempts():
            failed = await send_stop(self._link, self.run.graph_name)
            if not failed:
                self.watch.stop_left()
            self.tell(StopSent(self._clock_us(), attempt.number, failed))
            self.look()
            waited = anyio.current_time() - attempt.since
            if waited >= _UNCONFIRMED_S:
                why = failed or self.watch.trouble or "no proof has come"
                self.alarm("stop_unconfirmed", f"STOP UNCONFIRMED: {why}.")
            if self.run.simulated and waited >= _SWITCH_OFF_S:
                why = self._stopping.hung or f"It does not obey: {self.watch.trouble}."
                self.end("lost", f"{why} The simulated engine was switched off.")
                return

    def look(self) -> None:
        """Have the engine asked now; the call does not wait for the answer."""
        self._asks.set()

    async def _ask(self) -> None:
        """Ask the engine until cancelled: each second, sooner after news, ten times as often during
        a Stop. Slow jobs run beside it, so that no proof waits for them."""
        async with anyio.create_task_group() as beside:
            wait, has_stood = 0.0, False
            while True:
                began = anyio.current_time()
                with anyio.move_on_after(wait):
                    await self._asks.wait()
                self._asks = anyio.Event()
                look = self.watch.begin_query()
                self.watch.stood_still(max(0.0, look.began - began - wait - STOOD_S))
                answer, why = None, ""
                try:
                    with anyio.fail_after(_GET_S):
                        answer = await self._link.get()
                except (NoAnswer, TimeoutError) as failure:
                    why = str(failure)
                stood = anyio.current_time() - look.began - _GET_S
                if stood > STOOD_S and not has_stood:  # this says nothing of the engine
                    self.watch.stood_still(stood)
                    wait, has_stood = 0.0, True
                    continue
                has_stood = False
                with self._changing() as changes:
                    if answer is None:
                        self.watch.unanswered(changes, self._link.standing, why)
                    else:
                        self.watch.answered(changes, self._link.standing, answer, look)
                        self._stopping.is_held_elsewhere = self.watch.is_elsewhere
                for job in self.watch.take_jobs():
                    beside.start_soon(self._work_on, job)
                if self.run.process is not None and has_ended(self.run.process):
                    with self._changing() as changes:
                        changes.engine_ended()
                cost = anyio.current_time() - look.began
                wait = max(self.watch.pace(self.run), 5 * cost)
                if answer is None and self.run.unknown_since is None:  # known after 3 s, not later
                    wait = max(0.0, self.watch.pace(self.run) - cost)

    async def _work_on(self, job: Job) -> None:
        """Await a job of the monitor, and raise the alarm that it finds. Such jobs only inform
        people, so a job is dropped if no worker is free."""
        try:
            found = await job(self._run_in_worker)
        except Refused as why:
            log.warning("run %s: %s", self.run.id, why.detail)
            return
        if found.text and not (found.only_open and self.run.end is not None):
            self.alarm(found.code, found.text)
        if found.asks:
            self.look()

    async def _steadily(self, work: Callable[[], Awaitable[None]]) -> None:
        """Run `work` until it returns; run it again after each exception, so that a fault ends no
        task."""
        is_reported = False
        while True:
            try:
                await work()
                return
            except Exception as error:
                log.exception("run %s: a task failed and is begun again", self.run.id)
                if not is_reported:
                    self.alarm("internal", f"The runner has a fault: {error!r}")
                    is_reported = True
                await anyio.sleep(0.2)

    async def _publish(self, order: Order, incarnation: str) -> None:
        """Send the start message once; it is never repeated, whatever happens. `incarnation`: the
        id of the engine process that was checked for the start, recorded with it. If the message
        has certainly not left, the run ends as refused or stopped."""
        if self.run.end is not None:  # refused after it was stored
            return
        at = self._clock_us()
        self.watch.starts(order.umrf, self._link.standing.process)
        if self.run.desired == "stopped":
            self.end("stopped", _STOPPED_BEFORE)
            return
        leaving = anyio.Event()

        def leave() -> None:
            """Let the message leave now, unless a Stop has been pressed by now."""
            if self.run.desired == "stopped":
                raise _HeldBack
            self._may_leave()
            if self._piece is not None:
                self._piece.may_leave()
            leaving.set()

        try:
            with anyio.fail_after(_HAND_OVER_S), self._handing:
                await self._link.start(order, leave)
            if self._handing.cancelled_caught and not leaving.is_set():
                raise _HeldBack
            if self._handing.cancelled_caught:
                raise TimeoutError("somebody stopped it while it was handed over")
        except _HeldBack:
            self.end("stopped", _STOPPED_BEFORE)
            return
        except (EngineRefused, NotSent, NoAnswer) as refused:
            self.end("refused", str(refused))
            return
        except Exception as error:  # also a deadline: the message may have left
            if isinstance(error, TimeoutError) and not leaving.is_set():
                self.end("refused", _NO_TURN)
                return
            log.exception("run %s: the start may or may not have left", self.run.id)
            self.tell(self._published(at, incarnation))
            self.tell(
                Silent(self._clock_us(), at, f"Nobody knows whether the start left: {error!r}")
            )
        else:
            self._sent_at = self._clock_us()
            self.tell(self._published(at, incarnation))

    def _published(self, at: int, incarnation: str) -> Published:
        now = self._link.standing
        return Published(at, incarnation, now.process if now.incarnation == incarnation else None)

    def _let_early_ones_in(self) -> None:
        """Process the reports that arrived while the start was sent, so that they follow it in the
        history."""
        self.published.set()
        early, self._early = self._early, []
        for report in early:
            self._hear(report)

    def _hear(self, report: Report) -> None:
        if not self.published.is_set():
            self._early.append(report)
            return
        match report:
            case Transitions(run=run, changes=seen) if run == self.run.id:
                with self._changing() as changes:
                    changes.observe(seen)
            case Feedback(snapshots=snapshots):
                ours = tuple(each for each in snapshots if each.run == self.run.id)
                inside = f"{self.run.graph_name}__"
                others = (each for each in snapshots if each.run is None)
                parts = tuple(each for each in others if each.graph.startswith(inside))
                with self._changing() as heard:
                    self.watch.feed(heard, self._link.standing, ours, parts)
            case EngineLog():
                self._hear_line(report)
            case EngineChanged(state="gone", why=why) if self._owns_link:
                self.alarm("engine_gone", why)  # a simulated engine does not come back
                self.end("lost", why)
            case EngineChanged(state="busy", why=why):
                self._stopping.hung = why
            case _:
                return
        self.look()

    def _hear_line(self, line: EngineLog) -> None:
        if self._is_ours(line.graph) and self._lines < _LINES:
            self._lines += 1
            self.tell(EngineSaid(line.at, line.text[:_LONGEST_LINE], line.level))
        with self._changing() as changes:
            self.watch.hear(changes, line.text)

    def _is_ours(self, graph: str | None) -> bool:
        name = self.run.graph_name
        return graph is None or graph == name or graph.startswith(f"{name}__")

    # --- without a proof ----------------------------------------------------------------------

    def lose(self, why: str) -> None:
        """Record that it is unknown whether the code of the run has ended; `why`: the reason, as a
        sentence."""
        with self._changing() as changes:
            changes.lose(why)

    def confirm_rest(self, author: Author, how: str) -> None:
        """End the run because the person `author` has seen it at rest, where no answer of the
        engine can prove it. `how`: how it was seen."""
        why = self.run.doubt or self.run.lost or self.watch.trouble
        with self._changing() as changes:
            changes.rests(AtRest(author, self._clock_us(), how), "error", why, author.id)

    def rests_as(self, piece: Run) -> None:
        """End the run in the state in which `piece` ended, one of its pieces. Does nothing unless a
        person's statement or the end of the code, not an answer of its robot, showed that piece at
        rest."""
        if piece.at_rest is not None and piece.end is not None and self.run.end is None:
            with self._changing() as changes:
                changes.rests(piece.at_rest, piece.end, f"{piece.engine}: {piece.detail}")

    def end(self, state: End, detail: str) -> None:
        """End the run in this state, unless it has ended already. `detail`: the sentence for
        people."""
        with self._changing() as changes:
            changes.end(state, detail)

    def alarm(self, code: str, text: str) -> None:
        """Raise an alarm for people (its code and its sentence), unless the run has the same one
        already."""
        with self._changing() as changes:
            changes.alarm(code, text)
