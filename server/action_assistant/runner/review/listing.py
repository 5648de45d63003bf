"""The list of runs and the stored events of one, page by page. For workers."""

from collections.abc import Awaitable, Callable, Mapping, Sequence
from datetime import datetime
from typing import Any, Final

import msgspec
from sqlalchemy import Row, Select

from action_assistant.journal.events import Event
from action_assistant.runner.review.stored_runs import StoredRuns
from action_assistant.runner.runs import queries, views, word_index

_PAGE: Final = 500  # events read at once


class HistoryEvent(msgspec.Struct, frozen=True):
    """One stored event, for programs that follow a run."""

    seq: int
    kind: str
    author: str
    at: datetime
    body: msgspec.Raw


async def listed(
    stored_runs: StoredRuns,
    wanted: queries.Filter,
    limit: int,
    open_runs: Mapping[str, views.RunSummary],
) -> list[views.Listed]:
    """Return runs, newest first. `open_runs`: summaries of open runs by id, which the tables do not
    have."""
    among = None if wanted.text is None else await numbers_with(wanted.text, stored_runs.rows)
    rows = await stored_runs.rows(queries.listed(wanted, limit, among))
    labels = await _labels(stored_runs, rows)
    shown = (
        views.list_entry(
            open_runs.get(row.id) or views.summary_of_row(row), row, labels.get(row.id, [])
        )
        for row in rows
    )
    return [each for each in shown if not wanted.states or each.state in wanted.states]


async def numbers_with(
    text: str, rows: Callable[[Select[Any]], Awaitable[Sequence[Row[Any]]]]
) -> set[int] | None:
    """Return the numbers of all runs that may contain a text; None if there may be very many."""
    pieces = word_index.pieces(text)
    late = await rows(word_index.unindexed()) if pieces else []
    for piece in pieces if len(late) <= word_index.MOST else []:
        found = await rows(word_index.holding(piece))
        if len(found) <= word_index.MOST:
            # a run is also found by its whole number
            own = {int(text)} if text.isascii() and text.isdecimal() and len(text) < 19 else set()
            return {row.number for row in (*found, *late)} | own
    return None


async def _labels(stored_runs: StoredRuns, rows: Sequence[Row[Any]]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    if rows:
        for row in await stored_runs.rows(queries.labels_of([row.id for row in rows])):
            found.setdefault(row.run, []).append(row.label)
    return found


async def streamed(stored_runs: StoredRuns, run: str, after: int) -> tuple[int, bytes]:
    """Return a page of stored events in the format of an event stream, and the seq of the last
    one."""
    events = await stored_runs.events(run, after, _PAGE)
    lines = [
        b"id: %d\nevent: %b\ndata: %b\n\n" % (each.seq, each.kind.encode(), _event_json(each))
        for each in events
    ]
    return events[-1].seq if events else after, b"".join(lines)


def _event_json(event: Event) -> bytes:
    at, body = views.time(event.at), msgspec.Raw(event.body)
    return msgspec.json.encode(HistoryEvent(event.seq, event.kind, event.author, at, body))
