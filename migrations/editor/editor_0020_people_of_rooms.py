"""Store who is in the rooms of one of several editors, for the lists of the others."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0020"
down_revision: str | None = "editor_0019"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None
# Whether editors of the revision before can go on beside it (CONTRIBUTING.md, Migrations).
expands: bool = True


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("room", sa.Column("people", sa.Text))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("room", "people")
