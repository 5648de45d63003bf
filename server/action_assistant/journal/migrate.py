"""Bringing a database to the revision that this program knows."""

import logging
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, NamedTuple

from sqlalchemy import Connection, insert, inspect, select

from action_assistant import paths
from action_assistant.errors import AnothersDatabase, CannotStart, NewerSchema
from action_assistant.journal.database import Before, no_copy
from action_assistant.journal.database import Branch as Branch
from action_assistant.journal.events import Event
from action_assistant.kit.clock import utc_us
from action_assistant.schema.branches import BRANCHES, VERSIONS
from action_assistant.schema.editor_tables import written_by
from action_assistant.version import VERSION, commit, described

if TYPE_CHECKING:
    from alembic.config import Config

#: The pattern of the names of our revisions, also of later ones; a script's file begins with its name.
_OURS: Final = re.compile(rf"({'|'.join(BRANCHES)})_\d+")
#: Says in a script that programs of the revision before it can read and write the tables after it.
_EXPANDS: Final = re.compile(r"^expands: bool = True$", re.MULTILINE)
log: Final = logging.getLogger(__name__)
logging.getLogger("alembic.runtime").setLevel(logging.WARNING)  # we say it in one line
# The table is the same for both branches.
_LAST_WRITER: Final = select(written_by).order_by(written_by.c.since.desc()).limit(1)
_SHORT_COMMIT: Final = 8


def revisions_of(branch: str) -> list[str]:
    """Return every revision of the tables of a branch (editor or runner) that this program knows,
    oldest first."""
    names = (_OURS.match(path.name) for path in (paths.migrations() / branch).glob("*.py"))
    return sorted(
        (name[0] for name in names if name), key=lambda name: int(name.rpartition("_")[2])
    )


def steps_after(branch: str, revision: str) -> list[str]:
    """Return the subjects of the scripts that bring tables of a branch from this revision to this
    version, oldest first, as their file names say them."""
    later = revisions_of(branch)[revisions_of(branch).index(revision) + 1 :]
    folder = paths.migrations() / branch
    names = [path.stem for each in later for path in folder.glob(f"{each}_*.py")]
    return [name.split("_", 2)[2].replace("_", " ") for name in names]


def only_expands(branch: str, revision: str) -> bool:
    """Return whether programs of this revision can go on while the tables of a branch are brought to this
    version: each script in between says `expands: bool = True`."""
    later = revisions_of(branch)[revisions_of(branch).index(revision) + 1 :]
    folder = paths.migrations() / branch
    scripts = [path for each in later for path in folder.glob(f"{each}_*.py")]
    return all(_EXPANDS.search(path.read_text()) for path in scripts)


def upgrade_to(
    branch: Branch, revision: str = "head", *, before: Before = no_copy
) -> Callable[[Connection], str]:
    """Return a function that brings the schema of a branch to `revision` and returns the revision
    it ends at. It calls `before` if existing tables are about to change, and raises CannotStart for
    a database of the other branch or of a newer version."""

    def upgrade(connection: Connection) -> str:
        """Bring the tables to the wanted revision, and return it."""
        name = _name_of(connection)
        current = recognize(connection)
        ours = revisions_of(branch)
        if current - set(ours):
            raise CannotStart(f"The database {name} is not the {branch}'s.")
        wanted = ours[-1] if revision == "head" else revision
        if current - {wanted}:
            before(connection, branch, max(current))
        now = _upgraded(connection, branch, current, wanted)
        sign(connection, now)
        if {now} != current:
            log.info("%s: the tables are those of %s now", name, now)
        return now

    return upgrade


def kept_as_it_is(branch: Branch) -> Callable[[Connection], str]:
    """Return a function that returns the revision of a branch's database without changing it. The
    revision may be older than this program's newest one. The function raises CannotStart for a
    database of the other branch, of a newer version, or without tables."""

    def look(connection: Connection) -> str:
        current = recognize(connection)
        if not current or current - set(revisions_of(branch)):
            raise CannotStart(f"The database {_name_of(connection)} is not the {branch}'s.")
        return max(current)

    return look


def _upgraded(connection: Connection, branch: Branch, current: set[str], revision: str) -> str:
    """Bring the database of a branch from the revisions `current` to `revision`, and return the
    revision it has then."""
    newest = revisions_of(branch)[-1]
    if current == {newest} == {revision}:
        return newest
    if not current and revision == newest:
        # All of the tables at once: what the scripts come to, one after the other.
        BRANCHES[branch].create_all(connection, checkfirst=False)
        VERSIONS.create(connection, checkfirst=True)
        connection.execute(insert(VERSIONS).values(version_num=newest))
        return newest
    return run_scripts(connection, branch, revision)


