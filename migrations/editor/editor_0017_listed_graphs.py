"""Store by what lists of graphs are sorted, searched and paged."""

from collections.abc import Sequence
from typing import Any

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0017"
down_revision: str | None = "editor_0016"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None

_COLUMNS = ("seq", "changed_at", "name", "name_key", "words", "actions", "worst", "worst_alone")


def _column(name: str) -> sa.Column[Any]:
    match name:
        case "name_key":
            return sa.Column(name, sa.LargeBinary)
        case "name" | "words":
            return sa.Column(name, sa.Text, nullable=False, server_default="")
        case _:
            return sa.Column(name, sa.BigInteger, nullable=False, server_default="0")


def upgrade() -> None:
    """Go to this revision."""
    for name in _COLUMNS:
        op.add_column("graph_facts", _column(name))
    op.create_index("ix_graph_facts_changed_at", "graph_facts", ["changed_at"])
    op.create_index("ix_graph_facts_name_key", "graph_facts", ["name_key"])
    op.create_table(
        "graph_label",
        sa.Column("label", sa.Text, nullable=False),
        sa.Column("graph", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("label", "graph", name="pk_graph_label"),
    )
    op.create_index("ix_graph_label_graph", "graph_label", ["graph"])


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_table("graph_label")
    op.drop_index("ix_graph_facts_name_key", "graph_facts")
    op.drop_index("ix_graph_facts_changed_at", "graph_facts")
    for name in reversed(_COLUMNS):
        op.drop_column("graph_facts", name)
