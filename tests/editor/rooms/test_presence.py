"""The server vouches for the names in a room, and nobody can speak for others."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.messages import PresenceEntry
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.rooms.presence import (
    MOST_NUMBER,
    STATE_LIMIT,
    PresenceOwner,
    RoomPresence,
)
from action_assistant.web.auth.keys import Person
from editor.client import Client, settle


def entry(client: int, clock: int = 1, **state: Any) -> PresenceEntry:
    return PresenceEntry(client, clock, json.dumps(state).encode())


def said(entries: list[PresenceEntry]) -> dict[int, Any]:
    return {each.client: json.loads(each.state) for each in entries}


def owner(name: str) -> PresenceOwner:
    return PresenceOwner(Person(name, name.title()))


def test_the_server_says_who_it_is() -> None:
    room, ada = RoomPresence(), PresenceOwner(Person("ada", "Ada"), "#d110bc")
    told = room.update(ada, (entry(7, cursor=[1, 2], user={"id": "bob", "name": "Bob"}),))
    user = {"id": "ada", "name": "Ada", "color": "#d110bc"}
    assert said(told) == {7: {"cursor": [1, 2], "user": user}}


def test_names_of_any_script_arrive_whole() -> None:
    room = RoomPresence()
    person = Person("x", "Ülle 🤖 اسم 名前")
    told = room.update(PresenceOwner(person), (entry(1, editing="ключ"),))
    frame = messages.presence(told)
    parsed = messages.parse(frame)
    assert isinstance(parsed, messages.Presence)
    assert json.loads(parsed.entries[0].state)["user"]["name"] == person.name
    assert json.loads(parsed.entries[0].state)["editing"] == "ключ"


def test_nobody_speaks_for_others() -> None:
    room, ada, eve = RoomPresence(), owner("ada"), owner("eve")
    room.update(ada, (entry(1, cursor=[0, 0]),))
    assert room.update(eve, (entry(1, 9, cursor=[6, 6]),)) == []
    assert room.update(eve, (PresenceEntry(1, 9, b"null"),)) == []
    room.update(eve, (entry(2),))
    assert room.update(eve, (entry(1, 9, cursor=[6, 6]), entry(3))) == []
    assert said(list(room.everyone()))[1]["cursor"] == [0, 0]
    assert set(said(list(room.everyone()))) == {1, 2}


def test_a_client_that_reconnects_takes_over_its_entry_from_the_old_socket() -> None:
    room, old, new = RoomPresence(), owner("ada"), owner("ada")
    room.update(old, (entry(1, 5),))
    assert len(room.update(new, (entry(1, 6, cursor=[1, 1]),))) == 1
    assert room.leave(old) == []
    assert said(list(room.everyone()))[1]["cursor"] == [1, 1]
    assert room.leave(new) == [PresenceEntry(1, 6, b"null")]
    assert room.everyone() == ()


def test_another_window_of_the_same_person_is_left_alone_by_an_echo() -> None:
    room, one, two = RoomPresence(), owner("ada"), owner("ada")
    room.update(one, (entry(1),))
    room.update(two, (entry(2),))
    assert room.update(two, (entry(1, 7),)) == []
    assert room.leave(two) == [PresenceEntry(2, 1, b"null")]
    assert set(said(list(room.everyone()))) == {1}


def test_a_client_that_removes_its_entry_is_gone_and_may_come_back() -> None:
    room, ada = RoomPresence(), owner("ada")
    room.update(ada, (entry(1, 1),))
    assert room.update(ada, (PresenceEntry(1, 2, b"null"),)) == [PresenceEntry(1, 2, b"null")]
    assert room.everyone() == ()
    assert len(room.update(ada, (entry(1, 3),))) == 1


def test_an_entry_that_is_no_state_is_not_passed_on() -> None:
    room = RoomPresence()
    wrong = [b"", b"5", b"[]", b"{", b'{"a": ' + b"[" * 5000, b"\xff", b'"x"']
    wrong.append(json.dumps({"a": "x" * STATE_LIMIT}).encode())
    for state in wrong:
        assert room.update(owner("eve"), (PresenceEntry(1, 1, state),)) == []
    assert room.everyone() == ()


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 5), st.booleans()), max_size=40))
def test_entries_belong_to_the_sockets_that_sent_them(
    words: list[tuple[int, int, bool]],
) -> None:
    room = RoomPresence()
    owners = [owner(f"p{n}") for n in range(4)]
    for who, client, gone in words:
        state = b"null" if gone else b"{}"
        for told in room.update(owners[who], (PresenceEntry(client, 1, state),)):
            assert told.client == client
            if not gone:
                assert json.loads(told.state)["user"]["id"] == f"p{who}"
    for each in room.everyone():
        holder = json.loads(each.state)["user"]["id"]
        assert owners[int(holder[1:])].client == each.client
    for each_owner in owners:
        room.leave(each_owner)
    assert room.everyone() == ()


async def test_a_newcomer_sees_who_is_there_and_all_see_who_leaves(rooms: Rooms) -> None:
    ada, bob = Client("ada"), Client("bob")
    async with rooms.enter("graph/g") as room:
        ada.join(room)
        ada.deliver(messages.presence([entry(1, selection=["x"])]))
        bob.join(room)
        await settle(ada, bob)
        assert json.loads(bob.others[1])["selection"] == ["x"]
        bob.deliver(messages.presence([entry(2)]))
        await settle(ada, bob)
        assert set(ada.others) == {2}
        ada.leave()
        await settle(bob)
        assert bob.others == {}
        bob.deliver(bytes((messages.QUERY_AWARENESS,)))
        await settle(bob)
        assert set(bob.others) == {2}


async def test_only_the_last_of_many_presence_entries_of_a_person_waits(rooms: Rooms) -> None:
    ada, slow = Client("ada"), Client("slow")
    async with rooms.enter("graph/g") as room:
        ada.join(room)
        slow.join(room)
        await settle(ada, slow)
        for n in range(2000):
            ada.deliver(messages.presence([entry(1, n, cursor=[n, n])]))
        assert slow.member is not None
        assert not slow.member.closed
        (frame,) = await slow.member.take()
        slow.take(frame)
        assert json.loads(slow.others[1])["cursor"] == [1999, 1999]


async def test_clients_that_send_presence_at_once_get_all_entries_and_one_alone_gets_none(
    rooms: Rooms,
) -> None:
    """Stock servers send a client's own message back to it only together with others' messages."""
    ada, bob, eve = Client("ada"), Client("bob"), Client("eve")
    async with rooms.enter("graph/g") as room:
        for client in (ada, bob, eve):
            client.join(room)
        await settle(ada, bob, eve)
        ada.deliver(messages.presence([entry(1)]))
        await settle(ada, bob, eve)
        assert [set(c.others) for c in (ada, bob, eve)] == [set(), {1}, {1}]
        ada.deliver(messages.presence([entry(1, 2)]))
        bob.deliver(messages.presence([entry(2)]))
        await settle(ada, bob, eve)
        assert [set(c.others) for c in (ada, bob, eve)] == [{1, 2}] * 3


def test_numbers_that_a_page_cannot_read_are_not_passed_on() -> None:
    room = RoomPresence()
    for client, clock in ((2**53 - 1, 1), (1, 2**53 - 1), (2**53, 1), (1, 2**64 - 1)):
        for state in (b"{}", b"null"):
            assert room.update(owner("eve"), (PresenceEntry(client, clock, state),)) == []
    assert room.everyone() == ()
    eve = owner("eve")
    largest = PresenceEntry(MOST_NUMBER, MOST_NUMBER, b"{}")
    assert len(room.update(eve, (largest,))) == 1  # the clock after it can be read as well
    assert room.update(eve, (PresenceEntry(MOST_NUMBER, 2**60, b"null"),)) == []
    assert room.leave(eve) == [PresenceEntry(MOST_NUMBER, MOST_NUMBER, b"null")]


@pytest.mark.parametrize(
    "state",
    [
        b'{"a":"\xff"}',
        b'{"a":{"\xff":1}}',
        b'{"a":["\xed\xa0\x80"]}',
        b'{"a":NaN}',
        b'{"a":[-Infinity]}',
        b'{"a":{"b":01}}',
        b'{"a":"\x01"}',
        b'{"a":[1,]}',
        b'\xef\xbb\xbf{"a":1}',
        b'{"a":' + b"[" * 10_000 + b"]" * 10_000 + b"}",
    ],
)
def test_an_entry_that_a_page_cannot_read_as_json_is_not_passed_on(state: bytes) -> None:
    room = RoomPresence()
    assert room.update(owner("eve"), (PresenceEntry(1, 1, state),)) == []
    assert room.everyone() == ()


def test_the_last_of_two_equal_keys_is_passed_on_and_the_servers_stamp_stays() -> None:
    state = b'{"a":1,"user":{"id":"bob"},"a":2,"\\u0075ser":{"id":"cyd"}}'
    (told,) = RoomPresence().update(owner("eve"), (PresenceEntry(1, 1, state),))
    assert told.state.count(b'"a"') == told.state.count(b'"user"') == 1
    assert json.loads(told.state)["a"] == 2
    assert json.loads(told.state)["user"]["id"] == "eve"
