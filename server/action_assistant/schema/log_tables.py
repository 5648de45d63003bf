"""The tables of a log, which both databases have.

`event`, `head` (where each stream ends), `snapshot`, `written_by`, `outbox` and `receiver` are in both. Everything else
is a fold of the events: it can be thrown away and made again. Times are microseconds since 1970, UTC.
"""

from typing import Final

from sqlalchemy import (
    BigInteger,
    Column,
    Index,
    LargeBinary,
    MetaData,
    Table,
    Text,
)

NAMES: Final = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "pk": "pk_%(table_name)s",
}


def log_tables(metadata: MetaData) -> tuple[Table, Table, Table]:
    """Define the tables of an event log in `metadata`, and return them: `event` (the events of all
    streams), `head` (the last event of each stream) and `snapshot`."""
    event = Table(
        "event",
        metadata,
        Column("stream", Text, primary_key=True),
        Column("seq", BigInteger, primary_key=True, autoincrement=False),
        Column("kind", Text, nullable=False),
        Column("author", Text, nullable=False),
        Column("at", BigInteger, nullable=False),
        Column("body", LargeBinary, nullable=False),
        Column("position", BigInteger, nullable=False),
        Column("chain", LargeBinary, nullable=False),
        Index(None, "position", unique=True),
    )
    head = Table(
        "head",
        metadata,
        Column("stream", Text, primary_key=True),
        Column("seq", BigInteger, nullable=False),
        Column("chain", LargeBinary, nullable=False),
    )
    snapshot = Table(
        "snapshot",
        metadata,
        Column("stream", Text, primary_key=True),
        Column("seq", BigInteger, nullable=False),
        Column("proof", LargeBinary, nullable=False),
        Column("state", LargeBinary, nullable=False),
    )
    return event, head, snapshot


def written_by_table(metadata: MetaData) -> Table:
    """Define in `metadata`, and return, the table that lists which versions of the program wrote to
    a database, with one row for each change of the version. A row holds the version, the time since
    which it writes, and the revision of the tables. Older versions of the program read the last
    row, so the columns never change."""
    return Table(
        "written_by",
        metadata,
        Column("since", BigInteger, primary_key=True, autoincrement=False),
        Column("version", Text, nullable=False),
        Column("build", Text, nullable=False),
        Column("revision", Text, nullable=False),
    )


def outbox_tables(metadata: MetaData) -> tuple[Table, Table]:
    """Define in `metadata`, and return, the tables of notifications: `outbox` (the messages, each
    written in the transaction of the event that causes it) and `receiver` (the receivers to which
    nothing is sent any more).

    `subject`: the stream that a message is about; `at`: when it happened; `facts`: JSON object with
    the words of its sentence; `due`: when it is to be tried next, none when it is sent or given up.
    `target`: a digest of a receiver's address, so that another address is tried again."""
    outbox = Table(
        "outbox",
        metadata,
        Column("id", Text, primary_key=True),
        Column("receiver", Text, nullable=False),
        Column("kind", Text, nullable=False),
        Column("subject", Text, nullable=False),
        Column("at", BigInteger, nullable=False),
        Column("facts", Text, nullable=False),
        Column("due", BigInteger),
        Column("tries", BigInteger, nullable=False),
        Column("tried_at", BigInteger),
        Column("sent_at", BigInteger),
        Column("error", Text, nullable=False, server_default=""),
        Index(None, "receiver", "due"),
        Index(None, "subject", "at"),
    )
    receiver = Table(
        "receiver",
        metadata,
        Column("name", Text, primary_key=True),
        Column("target", Text, nullable=False),
        Column("off_at", BigInteger, nullable=False),
        Column("why", Text, nullable=False),
    )
    return outbox, receiver


#: The tables that are no folds. A message that was sent must not be sent again from its event.
LOG: Final = frozenset(
    {"event", "head", "snapshot", "written_by", "outbox", "receiver", "editor", "room"}
)
