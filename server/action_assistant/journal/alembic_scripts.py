"""Runs Alembic with this program's scripts, from one revision of a database to another."""

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from sqlalchemy import Connection

from action_assistant import paths
from action_assistant.schema.branches import BRANCHES


def config_for(connection: Connection, branch: str) -> Config:
    """Return Alembic's configuration with our scripts and an open connection."""
    folder = paths.migrations()
    config = Config(attributes={"connection": connection, "metadata": BRANCHES[branch]})
    config.set_main_option("script_location", str(folder).replace("%", "%%"))
    config.set_main_option("version_path_separator", "newline")
    config.set_main_option("path_separator", "newline")
    locations = "\n".join(str(folder / name) for name in BRANCHES)
    config.set_main_option("version_locations", locations.replace("%", "%%"))
    return config


def upgrade(connection: Connection, branch: str, revision: str) -> str:
    """Run the scripts up to a revision, and return it."""
    command.upgrade(config_for(connection, branch), f"{branch}@{revision}")
    (now,) = MigrationContext.configure(connection).get_current_heads()
    return now
