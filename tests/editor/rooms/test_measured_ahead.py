"""The opening time of a document is measured while edits go on."""

import asyncio
from collections.abc import Callable
from typing import Any

from action_assistant.editor.crdt import messages
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Unavailable
from action_assistant.journal.journal import Journal
from editor.test_nobody_waits import page_edit


async def test_a_document_is_measured_before_an_edit_has_to_wait_for_that(journal: Journal) -> None:
    """Edits go on meanwhile; one that fails is not tried again at once, and harms nobody."""
    measured, go_on = 0, asyncio.Event()

    async def slowly(work: Callable[..., Any], *values: Any) -> Any:
        nonlocal measured
        assert values[1] == messages.NOTHING_NEW, "an edit was tried first"
        measured += 1
        await go_on.wait()
        raise Unavailable("for a test")

    rooms = Rooms(journal, linger=60, window=0, tried=slowly)
    async with rooms.enter("graph/g") as room:
        n = 0
        while not measured:
            await room.submit(page_edit(n), "ada")
            n += 1
        for more in range(n, n + 50):
            await room.submit(page_edit(more), "ada")
        go_on.set()
        for more in range(n + 50, n + 100):
            await room.submit(page_edit(more), "ada")
        assert room.seq == n + 100
    await rooms.close()
    assert measured == 1
