"""The queues of this process: which starts wait for which robots, what closes a queue, and the starts.

Entries are stored, and there again after a restart of the runner; that a queue is open is in the memory
of the process in which a person put something into it, or opened it. It is closed in the step in which
the doubt is seen. A person starts each entry, except in the simulator, where it may start by itself. An
entry is started at most once: its start has one request id for ever, and what it became leaves the queue
in the step in which the run is there.
"""

import logging
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from typing import Final

import anyio
import msgspec

from action_assistant.errors import Conflict, Forbidden, NotFound, Refused
from action_assistant.kit.clock import ClockUs
from action_assistant.kit.lru_cache import LruCache
from action_assistant.runner.execution.doubts import DoubtWatch
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.execution.start_pipeline import NOT_WITH, Grouped, Started
from action_assistant.runner.links.port import SIMULATOR
from action_assistant.runner.queues.entry import (
    MOST,
    MOST_OF_ONE,
    Looked,
    MoveRequest,
    OpenQueueRequest,
    QueueClosed,
    QueueEntered,
    QueueLeft,
    QueueMoved,
    QueueOpened,
    QueueReady,
    QueueRequest,
    QueueStartKept,
    TurnRequest,
    Waiting,
    closing_of,
    differences,
    digest_of,
    entered_of,
    entry_id,
    looked_of,
    named,
    order_of,
    queue_names_of,
    request_of,
    require_openable,
    require_queueable,
    require_waitable,
    stream_of,
    stream_of_robot,
    told,
    waits_of,
)
from action_assistant.runner.queues.robot_queue import Entry, Look, RobotQueue
from action_assistant.runner.queues.stored_entries import read_entries, start_in
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.doubts import Doubt
from action_assistant.runner.runs.events import Author, StoredKind, draft_of
from action_assistant.runner.runs.history import RunnerJournal
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.views import QueuedStart
from action_assistant.runner.start.admission import StartRequest, Watching
from action_assistant.runner.start.kept_starts import graph_of, group_of, text_of
from action_assistant.runner.start.orders import InQueue, overridden_in, watched_in
from action_assistant.web.auth.caller import BackgroundTasks
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.rights import Denied, may
from action_assistant.web.auth.roles import OWNER
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_REMEMBERED: Final = 2000  # runs and groups
_STORE_S: Final = 1.0  # between two attempts to store something that has happened
_RESTARTED: Final = "The runner was started again. Nothing of the queue goes on after that."


