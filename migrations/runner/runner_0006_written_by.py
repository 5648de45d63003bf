"""Which versions of this program have written here."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "runner_0006"
down_revision: str | None = "runner_0005"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.create_table(
        "written_by",
        sa.Column("since", sa.BigInteger, nullable=False, autoincrement=False),
        sa.Column("version", sa.Text, nullable=False),
        sa.Column("build", sa.Text, nullable=False),
        sa.Column("revision", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("since", name="pk_written_by"),
    )


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_table("written_by")
