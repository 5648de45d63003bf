"""Locks of work on derived tables, which two editors must not do at the same time."""

from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import TypeAlias

#: Returns a context in which no other editor does the work with this name.
Exclusively: TypeAlias = Callable[[str], AbstractAsyncContextManager[None]]


@asynccontextmanager
async def alone(_: str) -> AsyncIterator[None]:
    """Return a context at once: there is no other editor."""
    yield
