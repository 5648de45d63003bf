"""Writes a journal, on a thread or at once: one connection, one transaction for all who wait."""

import logging
import queue
import threading
import time
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any, Final, Generic, TypeAlias, TypeVar

from sqlalchemy import Connection, Select, select
from sqlalchemy.exc import DBAPIError, IntegrityError

from action_assistant.errors import BadInput, Conflict, Unavailable
from action_assistant.journal.chain import NOTHING, Head, link
from action_assistant.journal.commit_metrics import CommitMetrics
from action_assistant.journal.database import Database, Overtaken, WriterSession, cause_of
from action_assistant.journal.events import Addition, Event, Fold
from action_assistant.journal.slots import newest_in
from action_assistant.kit.clock import utc_us
from action_assistant.schema import editor_tables

log: Final = logging.getLogger(__name__)

T = TypeVar("T")
#: The outcome of a job: its result, or its error; and the events that it wrote.
Outcome: TypeAlias = tuple[Any, BaseException | None, list[Event]]

_AT_ONCE: Final = 50  # jobs that are committed without the thread
_TOGETHER: Final = 1000  # jobs after which no others join a transaction
_HEAVY: Final = 16 << 20  # bytes in one statement, beyond which no other job joins
_KNOWN: Final = 10_000  # streams whose ends are kept in memory
_AGAIN: Final = 0.1  # seconds between attempts to find out about a commit
_RUNS: Final = 5  # of the same jobs, where another process goes on writing to their streams
_head: Final = editor_tables.editor_head.c


class Job(Generic[T]):
    """Work for the writer. `done` is called with the result or the error; it must not raise.
    `is_brief`: the job only appends a little to one stream."""

    def __init__(
        self,
        work: Callable[["Transaction"], T],
        done: Callable[[T | None, BaseException | None], None],
        *,
        is_brief: bool = False,
    ) -> None:
        self.work: Final = work
        self.done: Final = done
        self.is_brief: Final = is_brief


#: Jobs of one transaction, each with its outcome.
JobOutcomes: TypeAlias = Sequence[tuple[Job[Any], Outcome]]


