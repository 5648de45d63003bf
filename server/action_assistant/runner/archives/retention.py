"""Moves old runs and raw messages to archives, which are read back and verified before anything is
deleted.

A run goes in four steps, each of which may be the last before a crash: its archive is written under
another name; it is verified and renamed; the log records where the events are kept; the events are
deleted, some at a time. So every event is in the log, or in an archive that is complete.
"""

import logging
from collections.abc import Callable
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, Final

import anyio
import msgspec
from sqlalchemy import ColumnElement, Row, Select, exists, literal, or_, select

from action_assistant.errors import Conflict, Refused
from action_assistant.journal.events import Addition
from action_assistant.journal.removal import StreamRemoved
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.analysis import annotations
from action_assistant.runner.archives import archive_file
from action_assistant.runner.archives.archive_store import Journaled
from action_assistant.runner.archives.raw_messages import RawArchived, stream_of_raw
from action_assistant.runner.robots.recordings import Recordings
from action_assistant.runner.runs import queries, views
from action_assistant.runner.runs.events import draft_of
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.schema.runner_tables import review, run, runner_event
from action_assistant.settings import Keep
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_DAY_US: Final = 86_400_000_000
_EVERY_S: Final = 3_600.0
_PAUSE_S: Final = 0.02  # between two steps, for other work of the journal
_PAGE: Final = 500
_AT_ONCE: Final = 20


class SweepResult(msgspec.Struct, frozen=True, kw_only=True):
    """The result of a sweep: numbers of archived runs and hours of raw messages. `more`: others are
    due; `problems`: what could not be archived, and why."""

    runs: int = 0
    raw: int = 0
    more: bool = False
    problems: list[str] = []


class Retention:
    """Archives old runs and raw messages. No run ever waits for it."""

    def __init__(
        self,
        journal: Journaled,
        recordings: Recordings | None,
        keep: Keep,
        *,
        is_open: Callable[[str], bool],
        clock_us: ClockUs,
        run_in_worker: RunInWorker,
    ) -> None:
        self.keep = keep
        self._journal = journal
        self._recordings = recordings
        self._is_open = is_open
        self._clock_us = clock_us
        self._run_in_worker = run_in_worker
        self._one = anyio.Lock()
        self._may_be_unfinished = True  # an earlier process may have ended between two steps

    async def run(self) -> None:
        """Sweep every hour until cancelled, and again at once while more is due."""
        while True:
            try:
                swept = await self.sweep(self.keep.runs, self.keep.raw)
            except Refused as refused:
                swept = SweepResult(problems=[refused.detail])
            except Exception as error:  # a fault in these folders must not end the runner
                log.exception("old runs and messages cannot be archived")
                swept = SweepResult(problems=[str(error)])
            for problem in swept.problems:
                log.warning("%s", problem)
            if not swept.more or swept.problems:
                await anyio.sleep(_EVERY_S)

    async def sweep(self, run_days: float | None, raw_days: float | None) -> SweepResult:
        """Archive a batch of the runs and raw messages that are older than so many days; None keeps
        them all. Raise Unavailable if the journal cannot be read or written."""
        async with self._one:
            await self._finish()
            found = SweepResult()
            if raw_days is not None:
                found = await self._sweep_raw(raw_days)
            if run_days is None:
                return found
            before = self._clock_us() - round(run_days * _DAY_US)
            rows = await self._journal.query(_due(before, _AT_ONCE + 1))
            problems = list(found.problems)
            done = 0
            for row in rows[:_AT_ONCE]:
                if self._is_open(row.id):
                    continue
                try:
                    await self._archive_run(row)
                    done += 1
                except (Refused, OSError) as why:
                    detail = why.detail if isinstance(why, Refused) else str(why)
                    problems.append(f"Run {row.number} stays here: {detail}")
            more = len(rows) > _AT_ONCE and done > 0
            return SweepResult(runs=done, raw=found.raw, more=more, problems=problems)

    async def _archive_run(self, row: Row[Any]) -> None:
        """Archive the ended run of this table row, with its pieces if it is a led run. Raise
        Conflict if a piece moves again, or Refused or OSError if archiving fails; its events then
        stay in the journal."""
        pieces = [
            each.stream.removeprefix("run/")
            for each in await self._journal.query(queries.streams_of_pieces(row.id))
        ]
        for each in pieces:
            if self._is_open(each):
                raise Conflict("One of its actions moves again.")
        removed, *parts = [
            await self._written(each, _place(row, each)) for each in (row.id, *pieces)
        ]
        at = self._clock_us()

        def recorded(by: int) -> Addition:
            """Return the event of the archived run, whose pieces are numbered after `by`."""
            archived = annotations.RunArchived(
                at,
                removed.kept,
                removed.sha256,
                by,
                _fields(row),
                tuple(
                    annotations.ArchivedPiece(
                        run=run, file=each.kept, sha256=each.sha256, by=number
                    )
                    for number, (run, each) in enumerate(zip(pieces, parts, strict=True), by + 1)
                ),
            )
            return Addition(annotations.stream_about(row.id), (annotations.draft(archived),))

        if await self._journal.query(_kept(row.id)):
            raise Conflict("Somebody has pinned it, or keeps it as an incident, meanwhile.")
        self._may_be_unfinished = True
        by = await self._journal.take_out(removed, recorded, parts=parts)
        for number, each in enumerate((removed, *parts), by):
            await self._clear(each.stream, number)
        self._may_be_unfinished = False

    async def _written(self, run_id: str, place: str) -> StreamRemoved:
        """Write the archive file of a run or piece, with pauses so that others can work, and return
        the record of it that removes the stream. `place`: the path in the folder of archives."""
        stream = stream_of(run_id)
        end = await self._journal.end(stream)
        path = self.keep.folder / place
        written = await self._run_in_worker(
            lambda: archive_file.ArchiveFile(path, stream, place, end)
        )
        try:
            after = 0
            while events := await self._journal.read(stream, after=after, limit=_PAGE):
                await self._run_in_worker(partial(written.add, events))
                after = events[-1].seq
                await anyio.sleep(_PAUSE_S)
            digest = await self._run_in_worker(written.close)
        finally:
            written.abandon()
        return StreamRemoved(stream, end.seq, end.chain.hex(), place, digest)

    async def _clear(self, stream: str, by: int) -> None:
        left = True
        while left:
            left = await self._journal.delete_some(stream, by)
            await anyio.sleep(_PAUSE_S)

    async def _finish(self) -> None:
        """Delete events that an earlier process recorded as archived, but did not delete."""
        if not self._may_be_unfinished:
            return
        for row in await self._journal.query(_unfinished()):
            events = await self._journal.read(annotations.stream_about(row.id))
            archived = next(
                event for event in reversed(events) if event.kind == annotations.RunArchived.kind
            )
            gone = msgspec.json.decode(archived.body, type=annotations.RunArchived)
            await self._clear(stream_of(row.id), gone.by)
            for piece in gone.pieces:
                await self._clear(stream_of(piece.run), piece.by)
        self._may_be_unfinished = False

    # --- raw messages -------------------------------------------------------------------------

    async def _sweep_raw(self, days: float) -> SweepResult:
        recordings = self._recordings
        if recordings is None:
            return SweepResult()
        problems: list[str] = []
        done = 0
        for path in await self._run_in_worker(lambda: recordings.due(days)):
            try:
                await self._archive_raw(path)
                done += 1
            except (Refused, OSError) as why:
                detail = why.detail if isinstance(why, Refused) else str(why)
                problems.append(f"Raw messages {path.parent.name}/{path.name} stay here: {detail}")
            await anyio.sleep(_PAUSE_S)
        return SweepResult(raw=done, problems=problems)

    async def _archive_raw(self, path: Path) -> None:
        robot = path.parent.name
        file = f"raw/{robot}/{path.name}"
        target = self.keep.folder / file
        size = (await anyio.Path(path).stat()).st_size
        digest = await self._run_in_worker(lambda: archive_file.put(path, target))
        archived = RawArchived(self._clock_us(), robot, path.name, file, size, digest)
        await self._journal.append(stream_of_raw(robot), [draft_of(archived)])
        await self._run_in_worker(path.unlink)


