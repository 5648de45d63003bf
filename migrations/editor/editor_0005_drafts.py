"""Which graphs are drafts: of what, under which name, and at which moment both sides were last one."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0005"
down_revision: str | None = "editor_0004"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None

_NUMBERS = ("drafted_seq", "base_seq", "merged_seq")


def upgrade() -> None:
    """Go to this revision."""
    for name in ("draft_of", "draft_name", "base_graph"):
        op.add_column("graph", sa.Column(name, sa.Text))
    for name in _NUMBERS:
        op.add_column("graph", sa.Column(name, sa.BigInteger))
    op.create_index("ix_graph_draft_of", "graph", ["draft_of"])


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_index("ix_graph_draft_of", "graph")
    for name in ("draft_of", "draft_name", "base_graph", *_NUMBERS):
        op.drop_column("graph", name)
