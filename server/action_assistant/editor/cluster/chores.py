"""Chores: work that one of all editors does, for the whole database."""

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
    """Return a context during which this editor does the chores for as long as it is the one that does
    them. `doing`: returns a context in which they are done."""

    async def take_turns() -> None:
        while True:
            if await _is_ours(owners):
                try:
                    async with doing():
                        while await _is_ours(owners):  # noqa: ASYNC110 - another process decides
                            await asyncio.sleep(_LOOK_S)
                except Exception:  # they are begun again
                    log.exception("what is done once is interrupted")
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
