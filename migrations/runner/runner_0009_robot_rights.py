"""Add the table of rights of robots: operators, the holder of the baton, and locks."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "runner_0009"
down_revision: str | None = "runner_0008"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.create_table(
        "robot_right",
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("rules", sa.JSON, nullable=False),
        sa.Column("set_by", sa.JSON),
        sa.Column("holder", sa.JSON),
        sa.Column("locks", sa.JSON, nullable=False),
        sa.PrimaryKeyConstraint("name", name=op.f("pk_robot_right")),
    )


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_table("robot_right")
