"""The thread that writes a SQLite file: one connection, one transaction for all who wait."""

import logging
import queue
import sqlite3
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, Generic, TypeAlias, TypeVar

from sqlalchemy import Connection, Engine, StaticPool, create_engine
from sqlalchemy.exc import DatabaseError, IntegrityError

from action_assistant.errors import Conflict, Unavailable
from action_assistant.journal.events import Addition, Event, Fold

log: Final = logging.getLogger(__name__)

T = TypeVar("T")
Clock: TypeAlias = Callable[[], int]
#: What became of a job: its result, or why there is none; the events it wrote.
Outcome: TypeAlias = tuple[Any, BaseException | None, list[Event]]

_TOGETHER: Final = 1000  # jobs in one transaction
_WAIT: Final = 5.0  # seconds for a lock that only a foreign process could hold
_INSERT: Final = (
    "INSERT INTO event (stream, seq, kind, author, at, body, position) VALUES (?, ?, ?, ?, ?, ?, ?)"
)


def now() -> int:
    """Microseconds since 1970."""
    return time.time_ns() // 1000


class Job(Generic[T]):
    """Work for the writer's thread. `done` is called on that thread, after the commit or failure."""

    def __init__(
        self,
        work: Callable[["Pen"], T],
        done: Callable[[T | None, BaseException | None, Sequence[Event]], None],
    ) -> None:
        self.work = work
        self.done = done


class Pen:
    """What a job writes with, inside a transaction that is already open."""

    def __init__(self, connection: Connection, fold: Fold, clock: Clock) -> None:
        self.connection = connection
        self.fold = fold
        self.written: list[Event] = []
        self._clock = clock
        self._heads: dict[str, int] = {}
        (self._position,) = self._one("SELECT coalesce(max(position), 0) FROM event")

    def add(self, addition: Addition) -> int:
        """Append to one stream and fold; the newest seq. Raises Conflict."""
        head = self._head(addition.stream)
        if addition.expected is not None and addition.expected != head:
            raise Conflict(
                f"{addition.stream} has gone on to {head}; {addition.expected} was expected."
            )
        at = self._clock()
        for draft in addition.drafts:
            head += 1
            self._position += 1
            event = Event(
                addition.stream, head, draft.kind, draft.author, at, draft.body, self._position
            )
            self._raw.execute(_INSERT, (event.stream, *_columns(event)))
            for statement in self.fold(event):
                self.connection.execute(statement)
            self.written.append(event)
        self._heads[addition.stream] = head
        return head

    def run(self, sql: str, values: Sequence[object] = ()) -> None:
        """Driver SQL, for what SQLAlchemy would only slow down."""
        self._raw.execute(sql, values)

    def forget(self) -> None:
        """What was written did not happen: read the newest places again."""
        self._heads.clear()
        self.written = []
        (self._position,) = self._one("SELECT coalesce(max(position), 0) FROM event")

    def _head(self, stream: str) -> int:
        head = self._heads.get(stream)
        if head is None:
            sql = "SELECT coalesce(max(seq), 0) FROM event WHERE stream = ?"
            (head,) = self._one(sql, (stream,))
        return head

    @property
    def _raw(self) -> sqlite3.Connection:
        raw: Any = self.connection.connection.dbapi_connection
        connection: sqlite3.Connection = raw
        return connection

    def _one(self, sql: str, values: Sequence[object] = ()) -> tuple[int]:
        row: tuple[int] = self._raw.execute(sql, values).fetchone()
        return row


class Writer:
    """The only writer of a file. What waits while a commit is under way makes up the next one."""

    def __init__(self, path: Path, fold: Fold, clock: Clock = now) -> None:
        self._path = path
        self._fold = fold
        self._clock = clock
        self._jobs: queue.SimpleQueue[Job[Any] | None] = queue.SimpleQueue()
        self._engine: Engine | None = None
        self._pen: Pen | None = None
        self._thread = threading.Thread(target=self._run, name=f"journal {path.name}", daemon=True)
        self._thread.start()

    def submit(self, job: Job[Any]) -> None:
        """Queue a job; returns at once."""
        self._jobs.put(job)

    def close(self) -> None:
        """Finish what was submitted, then end the thread. Blocks."""
        self._jobs.put(None)
        self._thread.join()

    def _run(self) -> None:
        while True:
            jobs, last = self._next()
            if jobs:
                self._commit(jobs)
            if last:
                self._disconnect()
                return

    def _next(self) -> tuple[list[Job[Any]], bool]:
        """Everything that waits, at least one; whether to end after it."""
        found: list[Job[Any]] = []
        job = self._jobs.get()
        while job is not None:
            found.append(job)
            if len(found) == _TOGETHER:
                return found, False
            try:
                job = self._jobs.get_nowait()
            except queue.Empty:
                return found, False
        return found, True

    def _commit(self, jobs: list[Job[Any]]) -> None:
        done: list[Outcome]
        try:
            pen = self._connected()
            pen.run("BEGIN IMMEDIATE")
            done = [_attempt(pen, job) for job in jobs]
            pen.run("COMMIT")
        except (sqlite3.Error, DatabaseError) as error:
            # After a failed commit nobody knows what the disk holds: begin again from the file.
            log.error("the journal %s cannot be written: %s", self._path, error)
            self._disconnect()
            refusal = Unavailable(f"Nothing can be stored at the moment: {_cause(error)}.")
            done = [(None, refusal, [])] * len(jobs)
        for job, (result, error_, events) in zip(jobs, done, strict=True):
            job.done(result, error_, events)

    def _connected(self) -> Pen:
        if self._pen is None:
            self._engine = create_engine(
                f"sqlite:///{self._path}",
                poolclass=StaticPool,
                isolation_level="AUTOCOMMIT",  # BEGIN and COMMIT are ours to say
                connect_args={"timeout": _WAIT, "check_same_thread": False},
            )
            connection = self._engine.connect()
            for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON"):
                connection.exec_driver_sql(f"PRAGMA {pragma}")
            self._pen = Pen(connection, self._fold, self._clock)
        return self._pen

    def _disconnect(self) -> None:
        if self._pen is not None:
            try:
                self._pen.connection.close()
            except (sqlite3.Error, DatabaseError) as error:
                log.warning("closing %s: %s", self._path, error)
        if self._engine is not None:
            self._engine.dispose()
        self._pen = self._engine = None


def _attempt(pen: Pen, job: Job[Any]) -> Outcome:
    """One job in a savepoint of its own, so that what it did wrong touches nobody else's work."""
    pen.run("SAVEPOINT job")
    try:
        result = job.work(pen)
    except sqlite3.Error:
        raise  # the file, not the job
    except DatabaseError as error:
        if not isinstance(error, IntegrityError):
            raise
        outcome: Outcome = (None, _clash(error), [])
    except Exception as error:  # noqa: BLE001 - the job's own; whoever waits for it gets it
        outcome = (None, error, [])
    else:
        pen.run("RELEASE job")
        events, pen.written = pen.written, []
        return result, None, events
    pen.run("ROLLBACK TO job")
    pen.run("RELEASE job")
    pen.forget()
    return outcome


def _clash(error: IntegrityError) -> Conflict:
    return Conflict(f"This is in the way of something that is already stored: {error.orig}.")


def _cause(error: Exception) -> object:
    return error.orig if isinstance(error, DatabaseError) else error


def _columns(event: Event) -> tuple[object, ...]:
    return event.seq, event.kind, event.author, event.at, event.body, event.position
