"""A person who is far beyond the rate limits is not read on a new socket either."""

import asyncio
from typing import Any

from action_assistant.editor.api.room import (
    RoomConnection,
    serve_by_asgi,
    serve_directly,
)
from action_assistant.editor.crdt import messages
from action_assistant.editor.rooms.member import AT_ONCE, PER_MINUTE, ByteRateLimits, Member
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.rooms.room import Room
from action_assistant.web.auth.keys import Person
from editor.client import STREAM

SECOND = PER_MINUTE // 60  # bytes


def talk_of(room: Room, owed: float) -> RoomConnection:
    """Return the connection of a person who has to wait `owed` seconds."""
    limits = ByteRateLimits(limits=True, clock=lambda: 0.0)
    limits.spend("eve", AT_ONCE + int(owed * SECOND))
    return RoomConnection(room, Member(Person("eve", "Eve"), edits=False, acks=False), limits)


class Socket:
    """Stands for a socket that can be taken over, and notes when it was held."""

    is_writable = True

    def __init__(self) -> None:
        self.is_held = False
        self.was_held: bool | None = None  # when it was taken over

    def take_over(self, _: object) -> None:
        self.was_held = self.is_held

    def pause_hearing(self) -> None:
        self.is_held = True

    def resume_hearing(self) -> None:
        self.is_held = False

    def write(self, frames: list[bytes]) -> int:
        return len(frames)

    def write_framed(self, _: bytes) -> bool:
        return True

    def let_go(self) -> None:
        """Do nothing: there is nothing to release."""


async def held_for(rooms: Rooms, owed: float, seconds: float) -> tuple[bool | None, bool]:
    """Return whether a socket is held when it is taken over, and whether it still is after
    `seconds`."""
    socket: Any = Socket()
    async with rooms.enter(STREAM) as room:
        talk = talk_of(room, owed)
        talking = asyncio.create_task(serve_directly(talk, socket))
        await asyncio.sleep(seconds)
        found = socket.was_held, socket.is_held
        talk.member.close(1000)
        assert await talking == 1000
    return found


async def test_a_socket_that_is_taken_over_is_held_from_the_beginning(rooms: Rooms) -> None:
    assert await held_for(rooms, 30, 0.1) == (True, True)
    assert await held_for(rooms, 0.05, 0.3) == (True, False)
    assert await held_for(rooms, -1, 0.1) == (False, False)


async def heard(rooms: Rooms, owed: float, seconds: float) -> int:
    """Return how often the connection asked the server for a message."""
    asked = 0

    async def receive() -> Any:
        nonlocal asked
        asked += 1
        if asked > 1:
            await asyncio.Event().wait()
        return {"type": "websocket.receive", "bytes": messages.question(b"\x00")}

    async def send(_: Any) -> None:
        """Nobody reads it."""

    async with rooms.enter(STREAM) as room:
        talk = talk_of(room, owed)
        talking = asyncio.create_task(serve_by_asgi(talk, receive, send))
        await asyncio.sleep(seconds)
        found = asked
        talk.member.close(1000)
        assert await talking == 1000
    return found


async def test_a_socket_under_any_server_is_not_read_before_that(rooms: Rooms) -> None:
    assert await heard(rooms, 30, 0.1) == 0
    assert await heard(rooms, 0.05, 0.3) >= 1
    assert await heard(rooms, -1, 0.1) == 2
