"""Store the values that another one overwrote at once, and the form of each index of changes. An index of an earlier
form lacks these values and is derived again."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "editor_0009"
down_revision: str | None = "editor_0008"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.create_table(
        "overwritten_value",
        sa.Column("graph", sa.Text, nullable=False),
        sa.Column("seq", sa.BigInteger, nullable=False, autoincrement=False),
        sa.Column("root", sa.Text, nullable=False),
        sa.Column("key", sa.Text, nullable=False),
        sa.Column("author", sa.Text, nullable=False),
        sa.Column("at", sa.BigInteger, nullable=False),
        sa.Column("value", sa.LargeBinary, nullable=False),
        sa.Column("stands", sa.LargeBinary),
        sa.PrimaryKeyConstraint("graph", "seq", "root", "key", name="pk_overwritten_value"),
    )
    op.add_column("key_change_head", sa.Column("form", sa.BigInteger))


def downgrade() -> None:
    """Go back to the one before."""
    op.drop_column("key_change_head", "form")
    op.drop_table("overwritten_value")
