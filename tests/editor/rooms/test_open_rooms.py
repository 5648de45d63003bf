"""Rooms are opened once, stay open while somebody is there, and close for all."""

import asyncio
from typing import Any

import pytest

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.loading import Loaded, load
from action_assistant.editor.rooms.batch import BatchOutcome
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.rooms.room import Room, UpdateBroadcast
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


async def test_a_room_vouches_for_its_graph_while_somebody_is_in_it_and_it_is_not_deleted(
    rooms: Rooms,
) -> None:
    ada = Client()
    assert not rooms.is_joined(STREAM)
    async with rooms.enter(STREAM) as room:
        assert not rooms.is_joined(STREAM)  # nobody was asked whether there is such a graph
        ada.join(room)
        assert rooms.is_joined(STREAM)
        rooms.expel(STREAM)
        assert ada.member is not None
        assert await ada.member.ended() == messages.NO_SUCH_GRAPH
        assert room.members  # not gone yet
        assert not rooms.is_joined(STREAM)
        assert rooms.is_deleted(STREAM)
        rooms.readmit(STREAM)
        assert not rooms.is_deleted(STREAM)
        assert not rooms.is_joined(STREAM)  # the next one asks


async def test_when_a_graph_may_be_deleted_new_people_ask_the_database_and_present_ones_stay(
    rooms: Rooms,
) -> None:
    ada = Client()
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        rooms.check_existence(STREAM)
        assert not rooms.is_joined(STREAM)
        assert not rooms.is_deleted(STREAM)
        assert ada.member is not None
        assert not ada.member.closed


async def test_everyone_is_told_to_reconnect_when_the_server_ends(journal: Journal) -> None:
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


async def test_a_room_that_fails_closes_alone(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The room fails by a panic of the library too, in the same window and transaction as the
    others."""
    rooms = Rooms(journal, linger=60, window=0.01)
    ada, bob = Client("ada"), Client("bob")
    async with rooms.enter("graph/bad") as bad, rooms.enter("graph/good") as good:
        for client, room in ((ada, bad), (bob, good)):
            client.join(room)
            client.speak()
        await settle(ada, bob)
        original = UpdateBroadcast.send

        def tell(self: UpdateBroadcast, outcome: BatchOutcome, seq: int) -> None:
            if ada.member in self._members:
                raise Panic
            original(self, outcome, seq)

        monkeypatch.setattr(UpdateBroadcast, "send", tell)
        for _ in range(2):  # the second within the window
            ada.map["a"] = bob.map["a"] = "1"
            ada.speak()
            bob.speak()
        assert ada.member is not None
        assert await ada.member.ended() == messages.RESTARTING
        await settle(bob)
        assert bob.member is not None
        assert not bob.member.closed
        assert bob.durable == bob.sent
    assert rooms.open_room("graph/bad") is None
    monkeypatch.setattr(UpdateBroadcast, "send", original)
    async with rooms.enter("graph/bad") as again:  # what was stored is there
        ada.join(again)
        await settle(ada)
        assert ada.things == {"a": "1"}
    await rooms.close()


class Panic(BaseException):
    """An error that is no Exception, like the library's panic."""


async def test_a_room_whose_only_visitor_gave_up_while_it_was_loaded_is_let_go(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    loading, go_on = asyncio.Event(), asyncio.Event()

    async def slowly(*args: Any, **more: Any) -> Loaded:
        loading.set()
        await go_on.wait()
        return await load(*args, **more)

    monkeypatch.setattr("action_assistant.editor.rooms.open_rooms.load", slowly)
    rooms = Rooms(journal, linger=0.05, window=0)

    async def visit() -> None:
        async with rooms.enter(STREAM):
            pass

    visitor = asyncio.create_task(visit())
    await loading.wait()
    visitor.cancel()
    await asyncio.wait([visitor])
    go_on.set()
    async with asyncio.timeout(2):
        while rooms.open_room(STREAM) is None:  # noqa: ASYNC110 - nobody tells when it is loaded
            await asyncio.sleep(0.005)
        while rooms.open_room(STREAM) is not None:  # noqa: ASYNC110 - nor when it is gone
            await asyncio.sleep(0.005)
    await rooms.close()
