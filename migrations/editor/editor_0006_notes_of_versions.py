"""What the author of a version says of it."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0006"
down_revision: str | None = "editor_0005"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("version", sa.Column("note", sa.Text, nullable=False, server_default=""))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("version", "note")