class Transaction:
    """The transaction that jobs write in. Events are gathered, and stored by one statement at the
    end.

    A job that only appends costs no round trip of its own. Every other statement of a job is inside
    a savepoint, so that a failed job does not affect the others.
    """

    def __init__(self, session: WriterSession, fold: Fold) -> None:
        self.fold: Final = fold
        self._session = session
        last = newest_in(editor_tables.editor_event.c.position, session.slot)
        self._position: int = session.connection.execute(last).scalar_one()
        self._heads: dict[str, Head] = {}
        self._stored: dict[str, Head] = {}  # ends of the same streams in the database
        self._epochs: dict[str, int] = {}  # of the same streams, where the database is shared
        self._before: dict[str, Head] = {}  # ends of streams before the job that is under way
        self._gathered: list[tuple[Event, bytes]] = []  # by earlier jobs
        self._own: list[tuple[Event, bytes]] = []  # by this job
        self._weight = 0  # bytes since something was stored
        self._begun = self._entered = self._storing = False
        #: True once the statement was sent that commits.
        self.committing = False
        #: The last event of this transaction, with its chain: where it is, all is.
        self.last: tuple[Event, bytes] | None = None

    def start(self) -> None:
        """Begin a new transaction for the next jobs."""
        self.last = None
        self.committing = False
        if len(self._heads) > _KNOWN:
            self._heads.clear()
            self._stored.clear()
            self._epochs.clear()

    def hold(self, streams: Sequence[str]) -> None:
        """Begin on the server, and let no other process append to these streams until the end of this
        transaction, so that it cannot be overtaken in them again. Call it before the first job."""
        self._session.begin()
        self._begun = True
        self._session.hold(streams)

    @property
    def connection(self) -> Connection:
        """The connection for statements inside of this job's savepoint."""
        if not self._entered:
            self._flush()
            self._session.say("SAVEPOINT job")
            self._entered = True
        return self._session.connection

    def add(self, addition: Addition) -> int:
        """Append events to one stream and fold them into the tables; return the newest seq. Raise
        Conflict if the stream has another end than `expected`, BadInput if a text cannot be stored.
        """
        stream = addition.stream
        _check_text(stream)
        for each in addition.drafts:
            _check_text(each.kind)
            _check_text(each.author)
        head = self._head(stream)
        expected = addition.expected
        if addition.epoch is not None or (expected is not None and expected != head.seq):
            head = self._confirmed(addition, head)
        at, seq, chain = utc_us(), head.seq, head.chain
        for draft in addition.drafts:
            seq += 1
            self._position += 1
            event = Event(stream, seq, draft.kind, draft.author, at, draft.body, self._position)
            chain = link(chain, event)
            self._own.append((event, chain))
            for statement in self.fold(event):
                self.connection.execute(statement)
        head = Head(seq, chain)
        self._before.setdefault(stream, self._heads[stream])
        self._heads[stream] = head
        return head.seq

    def end(self, stream: str) -> Head:
        """Return the end of a stream (number and hash), with the events that earlier jobs of this
        transaction added."""
        return self._head(stream)

    def attempt(self, job: Job[Any], database: Database) -> Outcome:
        """Run one job and return its outcome. An error of the job is in the outcome; only an error
        that prevents storing anything at all is raised, and Overtaken."""
        position = self._position
        self._before.clear()
        try:
            result = job.work(self)
            if self._entered:
                self._store(self._own)
                self._session.say("RELEASE SAVEPOINT job")
        except Overtaken:
            raise
        except Exception as error:  # of the job alone: its caller gets it
            if isinstance(error, database.faults):
                if database.raced(error):
                    raise Overtaken(()) from error
                if self._storing or database.lost(error):
                    raise
            self._own.clear()
            self._position = position
            self._heads |= self._before
            if self._entered:
                self._session.say("ROLLBACK TO SAVEPOINT job")
                self._session.say("RELEASE SAVEPOINT job")
            self._entered = False
            return None, _told(error), []
        own, self._own = self._own, []
        if not self._entered:
            self._gathered += own
        self._entered = False
        self._weight += sum(len(event.body) for event, _ in own)
        if self._weight > _HEAVY:
            self._flush()
        return result, None, [event for event, _ in own]

    def finish(self) -> None:
        """Commit. If this fails after `committing` is set, it is unknown whether the commit has
        happened."""
        self.committing = True
        if self._begun:
            self.committing = False
            self._store(self._gathered)
            self.committing = True
            self._session.say("COMMIT")
        else:
            self._store(self._gathered)
        self._gathered = []
        self._begun = False

    def _flush(self) -> None:
        """Store the events that earlier jobs gathered; the transaction stays open."""
        if not self._begun:
            self._session.begin()
            self._begun = True
        gathered, self._gathered = self._gathered, []
        self._store(gathered)

    def _store(self, events: list[tuple[Event, bytes]]) -> None:
        self._weight = 0
        if events:
            self._storing = True
            self.last = events[-1]
            self._session.store(events, self._stored, self._epochs)
            self._storing = False
            for event, chain in events:
                self._stored[event.stream] = Head(event.seq, chain)

    def _confirmed(self, addition: Addition, head: Head) -> Head:
        """Return the end of the stream of an addition, `head` as it is remembered. In a shared database
        another process may have moved it: it is read again before the addition is refused, unless events wait
        for it in this transaction, which are compared with the database when they are stored. Raise Conflict
        if the addition was made for another end or epoch."""
        stream = addition.stream
        refusal = self._refusal(addition, head)
        if refusal and self._session.is_shared and head == self._stored[stream]:
            del self._heads[stream]
            head = self._head(stream)
            refusal = self._refusal(addition, head)
        if refusal:
            raise Conflict(refusal)
        return head

    def _refusal(self, addition: Addition, head: Head) -> str:
        """Return why an addition was not made for the end of its stream (`head`); "" if it was."""
        stream, expected = addition.stream, addition.expected
        if expected is not None and expected != head.seq:
            return f"{stream} has gone on to {head.seq}; {expected} was expected."
        if addition.epoch is not None and addition.epoch != self._epochs.get(stream):
            return f"Another process owns {stream} now."
        return ""

    def _head(self, stream: str) -> Head:
        head = self._heads.get(stream)
        if head is None:
            shared = self._session.is_shared
            columns = (_head.seq, _head.chain, *((_head.epoch,) if shared else ()))
            found = select(*columns).where(_head.stream == stream)
            row = self._session.connection.execute(found).first()
            head = self._heads[stream] = Head(*row[:2]) if row is not None else NOTHING
            self._stored[stream] = head
            if shared:
                self._epochs[stream] = row[2] if row is not None else 0
        return head


