"""What people note about runs, what runs add up to, and runs that shall go the same for ever."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "runner_0002"
down_revision: str | None = "runner_0001"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.create_table(
        "review",
        sa.Column("run", sa.Text, nullable=False),
        sa.Column("pinned", sa.Boolean(create_constraint=False), nullable=False),
        sa.Column("note", sa.Text, nullable=False),
        sa.Column("words", sa.Text, nullable=False),
        sa.Column("summed", sa.Boolean(create_constraint=False), nullable=False),
        sa.PrimaryKeyConstraint("run", name="pk_review"),
    )
    op.create_table(
        "run_label",
        sa.Column("run", sa.Text, nullable=False),
        sa.Column("label", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("run", "label", name="pk_run_label"),
    )
    op.create_index("ix_run_label_label", "run_label", ["label"])
    op.create_table(
        "action_sum",
        sa.Column("run", sa.Text, nullable=False),
        sa.Column("action", sa.Text, nullable=False),
        sa.Column("aid", sa.Text),
        sa.Column("visits", sa.Integer, nullable=False),
        sa.Column("results", sa.JSON, nullable=False),
        sa.Column("inferred", sa.Integer, nullable=False),
        sa.Column("took", sa.JSON, nullable=False),
        sa.PrimaryKeyConstraint("run", "action", name="pk_action_sum"),
    )
    op.create_table(
        "expectation",
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("graph", sa.Text),
        sa.Column("graph_name", sa.Text, nullable=False),
        sa.Column("run", sa.Text, nullable=False),
        sa.Column("at", sa.BigInteger, nullable=False),
        sa.Column("seq", sa.BigInteger, nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_expectation"),
    )


def downgrade() -> None:
    """Go back to the one before."""
    for table in ("expectation", "action_sum", "run_label", "review"):
        op.drop_table(table)
