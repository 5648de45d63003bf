"""Runs of a graph are found by its name as quickly as by its id, and failed ones among all others."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "runner_0004"
down_revision: str | None = "runner_0003"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.create_index("ix_run_graph_name_number", "run", ["graph_name", "number"])
    failed = sa.text("(state IN ('error', 'refused', 'lost', 'halted') OR result = 'on_error')")
    op.create_index("ix_run_failed", "run", ["number"], sqlite_where=failed)


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_index("ix_run_failed", "run")
    op.drop_index("ix_run_graph_name_number", "run")
