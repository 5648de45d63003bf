"""Robots whose owners allow runs that the runner leads step by step."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "runner_0008"
down_revision: str | None = "runner_0007"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("robot", sa.Column("led", sa.Boolean, nullable=False, server_default=sa.false()))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("robot", "led")
