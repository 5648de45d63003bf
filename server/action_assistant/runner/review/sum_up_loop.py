"""The loop that sums up runs when they have ended, those of earlier processes too."""

import logging
from collections import Counter
from collections.abc import Awaitable, Callable
from typing import Final

import anyio
from sqlalchemy import func, select

from action_assistant.errors import Refused, TooLarge
from action_assistant.runner.analysis import annotations
from action_assistant.runner.archives.archive_store import ArchiveStore
from action_assistant.runner.clock import ClockUs
from action_assistant.runner.review.ongoing_runs import OngoingRun, OngoingRuns
from action_assistant.runner.workers import Crashed
from action_assistant.schema.runner_tables import review, run

log: Final = logging.getLogger(__name__)

_TRIES: Final = 3
_AT_ONCE: Final = 200  # runs summed up between two looks
_CLOCK: Final = 3_600_000_000  # microseconds by which a clock may be set back


class SumUpLoop:
    """Goes on until cancelled. `summed` gives the sum of a run; it may be asked of a worker."""

    def __init__(
        self,
        journal: ArchiveStore,
        ongoing: OngoingRuns,
        clock_us: ClockUs,
        summed: Callable[[str], Awaitable[annotations.SummedUp]],
    ) -> None:
        self._journal = journal
        self._clock_us = clock_us
        self._summed = summed
        self._ended = anyio.Event()
        self._summed_up: int | None = None  # all runs that had ended by then are summed up
        self._tried: Counter[str] = Counter()  # runs whose sums took a worker's life
        ongoing.watch(self._saw)

    def begin_again(self) -> None:
        """Look at all runs anew, at once."""
        self._summed_up = None
        self._ended.set()

    def _saw(self, opened: OngoingRun) -> None:
        if opened.run.end is not None:
            if not opened.recorder.recorded:
                self._summed_up = None  # it may be stored long after it ended
            self._ended.set()

    async def run(self) -> None:
        """Sum up runs that have ended, those of earlier processes too, until cancelled."""
        while True:
            ended, self._ended = self._ended, anyio.Event()
            try:
                left = await self._some()
            except Refused as refused:
                log.warning("runs cannot be summed up now: %s", refused.detail)
                await anyio.sleep(5)
                continue
            if left:
                continue
            if ended.is_set():  # its last events may still be on their way to the journal
                await anyio.sleep(0.2)
                continue
            await self._ended.wait()

    async def _some(self) -> bool:
        """Sum up the newest runs that are over and are not yet. Whether any was."""
        before, since = self._clock_us(), self._summed_up
        figures = func.coalesce(func.json_extract(run.c.summary, "$.figures"), 0)
        done = select(review.c.run).where(
            review.c.run == run.c.id, review.c.summed, figures == annotations.FIGURES
        )
        query = (
            select(run.c.id)
            .where(run.c.archived_at.is_(None), run.c.ended_at > (since or 0), ~done.exists())
            .order_by(run.c.number.desc())
            .limit(_AT_ONCE)
        )
        rows = await self._journal.query(query)
        for row in rows:
            await self._one(row.id)
        if not rows:
            self._summed_up = before - _CLOCK
        return bool(rows)

    async def _one(self, run_id: str) -> None:
        try:
            summed = await self._summed(run_id)
        except Refused as refused:
            self._tried[run_id] += 1
            if self._tried[run_id] < _TRIES or not isinstance(refused, Crashed | TooLarge):
                raise  # it will be, later
            log.error("run %s is left out of sums: %s", run_id, refused.detail)
            summed = annotations.SummedUp(self._clock_us(), {})
        except Exception:  # whatever a run of long ago holds, those that go on are not ended by it
            log.exception("run %s cannot be read; it is left out of sums", run_id)
            summed = annotations.SummedUp(self._clock_us(), {}, figures=annotations.FIGURES)
        await self._journal.append(annotations.stream_about(run_id), [annotations.draft(summed)])
