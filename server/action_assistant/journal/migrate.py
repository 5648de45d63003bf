"""Bringing a database to the revision that this program knows."""

import logging
import sqlite3
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, MetaData, NullPool, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, DatabaseError

from action_assistant import places
from action_assistant.errors import CannotStart
from action_assistant.journal import tables

Branch: TypeAlias = Literal["editor", "runner"]

BRANCHES: Final[dict[str, MetaData]] = {"editor": tables.EDITOR, "runner": tables.RUNNER}
log: Final = logging.getLogger(__name__)
logging.getLogger("alembic.runtime").setLevel(logging.WARNING)  # we say it in one line

_WAIT: Final = 10.0  # seconds until a database that somebody else writes to is called busy


def migrate(url: str, branch: Branch, revision: str = "head") -> str:
    """Upgrade the database and return its revision. Raises CannotStart.

    All of it is one transaction: killed half-way, the database is as it was.
    """
    path = file_of(url)
    engine = sqlite_engine(path, wait=_WAIT)
    try:
        with engine.begin() as connection:
            return _upgrade(connection, branch, revision, path)
    except (DatabaseError, sqlite3.Error) as error:
        raise CannotStart(f"Cannot open the database {path}: {_cause(error)}.") from error
    finally:
        engine.dispose()


def config_for(connection: Connection, branch: Branch) -> Config:
    """Alembic's configuration, pointed at our scripts and at a connection that is open."""
    folder = places.migrations()
    config = Config(attributes={"connection": connection, "metadata": BRANCHES[branch]})
    config.set_main_option("script_location", str(folder).replace("%", "%%"))
    config.set_main_option("version_path_separator", "newline")
    config.set_main_option("path_separator", "newline")
    locations = "\n".join(str(folder / name) for name in BRANCHES)
    config.set_main_option("version_locations", locations.replace("%", "%%"))
    return config


def file_of(url: str) -> Path:
    """The file that a database URL names. Raises CannotStart for what we cannot open."""
    try:
        parsed = make_url(url)
    except ArgumentError as error:
        raise CannotStart(f"{url!r} is not a database URL such as sqlite:///editor.db.") from error
    if parsed.get_backend_name() != "sqlite" or not parsed.database:
        raise CannotStart(f"Databases of the kind {parsed.drivername!r} are not supported.")
    return Path(parsed.database)


def sqlite_engine(path: Path, *, wait: float, **options: Any) -> Engine:
    """An engine whose transactions are SQLite's own: also for schema changes, locked at BEGIN."""
    engine = create_engine(
        f"sqlite:///{path}", poolclass=NullPool, connect_args={"timeout": wait}, **options
    )

    @event.listens_for(engine, "connect")
    def _plain(connection: Any, _: object) -> None:
        connection.isolation_level = None  # the driver would commit before schema changes
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("PRAGMA foreign_keys=ON")
        connection.execute("PRAGMA synchronous=FULL")

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        connection.exec_driver_sql("BEGIN IMMEDIATE")

    return engine


def _cause(error: Exception) -> object:
    return error.orig if isinstance(error, DatabaseError) else error


def _upgrade(connection: Connection, branch: Branch, revision: str, path: Path) -> str:
    config = config_for(connection, branch)
    script = ScriptDirectory.from_config(config)
    ours = {item.revision for item in script.iterate_revisions(f"{branch}@head", "base")}
    known = {item.revision for item in script.walk_revisions()}
    current = set(MigrationContext.configure(connection).get_current_heads())
    if current - known:
        raise CannotStart(
            f"The database {path} was made by a newer version of this program "
            f"({', '.join(sorted(current - known))}): install that version, or choose another folder."
        )
    if current - ours:
        raise CannotStart(f"The database {path} is not the {branch}'s.")
    command.upgrade(config, f"{branch}@{revision}")
    (now,) = MigrationContext.configure(connection).get_current_heads()
    if {now} != current:
        log.info("%s: the tables are those of %s now", path, now)
    return now
