"""A run that is not over: keeps it moving, watches it, and stops it until that is proven.

One task listens, one asks, one stops, one writes. None of them waits for another: a stop leaves
while a get hangs, and everything goes on while the journal is down.
"""

import itertools
import logging
from collections.abc import Awaitable, Callable
from typing import Final

import anyio
import msgspec

from action_assistant.runner.events import (
    AlarmRaised,
    Answered,
    Author,
    End,
    Ended,
    EngineSaid,
    Observed,
    PauseRequested,
    Proof,
    Published,
    ResumeRequested,
    RunEvent,
    Silent,
    StopRequested,
    StopSent,
)
from action_assistant.runner.flight import alarm_of
from action_assistant.runner.history import Aside
from action_assistant.runner.lateness import fresh
from action_assistant.runner.links.port import (
    Answer,
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
)
from action_assistant.runner.proof import Rest, hash_of, send_stop
from action_assistant.runner.recorder import Recorder, Store
from action_assistant.runner.runs import Run, follow, is_news
from action_assistant.runner.sameness import difference
from action_assistant.runner.seen import TERMINAL, Hazard, Seen, Snapshot
from action_assistant.umrf.model import Graph

log: Final = logging.getLogger(__name__)

_POLL_S: Final = 1.0
_STOP_POLL_S: Final = 0.1
_GET_S: Final = 1.0  # an engine that is not busy answers within milliseconds
_SILENT_S: Final = 3.0
_APPEAR_S: Final = 3.0  # until a started graph must show in answers
_GIVEN_UP_S: Final = 30.0  # until a stopped run that never showed is believed to have never begun
_UNCONFIRMED_S: Final = 2.0
_SWITCH_OFF_S: Final = 10.0  # a simulated engine that does not obey harms nobody
_TOLD: Final = frozenset({"H7", "H8"})  # the run goes nowhere, and the engine says nothing
_ONE_PRESS_S: Final = 1.0

_SEVERAL: Final = (
    "{servers} engines are seen on the path of its answers, so that none proves anything"
)
_LINES: Final = 2_000  # of the engine's log, kept with one run
_LONGEST_LINE: Final = 2_000  # characters

_RESULTS: Final = {"HALTED": "on_halted", "STOPPED": "on_stopped", "ERROR": "on_error"}

