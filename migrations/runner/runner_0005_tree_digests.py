"""What a run was started with: its graph together with the graphs inside of it."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "runner_0005"
down_revision: str | None = "runner_0004"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("run", sa.Column("tree_digest", sa.Text, nullable=True))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("run", "tree_digest")
