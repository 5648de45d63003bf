"""Every table of both journals. The scripts in `migrations/` make the same ones, step by step.

`event`, `head` (where each stream ends) and `snapshot` are in both files. Everything else is a fold of
the events: it can be thrown away and made again. Times are microseconds since 1970, UTC.
"""

from typing import Final

from sqlalchemy import (
    JSON,
    BigInteger,
    Boolean,
    Column,
    ColumnElement,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    Table,
    Text,
    literal_column,
    text,
)

_NAMES: Final = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "pk": "pk_%(table_name)s",
}

EDITOR: Final = MetaData(naming_convention=_NAMES)
RUNNER: Final = MetaData(naming_convention=_NAMES)


def _log(metadata: MetaData) -> tuple[Table, Table, Table]:
    event = Table(
        "event",
        metadata,
        Column("stream", Text, primary_key=True),
        Column("seq", BigInteger, primary_key=True, autoincrement=False),
        Column("kind", Text, nullable=False),
        Column("author", Text, nullable=False),
        Column("at", BigInteger, nullable=False),
        Column("body", LargeBinary, nullable=False),
        Column("position", BigInteger, nullable=False),
        Column("chain", LargeBinary, nullable=False),
        Index(None, "position", unique=True),
    )
    head = Table(
        "head",
        metadata,
        Column("stream", Text, primary_key=True),
        Column("seq", BigInteger, nullable=False),
        Column("chain", LargeBinary, nullable=False),
    )
    snapshot = Table(
        "snapshot",
        metadata,
        Column("stream", Text, primary_key=True),
        Column("seq", BigInteger, nullable=False),
        Column("proof", LargeBinary, nullable=False),
        Column("state", LargeBinary, nullable=False),
    )
    return event, head, snapshot


editor_event, editor_head, editor_snapshot = _log(EDITOR)
runner_event, runner_head, runner_snapshot = _log(RUNNER)

#: What is not a fold.
LOG: Final = frozenset({"event", "head", "snapshot"})

# --- editor -----------------------------------------------------------------------------------

#: A graph of the catalogue. `name` and `description` follow the document.
graph: Final = Table(
    "graph",
    EDITOR,
    Column("id", Text, primary_key=True),
    Column("name", Text, nullable=False),
    Column("description", Text, nullable=False),
    Column("made_at", BigInteger, nullable=False),
    Column("made_by", Text, nullable=False),
    Column("deleted_at", BigInteger),
)

#: A published version. Its UMRF stands in the body of the event `(stream, event_seq)`.
version: Final = Table(
    "version",
    EDITOR,
    Column("id", Text, primary_key=True),
    Column("graph", Text, nullable=False),
    Column("label", Text, nullable=False),
    Column("digest", Text, nullable=False),
    Column("seq", BigInteger, nullable=False),
    Column("author_id", Text, nullable=False),
    Column("author_name", Text, nullable=False),
    Column("at", BigInteger, nullable=False),
    Column("stream", Text, nullable=False),
    Column("event_seq", BigInteger, nullable=False),
    Index(None, "graph", "at"),
    Index(None, "digest"),
)

#: Somebody who acted here, under the name they last gave.
person: Final = Table(
    "person",
    EDITOR,
    Column("id", Text, primary_key=True),
    Column("name", Text, nullable=False),
    Column("seen_at", BigInteger, nullable=False),
)

#: A link that lets people in with a role.
invitation: Final = Table(
    "invitation",
    EDITOR,
    Column("id", Text, primary_key=True),
    Column("role", Text, nullable=False),
    Column("label", Text, nullable=False),
    Column("made_at", BigInteger, nullable=False),
    Column("made_by", Text, nullable=False),
    Column("revoked_at", BigInteger),
    Column("revoked_by", Text),
)

#: Who came in by which link, under which name and when that was first.
guest: Final = Table(
    "guest",
    EDITOR,
    Column("invitation", Text, primary_key=True),
    Column("person", Text, primary_key=True),
    Column("name", Text, nullable=False),
    Column("at", BigInteger, nullable=False),
)

# --- runner -----------------------------------------------------------------------------------

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
    Index(None, "graph", "number"),
    Index(None, "graph_name", "number"),
    Index(None, "engine", "number"),
    Index(None, "state"),
    Index(None, "archived_at", "ended_at"),
    Index("ix_run_failed", "number", sqlite_where=text(str(FAILED).replace("run.", ""))),
)

#: A robot that somebody registered, under its wake word.
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
)

#: The labels of runs.
run_label: Final = Table(
    "run_label",
    RUNNER,
    Column("run", Text, primary_key=True),
    Column("label", Text, primary_key=True),
    Index(None, "label"),
)

#: What one action of a run that is over adds up to; `took` are microseconds.
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
