"""A question that may get no answer: asked once however many want to know, and never waited for
without end."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class SharedCheck(Generic[T]):
    """Calls the async function `ask` once for many callers. An answer is reused for `fresh`
    seconds; a caller waits for at most `patience` seconds. A call that hangs is not repeated."""

    def __init__(
        self, ask: Callable[[], Awaitable[T]], *, patience: float, fresh: float = 1.0
    ) -> None:
        self._ask = ask
        self._patience = patience
        self._fresh = fresh
        self._task: asyncio.Task[T] | None = None
        self._asked_at = self._answered_at = 0.0
        self._last: tuple[T, float, float] | None = None

    async def answer(self) -> T | None:
        """Return the answer of `ask`, which may be a fresh earlier one; None if it does not come
        within `patience` seconds. Raise the errors of `ask`."""
        task = self.begin()
        done, _ = await asyncio.wait({task}, timeout=self._patience)
        return task.result() if done else None

    def begin(self) -> "asyncio.Task[T]":
        """Call `ask` without waiting, unless a call is running or the last answer is fresh. Return
        the task whose result is the answer."""
        loop = asyncio.get_running_loop()
        task = self._task
        if task is None or (task.done() and loop.time() - self._answered_at > self._fresh):
            task = self._task = loop.create_task(self._asked())
            task.add_done_callback(_fetch_exception)
            self._asked_at = loop.time()
        return task

    @property
    def last(self) -> tuple[T, float, float] | None:
        """Return the last answer, its age and the time that it took, both in seconds. Return None
        before the first answer."""
        if self._last is None:
            return None
        answer, at, took = self._last
        return answer, asyncio.get_running_loop().time() - at, took

    @property
    def under_way(self) -> float | None:
        """Return for how many seconds the present call has been running; None if none is."""
        if self._task is None or self._task.done():
            return None
        return asyncio.get_running_loop().time() - self._asked_at

    @property
    def failure(self) -> BaseException | None:
        """Return the exception of the last call; None if it has an answer or is running."""
        task = self._task
        return (
            task.exception() if task is not None and task.done() and not task.cancelled() else None
        )

    async def _asked(self) -> T:
        loop = asyncio.get_running_loop()
        begun = loop.time()
        try:
            answer = await self._ask()
            self._last = answer, loop.time(), loop.time() - begun
            return answer
        finally:
            self._answered_at = loop.time()

    def cancel(self) -> None:
        """Cancel the running call of `ask`, if there is one. Call this when its answer is not
        needed any more."""
        if self._task is not None:
            self._task.cancel()


def _fetch_exception(task: "asyncio.Task[T]") -> None:
    """Fetch the exception of an ended task, so that asyncio does not warn where no caller waits for
    it any more; `failure` reports it."""
    if not task.cancelled():
        task.exception()
