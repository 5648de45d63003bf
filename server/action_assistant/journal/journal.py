"""The journal of one process: append, read, follow. Nothing is told before it is committed."""

import asyncio
import contextlib
import logging
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeAlias, TypeVar, cast

import msgspec
from sqlalchemy import Connection, delete, insert, select

from action_assistant.errors import Conflict, Unavailable
from action_assistant.journal.chain import Damage, Inspector
from action_assistant.journal.commit_metrics import CommitMetrics
from action_assistant.journal.copies.before_upgrade import keep_copy
from action_assistant.journal.database import (
    Before,
    Branch,
    Database,
    WriterSession,
    cause_of,
    no_copy,
)
from action_assistant.journal.databases import database_of
from action_assistant.journal.events import Addition, Draft, Event, Fold
from action_assistant.journal.migrate import revisions_of
from action_assistant.journal.reader import EVENTS, JournalReader, body_of, seal_of
from action_assistant.journal.removal import (
    STREAM,
    StreamRemoved,
    delete_some,
    removed_by,
    taken_out,
)
from action_assistant.journal.slots import Cursor, LogOrder, before_first, pages_in_order, slot_of
from action_assistant.journal.writer import Job, JobOutcomes, Transaction, Writer
from action_assistant.kit.shared_check import SharedCheck
from action_assistant.schema.branches import BRANCHES, VERSIONS
from action_assistant.schema.editor_tables import editor_event, editor_head, editor_snapshot
from action_assistant.schema.log_tables import LOG

log: Final = logging.getLogger(__name__)

T = TypeVar("T")
#: Runs work on a connection of the journal, and returns its result.
OnConnection: TypeAlias = Callable[[Callable[[Connection], Any]], Awaitable[Any]]

_PROBE_TIMEOUT_S: Final = 2.0
_FINE: Final = ""
#: A row of a stream in which nothing is ever stored.
_PROBE_ROW: Final = {"stream": "health", "seq": 0, "proof": b"", "state": b""}
_PAGE: Final = 500  # events that a follower reads at once
_HELD: Final = 1000  # events that wait for a follower in memory; after that it reads them
_POLLED_S: Final = 0.5  # between two looks for events of other processes
_BRIEF: Final = 64 * 1024  # bytes of events that are written without a thread
# The tables of the log are the same for both branches.
_head, _snapshot = editor_head.c, editor_snapshot.c


def _before(copies: Path | None) -> Before:
    """Return the function that copies the journal into the folder `copies` before tables change;
    for None one that makes no copy."""
    return no_copy if copies is None else partial(keep_copy, copies)


class Follower:
    """The bounded queue of committed events for one reader."""

    def __init__(self) -> None:
        self._waiting: deque[Event] = deque()
        self._missed = False
        self._ended = False
        self._news = asyncio.Event()

    def hear(self, events: Sequence[Event]) -> None:
        """Queue events that were just committed; a full queue is dropped, and the reader reads the
        log instead."""
        if not events or self._missed:
            return
        if len(self._waiting) + len(events) > _HELD:
            self._waiting.clear()
            self._missed = True
        else:
            self._waiting.extend(events)
        self._news.set()

    def wake(self) -> None:
        """Empty the queue of events, and have the reader read the events from the log instead."""
        self._waiting.clear()
        self._missed = True
        self._news.set()

    def end(self) -> None:
        """End the queue: no event will come any more."""
        self._ended = True
        self._news.set()

    async def next(self) -> list[Event] | None:
        """Wait for events and return them; return [] if the log has to be read, None at the end."""
        await self._news.wait()
        found = list(self._waiting)
        if self._ended and not found and not self._missed:
            return None
        self._waiting.clear()
        self._missed = False
        if not self._ended:
            self._news.clear()
        return found


