"""Viewers only read, and their messages delay nobody."""

import asyncio
from collections.abc import Callable
from typing import Any, TypeVar

import pytest

from action_assistant.editor.crdt import messages, trial
from action_assistant.editor.crdt.trial import adds_nothing
from action_assistant.editor.rooms.batch import LARGE
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.journal.journal import Journal
from action_assistant.web.workers.lanes import OutOfTime
from editor.client import STREAM, Client, settle

T = TypeVar("T")


class Aside:
    """A way aside that notes what is done there, and may fail."""

    def __init__(self) -> None:
        self.done: list[object] = []
        self.error: Exception | None = None
        self.is_here = False

    async def __call__(self, work: Callable[..., T], /, *args: Any) -> T:
        self.done.append(work)
        if self.error is not None:
            raise self.error
        await asyncio.sleep(0)
        self.is_here = True
        try:
            return work(*args)
        finally:
            self.is_here = False


@pytest.fixture
def aside(monkeypatch: pytest.MonkeyPatch) -> Aside:
    """Fails the test where a large update is read elsewhere by who may only look."""
    aside = Aside()
    read = trial.outline

    def outline(update: bytes) -> Any:
        assert aside.is_here or len(update) <= LARGE
        return read(update)

    monkeypatch.setattr(trial, "outline", outline)
    return aside


async def test_a_large_update_of_a_viewer_is_read_aside_and_ignored_where_it_is_known(
    journal: Journal, aside: Aside
) -> None:
    rooms = Rooms(journal, linger=60, window=0, tried=aside)
    ada, vic = Client("ada"), Client("vic")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        ada.map["a"] = "x" * LARGE
        await settle(ada)
        vic.join(room, edits=False)
        await settle(vic)
        aside.done.clear()
        vic.deliver(messages.answer(vic.doc.get_update()))
        await settle(ada, vic)
        assert aside.done == [adds_nothing]
        assert vic.member is not None
        assert not vic.member.closed
        assert vic.durable == vic.sent
        ada.map["b"] = "2"  # the room goes on
        await settle(ada, vic)
        assert vic.things["b"] == "2"
    await rooms.close()


async def test_a_large_update_of_a_viewer_that_adds_something_sends_them_away(
    journal: Journal, aside: Aside
) -> None:
    rooms = Rooms(journal, linger=60, window=0, tried=aside)
    ada, vic = Client("ada"), Client("vic")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        vic.join(room, edits=False)
        await settle(ada, vic)
        vic.map["a"] = "x" * LARGE
        vic.speak()
        await room.quiet()
        assert vic.member is not None
        assert await vic.member.ended() == messages.FORBIDDEN
        ada.map["b"] = "2"
        await settle(ada)
        assert ada.things == {"b": "2"}
    assert aside.done == [adds_nothing]
    await rooms.close()


async def test_a_large_update_of_a_viewer_that_takes_too_long_to_read_is_refused(
    journal: Journal, aside: Aside
) -> None:
    rooms = Rooms(journal, linger=60, window=0, tried=aside)
    vic = Client("vic")
    async with rooms.enter(STREAM) as room:
        vic.join(room, edits=False)
        await settle(vic)
        aside.error = OutOfTime("too long")
        vic.map["a"] = "x" * LARGE
        vic.speak()
        await room.quiet()
        assert vic.member is not None
        assert await vic.member.ended() == messages.TOO_BIG
    await rooms.close()
