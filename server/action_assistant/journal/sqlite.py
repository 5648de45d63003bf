"""A journal in one SQLite file: WAL, every commit on the disk before anyone hears of it."""

import asyncio
import logging
import os
import shutil
import sqlite3
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from functools import lru_cache
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, TypeVar
from urllib.parse import quote

from sqlalchemy import Connection, Engine, NullPool, QueuePool, create_engine, event
from sqlalchemy.exc import (
    DatabaseError,
    DataError,
    IntegrityError,
    InterfaceError,
    ProgrammingError,
)

from action_assistant.errors import CannotStart
from action_assistant.journal.chain import Damage, Head, Inspector
from action_assistant.journal.database import Before, Branch, cause_of, no_copy
from action_assistant.journal.events import Event
from action_assistant.journal.lock import own as own
from action_assistant.journal.migrate import kept_as_it_is, recognize, upgrade_to
from action_assistant.journal.removal import taken_out
from action_assistant.private_files import opener

log: Final = logging.getLogger(__name__)

T = TypeVar("T")

_READERS: Final = 3  # threads, each with a connection
_WAIT: Final = 5.0  # seconds for a lock that only a foreign process could hold
_FULL: Final = 1 << 20  # bytes; with less, SQLite cannot make the files beside a database
_PRAGMAS: Final = ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON")
_PAGES: Final = 1000  # of the write-ahead log that a checkpoint is to copy at once
_MOST_PAGES: Final = 16_384  # in the log, beyond which commits copy it themselves
_SOONEST_S: Final = 0.5  # between two checkpoints
_LATEST_S: Final = 10.0
_ROUNDS: Final = 3  # of one checkpoint, as long as commits go on meanwhile
_PAGE: Final = 500
_INSERT: Final = "INSERT INTO event (stream, seq, kind, author, at, body, position, chain) VALUES "
#: Ends of streams follow their events by themselves. So what is usually stored is one statement, which is
#: a transaction: the thread that writes has to wait for its turn in Python after each.
_ENDS: Final = """
CREATE TEMP TRIGGER ends AFTER INSERT ON main.event BEGIN
    INSERT INTO head (stream, seq, chain) VALUES (new.stream, new.seq, new.chain)
    ON CONFLICT (stream) DO UPDATE SET seq = excluded.seq, chain = excluded.chain;
END
"""
_ROWS: Final = 50  # of one statement; for each number of rows there is one, which SQLite keeps
#: The rows are read in their stored order, without an index, since an index may be damaged.
_SCAN: Final = (
    "SELECT stream, seq, kind, author, at, body, position, chain, rowid FROM event NOT INDEXED"
    f" WHERE rowid > ? ORDER BY rowid LIMIT {_PAGE}"
)


class SqliteSession:
    """The connection that writes to a SQLite file. The lock of the file keeps other writers out."""

    slot: Final = 0
    is_shared: Final = False

    def __init__(self, path: Path, driver: Any) -> None:
        self._checkpoints = Checkpoints(path, driver)
        self._engine = create_engine(
            f"sqlite:///{path}",
            module=driver,
            poolclass=NullPool,
            isolation_level="AUTOCOMMIT",  # this module sends BEGIN and COMMIT itself
            connect_args={"timeout": _WAIT, "check_same_thread": False},
        )
        self.connection = self._engine.connect()
        try:
            raw: Any = self.connection.connection.dbapi_connection
            self._raw: sqlite3.Connection = raw
            for pragma in _PRAGMAS:
                raw.execute(f"PRAGMA {pragma}")
            # After a failed fsync the log file may hold what the disk does not: begin a new one.
            if raw.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0]:
                raise sqlite3.OperationalError("somebody reads the database without end")
            raw.execute(f"PRAGMA wal_autocheckpoint={_MOST_PAGES}")
            raw.execute(_ENDS)
        except BaseException:
            self.close()
            raise

    def run(self, work: Callable[[], T]) -> T:
        """Call `work`, which uses this session, and return its result. Errors of `work` are passed
        on."""
        return work()

    def alive(self) -> bool:
        """Return True always: a file does not disconnect."""
        return True

    def begin(self) -> None:
        """Open a transaction, with the write lock from the start."""
        self._raw.execute("BEGIN IMMEDIATE")

    def say(self, command: str) -> None:
        """Execute a command of SQL without a result."""
        self._raw.execute(command)
        if command == "COMMIT":
            self._checkpoints.committed()

    def store(
        self,
        events: Sequence[tuple[Event, bytes]],
        known: Mapping[str, Head],
        epochs: Mapping[str, int],
    ) -> None:
        """Write events, each with its link of the hash chain. In the same transaction a trigger
        writes the new ends of their streams. There is no other writer, so `known`, the ends as this
        process read them, is right."""
        del known, epochs
        rows = [
            (e.stream, e.seq, e.kind, e.author, e.at, e.body, e.position, link)
            for e, link in events
        ]
        alone = len(rows) > _ROWS and not self._raw.in_transaction
        if alone:
            self.begin()
        for start in range(0, len(rows), _ROWS):
            some = rows[start : start + _ROWS]
            self._raw.execute(_insert_of(len(some)), list(chain(*some)))
        if alone:
            self._raw.execute("COMMIT")
        if not self._raw.in_transaction:
            self._checkpoints.committed()

    def hold(self, streams: Sequence[str]) -> None:
        """Do nothing: no other process can move a stream."""

    def abandon(self) -> None:
        """Roll the open transaction back, if there is one."""
        if self._raw.in_transaction:
            self._raw.execute("ROLLBACK")

    def close(self) -> None:
        """Close the connection; an uncommitted transaction is rolled back."""
        self._checkpoints.close()
        try:
            self.connection.close()
        except (sqlite3.Error, DatabaseError):
            self.connection.invalidate()  # a broken file may refuse even the roll-back
        self._engine.dispose()


