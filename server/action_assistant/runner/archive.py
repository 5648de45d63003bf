"""The tables of the runner: a fold of the events, written in their transactions, and its queries.

Open runs live in memory; the table answers for those that are over, and says which were open when
the process ended.
"""

from collections.abc import Sequence
from typing import Any, Final

import msgspec
from sqlalchemy import Executable, Select, func, insert, or_, select, update
from sqlalchemy.dialects.sqlite import insert as upsert

from action_assistant.journal.events import Event
from action_assistant.journal.tables import robot, run
from action_assistant.runner.events import (
    AlarmRaised,
    Answered,
    Ended,
    Proof,
    Published,
    Requested,
    Silent,
    StopRequested,
    decode,
)
from action_assistant.runner.robots import REGISTERED, Registered

_OPEN: Final = "open"


def fold(event: Event) -> Sequence[Executable]:
    """What an event means for the tables."""
    if event.kind == REGISTERED:
        return (_robot(msgspec.json.decode(event.body, type=Registered)),)
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
        case Ended() as end:
            return (
                change.values(
                    state=end.state,
                    ended_at=end.at,
                    result=end.result,
                    summary=func.json_set(run.c.summary, "$.detail", end.detail),
                ),
            )
        case _:
            return ()


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
        summary={"alarms": []},
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


def by_request(request_id: str) -> Select[Any]:
    """The run that a request has become: id, digest, engine."""
    return select(run.c.id, run.c.digest, run.c.engine).where(run.c.request_id == request_id)


def listed(
    *,
    graph: str | None,
    engine: str | None,
    state: str | None,
    before: str | None,
    limit: int,
) -> Select[Any]:
    """Runs, newest first. `graph` is an id or a name, `before` a run's id. Which of its states an
    open run is in the table does not know: with a `state` all open ones are there, too."""
    query = select(run).order_by(run.c.number.desc()).limit(limit)
    if graph is not None:
        query = query.where(or_(run.c.graph == graph, run.c.graph_name == graph))
    if engine is not None:
        query = query.where(run.c.engine == engine)
    if state is not None:
        query = query.where(run.c.state.in_([state, _OPEN]))
    if before is not None:
        number = select(run.c.number).where(run.c.id == before).scalar_subquery()
        query = query.where(run.c.number < number)
    return query


def all_robots() -> Select[Any]:
    """Registered robots by name."""
    return select(robot).where(robot.c.retired_at.is_(None)).order_by(robot.c.name)