class Journal(JournalReader):
    """The log of one process, which is the only writer of its database; readers never wait for
    writes."""

    def __init__(
        self,
        database: Database,
        session: WriterSession,
        branch: Branch,
        fold: Fold,
        *,
        at_once: bool = False,
    ) -> None:
        self._branch: Final = branch
        self._loop = asyncio.get_running_loop()
        self._database = database
        self._at_once = at_once
        self._writer = Writer(database, session, fold, self._written)
        self._jobs: list[Job[Any]] = []  # of this turn of the loop, for one transaction
        self._untold = 0  # jobs given to the writer's thread whose results were not reported yet
        self._followers: set[Follower] = set()
        self._closed = False
        self._polling: asyncio.Task[None] | None = None
        if session.is_shared:
            self._polling = self._loop.create_task(self._poll(), name="poll of the log")
        self._probe = JournalProbe(branch, self.derive, self._ask, lambda: self._writer.is_alive)

    @staticmethod
    def prepare(
        url: str, branch: Branch, *, copies: Path | None = None, several: bool = False
    ) -> None:
        """Open the journal of a branch, bring its tables to this version, and close it again, so
        that errors appear before a server begins. Blocks. Raise CannotStart as `open` does."""
        database = database_of(url, several=several)
        try:
            database.open(branch, _before(copies)).close()
        finally:
            database.disown()

    @classmethod
    async def open(
        cls,
        url: str,
        *,
        branch: Branch,
        fold: Fold,
        copies: Path | None = None,
        at_once: bool = False,
        upgrades: bool = True,
        several: bool = False,
    ) -> "Journal":
        """Open the journal of a branch, and bring its tables to this version. `url`: sqlite:///PATH
        or postgresql://… `fold`: turns events into statements for the tables. `copies`: the folder
        for a copy before an upgrade; None makes no copy. `at_once`: the event loop may wait for a
        local disk while that is quick; not for a process that must always answer. Without `upgrades`
        the tables stay as they are, and only the log may be read. `several`: other processes that say the
        same write to this Postgres, too; each has a slot. Raise CannotStart if the database is another
        program's, newer, in use, not reached, not writable, or does not store commits durably."""
        database = database_of(url, several=several)
        return await cls.on(
            database, branch=branch, fold=fold, copies=copies, at_once=at_once, upgrades=upgrades
        )

    @classmethod
    async def on(
        cls,
        database: Database,
        *,
        branch: Branch,
        fold: Fold,
        copies: Path | None = None,
        at_once: bool = False,
        upgrades: bool = True,
    ) -> "Journal":
        """Open the journal of a branch in a database; the other parameters are those of `open`.
        Raise CannotStart if the database cannot be used or another process holds it."""
        try:
            session = await asyncio.to_thread(
                database.open, branch, _before(copies), upgrades=upgrades
            )
        except BaseException:
            await database.close()
            database.disown()
            raise
        return cls(database, session, branch, fold, at_once=at_once)

    async def append(
        self, stream: str, drafts: Sequence[Draft], *, expected: int | None = None
    ) -> int:
        """Append events to a stream, wait for the COMMIT, and return the number of the last one.
        Raise Conflict if the stream has another end than `expected` (None: any), Unavailable if the
        journal cannot be written."""
        (newest,) = await self.append_all([Addition(stream, tuple(drafts), expected)])
        return newest

    async def append_all(self, additions: Sequence[Addition]) -> list[int]:
        """Append events to several streams in one transaction, all or none; wait for the COMMIT,
        and return the newest seq of each stream. The errors are those of `append`."""
        return await self._write(
            lambda transaction: [transaction.add(addition) for addition in additions]
        )

    def append_then(
        self,
        addition: Addition,
        done: Callable[[int | None, BaseException | None], None],
        *also: Addition,
    ) -> None:
        """Append events to one stream without waiting. `also`: additions for other streams, in the
        same transaction. `done` is called on the loop after COMMIT, with the newest seq of the first
        stream or with the exception that `append` would raise. It must not raise. Raise Unavailable
        if the journal is closed."""
        is_brief = sum([len(draft.body) for draft in addition.drafts]) <= _BRIEF

        def add(transaction: Transaction) -> int:
            newest = transaction.add(addition)
            for each in also:
                transaction.add(each)
            return newest

        self._queue(Job(add, done, is_brief=is_brief))

    def follow(self) -> AbstractAsyncContextManager[AsyncIterator[Event]]:
        """Return a context with an iterator over the events that are committed from now on, in
        order. Memory is bounded: a slow reader reads the log later."""
        return self._following()

    async def keep_snapshot(self, stream: str, seq: int, state: bytes) -> None:
        """Cache the state of a stream after the event `seq`. Raise Unavailable if the journal
        cannot be written."""

        def keep(transaction: Transaction) -> None:
            seal = seal_of(body_of(transaction.connection, stream, seq), state)
            row = {"stream": stream, "seq": seq, "proof": seal, "state": state}
            transaction.connection.execute(
                delete(editor_snapshot).where(_snapshot.stream == stream)
            )
            transaction.connection.execute(insert(editor_snapshot).values(row))

        await self._write(keep)

    async def derive(self, work: Callable[[Connection], T]) -> T:
        """Run `work` in one transaction, to write tables that are computed from stored events.
        Raise Unavailable if the journal cannot be written."""
        return await self._write(lambda transaction: work(transaction.connection))

    async def take_out(
        self,
        removed: StreamRemoved,
        also: Callable[[int], Addition],
        *,
        parts: Sequence[StreamRemoved] = (),
    ) -> int:
        """Record that a stream is in an archive from now on (`removed`); return the number of that
        event, by which `delete_some` may delete the stream. `parts`: other streams that go with it,
        whose numbers follow in their order. `also` returns another addition for the same
        transaction, from that number. Raise Conflict if a stream has another end than stated,
        Unavailable if the journal cannot be written."""
        streams = (removed, *parts)
        drafts = tuple(Draft(each.kind, "", msgspec.json.encode(each)) for each in streams)

        def say(transaction: Transaction) -> int:
            for each in streams:
                if transaction.end(each.stream) != each.end:
                    raise Conflict(f"{each.stream} does not end at {each.seq}.")
            by = transaction.add(Addition(STREAM, drafts)) - len(parts)
            transaction.add(also(by))
            return by

        return await self._write(say)

    async def delete_some(self, stream: str, by: int) -> bool:
        """Delete some events of a stream that was taken out, and its snapshots; return whether any
        events are left. `by`: the number that `take_out` returned. Raise Conflict if the removal is
        not recorded, Unavailable if the journal cannot be written."""
        return await self._write(
            lambda transaction: delete_some(transaction.connection, stream, by)
        )

    async def rebuild(self) -> int:
        """Compute all tables again from the events, in one transaction; return the number of
        events."""
        folds = [t for t in BRANCHES[self._branch].sorted_tables if t.name not in LOG]

        def again(transaction: Transaction) -> int:
            for table in reversed(folds):
                transaction.connection.execute(table.delete())
            done = 0
            position = editor_event.c.position
            for rows in pages_in_order(transaction.connection, EVENTS, position, _PAGE, removed_by):
                for row in rows:
                    for statement in transaction.fold(Event(*row)):
                        transaction.connection.execute(statement)
                done += len(rows)
            return done

        return await self._write(again)

    async def verify(self, tell: Callable[[int], None] = lambda _: None) -> list[Damage]:
        """Return the first damage of each stream; an empty list for a sound log. Every changed and
        every missing event is found. `tell` is called with the number of events read so far. If the
        journal cannot be read, that is the last damage of the list."""
        inspector = Inspector(taken_out)
        try:
            slots = await self._ask(self._database.slots)
            order = LogOrder(slots, removed_by)
            after = {slot: before_first(slot) for slot in slots}
            while (slot := order.needed) is not None:
                rows, after[slot] = await self._ask(partial(self._database.scan, after=after[slot]))
                order.add(slot, rows if len(slots) == 1 else _in_slot(slot, rows))
                for row in order.take():
                    inspector.see(row)
                tell(inspector.seen)
            ends = await self.query(select(_head.stream, _head.seq, _head.chain))
            found = inspector.findings(tuple(row) for row in ends)
            complaints = await self._ask(self._database.complaints)
        except Unavailable as error:
            return [*inspector.findings(None), Damage("", 0, error.detail)]
        return [*found, *(Damage("", 0, text) for text in complaints)]

    async def health(self) -> str | None:
        """Return why nothing can be stored now; None if it can. Nothing is written."""
        try:
            await self._write(lambda transaction: transaction.connection)
        except Unavailable as error:
            return error.detail
        return None

    async def parts(self) -> Mapping[str, str | None]:
        """Return the health of the parts `database`, `writer` (its thread) and `schema`: None for a
        part that works, else the reason. The check tries to write, and answers within seconds."""
        return await self._probe.parts()

    @property
    def slot(self) -> int | None:
        """Return the slot in which this process stores events; None while it has no connection."""
        return self._writer.slot

    @property
    def metrics(self) -> CommitMetrics:
        """Return the metrics of the writer's commits."""
        return self._writer.metrics

    async def ask(self, question: Callable[[Connection], T]) -> T:
        """Answer a question about stored data, on a thread of this process. Raise Unavailable if
        the journal cannot be read."""
        return await self._ask(question)

    @property
    def address(self) -> str:
        """The URL by which a worker reads the database. Never show or log it, since it may hold a
        password."""
        return self._database.address

    @property
    def database_name(self) -> str:
        """Return the name of the database for people: without a password."""
        return self._database.name

    async def bytes_in_use(self) -> dict[str, int]:
        """Return the bytes of the database and its write-ahead log, by name. Raise Unavailable or
        OSError if they cannot be read."""
        return await self._ask(self._database.bytes_in_use)

    async def close(self) -> None:
        """Commit what was appended, then close the database. Followers end."""
        if self._closed:
            return
        self._closed = True
        if self._polling is not None:
            self._polling.cancel()
        self._probe.close()
        self._submit()
        await asyncio.to_thread(self._writer.close)
        await asyncio.sleep(0)  # let the last outcomes arrive
        for follower in self._followers:
            follower.end()
        await self._database.close()
        self._database.disown()

    async def _write(self, work: Callable[[Transaction], T]) -> T:
        future: asyncio.Future[T] = self._loop.create_future()

        def done(result: T | None, error: BaseException | None) -> None:
            if future.done():  # the waiting task was cancelled
                pass
            elif error is None:
                future.set_result(cast("T", result))
            else:
                future.set_exception(error)

        self._queue(Job(work, done))
        # The waiting task may be cancelled; the job is not: it is written or it fails.
        return await future

    def _queue(self, job: Job[Any]) -> None:
        if self._closed:
            raise Unavailable("The journal is closed.")
        if not self._jobs:
            self._loop.call_soon(self._submit)
        self._jobs.append(job)

    def _submit(self) -> None:
        if not self._jobs:
            return
        jobs, self._jobs = self._jobs, []
        # Followers get events in order, so results of the thread are reported first.
        if self._at_once and not self._untold and self._writer.is_quick(jobs):
            self._tell(self._writer.commit(jobs))
        else:
            self._untold += len(jobs)
            self._writer.submit(jobs)

    def _written(self, outcomes: JobOutcomes) -> None:
        self._loop.call_soon_threadsafe(self._tell_of_thread, outcomes)

    def _tell_of_thread(self, outcomes: JobOutcomes) -> None:
        self._untold -= len(outcomes)
        self._tell(outcomes)

    def _tell(self, outcomes: JobOutcomes) -> None:
        for job, (result, error, events) in outcomes:
            try:
                job.done(result, error)
            except Exception:  # a fault in one caller must not keep results from the others
                log.exception("the outcome of a job was not heard")
            for follower in self._followers:
                if self._polling is None:
                    follower.hear(events)
                elif events:  # those of other processes may come before them
                    follower.wake()

    async def _ask(self, question: Callable[[Connection], T]) -> T:
        if self._closed:
            raise Unavailable("The journal is closed.")
        try:
            return await self._database.ask(question)
        except self._database.faults as error:
            raise Unavailable(f"The journal cannot be read: {cause_of(error)}.") from error

    @contextlib.asynccontextmanager
    async def _following(self) -> AsyncIterator[AsyncIterator[Event]]:
        follower = Follower()
        self._followers.add(follower)
        try:
            yield self._heard(follower, await self.cursor())
        finally:
            self._followers.discard(follower)

    async def _heard(self, follower: Follower, seen: Cursor) -> AsyncIterator[Event]:
        """Yield new events after the moment `seen` from the queue of a follower, or from the database
        if the queue overflowed, until the journal is closed."""
        while True:
            found = await follower.next()
            if found is None:
                return
            if not found or not seen.has(found[0].position - 1):
                found = await self.read_since(seen)
                if len(found) >= _PAGE:
                    follower.wake()
            for each in found:
                if not seen.has(each.position):
                    seen = seen.after(each.position)
                    yield each

    async def _poll(self) -> None:
        """Wake the followers when other processes have stored events."""
        seen = Cursor()
        while True:
            await asyncio.sleep(_POLLED_S)
            if not self._followers:
                continue
            with contextlib.suppress(Unavailable):  # told by whoever writes
                now = await self.cursor()
                if now != seen:
                    seen = now
                    for follower in self._followers:
                        follower.wake()