def alembic_config(connection: Connection, branch: str) -> "Config":
    """Return Alembic's configuration with the scripts of this program for a branch, and an open
    connection."""
    from alembic.config import Config

    folder = paths.migrations()
    config = Config(attributes={"connection": connection, "metadata": BRANCHES[branch]})
    config.set_main_option("script_location", str(folder).replace("%", "%%"))
    config.set_main_option("version_path_separator", "newline")
    config.set_main_option("path_separator", "newline")
    locations = "\n".join(str(folder / name) for name in BRANCHES)
    config.set_main_option("version_locations", locations.replace("%", "%%"))
    return config


def run_scripts(connection: Connection, branch: str, revision: str) -> str:
    """Run Alembic's scripts of a branch up to a revision, and return the revision then."""
    # Alembic takes longer to import than a start has otherwise to do with the database.
    from alembic import command
    from alembic.runtime.migration import MigrationContext

    command.upgrade(alembic_config(connection, branch), f"{branch}@{revision}")
    (now,) = MigrationContext.configure(connection).get_current_heads()
    return now


def recognize(connection: Connection) -> set[str]:
    """Return the schema revisions that are stored in a database of this program; an empty set for
    an empty database. Change nothing. Raise a subclass of CannotStart: AnothersDatabase for a
    database of another program, NewerSchema for one of a newer version of this program."""
    name = _name_of(connection)
    current = _current(connection)
    if _is_foreign(connection, current):
        raise AnothersDatabase(
            f"The database {name} is another program's: it is left as it is. Choose another one, "
            "or an empty one."
        )
    known = {revision for branch in BRANCHES for revision in revisions_of(branch)}
    if current - known:
        raise NewerSchema(_newer(connection, name, max(current - known)))
    return current


def _newer(connection: Connection, name: str, revision: str) -> str:
    """Return a sentence about a database of a newer version: that version, this one, and the ways
    out."""
    writer = last_writer(connection)
    newest = revisions_of(revision.partition("_")[0])[-1]
    return (
        f"The database {name} was made by a newer version of this program"
        f"{f', {writer}' if writer is not None else ''} (schema {revision}); this is version "
        f"{described()}, which knows up to {newest}. Install {writer.version if writer else 'that'} or "
        "newer; or go back to a copy from before its tables changed: `action-assistant migrate --back` "
        "lists them."
    )


def _current(connection: Connection) -> set[str]:
    """Return the revisions that are stored in a database."""
    if not inspect(connection).has_table(VERSIONS.name):
        return set()
    return set(map(str, connection.scalars(select(VERSIONS.c.version_num))))


def _name_of(connection: Connection) -> str:
    """Return the path of the SQLite file of a connection, or the name of the database on a server."""
    if connection.dialect.name != "sqlite":
        return str(connection.engine.url.database)
    row = connection.exec_driver_sql("PRAGMA database_list").first()
    return str(row[2]) if row is not None else ""


def _is_foreign(connection: Connection, current: set[str]) -> bool:
    """Return whether a database belongs to another program. `current`: the revisions of the schema
    that the database has stored.

    That is so if the database has tables but no stored revision, a revision of another form than
    this program's, or no table `event` with its columns. In a SQLite file all tables count; on a
    server only tables that have the name of one of this program's. A SQLite file with an
    application id also belongs to another program.
    """
    there = set(inspect(connection).get_table_names()) - {VERSIONS.name}
    if connection.dialect.name == "sqlite":
        if connection.exec_driver_sql("PRAGMA application_id").scalar():
            return True  # we have never set one
    else:
        there &= {name for metadata in BRANCHES.values() for name in metadata.tables}
    if not current:
        return bool(there)
    if not all(_OURS.fullmatch(revision) for revision in current) or "event" not in there:
        return True
    columns = {column["name"] for column in inspect(connection).get_columns("event")}
    return not columns >= {*Event.__struct_fields__, "chain"}


class ProgramVersion(NamedTuple):
    """A version that wrote, and the revision of the tables then. `build`: its commit, "" if unknown."""

    version: str
    build: str
    revision: str

    def __str__(self) -> str:
        return (
            f"{self.version} (commit {self.build[:_SHORT_COMMIT]})" if self.build else self.version
        )


def last_writer(connection: Connection) -> ProgramVersion | None:
    """Return the version of this program that wrote to a database last; None if no version was
    stored."""
    if not inspect(connection).has_table(written_by.name):
        return None
    row = connection.execute(_LAST_WRITER).first()
    return None if row is None else ProgramVersion(row.version, row.build, row.revision)


def sign(connection: Connection, revision: str) -> None:
    """Store that this version, with this revision of the tables, writes from now on. Nothing is
    written if it was the last writer."""
    if not inspect(connection).has_table(written_by.name):
        return  # brought to an earlier revision, by a test
    row = connection.execute(_LAST_WRITER).first()
    mine = ProgramVersion(VERSION, commit() or "", revision)
    if row is not None and (row.version, row.build, row.revision) == mine:
        return
    since = max(utc_us(), 0 if row is None else row.since + 1)
    connection.execute(insert(written_by).values(since=since, **mine._asdict()))
