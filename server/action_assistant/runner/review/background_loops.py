"""Work on stored runs that goes on in the background: sums, keyframes, and words of older runs."""

import logging
from collections import Counter
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any, Final, Protocol

import anyio
from sqlalchemy import Connection, func, select

from action_assistant.errors import Refused, TooLarge
from action_assistant.runner.analysis import annotations
from action_assistant.runner.analysis.keyframes import APART
from action_assistant.runner.archives.archive_store import ArchiveStore
from action_assistant.runner.clock import ClockUs
from action_assistant.runner.review.ongoing_runs import OngoingRun, OngoingRuns
from action_assistant.runner.runs.word_index import index_some
from action_assistant.runner.workers import Crashed
from action_assistant.schema.runner_tables import review, run

log: Final = logging.getLogger(__name__)

_RETRY_S: Final = 5.0  # after which the journal is tried again
_SUMMED_AT_ONCE: Final = 200  # runs of one query
_TRIES: Final = 3  # of a run whose sum ends the worker that computes it
_CLOCK_SET_BACK_US: Final = 3_600_000_000  # by which a clock may be set back
_UNKEPT_PART: Final = 8  # one part in so many of a run may be without stored keyframes
_INDEXED_AT_ONCE: Final = 10  # runs in one transaction, which takes milliseconds
_PAUSE_S: Final = 0.05  # between two such transactions


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
                await anyio.sleep(_RETRY_S)
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
            .limit(_SUMMED_AT_ONCE)
        )
        rows = await self._journal.query(query)
        for row in rows:
            await self._one(row.id)
        if not rows:
            self._summed_up = before - _CLOCK_SET_BACK_US
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


def due_after(kept: int) -> int:
    """How many keyframes there have to be until they are kept again. All are written each time, so the
    longer a run the more is waited for: 100,000 events write some 70 MB in all, not 200."""
    return kept + max(1, kept // _UNKEPT_PART)


class KeyframeLoop:
    """Goes on until cancelled. `make` makes and keeps the keyframes of a run; it may be asked of a
    worker."""

    def __init__(self, ongoing: OngoingRuns, make: Callable[[str], Awaitable[object]]) -> None:
        self._make = make
        self._kept: dict[str, int] = {}  # keyframes of runs that go on
        self._due: set[str] = set()
        self._more = anyio.Event()
        ongoing.watch(self._saw)

    def _saw(self, opened: OngoingRun) -> None:
        run, there = opened.run.id, opened.recorder.seq // APART
        if opened.run.end is not None:  # it will be summed up
            self._kept.pop(run, None)
            self._due.discard(run)
        elif there >= due_after(self._kept.get(run, 0)):
            self._kept[run] = there
            self._due.add(run)
            self._more.set()

    async def run(self) -> None:
        """Keep keyframes of runs that go on, until cancelled."""
        while True:
            await self._more.wait()
            self._more = anyio.Event()
            while self._due:
                run = self._due.pop()
                try:
                    await self._make(run)
                except Refused as refused:  # the next ones are made with these
                    log.warning("no keyframes of run %s were kept: %s", run, refused.detail)
                except Exception:  # a cache: what goes on does not end for it
                    log.exception("no keyframes of run %s were kept", run)


class Deriving(Protocol):
    """A journal whose tables may be added to."""

    async def derive(self, work: Callable[[Connection], Any]) -> Any:
        """Write to tables that follow from events. Raises Unavailable."""
        ...


async def index_words(journal: Deriving) -> None:
    """Until the words of all runs are in the index. Raises nothing: the process goes on without."""
    while True:
        try:
            if not await journal.derive(partial(index_some, most=_INDEXED_AT_ONCE)):
                return
        except Refused as refused:
            log.warning("the words of runs cannot be stored now: %s", refused.detail)
            await anyio.sleep(_RETRY_S)
        except Exception:  # such as a damaged row; a search reads what is not in the index
            log.exception("the words of earlier runs are not looked for until the next start")
            return
        await anyio.sleep(_PAUSE_S)