def _in_slot(slot: int, rows: Sequence[Sequence[Any]]) -> list[Sequence[Any]]:
    """Return those of some stored events (`rows`: their columns) that are in a slot."""
    return [row for row in rows if slot_of(row[6]) == slot]


class JournalProbe:
    """Tests whether a journal can be written and read, on request, once a second at most. `write`
    commits something on the writer's thread, `read` asks beside it; `is_alive` returns whether that
    thread lives."""

    def __init__(
        self, branch: Branch, write: OnConnection, read: OnConnection, is_alive: Callable[[], bool]
    ) -> None:
        self._expected = revisions_of(branch)[-1]
        self._is_alive = is_alive
        self._writing = SharedCheck(
            lambda: _tried(write, _leave_no_trace), patience=_PROBE_TIMEOUT_S
        )
        self._reading = SharedCheck(lambda: _tried(read, self._misfit), patience=_PROBE_TIMEOUT_S)

    async def parts(self) -> dict[str, str | None]:
        """Return for each part of the journal None if it works, else the reason."""
        parts: dict[str, str | None] = {"database": None, "writer": None, "schema": None}
        if not self._is_alive():
            parts["writer"] = (
                "The thread that writes the journal has ended: start this process anew."
            )
            return parts
        wrote = await self._writing.answer()
        read = await self._reading.answer()
        if wrote:
            parts["database"] = wrote
        elif read is None:
            parts["database"] = f"The database does not answer within {_PROBE_TIMEOUT_S:g} s."
        elif wrote is None:
            parts["writer"] = (
                f"Nothing was stored within {_PROBE_TIMEOUT_S:g} s, though it can be read."
            )
        elif read:
            parts["schema"] = read
        return parts

    def close(self) -> None:
        """Cancel the tests that are under way."""
        self._writing.cancel()
        self._reading.cancel()

    def _misfit(self, connection: Connection) -> str:
        found = set(connection.scalars(select(VERSIONS.c.version_num)))
        if self._expected in found:
            return _FINE
        other = ", ".join(sorted(found)) or "none"
        return f"The tables are of another version ({other}, not {self._expected})."


async def _tried(way: OnConnection, question: Callable[[Connection], Any]) -> str:
    """Ask a question on a connection in this `way`; return the reason why that failed, or the text
    for success."""
    try:
        said: str | None = await way(question)
    except Unavailable as error:
        return error.detail
    return said or _FINE


def _leave_no_trace(connection: Connection) -> None:
    """Write and delete a row, as a test, so that the commit has to reach the disk as that of an
    edit does."""
    table = editor_snapshot
    connection.execute(insert(table).values(_PROBE_ROW))
    connection.execute(delete(table).where(table.c.stream == _PROBE_ROW["stream"]))
