"""The messages that events of the runner cause: the rows of its outbox, written with the event."""

import logging
from collections.abc import Mapping, Sequence
from typing import Any, Final

import msgspec
from sqlalchemy import Executable, Select, exists, func, insert, literal, or_, select, text

from action_assistant.journal.events import Event, Fold
from action_assistant.runner.queues.entry import QueueReady
from action_assistant.runner.queues.entry import stream_of as stream_of_entry
from action_assistant.runner.robots.robot_events import EngineBecame, stream_of_robot
from action_assistant.runner.runs.events import (
    AlarmRaised,
    Ended,
    Held,
    PieceRest,
    RunEvent,
    decode,
)
from action_assistant.runner.runs.queries import OPEN
from action_assistant.runner.runs.question_events import QuestionAsked
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.runner.start.approvals import ApprovalAsked
from action_assistant.schema.runner_tables import outbox, run
from action_assistant.web.notifications.outbox import id_of, row
from action_assistant.web.notifications.receivers import Receiver

log: Final = logging.getLogger(__name__)

#: The kinds of messages that the runner sends.
KINDS: Final = (
    "run.ended",
    "run.stop_unconfirmed",
    "robot.lost",
    "run.held",
    "answer.asked",
    "approval.asked",
    "queue.ready",
    "server.fault",
)
#: The code of the alarm of a Stop without proof.
_UNCONFIRMED: Final = "stop_unconfirmed"
_FAILED: Final = {
    "error": "an error",
    "refused": "refused by the engine",
    "lost": "nothing proves its end",
    "halted": "nothing was left to run",
}
_HOW: Final = {
    "gone": "does not answer any more",
    "restarted": "has a new engine process",
}
#: Microseconds in which a second message of these kinds about one thing is no news, nor the question
#: how an action has ended, which is repeated with each state of its robot.
_QUIET_US: Final = 600_000_000
_QUIET: Final = frozenset({"run.stop_unconfirmed", "robot.lost", "queue.ready"})
_EVENTS: Final = frozenset(
    each.kind
    for each in (
        *(Ended, AlarmRaised, Held, PieceRest),
        *(QuestionAsked, EngineBecame, ApprovalAsked, QueueReady),
    )
)


def with_notices(fold: Fold, receivers: Sequence[Receiver]) -> Fold:
    """Return the fold `fold` with the messages to these receivers."""
    if not receivers:
        return fold

    def both(event: Event) -> Sequence[Executable]:
        if event.kind not in _EVENTS:
            return fold(event)
        try:
            messages = notices(event, receivers)
        except Exception:  # an event is stored, whatever becomes of the messages about it
            log.exception("no message is sent about an event of %s", event.stream)
            messages = []
        return (*fold(event), *messages)  # after the tables, which they read

    return both


def notices(event: Event, receivers: Sequence[Receiver]) -> list[Executable]:
    """Return the statements that put the messages about an event into the outbox, for each receiver
    that wants them. Runs in the simulator cause none, nor do pieces, which are parts of their run."""
    if event.kind == ApprovalAsked.kind:
        asked = msgspec.json.decode(event.body, type=ApprovalAsked)
        facts = {
            "person": asked.author.name,
            "graph": asked.graph_name,
            "robot": ", ".join(asked.robots),
            "id": asked.graph or "",
        }
        return _statements(event, receivers, "approval.asked", asked.at, facts, None)
    if event.kind == QueueReady.kind:
        ready = msgspec.json.decode(event.body, type=QueueReady)
        facts = {
            "person": ready.person,
            "graph": ready.graph_name,
            "robot": ", ".join(ready.robots),
            "id": ready.graph or "",
            "entry": event.stream.removeprefix(stream_of_entry("")),
        }
        return _statements(event, receivers, "queue.ready", ready.at, facts, None)
    if event.kind == EngineBecame.kind:
        became = msgspec.json.decode(event.body, type=EngineBecame)
        how = _HOW.get(became.state)
        if how is None:
            return []
        name = event.stream.removeprefix(stream_of_robot(""))
        open_there = select(run.c.id).where(run.c.state == OPEN, _plays(name)).limit(1)
        chosen = run.c.id == open_there.scalar_subquery()
        facts = {"lost": name, "how": how, "why": became.why}
        return _statements(event, receivers, "robot.lost", became.at, facts, chosen)
    return _of_run(event, receivers, decode(event.kind, event.body))


