"""Bringing a database to the revision that this program knows."""

import logging
from collections.abc import Callable
from typing import Final

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, MetaData

from action_assistant import places
from action_assistant.errors import CannotStart
from action_assistant.journal import tables
from action_assistant.journal.database import Branch as Branch
from action_assistant.journal.database import database_of

BRANCHES: Final[dict[str, MetaData]] = {"editor": tables.EDITOR, "runner": tables.RUNNER}
log: Final = logging.getLogger(__name__)
logging.getLogger("alembic.runtime").setLevel(logging.WARNING)  # we say it in one line


def migrate(url: str, branch: Branch, revision: str = "head") -> str:
    """Upgrade the database and return its revision. Raises CannotStart.

    All of it is one transaction: killed half-way, the database is as it was.
    """
    return database_of(url).migrate(upgrade_to(branch, revision))


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


def upgrade_to(branch: Branch, revision: str = "head") -> Callable[[Connection], str]:
    """A change of the schema that ends at a revision, and returns it. Raises CannotStart."""

    def upgrade(connection: Connection) -> str:
        name = connection.engine.url.database
        config = config_for(connection, branch)
        script = ScriptDirectory.from_config(config)
        ours = {item.revision for item in script.iterate_revisions(f"{branch}@head", "base")}
        known = {item.revision for item in script.walk_revisions()}
        current = set(MigrationContext.configure(connection).get_current_heads())
        if current - known:
            raise CannotStart(
                f"The database {name} was made by a newer version of this program "
                f"({', '.join(sorted(map(str, current - known)))}): install that version, or choose another."
            )
        if current - ours:
            raise CannotStart(f"The database {name} is not the {branch}'s.")
        command.upgrade(config, f"{branch}@{revision}")
        (now,) = MigrationContext.configure(connection).get_current_heads()
        if {now} != current:
            log.info("%s: the tables are those of %s now", name, now)
        return now

    return upgrade
