"""The execution service: starts at most once, stops until proven, takes up what a crash left.

All of it lives on one event loop. Runs that are not over are in memory; the journal has everything.
"""

import logging
import secrets
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Final
from weakref import WeakValueDictionary

import anyio
import msgspec
from anyio.abc import TaskGroup

from action_assistant.errors import Conflict, Refused, Unavailable
from action_assistant.journal.events import Draft
from action_assistant.runner import archive
from action_assistant.runner.admission import Admitted, StartRequest, admit
from action_assistant.runner.driving import Clock, OpenRun
from action_assistant.runner.events import Author, Ended, Requested, encode
from action_assistant.runner.history import Aside, History, Ledger
from action_assistant.runner.links.absent import AbsentLink
from action_assistant.runner.links.port import Link, NoAnswer, NotSent, Order, Registration
from action_assistant.runner.links.simulator import SimulatorLink
from action_assistant.runner.recorder import stream_of
from action_assistant.runner.robots import (
    SIMULATOR,
    STREAM,
    Registered,
    Robot,
    Robots,
    check_registration,
)
from action_assistant.runner.runs import ENDED, Run, begin
from action_assistant.umrf import codec
from action_assistant.umrf.facts import PINNED, SIMULATED
from action_assistant.umrf.semantics import Engine

log: Final = logging.getLogger(__name__)

_PREFLIGHT_S: Final = 2.0
_LOST: Final = (
    "The runner ended while this simulation went on, and the simulated engine with it. Nothing "
    "shows how it would have ended."
)


class Started(msgspec.Struct, frozen=True):
    """The answer to a start. `fresh` is false when the request had been carried out before."""

    run: Run
    fresh: bool


