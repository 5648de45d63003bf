"""The tables of the runner: a fold of the events, written in the transactions that store them."""

from collections.abc import Sequence
from typing import Final

import msgspec
from sqlalchemy import Executable, func, insert, update
from sqlalchemy.dialects.sqlite import insert as upsert

from action_assistant.journal.events import Event
from action_assistant.runner.analysis import annotations, expected_runs
from action_assistant.runner.robots.registration import RobotRegistered, RobotRemoved
from action_assistant.runner.robots.rights import (
    BatonPassed,
    Drilled,
    Holder,
    Locked,
    RightsSet,
    Unlocked,
)
from action_assistant.runner.robots.robot_events import event_of, stream_of_robot
from action_assistant.runner.runs.events import (
    AlarmRaised,
    Answered,
    Ended,
    MovesAgain,
    PieceOf,
    Proof,
    Published,
    Requested,
    RunEvent,
    Silent,
    StopRequested,
    decode,
)
from action_assistant.runner.runs.queries import OPEN
from action_assistant.runner.runs.sight import graphs_inside
from action_assistant.runner.runs.word_index import holds
from action_assistant.schema.runner_tables import review, robot, robot_right, run
from action_assistant.web.auth.keys import PersonRef

_RIGHTS: Final = frozenset(
    each.kind for each in (RightsSet, BatonPassed, Locked, Unlocked, Drilled)
)
#: Columns of a run that have the same names in its request.
_AS_REQUESTED: Final = set(run.c.keys()) & set(Requested.__struct_fields__)


def fold(event: Event) -> Sequence[Executable]:
    """Return the statements by which a stored event changes the tables."""
    if event.kind == RobotRegistered.kind:
        return (_robot(msgspec.json.decode(event.body, type=RobotRegistered)),)
    if annotations.is_about(event.stream):
        return annotations.fold(event)
    if event.stream == expected_runs.STREAM:
        return expected_runs.fold(event)
    if event.kind == RobotRemoved.kind:
        gone = msgspec.json.decode(event.body, type=RobotRemoved)
        return (update(robot).where(robot.c.name == gone.name).values(retired_at=gone.at),)
    if event.stream.startswith(stream_of_robot("")):
        return _rights(event)
    if event.stream.startswith("run/"):
        return _run_changes(event.stream.removeprefix("run/"), decode(event.kind, event.body))
    return ()


def _run_changes(id_: str, event: RunEvent) -> Sequence[Executable]:
    change = update(run).where(run.c.id == id_)
    match event:
        case Requested(piece=PieceOf()):
            return ()  # a part of its led run, which has a row
        case Requested() as asked:
            robots = asked.led.robots.values() if asked.led is not None else ()
            words = holds(asked.run, asked.graph_name, asked.engine, asked.author.name, *robots)
            return (_run(asked), *words)
        case Published() as sent:
            return (change.values(started_at=sent.at),)
        case StopRequested() as stop:
            by = func.json(msgspec.json.encode(stop.author).decode())
            stopped = {
                "desired": "stopped",
                "stopped_by": stop.author.name,
                "summary": func.json_set(run.c.summary, "$.stopped_by", by),
            }
            return (change.where(run.c.desired != "stopped").values(**stopped),)
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
        case MovesAgain() as moves:
            return _open_again(id_, moves)
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
    """Return the statements that reopen a run that was over, with an alarm, and have its totals
    computed again after its next end."""
    text = msgspec.json.encode({"code": "moves_again", "at": moves.at, "text": moves.text})
    more = func.json_insert(run.c.summary, "$.alarms[#]", func.json(text.decode()))
    summary = func.json_remove(more, "$.proof_at", "$.unknown_since", "$.detail", "$.at_rest")
    values = {"state": OPEN, "ended_at": None, "summary": summary}
    return (
        update(run).where(run.c.id == id_).values(**values),
        update(review).where(review.c.run == id_).values(summed=False),
    )


def _run(asked: Requested) -> Executable:
    return insert(run).values(
        **{name: getattr(asked, name) for name in _AS_REQUESTED},
        id=asked.run,
        author_id=asked.author.id,
        author_name=asked.author.name,
        state=OPEN,
        desired="running",
        requested_at=asked.at,
        summary=_first_summary(asked),
    )


def _first_summary(asked: Requested) -> dict[str, object]:
    """Return the summary of a run right after its request: no alarms, the ids of the graphs inside
    of the started one, and what else the request says. Members without a value are left out."""
    summary: dict[str, object] = {
        "alarms": [],
        "inside": graphs_inside(asked.sight, asked.subgraphs),
    }
    if asked.unsighted:
        summary["unsighted"] = True
    if asked.group is not None:
        summary["group"] = asked.group
    if asked.repeat is not None:
        summary["repeat"] = msgspec.to_builtins(asked.repeat)
    if asked.led is not None:
        summary |= {"robots": asked.led.robots, "lost": asked.led.lost}
    if asked.batons:
        summary["batons"] = asked.batons
    if asked.watching:
        summary["watching"] = asked.watching
    if asked.values:
        summary |= {"values": asked.values, "sent_digest": asked.sent_digest}
    if asked.start_from is not None:
        number = 0 if asked.earlier is None else asked.earlier.number
        start = msgspec.structs.asdict(asked.start_from)
        summary |= {"from": start | {"number": number}, "sent_digest": asked.sent_digest}
    if asked.levels is not None and asked.start_from is None:
        summary |= {"levels": "opened", "sent_digest": asked.sent_digest}
    return summary


def _rights(event: Event) -> Sequence[Executable]:
    """Return the statement that a change of the rights of a robot means."""
    if event.kind not in _RIGHTS:
        return ()
    values: dict[str, object]
    match event_of(event):
        case RightsSet(author=author, rules=rules):
            values = {"rules": rules, "set_by": PersonRef(author.id, author.name)}
        case BatonPassed(holder=person, at=at):
            values = {"holder": None if person is None else Holder(person, at)}
        case Locked(locks=locks) | Unlocked(locks=locks):
            values = {"locks": locks}
        case Drilled() as drill:
            values = {"drills": [drill]}
        case _:
            return ()
    values = {name: msgspec.to_builtins(value) for name, value in values.items()}
    name = event.stream.removeprefix(stream_of_robot(""))
    first: dict[str, object] = {
        "rules": {},
        "set_by": None,
        "holder": None,
        "locks": [],
        "drills": [],
    }
    statement = upsert(robot_right).values(name=name, **(first | values))
    if "drills" in values:
        one = func.json_extract(statement.excluded.drills, "$[0]")
        values = {"drills": func.json_insert(robot_right.c.drills, "$[#]", func.json(one))}
    return (statement.on_conflict_do_update(index_elements=["name"], set_=values),)


def _robot(robot_: RobotRegistered) -> Executable:
    values = msgspec.structs.asdict(robot_)
    name, at = values.pop("name"), values.pop("at")
    values |= {"registered_at": at, "retired_at": None}
    statement = upsert(robot).values(name=name, **values)
    return statement.on_conflict_do_update(index_elements=["name"], set_=values)
