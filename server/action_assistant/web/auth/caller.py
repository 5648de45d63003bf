"""Who waits for what a task does; what is done for nobody may end."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Final, NamedTuple

import anyio
from litestar.types import Receive


class Caller(NamedTuple):
    """Who waits for what is being done now. What is done for nobody may end."""

    person: str
    receive: Receive | None = None  # a socket's messages are not ours to read

    async def gone(self) -> None:
        """Wait until they have gone. Only after the request was read."""
        if self.receive is None:
            await anyio.sleep_forever()
        else:
            while (await self.receive())["type"] != "http.disconnect":
                pass


_CALLER: Final[ContextVar[Caller | None]] = ContextVar("caller", default=None)


def caller() -> Caller | None:
    """Whoever asked for what this task does; None when nobody did."""
    return _CALLER.get()


def called_by(person: Caller | None) -> None:
    """From here on what this task does is done for them."""
    _CALLER.set(person)


def done_for_person() -> None:
    """From here on this task goes on also when the connection ends that it was begun for."""
    asking = _CALLER.get()
    _CALLER.set(None if asking is None else Caller(asking.person))


@contextmanager
def acting_for(person: str) -> Iterator[None]:
    """What is asked for inside is asked for by this person."""
    token = _CALLER.set(Caller(person))
    try:
        yield
    finally:
        _CALLER.reset(token)


def done_for_nobody() -> None:
    """From here on this task, and those that it begins, go on for themselves."""
    _CALLER.set(None)
