"""The entries that an earlier process, maybe of another version, has left in the log."""

import logging
from typing import Any, Final

import msgspec

from action_assistant.errors import Refused
from action_assistant.journal.events import Event
from action_assistant.runner.queues.entry import (
    Looked,
    QueueEntered,
    QueueLeft,
    QueueStartKept,
    kept_in,
    require_as_asked,
    stream_of,
)
from action_assistant.runner.queues.robot_queue import Entry
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.history import RunnerJournal
from action_assistant.runner.start.admission import StartRequest

log: Final = logging.getLogger(__name__)

_UNREADABLE: Final = "It cannot be read: another version of this program has stored it."


async def read_entries(journal: RunnerJournal) -> list[Entry]:
    """Return the entries that have not left the queue, the oldest first. One that cannot be started says
    why. Raise Unavailable if the journal cannot be read."""
    found: list[Entry] = []
    for row in await journal.query(queries.waiting(QueueStartKept.kind, QueueLeft.kind)):
        if row.kind != QueueEntered.kind:
            continue
        try:
            entered = msgspec.json.decode(row.body, type=QueueEntered)
        except msgspec.DecodeError:
            log.exception("%s cannot be read", row.stream)
            found.append(Entry(_unreadable(row), obstacle=_UNREADABLE))
            continue
        kept = await journal.read(stream_of(entered.entry))
        found.append(Entry(entered, obstacle=_obstacle(entered, kept)))
    return found


def start_in(entered: QueueEntered, kept: list[Event]) -> StartRequest:
    """Return the one start of an entry, out of the events of its stream. Raise Conflict for what cannot be
    started, Unavailable if it cannot be read."""
    start = kept_in(kept)
    require_as_asked(entered, start)
    return start


def _obstacle(entered: QueueEntered, kept: list[Event]) -> str:
    try:
        start_in(entered, kept)
    except Refused as why:
        log.error("%s cannot be started: %s", stream_of(entered.entry), why.detail)
        return why.detail
    return ""


def _unreadable(row: Any) -> QueueEntered:
    """Return what the log itself says of an entry, by a row of it. Nobody knows its graphs, so only its
    person and owners see more of it."""
    return QueueEntered(
        at=row.at,
        entry=row.stream.removeprefix(stream_of("")),
        request_id="",
        order="",
        author=Author(row.author, ""),
        graph=None,
        graph_name="a start that cannot be read",
        version="",
        digest="",
        engine="",
        robots=(),
        seen=Looked({}),
        unsighted=True,
    )
