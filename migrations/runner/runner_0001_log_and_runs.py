"""The runner's log, and its tables of runs and robots."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "runner_0001"
down_revision: str | None = None
branch_labels: Sequence[str] | None = ("runner",)
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go to this revision."""
    op.create_table(
        "event",
        sa.Column("stream", sa.Text, nullable=False),
        sa.Column("seq", sa.BigInteger, nullable=False, autoincrement=False),
        sa.Column("kind", sa.Text, nullable=False),
        sa.Column("author", sa.Text, nullable=False),
        sa.Column("at", sa.BigInteger, nullable=False),
        sa.Column("body", sa.LargeBinary, nullable=False),
        sa.Column("position", sa.BigInteger, nullable=False),
        sa.Column("chain", sa.LargeBinary, nullable=False),
        sa.PrimaryKeyConstraint("stream", "seq", name="pk_event"),
    )
    op.create_index("ix_event_position", "event", ["position"], unique=True)
    op.create_table(
        "head",
        sa.Column("stream", sa.Text, nullable=False),
        sa.Column("seq", sa.BigInteger, nullable=False),
        sa.Column("chain", sa.LargeBinary, nullable=False),
        sa.PrimaryKeyConstraint("stream", name="pk_head"),
    )
    op.create_table(
        "snapshot",
        sa.Column("stream", sa.Text, nullable=False),
        sa.Column("seq", sa.BigInteger, nullable=False),
        sa.Column("proof", sa.LargeBinary, nullable=False),
        sa.Column("state", sa.LargeBinary, nullable=False),
        sa.PrimaryKeyConstraint("stream", name="pk_snapshot"),
    )
    op.create_table(
        "run",
        sa.Column("id", sa.Text, nullable=False),
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("graph", sa.Text),
        sa.Column("graph_name", sa.Text, nullable=False),
        sa.Column("version", sa.Text),
        sa.Column("digest", sa.Text, nullable=False),
        sa.Column("engine", sa.Text, nullable=False),
        sa.Column("author_id", sa.Text, nullable=False),
        sa.Column("author_name", sa.Text, nullable=False),
        sa.Column("state", sa.Text, nullable=False),
        sa.Column("desired", sa.Text, nullable=False),
        sa.Column("simulated", sa.Boolean(create_constraint=False), nullable=False),
        sa.Column("request_id", sa.Text, nullable=False),
        sa.Column("requested_at", sa.BigInteger, nullable=False),
        sa.Column("started_at", sa.BigInteger),
        sa.Column("ended_at", sa.BigInteger),
        sa.Column("result", sa.Text),
        sa.Column("stopped_by", sa.Text),
        sa.Column("summary", sa.JSON, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_run"),
        sa.UniqueConstraint("number", name="uq_run_number"),
        sa.UniqueConstraint("request_id", name="uq_run_request_id"),
    )
    op.create_index("ix_run_graph_number", "run", ["graph", "number"])
    op.create_index("ix_run_engine_number", "run", ["engine", "number"])
    op.create_index("ix_run_state", "run", ["state"])
    op.create_table(
        "robot",
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("domain", sa.Integer, nullable=False),
        sa.Column("rmw", sa.Text, nullable=False),
        sa.Column("get_service", sa.Text, nullable=False),
        sa.Column("profile", sa.JSON, nullable=False),
        sa.Column("registered_at", sa.BigInteger, nullable=False),
        sa.Column("retired_at", sa.BigInteger),
        sa.PrimaryKeyConstraint("name", name="pk_robot"),
    )


def downgrade() -> None:
    """Go back to the one before."""
    for table in ("robot", "run", "snapshot", "head", "event"):
        op.drop_table(table)