class Queues:
    """Puts starts into queues, and carries them out. Use the context manager `opened` to get one.
    `author` is the person in whose name a command is recorded."""

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
        self._entries: list[Entry] = []
        self._queues: dict[str, RobotQueue] = {}
        self._going: set[str] = set()  # runs that are not over
        self._putting: Counter[str] = Counter()  # request ids of starts that are being put there
        self._robots_of: LruCache[str, frozenset[str]] = LruCache(_REMEMBERED)
        self._entering = anyio.Lock()
        self._watchers: list[Callable[[], None]] = []
        self._doubts = DoubtWatch[RobotQueue](control, self._queues.values, self._close)
        control.watch(self._run_changed)
        control.watch_robots(self._survey)

    @classmethod
    @asynccontextmanager
    async def opened(
        cls,
        control: ExecutionService,
        journal: RunnerJournal,
        *,
        clock_us: ClockUs,
        run_in_worker: RunInWorker,
    ) -> "AsyncIterator[Queues]":
        """Return a context with the queues of a runner. Those in which an earlier process left something
        are closed. Raise Unavailable if the journal cannot be read."""
        async with anyio.create_task_group() as tasks:
            queues = cls(control, journal, clock_us, BackgroundTasks(tasks), run_in_worker)
            await queues._load()
            try:
                yield queues
            finally:
                queues._entries.clear()
                queues._queues.clear()  # runs change further, while nobody stores what that closes
                tasks.cancel_scope.cancel()

    def watch(self, watcher: Callable[[], None]) -> None:
        """Call `watcher` at once whenever an entry or a queue has changed."""
        self._watchers.append(watcher)

    def _changed(self) -> None:
        for watcher in self._watchers:
            watcher()

    # --- what there is ------------------------------------------------------------------------

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All entries, in the order in which people have put or moved them."""
        return tuple(self._entries)

    @property
    def robot_queues(self) -> tuple[RobotQueue, ...]:
        """The queues in which something waits, by name."""
        used = {name for each in self._entries for name in each.queue_names}
        return tuple(self._queues[name] for name in sorted(used))

    def find(self, id_: str) -> Entry:
        """Return an entry that waits. Raise NotFound if there is none with this id."""
        found = next((each for each in self._entries if each.id == id_), None)
        if found is None:
            raise NotFound("This is not in the queue: it has left it, or never was.")
        return found

    def is_under_way(self, request_id: str) -> bool:
        """Return whether the start with this request id is being put into the queue, or is looked at
        or sent as that of an entry, at this moment."""
        starting = (request_of(each.id) for each in self._entries if each.turn.locked())
        return self._putting[request_id] > 0 or request_id in starting

    async def queued(self, request_id: str) -> QueuedStart | None:
        """Return the entry that the start with this request id has become; None if it has become none.
        Raise Unavailable if the journal cannot be read."""
        id_ = entry_id(request_id)
        waits = any(each.id == id_ for each in self._entries)
        if not waits and not await self._journal.read(stream_of(id_), limit=1):
            return None
        return QueuedStart(id_, waits)

    async def _start_in(self, entry: Entry, watching: Watching) -> StartRequest:
        """Return the one start of an entry. Raise BadInput if a person watches a robot that does not
        move, Conflict for what cannot be started, Unavailable if it cannot be read."""
        watched_in(watching, entry.entered.robots)
        if entry.obstacle:
            raise Conflict(entry.obstacle)
        start = start_in(entry.entered, await self._journal.read(stream_of(entry.id)))
        return msgspec.structs.replace(start, request_id=request_of(entry.id), watching=watching)

    async def _look(
        self,
        start: StartRequest,
        robots: tuple[str, ...],
        engines: tuple[str, ...],
        seen: Looked,
        identity: Identity,
        turn: InQueue | None = None,
    ) -> tuple[Look, Looked]:
        group = group_of(start, engines)
        looks = await self._control.look(group, identity.person.id, identity, turn)
        now = looked_of(looks, {each: self._control.rights.of(each).rules for each in robots})
        differs = differences(seen, now, looks)
        digest = digest_of(now, looks, None if turn is None else turn.ready_at)
        return Look(tuple(looks), differs, digest, overridden_in(start)), now

    async def _look_at(
        self, entry: Entry, start: StartRequest, identity: Identity, turn: InQueue | None = None
    ) -> Look:
        of = entry.entered
        return (await self._look(start, of.robots, of.engines, of.seen, identity, turn))[0]

    async def look(self, id_: str, watching: Watching, identity: Identity) -> Look:
        """Return the pre-flight of an entry as it is now for a person. Raise NotFound if it does not
        wait, Forbidden if they may not see its graph."""
        entry = self.find(id_)
        start = await self._start_in(entry, watching)
        self._survey()
        return await self._look_at(entry, start, identity, entry.often)

    # --- put, move, remove --------------------------------------------------------------------

    async def put(
        self, request: QueueRequest, author: Author, identity: Identity
    ) -> tuple[Entry, bool]:
        """Put a start into the queue, once for its request id, and return the entry, and whether it is
        new. Nothing is started by it, except in the simulator where the person has said so. Raise a
        subclass of Refused if it cannot wait, or cannot be stored."""
        require_queueable(request)
        start, robots = request.start, request.robots
        graphs = (start.graph, *(each.graph for each in start.subgraphs))
        self._control.sight.require_graphs(identity, *graphs)
        own_queues = [self._queue_of(name) for name in queue_names_of(robots)]
        for queue in own_queues:
            queue.entering += 1  # a Stop from here on closes it
        self._putting[start.request_id] += 1
        try:
            known = await self._known(request, author)
            if known is not None:
                return known, False
            self._require_capacity(author)
            graph = await self._run_in_worker(graph_of, start)
            engines = request.each_whole
            look, seen = await self._look(start, robots, engines, Looked({}), identity)
            require_waitable(start, look.looks)
            unsighted = start.sight is None and self._control.sight.has_rules
            now = self._clock_us()
            entered = entered_of(request, author, now, graph.name, seen, unsighted=unsighted)
            return await self._enter(entered, request, identity)
        finally:
            self._putting -= Counter({start.request_id: 1})
            for queue in own_queues:
                queue.entering -= 1
            self._drop_empty()

    async def _enter(
        self, entered: QueueEntered, request: QueueRequest, identity: Identity
    ) -> tuple[Entry, bool]:
        author, stream = entered.author, stream_of(entered.entry)
        async with self._entering:
            known = await self._known(request, author)
            if known is not None:
                return known, False
            self._require_capacity(author)
            with anyio.CancelScope(shield=True):
                try:
                    kept = QueueStartKept(text_of(request.start))
                    drafts = [draft_of(entered, author.id), draft_of(kept, author.id)]
                    await self._journal.append(stream, drafts, expected=0)
                except Refused:
                    self._tasks.start_soon(self._disown, stream)
                    raise
                entry = Entry(entered)
                entry.by = (author, identity)
                self._entries.append(entry)
                self._survey()
                self._changed()
        return entry, True

    async def _disown(self, stream: str) -> None:
        """Store that an entry has left, in case it was committed although the answer got lost."""
        while True:
            async with self._entering:  # it may be sent again, and stored, meanwhile
                if any(stream_of(each.id) == stream for each in self._entries):
                    return
                try:
                    if await self._journal.newest(stream):
                        left = QueueLeft(at=self._clock_us())
                        await self._journal.append(stream, [draft_of(left)])
                    return
                except Refused:
                    pass
            await anyio.sleep(_STORE_S)

    async def _known(self, request: QueueRequest, author: Author) -> Entry | None:
        """Return the entry that a request has become; None if it has become none yet. Raise Conflict if
        its request id belongs to another one, or to one that has left the queue."""
        id_ = entry_id(request.start.request_id)
        found = next((each for each in self._entries if each.id == id_), None)
        where: dict[str, object] = {"path": "/start/request_id"}
        if found is None:
            if await self._journal.read(stream_of(id_), limit=1):
                raise Conflict("What this request_id put into the queue has left it.", where=where)
            return None
        if (found.entered.order, found.entered.author.id) != (order_of(request), author.id):
            raise Conflict("This request_id belongs to another entry of the queue.", where=where)
        return found

    def _require_capacity(self, author: Author) -> None:
        own = sum(each.entered.author.id == author.id for each in self._entries)
        if len(self._entries) >= MOST:
            raise Conflict(f"{MOST} starts wait already. Remove one of them first.")
        if own >= MOST_OF_ONE:
            raise Conflict(f"{MOST_OF_ONE} starts of yours wait already. Remove one of them first.")

    async def move(self, id_: str, asked: MoveRequest, author: Author, identity: Identity) -> None:
        """Move an entry. Whoever put it there may move it back, and before others of theirs; an owner
        anywhere. Raise NotFound if it does not wait, Forbidden if the person may not, Unavailable if it
        cannot be stored."""
        entry = self.find(id_)
        after = self.find(asked.before) if asked.before else None
        self._require_own(entry, identity, "move")
        others = [each for each in self._entries if each is not entry]
        place = others.index(after) if after is not None and after in others else len(others)
        if after is entry:
            return
        if identity.person.role != OWNER:
            passed = others[place : self._entries.index(entry)]
            strangers = (each for each in passed if each.entered.author.id != author.id)
            for each in strangers:
                if not set(each.queue_names).isdisjoint(entry.queue_names):
                    who = each.entered.author.name or "somebody"
                    raise Forbidden(f"That would go before the start of {who}: an owner may do it.")
        order = [*others[:place], entry, *others[place:]]
        event = QueueMoved(
            at=self._clock_us(), author=author, order=tuple(each.id for each in order)
        )
        with anyio.CancelScope(shield=True):
            await self._journal.append(stream_of(entry.id), [draft_of(event, author.id)])
            ranks = {each: rank for rank, each in enumerate(event.order)}
            self._entries.sort(key=lambda each: ranks.get(each.id, len(ranks)))
            self._survey()
            self._changed()

    async def remove(self, id_: str, author: Author, identity: Identity) -> None:
        """Take an entry out of the queue. Raise NotFound if it does not wait, Forbidden if it is that of
        somebody else and the person is no owner, Unavailable if it cannot be stored."""
        entry = self.find(id_)
        self._require_own(entry, identity, "remove")
        async with entry.turn:
            self.find(id_)
            event = QueueLeft(at=self._clock_us(), by=author)
            with anyio.CancelScope(shield=True):
                await self._journal.append(stream_of(id_), [draft_of(event, author.id)])
                self._forget(entry)

    def _require_own(self, entry: Entry, identity: Identity, what: str) -> None:
        if identity.person.role != OWNER and entry.entered.author.id != identity.person.id:
            who = entry.entered.author.name or "somebody else"
            raise Forbidden(f"{who} put this into the queue: they may {what} it, and owners may.")

    def _forget(self, entry: Entry) -> None:
        if entry in self._entries:
            self._entries.remove(entry)
            self._drop_empty()
            self._survey()
            self._changed()

    # --- whose turn it is ---------------------------------------------------------------------

    def _survey(self) -> None:
        """Say anew of each entry why it waits."""
        if not self._entries:
            return
        busy = {name: tuple(self._busy(name)) for name in self._queues}
        closed = {name for name, queue in self._queues.items() if not queue.is_open}
        entries, is_changed = tuple(each for each in self._entries if not each.obstacle), False
        every = waits_of([each.queue_names for each in entries], closed, busy)
        for entry, waits in zip(entries, every, strict=True):
            if entry.waits != waits or (entry.ready_at is None) == (not waits):
                is_changed = True
                entry.waits = waits
                was_ready, entry.ready_at = entry.ready_at, None
                if not waits:
                    entry.ready_at = was_ready or self._clock_us()
                    if was_ready is None:
                        self._tasks.start_soon(self._take_turn, entry, entry.ready_at)
        if is_changed:
            self._changed()

    def _busy(self, name: str) -> Iterator[Waiting]:
        """Yield why a robot is not free, whatever waits for it."""
        if name == SIMULATOR:
            queue = self._queues[name]
            for run in sorted(filter(queue.owns, self._going))[:1]:
                yield Waiting(name, "run", run)
            return
        occupying = self._control.occupying(name)
        if occupying is not None:
            yield Waiting(name, "run", occupying.id)
        elif self._control.foreign_stops.is_stopping(name):
            yield Waiting(name, "stop")

    async def _take_turn(self, entry: Entry, ready_at: int) -> None:
        try:
            await self._turn_came(entry, ready_at)
        except Exception:  # a fault of one entry ends no other part of the runner
            log.exception("the turn of %s", entry.id)

    async def _turn_came(self, entry: Entry, ready_at: int) -> None:
        """Look before the start, tell people, and start an entry that starts by itself."""
        entered = entry.entered
        if entered.robots:
            event = QueueReady(
                at=ready_at,
                person=entered.author.name,
                graph=entered.graph,
                graph_name=entered.graph_name,
                robots=entered.robots,
            )
            try:
                await self._journal.append(stream_of(entry.id), [draft_of(event)])
            except Refused:
                log.exception("it could not be stored that it is the turn of %s", entry.id)
        by = entry.by
        identity = None if by is None else self._control.rights.current(by[1])
        try:
            if by is None:
                raise Conflict("The runner was started again since it was put into the queue.")
            if identity is None:
                raise Forbidden(f"{entered.author.name or 'Its person'} is not signed in any more.")
            start = await self._start_in(entry, {})
            found = (await self._look_at(entry, start, identity)).differs
        except Refused as refused:
            found = (refused.detail,)
        if entry.ready_at != ready_at or entry not in self._entries:
            return
        entry.differs = found
        self._changed()
        if entered.by_itself and not found and by is not None and identity is not None:
            await self._start_by_itself(entry, start, ready_at, by[0], identity)

    async def _start_by_itself(
        self, entry: Entry, start: StartRequest, ready_at: int, author: Author, identity: Identity
    ) -> None:
        async with entry.turn:
            if entry.ready_at != ready_at or entry not in self._entries:
                return
            denied = may(identity, "simulate", now=self._clock_us() / 1e6)
            try:
                if isinstance(denied, Denied):
                    raise Forbidden(denied.reason)
                await self._start(entry, start, ready_at, author, identity)
            except Refused as refused:
                for name in self._queues.keys() & set(entry.queue_names):
                    self._doubts.meet(self._queues[name], Doubt("refused", refused.detail))

    # --- start --------------------------------------------------------------------------------

    async def start(
        self, id_: str, asked: TurnRequest, author: Author, identity: Identity
    ) -> Started | Grouped:
        """Start an entry whose turn it is, and return its run, or its runs; what was started before is
        returned as it is. Raise Conflict if it has to wait, or is not as it was looked at, NotFound if
        it was removed, and what a start raises."""
        entry = next((each for each in self._entries if each.id == id_), None)
        if entry is None:
            return await self._started(id_)
        ready_at = self._require_turn(entry)
        async with entry.turn:
            if entry not in self._entries:
                return await self._started(id_)
            start = await self._start_in(entry, asked.watching)
            turn = InQueue(entry.id, ready_at)
            look = await self._look_at(entry, start, identity, turn)
            if look.digest != asked.look:
                text = "It is not as you have looked at it. Look again."
                if look.differs:
                    text += f" Since it was put into the queue: {' '.join(look.differs[:3])}"
                raise Conflict(text, where={"path": "/look", "differs": list(look.differs)})
            return await self._start(entry, start, ready_at, author, identity)

    async def _start(
        self, entry: Entry, start: StartRequest, ready_at: int, author: Author, identity: Identity
    ) -> Started | Grouped:
        """Start an entry whose turn came at `ready_at`. Nothing waits between the look at the queue and
        the start, which takes note of the Stops pressed so far in that same step. Raise Conflict if
        its queue was closed since then, although it is open again."""
        if self._require_turn(entry) != ready_at:
            raise Conflict("Its queue was closed since, or a robot was not free. Look again.")
        turn = InQueue(entry.id, ready_at)
        together = entry.entered.together
        if not together:
            started = await self._control.start(start, author, identity, often=turn)
            self._leave(entry, started.run)
            return started
        group = group_of(start, together)
        try:
            grouped = await self._control.start_group(group, author, identity, often=turn)
        finally:
            if entry.became is not None:
                self._leave(entry, entry.became)
        if not grouped.runs:
            failed = [f"{robot}: {why}" for robot, why in grouped.failed.items()]
            raise Conflict(f"Nothing was started. {' '.join(failed)}", where={"path": "/start"})
        self._leave(entry, grouped.runs[0])
        return grouped

    def _require_turn(self, entry: Entry) -> int:
        """Return since when it is the turn of an entry, µs UTC. Raise Conflict if it has to wait."""
        self._survey()
        if entry.obstacle:
            raise Conflict(entry.obstacle)
        for each in entry.waits:
            closed = self._queues[each.robot].closed if each.why == "closed" else None
            where: dict[str, object] = {"robot": each.robot, "why": each.why}
            if closed is not None:
                text = f"The queue of {named(each.robot)} is closed. {told(closed)}"
                raise Conflict(text, where=where | {"closing": closing_of(closed)})
            if each.why == "behind":
                text = f"{each.behind} before it wait for {named(each.robot)}."
                raise Conflict(text, where=where)
            text = named(each.robot)
            raise Conflict(f"{text[0].upper()}{text[1:]} is not free.", where=where)
        assert entry.ready_at is not None
        return entry.ready_at

    async def _started(self, id_: str) -> Started | Grouped:
        """Return what an entry has become. Raise NotFound if that is nothing."""
        rows = await self._journal.query(queries.of_start(request_of(id_)))
        if not rows:
            raise NotFound("This is not in the queue: it was removed, or never was.")
        runs = [await self._control.find(row.id) for row in rows]
        if runs[0].group is None:
            return Started(runs[0], fresh=False)
        entered = (await self._journal.read(stream_of(id_), limit=1))[0]
        missing = set(msgspec.json.decode(entered.body, type=QueueEntered).together)
        missing -= {run.engine for run in runs}
        return Grouped(runs[0].group, runs, dict.fromkeys(sorted(missing), NOT_WITH), fresh=False)

    def _leave(self, entry: Entry, run: Run) -> None:
        """Take out an entry that has become a run, in this step, and store that."""
        if entry not in self._entries:
            return
        if run.group is None:
            self._robots_of.put(run.id, frozenset(entry.queue_names))
        event = QueueLeft(at=self._clock_us(), run=run.id)
        self._tasks.start_soon(self._store, stream_of(entry.id), event)
        self._forget(entry)

    async def _store(self, stream: str, event: StoredKind, author: str = "") -> None:
        while True:
            try:
                await self._journal.append(stream, [draft_of(event, author)])
                return
            except Refused:  # it has happened in any case, and a restart finds the same
                await anyio.sleep(_STORE_S)

    # --- close and open -----------------------------------------------------------------------

    def _queue_of(self, name: str) -> RobotQueue:
        """Return the queue of a robot. One in which nothing waited is open: whoever puts the first start
        into it has looked."""
        if name not in self._queues:
            self._queues[name] = RobotQueue(name, self._robots_of)
            self._doubts.begin(self._queues[name])
        return self._queues[name]

    def _drop_empty(self) -> None:
        used = {name for each in self._entries for name in each.queue_names}
        for name, queue in tuple(self._queues.items()):
            if name not in used and not queue.entering:
                del self._queues[name]

    def close(self, robot: str, author: Author) -> None:
        """Close the queue of a robot in the name of a person; no run is stopped by it. Raise NotFound if
        nothing waits for it."""
        who = author.name or "Somebody"
        self._doubts.meet(self._of(robot), Doubt("person", f"{who} closed the queue.", author))

    def _of(self, robot: str) -> RobotQueue:
        queue = next((each for each in self.robot_queues if each.name == robot), None)
        if queue is None:
            raise NotFound(f"Nothing waits for {named(robot)}.")
        return queue

    def _close(self, queue: RobotQueue, doubt: Doubt) -> None:
        queue.is_open = False
        event = QueueClosed(
            at=self._clock_us(), why=doubt.why, text=doubt.text, by=doubt.by, run=doubt.run
        )
        queue.closed = event
        by = doubt.by.id if doubt.by is not None else ""
        self._tasks.start_soon(self._store, stream_of_robot(queue.name), event, by)
        for entry in self._entries:
            if queue.name in entry.queue_names and entry.turn.locked():
                for request in entry.entered.requests:
                    self._control.hold_back(request, "Its queue was closed meanwhile.")
        self._survey()
        self._changed()

    async def open(
        self, robot: str, asked: OpenQueueRequest, author: Author, identity: Identity
    ) -> None:
        """Open the closed queue of a robot again, after a pre-flight of its first entry that blocks
        nothing there. On robots nothing is started. Raise NotFound if nothing waits for it, Conflict if
        it was closed again since the person looked, or something is in doubt, Unavailable if it cannot
        be stored."""
        queue = self._of(robot)
        if queue.closed is None:
            raise Conflict(f"The queue of {named(robot)} is open.")
        closed, before = queue.closed, queue.doubts
        if asked.closing != closing_of(closed):
            where: dict[str, object] = {"path": "/closing", "closing": closing_of(closed)}
            raise Conflict(f"It was closed again meanwhile. {told(closed)}", where=where)
        self._require_settled(robot)
        standing = self._doubts.standing(queue)
        entry = self._first_seen(queue, identity)
        start = await self._start_in(entry, {})
        require_openable(start, (await self._look_at(entry, start, identity)).looks, robot)
        event = QueueOpened(at=self._clock_us(), author=author)
        with anyio.CancelScope(shield=True):
            await self._journal.append(stream_of_robot(robot), [draft_of(event, author.id)])
            is_other = queue.doubts != before or self._doubts.standing(queue) != standing
            if queue.closed is not closed or is_other or self._queues.get(robot) != queue:
                if queue.closed is not None:
                    self._tasks.start_soon(self._store, stream_of_robot(robot), queue.closed)
                raise Conflict("It was opened or closed meanwhile. Look again.")
            queue.closed = None
            self._doubts.begin(queue)
            if robot == SIMULATOR:
                for each in self._entries:
                    if each.by is None and robot in each.queue_names:
                        each.by = (author, identity)
            self._survey()
            self._changed()

    def _require_settled(self, robot: str) -> None:
        """Raise Conflict while a run on a robot is being stopped, or is lost."""
        run = None if robot == SIMULATOR else self._control.occupying(robot)
        if run is not None and (run.desired == "stopped" or run.lost or run.unconfirmed):
            text = f"Run {run.number} on {robot} is not known to be at rest."
            raise Conflict(text, where={"run": run.id})

    def _first_seen(self, queue: RobotQueue, identity: Identity) -> Entry:
        """Return the first entry of a queue that a person may see. Raise Forbidden if there is none."""
        unseen = self._control.sight.unseen(identity)
        for entry in self._entries:
            if queue.name in entry.queue_names and (
                unseen is None or not unseen.hides(entry.graphs)
            ):
                return entry
        raise Forbidden(
            "You may see no graph that waits there, so you cannot look before the start."
        )

    def _run_changed(self, opened: OpenRun) -> None:
        run = opened.run
        if opened.is_led:  # a piece is a part of its run
            return
        is_news = (run.id in self._going) == (run.end is not None)
        (self._going.discard if run.end is not None else self._going.add)(run.id)
        for id_ in filter(None, (run.id, run.group) if run.robots else ()):
            known = self._robots_of.get(id_) or frozenset()
            self._robots_of.put(id_, known.union(run.robots))
        for entry in self._entries if run.request_id.startswith(stream_of("")) else ():
            if run.request_id in entry.entered.requests:
                if not entry.entered.together:
                    self._leave(entry, run)
                entry.became = entry.became or run
                break
        self._doubts.look_at(run)
        if is_news:
            self._survey()
            self._drop_empty()

    # --- restart ------------------------------------------------------------------------------

    async def _load(self) -> None:
        """Read the entries that an earlier process left, and close their queues. One of which a run was
        made has left the queue, even if that could not be stored."""
        for opened in self._control.shown.values():
            self._run_changed(opened)
        self._entries += await read_entries(self._journal)
        for entry in tuple(self._entries):
            rows = await self._journal.query(queries.of_start(request_of(entry.id)))
            if rows:
                self._entries.remove(entry)
                event = QueueLeft(at=self._clock_us(), run=rows[0].id)
                self._tasks.start_soon(self._store, stream_of(entry.id), event)
        for row in await self._journal.query(queries.newest_move(QueueMoved.kind)):
            try:
                order = msgspec.json.decode(row.body, type=QueueMoved).order
            except msgspec.DecodeError:
                log.exception("the order of the queue cannot be read")
                continue
            ranks = {each: rank for rank, each in enumerate(order)}
            self._entries.sort(key=lambda each: ranks.get(each.id, len(ranks)))
        names = {name for each in self._entries for name in each.queue_names}
        for queue in [self._queue_of(name) for name in sorted(names)]:
            self._doubts.meet(queue, Doubt("restart", _RESTARTED))
