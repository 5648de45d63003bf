"""The runner's tables: its log, and what is folded from it."""

from typing import Final

from sqlalchemy import (
    JSON,
    BigInteger,
    Boolean,
    Column,
    ColumnElement,
    Index,
    Integer,
    MetaData,
    Table,
    Text,
    false,
    literal_column,
    text,
)

from action_assistant.schema.log_tables import NAMES, log_tables, outbox_tables, written_by_table

RUNNER: Final = MetaData(naming_convention=NAMES)
runner_event, runner_head, runner_snapshot = log_tables(RUNNER)
runner_written_by: Final = written_by_table(RUNNER)
#: Runs that ended badly: a list of them must not read all the others. Of an index, so word for word.
FAILED: Final[ColumnElement[bool]] = literal_column(
    "(run.state IN ('error', 'refused', 'lost', 'halted') OR run.result = 'on_error')"
)
#: A run. `number` counts for people; `request_id` makes a start happen once; `summary` is the run as
#: the list shows it; `archived_as` is where its events are once they are not here any more.
run: Final = Table(
    "run",
    RUNNER,
    Column("id", Text, primary_key=True),
    Column("number", Integer, nullable=False, unique=True),
    Column("graph", Text),
    Column("graph_name", Text, nullable=False),
    Column("version", Text),
    Column("digest", Text, nullable=False),
    Column("engine", Text, nullable=False),
    Column("author_id", Text, nullable=False),
    Column("author_name", Text, nullable=False),
    Column("state", Text, nullable=False),
    Column("desired", Text, nullable=False),
    Column("simulated", Boolean(create_constraint=False), nullable=False),
    Column("request_id", Text, nullable=False, unique=True),
    Column("requested_at", BigInteger, nullable=False),
    Column("started_at", BigInteger),
    Column("ended_at", BigInteger),
    Column("result", Text),
    Column("stopped_by", Text),
    Column("summary", JSON, nullable=False),
    Column("archived_at", BigInteger),
    Column("archived_as", Text),
    Column("tree_digest", Text),
    Index(None, "graph", "number"),
    Index(None, "graph_name", "number"),
    Index(None, "engine", "number"),
    Index(None, "state"),
    Index(None, "archived_at", "ended_at"),
    Index("ix_run_failed", "number", sqlite_where=text(str(FAILED).replace("run.", ""))),
)
#: A registered robot, under its wake word.
robot: Final = Table(
    "robot",
    RUNNER,
    Column("name", Text, primary_key=True),
    Column("domain", Integer, nullable=False),
    Column("rmw", Text, nullable=False),
    Column("get_service", Text, nullable=False),
    Column("profile", JSON, nullable=False),
    Column("registered_at", BigInteger, nullable=False),
    Column("retired_at", BigInteger),
    Column("led", Boolean(create_constraint=False), nullable=False, server_default=false()),
)
#: The rights of a robot, by its name: the rules of an owner, who set them, who holds its baton, and who
#: has put it out of service. A robot that is forgotten keeps them.
robot_right: Final = Table(
    "robot_right",
    RUNNER,
    Column("name", Text, primary_key=True),
    Column("rules", JSON, nullable=False),
    Column("set_by", JSON(none_as_null=True)),
    Column("holder", JSON(none_as_null=True)),
    Column("locks", JSON, nullable=False),
    Column("drills", JSON, nullable=False, server_default="[]"),
)
#: What people noted about a run, and what may be searched of it once it is over (`summed`).
review: Final = Table(
    "review",
    RUNNER,
    Column("run", Text, primary_key=True),
    Column("pinned", Boolean(create_constraint=False), nullable=False),
    Column("note", Text, nullable=False),
    Column("words", Text, nullable=False),
    Column("summed", Boolean(create_constraint=False), nullable=False),
    Column("remarks", Text, nullable=False, server_default=""),
)
#: The words of runs, in small letters, and which runs hold which: `number` is theirs.
word: Final = Table(
    "word",
    RUNNER,
    Column("id", Integer, primary_key=True),
    Column("text", Text, nullable=False, unique=True),
)
run_word: Final = Table(
    "run_word",
    RUNNER,
    Column("word", Integer, primary_key=True, autoincrement=False),
    Column("number", Integer, primary_key=True, autoincrement=False),
    sqlite_with_rowid=False,
)
#: Runs whose words are yet to be found.
unindexed_run: Final = Table(
    "unindexed_run", RUNNER, Column("number", Integer, primary_key=True, autoincrement=False)
)
#: The labels of runs.
run_label: Final = Table(
    "run_label",
    RUNNER,
    Column("run", Text, primary_key=True),
    Column("label", Text, primary_key=True),
    Index(None, "label"),
)
#: Totals of one action of a run that is over; `took` are microseconds.
action_sum: Final = Table(
    "action_sum",
    RUNNER,
    Column("run", Text, primary_key=True),
    Column("action", Text, primary_key=True),
    Column("aid", Text),
    Column("visits", Integer, nullable=False),
    Column("results", JSON, nullable=False),
    Column("inferred", Integer, nullable=False),
    Column("took", JSON, nullable=False),
)
#: A run that shall go the same for ever. Its graph, script and course stand in the event.
expectation: Final = Table(
    "expectation",
    RUNNER,
    Column("name", Text, primary_key=True),
    Column("graph", Text),
    Column("graph_name", Text, nullable=False),
    Column("run", Text, nullable=False),
    Column("at", BigInteger, nullable=False),
    Column("seq", BigInteger, nullable=False),
)
outbox, receiver = outbox_tables(RUNNER)
