"""People who edit while the server works out an edit of its own, at moments that a test chooses."""

import asyncio
import copy
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

import pytest
from pycrdt import Doc, Map

from action_assistant.editor.documents.document import Maps, maps_of
from action_assistant.editor.rooms.room import Room

_SUBMIT: Final = Room.submit


class Page:
    """A person who has a graph open. `client`: of two who set a key at once, the higher one wins."""

    def __init__(self, room: Room, author: str, client: int) -> None:
        self._room = room
        self._author = author
        self._client = client

    async def set(self, root: str, key: str, value: str) -> "asyncio.Task[int]":
        """Give a key a value; the edit is acknowledged when the task is done."""
        doc: Doc[Any] = Doc(client_id=self._client)
        doc.apply_update((await self._room.now()).state)
        before = doc.get_state()
        shared: Map[Any] = doc.get(root, type=Map)
        shared[key] = value
        sent = asyncio.create_task(_SUBMIT(self._room, doc.get_update(before), self._author))
        await asyncio.sleep(0)  # it waits in the queue
        return sent


@contextmanager
def meanwhile(act: Callable[[Room], Awaitable[object]]) -> Iterator[None]:
    """Let somebody act each time that the server has worked out an edit, before it is applied."""

    async def submit(room: Room, update: bytes, author: str, expected: int | None = None) -> int:
        await act(room)
        return await _SUBMIT(room, update, author, expected)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Room, "submit", submit)
        yield


async def maps_in(room: Room) -> Maps:
    """Return a copy of what the document holds now."""
    return copy.deepcopy(maps_of((await room.quiet()).doc))
