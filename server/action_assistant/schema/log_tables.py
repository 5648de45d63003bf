"""The tables of a log, which both databases have.

`event`, `head` (where each stream ends), `snapshot` and `written_by` are in both. Everything else is a fold of the
events: it can be thrown away and made again. Times are microseconds since 1970, UTC.
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


#: The tables that are no folds.
LOG: Final = frozenset({"event", "head", "snapshot", "written_by"})