def _of_run(event: Event, receivers: Sequence[Receiver], decoded: RunEvent) -> list[Executable]:
    facts: Mapping[str, str]
    match decoded:
        case Ended(state=state, detail=why, result=result) if (
            state in _FAILED or result == "on_error"
        ):
            kind, at = "run.ended", decoded.at
            facts = {"state": _FAILED.get(state, "an error"), "why": why}
        case AlarmRaised(code=code, text=why) if code == _UNCONFIRMED:
            kind, at, facts = "run.stop_unconfirmed", decoded.at, {"why": why}
        case Held(by=None, why=why):
            kind, at, facts = "run.held", decoded.at, {"why": why}
        case PieceRest(asks=True):
            why = f"{decoded.node} on {decoded.engine} has ended, and a person has to say how."
            kind, at, facts = "run.held", decoded.at, {"why": why}
        # One that nobody answers is asked again each minute.
        case QuestionAsked(asks=asks, again=""):
            kind, at, facts = "answer.asked", decoded.at, {"why": asks.text}
        case _:
            return []
    chosen = run.c.id == event.stream.removeprefix(stream_of(""))
    return _statements(event, receivers, kind, at, facts, chosen)


def _statements(
    event: Event,
    receivers: Sequence[Receiver],
    kind: str,
    at: int,
    facts: Mapping[str, str],
    chosen: Any,
) -> list[Executable]:
    """Return one statement for each receiver of messages of `kind`; it inserts the message about
    `event` into the outbox. `at`: the time of the event (µs UTC). `chosen`: the SQL condition that
    selects the run of the message, whose name, number and robots are added; None for a message
    about no run."""
    found: list[Executable] = []
    for each in receivers:
        if kind not in each.kinds:
            continue
        written = func.json_object(
            *(word for pair in facts.items() for word in pair),
            *() if chosen is None else _ABOUT_RUN,
        )
        values = row(id_of(event, each.name), each.name, kind, event.stream, at, written)
        columns: list[Any] = [v if n == "facts" else literal(v) for n, v in values.items()]
        query: Select[Any] = select(*columns)
        if chosen is not None:
            query = query.select_from(run).where(chosen, run.c.simulated.is_(False))
        if kind in _QUIET or event.kind == PieceRest.kind:
            query = query.where(~_was_told(each.name, kind, event.stream, at))
        # One that is there already was written when the event was: its row stays as it is.
        statement = insert(outbox).prefix_with("OR IGNORE").from_select(list(values), query)
        found.append(statement)
    return found


#: All robots of a led run; else the engine.
_ROBOTS: Final = func.coalesce(
    text(
        "(SELECT group_concat(value, ', ') FROM "
        "(SELECT DISTINCT value FROM json_each(run.summary, '$.robots')))"
    ),
    run.c.engine,
)
_ABOUT_RUN: Final = (
    *("run", run.c.id),
    *("number", run.c.number),
    *("graph", run.c.graph_name),
    *("robot", _ROBOTS),
)


def _plays(robot: str) -> Any:
    """Return the condition that a robot plays in a run."""
    inside = func.json_each(run.c.summary, "$.robots").table_valued("value")
    is_in = exists(select(inside.c.value).where(inside.c.value == robot).correlate(run))
    return or_(run.c.engine == robot, is_in)


def _was_told(receiver: str, kind: str, subject: str, at: int) -> Any:
    before = outbox.alias("before")
    return exists(
        select(before.c.id).where(
            before.c.subject == subject,
            before.c.at > at - _QUIET_US,
            before.c.kind == kind,
            before.c.receiver == receiver,
        )
    )
