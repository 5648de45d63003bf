"""The loop that keeps keyframes of long runs while they go on.

When a runner dies, what had happened by then need not be folded anew by whoever looks at the run first.
"""

import logging
from collections.abc import Awaitable, Callable
from typing import Final

import anyio

from action_assistant.errors import Refused
from action_assistant.runner.analysis.keyframes import APART
from action_assistant.runner.review.ongoing_runs import OngoingRun, OngoingRuns

log: Final = logging.getLogger(__name__)

_PART: Final = 8  # of what there is, which may be left to fold


def due_after(kept: int) -> int:
    """How many keyframes there have to be until they are kept again. All are written each time, so the
    longer a run the more is waited for: 100,000 events write some 70 MB in all, not 200."""
    return kept + max(1, kept // _PART)


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
