"""Which keys of documents each event changed."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0004"
down_revision: str | None = "editor_0003"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.create_table(
        "key_change",
        sa.Column("graph", sa.Text, nullable=False),
        sa.Column("seq", sa.BigInteger, nullable=False, autoincrement=False),
        sa.Column("root", sa.Text, nullable=False),
        sa.Column("key", sa.Text, nullable=False),
        sa.Column("owner", sa.Text, nullable=False),
        sa.Column("author", sa.Text, nullable=False),
        sa.Column("at", sa.BigInteger, nullable=False),
        sa.Column("before", sa.LargeBinary),
        sa.Column("after", sa.LargeBinary),
        sa.PrimaryKeyConstraint("graph", "seq", "root", "key", name="pk_key_change"),
    )
    op.create_index("ix_key_change_graph_owner_seq", "key_change", ["graph", "owner", "seq"])
    op.create_index(
        "ix_key_change_graph_root_key_seq", "key_change", ["graph", "root", "key", "seq"]
    )
    op.create_table(
        "key_change_head",
        sa.Column("graph", sa.Text, nullable=False),
        sa.Column("seq", sa.BigInteger, nullable=False),
        sa.Column("document", sa.LargeBinary, nullable=False),
        sa.PrimaryKeyConstraint("graph", name="pk_key_change_head"),
    )


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_table("key_change_head")
    op.drop_table("key_change")
