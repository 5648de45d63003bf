"""The execution service: starts at most once, stops until proven, takes up what a crash left.

All of it lives on one event loop. Runs that are not over are in memory; the journal has everything.
"""

import logging
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any, Final

import anyio
from sqlalchemy import Row

from action_assistant.errors import BadInput, Conflict, NotFound, Refused
from action_assistant.logs.context import begin
from action_assistant.random_ids import random_id
from action_assistant.runner.clock import ClockUs
from action_assistant.runner.execution import interventions
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.links.port import SIMULATOR, ForeignCommand, Link, Order, Registration
from action_assistant.runner.links.simulator import Simulator, in_this_process
from action_assistant.runner.links.unreachable import UnreachableLink
from action_assistant.runner.robots.engine import KnownEngine
from action_assistant.runner.robots.registration import Robot, registration_of
from action_assistant.runner.robots.registry import RegistryContext, Robots
from action_assistant.runner.robots.robot_events import Commanded
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.events import Author, Ended, MovesAgain
from action_assistant.runner.runs.history import Past, RunHistory, RunnerJournal
from action_assistant.runner.runs.run import Run
from action_assistant.runner.start.admission import StartRequest
from action_assistant.runner.start.approvals import Approvals
from action_assistant.runner.start.idempotency import IdempotentStarts, StopOrder, booked
from action_assistant.runner.start.preflight import (
    Preflight,
    Settled,
    check_items,
    stands_in_the_way,
)
from action_assistant.runner.start.start_checks import (
    NO_SOURCES,
    Cleared,
    Grouped,
    GroupRequest,
    StartChecks,
    Started,
    StartSources,
)
from action_assistant.runner.stop.foreign_stop import ForeignStopLoop, StoppedAll
from action_assistant.runner.stop.late_activity import LateActivity
from action_assistant.runner.stop.loading import LoadingTimes
from action_assistant.web.auth.caller import BackgroundTasks
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_LOST: Final = (
    "The runner ended while this simulation went on, and the simulated engine with it. Nothing "
    "shows how it would have ended."
)


