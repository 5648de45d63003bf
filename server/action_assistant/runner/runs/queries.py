"""Queries of the runner's tables: runs, labels, robots.

Open runs live in memory; the table has those that are over, and tells which were open when the
process ended.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Final

import msgspec
from sqlalchemy import (
    ColumnElement,
    Select,
    Text,
    and_,
    cast,
    exists,
    func,
    literal,
    not_,
    or_,
    select,
    true,
    union_all,
)
from sqlalchemy.sql.selectable import TableValuedAlias

from action_assistant.runner.links.port import CONDUCTED
from action_assistant.runner.runs.question_events import QuestionAnswered
from action_assistant.runner.runs.sight import Unseen
from action_assistant.schema.runner_tables import (
    FAILED,
    review,
    robot,
    robot_right,
    run,
    run_label,
    runner_event,
)

OPEN: Final = "open"


def open_runs() -> Select[Any]:
    """Select the ids of the runs that have no end yet, oldest first."""
    return select(run.c.id).where(run.c.state == OPEN).order_by(run.c.number)


def last_number() -> Select[Any]:
    """Select the highest run number so far, 0 without runs."""
    return select(func.coalesce(func.max(run.c.number), 0))


def of_run(run_id: str) -> Select[Any]:
    """Select `state` and `simulated` of the run with this id."""
    return select(run.c.state, run.c.simulated).where(run.c.id == run_id)


def streams_of_pieces(run_id: str | ColumnElement[str], having: str = "") -> Select[Any]:
    """Select the names of the streams whose names begin as those of the pieces of a run do.
    `having`: only streams with an event of this kind, "" for all."""
    stream, own = runner_event.c.stream, literal("run/") + run_id
    found = select(stream).distinct().where(stream > own + ".", stream < own + "/")
    return found.where(runner_event.c.kind == having) if having else found


def answers_of(run_id: str) -> Select[Any]:
    """Select the bodies of all answers of people to questions of a run."""
    event = runner_event.c
    return select(event.body).where(
        event.stream == f"run/{run_id}", event.kind == QuestionAnswered.kind
    )


def by_request(request_id: str) -> Select[Any]:
    """Return the query for the run that the start with this request id has created: id, digest,
    engine, tree_digest, summary."""
    fields = (run.c.id, run.c.digest, run.c.engine, run.c.tree_digest, run.c.summary)
    return select(*fields).where(run.c.request_id == request_id)


def continued_by(earlier: str) -> Select[Any]:
    """Return the query for the numbers of the runs that continued a run where it ended. One that was
    refused did not."""
    origin = func.json_extract(run.c.summary, "$.from.run")
    at = func.json_extract(run.c.summary, "$.from.at")
    chosen = and_(origin == earlier, at == "[]", run.c.state != "refused")
    return select(run.c.number).where(chosen).order_by(run.c.number)


def of_start(request_id: str) -> Select[Any]:
    """Return the query for the ids of the runs that a start has created. In a start on several
    robots the request id of each run begins with the id of the group."""
    group = and_(run.c.request_id > f"{request_id}/", run.c.request_id < f"{request_id}0")
    return select(run.c.id).where(or_(run.c.request_id == request_id, group)).order_by(run.c.number)


def _cells(repeat: str) -> ColumnElement[bool]:
    """Return the condition of the runs of a repeat, by the ids of their starts."""
    first = request_of_cell(repeat, "")
    return and_(run.c.request_id > first, run.c.request_id < f"{first[:-1]}0")


def request_of_cell(repeat: str, cell: int | str) -> str:
    """Return the request id of the one start of a cell."""
    return f"repeat/{repeat}/{cell}"


def of_repeat(repeat: str) -> Select[Any]:
    """Select id, state and summary of the runs of a repeat, oldest first."""
    columns = (run.c.id, run.c.state, run.c.summary)
    return select(*columns).where(_cells(repeat)).order_by(run.c.number)


def repeats(but: str, newest: int | None = None) -> Select[Any]:
    """Select the events of all repeats, the newest first, without those of the kind `but`."""
    event = runner_event.c
    chosen = select(event.stream, event.seq, event.kind, event.body).where(
        event.stream > "repeat/", event.stream < "repeat0", event.kind != but
    )
    return chosen.order_by(event.position.desc()).limit(newest)


def kinds_of_repeats(but: str) -> Select[Any]:
    """Select stream and kind of the events of all repeats, the newest first, without those of the
    kind `but`."""
    event = runner_event.c
    chosen = select(event.stream, event.kind).where(
        event.stream > "repeat/", event.stream < "repeat0", event.kind != but
    )
    return chosen.order_by(event.position.desc())


def waiting(but: str, left: str) -> Select[Any]:
    """Select the events of all entries of the queue that have not left it, the oldest first, without those
    of the kind `but`. `left`: the kind that says that one has left."""
    event, other = runner_event.c, runner_event.alias("other")
    is_left = exists(
        select(other.c.seq).where(other.c.stream == event.stream, other.c.kind == left)
    )
    chosen = select(event.stream, event.kind, event.author, event.at, event.body).where(
        event.stream > "queue/", event.stream < "queue0", event.kind != but, ~is_left
    )
    return chosen.order_by(event.position)


def newest_move(moved: str) -> Select[Any]:
    """Select the body of the newest event of the queue of the kind `moved`."""
    event = runner_event.c
    chosen = select(event.body).where(
        event.stream > "queue/", event.stream < "queue0", event.kind == moved
    )
    return chosen.order_by(event.position.desc()).limit(1)


class Filter(msgspec.Struct, frozen=True, kw_only=True):
    """The wanted runs; None in a field means any. `failed`: true for runs that were refused, lost,
    halted, or ended in error; false for other ended runs. `graph`: id or name; `person`: id or
    part of a name; `text`: part of a name or message; `since`, `until`:
    microseconds UTC; `before`: the id of a run; `repeat`: of which
    they are cells."""

    graph: str | None = None
    engine: str | None = None
    states: tuple[str, ...] = ()
    failed: bool | None = None
    version: str | None = None
    person: str | None = None
    text: str | None = None
    label: str | None = None
    pinned: bool | None = None
    since: int | None = None
    until: int | None = None
    before: str | None = None
    repeat: str | None = None

    @property
    def asks_for_content(self) -> bool:
        """Return whether a run fits only by something that is hidden from a person who may not see
        its graph."""
        named = (self.graph, self.version, self.text, self.label, self.pinned, self.failed)
        return any(each is not None for each in named)


def listed(
    wanted: Filter,
    limit: int,
    among: Iterable[int] | None = None,
    unseen: Unseen | None = None,
) -> Select[Any]:
    """Return the query for at most `limit` of the `wanted` runs with their marks, newest first.
    `among`: the numbers of the only possible runs, None for any; `unseen`: leave out runs that this
    person may not see, if the filter asks for what these hide. The table does not have the states
    of open runs, so a filter by `states` returns all open ones, too."""
    seen = seen_by(unseen if wanted.asks_for_content else None)
    query = select(run, review.c.pinned, review.c.note).where(seen)
    query = query.outerjoin(review, review.c.run == run.c.id)
    if among is not None:
        numbers = func.json_each(msgspec.json.encode(sorted(among)).decode()).table_valued("value")
        query = query.where(run.c.number.in_(select(numbers.c.value)))
        query = query.where(*(or_(*each) for each in (_graph(wanted), on_engine(wanted.engine))))
        return _newest(query, wanted, limit)
    if wanted.graph is None and wanted.engine is None:
        return _newest(query, wanted, limit)
    # Out of sight is left out before runs are counted: else they would take the places of others.
    ids = select(run.c.id).outerjoin(review, review.c.run == run.c.id).where(seen)
    # Several queries, each by an index in the order of the numbers: one with OR would read all runs.
    named = union_all(
        *(
            select(_newest(ids.where(of_graph, on), wanted, limit).subquery())
            for of_graph in _graph(wanted)
            for on in on_engine(wanted.engine)
        )
    )
    return query.where(run.c.id.in_(named)).order_by(run.c.number.desc()).limit(limit)


def _graph(wanted: Filter) -> tuple[ColumnElement[bool], ...]:
    """Return conditions, any of which holds for a run of the wanted graph: by its id or its name."""
    if wanted.graph is None:
        return (true(),)
    return (run.c.graph == wanted.graph, run.c.graph_name == wanted.graph)


def on_engine(engine: str | None) -> tuple[ColumnElement[bool], ...]:
    """Return conditions, any of which holds for a run on this engine; a led run is on each
    engine that plays an actor in it. For None (any engine), one that always holds."""
    if engine is None:
        return (true(),)
    robots = _robots()
    has = select(robots.c.value).where(robots.c.value == engine).exists()
    return (run.c.engine == engine, and_(run.c.engine == CONDUCTED, has))


def _robots() -> TableValuedAlias:
    """Return the engines of a led run as a table of one column, `value`."""
    return func.json_each(run.c.summary, "$.robots").table_valued("value")


def _newest(query: Select[Any], wanted: Filter, limit: int) -> Select[Any]:
    for condition in _conditions(wanted):
        query = query.where(condition)
    if wanted.before is not None:
        number = select(run.c.number).where(run.c.id == wanted.before).scalar_subquery()
        query = query.where(run.c.number < number)
    return query.order_by(run.c.number.desc()).limit(limit)


def _conditions(wanted: Filter) -> Iterator[ColumnElement[bool]]:
    if wanted.repeat is not None:
        yield _cells(wanted.repeat)
    if wanted.states:
        yield run.c.state.in_([*wanted.states, OPEN])
    if wanted.failed is not None:
        yield (
            FAILED if wanted.failed else and_(run.c.state != OPEN, func.coalesce(not_(FAILED), 1))
        )
    if wanted.version is not None:
        yield or_(run.c.version == wanted.version, run.c.digest.startswith(wanted.version))
    if wanted.person is not None:
        named = run.c.author_name.icontains(wanted.person, autoescape=True)
        yield or_(run.c.author_id == wanted.person, named)
    if wanted.text is not None:
        said = (review.c.words, review.c.note, review.c.remarks)
        places = (run.c.graph_name, run.c.engine, run.c.author_name, *said)
        found = (each.icontains(wanted.text, autoescape=True) for each in places)
        robots = _robots()
        named = robots.c.value.icontains(wanted.text, autoescape=True)
        led = and_(run.c.engine == CONDUCTED, select(robots.c.value).where(named).exists())
        yield or_(*found, led, cast(run.c.number, Text) == wanted.text)
    if wanted.label is not None:
        yield run.c.id.in_(select(run_label.c.run).where(run_label.c.label == wanted.label))
    if wanted.pinned is not None:
        yield func.coalesce(review.c.pinned, False) == wanted.pinned
    if wanted.since is not None:
        yield run.c.requested_at >= wanted.since
    if wanted.until is not None:
        yield run.c.requested_at <= wanted.until


def labels_of(runs: Sequence[str]) -> Select[Any]:
    """Select the labels of the runs with these ids, by run and label."""
    query = select(run_label).where(run_label.c.run.in_(runs))
    return query.order_by(run_label.c.run, run_label.c.label)


def all_labels(unseen: Unseen | None = None) -> Select[Any]:
    """Select up to 200 labels of runs, the most used first. `unseen`: the graphs that a person may
    not see; only runs that this person may see are then counted. None counts all runs."""
    query = select(run_label.c.label).group_by(run_label.c.label)
    if unseen is not None:
        query = query.join(run, run.c.id == run_label.c.run).where(seen_by(unseen))
    return query.order_by(func.count().desc(), run_label.c.label).limit(200)


def seen_by(unseen: Unseen | None) -> ColumnElement[bool]:
    """Return a condition that holds for runs that a person may see; None for one who sees all. Rows of
    earlier versions do not have the graphs inside."""
    if unseen is None:
        return true()
    own = run.c.author_id == unseen.person
    if unseen.everything:
        return own
    listed = func.json_each(msgspec.json.encode(sorted(unseen.graphs)).decode())
    graphs = listed.table_valued("value", name="unseen")
    ids = select(graphs.c.value)
    inside = func.json_each(run.c.summary, "$.inside").table_valued("value", name="inside")
    is_inside = select(inside.c.value).where(inside.c.value.in_(ids)).exists()
    is_unsighted = func.json_extract(run.c.summary, "$.unsighted").is_not(None)
    is_of = func.coalesce(run.c.graph.in_(ids), 0)
    return or_(own, not_(or_(is_of, is_inside, is_unsighted)))


def all_robots() -> Select[Any]:
    """Select all registered robots, sorted by name."""
    return select(robot).where(robot.c.retired_at.is_(None)).order_by(robot.c.name)


def all_rights() -> Select[Any]:
    """Select the rights of all robots that have some, also of those that were forgotten."""
    return select(robot_right)
