"""The tables of the runner: a fold of the events, written in their transactions, and its queries.

Open runs live in memory; the table answers for those that are over, and says which were open when
the process ended.
"""

from collections.abc import Iterator, Sequence
from typing import Any, Final

import msgspec
from sqlalchemy import (
    ColumnElement,
    Executable,
    Select,
    Text,
    and_,
    cast,
    func,
    insert,
    not_,
    or_,
    select,
    union_all,
    update,
)
from sqlalchemy.dialects.sqlite import insert as upsert

from action_assistant.journal.events import Event
from action_assistant.runner.events import (
    AlarmRaised,
    Answered,
    Ended,
    MovesAgain,
    Proof,
    Published,
    Requested,
    Silent,
    StopRequested,
    decode,
)
from action_assistant.runner.registered import Registered, Removed
from action_assistant.runner.review import about, again
from action_assistant.schema.runner_tables import FAILED, review, robot, run, run_label

_OPEN: Final = "open"


def fold(event: Event) -> Sequence[Executable]:
    """What an event means for the tables."""
    if event.kind == Registered.kind:
        return (_robot(msgspec.json.decode(event.body, type=Registered)),)
    if about.is_about(event.stream):
        return about.fold(event)
    if event.stream == again.STREAM:
        return again.fold(event)
    if event.kind == Removed.kind:
        gone = msgspec.json.decode(event.body, type=Removed)
        return (update(robot).where(robot.c.name == gone.name).values(retired_at=gone.at),)
    if not event.stream.startswith("run/"):
        return ()
    change = update(run).where(run.c.id == event.stream.removeprefix("run/"))
    match decode(event.kind, event.body):
        case Requested() as asked:
            return (_run(asked),)
        case Published() as sent:
            return (change.values(started_at=sent.at),)
        case StopRequested() as stop:
            first = change.where(run.c.desired != "stopped")
            return (
                first.values(
                    desired="stopped",
                    stopped_by=stop.author.name,
                    summary=func.json_set(
                        run.c.summary,
                        "$.stopped_by",
                        func.json(msgspec.json.encode(stop.author).decode()),
                    ),
                ),
            )
        case Proof() as proof:
            return (change.values(summary=func.json_set(run.c.summary, "$.proof_at", proof.at)),)
        case Silent() as silent:
            since = func.json_set(run.c.summary, "$.unknown_since", silent.since)
            return (change.values(summary=since),)
        case Answered():
            return (change.values(summary=func.json_remove(run.c.summary, "$.unknown_since")),)
        case AlarmRaised() as alarm:
            text = msgspec.json.encode({"code": alarm.code, "at": alarm.at, "text": alarm.text})
            more = func.json_insert(run.c.summary, "$.alarms[#]", func.json(text.decode()))
            return (change.values(summary=more),)
        case MovesAgain() as again_:
            return _open_again(event.stream.removeprefix("run/"), again_)
        case Ended() as end:
            summary = func.json_set(run.c.summary, "$.detail", end.detail)
            if end.at_rest is not None:
                seen = msgspec.json.encode(end.at_rest).decode()
                summary = func.json_set(summary, "$.at_rest", func.json(seen))
            return (
                change.values(state=end.state, ended_at=end.at, result=end.result, summary=summary),
            )
        case _:
            return ()


def _open_again(id_: str, moves: MovesAgain) -> Sequence[Executable]:
    """A run that was over is not; its sum is made anew at its next end."""
    text = msgspec.json.encode({"code": "moves_again", "at": moves.at, "text": moves.text})
    more = func.json_insert(run.c.summary, "$.alarms[#]", func.json(text.decode()))
    summary = func.json_remove(more, "$.proof_at", "$.unknown_since", "$.detail", "$.at_rest")
    values = {"state": _OPEN, "ended_at": None, "summary": summary}
    return (
        update(run).where(run.c.id == id_).values(**values),
        update(review).where(review.c.run == id_).values(summed=False),
    )


def _run(asked: Requested) -> Executable:
    return insert(run).values(
        id=asked.run,
        number=asked.number,
        graph=asked.graph,
        graph_name=asked.graph_name,
        version=asked.version,
        digest=asked.digest,
        engine=asked.engine,
        author_id=asked.author.id,
        author_name=asked.author.name,
        state=_OPEN,
        desired="running",
        simulated=asked.simulated,
        request_id=asked.request_id,
        requested_at=asked.at,
        summary={"alarms": []} if asked.group is None else {"alarms": [], "group": asked.group},
    )


def _robot(robot_: Registered) -> Executable:
    values = {
        "domain": robot_.domain,
        "rmw": robot_.rmw,
        "get_service": robot_.get_service,
        "profile": robot_.profile,
        "registered_at": robot_.at,
        "retired_at": None,
    }
    statement = upsert(robot).values(name=robot_.name, **values)
    return statement.on_conflict_do_update(index_elements=["name"], set_=values)


