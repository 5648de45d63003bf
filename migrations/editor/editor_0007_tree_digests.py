"""What a version is together with the graphs inside of it."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0007"
down_revision: str | None = "editor_0006"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("version", sa.Column("tree_digest", sa.Text, nullable=True))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("version", "tree_digest")