class Control:
    """Everything that goes on. `opened` gives it, with its tasks running."""

    def __init__(
        self, ledger: Ledger, robots: Robots, *, wall: Clock, tasks: TaskGroup, aside: Aside
    ) -> None:
        self.robots = robots
        self.history = History(ledger, aside)
        self.open: dict[str, OpenRun] = {}
        self._ledger = ledger
        self._wall = wall
        self._tasks = tasks
        self._aside = aside
        self._watchers: list[Callable[[OpenRun], None]] = []
        self._news = anyio.Event()
        self._asking: WeakValueDictionary[str, anyio.Lock] = WeakValueDictionary()
        self._places: dict[str, anyio.Lock] = {}
        self._number = 0
        self._stops = 0  # how often everything was stopped
        self._last_stop: tuple[Author, str] | None = None

    @classmethod
    @asynccontextmanager
    async def opened(
        cls,
        ledger: Ledger,
        robots: Robots,
        *,
        wall: Clock,
        aside: Aside = anyio.to_thread.run_sync,
    ) -> "AsyncIterator[Control]":
        """The service, after it has taken up what an earlier process left."""
        async with anyio.create_task_group() as tasks:
            control = cls(ledger, robots, wall=wall, tasks=tasks, aside=aside)
            await control._take_up()
            try:
                yield control
            finally:
                tasks.cancel_scope.cancel()

    def watch(self, watcher: Callable[[OpenRun], None]) -> None:
        """Be told, at once, of every run that has changed."""
        self._watchers.append(watcher)

    # --- start --------------------------------------------------------------------------------

    async def start(self, asked: StartRequest, author: Author) -> Started:
        """Carry out a start, at most once per request. Raises Refused of many kinds; then nothing
        was sent. Returns after the one message has left."""
        stops = self._stops
        lock = self._asking.get(asked.request_id)
        if lock is None:
            lock = self._asking[asked.request_id] = anyio.Lock()
        async with lock:
            known = await self._known(asked)
            if known is not None:
                return Started(known, fresh=False)
            if asked.engine == SIMULATOR:
                admitted = await self._aside(lambda: admit(asked, SIMULATED))
                engine = Engine(facts=SIMULATED, script=admitted.script)
                link = SimulatorLink(engine, wall=self._wall)
                run = await self._begin(asked, admitted, author, link, stops, own=True)
                return Started(run, fresh=True)
            robot = self.robots.reachable(asked.engine)
            async with self._places.setdefault(asked.engine, anyio.Lock()):
                admitted = await self._aside(lambda: admit(asked, PINNED))
                self._check_free(asked.engine)
                run = await self._begin(asked, admitted, author, robot, stops, own=False)
                return Started(run, fresh=True)

    async def _known(self, asked: StartRequest) -> Run | None:
        rows = await self._ledger.query(archive.by_request(asked.request_id))
        if not rows:
            return None
        row = rows[0]
        if (row.digest, row.engine) != (asked.digest, asked.engine):
            raise Conflict(
                "This request_id belongs to another start.", where={"path": "/request_id"}
            )
        return await self.find(row.id)

    def _check_free(self, engine: str) -> None:
        for other in self.open.values():
            if other.run.engine == engine and other.run.end is None:
                run = other.run
                raise Conflict(
                    f"{engine} is taken by run {run.number} of {run.graph_name}, started by "
                    f"{run.author.name}; it is {run.state}.",
                    where={"path": "/engine", "run": run.id},
                )

    async def _begin(
        self,
        asked: StartRequest,
        admitted: Admitted,
        author: Author,
        link: Link,
        stops: int,
        *,
        own: bool,
    ) -> Run:
        incarnation = await self._answering(link, asked.engine)
        self._number += 1
        number = self._number
        requested, order = await self._aside(
            lambda: self._order(asked, admitted, author, number, simulated=own)
        )
        with anyio.CancelScope(shield=True):
            run = await self._store(requested)
            opened = self._opened(run, link, own=own, seq=1)
            if self._stops != stops and self._last_stop is not None:
                opened.stop(*self._last_stop)  # everything was stopped since this was asked for
            self._tasks.start_soon(self._drive, opened, order, incarnation)
        await opened.published.wait()
        return opened.run

    async def _answering(self, link: Link, engine: str) -> str:
        """A get sent for this start, on the path that would confirm its stop."""
        try:
            with anyio.fail_after(_PREFLIGHT_S):
                return (await link.get()).incarnation
        except (NoAnswer, TimeoutError) as nothing:
            raise Unavailable(
                f"{engine} does not answer, so a stop could not be confirmed either. "
                f"Nothing was sent. {nothing}".rstrip(),
                where={"path": "/engine"},
            ) from nothing

    def _order(
        self,
        asked: StartRequest,
        admitted: Admitted,
        author: Author,
        number: int,
        *,
        simulated: bool,
    ) -> tuple[Requested, Order]:
        run, graph = secrets.token_urlsafe(9), admitted.graph
        umrf = codec.write(graph, codec.Stamp(admitted.graph_id, asked.version, run))
        requested = Requested(
            at=self._wall(),
            run=run,
            number=number,
            request_id=asked.request_id,
            author=author,
            graph=admitted.graph_id,
            graph_name=graph.name,
            version=asked.version,
            digest=admitted.digest,
            engine=asked.engine,
            simulated=simulated,
            actions={each.full_name: each.key for each in graph.actions if not each.missing},
            umrf=umrf,
            script=admitted.script_text,
            override=asked.override,
        )
        targets = () if simulated else (asked.engine,)
        return requested, Order(run=run, graph=graph, umrf=umrf, targets=targets)

    async def _store(self, requested: Requested) -> Run:
        """What cannot be recorded is not started."""
        stream = stream_of(requested.run)
        draft = Draft(requested.kind, requested.author.id, encode(requested))
        try:
            await self._ledger.append(stream, [draft], expected=0)
        except Refused as refused:
            self._tasks.start_soon(self._disown, requested.run)
            raise Unavailable(
                f"The run could not be recorded, so nothing was started. {refused.detail}"
            ) from refused
        return begin(requested)

    async def _disown(self, run: str) -> None:
        """A commit whose answer got lost may still have happened: then say that nothing was sent."""
        stream = stream_of(run)
        end = Ended(self._wall(), "refused", None, "It could not be recorded in time.")
        while True:
            try:
                seq = await self._ledger.newest(stream)
                if seq:
                    await self._ledger.append(stream, [Draft(end.kind, "", encode(end))])
                return
            except Refused:
                await anyio.sleep(1)

    def _opened(self, run: Run, link: Link, *, own: bool, seq: int) -> OpenRun:
        opened = OpenRun(
            run,
            link=link,
            owns_link=own,
            store=self._ledger,
            seq=seq,
            wall=self._wall,
            changed=self._changed,
        )
        self.open[run.id] = opened
        self._changed(opened)
        return opened

    async def _drive(self, opened: OpenRun, order: Order | None, incarnation: str = "") -> None:
        await opened.drive(order, incarnation)
        self.open.pop(opened.run.id, None)
        self._news.set()
        self._news = anyio.Event()

    def _changed(self, opened: OpenRun) -> None:
        self._news.set()
        self._news = anyio.Event()
        for watcher in self._watchers:
            watcher(opened)

    async def change(self, run: str, revision: int) -> None:
        """Wait until an open run is not at this revision any more, or is over and stored."""
        while run in self.open and self.open[run].revision == revision:
            await self._news.wait()

    # --- stop, pause, resume ------------------------------------------------------------------

    def stop_all(self, author: Author, stop_id: str = "") -> list[str]:
        """Want everything stopped; the runs that this concerns. Never waits."""
        self._stops += 1
        self._last_stop = (author, stop_id)
        return [run for run in tuple(self.open) if self._stop(run, author, stop_id)]

    async def stop(self, run: str, author: Author, stop_id: str = "") -> list[str]:
        """Want one run stopped; nothing when it is over. Waits for nothing unless the run is not
        known. Raises NotFound."""
        if run in self.open:
            return [run] if self._stop(run, author, stop_id) else []
        await self.find(run)
        return []

    def _stop(self, run: str, author: Author, stop_id: str) -> bool:
        opened = self.open[run]
        if opened.run.end is not None:
            return False
        opened.stop(author, stop_id)
        return True

    async def pause(self, run: str, author: Author) -> Run:
        """Pause a run. Raises NotFound, Conflict."""
        opened = await self._movable(run)
        if opened.run.state != "running" or opened.run.desired != "running":
            raise Conflict(
                f"Only a running run can be paused; this one is {_condition(opened.run)}."
            )
        if not opened.pauses:
            raise Conflict(f"Pausing is not safe on {opened.run.engine}; use Stop.")
        try:
            await opened.pause(author)
        except NotSent as why:
            raise Unavailable(f"The pause could not be sent: {why}") from why
        return opened.run

    async def resume(self, run: str, author: Author) -> Run:
        """Let a paused run go on. Raises NotFound, Conflict."""
        opened = await self._movable(run)
        if opened.run.desired != "paused":
            raise Conflict(f"Only a paused run can go on; this one is {_condition(opened.run)}.")
        try:
            await opened.resume(author)
        except NotSent as why:
            raise Unavailable(f"The resume could not be sent: {why}") from why
        return opened.run

    async def modify(self, run: str) -> Run:
        """Changing a running graph is offered nowhere yet. Raises NotFound, Conflict."""
        opened = await self._movable(run)
        raise Conflict(f"A running graph cannot be changed on {opened.run.engine}; stop it first.")

    async def _movable(self, run: str) -> OpenRun:
        opened = self.open.get(run)
        if opened is None or opened.run.end is not None:
            found = opened.run if opened is not None else await self.find(run)
            raise Conflict(f"The run is over: {found.state}.")
        return opened

    # --- what there is ------------------------------------------------------------------------

    async def find(self, run: str) -> Run:
        """A run, open or over. Raises NotFound."""
        opened = self.open.get(run)
        if opened is not None:
            return opened.run
        return await self.history.run(run)

    async def register(self, asked: Registration, author: Author) -> Robot:
        """Take a robot into the registry. Raises BadInput, Conflict, Unavailable."""
        check_registration(asked)
        body = Registered(at=self._wall(), **msgspec.structs.asdict(asked))
        draft = Draft(Registered.kind, author.id, msgspec.json.encode(body))
        await self._ledger.append(STREAM, [draft])
        self.robots.add(asked)
        return next(each for each in self.robots.all() if each.name == asked.name)

    # --- after a restart ----------------------------------------------------------------------

    async def _take_up(self) -> None:
        """Adopt what an earlier process left: pending stops first of all; nothing is started."""
        self._number = (await self._ledger.query(archive.last_number()))[0][0]
        for row in await self._ledger.query(archive.all_robots()):
            self.robots.add(
                Registration(
                    name=row.name,
                    domain=row.domain,
                    rmw=row.rmw,
                    get_service=row.get_service,
                    profile=row.profile,
                )
            )
        for row in await self._ledger.query(archive.open_runs()):
            try:
                run, seq = await self.history.replayed(row.id)
            except msgspec.DecodeError:
                log.exception("run %s cannot be read; it is left as it is", row.id)
                continue
            if run is None or run.state in ENDED:
                log.error("run %s: table and events differ; `rebuild` mends the table", row.id)
                continue
            self._adopt(run, seq)

    def _adopt(self, run: Run, seq: int) -> None:
        link = self.robots.link(run.engine) or AbsentLink("there is no link to this robot any more")
        opened = self._opened(run, link, own=False, seq=seq)
        if run.simulated:
            opened.tell(Ended(self._wall(), "lost", None, _LOST))
        self._tasks.start_soon(self._drive, opened, None)


def _condition(run: Run) -> str:
    return "being paused" if (run.state, run.desired) == ("running", "paused") else run.state
