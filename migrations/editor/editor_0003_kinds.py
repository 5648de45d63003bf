"""What a document is of: a graph, or an action of the library."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0003"
down_revision: str | None = "editor_0002"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("graph", sa.Column("kind", sa.Text, nullable=False, server_default="graph"))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("graph", "kind")
