"""Add to versions who has released them, and when."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0014"
down_revision: str | None = "editor_0013"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("version", sa.Column("released_at", sa.BigInteger))
    op.add_column("version", sa.Column("released_by", sa.Text))
    op.add_column("version", sa.Column("released_by_name", sa.Text))


def downgrade() -> None:
    """Go back to the one before."""
    for column in ("released_by_name", "released_by", "released_at"):
        op.drop_column("version", column)
