"""Records which versions of this program have written to a database."""

from typing import Final, NamedTuple

from sqlalchemy import Connection, insert, inspect, select

from action_assistant.kit.clock import utc_us
from action_assistant.schema.editor_tables import written_by
from action_assistant.version import VERSION, commit

# The table is the same for both branches.
_LAST: Final = select(written_by).order_by(written_by.c.since.desc()).limit(1)
_SHORT: Final = 8


class ProgramVersion(NamedTuple):
    """A version that wrote, and the revision of the tables then. `build`: its commit, "" if unknown."""

    version: str
    build: str
    revision: str

    def __str__(self) -> str:
        return f"{self.version} (commit {self.build[:_SHORT]})" if self.build else self.version


def last_writer(connection: Connection) -> ProgramVersion | None:
    """Return the version that wrote last; None if no version was stored."""
    if not inspect(connection).has_table(written_by.name):
        return None
    row = connection.execute(_LAST).first()
    return None if row is None else ProgramVersion(row.version, row.build, row.revision)


def sign(connection: Connection, revision: str) -> None:
    """Store that this version writes from now on. Nothing is written if it was the last writer."""
    if not inspect(connection).has_table(written_by.name):
        return  # brought to an earlier revision, by a test
    row = connection.execute(_LAST).first()
    mine = ProgramVersion(VERSION, commit() or "", revision)
    if row is not None and (row.version, row.build, row.revision) == mine:
        return
    since = max(utc_us(), 0 if row is None else row.since + 1)
    connection.execute(insert(written_by).values(since=since, **mine._asdict()))
