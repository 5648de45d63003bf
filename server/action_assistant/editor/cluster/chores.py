"""Chores: work for the whole database, which only one of its editors does at a time."""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import Final

from action_assistant.editor.cluster.owners import Here, Owners
from action_assistant.errors import Unavailable

log: Final = logging.getLogger(__name__)

#: The stream whose owner does the chores; nothing is stored in it.
CHORES: Final = "chores"
_LOOK_S: Final = 2.0


@asynccontextmanager
async def done_by_one(
    owners: Owners, doing: Callable[[], AbstractAsyncContextManager[None]]
) -> AsyncIterator[None]:
    """Return a context during which this editor does the chores while it is their owner. `doing`:
    returns a context in which they are done."""

    async def take_turns() -> None:
        while True:
            if await _is_ours(owners):
                try:
                    async with doing():
                        while await _is_ours(owners):  # noqa: ASYNC110 - another process decides
                            await asyncio.sleep(_LOOK_S)
                except Exception:  # whatever it is: they are begun again
                    log.exception("the chores are interrupted")
            await asyncio.sleep(_LOOK_S)

    task = asyncio.create_task(take_turns(), name="chores")
    try:
        yield
    finally:
        task.cancel()
        await asyncio.wait([task])


async def _is_ours(owners: Owners) -> bool:
    try:
        return isinstance(await owners.owner(CHORES), Here)
    except Unavailable:  # it is ending, or its database is away
        return False
