"""Store as whom an OpenID Connect provider knows a person."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0013"
down_revision: str | None = "editor_0012"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("member", sa.Column("provider", sa.Text))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("member", "provider")
