"""Loops that work on stored runs in the background: sums of ended runs, keyframes of long ones,
words of older ones."""

import logging
from collections import Counter
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Final

import anyio
from sqlalchemy import func, select

from action_assistant.errors import Refused, TooLarge
from action_assistant.journal.journal import Journal
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.analysis import annotations
from action_assistant.runner.analysis.keyframes import APART
from action_assistant.runner.archives.archive_store import ArchiveStore
from action_assistant.runner.runs.recorder import RunRecorder
from action_assistant.runner.runs.run import Run
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
    """Computes and stores the totals of ended runs, for lists and statistics. `summed` computes the
    event with them for a run, given its id and the present time in microseconds UTC."""

    def __init__(
        self,
        journal: ArchiveStore,
        clock_us: ClockUs,
        summed: Callable[[str, int], Awaitable[annotations.SummedUp]],
    ) -> None:
        self._journal = journal
        self._clock_us = clock_us
        self._summed = summed
        self._ended = anyio.Event()
        self._summed_up: int | None = None  # all runs that had ended by then have their sums
        self._tried: Counter[str] = Counter()  # how often the sum of a run ended its worker

    def begin_again(self) -> None:
        """Examine all runs again, starting at once; the call does not wait."""
        self._summed_up = None
        self._ended.set()

    def run_changed(self, run: Run, recorder: RunRecorder) -> None:
        """Call this when an open run has changed: if it has ended, its totals are computed soon.
        `recorder`: the recorder of the run."""
        if run.end is not None:
            if not recorder.recorded:
                self._summed_up = None  # its end may be stored much later
            self._ended.set()

    async def run(self) -> None:
        """Compute the totals of ended runs, also of runs of earlier processes, until cancelled."""
        while True:
            ended, self._ended = self._ended, anyio.Event()
            try:
                left = await self._some()
            except Refused as refused:
                log.warning("runs cannot be summed up now: %s", refused.detail)
                await anyio.sleep(_RETRY_S)
                continue
            except Exception:  # sums are for people: without them the runner goes on
                log.exception("runs cannot be summed up now")
                await anyio.sleep(_RETRY_S)
                continue
            if left:
                continue
            if ended.is_set():  # its last events may not be stored yet
                await anyio.sleep(0.2)
                continue
            await self._ended.wait()

    async def _some(self) -> bool:
        """Compute and store the totals of the newest ended runs that have none; return whether
        there were any."""
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
            summed = await self._summed(run_id, self._clock_us())
        except Refused as refused:
            self._tried[run_id] += 1
            if self._tried[run_id] < _TRIES or not isinstance(refused, Crashed | TooLarge):
                raise  # it is tried again later
            log.error("run %s is left out of sums: %s", run_id, refused.detail)
            summed = annotations.SummedUp(self._clock_us(), {})
        except Exception:  # a damaged run must not end the runner
            log.exception("run %s cannot be read; it is left out of sums", run_id)
            summed = annotations.SummedUp(self._clock_us(), {}, figures=annotations.FIGURES)
        await self._journal.append(annotations.stream_about(run_id), [annotations.draft(summed)])


def due_after(stored: int) -> int:
    """Return the number of keyframes at which a run's keyframes are stored again, after `stored` of
    them were stored. All are written each time, so the interval grows: 100,000 events write some 70
    MB in all, not 200."""
    return stored + max(1, stored // _UNKEPT_PART)


class KeyframeLoop:
    """Stores keyframes of long runs while they go on, so that they need not be folded from the
    start after a crash. `make` makes and stores the keyframes of a run."""

    def __init__(self, make: Callable[[str], Awaitable[object]]) -> None:
        self._make = make
        self._kept: dict[str, int] = {}  # by open run: how many of its keyframes are stored
        self._due: set[str] = set()
        self._wake = anyio.Event()

    def run_changed(self, run: Run, recorder: RunRecorder) -> None:
        """Call this when an open run has changed: if it has grown enough, its keyframes are stored
        soon. `recorder`: the recorder of the run."""
        count = recorder.seq // APART
        if run.end is not None:  # its sum makes its keyframes
            self._kept.pop(run.id, None)
            self._due.discard(run.id)
        elif count >= due_after(self._kept.get(run.id, 0)):
            self._kept[run.id] = count
            self._due.add(run.id)
            self._wake.set()

    async def run(self) -> None:
        """Store keyframes that are due, until cancelled."""
        while True:
            await self._wake.wait()
            self._wake = anyio.Event()
            while self._due:
                run = self._due.pop()
                try:
                    await self._make(run)
                except Refused as refused:  # they are made together with the next ones
                    log.warning("no keyframes of run %s were stored: %s", run, refused.detail)
                except Exception:  # keyframes are a cache: without them the runner goes on
                    log.exception("no keyframes of run %s were stored", run)


async def index_words(journal: Journal) -> None:
    """Index the words of old runs for the search, in batches, until all are indexed. Wait and retry
    while the journal is unavailable; no error is raised, since a search reads unindexed runs."""
    while True:
        try:
            if not await journal.derive(partial(index_some, most=_INDEXED_AT_ONCE)):
                return
        except Refused as refused:
            log.warning("the words of runs cannot be stored now: %s", refused.detail)
            await anyio.sleep(_RETRY_S)
        except Exception:  # such as a damaged row; a search reads what is not in the index
            log.exception(
                "the words of earlier runs are not indexed until the next start of the runner"
            )
            return
        await anyio.sleep(_PAUSE_S)
