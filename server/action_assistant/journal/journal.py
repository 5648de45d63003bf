"""The journal of one process: append, read, follow. Nothing is told before it is committed."""

import asyncio
import contextlib
import fcntl
import hashlib
import os
from collections import deque
from collections.abc import AsyncIterator, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import Any, Final, TypeVar

from sqlalchemy import Connection, Engine, QueuePool, Row, Select, create_engine, event
from sqlalchemy.exc import DatabaseError

from action_assistant.errors import CannotStart, Unavailable
from action_assistant.journal.events import Addition, Draft, Event, Fold, Snapshot
from action_assistant.journal.migrate import BRANCHES, Branch, file_of, migrate
from action_assistant.journal.sqlite import Job, Pen, Writer
from action_assistant.journal.tables import LOG

T = TypeVar("T")

_READERS: Final = 3  # threads, each with a connection
_HELD: Final = 1000  # events that wait for a follower in memory; after that it reads them
_PAGE: Final = 500  # events that a follower reads at once
_COLUMNS: Final = "stream, seq, kind, author, at, body, position"


class Journal:
    """The log of one process. The only writer of its database; readers never wait for it."""

    def __init__(self, path: Path, branch: Branch, fold: Fold, lock: int) -> None:
        self._branch: Final = branch
        self._lock = lock
        self._loop = asyncio.get_running_loop()
        self._writer = Writer(path, fold)
        self._readers = ThreadPoolExecutor(_READERS, thread_name_prefix=f"{branch} reader")
        self._engine = _reading(path)
        self._followers: set[_Follower] = set()
        self._closed = False

    @staticmethod
    def prepare(url: str, branch: Branch) -> None:
        """Raise CannotStart if `open` would: to be called before a server is begun."""
        lock = _own(file_of(url))
        try:
            migrate(url, branch)
        finally:
            _disown(lock)

    @classmethod
    async def open(cls, url: str, *, branch: Branch, fold: Fold) -> "Journal":
        """Open, and bring the tables to this version. `url` is `sqlite:///PATH`.

        Raises CannotStart: newer or foreign database, folder that cannot be written, in use.
        """
        path = file_of(url)
        lock = _own(path)
        try:
            await asyncio.to_thread(migrate, url, branch)
            return cls(path, branch, fold, lock)
        except BaseException:
            _disown(lock)
            raise

    async def append(
        self, stream: str, drafts: Sequence[Draft], *, expected: int | None = None
    ) -> int:
        """Add events; their newest seq, after COMMIT. Raises Conflict, Unavailable."""
        (newest,) = await self.append_all([Addition(stream, tuple(drafts), expected)])
        return newest

    async def append_all(self, additions: Sequence[Addition]) -> list[int]:
        """Add events to several streams at once, all or none; the newest seq of each."""
        return await self._write(lambda pen: [pen.add(addition) for addition in additions])

    async def read(
        self, stream: str, *, after: int = 0, upto: int | None = None, limit: int | None = None
    ) -> list[Event]:
        """The events of a stream with `after < seq <= upto`, in order."""
        where = "stream = ? AND seq > ?" + ("" if upto is None else " AND seq <= ?")
        values: list[object] = [stream, after, *([] if upto is None else [upto])]
        sql = f"SELECT {_COLUMNS} FROM event WHERE {where} ORDER BY seq LIMIT ?"
        return await self._events(sql, [*values, -1 if limit is None else limit])

    async def read_all(self, *, after: int = 0, limit: int = _PAGE) -> list[Event]:
        """The events of all streams with `position > after`, in order."""
        sql = f"SELECT {_COLUMNS} FROM event WHERE position > ? ORDER BY position LIMIT ?"
        return await self._events(sql, [after, limit])

    async def newest(self, stream: str) -> int:
        """The seq of a stream's last event; 0 when there is none."""
        sql = "SELECT coalesce(max(seq), 0) FROM event WHERE stream = ?"
        return await self._number(sql, (stream,))

    async def position(self) -> int:
        """The position of the last event of all."""
        return await self._number("SELECT coalesce(max(position), 0) FROM event")

    async def query(self, statement: Select[Any]) -> list[Row[Any]]:
        """Ask the tables."""
        return await self._ask(lambda connection: list(connection.execute(statement).all()))

    def follow(self) -> AbstractAsyncContextManager[AsyncIterator[Event]]:
        """What is committed from now on, in order. Memory is bounded: who is slow reads later."""
        return self._following()

    async def snapshot(self, stream: str) -> Snapshot | None:
        """The cached sum of a stream; None when there is none, or when it does not fit the log."""
        sql = "SELECT seq, proof, state FROM snapshot WHERE stream = ?"

        def find(connection: Connection) -> Snapshot | None:
            row = connection.exec_driver_sql(sql, (stream,)).first()
            if row is None:
                return None
            proof = _proof(_body(connection, stream, row.seq), row.state)
            return Snapshot(stream, row.seq, row.state) if proof == row.proof else None

        return await self._ask(find)

    async def keep_snapshot(self, stream: str, seq: int, state: bytes) -> None:
        """Cache what a stream adds up to at `seq`. Raises Unavailable."""
        sql = "INSERT OR REPLACE INTO snapshot (stream, seq, proof, state) VALUES (?, ?, ?, ?)"

        def keep(pen: Pen) -> None:
            proof = _proof(_body(pen.connection, stream, seq), state)
            pen.run(sql, (stream, seq, proof, state))

        await self._write(keep)

    async def rebuild(self) -> int:
        """Make all tables again from the events, in one transaction; the number of events."""
        folds = [t for t in BRANCHES[self._branch].sorted_tables if t.name not in LOG]
        sql = f"SELECT {_COLUMNS} FROM event WHERE position > ? ORDER BY position LIMIT {_PAGE}"

        def again(pen: Pen) -> int:
            for table in reversed(folds):
                pen.connection.execute(table.delete())
            done = position = 0
            while rows := pen.connection.exec_driver_sql(sql, (position,)).all():
                for row in rows:
                    for statement in pen.fold(Event(*row)):
                        pen.connection.execute(statement)
                done += len(rows)
                position = rows[-1].position
            return done

        return await self._write(again)

    async def health(self) -> str | None:
        """Why nothing can be stored at the moment; None when it can. Writes nothing."""
        try:
            await self._write(lambda _: None)
        except Unavailable as error:
            return error.detail
        return None

    async def close(self) -> None:
        """Finish what was appended, then let go of the file. Followers end."""
        if self._closed:
            return
        self._closed = True
        await asyncio.to_thread(self._writer.close)
        await asyncio.sleep(0)  # let the last outcomes arrive
        for follower in self._followers:
            follower.end()
        await asyncio.to_thread(self._readers.shutdown)
        self._engine.dispose()
        _disown(self._lock)

    async def _write(self, work: Callable[[Pen], T]) -> T:
        if self._closed:
            raise Unavailable("The journal is closed.")
        future: asyncio.Future[T] = self._loop.create_future()

        def done(result: T | None, error: BaseException | None, events: Sequence[Event]) -> None:
            self._loop.call_soon_threadsafe(self._tell, future, result, error, events)

        self._writer.submit(Job(work, done))
        # Whoever waits may be cancelled; the job may not: it is written or it is not.
        return await asyncio.shield(future)

    def _tell(
        self,
        future: "asyncio.Future[Any]",
        result: object,
        error: BaseException | None,
        events: Sequence[Event],
    ) -> None:
        if error is None:
            future.set_result(result)
        else:
            future.set_exception(error)
            future.exception()  # seen: the one who waited may have been cancelled
        for follower in self._followers:
            follower.hear(events)

    async def _ask(self, question: Callable[[Connection], T]) -> T:
        def asked() -> T:
            try:
                with self._engine.connect() as connection:
                    return question(connection)
            except DatabaseError as error:
                raise Unavailable(f"The journal cannot be read: {error.orig}.") from error

        if self._closed:
            raise Unavailable("The journal is closed.")
        return await self._loop.run_in_executor(self._readers, asked)

    async def _events(self, sql: str, values: Sequence[object]) -> list[Event]:
        def find(connection: Connection) -> list[Event]:
            return [Event(*row) for row in connection.exec_driver_sql(sql, tuple(values))]

        return await self._ask(find)

    async def _number(self, sql: str, values: Sequence[object] = ()) -> int:
        def find(connection: Connection) -> int:
            number: int = connection.exec_driver_sql(sql, tuple(values)).scalar_one()
            return number

        return await self._ask(find)

    @contextlib.asynccontextmanager
    async def _following(self) -> AsyncIterator[AsyncIterator[Event]]:
        follower = _Follower()
        self._followers.add(follower)
        try:
            yield self._heard(follower, await self.position())
        finally:
            self._followers.discard(follower)

    async def _heard(self, follower: "_Follower", last: int) -> AsyncIterator[Event]:
        """Events from memory, or from the file where memory was not enough."""
        while True:
            found = await follower.next()
            if found is None:
                return
            if not found or found[0].position > last + 1:
                found = await self.read_all(after=last)
                if len(found) == _PAGE:
                    follower.wake()
            for each in found:
                if each.position > last:
                    last = each.position
                    yield each


