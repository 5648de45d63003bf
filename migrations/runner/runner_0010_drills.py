"""Add the Stop drills of robots."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "runner_0010"
down_revision: str | None = "runner_0009"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    with op.batch_alter_table("robot_right") as table:
        table.add_column(sa.Column("drills", sa.JSON, nullable=False, server_default="[]"))


def downgrade() -> None:
    """Go back to the one before."""
    with op.batch_alter_table("robot_right") as table:
        table.drop_column("drills")
