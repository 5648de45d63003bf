"""The interface between a journal and its database, SQLite or Postgres."""

import errno
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final, Literal, Protocol, TypeAlias, TypeVar

from sqlalchemy import Connection
from sqlalchemy.exc import DBAPIError

from action_assistant.journal.chain import Head
from action_assistant.journal.events import Event

T = TypeVar("T")

Branch: TypeAlias = Literal["editor", "runner"]


#: What comes before the tables of a database change: called with its connection, whose it is, and its
#: revision, in the transaction of the change. Raises CannotStart, and then there is none.
Before: TypeAlias = Callable[[Connection, Branch, str], object]


def no_copy(connection: Connection, branch: Branch, revision: str) -> None:
    """Do nothing: make no copy before an upgrade, since the database is a copy itself, or new."""


class Overtaken(Exception):
    """Another process has written to this database, so what this one knows of its streams is old.
    `streams`: those of the statement that was refused; at least one of them has moved. Or another
    event has the position of one of their events (`by_position`), which only the writer of the same
    slot could have stored."""

    def __init__(self, streams: Iterable[str], *, by_position: bool = False) -> None:
        self.streams: Final = tuple(streams)
        self.by_position: Final = by_position
        super().__init__(
            "the log has another end than this process has read, as when another process writes to it"
        )


class WriterSession(Protocol):
    """The connection that writes. One thread at a time uses it, only inside `run`."""

    connection: Connection

    @property
    def slot(self) -> int:
        """Return the slot in which this session stores events; 0 for the only writer of a log."""

    @property
    def is_shared(self) -> bool:
        """Return whether other processes may write to this database at the same time, so that
        streams may have moved on; `store` compares their epochs then."""

    def run(self, work: Callable[[], T]) -> T:
        """Call `work`, which uses this session, in the way that the database needs, and return its
        result."""

    def alive(self) -> bool:
        """Return whether the connection still existed when it was last used."""

    def begin(self) -> None:
        """Begin a transaction that locks out all other writers."""

    def say(self, command: str) -> None:
        """Execute a command of SQL without a result, such as COMMIT or SAVEPOINT."""

    def store(
        self,
        events: Sequence[tuple[Event, bytes]],
        known: Mapping[str, Head],
        epochs: Mapping[str, int],
    ) -> None:
        """Write events, each with its link of the hash chain, and the new ends of their streams:
        all or nothing. If no transaction is open, this is one of its own, which is committed.
        `known`: the ends of their streams in the database, as the writer knows them; `epochs`:
        those of streams in a shared database. Raise Overtaken if another process has moved one of
        them or has taken it; nothing is written then."""

    def hold(self, streams: Sequence[str]) -> None:
        """Lock these streams in the open transaction: no other process appends to them until it
        ends. A database with only one writer needs no such lock, and does nothing."""

    def abandon(self) -> None:
        """Roll the transaction back that is open, if there is one."""

    def close(self) -> None:
        """Close the connection, whatever its state is; an open transaction is rolled back."""


class Database(Protocol):
    """One database, which only this process writes."""

    @property
    def name(self) -> str:
        """Return the name of the database for people: without a password."""

    @property
    def address(self) -> str:
        """The URL by which another process of this computer reads the same database, with its
        password."""

    @property
    def is_local(self) -> bool:
        """Return whether a commit waits for nothing but a disk of this machine."""

    @property
    def patience(self) -> float:
        """The seconds to wait for the database before it stays unknown whether a commit has
        happened."""

    @property
    def faults(self) -> tuple[type[Exception], ...]:
        """Return all exception types that the driver raises."""

    def open(
        self, branch: Branch, before: Before = no_copy, *, upgrades: bool = True
    ) -> WriterSession:
        """Take the lock of the only writer, bring the tables of the branch to this version, and
        connect. `before` is called if tables are about to change; without `upgrades` they stay as
        they are. Raise CannotStart if the database cannot be used or another process holds the
        lock."""

    def look(self, question: Callable[[Connection], object]) -> None:
        """Call `question` with a connection to the existing database; create and change nothing.
        Raise CannotStart if the database cannot be read."""

    def migrate(self, upgrade: Callable[[Connection], T]) -> T:
        """Call `upgrade`, which changes the schema, in one transaction, and return its result.
        Raise CannotStart if the database cannot be used."""

    def connect(self) -> WriterSession:
        """Connect again after a failure. The unfinished transaction of the last session has ended
        then."""

    def lost(self, error: Exception) -> bool:
        """Return whether an error is the fault of the database, so that nothing can be written, and
        not of the statement."""

    def raced(self, error: Exception) -> bool:
        """Return whether a statement failed only because another process wrote at the same time, so
        that it may be tried again in a new transaction."""

    async def ask(self, question: Callable[[Connection], T]) -> T:
        """Call `question` with a connection that reads, and return its result; it does not wait for
        the writer."""

    async def at_one_moment(self, question: Callable[[Connection], T]) -> T:
        """Call `question` with a connection that reads one consistent snapshot, while others write,
        and return its result. Nothing is changed, not even the tables of an older version."""

    def slots(self, connection: Connection) -> list[int]:
        """Return the slots whose events `scan` returns one slot after the other; one slot stands
        for a log that `scan` returns in its own order."""

    def scan(self, connection: Connection, after: int) -> tuple[list[Sequence[Any]], int]:
        """Return a page of stored events, unchecked and with their links of the hash chain, after
        the position `after`; and the position for the next page."""

    def bytes_in_use(self, connection: Connection) -> dict[str, int]:
        """Return the size in bytes of the database and, if it has one, of its write-ahead log,
        under the keys `database` and `wal`. Raise OSError if a file cannot be read."""

    def complaints(self, connection: Connection) -> list[str]:
        """Return the faults that the database itself finds in its files, as sentences."""

    async def close(self) -> None:
        """Close all connections that read."""

    def disown(self) -> None:
        """Release the lock, so that another process may write."""


#: Errors of a connection to a database server, in words: SQLite has no connection.
_AWAY: Final = {
    errno.ENOENT: "its socket is gone: it has ended, or not begun",
    errno.ECONNREFUSED: "nothing listens there",
    errno.ECONNRESET: "it ended the connection",
    errno.EPIPE: "it ended the connection",
    errno.EHOSTUNREACH: "no way leads to it",
    errno.ENETUNREACH: "no way leads to it",
    errno.ETIMEDOUT: "nothing came back in time",
}


#: What the driver of Postgres says when the server, or what is between, ends a connection.
_ENDED: Final = (
    "connection was closed in the middle of operation",
    "unexpected connection_lost() call",
)


def cause_of(error: Exception) -> str:
    """Return the text of an error of a database or disk, without a full stop."""
    cause: object = error.orig if isinstance(error, DBAPIError) else error
    if isinstance(cause, TimeoutError):
        return "the database server does not answer in time"
    if isinstance(cause, OSError) and cause.errno in _AWAY:
        return f"the database server does not answer ({_AWAY[cause.errno]})"
    if isinstance(cause, OSError) and cause.errno is not None:
        return os.strerror(cause.errno)
    text = str(cause).strip().rstrip(".")
    if text in _ENDED:
        return "the database server ended the connection"
    return text or type(cause).__name__