class Writer:
    """The only writer of a database, with a thread of its own. Jobs that wait during a commit form
    the next transaction. `tell` is called on the writer's thread after each commit or failure, once
    for all its jobs."""

    def __init__(
        self,
        database: Database,
        session: WriterSession | None,
        fold: Fold,
        tell: Callable[[JobOutcomes], None],
    ) -> None:
        self._database = database
        self._session = session
        self._fold = fold
        self._tell = tell
        self.metrics: Final = CommitMetrics()
        self._transaction: Transaction | None = None
        self._jobs: queue.SimpleQueue[Sequence[Job[Any]] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(
            target=self._run, name=f"{database.name} writer", daemon=True
        )
        self._thread.start()

    def submit(self, jobs: Sequence[Job[Any]]) -> None:
        """Queue jobs, for one transaction if it can hold them; return at once."""
        self.metrics.submitted(len(jobs))
        self._jobs.put(jobs)

    def commit(self, jobs: Sequence[Job[Any]]) -> JobOutcomes:
        """Commit jobs on this thread, which blocks, and return their outcomes. Call it only after
        `tell` has reported the outcomes of all jobs submitted before."""
        self.metrics.submitted(len(jobs))
        return self._commit(jobs)

    def is_quick(self, jobs: Sequence[Job[Any]]) -> bool:
        """Return whether `commit` is expected to be quick with `jobs` (decision 94)."""
        return (
            self._database.is_local
            and self.metrics.quick.are_quick
            and self.metrics.failing is None
            and self._transaction is not None  # to connect again may take long
            and len(jobs) <= _AT_ONCE
            and all(job.is_brief for job in jobs)
        )

    @property
    def slot(self) -> int | None:
        """Return the slot in which events are stored; None while there is no connection."""
        session = self._session
        return None if session is None else session.slot

    @property
    def is_alive(self) -> bool:
        """Return whether the writer's thread still runs."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Finish all submitted jobs, then end the thread. Blocks."""
        self._jobs.put(None)
        self._thread.join()

    def _run(self) -> None:
        while True:
            jobs, last = self._next()
            if jobs:
                self._tell(self._commit(jobs))
            if last:
                self._disconnect()
                return

    def _next(self) -> tuple[list[Job[Any]], bool]:
        """Wait for jobs; return all that are queued, and whether the writer has to end after them."""
        found: list[Job[Any]] = []
        jobs = self._jobs.get()
        while jobs is not None:
            found += jobs
            if len(found) >= _TOGETHER:
                return found, False
            try:
                jobs = self._jobs.get_nowait()
            except queue.Empty:
                return found, False
        return found, True

    def _commit(self, jobs: Sequence[Job[Any]]) -> JobOutcomes:
        done: list[Outcome] = []
        transaction: Transaction | None = None
        held: Sequence[str] = ()  # streams by which another process has overtaken this one
        self.metrics.begins()
        try:
            for run in range(_RUNS):
                session, transaction = self._connected()
                try:
                    session.run(partial(self._together, transaction, jobs, done, held))
                    break
                except Overtaken as error:
                    # Read all ends again. A job that was made for another end is refused then, alone.
                    transaction = None  # the server refused it whole
                    held = error.streams
                    self._forget_ends(session, error)
                    if run == _RUNS - 1:
                        raise
                    done.clear()
        except Exception as error:  # the thread lives on, and all callers get the error
            # After a failed commit it is unknown what the disk holds: read it again.
            ours = not isinstance(error, (Overtaken, *self._database.faults))
            why = cause_of(error)
            is_known = not ours and why == self.metrics.failing  # said once, until it works again
            level = logging.DEBUG if is_known else logging.ERROR
            log.log(level, "%s was not written: %s", self._database.name, why, exc_info=ours)
            self._disconnect()
            done = self._settled(transaction, done, len(jobs), error)
            self.metrics.failed(len(jobs), why)
        else:
            self.metrics.over(len(jobs), [events for _, failed, events in done if failed is None])
        return list(zip(jobs, done, strict=True))

    def _forget_ends(self, session: WriterSession, error: Overtaken) -> None:
        """Forget what is known of the ends of streams, since this process was overtaken. Where it should
        be the only writer, or another one stores in its slot, take the lock again: who has it is the
        writer."""
        if session.is_shared and not error.by_position:
            self._transaction = None
            session.run(session.abandon)
            return
        log.error("%s: %s (%s).", self._database.name, error, ", ".join(error.streams[:1]))
        self._disconnect()

    def _together(
        self,
        transaction: Transaction,
        jobs: Sequence[Job[Any]],
        done: list[Outcome],
        held: Sequence[str],
    ) -> None:
        transaction.start()
        if held:
            transaction.hold(held)
        done.extend(transaction.attempt(job, self._database) for job in jobs)
        transaction.finish()

    def _settled(
        self, transaction: Transaction | None, done: list[Outcome], jobs: int, error: Exception
    ) -> list[Outcome]:
        """Return the outcomes of `jobs` jobs whose transaction failed with `error`: all stored
        (`done`), none stored, or unknown."""
        text = f"Nothing can be stored at the moment: {cause_of(error)}."
        if transaction is not None and transaction.committing and transaction.last is not None:
            match self._stored(*transaction.last):
                case True:
                    return done
                case None:
                    text = f"It is not known whether this was stored: {cause_of(error)}."
        return [(None, Unavailable(text), [])] * jobs

    def _stored(self, event: Event, chain: bytes) -> bool | None:
        """Return whether an event is in the log, at its position and with the chain hash `chain`.
        Return None if the database does not answer in time."""
        table = editor_tables.editor_event
        found = select(table.c.chain).where(table.c.position == event.position)
        until = time.monotonic() + self._database.patience
        said = ""
        while True:
            try:
                session, _ = self._connected()
                return session.run(partial(_scalar, session, found)) == chain
            except self._database.faults as error:
                if said != (said := cause_of(error)):
                    log.warning("%s does not answer: %s", self._database.name, said)
                self._disconnect()
            if time.monotonic() > until:
                return None
            time.sleep(_AGAIN)

    def _connected(self) -> tuple[WriterSession, Transaction]:
        session = self._session
        if session is None or not session.alive():
            self._disconnect()
            session = self._session = self._database.connect()
        if self._transaction is None:
            self._transaction = session.run(lambda: Transaction(session, self._fold))
        return session, self._transaction

    def _disconnect(self) -> None:
        session, self._session, self._transaction = self._session, None, None
        if session is None:
            return
        try:
            session.close()
        except Exception:  # the thread lives on with another one
            log.exception("a connection to %s could not be closed", self._database.name)


def _scalar(session: WriterSession, chosen: Select[Any]) -> object:
    return session.connection.execute(chosen).scalar()


@lru_cache(_KNOWN)  # the same names come again and again
def _check_text(text: str) -> None:
    """Raise BadInput for a text that some database cannot store. At the commit such an error would
    affect other jobs."""
    try:
        if b"\0" not in text.encode():
            return
    except UnicodeEncodeError as error:
        raise BadInput("A name cannot hold half of a character.") from error
    raise BadInput("A name cannot hold the character NUL.")


def _told(error: Exception) -> Exception:
    """Return the exception that a caller gets if its job failed with `error`."""
    if isinstance(error, IntegrityError):
        return Conflict(f"This is in the way of something that is already stored: {error.orig}.")
    if isinstance(error, DBAPIError):
        return BadInput(f"This cannot be stored: {error.orig}.")
    return error