def _due(before: int, most: int) -> Select[Any]:
    """Return the query for at most `most` runs that ended before the time `before` (µs UTC), are
    summed up and not pinned; oldest first."""
    return (
        select(run)
        .join(review, review.c.run == run.c.id)
        .where(
            run.c.archived_at.is_(None),
            run.c.ended_at < before,
            review.c.summed,
            or_(review.c.pinned.is_(None), ~review.c.pinned),
            ~is_incident(run.c.id),
        )
        .order_by(run.c.ended_at)
        .limit(most)
    )


def _kept(run_id: str) -> Select[Any]:
    """Return the query that finds a run (by id) if it is never archived: it is pinned, or kept as
    an incident."""
    pinned = exists().where(review.c.run == run.c.id, review.c.pinned)
    return select(run.c.id).where(run.c.id == run_id, or_(pinned, is_incident(run.c.id)))


def is_incident(run_id: ColumnElement[str]) -> ColumnElement[bool]:
    """Return the SQL condition that an owner keeps the run as an incident, by the events about it."""
    stream = literal(annotations.stream_about("")) + run_id
    event = runner_event.c
    return exists().where(event.stream == stream, event.kind == annotations.IncidentKept.kind)


def _unfinished() -> Select[Any]:
    here = exists().where(runner_event.c.stream == literal("run/") + run.c.id)
    pieces = queries.streams_of_pieces(run.c.id).exists()
    return select(run.c.id).where(run.c.archived_at.is_not(None), or_(here, pieces))


def _place(row: Row[Any], run_id: str) -> str:
    """Return the path, in the folder of archives, of the file for the events of a run, or of a
    piece of it (`run_id`). `row`: the row of the run."""
    ended: datetime = views.time(row.ended_at)
    return f"runs/{ended:%Y-%m}/run-{row.number:06d}-{run_id}.jsonl.gz"


def _fields(row: Row[Any]) -> dict[str, Any]:
    kept = set(run.c.keys()) - {"id", "archived_at", "archived_as"}
    return {name: value for name, value in row._asdict().items() if name in kept}
