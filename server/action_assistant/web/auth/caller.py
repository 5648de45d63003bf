"""Tracks the client for whom a task works, so that the work can be cancelled when the client disconnects.

Imported by workers too, so it imports little.
"""

from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVarTuple, Unpack

import anyio
from anyio.abc import TaskGroup

from action_assistant.errors import Refused

if TYPE_CHECKING:
    from litestar.types import Receive


class Caller(NamedTuple):
    """Identifies the client for whom a request works, so that abandoned work can be cancelled.

    `device`: the id of the browser, whoever is signed in; "" if unknown.
    """

    person: str
    receive: "Receive | None" = None  # a socket's messages are not ours to read
    device: str = ""

    async def gone(self) -> None:
        """Wait until the client has disconnected. Call it only after the request body was read."""
        if self.receive is None:
            await anyio.sleep_forever()
        else:
            try:
                while (await self.receive())["type"] != "http.disconnect":
                    pass
            except Refused:  # nothing more can be read of them
                pass


_Values = TypeVarTuple("_Values")

_CALLER: Final[ContextVar[Caller | None]] = ContextVar("caller", default=None)


def caller() -> Caller | None:
    """Return the client for whom this task works; None if the task works for no client."""
    return _CALLER.get()


def device() -> str:
    """Return the id of the browser for which this task works; "" if unknown."""
    asking = _CALLER.get()
    return "" if asking is None else asking.device


def set_caller(asking: Caller | None) -> None:
    """Set the client for whom this task works from now on."""
    _CALLER.set(asking)


def outlive_connection() -> None:
    """Let this task continue after the end of the connection for which it was started. It still
    counts for its person."""
    asking = _CALLER.get()
    _CALLER.set(None if asking is None else asking._replace(receive=None))


@contextmanager
def acting_for(person: str) -> Iterator[None]:
    """Set the person for whom the work inside the block is done."""
    token = _CALLER.set(Caller(person))
    try:
        yield
    finally:
        _CALLER.reset(token)


def detach_from_request() -> None:
    """Detach this task, and those that it starts, from the request in which it was started."""
    _CALLER.set(None)


class BackgroundTasks:
    """Starts tasks that outlive the request in which they begin.

    A task inherits the caller of the code that starts it. When the request of that caller ends, a
    worker would refuse the task, and the error would end the whole group. So services that live as
    long as their process get this instead of a TaskGroup.
    """

    def __init__(self, tasks: TaskGroup) -> None:
        self._tasks = tasks

    def start_soon(
        self,
        work: Callable[[Unpack[_Values]], Coroutine[object, object, object]],
        *values: *_Values,
    ) -> None:
        """Start a task without a caller."""
        token = _CALLER.set(None)
        try:
            self._tasks.start_soon(work, *values)
        finally:
            _CALLER.reset(token)
