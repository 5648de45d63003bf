"""The execution service: the commands of people on runs and robots, and the runs that a crash left.

It lives on one event loop. Open runs are in memory; the journal has all runs.
"""

import logging
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager
from functools import partial
from typing import Any, Final

import anyio
import msgspec
from sqlalchemy import Row

from action_assistant.errors import Conflict, NotFound
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.execution import interventions
from action_assistant.runner.execution.conducted_steps import RUNNER
from action_assistant.runner.execution.conductors import Conductors
from action_assistant.runner.execution.earlier_runs import EarlierRuns
from action_assistant.runner.execution.hardware_stops import HardwareStops
from action_assistant.runner.execution.health import HealthWatch
from action_assistant.runner.execution.late_activity import LateActivity
from action_assistant.runner.execution.led_commands import (
    LedCommands,
    claim_of,
    no_piece,
    operator_of,
)
from action_assistant.runner.execution.led_look import LedLook
from action_assistant.runner.execution.open_runs import OpenRuns
from action_assistant.runner.execution.operator_pages import OperatorPages
from action_assistant.runner.execution.question_commands import QuestionCommands
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.start_checks import NO_SOURCES, StartChecks, StartSources
from action_assistant.runner.execution.start_pipeline import Grouped, Started, StartPipeline
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import SIMULATOR, ForeignCommand, Registration
from action_assistant.runner.links.simulator import Simulator, in_this_process
from action_assistant.runner.robots.engine import KnownEngine
from action_assistant.runner.robots.registration import (
    HolderShown,
    Robot,
    registration_of,
    seen_by,
    with_health,
    with_rights,
)
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.rights import OF_PEOPLE
from action_assistant.runner.robots.robot_events import Commanded
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.events import Author, Ended, PartOfRepeat
from action_assistant.runner.runs.history import Past, RunHistory, RunnerJournal, whole_of
from action_assistant.runner.runs.recorder import RunRecorder
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sight import RunGraphs, Unseen, run_graphs
from action_assistant.runner.runs.views import time
from action_assistant.runner.runtime import Runtime
from action_assistant.runner.start.admission import (
    AskedInputsRequest,
    GroupRequest,
    ResumeRequest,
    StartRequest,
)
from action_assistant.runner.start.approvals import Approvals
from action_assistant.runner.start.drills import DrillRequest, drill_of
from action_assistant.runner.start.idempotency import STOPPED_WITH, StopOrder
from action_assistant.runner.start.led_items import IndexingWords
from action_assistant.runner.start.orders import Often, watched_in
from action_assistant.runner.start.preflight import Preflight
from action_assistant.runner.start.rights_registry import IdentityNow, RightsRegistry, unchanged
from action_assistant.runner.stop.foreign_stop import ForeignStopLoop, StoppedAll
from action_assistant.umrf.files.codec import Unreadable
from action_assistant.umrf.start_values import AskedInput
from action_assistant.web.auth.caller import BackgroundTasks
from action_assistant.web.auth.identity import Identity
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_LOST: Final = (
    "The runner ended while this simulation went on, and the simulated engine with it. Nothing "
    "shows how it would have ended."
)


