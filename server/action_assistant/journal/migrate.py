"""Bringing a database to the revision that this program knows."""

import logging
import re
from collections.abc import Callable
from typing import Final

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, MetaData, inspect

from action_assistant import paths
from action_assistant.errors import CannotStart
from action_assistant.journal.database import Branch as Branch
from action_assistant.journal.events import Event
from action_assistant.schema import editor_tables, runner_tables

BRANCHES: Final[dict[Branch, MetaData]] = {
    "editor": editor_tables.EDITOR,
    "runner": runner_tables.RUNNER,
}
#: How our revisions are named, also those of versions to come.
_OURS: Final = re.compile(rf"({'|'.join(BRANCHES)})_\d+")
_VERSIONS: Final = "alembic_version"
log: Final = logging.getLogger(__name__)
logging.getLogger("alembic.runtime").setLevel(logging.WARNING)  # we say it in one line


def config_for(connection: Connection, branch: Branch) -> Config:
    """Alembic's configuration, pointed at our scripts and at a connection that is open."""
    folder = paths.migrations()
    config = Config(attributes={"connection": connection, "metadata": BRANCHES[branch]})
    config.set_main_option("script_location", str(folder).replace("%", "%%"))
    config.set_main_option("version_path_separator", "newline")
    config.set_main_option("path_separator", "newline")
    locations = "\n".join(str(folder / name) for name in BRANCHES)
    config.set_main_option("version_locations", locations.replace("%", "%%"))
    return config


def upgrade_to(branch: Branch, revision: str = "head") -> Callable[[Connection], str]:
    """A change of the schema that ends at a revision, and returns it. Raises CannotStart."""

    def upgrade(connection: Connection) -> str:
        name = _name_of(connection)
        current = recognize(connection)
        config = config_for(connection, branch)
        script = ScriptDirectory.from_config(config)
        ours = {item.revision for item in script.iterate_revisions(f"{branch}@head", "base")}
        if current - ours:
            raise CannotStart(f"The database {name} is not the {branch}'s.")
        command.upgrade(config, f"{branch}@{revision}")
        (now,) = MigrationContext.configure(connection).get_current_heads()
        if {now} != current:
            log.info("%s: the tables are those of %s now", name, now)
        return now

    return upgrade


def recognize(connection: Connection) -> set[str]:
    """The revisions of a database of ours; none of an empty one. Changes nothing. Raises CannotStart
    for another program's, and for one that a newer version of this program made."""
    name = _name_of(connection)
    current = set(map(str, MigrationContext.configure(connection).get_current_heads()))
    if _is_foreign(connection, current):
        raise CannotStart(
            f"The database {name} is another program's: it is left as it is. Choose another one, "
            "or an empty one."
        )
    known = {
        item.revision
        for branch in BRANCHES
        for item in ScriptDirectory.from_config(config_for(connection, branch)).walk_revisions()
    }
    if current - known:
        raise CannotStart(
            f"The database {name} was made by a newer version of this program "
            f"({', '.join(sorted(current - known))}): install that version, or choose another."
        )
    return current


def _name_of(connection: Connection) -> str:
    """The path of a file, the name of a database on a server."""
    if connection.dialect.name != "sqlite":
        return str(connection.engine.url.database)
    row = connection.exec_driver_sql("PRAGMA database_list").first()
    return str(row[2]) if row is not None else ""


def _is_foreign(connection: Connection, current: set[str]) -> bool:
    """Whether tables are there that we did not make. A database on a server may hold others, too, as
    long as their names are not in our way."""
    there = set(inspect(connection).get_table_names()) - {_VERSIONS}
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
