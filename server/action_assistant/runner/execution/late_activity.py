"""Late activity: opens runs again that are over and move, since an action was still being loaded.

An engine neither counts nor shows an action that it loads. So runs are watched after their end, and an end
that turns out to be wrong is taken back.
"""

import logging
from collections import deque
from typing import Final

import anyio
import msgspec

from action_assistant.errors import NotFound, Refused
from action_assistant.kit.lru_cache import LruCache
from action_assistant.runner.execution.open_runs import OpenRuns
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.links.engine_text import run_in
from action_assistant.runner.links.observations import ACTIVE, Snapshot
from action_assistant.runner.links.port import ForeignCommand, NoAnswer
from action_assistant.runner.robots.engine import KnownEngine
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.robot_events import Commanded
from action_assistant.runner.runs.events import MovesAgain
from action_assistant.runner.runs.history import RunHistory
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runtime import Runtime
from action_assistant.runner.start.preflight import Settled

log: Final = logging.getLogger(__name__)

_GET_S: Final = 1.0
_PATIENCE_S: Final = 3.0  # after which feedback counts although no answer confirms it
_AGAIN_S: Final = 0.5
_OVERTAKEN_US: Final = 3_000_000  # for which an answer may be under way
_KEPT: Final = 200
_LOG_ENTRIES: Final = 500  # newest entries of a robot's log


class LateActivity:
    """Watches for runs that had ended but that an engine shows moving, and opens them again. It
    also knows which runs ended without a proof by their engine."""

    def __init__(
        self,
        runs: OpenRuns,
        history: RunHistory,
        robots: Robots,
        runtime: Runtime,
    ) -> None:
        self._runs = runs
        self._history = history
        self._robots = robots
        self._tasks = runtime.tasks
        self._clock_us = runtime.clock_us
        self._looking: set[tuple[str, str]] = set()  # robots and runs
        self._waiting: deque[tuple[KnownEngine, Snapshot, str]] = deque()
        self._news = anyio.Event()
        self._settled: dict[str, Settled] = {}
        self._others: LruCache[str, bool] = LruCache(_KEPT)
        #: Runs that a robot shows and that are not its own: one engine may be registered under two names.
        self._elsewhere: LruCache[tuple[str, str], bool] = LruCache(_KEPT)
        runs.watch(self._changed)

    def _changed(self, opened: OpenRun) -> None:
        run = opened.run
        if run.end is not None and run.at_rest is not None and not run.simulated:
            life = run.incarnation or ""
            self._settled[run.id] = Settled(run.engine, run.id, life, opened.failed)

    def settled_on(self, engine: str) -> tuple[Settled, ...]:
        """Return the runs on an engine that ended, since this process began, by a person's
        statement or the end of their code instead of a proof by the engine. Runs whose start
        message another program has published again are not among them."""
        found = (each for each in self._settled.values() if each.engine == engine)
        return tuple(each for each in found if not self._is_of_others(engine, each.run))

    def sent_by_others(self, command: ForeignCommand) -> None:
        """Remember that another program has published a start message of this runner again, so that
        the graph which it starts is not taken for the runner's own run. `command`: the message as
        it was observed; other commands are ignored."""
        run = run_in(command.umrf) if command.umrf else None
        if run is not None:
            self._others.put(run, True)

    def _is_of_others(self, robot: str, run: str) -> bool:
        """Return whether another program has started the graph that a robot shows under this run's
        id."""
        return bool(self._others.get(run) or self._elsewhere.get((robot, run)))

    def shows(self, engine: KnownEngine, snapshots: tuple[Snapshot, ...]) -> None:
        """Check the graphs (`snapshots`) that an engine reports in an answer or by feedback. If a
        graph moves although its run has ended, queue it for the method `run`. Do not wait."""
        robot = engine.registration.name
        for each in snapshots:
            if each.run is None or not each.active or (robot, each.run) in self._looking:
                continue
            if self._is_over(robot, each.run):
                self._looking.add((robot, each.run))
                self._waiting.append((engine, each, each.run))
                self._news.set()

    async def run(self) -> None:
        """Examine each run that was shown moving after its end, until cancelled."""
        while True:
            await self._news.wait()
            self._news = anyio.Event()
            while self._waiting:
                self._tasks.start_soon(self._look_into, *self._waiting.popleft())

    def _is_over(self, robot: str, run: str) -> bool:
        if self._is_of_others(robot, run):
            return False
        opened = self._runs.by_id.get(run)
        return opened is None or opened.run.end is not None

    async def _look_into(self, engine: KnownEngine, shown: Snapshot, run: str) -> None:
        robot = engine.registration.name
        try:
            moving = shown if shown.source == "get" else await _asked(engine, shown, run)
            if moving is not None and self._is_over(robot, run):
                await self._take_back(engine, moving, run)
        except Exception:  # the next snapshot of this run is examined again
            log.exception("whether run %s moves again cannot be told", run)
        finally:
            self._looking.discard((robot, run))

    async def _take_back(self, engine: KnownEngine, shown: Snapshot, run: str) -> None:
        opened, robot = self._runs.by_id.get(run), engine.registration.name
        if opened is not None and _is_older(shown, opened.run):
            return
        if opened is not None and opened.run.engine != robot:
            self._elsewhere.put((robot, run), True)
            return
        if opened is not None and opened.moves_again(self._moves_again(opened.run, shown)):
            return
        while run in self._runs.by_id:  # noqa: ASYNC110 - it is just being left
            await anyio.sleep(0.01)
        found = await self._known(run, robot)
        if found is None or not _is_of(found[0], engine):
            self._elsewhere.put((robot, run), True)
        elif found[0].end is None or _is_older(shown, found[0]):
            return  # it is being adopted after a restart, or the answer tells of an earlier moment
        else:
            self._runs.reopen(*found, self._moves_again(found[0], shown))

    async def _known(self, run: str, robot: str) -> tuple[Run, int] | None:
        """Return a run that is not open in this process, and the number (`seq`) of its last event.
        Return None if there is no such run, if it cannot be decoded, or if the log of the robot
        says that another program published its start again. While the journal cannot be read, wait
        and retry."""
        if (closed := self._runs.closed.get(run)) is not None:
            return closed
        while True:
            try:
                entries = await self._robots.robot_log.newest(robot, _LOG_ENTRIES)
                found, seq = await self._history.followed(run)
            except NotFound:
                return None
            except Refused:
                await anyio.sleep(_AGAIN_S)
            except msgspec.DecodeError:
                return None
            else:
                played = any(
                    isinstance(each, Commanded) and run_in(each.umrf) == run for _, each in entries
                )
                return None if played or found is None else (found, seq)

    def _moves_again(self, run: Run, shown: Snapshot) -> MovesAgain:
        nodes = ", ".join(name for name, state in shown.nodes.items() if state in ACTIVE)
        text = (
            f"MOVES AGAIN: {run.engine} shows {nodes} moving in {run.graph_name}, after the run "
            f"had been called {run.end}."
        )
        return MovesAgain(self._clock_us(), text)