class Checkpoints:
    """Copies the write-ahead log of a SQLite file into the file (a checkpoint), on a thread with a
    connection of its own. A commit that does so itself, as SQLite's default is, waits for two more
    syncs of the disk and for all pages since the last time. A passive checkpoint holds up no
    commit. Commits stay durable without it: their pages are in the log, which was synced."""

    def __init__(self, path: Path, driver: Any) -> None:
        self._path = path
        self._driver = driver
        self._due = threading.Event()  # something was committed since the last checkpoint
        self._closed = threading.Event()
        self._thread: threading.Thread | None = None

    def committed(self) -> None:
        """Start a checkpoint in the background if none is due; call this after each commit. Returns
        at once."""
        if self._due.is_set():
            return
        self._due.set()
        if self._thread is None:
            name = f"{self._path.name} checkpoints"
            self._thread = threading.Thread(target=self._run, name=name, daemon=True)
            self._thread.start()

    def close(self) -> None:
        """Finish the checkpoint that is under way, and make no more."""
        self._closed.set()
        self._due.set()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        engine = _reading(self._path, self._driver)
        pause, ended = _SOONEST_S, time.monotonic()
        try:
            while self._due.wait() and not self._closed.wait(pause):
                self._due.clear()
                if self._closed.is_set():  # or the signal of `close` was cleared just now
                    break
                pages = self._copied(engine)
                rate = pages / (time.monotonic() - ended)
                pause = min(max(_PAGES / max(rate, 1.0), _SOONEST_S), _LATEST_S)
                ended = time.monotonic()
        finally:
            engine.dispose()

    def _copied(self, engine: Engine) -> int:
        """Copy the write-ahead log into the database by `engine`, again after commits in between.
        Once all of it is copied, the next commit restarts the log. Return its number of pages."""
        pages = 0
        try:
            with engine.connect() as connection:
                for _ in range(_ROUNDS):
                    done = connection.exec_driver_sql("PRAGMA wal_checkpoint(PASSIVE)").one()
                    pages = max(pages, done[1])
                    if done[1] == done[2]:
                        break
        except Sqlite.faults as error:  # the log keeps everything, and a later checkpoint copies it
            log.warning("%s: its log is not copied: %s", self._path, cause_of(error))
        return pages


@lru_cache(_ROWS)
def _insert_of(rows: int) -> str:
    """Return the text of an INSERT of so many events."""
    return _INSERT + ", ".join(["(?, ?, ?, ?, ?, ?, ?, ?)"] * rows)


