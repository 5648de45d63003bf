"""Store by which file the editors of a database find out that they have the same data folder."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0021"
down_revision: str | None = "editor_0020"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None
# Whether editors of the revision before can go on beside it (CONTRIBUTING.md, Migrations).
expands: bool = True


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("editor", sa.Column("mark", sa.Text))
    op.add_column("editor", sa.Column("met", sa.Text))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("editor", "met")
    op.drop_column("editor", "mark")
