"""Store which of several editors owns a stream, and how often it has changed hands."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0018"
down_revision: str | None = "editor_0017"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.add_column("head", sa.Column("epoch", sa.BigInteger, nullable=False, server_default="0"))
    op.create_table(
        "editor",
        sa.Column("slot", sa.BigInteger, nullable=False, autoincrement=False),
        sa.Column("life", sa.LargeBinary, nullable=False),
        sa.Column("url", sa.Text, nullable=False),
        sa.Column("version", sa.Text, nullable=False),
        sa.Column("beat_at", sa.BigInteger, nullable=False),
        sa.Column("draining_at", sa.BigInteger),
        sa.PrimaryKeyConstraint("slot", name="pk_editor"),
    )
    op.create_table(
        "room",
        sa.Column("stream", sa.Text, nullable=False),
        sa.Column("life", sa.LargeBinary, nullable=False),
        sa.Column("epoch", sa.BigInteger, nullable=False),
        sa.Column("since", sa.BigInteger, nullable=False),
        sa.PrimaryKeyConstraint("stream", name="pk_room"),
    )
    op.create_index("ix_room_life", "room", ["life"])


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_table("room")
    op.drop_table("editor")
    op.drop_column("head", "epoch")
