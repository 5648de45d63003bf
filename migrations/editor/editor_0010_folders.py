"""Store folders of graphs. Existing graphs lie in none."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0010"
down_revision: str | None = "editor_0009"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.create_table(
        "folder",
        sa.Column("id", sa.Text, nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("parent", sa.Text),
        sa.Column("made_at", sa.BigInteger, nullable=False),
        sa.Column("made_by", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_folder"),
    )
    op.add_column("graph", sa.Column("folder", sa.Text))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("graph", "folder")
    op.drop_table("folder")
