"""The loop of a run that is not over: starts it, watches it, and stops it until that is proven.

One task listens, one asks, one stops (`stop_loop`), one writes. None of them waits for another: a stop leaves
while a get hangs, and everything goes on while the journal is down.
"""

import logging
from collections.abc import Awaitable, Callable, Sequence
from typing import Final

import anyio
import msgspec

from action_assistant.errors import Refused
from action_assistant.runner.clock import ClockUs
from action_assistant.runner.execution.graph_change import send_change
from action_assistant.runner.execution.monitor import Monitor
from action_assistant.runner.links.engine_text import run_in
from action_assistant.runner.links.observations import Hazard, Seen
from action_assistant.runner.links.port import (
    EngineChanged,
    EngineLog,
    EngineRefused,
    Feedback,
    ForeignCommand,
    Link,
    NoAnswer,
    NotSent,
    Order,
    Report,
    Transitions,
    graph_outline,
)
from action_assistant.runner.robots.robot_events import alarm_of
from action_assistant.runner.runs.events import (
    AlarmRaised,
    AtRest,
    Author,
    End,
    Ended,
    EngineSaid,
    Loading,
    ModifyRequested,
    MovesAgain,
    Observed,
    PauseRequested,
    Published,
    ResumeRequested,
    RunEvent,
    Silent,
    Unconfirmed,
)
from action_assistant.runner.runs.fold import follow, thin
from action_assistant.runner.runs.history import sent_of
from action_assistant.runner.runs.recorder import RunRecorder, Store
from action_assistant.runner.runs.run import Run
from action_assistant.runner.stop.doubtful_errors import DoubtfulErrors
from action_assistant.runner.stop.loading import LoadingAction, LoadingTimes, in_words
from action_assistant.runner.stop.proof import SET_GOING
from action_assistant.runner.stop.stop_loop import StopLoop
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_TOLD: Final = frozenset({"H7", "H8"})  # the run goes nowhere, and the engine says nothing
_LOOK_AT_IT: Final = "Look at the robot; its hardware stop is the one to use."

_HAND_OVER_S: Final = 5.0
_NO_TURN: Final = (
    "It was not sent: its turn among the starts on its domain did not come within 5 seconds."
)
_LINES: Final = 2_000  # of the engine's log, kept with one run
_LONGEST_LINE: Final = 2_000  # characters

_RESULTS: Final = {"HALTED": "on_halted", "STOPPED": "on_stopped", "ERROR": "on_error"}


