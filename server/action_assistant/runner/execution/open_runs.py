"""The runs that are not over: opened, driven until they are stored, and found by id or by engine."""

from collections.abc import Callable
from typing import Final

import anyio

from action_assistant.kit.lru_cache import LruCache
from action_assistant.logs import begin
from action_assistant.runner.execution.run_loop import OpenRun, PieceHooks
from action_assistant.runner.links.port import ForeignCommand, Leaves, Link, Order, unwatched
from action_assistant.runner.links.unreachable import UnreachableLink
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import Author, MovesAgain
from action_assistant.runner.runs.history import RunHistory
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runtime import Runtime
from action_assistant.runner.stop.loading import LoadingTimes

_CLOSED: Final = 200  # newest runs that are over and kept in memory


class OpenRuns:
    """Opens runs and drives each in a task until it is over and stored. `by_id`: the runs that are
    still driven; `closed`: the newest ones that were driven to their end, each with the seq of its
    last event."""

    def __init__(self, robots: Robots, history: RunHistory, runtime: Runtime) -> None:
        self.by_id: Final[dict[str, OpenRun]] = {}
        self.last_number = 0
        self.closed: Final[LruCache[str, tuple[Run, int]]] = LruCache(_CLOSED)
        self._robots = robots
        self._history = history
        self._runtime = runtime
        self._loading_times = LoadingTimes()
        self._watchers: list[Callable[[OpenRun], None]] = []
        self._news = anyio.Event()

    def next_number(self) -> int:
        """Return the number for a new run; no two calls return the same number."""
        self.last_number += 1
        return self.last_number

    def admitted(self, newest: int | None) -> tuple[str, ...]:
        """Return the ids of the open runs with a number up to `newest`; of all if it is None. A piece has
        the number of its whole run."""
        runs = self.by_id.items()
        return tuple(each for each, it in runs if newest is None or it.run.number <= newest)

    # --- opening and driving ------------------------------------------------------------------

    def open(
        self,
        run: Run,
        link: Link | None,
        *,
        owns_link: bool,
        seq: int,
        piece: PieceHooks | None = None,
        pressed: Callable[[Author], None] | None = None,
        may_leave: Leaves = unwatched,
    ) -> OpenRun:
        """Open a stored run on a link, announce it to watchers and return it. `seq`: the number of
        the run's last stored event; `owns_link`: the link is closed with the run; `link`: None if
        the robot is not registered any more: such a run gets a link that never answers. `piece`:
        ties a piece to its led run; `pressed`: called first when a person stops a led
        run; `may_leave`: called right before its start leaves, and raises NotSent if it may not."""
        opened = OpenRun(
            run,
            link=link
            if link is not None
            else UnreachableLink("there is no link to this robot any more"),
            owns_link=owns_link,
            store=self._runtime.journal,
            seq=seq,
            clock_us=self._runtime.clock_us,
            run_in_worker=self._runtime.run_in_worker,
            changed=self._changed,
            loading_times=self._loading_times,
            piece=piece,
            pressed=pressed,
            may_leave=may_leave,
        )
        self.by_id[run.id] = opened
        self._changed(opened)
        return opened

    def drive(self, opened: OpenRun, order: Order | None = None, incarnation: str = "") -> None:
        """Drive an open run in a task of its own; the call does not wait. With an order, the start
        message is sent first, exactly once, and recorded with `incarnation`, the id of the engine
        process that was checked for it; without one, the run continues from its present state."""
        self._runtime.tasks.start_soon(self._drive, opened, order, incarnation)

    async def _drive(self, opened: OpenRun, order: Order | None, incarnation: str) -> None:
        begin({"run": opened.run.id})
        await opened.drive(order, incarnation)
        self.by_id.pop(opened.run.id, None)
        self.closed.put(opened.run.id, (opened.run, opened.recorder.seq))
        self._news.set()
        self._news = anyio.Event()

    def reopen(self, run: Run, seq: int, event: MovesAgain) -> None:
        """Open a run that had ended and was stored, since it moves again, and drive it. `seq`: the
        number of its last stored event; `event`: says that it moves."""
        opened = self.open(run, self._robots.link(run.engine), owns_link=False, seq=seq)
        opened.tell(event)
        self.drive(opened)

    # --- changes ------------------------------------------------------------------------------

    def watch(self, watcher: Callable[[OpenRun], None]) -> None:
        """Call `watcher` with every run that has changed, at once and on the event loop."""
        self._watchers.append(watcher)

    async def change(self, run: str, revision: int) -> None:
        """Wait until an open run has another revision number than `revision`, or is over and
        stored. Return at once if it is not open."""
        while run in self.by_id and self.by_id[run].revision == revision:
            await self._news.wait()

    def _changed(self, opened: OpenRun) -> None:
        self._news.set()
        self._news = anyio.Event()
        engine = self._robots.link(opened.run.engine)
        if engine is not None and opened.run.end is not None:
            engine.look_closely()
        for watcher in self._watchers:
            watcher(opened)

    def hear_of(self, robot: str, command: ForeignCommand) -> Run | None:
        """Pass a command that another program has sent to a robot on to the runs there. Return the
        run that it most likely concerns, one of the same graph before others; None if no run is
        open there."""
        opened = [each for each in self.on(robot).values() if each.run.led is None]
        for each in opened:
            each.hear_of(command)
        runs = (each.run for each in opened)
        return min(runs, key=lambda run: run.graph_name != command.graph, default=None)

    # --- queries ------------------------------------------------------------------------------

    async def find(self, run: str) -> Run:
        """Return a run, open or over. Raise NotFound if there is no such run."""
        opened = self.by_id.get(run)
        return opened.run if opened is not None else await self._history.run(run)

    def on(self, engine: str) -> dict[str, OpenRun]:
        """Return the runs on an engine that have not ended, by id. A graph that the engine shows
        under any other id was started by another program."""
        found = self.by_id.items()
        return {
            run: each for run, each in found if engine in each.run.robots and each.run.end is None
        }

    def occupying(self, engine: str, graph_name: str = "", *, apart_from: str = "") -> Run | None:
        """Return the open run that keeps an engine occupied; None if the engine is free. Of
        several runs, one that has begun comes before one that is only loading, then one of the
        graph `graph_name` before others. `apart_from`: the id of a led run; this run and its
        pieces do not count."""
        runs = [
            each.run
            for each in self.on(engine).values()
            if apart_from not in {each.run.id, each.run.piece and each.run.piece.run}
        ]
        return min(
            runs, key=lambda run: (bool(run.loading), run.graph_name != graph_name), default=None
        )
