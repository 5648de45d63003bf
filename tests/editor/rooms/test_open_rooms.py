"""Rooms are opened once, stay open while somebody is there, and close for all."""

import asyncio

import pytest

from action_assistant.editor.crdt import messages
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.rooms.room import Room
from action_assistant.journal.journal import Journal
from editor.client import STREAM, Client, bodies, settle


async def test_opening_at_the_same_time_gives_one_room(rooms: Rooms) -> None:
    async def visit() -> Room:
        async with rooms.enter(STREAM) as room:
            await asyncio.sleep(0)
            return room

    found = await asyncio.gather(*(visit() for _ in range(20)))
    assert len(set(map(id, found))) == 1


async def test_a_visitor_who_gives_up_takes_nobody_along(rooms: Rooms) -> None:
    async def visit() -> int:
        async with rooms.enter(STREAM) as room:
            return room.seq

    impatient = asyncio.create_task(visit())
    patient = asyncio.create_task(visit())
    await asyncio.sleep(0)
    impatient.cancel()
    assert await patient == 0


async def test_an_empty_room_is_let_go_after_a_while_and_its_memory_freed(
    journal: Journal,
) -> None:
    rooms = Rooms(journal, linger=0.05, window=0)
    ada = Client("ada")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        ada.map["a"] = "1"
        await settle(ada)
        ada.leave()
    assert rooms.open_room(STREAM) is room
    await asyncio.sleep(0.02)
    async with rooms.enter(STREAM) as same:
        assert same is room
        await asyncio.sleep(0.1)
    assert rooms.open_room(STREAM) is room  # joining in time has cancelled it
    await asyncio.sleep(0.2)
    assert rooms.open_room(STREAM) is None
    assert (await journal.snapshot(STREAM)) is not None
    async with rooms.enter(STREAM) as fresh:
        assert fresh is not room
        assert fresh.seq == 1
    await rooms.close()


async def test_when_the_server_ends_everyone_is_told_to_come_again(journal: Journal) -> None:
    rooms = Rooms(journal)
    ada = Client("ada")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        await settle(ada)
        ada.map["a"] = "1"
        ada.speak()
        member = ada.member
        assert member is not None
        await rooms.close()
        assert await member.ended() == messages.RESTARTING
    assert len(await bodies(journal)) == 1


async def test_a_silent_socket_hears_something(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("action_assistant.editor.rooms.open_rooms._TICK", 0.02)
    monkeypatch.setattr("action_assistant.editor.rooms.open_rooms._SILENCE", 0.05)
    rooms = Rooms(journal)
    ada = Client("ada")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        await settle(ada)
        assert ada.member is not None
        async with asyncio.timeout(2):
            assert await ada.member.take() == [messages.BEAT]
        ada.leave()
    await rooms.close()