class OpenRun:
    """A run that is not over. `changed` is called after every change of what people see."""

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
    ) -> None:
        self.run = run
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
        )  # what came before is not known
        self.watch = self._watched()
        self._lines = 0
        self._loading_told_at = 0.0  # seconds of loading at which that is told again
        self._loading_times = loading_times or LoadingTimes()
        self._sent_at: int | None = None  # when its start left; None: an earlier process sent it
        self._changed = changed
        self._over = anyio.Event()
        self._again = anyio.Event()
        self._is_left = False
        self._handing = anyio.CancelScope()  # while the start is handed over
        self._stopping = StopLoop(self, link, simulated=owns_link, clock_us=clock_us)
        self._early: list[Report] = []

    # --- what people want ---------------------------------------------------------------------

    def stop(self, author: Author, stop_id: str) -> None:
        """Want the run stopped, now and until it is. Never waits, never fails."""
        self._doubts.reach()
        self._stopping.press(author, stop_id)
        self._handing.cancel()

    @property
    def failed(self) -> frozenset[tuple[str, str]]:
        """What its engine calls ERROR, as far as was seen: running names of graphs, and full names."""
        return self._doubts.places

    async def pause(self, author: Author) -> None:
        """Want the run paused. Raises NotSent."""
        self._doubts.reach()
        self.tell(PauseRequested(self._clock_us(), author), author.id)
        await self._link.pause(self.run.graph_name)
        self.watch.look()

    async def resume(self, author: Author) -> None:
        """Want the run to go on. Raises NotSent."""
        self.tell(ResumeRequested(self._clock_us(), author), author.id)
        await self._link.resume(self.run.graph_name)
        self.watch.look()

    async def modify(
        self, author: Author, order: Order, version: str, digest: str, continue_from: str
    ) -> None:
        """Want the run to go on with another graph. Raises NotSent, EngineRefused, and OutcomeUnknown
        when nobody knows whether it does."""
        asked = ModifyRequested(
            at=self._clock_us(),
            author=author,
            version=version,
            digest=digest,
            actions=graph_outline(order.graph).actions,
            umrf=order.umrf,
            continue_from=continue_from,
        )
        self._doubts.reach()
        await send_change(self, self._link, order, asked, self._clock_us)

    @property
    def pauses(self) -> bool:
        """Whether pausing is safe on this engine."""
        return self._link.pauses

    def hear_of(self, command: ForeignCommand) -> None:
        """Somebody else has told this robot something while the run goes on there."""
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
            self.watch.look()

    # --- what happens -------------------------------------------------------------------------

    def tell(self, event: RunEvent, author: str = "") -> None:
        """Show an event to everybody and store it as soon as the journal can."""
        if self.run.end is not None and not isinstance(event, AlarmRaised | MovesAgain):
            return
        self.run = follow(self.run, event)
        self.recorder.put(event, author or self.run.engine)
        if self.run.end is not None:
            self._over.set()
        if isinstance(event, Ended) and self._sent_at is not None:
            self._loading_times.learn(self.run, self._sent_at)
            self._sent_at = None
        self._stopping.notice()
        self._touch()

    def _touch(self) -> None:
        self.revision += 1
        self._changed(self)

    async def drive(self, order: Order | None, incarnation: str = "") -> None:
        """Live through the run until it is over and stored. With an order it is started first,
        exactly once; without one it is taken up where it stands."""
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
        """What an earlier process sent. Nothing waits for it: it only says what the run waits for."""
        try:
            umrf = await sent_of(self._store, self.run)
        except (Refused, msgspec.DecodeError):
            log.warning("the graph of run %s cannot be read", self.run.id)
        else:
            if umrf is not None:
                self.watch.recalls(umrf)

    def moves_again(self, event: MovesAgain) -> bool:
        """It had ended and moves: it is open again. False when it is stored and left already."""
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
        rested_at = self.run.ended_at
        return Monitor(
            self,
            self._link,
            exact=self._owns_link,
            clock_us=self._clock_us,
            run_in_worker=self._run_in_worker,
            doubts=self._doubts,
            rested_at=rested_at,
        )

    async def _opens_again(self) -> bool:
        """Wait until everything is stored, or until it moves before that."""
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
            tasks.start_soon(self._steadily, self.watch.run)
            tasks.start_soon(self._steadily, self._stopping.run)
            await self._over.wait()
            tasks.cancel_scope.cancel()

    async def _steadily(self, work: Callable[[], Awaitable[None]]) -> None:
        """A fault in one of these must neither end the others nor itself."""
        told = False
        while True:
            try:
                await work()
                return
            except Exception as error:
                log.exception("run %s: a task failed and is begun again", self.run.id)
                if not told:
                    self.alarm("internal", f"The runner has a fault: {error!r}")
                    told = True
                await anyio.sleep(0.2)

    async def _publish(self, order: Order, incarnation: str) -> None:
        """Send the one start message. Whatever happens, it is never sent again."""
        if self.run.end is not None:  # refused since it was written down
            return
        at = self._clock_us()
        self.watch.starts(order.umrf)
        if self.run.desired == "stopped":
            self.end("stopped", "Stopped before anything was sent.")
            return
        leaving = anyio.Event()
        try:
            with anyio.fail_after(_HAND_OVER_S), self._handing:
                await self._link.start(order, leaving.set)
            if self._handing.cancelled_caught and not leaving.is_set():
                self.end("stopped", "Stopped before anything was sent.")
                return
            if self._handing.cancelled_caught:
                raise TimeoutError("somebody stopped it while it was handed over")
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
        """What the engine showed while the start was handed over follows it in the history."""
        self.published.set()
        early, self._early = self._early, []
        for report in early:
            self._hear(report)

    def _hear(self, report: Report) -> None:
        if not self.published.is_set():
            self._early.append(report)
            return
        match report:
            case Transitions(run=run, changes=changes) if run == self.run.id:
                self.observe(changes)
            case Feedback(snapshots=snapshots):
                ours = tuple(each for each in snapshots if each.run == self.run.id)
                inside = f"{self.run.graph_name}__"
                others = (each for each in snapshots if each.run is None)
                self.watch.feed(
                    ours, tuple(each for each in others if each.graph.startswith(inside))
                )
            case EngineLog():
                self._hear_line(report)
            case EngineChanged(state="gone", why=why) if self._owns_link:
                self.alarm("engine_gone", why)  # a simulated engine does not come back
                self.end("lost", why)
            case EngineChanged(state="busy", why=why):
                self._stopping.hung = why
            case _:
                return
        self.watch.look()

    def _hear_line(self, line: EngineLog) -> None:
        if self._is_ours(line.graph) and self._lines < _LINES:
            self._lines += 1
            self.tell(EngineSaid(line.at, line.text[:_LONGEST_LINE]))
        self.watch.hear(line.text)

    def _is_ours(self, graph: str | None) -> bool:
        name = self.run.graph_name
        return graph is None or graph == name or graph.startswith(f"{name}__")

    def observe(self, seen: tuple[Seen, ...]) -> None:
        """Show and store what was seen."""
        self.tell(Observed(self._clock_us(), thin(self.run, seen)))
        for item in seen:
            if isinstance(item, Hazard) and (item.effect != "goes on" or item.code in _TOLD):
                place = f" at {item.node}" if item.node else ""
                self.alarm(item.code, f"{item.code}{place}: {item.message or item.effect}")

    # --- without a proof ----------------------------------------------------------------------

    def lose(self, why: str) -> None:
        """The engine does not hold the run any more: whether its code has ended is not known."""
        if self.run.simulated:
            self.end("lost", why)
        elif self.run.lost != why:
            self.tell(Unconfirmed(self._clock_us(), why, lost=True))
            self.alarm("stop_unconfirmed", f"STOP UNCONFIRMED: {why} {_LOOK_AT_IT}")

    def doubt(self, why: str) -> None:
        """The code of an action may go on, and the engine will never tell of its end."""
        self.tell(Unconfirmed(self._clock_us(), why))
        self.alarm("stop_unconfirmed", f"STOP UNCONFIRMED: {why}. {_LOOK_AT_IT}")

    def load(self, actions: Sequence[LoadingAction], waited_s: float) -> None:
        """Nothing moves, but these actions may still be loading, for so long by now; none: that is over.
        How long is told again each time that it has doubled."""
        why, known = in_words(actions), self.run.loading
        if not why and not known:
            return
        is_same = bool(why) and known.startswith(why)
        if is_same and waited_s < self._loading_told_at:
            return
        self._loading_told_at = max(4.0, 2 * waited_s)
        usual = self._loading_times.usual(self.run.engine, actions)
        times = [f"{waited_s:.0f} s so far"] * is_same + [usual] * bool(usual)
        told = f"{why} ({'; '.join(times)})" if times else why
        places = tuple((each.graph, each.node) for each in actions)
        self.tell(Loading(self._clock_us(), told, places))
        if why:
            self.alarm("stop_unconfirmed", f"STOP UNCONFIRMED: {why}. {_LOOK_AT_IT}")

    def engine_ended(self) -> None:
        """The engine's process has ended, and the code of every action with it."""
        process = self.run.process
        how = (
            "The simulated engine was switched off."
            if process is None
            else f"The engine's process, {process.pid} on this computer, has ended."
        )
        self._rests_by_itself(how)

    def threads_ended(self) -> None:
        """No thread is left that the engine began for this run, and none of its code goes on."""
        process = self.run.process
        where = f"process {process.pid} on this computer" if process else "the engine's process"
        self._rests_by_itself(f"No thread that the engine began for this run is left in {where}.")

    def _rests_by_itself(self, how: str) -> None:
        run = self.run
        state: End = "error" if run.doubt else "lost"
        self._rests(AtRest(None, self._clock_us(), how), state, run.doubt or run.lost or how)

    def confirm_rest(self, author: Author, how: str) -> None:
        """Somebody has seen that it is at rest, where no answer of the engine can prove it."""
        why = self.run.doubt or self.run.lost or self.watch.trouble
        self._rests(AtRest(author, self._clock_us(), how), "error", why, author.id)

    def _rests(self, seen: AtRest, state: End, why: str, author: str = "") -> None:
        self.tell(Ended(seen.at, state, self._result(), why, seen), author)

    def _result(self) -> str | None:
        return self.run.result or _RESULTS.get(self.run.graph_state or "")

    def end(self, state: End, detail: str) -> None:
        """The run is over. The first end counts."""
        if self.run.end is None:
            self.tell(Ended(self._clock_us(), state, self._result(), detail))

    def alarm(self, code: str, text: str) -> None:
        """Tell people something now, once."""
        if all((alarm.code, alarm.text) != (code, text) for alarm in self.run.alarms):
            self.tell(AlarmRaised(self._clock_us(), code, text))
