"""Whoever waits for a look at a document hears when its room fails."""

import asyncio

import pytest

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.applying import Panicked
from action_assistant.editor.crdt.replica import Replica
from action_assistant.editor.rooms import room as room_module
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.rooms.room import Room
from action_assistant.errors import Unavailable
from editor.client import STREAM, Client, settle, updates


async def test_a_look_ends_where_answering_fails(
    rooms: Rooms, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise RuntimeError("a fault of ours")

    async with rooms.enter(STREAM) as room:
        monkeypatch.setattr(room_module, "answer_requests", fails)
        async with asyncio.timeout(2):
            with pytest.raises(Unavailable):
                await room.now()


async def test_a_look_ends_where_the_document_cannot_be_loaded_anew(
    rooms: Rooms, monkeypatch: pytest.MonkeyPatch
) -> None:
    def panics(*_: object) -> None:
        raise Panicked("over this edit")

    async def fails(_: Room) -> None:
        raise Unavailable("the disk is gone")

    eve = Client("eve")
    async with rooms.enter(STREAM) as room:
        eve.join(room)
        await settle(eve)
        monkeypatch.setattr(Replica, "take", panics)
        monkeypatch.setattr(Room, "_reload", fails)
        looking = [asyncio.create_task(room.now())]
        await asyncio.sleep(0)  # it enters before the edit, and has to wait for the same document
        eve.deliver(messages.change(updates(("a", "1"))[0]))
        looking.append(asyncio.create_task(room.now()))
        async with asyncio.timeout(2):
            found = await asyncio.gather(*looking, return_exceptions=True)
        assert [type(each) for each in found] == [Unavailable] * 2
