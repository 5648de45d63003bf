"""A question that may get no answer: asked once however many want to know, and never waited for
without end."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class SharedCheck(Generic[T]):
    """`ask` is asked again when its answer is `fresh` seconds old; who wants one waits for `patience`
    seconds at most. A question without an answer stays under way: what hangs is not asked twice."""

    def __init__(
        self, ask: Callable[[], Awaitable[T]], *, patience: float, fresh: float = 1.0
    ) -> None:
        self._ask = ask
        self._patience = patience
        self._fresh = fresh
        self._task: asyncio.Task[T] | None = None
        self._answered_at = 0.0

    async def answer(self) -> T | None:
        """The answer; None when there is none in time. Raises what `ask` raises."""
        loop = asyncio.get_running_loop()
        task = self._task
        if task is None or (task.done() and loop.time() - self._answered_at > self._fresh):
            task = self._task = loop.create_task(self._asked())
        done, _ = await asyncio.wait({task}, timeout=self._patience)
        return task.result() if done else None

    async def _asked(self) -> T:
        try:
            return await self._ask()
        finally:
            self._answered_at = asyncio.get_running_loop().time()

    def cancel(self) -> None:
        """Nobody will ask any more."""
        if self._task is not None:
            self._task.cancel()
