"""The repeats of this process: which are open, what closes them, and the starts of their cells.

A repeat is open in the memory of the process in which a person opened it, and nowhere else: after a
restart of the runner it is closed, whatever its stream says. It is closed in the step in which the reason
is seen, and stored as soon as possible. A person starts each cell, except in the simulator, where
a repeat may go on by itself. A cell is started at most once: its start has one request id for ever.
"""

import logging
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from typing import Final

import anyio
import anyio.lowlevel
import msgspec

from action_assistant.errors import BadInput, Conflict, NotFound, Refused, Unavailable
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.execution.doubts import Closable, DoubtWatch
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.execution.start_pipeline import Started
from action_assistant.runner.repeats.repeat import (
    NextRequest,
    ReopenRequest,
    Repeat,
    RepeatClosed,
    RepeatEvent,
    RepeatOpened,
    RepeatReopened,
    RepeatRequest,
    StartKept,
    cells_of,
    follow,
    named,
    order_of,
    repeat_id,
    replay,
    start_in,
    stream_of,
)
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.doubts import Doubt
from action_assistant.runner.runs.events import Author, PartOfRepeat, draft_of
from action_assistant.runner.runs.history import RunnerJournal
from action_assistant.runner.runs.run import Run
from action_assistant.runner.start.admission import StartRequest, Watching
from action_assistant.runner.start.kept_starts import group_of, require_form, text_of
from action_assistant.runner.start.orders import (
    InRepeat,
    engines_of,
    graphs_inside,
    watched_in,
)
from action_assistant.runner.start.preflight import Preflight
from action_assistant.web.auth.caller import BackgroundTasks
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.rights import Denied, may
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_MOST: Final = 200  # repeats in memory
_LISTED: Final = 400  # newest events of repeats that a list reads
_STORE_S: Final = 1.0  # between two attempts to store that one is closed
_WAIT_S: Final = 5.0  # for that, before it is opened again
_RESTARTED: Final = "The runner was started again. Nothing of a repeat goes on after that."


class _Record(Closable):
    """A repeat in memory. `runs`: the run of each cell that was started; `openings`: how often it was
    opened in this process; `since`: when the newest doubt was seen, or it came into memory, µs UTC, at each
    doubt a later one; `turn`: one start at a time; `storing`: one event at a time."""

    def __init__(self, repeat: Repeat, start: StartRequest, since: int) -> None:
        super().__init__(repeat.opened.robots)
        self.repeat = repeat
        self.start = start
        self.since = since
        self.runs: dict[int, str] = {}
        self.openings = 0
        self.turn = anyio.Lock()
        self.storing = anyio.Lock()
        self.news = anyio.Event()

    def owns(self, run: str) -> bool:
        """Return whether a run is that of one of its cells."""
        return run in self.runs.values()

    @property
    def next_cell(self) -> int | None:
        """The number of the first cell that was not started; None after the last one."""
        cells = range(1, len(self.repeat.opened.cells) + 1)
        return next((cell for cell in cells if cell not in self.runs), None)

    def has_changed(self, doubts: int) -> bool:
        """Return whether it is open, or more than these doubts were seen."""
        return self.is_open or self.doubts != doubts

    def tell(self) -> None:
        """Wake up who waits for a change."""
        self.news.set()
        self.news = anyio.Event()


