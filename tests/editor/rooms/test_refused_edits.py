"""A refused update closes its sender's socket, and no other one."""

from typing import Any

import pytest
from pycrdt import Doc, Map

from action_assistant.editor.crdt import messages, replica
from action_assistant.editor.crdt.applying import apply_updates
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import BadInput
from action_assistant.journal.journal import Journal
from editor.client import STREAM, Client, bodies, settle, updates


async def test_a_malformed_update_closes_its_sender_and_nobody_else(
    journal: Journal, rooms: Rooms
) -> None:
    ada, eve = Client("ada"), Client("eve")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        eve.join(room)
        await settle(ada, eve)
        eve.deliver(messages.change(b"\x01\x01\x01nonsense"))
        eve.deliver(messages.change(updates(("later", "x"))[0]))
        ada.map["a"] = "1"
        await settle(ada)
        assert eve.member is not None
        assert await eve.member.ended() == messages.MALFORMED
        assert ada.member is not None
        assert not ada.member.closed
    assert len(await bodies(journal)) == 1


class PanicException(BaseException):
    """Named as what the CRDT library raises when it panics; not every version does for the same bytes."""


async def test_an_update_that_breaks_the_library_is_refused_and_harms_nobody(
    journal: Journal, rooms: Rooms, monkeypatch: pytest.MonkeyPatch
) -> None:
    (poison,) = updates(("poison", "1"))

    def apply(doc: Doc[Any], *updates: bytes) -> None:
        if poison in updates:
            raise PanicException("index out of bounds")
        apply_updates(doc, *updates)

    monkeypatch.setattr(replica, "apply_updates", apply)
    ada, eve = Client("ada"), Client("eve")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        eve.join(room)
        ada.map["a"] = "1"
        await settle(ada, eve)
        before = await room.quiet()
        ada.map["b"] = "2"
        ada.speak()
        eve.deliver(messages.change(poison))
        ada.map["c"] = "3"
        ada.speak()
        await settle(ada)
        assert eve.member is not None
        assert await eve.member.ended() == messages.MALFORMED
        assert (await room.quiet()) is not before  # read again from the log
        with pytest.raises(BadInput):
            await room.submit(poison, "server")
        assert (await room.quiet()).doc.get("things", type=Map).to_py() == ada.things
        assert len(ada.things) == 3
        assert ada.durable == ada.sent
    assert len(await bodies(journal)) == 3


async def test_counts_that_bytes_cannot_hold_are_refused_before_the_library_allocates(
    rooms: Rooms,
) -> None:
    async with rooms.enter(STREAM) as room:
        with pytest.raises(BadInput, match="too many clients"):
            await room.submit(bytes.fromhex("8be0cc71"), "eve")


async def test_an_update_over_a_mebibyte_is_refused(journal: Journal, rooms: Rooms) -> None:
    eve = Client("eve")
    async with rooms.enter(STREAM) as room:
        eve.join(room)
        await settle(eve)
        eve.map["a"] = "x" * (1 << 20)
        eve.speak()
        assert eve.member is not None
        assert await eve.member.ended() == messages.TOO_BIG
        await room.quiet()
    assert await bodies(journal) == []


async def test_a_viewer_sees_everything_and_changes_nothing(journal: Journal, rooms: Rooms) -> None:
    ada, vic = Client("ada"), Client("vic")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        vic.join(room, edits=False)
        ada.map["a"] = "1"
        await settle(ada, vic)
        assert vic.things == {"a": "1"}
        assert not vic.out  # was not asked what it has
        vic.deliver(messages.answer(messages.NOTHING_NEW))
        await settle(ada, vic)
        assert vic.member is not None
        assert not vic.member.closed
        vic.map["a"] = "2"
        vic.speak()
        assert await vic.member.ended() == messages.FORBIDDEN
        await settle(ada)
        assert ada.things == {"a": "1"}
    assert len(await bodies(journal)) == 1
