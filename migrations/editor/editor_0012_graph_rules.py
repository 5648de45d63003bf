"""Store who may see and edit graphs and the graphs in folders. Without a rule everybody may."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0012"
down_revision: str | None = "editor_0011"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("graph", sa.Column("rule", sa.Text))
    op.add_column("folder", sa.Column("rule", sa.Text))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("folder", "rule")
    op.drop_column("graph", "rule")