class Repeats:
    """Opens, closes and carries out repeats. Use the context manager `opened` to get one. `author`
    is the person in whose name a command is recorded."""

    def __init__(
        self,
        control: ExecutionService,
        journal: RunnerJournal,
        clock_us: ClockUs,
        tasks: BackgroundTasks,
        run_in_worker: RunInWorker,
    ) -> None:
        self._control = control
        self._journal = journal
        self._clock_us = clock_us
        self._tasks = tasks
        self._run_in_worker = run_in_worker
        self._records: dict[str, _Record] = {}
        self._opening = anyio.Lock()
        self._doubts = DoubtWatch[_Record](
            control, self._records.values, self._close, self._doubted
        )
        control.watch(self._run_changed)

    @classmethod
    @asynccontextmanager
    async def opened(
        cls,
        control: ExecutionService,
        journal: RunnerJournal,
        *,
        clock_us: ClockUs,
        run_in_worker: RunInWorker,
    ) -> "AsyncIterator[Repeats]":
        """Return a context with the repeats of a runner. Those that an earlier process left open are
        closed."""
        async with anyio.create_task_group() as tasks:
            repeats = cls(control, journal, clock_us, BackgroundTasks(tasks), run_in_worker)
            await repeats._close_left()
            try:
                yield repeats
            finally:
                repeats._records.clear()  # runs change further, while nobody stores what that closes
                tasks.cancel_scope.cancel()

    # --- what there is ------------------------------------------------------------------------

    async def find(self, id_: str) -> Repeat:
        """Return a repeat as it is now. Raise NotFound if there is no such repeat, Unavailable if the
        journal cannot be read."""
        record = self._records.get(id_)
        if record is not None:
            return record.repeat
        events = await self._journal.read(stream_of(id_))
        return self._as_now(replay((each.kind, each.body) for each in events))

    async def newest(self) -> list[Repeat]:
        """Return the repeats of which something was stored last, the newest first. Raise Unavailable if
        the journal cannot be read."""
        rows = await self._journal.query(queries.repeats(StartKept.kind, _LISTED))
        by_stream: dict[str, list[tuple[str, bytes]]] = {}
        for row in rows:
            by_stream.setdefault(row.stream, []).insert(0, (row.kind, row.body))
        found: list[Repeat] = []
        for events in by_stream.values():
            await anyio.lowlevel.checkpoint()  # they may be large
            try:
                repeat = replay(events)
            except msgspec.DecodeError:
                log.exception("a repeat cannot be read")
                continue
            if repeat is not None:
                record = self._records.get(repeat.id)
                found.append(self._as_now(repeat) if record is None else record.repeat)
        return found

    def _as_now(self, stored: Repeat | None) -> Repeat:
        """Return a repeat that this process has not opened: it is closed."""
        if stored is None:
            raise NotFound("There is no such repeat.")
        if stored.closed is not None:
            return stored
        last = stored.reopened.at if stored.reopened is not None else stored.opened.at
        closed = follow(stored, RepeatClosed(at=last, why="restart", text=_RESTARTED))
        assert closed is not None
        return closed

    # --- open ---------------------------------------------------------------------------------

    async def open(
        self, request: RepeatRequest, author: Author, identity: Identity
    ) -> tuple[Repeat, bool]:
        """Open a repeat, once for the request id of its start, and return it, and whether it is new. On
        robots nothing is started. Raise a subclass of Refused if it cannot be carried out or stored."""
        start, robots = request.start, engines_of(request.start)
        if start.drill or start.start_from is not None:
            where: dict[str, object] = {"path": "/start/drill" if start.drill else "/start/from"}
            raise BadInput("A repeat begins at the entry, and is no Stop drill.", where=where)
        require_form(start)
        if request.by_itself and robots:
            text = (
                "On robots a person starts each run: a repeat goes on by itself in the simulator."
            )
            raise BadInput(text, where={"path": "/by_itself"})
        self._control.sight.require_graphs(
            identity, start.graph, *(each.graph for each in start.subgraphs)
        )
        cells = cells_of(request)
        name = await self._run_in_worker(named, request, cells)
        for robot in robots:
            engine = self._control.robots.reachable(robot)
            if engine.state == "gone":
                text = f"{robot} does not answer. {engine.why}".strip()
                raise Conflict(text, where={"path": "/start/engine"})
        opened = RepeatOpened(
            at=self._clock_us(),
            repeat=repeat_id(start.request_id),
            order=order_of(request),
            author=author,
            graph=start.graph,
            graph_name=name,
            version=start.version,
            digest=start.digest,
            engine=start.engine,
            robots=robots,
            cells=cells,
            times=request.times,
            grid=request.grid,
            seed=request.seed,
            by_itself=request.by_itself,
            inside=graphs_inside(start),
            unsighted=start.sight is None and self._control.sight.has_rules,
        )
        async with self._opening:
            return await self._open(opened, start, author, identity)

    async def _open(
        self, opened: RepeatOpened, start: StartRequest, author: Author, identity: Identity
    ) -> tuple[Repeat, bool]:
        try:
            known = await self.find(opened.repeat)
        except NotFound:
            pass
        else:
            if (known.opened.order, known.opened.author.id) != (opened.order, author.id):
                where: dict[str, object] = {"path": "/start/request_id"}
                raise Conflict("This request_id belongs to another repeat.", where=where)
            return known, False
        record = _Record(Repeat(opened=opened), start, opened.at)
        self._keep(record)
        try:
            drafts = [draft_of(opened, author.id), draft_of(StartKept(text_of(start)), author.id)]
            await self._journal.append(stream_of(opened.repeat), drafts, expected=0)
        except BaseException:
            del self._records[opened.repeat]
            raise
        if record.doubts:
            self._close(record, Doubt("stop", "Something closed it while it was being opened."))
        else:
            self._begin(record, author, identity)
        return record.repeat, True

    async def reopen(
        self, id_: str, asked: ReopenRequest, author: Author, identity: Identity
    ) -> Repeat:
        """Open a closed repeat again, after a pre-flight of its next cell that blocks nothing. On robots
        nothing is started. Raise Conflict if it was closed again since the person looked or nothing of
        it is left, and what a start of the cell would raise."""
        record = await self._loaded(id_)
        if record.is_open:
            raise Conflict("This repeat is open.")
        cell, before = record.next_cell, record.doubts
        if asked.closings != record.repeat.closings:
            closed = record.repeat.closed
            text = f"It was closed again meanwhile. {closed.text if closed else ''}"
            raise Conflict(text, where={"path": "/closings", "closings": record.repeat.closings})
        if cell is None:
            raise Conflict("Every run of this repeat was started.")
        self._require_at_rest(record)
        standing = self._doubts.standing(record)
        request = _start_of(record, cell, asked.watching)
        await self._require_clear(record, request, identity)
        is_stored = False
        with anyio.move_on_after(_WAIT_S):
            async with record.storing:
                if record.has_changed(before) or self._doubts.standing(record) != standing:
                    raise Conflict("It was opened or closed meanwhile. Look again.")
                event = RepeatReopened(at=self._clock_us(), author=author)
                await self._journal.append(stream_of(id_), [draft_of(event, author.id)])
                is_stored = True
                self._follow(record, event)
                is_other = self._doubts.standing(record) != standing
                if not is_other and not record.has_changed(before):
                    self._begin(record, author, identity)
                    return record.repeat
        if not is_stored and not record.has_changed(before):
            raise Unavailable("It could not be stored that the repeat was closed. Try again.")
        reason = Doubt("stop", "Something closed it while it was being opened again.")
        self._close(record, reason, is_stored=True)
        raise Conflict(reason.text)

    async def look(self, id_: str, watching: Watching, identity: Identity) -> list[Preflight]:
        """Return the pre-flight of the next cell of a repeat as it is now; nothing after the last one.
        Raise NotFound if there is no such repeat."""
        record = await self._loaded(id_)
        cell = record.next_cell
        if cell is None:
            return []
        return await self._look(record, _start_of(record, cell, watching), identity)

    async def _look(
        self, record: _Record, request: StartRequest, identity: Identity
    ) -> list[Preflight]:
        group, often = group_of(request), _often(record)
        return await self._control.look(group, identity.person.id, identity, often)

    async def _require_clear(
        self, record: _Record, request: StartRequest, identity: Identity
    ) -> None:
        """Raise Conflict if a pre-flight of this start finds something that blocks it, but for the yes
        of a second person, which each start needs."""
        overridden = set(request.override.codes) if request.override is not None else set()
        for look in await self._look(record, request, identity):
            blocked = [
                each
                for each in look.items
                if each.verdict == "blocked"
                and each.code != "approved"
                and not (each.overridable and each.code in overridden)
            ]
            if blocked:
                text = " ".join(each.text for each in blocked[:3])
                raise Conflict(text, where={"path": "/start", "item": blocked[0].code})

    def _begin(self, record: _Record, author: Author, identity: Identity) -> None:
        """Let cells of a repeat be started, and remember how its robots are now."""
        self._doubts.begin(record)
        record.openings += 1
        record.tell()
        if record.repeat.opened.by_itself:
            self._tasks.start_soon(self._go_on, record, author, identity)

    # --- start --------------------------------------------------------------------------------

    async def start(
        self, id_: str, asked: NextRequest, author: Author, identity: Identity
    ) -> Started:
        """Start the next cell of an open repeat, and return its run; that of a cell which was started
        before is returned as it is. Raise Conflict if the repeat is closed, another cell is next or
        a run of it goes on, and what a start raises."""
        record = self._records.get(id_)
        if record is None:
            raise _why_closed(await self.find(id_))
        async with record.turn:
            known = record.runs.get(asked.cell)
            if known is not None:
                return Started(await self._control.find(known), fresh=False)
            return await self._start(record, asked.cell, asked.watching, author, identity)

    async def _start(
        self,
        record: _Record,
        cell: int,
        watching: Watching,
        author: Author,
        identity: Identity,
    ) -> Started:
        """Start a cell. Nothing waits between the look at the repeat and the start, which takes note of
        the Stops pressed so far in that same step."""
        if not record.is_open:
            raise _why_closed(record.repeat)
        if cell != record.next_cell:
            where: dict[str, object] = {"path": "/cell", "next": record.next_cell}
            raise Conflict(f"Run {record.next_cell} of this repeat is the next.", where=where)
        self._require_at_rest(record)
        request = _start_of(record, cell, watching)
        part = PartOfRepeat(record.repeat.id, cell)
        often = _often(record)
        started = await self._control.start(request, author, identity, part, often)
        record.runs[cell] = started.run.id
        return started

    def _require_at_rest(self, record: _Record) -> None:
        """Raise Conflict while a run of the repeat goes on."""
        for run in self._open_runs(record):
            raise Conflict(f"Run {run.number} of this repeat goes on.", where={"run": run.id})

    def _open_runs(self, record: _Record) -> Iterator[Run]:
        for run in record.runs.values():
            opened = self._control.open.get(run)
            if opened is not None and opened.run.end is None:
                yield opened.run

    async def _go_on(self, record: _Record, author: Author, identity: Identity) -> None:
        """Start the cells of a repeat in the simulator one after the other, while it is open and its
        person may simulate."""
        opening = record.openings
        while record.is_open and record.openings == opening:
            news = record.news
            cell = record.next_cell
            if cell is None:
                return
            if any(self._open_runs(record)):
                await news.wait()
                continue
            async with record.turn:
                if (record.is_open, record.openings, record.next_cell) != (True, opening, cell):
                    continue
                if why := self._why_not(identity):
                    self._close(record, Doubt("refused", why))
                    return
                try:
                    await self._start(record, cell, {}, author, identity)
                except Refused as refused:
                    self._close(record, Doubt("refused", refused.detail))

    def _why_not(self, identity: Identity) -> str:
        who = identity.person.name or "The person who opened it"
        now = self._control.rights.current(identity)
        if now is None:
            return f"{who} is not signed in any more."
        denied = may(now, "simulate", now=self._clock_us() / 1e6)
        return f"{who} may not simulate any more." if isinstance(denied, Denied) else ""

    # --- close --------------------------------------------------------------------------------

    async def close(self, id_: str, author: Author) -> Repeat:
        """Close a repeat in the name of a person; a run that goes on is not stopped by it. Raise NotFound
        if there is no such repeat."""
        record = self._records.get(id_)
        if record is None:
            return await self.find(id_)
        who = author.name or "Somebody"
        self._doubts.meet(record, Doubt("person", f"{who} stopped repeating.", author))
        return record.repeat

    def _close(self, record: _Record, reason: Doubt, *, is_stored: bool = False) -> None:
        """Close a repeat in this step, and store that. `is_stored`: its stream says that it is open,
        although it is not."""
        if not record.is_open and record.repeat.closed is not None and not is_stored:
            return
        record.is_open = False
        self._doubted(record, reason)
        event = RepeatClosed(
            at=self._clock_us(), why=reason.why, text=reason.text, by=reason.by, run=reason.run
        )
        self._follow(record, event)
        self._tasks.start_soon(self._store, record, event)
        why = "Its repeat was closed before anything was sent."
        self._control.hold_back(record.repeat.id, why)

    def _doubted(self, record: _Record, _doubt: Doubt) -> None:
        """Let no second person's yes count who did not know of a doubt. What was seen while it was closed
        is in memory only: that it is read again counts as a doubt, too."""
        record.since = max(self._clock_us(), record.since + 1)

    def _follow(self, record: _Record, event: RepeatEvent) -> None:
        followed = follow(record.repeat, event)
        assert followed is not None
        record.repeat = followed
        record.tell()

    async def _store(self, record: _Record, event: RepeatClosed) -> None:
        draft = draft_of(event, event.by.id if event.by is not None else "")
        async with record.storing:
            while True:
                try:
                    await self._journal.append(stream_of(record.repeat.id), [draft])
                    return
                except Refused:  # it is closed in any case, and after a restart, too
                    await anyio.sleep(_STORE_S)

    def _run_changed(self, opened: OpenRun) -> None:
        run = opened.run
        if opened.is_led:
            return
        own = self._records.get(run.repeat.id) if run.repeat is not None else None
        if own is not None and run.repeat is not None:
            own.runs.setdefault(run.repeat.cell, run.id)
        self._doubts.look_at(run)
        if own is not None and run.end is not None:
            own.tell()
            if own.is_open and own.next_cell is None:
                text = "Every run was carried out, and ended true."
                self._close(own, Doubt("complete", text, run=run.id))

    # --- memory -------------------------------------------------------------------------------

    def _keep(self, record: _Record) -> None:
        """Keep a repeat in memory, in place of the oldest one that is closed and stored."""
        if len(self._records) >= _MOST:
            free = (
                id_
                for id_, each in self._records.items()
                if not each.is_open and each.storing.statistics().owner is None
            )
            if (oldest := next(free, None)) is None:
                raise Conflict(f"{_MOST} repeats are open. Close one of them first.")
            del self._records[oldest]
        self._records[record.repeat.id] = record

    async def _loaded(self, id_: str) -> _Record:
        """Return a repeat in memory, read if it is not there. Raise NotFound if there is no such
        repeat."""
        if id_ in self._records:
            return self._records[id_]
        events = await self._journal.read(stream_of(id_))
        repeat = self._as_now(replay((each.kind, each.body) for each in events))
        record = _Record(repeat, start_in(events), self._clock_us())
        for row in await self._journal.query(queries.of_repeat(id_)):
            record.runs[row.summary["repeat"]["cell"]] = row.id
        if id_ not in self._records:  # another caller may have read it meanwhile
            self._keep(record)
        return self._records[id_]

    async def _close_left(self) -> None:
        """Close the repeats that an earlier process left open, and store that. None of them goes
        on, even if this cannot be stored."""
        newest: dict[str, str] = {}
        for row in await self._journal.query(queries.kinds_of_repeats(StartKept.kind)):
            newest.setdefault(row.stream, row.kind)
        event = RepeatClosed(at=self._clock_us(), why="restart", text=_RESTARTED)
        for stream, kind in newest.items():
            if kind != RepeatClosed.kind:
                try:
                    await self._journal.append(stream, [draft_of(event)])
                except Refused:
                    log.exception("%s could not be closed", stream)


def _start_of(record: _Record, cell: int, watching: Watching) -> StartRequest:
    """Return the one start of a cell. Raise BadInput if a person watches a robot that does not move."""
    watched_in(watching, record.robots)
    opened = record.repeat.opened
    return msgspec.structs.replace(
        record.start,
        values=opened.cells[cell - 1],
        request_id=queries.request_of_cell(opened.repeat, cell),
        watching=watching,
    )


def _often(record: _Record) -> InRepeat:
    """Return how often the start of a repeat is carried out, as a second person says yes to it: to all its
    cells at once, until the next doubt."""
    opened = record.repeat.opened
    return InRepeat(
        repeat=opened.repeat,
        closings=record.repeat.closings,
        since=record.since,
        times=opened.times,
        grid=tuple((each.action, each.name, each.values) for each in opened.grid),
        seed=opened.seed,
        values=record.start.values,
    )


def _why_closed(repeat: Repeat) -> Conflict:
    closed = repeat.closed
    text = "" if closed is None else f" {closed.text}"
    return Conflict(f"This repeat is closed.{text}", where={"closings": repeat.closings})