class ExecutionService:
    """Everything that goes on. `opened` gives it, with its tasks running."""

    def __init__(
        self,
        journal: RunnerJournal,
        robots: Robots,
        *,
        clock_us: ClockUs,
        tasks: BackgroundTasks,
        run_in_worker: RunInWorker,
        simulator: Simulator,
        past: Past | None = None,
        sources: StartSources = NO_SOURCES,
    ) -> None:
        self.robots = robots
        self.history = RunHistory(journal, past)
        self.open: dict[str, OpenRun] = {}
        self._journal, self._clock_us = journal, clock_us
        self._tasks, self._run_in_worker = tasks, run_in_worker
        self._watchers: list[Callable[[OpenRun], None]] = []
        self._news = anyio.Event()
        self._places: dict[str, anyio.Lock] = {}
        self._idempotent_starts = IdempotentStarts(journal, tasks, clock_us)
        self.under_way: Final = self._idempotent_starts.under_way
        self.approvals: Final = Approvals(journal, clock_us)
        self._starting = StartChecks(
            robots,
            approvals=self.approvals,
            clock_us=clock_us,
            run_in_worker=run_in_worker,
            taken=self._taken,
            going=self._going,
            settled=self._settled_on,
            simulator=simulator,
            sources=sources,
        )
        self._late_activity = LateActivity(
            self.open, self.history, robots, self._tasks, clock_us=clock_us, reopen=self._reopen
        )
        self._robot_watchers: list[Callable[[], None]] = []
        self._settled: dict[str, Settled] = {}
        self._loading_times = LoadingTimes()
        self._number, self._stops = 0, StopOrder()

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
    ) -> "AsyncIterator[ExecutionService]":
        """The service, after it has taken up what an earlier process left. `past` reads runs that
        are over, `simulator` makes what simulated ones run on. `sources`: what starts have, and are
        looked at with, besides."""
        async with anyio.create_task_group() as tasks:
            control = cls(
                journal,
                robots,
                clock_us=clock_us,
                tasks=BackgroundTasks(tasks),
                run_in_worker=run_in_worker,
                simulator=simulator,
                past=past,
                sources=sources,
            )
            await control._take_up()
            try:
                yield control
            finally:
                tasks.cancel_scope.cancel()

    def watch(self, watcher: Callable[[OpenRun], None]) -> None:
        """Be told, at once, of every run that has changed."""
        self._watchers.append(watcher)

    def watch_robots(self, watcher: Callable[[], None]) -> None:
        """Be told, at once, when a robot is not as it was."""
        self._robot_watchers.append(watcher)

    def _robots_changed(self) -> None:
        for watcher in self._robot_watchers:
            watcher()

    # --- start --------------------------------------------------------------------------------

    async def start(self, asked: StartRequest, author: Author) -> Started:
        """Carry out a start, at most once per request. Raises Refused of many kinds; then nothing
        was sent. Returns after the one message has left."""
        stops = self._stops.count
        async with self._idempotent_starts.once(asked.request_id):
            known = await self._known(asked)
            if known is not None:
                return Started(known, fresh=False)
            async with AsyncExitStack() as places:
                if asked.engine != SIMULATOR:
                    await places.enter_async_context(self._place(asked.engine))
                cleared = await self._starting.cleared(asked, author.id)
                run = await self._begin(asked, cleared, author, stops)
            return Started(run, fresh=True)

    async def start_group(self, asked: GroupRequest, author: Author) -> Grouped:
        """Start one version on several robots: all are looked at before the first message leaves.
        Raises Refused; then nothing was sent to any of them."""
        stops = self._stops.count
        starts = [asked.of(engine) for engine in sorted(asked.engines)]
        if not asked.request_id or SIMULATOR in asked.engines:
            where = "/engines" if asked.request_id else "/request_id"
            raise BadInput("A group has a request_id, and robots only.", where={"path": where})
        async with self._idempotent_starts.once(asked.request_id):
            found = [await self._known(each) for each in starts]
            if known := [run for run in found if run is not None]:
                missing = [each.engine for each, run in zip(starts, found, strict=True) if not run]
                failed = dict.fromkeys(missing, "It was not started with the others.")
                return Grouped(known[0].group or "", known, failed, fresh=False)
            async with AsyncExitStack() as places:
                for each in starts:  # in the order of their names, so that no two groups wait
                    await places.enter_async_context(self._place(each.engine))
                cleared = await self._starting.all_cleared(starts, author.id)
                return await self._begin_group(starts, cleared, author, stops)

    async def _begin_group(
        self,
        starts: Sequence[StartRequest],
        cleared: Sequence[Cleared],
        author: Author,
        stops: int,
    ) -> Grouped:
        group = random_id()
        runs: list[Run] = []
        failed: dict[str, str] = {}
        for each, clear in zip(starts, cleared, strict=True):
            try:
                runs.append(await self._begin(each, clear, author, stops, group))
            except Refused as why:
                failed[each.engine] = why.detail
        return Grouped(group, runs, failed, fresh=True)

    async def look(self, asked: GroupRequest, starter: str = "") -> list[Preflight]:
        """What stands between a graph and its start on each engine by this person. Sends nothing but
        a get."""
        return await self._starting.look(asked, starter)

    def _place(self, engine: str) -> anyio.Lock:
        """One start at a time for each robot, and none while it is registered anew."""
        return self._places.setdefault(engine, anyio.Lock())

    async def _known(self, asked: StartRequest) -> Run | None:
        run = await self._idempotent_starts.run_of(asked)
        return None if run is None else await self.find(run)

    def _taken(self, engine: str, graph_name: str = "") -> Run | None:
        """Return the run that keeps an engine from another one, of a graph of this name: rather one that
        goes on than one of which an action may still be loading."""
        going = (each.run for each in self._going(engine).values())
        return min(
            going, key=lambda run: (bool(run.loading), run.graph_name != graph_name), default=None
        )

    def _settled_on(self, engine: str) -> list[Settled]:
        """What somebody has seen at rest there since this process began. A start that others have
        played again is theirs, and was not seen."""
        found = [each for each in self._settled.values() if each.engine == engine]
        return [each for each in found if not self._late_activity.is_of_others(engine, each.run)]

    def _going(self, engine: str) -> dict[str, OpenRun]:
        """The runs that go on there. Whatever else carries the mark of one was sent by others."""
        found = self.open.items()
        return {run: it for run, it in found if it.run.engine == engine and it.run.end is None}

    async def _begin(
        self,
        asked: StartRequest,
        cleared: Cleared,
        author: Author,
        stops: int,
        group: str | None = None,
    ) -> Run:
        number, at = self.next_number(), self._clock_us()
        requested, order = booked(asked, cleared, author, at=at, number=number, group=group)
        overridden = asked.override.codes if asked.override else ()
        name = cleared.ready.name
        if not cleared.own:  # a run that was over may have moved again since it was looked at
            check_items([self._starting.free(asked.engine, name)], overridden)
        with anyio.CancelScope(shield=True):
            run = await self._idempotent_starts.store(requested)
            free = None if cleared.own else self._starting.free(asked.engine, name)
            opened = self._opened(run, cleared.link, own=cleared.own, seq=1)
            if free is not None and stands_in_the_way(free, overridden):
                opened.end("refused", free.text)
            if pressed := self._stops.since(stops, asked.engine, group or ""):
                opened.stop(*pressed)
            self._tasks.start_soon(self._drive, opened, order, cleared.incarnation)
        await opened.published.wait()
        return opened.run

    def next_number(self) -> int:
        """A number for one more run."""
        self._number += 1
        return self._number

    def _opened(self, run: Run, link: Link, *, own: bool, seq: int) -> OpenRun:
        opened = OpenRun(
            run,
            link=link,
            owns_link=own,
            store=self._journal,
            seq=seq,
            clock_us=self._clock_us,
            run_in_worker=self._run_in_worker,
            changed=self._changed,
            loading_times=self._loading_times,
        )
        self.open[run.id] = opened
        self._changed(opened)
        return opened

    async def _drive(self, opened: OpenRun, order: Order | None, incarnation: str = "") -> None:
        begin({"run": opened.run.id})
        await opened.drive(order, incarnation)
        self.open.pop(opened.run.id, None)
        self._late_activity.ended(opened.run, opened.recorder.seq)
        self._news.set()
        self._news = anyio.Event()

    def _changed(self, opened: OpenRun) -> None:
        self._news.set()
        self._news = anyio.Event()
        engine = self.robots.link(opened.run.engine)
        if engine is not None and opened.run.end is not None:
            engine.look_closely()
        for watcher in self._watchers:
            watcher(opened)

    async def change(self, run: str, revision: int) -> None:
        """Wait until an open run is not at this revision any more, or is over and stored."""
        while run in self.open and self.open[run].revision == revision:
            await self._news.wait()

    # --- stop, pause, resume ------------------------------------------------------------------

    def stop_all(self, author: Author, stop_id: str = "") -> StoppedAll:
        """Want everything stopped; what this concerns. Never waits."""
        self._stops.note("", author, stop_id)
        runs = [run for run in tuple(self.open) if self._stop(run, author, stop_id)]
        self.robots.silence(author, self._going)
        return StoppedAll(runs, self.robots.foreign_stops.graphs(), self.robots.unheard())

    def stop_robot(self, name: str, author: Author) -> tuple[list[str], list[str]]:
        """Want whatever a robot runs stopped: runs of ours, graphs of others. Raises NotFound."""
        graphs = self.robots.silence(author, self._going, name)
        self._stops.note(name, author)
        return [run for run in self._going(name) if self._stop(run, author, "")], graphs

    async def stop(self, run: str, author: Author, stop_id: str = "") -> list[str]:
        """Want one run stopped, or all of a group; nothing when it is over. Waits for nothing unless
        the run is not known. Raises NotFound."""
        if run in self.open:
            return [run] if self._stop(run, author, stop_id) else []
        group = [each for each, opened in tuple(self.open.items()) if opened.run.group == run]
        if group:
            self._stops.note(run, author, stop_id)
            return [each for each in group if self._stop(each, author, stop_id)]
        await self._over(run)
        return []

    def _stop(self, run: str, author: Author, stop_id: str) -> bool:
        opened = self.open[run]
        if opened.run.end is not None:
            return False
        opened.stop(author, stop_id)
        return True

    async def pause(self, run: str, author: Author) -> Run:
        """Pause a run. Raises NotFound, Conflict, Unavailable."""
        return await interventions.pause(await self._movable(run), author)

    async def resume(self, run: str, author: Author) -> Run:
        """Let a paused run go on. Raises NotFound, Conflict, Unavailable."""
        return await interventions.resume(await self._movable(run), author)

    async def modify(self, run: str, body: bytes, author: Author) -> Run:
        """Give a run another version of its graph. Raises NotFound, BadInput, Conflict,
        Unavailable, OutcomeUnknown."""
        opened = await self._movable(run)
        engine = self.robots.link(opened.run.engine)
        return await interventions.modify(
            opened,
            body,
            author,
            engine=engine,
            approvals=self.approvals,
            run_in_worker=self._run_in_worker,
        )

    async def confirm_rest(self, run: str, asked: interventions.RestRequest, author: Author) -> Run:
        """Take somebody's word that a run is at rest, where its engine's is none. Raises NotFound,
        BadInput, Conflict."""
        opened = await self._movable(run)
        told = interventions.confirm_rest(opened, asked, author)
        self._settled[run] = Settled(told.engine, run, told.incarnation or "", opened.failed)
        return told

    async def _movable(self, run: str) -> OpenRun:
        opened = self.open.get(run)
        if opened is None or opened.run.end is not None:
            state = opened.run.state if opened is not None else (await self._over(run)).state
            raise Conflict(f"The run is over: {state}.")
        return opened

    # --- what there is ------------------------------------------------------------------------

    async def find(self, run: str) -> Run:
        """A run, open or over. Raises NotFound."""
        opened = self.open.get(run)
        if opened is not None:
            return opened.run
        return await self.history.run(run)

    async def simulates(self, run: str) -> bool:
        """Whether nothing moves in the world because of a run. Raises NotFound."""
        opened = self.open.get(run)
        return bool(
            opened.run.simulated if opened is not None else (await self._over(run)).simulated
        )

    async def _over(self, run: str) -> Row[Any]:
        """What the table tells of a run: that takes no time. Raises NotFound, Unavailable."""
        rows = await self._journal.query(queries.of_run(run))
        if not rows:
            raise NotFound("There is no such run.")
        return rows[0]

    async def register(self, asked: Registration, author: Author) -> Robot:
        """Take a robot into the registry, or change it. Raises BadInput, Conflict, Unavailable."""
        async with self._place(asked.name):
            self._check_unused(asked.name)
            return await self.robots.register(asked, author)

    async def remove(self, robot: str, author: Author) -> None:
        """Take a robot out of the registry. Raises NotFound, Conflict, Unavailable."""
        async with self._place(robot):
            self._check_unused(robot)
            await self.robots.remove(robot, author)

    def _check_unused(self, robot: str) -> None:
        run = self._taken(robot)
        if run is not None:
            raise Conflict(
                f"Run {run.number} goes on {robot}; stop it first. Its Stop would get lost.",
                where={"path": "/name", "run": run.id},
            )
        if self.robots.foreign_stops.going(robot):
            raise Conflict(
                f"Something is being stopped on {robot}; wait until it is.", where={"path": "/name"}
            )

    def _foreign(self, engine: KnownEngine, command: ForeignCommand) -> Commanded:
        """Somebody else has told a robot something: which run of ours that concerns."""
        self._late_activity.sent_by_others(command)
        runs = [each.run for each in self._going(engine.registration.name).values()]
        for each in runs:
            self.open[each.id].hear_of(command)
        run = min(runs, key=lambda each: each.graph_name != command.graph, default=None)
        return Commanded(
            at=command.at,
            command=command.command,
            graph=command.graph,
            umrf=command.umrf,
            targets=command.targets,
            sender=command.sender,
            run=None if run is None else run.id,
            number=None if run is None else run.number,
        )

    # --- after a restart ----------------------------------------------------------------------

    async def _take_up(self) -> None:
        """Adopt what an earlier process left: pending stops first of all; nothing is started."""
        self._number = (await self._journal.query(queries.last_number()))[0][0]
        ground = RegistryContext(
            self._journal,
            self._tasks,
            self._clock_us,
            self._run_in_worker,
            self._robots_changed,
            self._foreign,
            self._late_activity.shows,
            ForeignStopLoop,
        )
        self._tasks.start_soon(self._late_activity.run)
        self.robots.open(ground)
        for row in await self._journal.query(queries.all_robots()):
            self.robots.add(registration_of(row))
        for row in await self._journal.query(queries.open_runs()):
            run, seq, is_whole = await self.history.left(row.id)
            if run is None or run.end is not None:
                log.error("run %s: table and events differ; `rebuild` mends the table", row.id)
                continue
            self._adopt(run, seq, is_whole=is_whole)
        await self.robots.take_up_stops()

    def _reopen(self, run: Run, seq: int, event: MovesAgain) -> None:
        """A run that was over and stored moves again."""
        link = self.robots.link(run.engine) or UnreachableLink(
            "there is no link to this robot any more"
        )
        opened = self._opened(run, link, own=False, seq=seq)
        opened.tell(event)
        self._tasks.start_soon(self._drive, opened, None)

    def _adopt(self, run: Run, seq: int, *, is_whole: bool) -> None:
        link = self.robots.link(run.engine) or UnreachableLink(
            "there is no link to this robot any more"
        )
        opened = self._opened(run, link, own=False, seq=seq)
        if run.simulated:
            opened.tell(Ended(self._clock_us(), "lost", None, _LOST))
        elif not is_whole:
            log.error("run %s: some of its events cannot be read", run.id)
            opened.lose("Some of what was recorded of this run cannot be read.")
        self._tasks.start_soon(self._drive, opened, None)
