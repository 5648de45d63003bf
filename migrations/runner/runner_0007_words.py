"""The words of runs, so that a search need not read all runs. Those of runs that are there already are
found by the runner, some at a time."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "runner_0007"
down_revision: str | None = "runner_0006"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.create_table(
        "word",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("text", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_word"),
        sa.UniqueConstraint("text", name="uq_word_text"),
    )
    op.create_table(
        "run_word",
        sa.Column("word", sa.Integer, nullable=False),
        sa.Column("number", sa.Integer, nullable=False),
        sa.PrimaryKeyConstraint("word", "number", name="pk_run_word"),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "unindexed_run",
        sa.Column("number", sa.Integer, autoincrement=False, nullable=False),
        sa.PrimaryKeyConstraint("number", name="pk_unindexed_run"),
    )
    op.execute("INSERT INTO unindexed_run (number) SELECT number FROM run")


def downgrade() -> None:
    """Go back to the one before."""
    for table in ("unindexed_run", "run_word", "word"):
        op.drop_table(table)
