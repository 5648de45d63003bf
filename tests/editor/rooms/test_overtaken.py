"""Two editors have the same room open on one Postgres, although only one of them should write."""

from action_assistant.editor.crdt import messages
from action_assistant.editor.rooms.open_rooms import Rooms
from editor.client import STREAM, Client, settle
from journal.servers import Server
from journal.test_overtaken import opened


async def test_an_edit_on_an_old_state_closes_its_room_and_is_stored_once_after_that(
    postgres: Server,
) -> None:
    url = postgres.new_database()
    journals = [await opened(url), await opened(url)]
    one, other = (Rooms(each, linger=60, window=0) for each in journals)
    ada, bob, cyd = Client("ada"), Client("bob"), Client("cyd")
    async with one.enter(STREAM) as room, other.enter(STREAM) as elsewhere:
        ada.join(room)
        cyd.join(room)
        bob.join(elsewhere)
        await settle(ada, bob, cyd)
        bob.map["b"] = "1"
        await settle(bob)
        ada.map["a"] = "1"
        ada.speak()
        assert ada.member is not None
        assert await ada.member.ended() == messages.RESTARTING
        await cyd.listen()
        assert cyd.things == {}
    async with one.enter(STREAM) as again:
        ada.join(again)
        cyd.join(again)
        await settle(ada, cyd)
        assert ada.things == cyd.things == {"a": "1", "b": "1"}
        assert await journals[0].newest(STREAM) == 2
    assert await journals[1].verify() == []
    for rooms, journal in zip((one, other), journals, strict=True):
        await rooms.close()
        await journal.close()