class Sqlite:
    """A SQLite file that this process owns."""

    is_local: Final = True
    patience: Final = 0.0
    faults: Final[tuple[type[Exception], ...]] = (
        sqlite3.Error,
        DatabaseError,
        UnicodeDecodeError,  # the driver's, where damage has reached the schema
    )

    def __init__(self, path: str | Path, *, driver: Any = sqlite3) -> None:
        self._path: Final = Path(path)
        self._driver = driver
        self._lock: int | None = None
        self._engine = _reading(self._path, driver)
        self._threads = ThreadPoolExecutor(_READERS, thread_name_prefix=f"{self._path.name} reader")
        self.name: Final = f"The database {path}"
        self.address: Final = f"sqlite:///{self._path.absolute()}"

    def open(
        self, branch: Branch, before: Before = no_copy, *, upgrades: bool = True
    ) -> SqliteSession:
        """Lock the file for this process, since two writers would damage the log; then bring the
        tables of the branch to this version, and connect. `before` is called if tables are about to
        change; without `upgrades` they stay as they are. Raise CannotStart if the file cannot be used or another process holds the lock."""
        self.look(recognize if upgrades else kept_as_it_is(branch))
        self._lock = own(self._path)
        if upgrades:
            self.migrate(upgrade_to(branch, before=before))
        try:
            return self.connect()
        except self.faults as error:
            raise CannotStart(f"Cannot open {self._the}: {self._why(error)}.") from error

    def look(self, question: Callable[[Connection], object]) -> None:
        """Call `question` with a read-only connection to the file, and ignore its result; do
        nothing if there is no file. A normal connection would already change the file's journal
        mode. Raise CannotStart if the file cannot be read, and what `question` raises."""
        if not self._path.exists():
            return
        with _readable(self._path) as path:
            engine = create_engine(unchanged(path), poolclass=NullPool)
            try:
                with engine.connect() as connection:
                    question(connection)
            except CannotStart as error:  # of the file that it is, also where a copy was read
                raise type(error)(str(error).replace(str(path), str(self._path))) from error
            except self.faults as error:
                raise CannotStart(f"Cannot open {self._the}: {self._why(error)}.") from error
            finally:
                engine.dispose()

    def migrate(self, upgrade: Callable[[Connection], T]) -> T:
        """Call `upgrade`, which changes the schema, in one transaction, and return its result.
        Raise CannotStart if the file cannot be used."""
        self._make()
        engine = sqlite_engine(self._path, wait=2 * _WAIT, module=self._driver)
        try:
            with engine.begin() as connection:
                return upgrade(connection)
        except self.faults as error:
            raise CannotStart(f"Cannot open {self._the}: {self._why(error)}.") from error
        finally:
            engine.dispose()

    def _why(self, error: Exception) -> str:
        """Return the text of an error of this file. SQLite calls a full disk an I/O error where it
        cannot make the files beside the database."""
        said = cause_of(error)
        if said not in {
            "disk I/O error",
            "unable to open database file",
            "database or disk is full",
        }:
            return said
        try:
            free = shutil.disk_usage(self._path.parent).free
        except OSError:
            return said
        return f"the disk is full ({free >> 10} KiB are free)" if free < _FULL else said

    def _make(self) -> None:
        """Create an empty file if it does not exist, only for this user; SQLite gives the files
        beside it the same rights. Raise CannotStart if it cannot be created."""
        try:
            os.close(opener(str(self._path), os.O_RDWR | os.O_CREAT))
        except OSError as error:
            raise CannotStart(f"Cannot open {self._the}: {error.strerror}.") from error

    def connect(self) -> SqliteSession:
        """Connect again; a session that was closed left nothing unfinished."""
        return SqliteSession(self._path, self._driver)

    def lost(self, error: Exception) -> bool:
        """Return whether an error is the fault of the file, and not of the statement."""
        return not isinstance(
            error,
            IntegrityError | ProgrammingError | InterfaceError | DataError | UnicodeDecodeError,
        )

    def raced(self, error: Exception) -> bool:
        """Return False: nobody else writes."""
        del error
        return False

    async def ask(self, question: Callable[[Connection], T]) -> T:
        """Call `question` with a connection, on a thread that reads, and return its result."""

        def asked() -> T:
            with self._engine.connect() as connection:
                return question(connection)

        return await asyncio.get_running_loop().run_in_executor(self._threads, asked)

    async def at_one_moment(self, question: Callable[[Connection], T]) -> T:
        """Answer a question in one transaction, so that all of it sees the same state."""

        def asked(connection: Connection) -> T:
            connection.exec_driver_sql("BEGIN")
            try:
                return question(connection)
            finally:
                connection.exec_driver_sql("ROLLBACK")

        return await self.ask(asked)

    def slots(self, connection: Connection) -> list[int]:
        """Return one slot: the rows of a file stand in the order of the log, also in a copy of a log of
        several writers."""
        del connection
        return [0]

    def scan(self, connection: Connection, after: int) -> tuple[list[Sequence[Any]], int]:
        """Return a page of stored events after the position `after`, even if their text is damaged,
        and the position for the next page."""
        raw: Any = connection.connection.dbapi_connection
        plain, raw.text_factory = raw.text_factory, _lenient
        try:
            rows = raw.execute(_SCAN, (after,)).fetchall()
        finally:
            raw.text_factory = plain
        return [row[:8] for row in rows], rows[-1][8] if rows else after

    def bytes_in_use(self, connection: Connection) -> dict[str, int]:
        """Return the size in bytes of the file and of its write-ahead log."""
        del connection
        log = self._path.with_name(f"{self._path.name}-wal")
        return {
            "database": self._path.stat().st_size,
            "wal": log.stat().st_size if log.exists() else 0,
        }

    def complaints(self, connection: Connection) -> list[str]:
        """Return the faults that SQLite finds in the file, as its own texts."""
        found = connection.exec_driver_sql("PRAGMA integrity_check").scalars().all()
        return [text for text in found if text != "ok"]

    async def close(self) -> None:
        """Close all connections that read."""
        await asyncio.to_thread(self._threads.shutdown)
        self._engine.dispose()

    def disown(self) -> None:
        """Release the lock, so that another process may write."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    @property
    def _the(self) -> str:
        return self.name[0].lower() + self.name[1:]


def sqlite_engine(path: Path, *, wait: float, **options: Any) -> Engine:
    """Return an engine for the file `path` that uses SQLite's own transactions, also for schema
    changes. They take the write lock at BEGIN, and wait for it for up to `wait` seconds."""
    engine = create_engine(
        f"sqlite:///{path}", poolclass=NullPool, connect_args={"timeout": wait}, **options
    )

    @event.listens_for(engine, "connect")
    def _plain(connection: Any, _: object) -> None:
        connection.isolation_level = None  # the driver would commit before schema changes
        for pragma in _PRAGMAS:
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        connection.exec_driver_sql("BEGIN IMMEDIATE")

    return engine


@contextmanager
def _readable(path: Path) -> Iterator[Path]:
    """Return a context with the path of a file to read. If the file has a hot rollback journal (of
    a process that was killed), that is applied to a copy, whose path it is then."""
    undone = path.with_name(f"{path.name}-journal")
    if not undone.exists() or not undone.stat().st_size:
        yield path
        return
    with TemporaryDirectory() as folder:
        for each in (path, undone):
            shutil.copyfile(each, Path(folder) / each.name)
        copy = Path(folder) / path.name
        with closing(sqlite3.connect(copy)) as database:
            database.execute("SELECT count(*) FROM sqlite_master").fetchone()
        yield copy


def inspected(path: Path) -> tuple[int, list[Damage]]:
    """Return the number of events in the SQLite file `path` and their damages, at any revision of
    its tables. The file is not changed. Raise sqlite3.Error if it cannot be read."""
    inspector, after = Inspector(taken_out), 0
    with closing(sqlite3.connect(f"{path.as_uri()}?{reads(path)}", uri=True)) as database:
        database.execute("BEGIN")
        database.execute("SELECT count(*) FROM sqlite_master").fetchone()
        database.text_factory = _lenient
        while rows := database.execute(_SCAN, (after,)).fetchall():
            for row in rows:
                inspector.see(row[:8])
            after = rows[-1][8]
        ends = database.execute("SELECT stream, seq, chain FROM head").fetchall()
    return inspector.seen, inspector.findings(ends)


def unchanged(path: Path) -> str:
    """Return the URL for reading the SQLite file `path` without changing it. If its write-ahead log
    is empty, no lock and no index file are made either."""
    return f"sqlite:///file:{quote(str(path))}?uri=true&{reads(path)}"


def reads(path: Path) -> str:
    """Return the option of an address by which SQLite only reads `path`. Files beside it are made
    only where its write-ahead log holds something: a reader may not remove them again."""
    log = path.with_name(f"{path.name}-wal")
    return "mode=ro" if log.exists() and log.stat().st_size > 0 else "immutable=1"


def _reading(path: Path, driver: Any) -> Engine:
    engine = create_engine(
        f"sqlite:///{path}",
        module=driver,
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


def _lenient(text: bytes) -> str:
    return text.decode("utf-8", "surrogateescape")
