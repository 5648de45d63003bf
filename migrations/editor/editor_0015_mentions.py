"""Store mentions of persons, messages that are to be sent, and receivers that are switched off."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0015"
down_revision: str | None = "editor_0014"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.create_table(
        "outbox",
        sa.Column("id", sa.Text, nullable=False),
        sa.Column("receiver", sa.Text, nullable=False),
        sa.Column("kind", sa.Text, nullable=False),
        sa.Column("subject", sa.Text, nullable=False),
        sa.Column("at", sa.BigInteger, nullable=False),
        sa.Column("facts", sa.Text, nullable=False),
        sa.Column("due", sa.BigInteger),
        sa.Column("tries", sa.BigInteger, nullable=False),
        sa.Column("tried_at", sa.BigInteger),
        sa.Column("sent_at", sa.BigInteger),
        sa.Column("error", sa.Text, nullable=False, server_default=""),
        sa.PrimaryKeyConstraint("id", name="pk_outbox"),
    )
    op.create_index("ix_outbox_receiver_due", "outbox", ["receiver", "due"])
    op.create_index("ix_outbox_subject_at", "outbox", ["subject", "at"])
    op.create_table(
        "receiver",
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("target", sa.Text, nullable=False),
        sa.Column("off_at", sa.BigInteger, nullable=False),
        sa.Column("why", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_receiver"),
    )
    op.create_table(
        "mention",
        sa.Column("key", sa.Text, nullable=False),
        sa.Column("person", sa.Text, nullable=False),
        sa.Column("graph", sa.Text, nullable=False),
        sa.Column("seq", sa.BigInteger, nullable=False),
        sa.Column("author", sa.Text, nullable=False),
        sa.Column("at", sa.BigInteger, nullable=False),
        sa.Column("text", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("key", "person", name="pk_mention"),
    )
    op.create_index("ix_mention_person_at", "mention", ["person", "at"])
    op.create_index("ix_mention_graph_key", "mention", ["graph", "key"])
    op.create_table(
        "mention_due",
        sa.Column("graph", sa.Text, nullable=False),
        sa.Column("seq", sa.BigInteger, nullable=False, autoincrement=False),
        sa.Column("at", sa.BigInteger, nullable=False),
        sa.PrimaryKeyConstraint("graph", "seq", name="pk_mention_due"),
    )
    op.create_table(
        "mention_read",
        sa.Column("person", sa.Text, nullable=False),
        sa.Column("key", sa.Text, nullable=False),
        sa.PrimaryKeyConstraint("person", "key", name="pk_mention_read"),
    )


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_table("mention_read")
    op.drop_table("mention_due")
    op.drop_table("mention")
    op.drop_table("receiver")
    op.drop_table("outbox")