def open_runs() -> Select[Any]:
    """Ids of the runs that have no end yet, oldest first."""
    return select(run.c.id).where(run.c.state == _OPEN).order_by(run.c.number)


def last_number() -> Select[Any]:
    """The highest run number given so far."""
    return select(func.coalesce(func.max(run.c.number), 0))


def of_run(run_id: str) -> Select[Any]:
    """A run: state, simulated."""
    return select(run.c.state, run.c.simulated).where(run.c.id == run_id)


def by_request(request_id: str) -> Select[Any]:
    """The run that a request has become: id, digest, engine."""
    return select(run.c.id, run.c.digest, run.c.engine).where(run.c.request_id == request_id)


def of_start(request_id: str) -> Select[Any]:
    """Ids of the runs that a start has become, also one on several robots: those have a request each,
    which begins with that of their group."""
    group = and_(run.c.request_id > f"{request_id}/", run.c.request_id < f"{request_id}0")
    return select(run.c.id).where(or_(run.c.request_id == request_id, group)).order_by(run.c.number)


class Filter(msgspec.Struct, frozen=True, kw_only=True):
    """Which runs are asked for; None asks for all. `failed`: refused, lost, halted, or ended in
    error; the other ones are over as well. `graph` is an id or a name, `person` an id or a
    part of a name, `text` a part of a name or of what was said, `before` a run's id."""

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


def listed(wanted: Filter, limit: int) -> Select[Any]:
    """Runs and what was noted about them, newest first. Which of its states an open run is in the
    table does not know: with `states` all open ones are there, too."""
    query = select(run, review.c.pinned, review.c.note)
    query = query.outerjoin(review, review.c.run == run.c.id)
    if wanted.graph is None:
        return _newest(query, wanted, limit)
    ids = select(run.c.id).outerjoin(review, review.c.run == run.c.id)
    # each by an index in the order of the numbers: one question for both would read all runs
    named = union_all(
        *(
            select(_newest(ids.where(column == wanted.graph), wanted, limit).subquery())
            for column in (run.c.graph, run.c.graph_name)
        )
    )
    return query.where(run.c.id.in_(named)).order_by(run.c.number.desc()).limit(limit)


def _newest(query: Select[Any], wanted: Filter, limit: int) -> Select[Any]:
    for condition in _conditions(wanted):
        query = query.where(condition)
    if wanted.before is not None:
        number = select(run.c.number).where(run.c.id == wanted.before).scalar_subquery()
        query = query.where(run.c.number < number)
    return query.order_by(run.c.number.desc()).limit(limit)


def _conditions(wanted: Filter) -> Iterator[ColumnElement[bool]]:
    if wanted.engine is not None:
        yield run.c.engine == wanted.engine
    if wanted.states:
        yield run.c.state.in_([*wanted.states, _OPEN])
    if wanted.failed is not None:
        yield (
            FAILED if wanted.failed else and_(run.c.state != _OPEN, func.coalesce(not_(FAILED), 1))
        )
    if wanted.version is not None:
        yield or_(run.c.version == wanted.version, run.c.digest.startswith(wanted.version))
    if wanted.person is not None:
        named = run.c.author_name.icontains(wanted.person, autoescape=True)
        yield or_(run.c.author_id == wanted.person, named)
    if wanted.text is not None:
        places = (run.c.graph_name, run.c.engine, run.c.author_name, review.c.words, review.c.note)
        found = (each.icontains(wanted.text, autoescape=True) for each in places)
        yield or_(*found, cast(run.c.number, Text) == wanted.text)
    if wanted.label is not None:
        yield run.c.id.in_(select(run_label.c.run).where(run_label.c.label == wanted.label))
    if wanted.pinned is not None:
        yield func.coalesce(review.c.pinned, False) == wanted.pinned
    if wanted.since is not None:
        yield run.c.requested_at >= wanted.since
    if wanted.until is not None:
        yield run.c.requested_at <= wanted.until


def labels_of(runs: Sequence[str]) -> Select[Any]:
    """The labels of these runs."""
    query = select(run_label).where(run_label.c.run.in_(runs))
    return query.order_by(run_label.c.run, run_label.c.label)


def all_labels() -> Select[Any]:
    """Every label, the most used first."""
    query = select(run_label.c.label).group_by(run_label.c.label)
    return query.order_by(func.count().desc(), run_label.c.label).limit(200)


def all_robots() -> Select[Any]:
    """Registered robots by name."""
    return select(robot).where(robot.c.retired_at.is_(None)).order_by(robot.c.name)
