"""Rooms are open where their stream is owned, and the only editor of a database owns every stream."""

import asyncio
from collections.abc import Callable

import pytest

from action_assistant.editor.cluster.owners import Alone, Elsewhere, Here, Owner, Owners
from action_assistant.editor.crdt import messages
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Unavailable
from action_assistant.journal.journal import Journal
from editor.client import STREAM, Client


async def test_the_only_editor_owns_every_stream_for_ever() -> None:
    owners: Owners = Alone()
    lost: list[str] = []
    owners.when_lost(lost.append)
    assert await owners.owner("graph/a") == Here(None)
    await owners.give_up("graph/a")
    assert await owners.owner("graph/a") == Here(None)
    assert lost == []


class Two(Alone):
    """Owners as one of two editors sees them; the test moves streams between both."""

    def __init__(self) -> None:
        self.elsewhere: set[str] = set()
        self.given_up: list[str] = []
        self.was_given_up = asyncio.Event()
        self.hear: Callable[[str], object] = lambda _: None

    async def owner(self, stream: str) -> Owner:
        """Return this editor, unless the test has moved the stream."""
        return Elsewhere("http://other") if stream in self.elsewhere else Here(3)

    async def give_up(self, stream: str) -> None:
        """Note that the stream was given up."""
        self.given_up.append(stream)
        self.was_given_up.set()

    def when_lost(self, hear: Callable[[str], object]) -> None:
        """Keep whom to tell."""
        self.hear = hear


async def test_a_lost_room_ends_at_once_and_its_clients_connect_again(journal: Journal) -> None:
    owners = Two()
    rooms = Rooms(journal, window=0, owners=owners)
    ada = Client("ada")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        assert ada.member is not None
        member = ada.member
        owners.elsewhere.add(STREAM)
        owners.hear(STREAM)
        owners.hear("graph/not-open")
        assert await member.ended() == messages.RESTARTING
        assert rooms.open_room(STREAM) is None
    with pytest.raises(Unavailable, match="Another editor"):
        async with rooms.enter(STREAM):
            pass
    await rooms.close()


async def test_a_room_that_nobody_uses_is_given_up_after_it_was_closed(journal: Journal) -> None:
    owners = Two()
    rooms = Rooms(journal, linger=0.01, window=0, owners=owners)
    async with rooms.enter(STREAM):
        assert owners.given_up == []
    await owners.was_given_up.wait()
    assert owners.given_up == [STREAM]
    assert rooms.open_room(STREAM) is None
    await rooms.close()