class ExecutionService:
    """Carries out commands of people on runs and robots. Use the context manager `opened` to get
    one with its tasks running. In its methods, `author` is the person (or program) in whose name
    the command is recorded."""

    def __init__(
        self,
        robots: Robots,
        runtime: Runtime,
        *,
        simulator: Simulator,
        past: Past | None,
        sources: StartSources,
        identity_now: IdentityNow,
    ) -> None:
        self.robots = robots
        self.history = RunHistory(runtime.journal, past)
        self.sight: Final = sources.sight
        self.approvals: Final = Approvals(
            runtime.journal, runtime.clock_us, identity_now, sources.sight
        )
        self._runtime = runtime
        self._robot_watchers: list[Callable[[], None]] = []
        self._stop_watchers: list[Callable[[Author, str, str], None]] = []
        #: Called with each Stop that found nothing to stop: who pressed it, and for which robot and run.
        self.idle_stop: Callable[[Author, str, str], None] = _ignore_stop
        self._stops = StopOrder()
        self.foreign_stops: Final = ForeignStopLoop(robots, runtime, self._robots_changed)
        self._runs = OpenRuns(robots, self.history, runtime)
        self._runs.watch(self._remember_sight)
        self.open: Final = self._runs.by_id
        self._late_activity = LateActivity(self._runs, self.history, robots, runtime)
        self.rights: Final = RightsRegistry(
            robots, runtime, self._rights_changed, identity_now, sources.release_of
        )
        self.hardware_stops: Final = HardwareStops(
            robots,
            runtime,
            self.rights.hardware_stop_of,
            self._stop_pressed,
            self._rights_changed,
        )
        self.rights.why_pressed = self.hardware_stops.why
        self._health: Final = HealthWatch(
            robots, runtime, self.rights.health_of, self._robots_changed
        )
        self.rights.health_now = self._health.of
        look = LedLook(
            self._runs,
            self.foreign_stops,
            IndexingWords(runtime.journal, runtime.clock_us),
            self.rights,
            sources.sight,
        )
        self._earlier = EarlierRuns(self._runs, self.history, self.sight, runtime.run_in_worker)
        self._checks = StartChecks(
            self._runs,
            self._late_activity,
            robots,
            self.foreign_stops,
            runtime,
            approvals=self.approvals,
            look=look,
            rights=self.rights,
            simulator=simulator,
            sources=sources,
            earlier=self._earlier,
        )
        self._conductors = Conductors(robots, look, self._runs, self.history, simulator, runtime)
        self.operator_pages: Final = OperatorPages(
            self.rights, self._runs, self._conductors.hold, self._page_missing
        )
        self._conductors.why_missing = self.operator_pages.why_missing
        self._led = LedCommands(
            self._conductors,
            self.rights,
            self.sight,
            movable=self._movable,
            find=self.find,
            requested=self.history.requested,
            in_worker=runtime.run_in_worker,
        )
        self.questions: Final = QuestionCommands(
            self._conductors,
            self._led,
            find=self.find,
            open_runs=lambda: [each.run for each in self.open.values()],
        )
        self.set_breakpoints: Final = self._led.set_breakpoints
        self.go_on: Final = self._led.go_on
        self.step: Final = self._led.step
        self.wait: Final = self._led.wait
        self.hand_over: Final = self._led.hand_over
        self.give_outcome: Final = self._led.give_outcome
        self._starts = StartPipeline(
            self._runs, self._checks, self._stops, self._conductors, self.rights, runtime
        )

    @classmethod
    @asynccontextmanager
    async def opened(
        cls,
        journal: RunnerJournal,
        robots: Robots,
        *,
        clock_us: ClockUs,
        run_in_worker: RunInWorker = anyio.to_thread.run_sync,
        simulator: Simulator = in_this_process,
        past: Past | None = None,
        sources: StartSources = NO_SOURCES,
        identity_now: IdentityNow = unchanged,
    ) -> "AsyncIterator[ExecutionService]":
        """Return a context manager that yields the service after it has taken over the runs that an
        earlier process left open; at its end the background tasks are cancelled. `past` reads runs
        that are over; `simulator` makes links to simulated engines; `sources` are the behaviours,
        expected courses and index folders that starts need; `identity_now` returns an identity with
        the role and groups that its person has now, or None if the access of the person was
        ended."""
        async with anyio.create_task_group() as tasks:
            runtime = Runtime(journal, clock_us, BackgroundTasks(tasks), run_in_worker)
            control = cls(
                robots,
                runtime,
                simulator=simulator,
                past=past,
                sources=sources,
                identity_now=identity_now,
            )
            await control._take_up()
            try:
                yield control
            finally:
                tasks.cancel_scope.cancel()

    def watch(self, watcher: Callable[[OpenRun], None]) -> None:
        """Call `watcher` with every run that has changed, at once and on the event loop."""
        self._runs.watch(watcher)

    def watch_stops(self, watcher: Callable[[Author, str, str], None]) -> None:
        """Call `watcher` at once with each Stop that is pressed: who pressed it, the robot and the run that
        it names; "" for both where it stops everything."""
        self._stop_watchers.append(watcher)

    def hold_back(self, what: str, why: str) -> None:
        """Let no start leave that was requested before, of the repeat or with the request id `what`. `why`:
        the reason, as a sentence."""
        self._stops.refuse(what, why)

    def occupying(self, robot: str) -> Run | None:
        """Return the open run that keeps a robot occupied; None if no run does."""
        return self._runs.occupying(robot)

    def _tell_of_stop(self, author: Author, robot: str, run: str) -> None:
        for watcher in self._stop_watchers:
            try:
                watcher(author, robot, run)
            except Exception:  # whatever it is: the Stop goes on
                log.exception("a Stop could not be passed on")

    def _remember_sight(self, opened: OpenRun) -> None:
        """Remember who may see a run: its robot may hold its graph long after it is over."""
        if not opened.is_led and self.sight.known(opened.run.id) is None:
            self.sight.remember(opened.run.id, run_graphs(opened.run))

    def watch_robots(self, watcher: Callable[[], None]) -> None:
        """Call `watcher` whenever a robot has changed, at once."""
        self._robot_watchers.append(watcher)

    def _robots_changed(self) -> None:
        self.hardware_stops.look()
        self.operator_pages.look()
        self._health.look()
        for watcher in self._robot_watchers:
            watcher()

    def _stop_pressed(self, robot: str, why: str) -> None:
        """Close the gates of the runs on a robot whose hardware stop counts as pressed from now on, and
        begin to stop them and what others have started there."""
        author = msgspec.structs.replace(RUNNER, name=f"the hardware stop of {robot}")
        self._stops.note(robot, author)
        self._tell_of_stop(author, robot, "")
        self._conductors.rights_changed(robot)
        going = {
            run: opened
            for run, opened in self._runs.on(robot).items()
            if opened.run.end is None and opened.run.desired != "stopped"
        }
        try:
            self._stop_each(tuple(going), author, "")
        finally:
            self.foreign_stops.stop(author, self._runs.on, robot)
            for opened in going.values():
                if not opened.is_led:
                    opened.alarm("hardware_stop", why)

    def _page_missing(self, opened: OpenRun, robot: str, why: str) -> None:
        """Begin to stop a run of whose people no page has been visible for too long."""
        author = msgspec.structs.replace(RUNNER, name=f"the watch for pages of {robot}")
        self._tell_of_stop(author, "", opened.run.id)
        try:
            self._stop(opened.run.id, author, "")
        finally:
            opened.alarm("page_missing", why)

    def _rights_changed(self, robot: str) -> None:
        self.hardware_stops.look()
        self.operator_pages.look()
        self._conductors.rights_changed(robot)
        self._robots_changed()

    # --- start --------------------------------------------------------------------------------

    async def start(
        self,
        request: StartRequest,
        author: Author,
        identity: Identity | None = None,
        repeat: PartOfRepeat | None = None,
        often: Often = None,
    ) -> Started:
        """Carry out a start, at most once per request id, and return when its one message was sent.
        `identity`: of the author, None for an operator without groups; `repeat`, `often`: as in the
        pipeline. Raise a subclass of Refused if the start is refused; nothing was sent then."""
        starter = identity or operator_of(author)
        self.rights.act(starter)
        return await self._starts.start(request, author, starter, repeat, often)

    async def start_group(
        self,
        group: GroupRequest,
        author: Author,
        identity: Identity | None = None,
        often: Often = None,
    ) -> Grouped:
        """Start one version on several robots: all starts are accepted before the first message is sent.
        `identity`, `often`: as for `start`. Raise a subclass of Refused if one start is refused; nothing
        was sent to any robot then."""
        starter = identity or operator_of(author)
        self.rights.act(starter)
        return await self._starts.start_group(group, author, starter, often)

    async def look(
        self,
        group: GroupRequest,
        starter: str = "",
        identity: Identity | None = None,
        often: Often = None,
    ) -> list[Preflight]:
        """Return the pre-flight of a start on each engine for the person with the id `starter`. Only a
        get is sent. Raise Forbidden if they may not see the graph, or one inside."""
        by = identity or operator_of(Author(starter, ""))
        await self._checks.require_sight(group, by)
        return await self._checks.look(group, by, often)

    async def asked_inputs(
        self, wanted: AskedInputsRequest, identity: Identity
    ) -> tuple[AskedInput, ...]:
        """Return the inputs for which a start of a graph asks. Raise a subclass of Refused if it cannot
        begin where it says."""
        return await self._earlier.asked_inputs(wanted, identity)

    def under_way(self, request_id: str) -> bool:
        """Return whether the start, of a group too, with this request id is being carried out now."""
        return self._starts.is_under_way(request_id)

    def next_number(self) -> int:
        """Return the number for a new run; no two calls return the same number."""
        return self._runs.next_number()

    async def change(self, run: str, revision: int) -> None:
        """Wait until an open run has another revision number than `revision`, or is over and
        stored."""
        await self._runs.change(run, revision)

    # --- stop, pause, resume ------------------------------------------------------------------

    def stop_all(self, author: Author, stop_id: str = "", again: bool = False) -> StoppedAll:
        """Begin to stop all runs and all graphs of other programs. Return which are being stopped, and the
        robots that cannot be reached. The call never waits. `stop_id`: the id of the press; `again`: it is
        sent once more, and reaches no run that was admitted since it first came."""
        newest = self._stops.note_all(author, stop_id, again, self._runs.last_number)
        if newest is None:
            self._tell_of_stop(author, "", "")
        try:
            stopped = self._stop_each(self._runs.admitted(newest), author, stop_id)
        finally:
            graphs = self.foreign_stops.stop(author, self._runs.on)
        runs = [run for run in stopped if not self.open[run].is_led]
        if not graphs and not stopped:
            self.idle_stop(author, "", "")
        return StoppedAll(runs, self.foreign_stops.graphs(), self.robots.unheard())

    def stop_robot(self, name: str, author: Author) -> tuple[list[str], list[str]]:
        """Begin to stop all runs on the robot `name` and all graphs that other programs have
        started there. Return the ids of the runs and the names of the graphs. The call never waits.
        Raise NotFound if the robot is not registered."""
        self.robots.engines(name)
        self._stops.note(name, author)
        self._tell_of_stop(author, name, "")
        try:
            stopped = self._stop_each(tuple(self._runs.on(name)), author, "")
        finally:
            graphs = self.foreign_stops.stop(author, self._runs.on, name)
        if not graphs and not stopped:
            self.idle_stop(author, name, "")
        return [run for run in stopped if not self.open[run].is_led], graphs

    async def stop(self, run: str, author: Author, stop_id: str = "") -> list[str]:
        """Begin to stop a run, or all runs of a group, and return the ids of the runs that are
        being stopped; none if all is over. A Stop of a piece stops its whole led run; once that is
        over, a Stop of either reaches the pieces that move again. The call only waits to read a run
        that is not open. Raise NotFound if there is no such run or group."""
        self._tell_of_stop(author, "", whole_of(run) or run)
        for each in (whole_of(run), run):
            if each in self.open and self._stop(each, author, stop_id):
                return [each]
        parts = [each for each, opened in tuple(self.open.items()) if run in opened.run.wholes]
        if parts:
            self._stops.note(run, author, stop_id)
            return self._stop_each(parts, author, stop_id)
        if run not in self.open:
            await self._over(run)
        self.idle_stop(author, "", run)
        return []

    def _stop_each(self, runs: Iterable[str], author: Author, stop_id: str) -> list[str]:
        """Begin to stop these runs, and return those that had not ended. A fault of the runner in one
        of them keeps it from no other one, and is raised at the end."""
        stopped, faults = list[str](), list[Exception]()
        for run in runs:
            try:
                if self._stop(run, author, stop_id):
                    stopped.append(run)
            except Exception as fault:  # whatever it is: the others are stopped
                log.exception("a Stop has failed")
                faults.append(fault)
        if faults:
            raise ExceptionGroup("a Stop has failed in part", faults)
        return stopped

    def _stop(self, run: str, author: Author, stop_id: str) -> bool:
        opened = self.open[run]
        if opened.run.end is not None:
            return False
        if opened.run.group:
            self._stops.refuse(opened.run.group, STOPPED_WITH)
        opened.stop(author, stop_id)
        return True

    async def pause(self, run: str, author: Author) -> Run:
        """Pause a run. Raise NotFound, Conflict if it cannot be paused, Unavailable if not sent."""
        return await interventions.pause(no_piece(await self._movable(run)), author)

    async def resume(
        self,
        run: str,
        author: Author,
        identity: Identity | None = None,
        asked: ResumeRequest | None = None,
    ) -> Run:
        """Resume a paused run. Raise NotFound if there is no such run, Conflict if it is not
        paused, Unavailable if the message could not be sent, Forbidden or Conflict if the author may
        not start on its robot."""
        opened = no_piece(await self._movable(run))
        watching = watched_in(asked.watching if asked else {}, opened.run.robots)
        claim = claim_of(opened.run, watching)
        self._led.require_rights(opened.run, author, identity, claim)
        by = identity or operator_of(author)
        may_leave = partial(self.rights.require_still, opened.run.robots, by, claim)
        return await interventions.resume(opened, author, watching, may_leave)

    async def modify(
        self, run: str, body: bytes, author: Author, identity: Identity | None = None
    ) -> Run:
        """Give a run another version of its graph; `body` is an encoded ModifyRequest. Raise
        NotFound if there is no such run, Forbidden or Conflict if the author may not start on its
        robot, and what `interventions.modify` raises."""
        opened = no_piece(await self._movable(run))
        by = identity or operator_of(author)
        self.rights.act(by)
        self.rights.require(opened.run.robots, by, only=OF_PEOPLE)
        engine = self.robots.link(opened.run.engine)
        return await interventions.modify(
            opened,
            body,
            author,
            engine=engine,
            approvals=self.approvals,
            run_in_worker=self._runtime.run_in_worker,
            limits=self.rights.limits(opened.run.robots),
            require=partial(self._led.require_rights, opened.run, author, identity),
            sight=self.sight,
            identity=by,
        )

    async def confirm_rest(self, run: str, asked: interventions.RestRequest, author: Author) -> Run:
        """Record that a person has seen a run at rest (nothing moves), where its engine cannot
        prove that; return the run. `asked`: how it was seen. Raise NotFound if there is no such
        run, Conflict if a piece of it may still be moving, and what `interventions.confirm_rest` raises.
        """
        opened = await self._movable(run)
        for each in self.open.values():
            piece = each.run.piece
            if piece is not None and piece.run == run and each.run.end is None:
                raise Conflict(
                    f"{each.run.engine} may still be moving in this run. Look at {each.run.engine}, and confirm "
                    f"that {piece.node} is at rest.",
                    where={"path": "/how", "run": each.run.id},
                )
        return interventions.confirm_rest(opened, asked, author)

    async def record_drill(self, robot: str, asked: DrillRequest, author: Author) -> None:
        """Record a Stop drill of a robot: a run there that was stopped, and what a person saw. Raise
        NotFound if there is no such robot or run, Conflict if the run shows nothing about a Stop there,
        Unavailable if the drill could not be stored."""
        self.robots.registration(robot)
        run, now = await self.find(asked.run), self._runtime.clock_us()
        await self.rights.record_drill(robot, drill_of(run, robot, asked, author, now))

    async def _movable(self, run: str) -> OpenRun:
        opened = self.open.get(run)
        if opened is None or opened.run.end is not None:
            over = opened.run if opened is not None else await self._over(run)
            what = "run" if not whole_of(run) else f"part of run {whole_of(run)} that this names"
            raise Conflict(f"The {what} is over: {over.state}.")
        return opened

    # --- what there is ------------------------------------------------------------------------

    async def find(self, run: str) -> Run:
        """Return a run, open or over. Raise NotFound if there is no such run."""
        return await self._runs.find(run)

    def graphs_now(self, run: str) -> RunGraphs | None:
        """Return the facts that decide who may see an open run, or one that was open in this process;
        None for any other id. A piece has those of its whole run."""
        whole = whole_of(run) or run
        opened = self.open.get(whole) or self.open.get(run)
        if opened is None or opened.run.piece is not None:
            return self.sight.known(whole) or self.sight.known(run)
        return run_graphs(opened.run)

    @property
    def shown(self) -> dict[str, OpenRun]:
        """The open runs that people see, by id: all but the pieces that a conductor leads."""
        return {run: opened for run, opened in self.open.items() if not opened.is_led}

    def recorder_of(self, run: str) -> RunRecorder | None:
        """Return the recorder of an open run; None for any other id."""
        opened = self.open.get(run)
        return None if opened is None else opened.recorder

    async def simulates(self, run: str) -> bool:
        """Return whether a run is simulated. Raise NotFound if there is no such run."""
        opened = self.open.get(run)
        return bool(
            opened.run.simulated if opened is not None else (await self._over(run)).simulated
        )

    async def _over(self, run: str) -> "Row[Any] | Run":
        """Return a run that is over, at least with its `state` and `simulated`; a piece has no row in
        the table. Raise NotFound if there is no such run, Unavailable if the journal cannot be
        read."""
        rows = await self._runtime.journal.query(queries.of_run(run))
        if rows:
            return rows[0]
        if whole_of(run):
            return await self.history.run(run)
        raise NotFound("There is no such run.")

    def robot_views(self, unseen: Unseen | None = None) -> list[Robot]:
        """Return all engines as people see them, the simulator first. `unseen`: the graphs that the
        reader may not see."""
        return [
            seen_by(self._with_rights(each), unseen, self.graphs_now)
            for each in self.robots.all(self.foreign_stops.trouble)
        ]

    def robot_view(self, name: str, unseen: Unseen | None = None) -> Robot:
        """Return one engine as people see it; `unseen` as above. Raise NotFound if no robot has this
        name."""
        if name == SIMULATOR:
            return next(self.robots.all())
        robot = self._with_rights(self.robots.robot(name, self.foreign_stops.trouble))
        return seen_by(robot, unseen, self.graphs_now)

    def _with_rights(self, plain: Robot) -> Robot:
        """Return a robot with its rights and the holder of its baton."""
        if plain.simulated:
            return plain
        held = self.rights.holder(plain.name)
        shown = None
        if held is not None:
            falls_at = self.rights.falls_at(held.person.id)
            left_us = 0 if falls_at is None else round((falls_at - anyio.current_time()) * 1e6)
            shown = HolderShown(
                person=held.person,
                since=time(held.since),
                here=falls_at is None,
                falls_at=None if falls_at is None else time(self._runtime.clock_us() + left_us),
            )
        rights = self.rights.of(plain.name)
        due = rights.drill_due(self._runtime.clock_us() / 1e6)
        found = with_rights(plain, rights, shown, due, self.hardware_stops.why(plain.name))
        return with_health(found, self._health.of(plain.name), self._runtime.clock_us())

    async def register(self, asked: Registration, author: Author) -> Robot:
        """Register a robot, or change its registration, and return it. Raise BadInput if that is not valid,
        Conflict if it is in use or has the simulator's name, Unavailable if the journal cannot store it."""
        async with self._starts.turns([asked.name]):
            self.require_unused(asked.name)
            await self.robots.register(asked, author)
            return self.robot_view(asked.name)

    async def remove(self, robot: str, author: Author) -> None:
        """Remove a robot from the registry. Raise NotFound if the robot is not registered, Conflict
        if it is in use, Unavailable if the journal cannot store that."""
        async with self._starts.turns([robot]):
            self.require_unused(robot)
            await self.robots.remove(robot, author)

    def require_unused(self, robot: str) -> None:
        """Raise Conflict if a registration cannot change now, since something goes on there."""
        run = self._runs.occupying(robot)
        if run is not None:
            raise Conflict(
                f"Run {run.number} goes on {robot}; stop it first. Its Stop would get lost.",
                where={"path": "/name", "run": run.id},
            )
        if self.foreign_stops.is_stopping(robot):
            raise Conflict(
                f"Something is being stopped on {robot}; wait until it is.", where={"path": "/name"}
            )

    # --- what robots report -------------------------------------------------------------------

    def _hear_of(self, engine: KnownEngine, command: ForeignCommand) -> None:
        """Process a command that another program has sent to a robot: pass it to the open runs and
        Stops there, and record it in the robot's log with the run that it concerns."""
        robot = engine.registration.name
        self.foreign_stops.hear_of(robot, command)
        self._late_activity.sent_by_others(command)
        run = self._runs.hear_of(robot, command)
        event = Commanded(
            **msgspec.structs.asdict(command),
            run=None if run is None else run.id,
            number=None if run is None else run.number,
        )
        self.robots.robot_log.note(robot, event, command.sender)

    def _show(self, engine: KnownEngine, snapshots: tuple[Snapshot, ...]) -> None:
        """Process the graphs (`snapshots`) that an engine shows in an answer or by feedback: find
        those that others have started, and runs that move after their end."""
        self.foreign_stops.shows(engine, snapshots)
        self._late_activity.shows(engine, snapshots)

    # --- after a restart ----------------------------------------------------------------------

    async def _take_up(self) -> None:
        """Take over what an earlier process left: the robots, the open runs, and the Stops of
        graphs that other programs started. Stops that were pressed go on; no run is started."""
        self._runs.last_number = (await self._runtime.journal.query(queries.last_number()))[0][0]
        self._runtime.tasks.start_soon(self._late_activity.run)
        self.robots.open(
            self._runtime,
            changed=self._robots_changed,
            commanded=self._hear_of,
            shows=self._show,
        )
        self.rights.take_up(await self._runtime.journal.query(queries.all_rights()))
        for row in await self._runtime.journal.query(queries.all_robots()):
            self.robots.add(registration_of(row))
        for row in await self._runtime.journal.query(queries.open_runs()):
            run, seq, is_whole = await self.history.left(row.id)
            if run is None:
                pieces, _ = await self.history.pieces(row.id)
                self._conductors.follow_pieces(row.id, pieces)
            if run is None or run.end is not None:
                log.error("run %s: table and events differ; `rebuild` mends the table", row.id)
                continue
            await self._adopt(run, seq, is_whole=is_whole)
        await self.foreign_stops.take_up()
        # Until here each robot with a hardware stop counts as pressed; what a press stops is known now.
        self._runtime.tasks.start_soon(self.hardware_stops.run)
        self._runtime.tasks.start_soon(self.operator_pages.run)
        self._runtime.tasks.start_soon(self._health.run)

    async def _adopt(self, run: Run, seq: int, *, is_whole: bool) -> None:
        """Follow a run that an earlier process left open; nothing of the run is started. `seq` is
        the number of its last stored event; `is_whole` says that all of its events could be
        read."""
        if run.led is not None:
            try:
                if is_whole:
                    await self._conductors.take_up(run, seq)
                    return
            except (Unreadable, msgspec.DecodeError):
                log.exception("run %s: what leads it cannot be read", run.id)
            await self._conductors.follow_unread(run, seq)
            return
        link = self.robots.link(run.engine)
        opened = self._runs.open(run, link, owns_link=False, seq=seq)
        if run.simulated:
            opened.tell(Ended(self._runtime.clock_us(), "lost", None, _LOST))
        elif not is_whole:
            log.error("run %s: some of its events cannot be read", run.id)
            opened.lose("Some of what was recorded of this run cannot be read.")
        self._runs.drive(opened)


def _ignore_stop(_author: Author, _robot: str, _run: str) -> None:
    """Ignore a Stop that found nothing to stop."""