Clock = Callable[[], int]


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
        wall: Clock,
        aside: Aside,
        changed: "Callable[[OpenRun], None]",
    ) -> None:
        self.run = run
        self.revision = 0
        self.published = anyio.Event()
        self.recorder = Recorder(store, run.id, seq, self._touch)
        self._link = link
        self._owns_link = owns_link
        self._wall = wall
        self._aside = aside
        self._sent: Graph | None = None  # until it was compared with what the engine shows
        self._lines = 0
        self._answered = False  # by a get, since the last feedback
        self.seen_at: int | None = None  # when the engine last showed this run
        self._changed = changed
        self._over = anyio.Event()
        self._stop_wanted = anyio.Event()
        self._look = anyio.Event()
        self._order = itertools.count(1)
        self._stop_sent: int | None = None
        self._stop_ids: set[str] = {""}
        self._stop_asked: tuple[str, float] = ("", 0.0)
        self._stop_trouble = ""
        self._hung = ""
        self._early: list[Report] = []
        self._rest = Rest(exact=owns_link)
        self._heard_at = anyio.current_time()
        self._began_at = anyio.current_time()
        self._seen_wall: int | None = None
        if run.desired == "stopped":
            self._stop_wanted.set()

    # --- what people want ---------------------------------------------------------------------

    def stop(self, author: Author, stop_id: str) -> None:
        """Want the run stopped, now and until it is. Never waits, never fails. One press may come
        several times and by several ways; it is recorded once."""
        now, (who, when) = anyio.current_time(), self._stop_asked
        if who != author.id or (stop_id not in self._stop_ids and now - when > _ONE_PRESS_S):
            self._stop_asked = (author.id, now)
            self.tell(StopRequested(self._wall(), author, stop_id), author.id)
        self._stop_ids.add(stop_id)
        self._stop_wanted.set()

    async def pause(self, author: Author) -> None:
        """Want the run paused. Raises NotSent."""
        self.tell(PauseRequested(self._wall(), author), author.id)
        await self._link.pause(self.run.graph_name)
        self._look.set()

    async def resume(self, author: Author) -> None:
        """Want the run to go on. Raises NotSent."""
        self.tell(ResumeRequested(self._wall(), author), author.id)
        await self._link.resume(self.run.graph_name)
        self._look.set()

    @property
    def pauses(self) -> bool:
        """Whether pausing is safe on this engine."""
        return self._link.pauses

    def hear_of(self, command: ForeignCommand) -> None:
        """Somebody else has told this robot something while the run goes on there."""
        alarm = alarm_of(command, self.run.engine, self.run.graph_name)
        if alarm is not None:
            self._alarm(*alarm)
            self._look.set()

    # --- what happens -------------------------------------------------------------------------

    def tell(self, event: RunEvent, author: str = "") -> None:
        """Show an event to everybody and store it as soon as the journal can."""
        if self.run.end is not None and not isinstance(event, AlarmRaised):
            return
        self.run = follow(self.run, event)
        self.recorder.put(event, author or self.run.engine)
        if self.run.end is not None:
            self._over.set()
        self._touch()

    def _touch(self) -> None:
        self.revision += 1
        self._changed(self)

    async def drive(self, order: Order | None, incarnation: str = "") -> None:
        """Live through the run until it is over and stored. With an order it is started first,
        exactly once; without one it is taken up where it stands."""
        async with anyio.create_task_group() as outer:
            outer.start_soon(self.recorder.run)
            try:
                with self._link.listen(self._hear):
                    if order is not None:
                        await self._publish(order, incarnation)
                    self._let_early_ones_in()
                    await self._live()
                if self._owns_link:
                    await self._link.aclose()
                await self.recorder.flushed()
            except anyio.get_cancelled_exc_class():
                with anyio.move_on_after(1, shield=True):
                    await self.recorder.flushed()
                raise
            outer.cancel_scope.cancel()

    async def _live(self) -> None:
        async with anyio.create_task_group() as tasks:
            if self._owns_link:
                tasks.start_soon(self._steadily, self._link.run)
            tasks.start_soon(self._steadily, self._watch)
            tasks.start_soon(self._steadily, self._stop_until_proven)
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
                    self._alarm("internal", f"The runner has a fault: {error!r}")
                    told = True
                await anyio.sleep(0.2)

    async def _publish(self, order: Order, incarnation: str) -> None:
        """Send the one start message. Whatever happens, it is never sent again."""
        at, self._sent = self._wall(), order.graph
        if self.run.desired == "stopped":
            self._end("stopped", "Stopped before anything was sent.")
            return
        try:
            with anyio.fail_after(5):
                await self._link.start(order)
        except (EngineRefused, NotSent, NoAnswer) as refused:
            self._end("refused", str(refused))
            return
        except Exception as error:  # also a deadline: the message may have left
            log.exception("run %s: the start may or may not have left", self.run.id)
            self.tell(Published(at, incarnation))
            self.tell(Silent(self._wall(), at, f"Nobody knows whether the start left: {error!r}"))
        else:
            self.tell(Published(at, incarnation))

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
                self._observe(changes)
            case Feedback(snapshots=snapshots):
                self._feed(tuple(each for each in snapshots if each.run == self.run.id))
            case EngineLog(at=at, text=text, graph=graph) if self._is_ours(graph):
                if self._lines < _LINES:
                    self._lines += 1
                    self.tell(EngineSaid(at, text[:_LONGEST_LINE]))
            case EngineChanged(state="gone", why=why) if self._owns_link:
                self._alarm("engine_gone", why)  # a simulated engine does not come back
                self._end("lost", why)
            case EngineChanged(state="busy", why=why):
                self._hung = why
            case _:
                return
        self._look.set()

    def _feed(self, ours: tuple[Snapshot, ...]) -> None:
        """Feedback of this run, oldest first."""
        overtaken, self._answered = self._answered, False
        if not ours:
            return
        self.seen_at = self._wall()
        if news := fresh(self.run, ours) if overtaken else ours:
            self._observe(news)

    def _is_ours(self, graph: str | None) -> bool:
        name = self.run.graph_name
        return graph is None or graph == name or graph.startswith(f"{name}__")

    def _observe(self, seen: tuple[Seen, ...]) -> None:
        self.tell(Observed(self._wall(), seen))
        for item in seen:
            if isinstance(item, Hazard) and (item.effect != "goes on" or item.code in _TOLD):
                place = f" at {item.node}" if item.node else ""
                self._alarm(item.code, f"{item.code}{place}: {item.message or item.effect}")

    async def _watch(self) -> None:
        wait = 0.0
        while True:
            with anyio.move_on_after(wait):
                await self._look.wait()
            self._look = anyio.Event()
            order, began = next(self._order), anyio.current_time()
            try:
                with anyio.fail_after(_GET_S):
                    answer = await self._link.get()
            except (NoAnswer, TimeoutError) as nothing:
                self._hear_nothing(str(nothing))
            else:
                self._take(answer, order, began)
                await self._compare(answer)
            cost = anyio.current_time() - began
            hurry = self._stop_wanted.is_set() or self._rest.pending
            pace = _STOP_POLL_S if hurry else _POLL_S
            wait = max(pace, 5 * cost)

    def _hear_nothing(self, why: str) -> None:
        silent = anyio.current_time() - self._heard_at
        self._stop_trouble = why or "the engine does not answer"
        if silent >= _SILENT_S and self.run.unknown_since is None:
            at = self._wall()
            self.tell(Silent(at, at - round(silent * 1e6), self._stop_trouble))

    def _take(self, answer: Answer, order: int, asked: float) -> None:
        """Draw the conclusions that one answer allows, and no others."""
        name = self.run.graph_name
        if len({self.run.incarnation, answer.incarnation} - {None, ""}) > 1:
            self._alarm("engine_restarted", "The engine was restarted: look at the robot.")
            self._end("lost", "The engine was restarted while the run went on.")
            return
        own = next((each for each in answer.graphs if each.graph == name), None)
        servers = self._link.standing.servers
        if own is None or own.run != self.run.id:
            if servers > 1:
                self._hear_nothing(_SEVERAL.format(servers=servers))
                return
            self._heard_at = anyio.current_time()
            self._missing(own, answer)
            return
        self._heard_at, self.seen_at, self._answered = anyio.current_time(), answer.at, True
        if self.run.incarnation is None:  # the runner died between sending and noting it
            self.tell(Published(answer.at, answer.incarnation))
        if self.run.unknown_since is not None:
            self.tell(Answered(answer.at))
        parts = [each for each in answer.graphs if each.graph.startswith(f"{name}__")]
        shown = [own, *(part for part in parts if part.run in {None, self.run.id})]
        self._note(shown)
        if servers == 1:
            self._conclude(shown, answer, order, asked)
        else:
            self._stop_trouble = _SEVERAL.format(servers=servers or "no")

    async def _compare(self, answer: Answer) -> None:
        """Once: whether the engine has what was sent. It is never stopped for that by itself."""
        sent, text = self._sent, answer.texts.get(self.run.graph_name)
        if sent is None or text is None or self.run.graph_state is None:
            return
        self._sent = None
        if why := await self._aside(lambda: difference(sent, text)):
            self._alarm("echo_differs", f"What {self.run.engine} shows is not what was sent: {why}")

    def _note(self, shown: list[Snapshot]) -> None:
        """Keep what an answer says beyond what is known already."""
        since, self._seen_wall = self._seen_wall, shown[0].at
        news = tuple(
            msgspec.structs.replace(each, since=since) for each in shown if is_news(self.run, each)
        )
        if news:
            self._observe(news)

    def _missing(self, other: Snapshot | None, answer: Answer) -> None:
        """The answer does not show this run."""
        self._rest.forget()
        if self.run.graph_state is not None:
            self._end(
                "lost",
                "The engine does not hold this run any more."
                if other is None
                else "Another start has taken the place of this run.",
            )
            return
        waited = anyio.current_time() - self._began_at
        if waited < _APPEAR_S:
            return
        if self.run.incarnation is None:
            self._end("lost", "The runner ended before it could note whether the start was sent.")
        elif self.run.desired == "stopped" and waited >= _GIVEN_UP_S:
            self._end("lost", "The engine answers but has never shown this run.")
        elif self.run.unknown_since is None:
            since = answer.at - round(waited * 1e6)
            self.tell(Silent(answer.at, since, "The engine answers but does not show this run."))

    def _conclude(self, shown: list[Snapshot], answer: Answer, order: int, asked: float) -> None:
        own, at_rest = shown[0], self._rest.seen(shown, asked)
        if self.run.desired != "stopped":
            end = self.run.apparent_end
            if end is not None and own.state in TERMINAL and at_rest:
                self._end(end, "")
            return
        if self._stop_sent is None or order <= self._stop_sent:
            return
        if at_rest:
            self.tell(Proof(answer.at, answer.asked_at, hash_of(shown)))
            self._end(self.run.apparent_end or "stopped", "")
        elif self._rest.pending:
            self._stop_trouble = "nothing moves, but an action may still be about to begin"
        elif own.state == "FINISHED":
            self._stop_trouble = (
                "the graph has finished, so the engine ignores Stop, while "
                f"{', '.join(self.run.active)} goes on"
            )
        else:
            self._stop_trouble = f"{', '.join(self.run.active) or own.graph} has not stopped yet"

    # --- stopping -----------------------------------------------------------------------------

    async def _stop_until_proven(self) -> None:
        await self._stop_wanted.wait()
        began, gap = anyio.current_time(), _STOP_POLL_S
        for attempt in itertools.count(self.run.stops_sent + 1):
            failed = await send_stop(self._link, self.run.graph_name)
            if not failed and self._stop_sent is None:
                self._stop_sent = next(self._order)
            self.tell(StopSent(self._wall(), attempt, failed))
            self._look.set()
            if anyio.current_time() - began >= _UNCONFIRMED_S:
                why = failed or self._stop_trouble or "no proof has come"
                self._alarm("stop_unconfirmed", f"STOP UNCONFIRMED: {why}.")
            if self._owns_link and anyio.current_time() - began >= _SWITCH_OFF_S:
                why = self._hung or f"It does not obey: {self._stop_trouble}."
                self._end("lost", f"{why} The simulated engine was switched off.")
                return
            await anyio.sleep(gap)
            gap = min(gap * 1.5, 1.0)

    def _end(self, state: End, detail: str) -> None:
        result = self.run.result or _RESULTS.get(self.run.graph_state or "")
        if self.run.end is None:
            self.tell(Ended(self._wall(), state, result, detail))

    def _alarm(self, code: str, text: str) -> None:
        if all((alarm.code, alarm.text) != (code, text) for alarm in self.run.alarms):
            self.tell(AlarmRaised(self._wall(), code, text))
