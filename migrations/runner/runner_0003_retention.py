"""Runs whose events are kept in archives, and lists of runs that are quick however many there are."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "runner_0003"
down_revision: str | None = "runner_0002"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("run", sa.Column("archived_at", sa.BigInteger))
    op.add_column("run", sa.Column("archived_as", sa.Text))
    op.create_index("ix_run_archived_at_ended_at", "run", ["archived_at", "ended_at"])


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_index("ix_run_archived_at_ended_at", "run")
    op.drop_column("run", "archived_as")
    op.drop_column("run", "archived_at")