class _Follower:
    """What waits for one follower."""

    def __init__(self) -> None:
        self._waiting: deque[Event] = deque()
        self._missed = False
        self._ended = False
        self._news = asyncio.Event()

    def hear(self, events: Sequence[Event]) -> None:
        if not events or self._missed:
            return
        if len(self._waiting) + len(events) > _HELD:
            self._waiting.clear()
            self._missed = True
        else:
            self._waiting.extend(events)
        self._news.set()

    def wake(self) -> None:
        """There is more to read."""
        self._waiting.clear()
        self._missed = True
        self._news.set()

    def end(self) -> None:
        self._ended = True
        self._news.set()

    async def next(self) -> list[Event] | None:
        """What came; empty when something was missed and has to be read; None at the end."""
        await self._news.wait()
        found = list(self._waiting)
        if self._ended and not found and not self._missed:
            return None
        self._waiting.clear()
        self._missed = False
        if not self._ended:
            self._news.clear()
        return found


def _own(path: Path) -> int:
    """Lock the database for this process; two writers of one log would tear it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.with_name(f"{path.name}.lock").open("ab")
    except OSError as error:
        raise CannotStart(f"Cannot write to the folder {path.parent}: {error.strerror}.") from error
    with file:
        descriptor = file.fileno()
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise CannotStart(f"The database {path} is in use by another process.") from error
        return os.dup(descriptor)


def _disown(lock: int) -> None:
    os.close(lock)


def _reading(path: Path) -> Engine:
    engine = create_engine(
        f"sqlite:///{path}",
        poolclass=QueuePool,
        pool_size=_READERS,
        isolation_level="AUTOCOMMIT",
        connect_args={"check_same_thread": False},
    )

    @event.listens_for(engine, "connect")
    def _only_read(connection: Any, _: object) -> None:
        connection.execute("PRAGMA query_only=ON")
        connection.execute("PRAGMA wal_autocheckpoint=0")

    return engine


def _body(connection: Connection, stream: str, seq: int) -> bytes:
    sql = "SELECT body FROM event WHERE stream = ? AND seq = ?"
    body = connection.exec_driver_sql(sql, (stream, seq)).scalar()
    return bytes(body) if body is not None else b""


def _proof(body: bytes, state: bytes) -> bytes:
    """Ties a snapshot to its own bytes and to the event it was made at."""
    return hashlib.sha256(hashlib.sha256(body).digest() + state).digest()
