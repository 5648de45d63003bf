"""The tables of each database, by the process that owns it."""

from collections.abc import Mapping
from typing import Final

from sqlalchemy import Column, MetaData, PrimaryKeyConstraint, String, Table

from action_assistant.schema import editor_tables, runner_tables

BRANCHES: Final[Mapping[str, MetaData]] = {
    "editor": editor_tables.EDITOR,
    "runner": runner_tables.RUNNER,
}
#: Alembic's own table, as it makes it: at which revision a database is.
VERSIONS: Final = Table(
    "alembic_version",
    MetaData(),
    Column("version_num", String(32), nullable=False),
    PrimaryKeyConstraint("version_num", name="alembic_version_pkc"),
)
