"""The runs that are not over: opened, driven until they are stored, and found by id or by engine."""

from collections.abc import Callable
from typing import Final

import anyio

from action_assistant.kit.clock import ClockUs
from action_assistant.logs.context import begin
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.links.port import Link, Order
from action_assistant.runner.links.unreachable import UnreachableLink
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import MovesAgain
from action_assistant.runner.runs.history import RunHistory, RunnerJournal
from action_assistant.runner.runs.run import Run
from action_assistant.runner.start.preflight import Settled
from action_assistant.runner.stop.late_activity import LateActivity
from action_assistant.runner.stop.loading import LoadingTimes
from action_assistant.web.auth.caller import BackgroundTasks
from action_assistant.web.workers.lanes import RunInWorker


class OpenRuns:
    """Opens runs and drives each in a task until it is over and stored. `by_id`: the runs that are
    still driven; `late_activity` reopens a run that was over and moves again."""

    def __init__(
        self,
        journal: RunnerJournal,
        robots: Robots,
        history: RunHistory,
        *,
        clock_us: ClockUs,
        tasks: BackgroundTasks,
        run_in_worker: RunInWorker,
    ) -> None:
        self.by_id: Final[dict[str, OpenRun]] = {}
        self.last_number = 0
        self.late_activity: Final = LateActivity(
            self.by_id, history, robots, tasks, clock_us=clock_us, reopen=self._reopen
        )
        self._journal = journal
        self._robots = robots
        self._history = history
        self._clock_us = clock_us
        self._tasks = tasks
        self._run_in_worker = run_in_worker
        self._loading_times = LoadingTimes()
        self._watchers: list[Callable[[OpenRun], None]] = []
        self._news = anyio.Event()
        self._settled: dict[str, Settled] = {}

    def next_number(self) -> int:
        """Return the number for a new run. Each number is given once."""
        self.last_number += 1
        return self.last_number

    # --- opening and driving ------------------------------------------------------------------

    def open(self, run: Run, link: Link | None, *, owns_link: bool, seq: int) -> OpenRun:
        """Open a stored run on a link, and announce it. `seq` is the number of the run's last
        stored event; `owns_link` says that the link is closed with the run. A run without a
        link, whose robot is not registered any more, gets a link that never answers."""
        opened = OpenRun(
            run,
            link=link
            if link is not None
            else UnreachableLink("there is no link to this robot any more"),
            owns_link=owns_link,
            store=self._journal,
            seq=seq,
            clock_us=self._clock_us,
            run_in_worker=self._run_in_worker,
            changed=self._changed,
            loading_times=self._loading_times,
        )
        self.by_id[run.id] = opened
        self._changed(opened)
        return opened

    def drive(self, opened: OpenRun, order: Order | None = None, incarnation: str = "") -> None:
        """Drive an open run in a task of its own. With an order, first start it, exactly once, in
        the life `incarnation` of the engine; without one, continue from its present state."""
        self._tasks.start_soon(self._drive, opened, order, incarnation)

    async def _drive(self, opened: OpenRun, order: Order | None, incarnation: str) -> None:
        begin({"run": opened.run.id})
        await opened.drive(order, incarnation)
        self.by_id.pop(opened.run.id, None)
        self.late_activity.ended(opened.run, opened.recorder.seq)
        self._news.set()
        self._news = anyio.Event()

    def _reopen(self, run: Run, seq: int, event: MovesAgain) -> None:
        """Open a run that was over and stored, since it moves again."""
        opened = self.open(run, self._robots.link(run.engine), owns_link=False, seq=seq)
        opened.tell(event)
        self.drive(opened)

    # --- changes ------------------------------------------------------------------------------

    def watch(self, watcher: Callable[[OpenRun], None]) -> None:
        """Call `watcher` with every run that has changed, at once and on the event loop."""
        self._watchers.append(watcher)

    async def change(self, run: str, revision: int) -> None:
        """Wait until an open run has another revision than `revision`, or is over and stored."""
        while run in self.by_id and self.by_id[run].revision == revision:
            await self._news.wait()

    def _changed(self, opened: OpenRun) -> None:
        self._news.set()
        self._news = anyio.Event()
        run = opened.run
        if run.end is not None and run.at_rest is not None and not run.simulated:
            life = run.incarnation or ""
            self._settled[run.id] = Settled(run.engine, run.id, life, opened.failed)
        engine = self._robots.link(opened.run.engine)
        if engine is not None and opened.run.end is not None:
            engine.look_closely()
        for watcher in self._watchers:
            watcher(opened)

    # --- queries ------------------------------------------------------------------------------

    async def find(self, run: str) -> Run:
        """Return a run, open or over. Raise NotFound if there is no such run."""
        opened = self.by_id.get(run)
        return opened.run if opened is not None else await self._history.run(run)

    def on(self, engine: str) -> dict[str, OpenRun]:
        """Return the runs on an engine without an end, by id. A graph with the id of any other run
        was sent by somebody else."""
        found = self.by_id.items()
        return {
            run: each for run, each in found if each.run.engine == engine and each.run.end is None
        }

    def occupying(self, engine: str, graph_name: str = "") -> Run | None:
        """Return the run that prevents a start of a graph of this name on an engine; None if it is
        free. A moving run comes before one that may only be loading, then one of this graph name
        before others."""
        runs = (each.run for each in self.on(engine).values())
        return min(
            runs, key=lambda run: (bool(run.loading), run.graph_name != graph_name), default=None
        )

    def settled_on(self, engine: str) -> tuple[Settled, ...]:
        """Return the runs on an engine that ended since this process began because they were at
        rest, by a person's word or the end of their code. Runs whose start message somebody else
        has sent again are left out."""
        found = (each for each in self._settled.values() if each.engine == engine)
        is_of_others = self.late_activity.is_of_others
        return tuple(each for each in found if not is_of_others(engine, each.run))
