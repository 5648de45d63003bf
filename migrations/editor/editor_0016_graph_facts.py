"""Store what lists show of each graph, so that no start has to read every document."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0016"
down_revision: str | None = "editor_0015"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.create_table(
        "graph_facts",
        sa.Column("graph", sa.Text, nullable=False),
        sa.Column("form", sa.LargeBinary, nullable=False),
        sa.Column("facts", sa.LargeBinary, nullable=False),
        sa.PrimaryKeyConstraint("graph", name="pk_graph_facts"),
    )


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_table("graph_facts")
