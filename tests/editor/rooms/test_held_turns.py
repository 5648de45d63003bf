"""The server computes an edit in its turn: no other edit comes between, none is lost, and none waits for long."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from pycrdt import Doc, Map

from action_assistant.editor.rooms import batch
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.rooms.room import Room
from action_assistant.errors import BadInput, Overtaken, Unavailable
from action_assistant.journal.events import nothing
from action_assistant.journal.journal import Journal
from editor.client import STREAM, Client, settle


class Here(NamedTuple):
    """A room, in which Ada is."""

    journal: Journal
    rooms: Rooms
    room: Room
    ada: Client


@pytest.fixture
async def here(tmp_path: Path) -> AsyncIterator[Here]:
    journal = await Journal.open(
        f"sqlite:///{tmp_path / 'editor.db'}", branch="editor", fold=nothing
    )
    rooms = Rooms(journal, linger=60, window=0)
    ada = Client("ada")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        await settle(ada)
        yield Here(journal, rooms, room, ada)
    await rooms.close()
    await journal.close()


class Computation:
    """An edit of the server that sets `who` and how many things it saw, when the test lets it."""

    def __init__(self, who: str = "server") -> None:
        self._who = who
        self.begun = asyncio.Event()
        self.may_end = asyncio.Event()

    async def compute(self, state: bytes, _: int) -> bytes:
        self.begun.set()
        await self.may_end.wait()
        doc: Doc[Any] = Doc()
        doc.apply_update(state)
        before = doc.get_state()
        things = doc.get("things", type=Map)
        things[self._who] = float(len(things))
        update: bytes = doc.get_update(before)
        return update


def submitted(room: Room, work: Computation) -> "asyncio.Task[int]":
    return asyncio.create_task(room.submit_in_turn("server", work.compute))


async def heard(ada: Client) -> None:
    """Let Ada hear all that is sent within some turns of the loop, which never come to rest here."""
    for _ in range(20):
        ada.speak()
        await asyncio.sleep(0)
        await ada.listen()


async def test_edits_of_others_wait_while_the_server_computes_its_own_and_come_after_it(
    here: Here,
) -> None:
    here.ada.map["before"] = 1.0
    here.ada.speak()
    work = Computation()
    editing = submitted(here.room, work)
    await work.begun.wait()
    here.ada.map["meanwhile"] = 2.0
    await heard(here.ada)
    assert (here.room.seq, here.ada.seq) == (1, 1)
    work.may_end.set()
    assert await editing == 2
    await settle(here.ada)
    assert here.ada.things == {"before": 1.0, "meanwhile": 2.0, "server": 1.0}
    assert (here.room.seq, here.ada.durable, here.ada.seq) == (3, here.ada.sent, 3)


async def test_what_takes_too_long_is_not_stored_and_others_go_on(
    here: Here, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batch, "HELD_S", 0.02)
    work = Computation()
    editing = submitted(here.room, work)
    await work.begun.wait()
    here.ada.map["meanwhile"] = 2.0
    here.ada.speak()
    with pytest.raises(Overtaken, match="too long"):
        await editing
    await settle(here.ada)
    assert here.ada.things == {"meanwhile": 2.0}
    assert here.room.seq == here.ada.seq == 1


@pytest.mark.parametrize("has_begun", [True, False])
async def test_a_caller_that_leaves_holds_nobody_up(here: Here, has_begun: bool) -> None:
    work = Computation()
    editing = submitted(here.room, work)
    await (work.begun.wait() if has_begun else asyncio.sleep(0))
    here.ada.map["meanwhile"] = 2.0
    here.ada.speak()
    editing.cancel()
    with pytest.raises(asyncio.CancelledError):
        await editing
    await settle(here.ada)
    assert here.ada.things == {"meanwhile": 2.0}
    assert work.begun.is_set() == has_begun


async def test_what_cannot_be_computed_raises_its_error_and_leaves_the_room_open(
    here: Here,
) -> None:
    async def compute(_: bytes, __: int) -> bytes:
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        await here.room.submit_in_turn("server", compute)

    async def compute_badly(_: bytes, __: int) -> bytes:
        return b"nonsense"

    with pytest.raises(BadInput, match="cannot be read"):
        await here.room.submit_in_turn("server", compute_badly)
    here.ada.map["after"] = 2.0
    await settle(here.ada)
    assert here.ada.seq == here.room.seq == 1


async def test_a_room_that_closes_waits_for_the_edit(here: Here) -> None:
    work = Computation()
    editing = submitted(here.room, work)
    await work.begun.wait()
    closing = asyncio.create_task(here.rooms.close())
    await asyncio.sleep(0)
    work.may_end.set()
    assert await editing == 1
    await closing
    assert await here.journal.newest(STREAM) == 1
    with pytest.raises(Unavailable, match="closed"):
        await here.room.submit_in_turn("server", work.compute)


async def test_an_edit_that_cannot_be_stored_is_refused_and_its_room_ends(here: Here) -> None:
    work = Computation()
    editing, next_one = submitted(here.room, work), submitted(here.room, Computation())
    await work.begun.wait()
    await here.journal.close()
    work.may_end.set()
    with pytest.raises(Unavailable):
        await editing
    with pytest.raises(Unavailable):
        await next_one
    assert here.rooms.open_room(STREAM) is None


async def test_between_two_edits_of_the_server_those_of_people_have_their_turn(here: Here) -> None:
    one, other = Computation("one"), Computation("other")
    both = [submitted(here.room, each) for each in (one, other)]
    await one.begun.wait()
    for n in range(3):
        here.ada.map[f"meanwhile {n}"] = 2.0
    await heard(here.ada)
    one.may_end.set()
    await other.begun.wait()
    await heard(here.ada)
    assert here.ada.durable == here.ada.sent
    other.may_end.set()
    assert await asyncio.gather(*both) == [1, 5]
    await settle(here.ada)
    assert (here.ada.things["one"], here.ada.things["other"]) == (0.0, 4.0)
