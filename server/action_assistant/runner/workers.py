"""The runner's workers: whatever may take long happens in them, so that the runner is free for Stop."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any, Final

from anyio import CapacityLimiter

from action_assistant.web.workers import lanes as workers
from action_assistant.web.workers.lanes import Crashed, Lane, kept_warm

if TYPE_CHECKING:  # not on Windows
    from multiprocessing.context import ForkServerProcess

__all__ = ["Crashed", "Lane", "RunnerWorkers", "child"]

#: What the server process has imported before it forks anybody.
_PRELOADED: Final = (
    "action_assistant.runner.execution.start_pipeline",
    "action_assistant.runner.links.simulated",
    "action_assistant.runner.review.worker_queries",
)
_NICE: Final = 5  # somebody waits for a start
_NICER: Final = 10


class RunnerWorkers:
    """The lanes of a runner. `starts`: what stands between a person and a start, and what goes on
    with runs. `looks`: everything that is looked back on, which may take long. `ours`: what the runner
    itself has to know, behind nobody."""

    def __init__(self) -> None:
        threads = CapacityLimiter(8)
        self.starts: Final = Lane("starts", 2, 20.0, _NICE, threads, _PRELOADED)
        self.looks: Final = Lane("looks", 2, 60.0, _NICER, threads, _PRELOADED)
        self.ours: Final = Lane("ours", 1, 60.0, 0, CapacityLimiter(2), _PRELOADED)

    @classmethod
    @asynccontextmanager
    async def opened(cls) -> "AsyncIterator[RunnerWorkers]":
        """Workers, as long as you are inside. The first ones are made soon after."""
        lanes = cls()
        async with kept_warm(lanes.starts, lanes.looks, lanes.ours):
            yield lanes


def child(work: Callable[..., None], *args: Any, name: str, nice: int) -> "ForkServerProcess":
    """A process of low priority that ends with this one, in which `work(*args)` runs. Waits for it
    to exist. Raises OSError, EOFError."""
    return workers.child(work, *args, name=name, nice=nice, preloaded=_PRELOADED)
