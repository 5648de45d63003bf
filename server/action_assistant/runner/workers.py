"""The runner's worker processes: they compute whatever takes long, so that the event loop stays
free for Stop."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any, Final

from anyio import CapacityLimiter

from action_assistant.web.workers import lanes as workers
from action_assistant.web.workers.lanes import Crashed, Lane, opened

if TYPE_CHECKING:  # not on Windows
    from multiprocessing.context import ForkServerProcess

__all__ = ["Crashed", "Lane", "RunnerWorkers", "child", "prepare_workers"]

#: Modules that the fork server imports before it makes workers.
_PRELOADED: Final = (
    "action_assistant.runner.execution.start_pipeline",
    "action_assistant.runner.links.simulated",
    "action_assistant.runner.review.worker_queries",
)
_NICE: Final = 5  # nice values: of lanes that a person waits for, and of others
_NICER: Final = 10


def prepare_workers() -> None:
    """Fork the fork server of the runner's workers: at the start, before there are threads, data or
    sockets."""
    workers.start_fork_server(_PRELOADED)


class RunnerWorkers:
    """The pools of worker processes of a runner. `starts`: for the stages of starts, and the work
    of open runs. `looks`: for questions about stored runs, which may take long. `ours`: for
    questions of the runner itself, which wait behind no others."""

    def __init__(self) -> None:
        threads = CapacityLimiter(8)
        self.starts: Final = Lane("starts", 2, 20.0, _NICE, threads, _PRELOADED)
        self.looks: Final = Lane("looks", 2, 60.0, _NICER, threads, _PRELOADED)
        self.ours: Final = Lane("ours", 1, 60.0, 0, CapacityLimiter(2), _PRELOADED)

    @classmethod
    @asynccontextmanager
    async def opened(cls) -> "AsyncIterator[RunnerWorkers]":
        """Return a context with the pools, whose workers are made when they are needed."""
        lanes = cls()
        async with opened(lanes.starts, lanes.looks, lanes.ours):
            yield lanes


def child(work: Callable[..., None], *args: Any, name: str, nice: int) -> "ForkServerProcess":
    """Start a process of low priority that runs `work(*args)` and ends with this one; wait until it
    exists. Raise OSError or EOFError if it cannot be started."""
    return workers.child(work, *args, name=name, nice=nice, preloaded=_PRELOADED)