async def _asked(engine: KnownEngine, shown: Snapshot, run: str) -> Snapshot | None:
    """Ask an engine whether a run still moves. Return the run's snapshot in the answer if it shows
    it moving, else None. If no answer comes within 3 s, return `shown`, the feedback that gave rise
    to the question: feedback alone may be late or forged."""
    with anyio.move_on_after(_PATIENCE_S):
        while True:
            try:
                with anyio.fail_after(_GET_S):
                    answer = await engine.get()
            except (NoAnswer, TimeoutError):
                await anyio.sleep(0.1)
            else:
                return next(
                    (each for each in answer.graphs if each.run == run and each.active), None
                )
    return shown


def _is_older(shown: Snapshot, run: Run) -> bool:
    """Return whether the answer in which a snapshot came was requested shortly before the end of
    the run, so that it says nothing about the time after. A snapshot requested long before the end
    counts: the clock may have been set back."""
    if shown.asked_at is None or run.ended_at is None:
        return False
    return 0 < run.ended_at - shown.asked_at < _OVERTAKEN_US


def _is_of(run: Run, engine: KnownEngine) -> bool:
    """Return whether a run was sent to the engine process that answers now, and not to one before
    its restart. True if either is unknown."""
    lives = {run.incarnation, engine.standing.incarnation} - {None, ""}
    return run.engine == engine.registration.name and len(lives) <= 1
