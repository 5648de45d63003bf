"""Store by what an editor proves to others of its database that it knows the same token."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0019"
down_revision: str | None = "editor_0018"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("editor", sa.Column("proof", sa.LargeBinary))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("editor", "proof")
