"""Keep the texts of notes at moments of a run where runs are searched."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "runner_0012"
down_revision: str | None = "runner_0011"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("review", sa.Column("remarks", sa.Text, nullable=False, server_default=""))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("review", "remarks")
