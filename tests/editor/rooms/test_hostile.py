"""Hostile and unlucky clients of one room: what they do is theirs alone to bear."""

import contextlib
import random
from typing import Any

import pytest
from pycrdt import Array, Doc, Map

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.loading import load
from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.nesting import DEEPEST_TYPES
from action_assistant.editor.crdt.replica import WAITING_UPDATES, ForeignClient, Replica
from action_assistant.editor.crdt.updates.update_scan import outline
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import TooMany
from action_assistant.journal.journal import Journal
from action_assistant.settings import load_limits
from action_assistant.web.network.connection_limits import (
    AT_ONCE,
    OF_A_PERSON,
    OF_AN_ADDRESS,
    PER_MINUTE,
    ConnectionLimits,
)
from editor import forged_updates
from editor.client import Client, settle

STREAM = "graph/g"


async def ended(client: Client) -> int:
    assert client.member is not None
    return await client.member.ended()


async def test_a_forged_client_id_changes_nothing_and_the_victims_edit_survives(
    rooms: Rooms,
) -> None:
    ada, eve = Client("ada", client_id=1), Client("eve", client_id=2)
    async with rooms.enter(STREAM) as room:
        for client in (ada, eve):
            client.join(room)
        await settle(ada, eve)
        ada.map["speed"] = "mine"
        await settle(ada, eve)
        ada.map["place"] = "mine too"  # made, not sent yet
        clock = 1
        eve.deliver(messages.change(forged_updates.entry(1, clock, "place", "stolen")))
        await room.quiet()
        assert await ended(eve) == messages.FORBIDDEN
        await settle(ada)
        assert ada.member is not None
        assert not ada.member.closed
        late = Client("late")
        late.join(room)
        await settle(ada, late)
        assert late.things == ada.things == {"speed": "mine", "place": "mine too"}


async def test_ids_are_learned_from_the_log(journal: Journal) -> None:
    ada = Client("ada", client_id=1)
    for kept in (False, True):
        rooms = Rooms(journal, linger=60, window=0)
        async with rooms.enter(STREAM) as room:
            ada.join(room)
            ada.map[f"edit{kept}"] = 1.0
            await settle(ada)
            ada.leave()
        await rooms.close()  # keeps a snapshot
        if not kept:
            await journal.keep_snapshot(STREAM, 1, b"no snapshot of ours")
        rooms = Rooms(journal, linger=60, window=0)
        eve = Client("eve")
        async with rooms.enter(STREAM) as room:
            eve.join(room)
            await settle(eve)
            eve.deliver(messages.change(forged_updates.entry(1, 1 + kept, "stolen", "x")))
            await room.quiet()
            assert await ended(eve) == messages.FORBIDDEN
            eve.leave()
        await rooms.close()


async def test_a_client_that_echoes_updates_of_others_is_not_closed(rooms: Rooms) -> None:
    ada, bob = Client("ada"), Client("bob")
    async with rooms.enter(STREAM) as room:
        for client in (ada, bob):
            client.join(room)
        await settle(ada, bob)
        for n in range(3):
            ada.map[f"k{n}"] = "ada's"
            await settle(ada, bob)
        bob.map["own"] = "bob's"
        bob.out = []  # lost on its way: it comes with everything else
        bob.deliver(messages.answer(bob.doc.get_update()))
        await settle(ada, bob)
        assert bob.member is not None
        assert not bob.member.closed
        assert ada.things == bob.things
        assert ada.things["own"] == "bob's"


async def test_an_id_that_somebody_shows_is_theirs_before_they_write(rooms: Rooms) -> None:
    ada, eve = Client("ada", client_id=1), Client("eve", client_id=2)
    async with rooms.enter(STREAM) as room:
        for client in (ada, eve):
            client.join(room)
        ada.deliver(messages.presence([messages.PresenceEntry(1, 1, b"{}")]))
        eve.deliver(messages.change(forged_updates.entry(1, 0, "stolen", "x")))
        await room.quiet()
        assert await ended(eve) == messages.FORBIDDEN
        ada.map["k"] = "mine"
        await settle(ada)
        assert room.seq == 1


def test_no_forged_header_is_taken() -> None:
    chance = random.Random(13)
    owners = dict.fromkeys(range(1, 40), "ada")
    replica = Replica()
    for client in owners:
        replica.take(forged_updates.entry(client, 0, f"k{client}", "true"), "ada")
    before = replica.doc.get_update()
    for _ in range(10_000):
        client, clock = chance.randint(1, 39), chance.choice([1, 1, 2, 50, 2**31 - 2])
        with pytest.raises(ForeignClient):
            replica.take(forged_updates.entry(client, clock, "forged", "x"), "eve")
    assert replica.doc.get_update() == before
    assert replica.waiting == ()


async def test_viewers_change_nothing_and_are_not_asked(rooms: Rooms) -> None:
    ada, vic = Client("ada"), Client("vic")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        ada.map["k"] = "v"
        await settle(ada)
        vic.join(room, edits=False)
        await settle(ada, vic)
        assert vic.things == {"k": "v"}
        vic.deliver(messages.answer(b"\x00\x00"))
        vic.deliver(messages.answer(vic.doc.get_update()))  # what all know
        await settle(ada, vic)
        assert vic.member is not None
        assert not vic.member.closed
        vic.deliver(messages.change(forged_updates.entry(99, 0, "k", "vic's")))
        await room.quiet()
        assert await ended(vic) == messages.FORBIDDEN
        assert room.seq == 1


async def test_no_two_first_bytes_of_a_viewer_change_anything(rooms: Rooms) -> None:
    ada = Client("ada")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        ada.map["k"] = "v"
        await settle(ada)
        update = forged_updates.entry(99, 0, "k", "vic's")
        for first in range(256):
            for second in range(0, 256, 1 if first < 8 else 51):
                vic = Client("vic")
                vic.join(room, edits=False)
                try:
                    message = messages.parse(bytes((first, second)) + messages.text(update))
                except Malformed:
                    continue
                if message is not None and vic.member is not None:
                    room.receive(vic.member, message)
                vic.leave()
            await room.quiet()
        assert room.seq == 1
        assert ada.things == {"k": "v"}


def test_types_may_lie_in_one_another_but_not_deeply() -> None:
    replica = Replica()
    replica.take(forged_updates.nested_types(DEEPEST_TYPES), "eve")
    for deep in (DEEPEST_TYPES + 2, 1000, 30_000):
        with pytest.raises(Malformed, match="nested"):
            Replica().take(forged_updates.nested_types(deep), "eve")
    below = DEEPEST_TYPES - 1
    replica.take(forged_updates.nested_types(1, start=DEEPEST_TYPES, below=below), "eve")
    with pytest.raises(Malformed, match="nested"):  # not in small steps either
        replica.take(
            forged_updates.nested_types(1, start=DEEPEST_TYPES + 1, below=DEEPEST_TYPES), "eve"
        )


async def test_depth_is_known_after_a_snapshot(journal: Journal) -> None:
    rooms = Rooms(journal, linger=60, window=0)
    async with rooms.enter(STREAM) as room:
        await room.submit(forged_updates.nested_types(DEEPEST_TYPES), "eve")
        await room.submit(
            forged_updates.nested_types(1, start=DEEPEST_TYPES, below=DEEPEST_TYPES - 1), "eve"
        )
    await rooms.close()
    loaded = await load(journal, STREAM)
    assert loaded.kept == 2
    with pytest.raises(Malformed, match="nested"):
        loaded.replica.take(
            forged_updates.nested_types(1, start=DEEPEST_TYPES + 1, below=DEEPEST_TYPES), "eve"
        )


def test_ordinary_nesting_is_taken() -> None:
    doc: Doc[Any] = Doc()
    things = doc.get("things", type=Map)
    made: list[bytes] = []
    subscription = doc.observe(lambda event: made.append(event.update))
    things["nodes"] = Array([Map({"at": Map({"x": float(n)})}) for n in range(300)])
    for n in range(100):
        things["nodes"].append(Map({"n": float(n)}))
        things["nodes"][n]["more"] = Map({"y": Array([1.0])})
    del things["nodes"][7]
    doc.unobserve(subscription)
    one, whole = Replica(), Replica()
    for update in made:
        one.take(update, "ada")
    whole.take(doc.get_update(), "ada")
    for replica in (one, whole):
        assert replica.doc.get("things", type=Map).to_py() == things.to_py()


async def test_waiting_updates_of_a_person_are_bounded(rooms: Rooms) -> None:
    eve, ada = Client("eve"), Client("ada")
    async with rooms.enter(STREAM) as room:
        eve.join(room)
        ada.join(room)
        for n in range(WAITING_UPDATES + 1):
            eve.deliver(messages.change(forged_updates.entry(66, 10 + 2 * n, "k", "x")))
        await room.quiet()
        assert await ended(eve) == messages.TOO_BIG
        assert room.seq == WAITING_UPDATES
        ada.deliver(messages.change(forged_updates.entry(67, 10, "k", "x")))
        ada.map["k"] = "v"
        await settle(ada)
        assert ada.things == {"k": "v"}


@pytest.mark.parametrize(
    "update",
    [
        forged_updates.entry(2**53, 0, "k", "x"),
        forged_updates.entry(7, 2**31 - 1, "k", "x"),
        forged_updates.entry(7, 2**63, "k", "x"),
        b"\x02"
        + forged_updates.entry(7, 0, "k", "x")[1:-1]
        + forged_updates.entry(7, 1, "k", "x")[1:],
        b"\x00\x01\x07\x01" + messages.number(2**40) + b"\x01",
    ],
)
def test_numbers_that_a_page_cannot_read_are_refused(update: bytes) -> None:
    with pytest.raises(Malformed):
        outline(update)


def test_sockets_are_counted_per_person_and_address() -> None:
    now = 0.0
    connection_limits = ConnectionLimits(limits=True, clock=lambda: now)
    held = []
    for n in range(OF_A_PERSON):
        held.append(connection_limits.admitted("ada", "a"))
        held[n].__enter__()
    with pytest.raises(TooMany, match="open already"), connection_limits.admitted("ada", "a"):
        pass
    with connection_limits.admitted("bob", "a"):
        pass
    for n in range(OF_AN_ADDRESS - OF_A_PERSON):
        held.append(connection_limits.admitted(f"p{n}", "a"))
        held[-1].__enter__()
        now += 60 / PER_MINUTE
    with pytest.raises(TooMany, match="address"), connection_limits.admitted("cy", "a"):
        pass
    with connection_limits.admitted("cy", "b"):
        pass
    held.pop().__exit__(None, None, None)
    with connection_limits.admitted("cy", "a"):
        pass


def test_a_setting_says_how_many_sockets_a_person_and_an_address_may_have() -> None:
    said = load_limits({"ACTION_ASSISTANT_LIMITS": "sockets=10, address-sockets=12"})
    connection_limits = ConnectionLimits(limits=True, load=said, clock=lambda: 0.0)
    with contextlib.ExitStack() as held:
        for _ in range(10):
            held.enter_context(connection_limits.admitted("ada", "a"))
        with pytest.raises(TooMany, match="10 pages"), connection_limits.admitted("ada", "b"):
            pass
        for _ in range(2):
            held.enter_context(connection_limits.admitted("bob", "a"))
        with pytest.raises(TooMany, match="has 12 conn"), connection_limits.admitted("bob", "a"):
            pass


def test_upgrades_come_in_bursts_and_then_at_a_rate() -> None:
    now = 0.0
    connection_limits = ConnectionLimits(limits=True, clock=lambda: now)
    for _ in range(AT_ONCE):
        with connection_limits.admitted("ada", "a"):
            pass
    with pytest.raises(TooMany, match="short time"), connection_limits.admitted("ada", "a"):
        pass
    now += 60
    for _ in range(PER_MINUTE):
        with connection_limits.admitted("ada", "a"):
            pass
    with pytest.raises(TooMany), connection_limits.admitted("ada", "a"):
        pass
    free = ConnectionLimits(limits=False, clock=lambda: now)
    for _ in range(AT_ONCE * 3):
        with free.admitted("ada", "a"):
            pass


def test_the_first_socket_of_a_person_is_always_admitted_where_stop_is_sent() -> None:
    connection_limits = ConnectionLimits(limits=True, keeps_one=True, clock=lambda: 0.0)
    held = [connection_limits.admitted("eve", "a") for _ in range(OF_A_PERSON)]
    for each in held:
        each.__enter__()
    with pytest.raises(TooMany, match="open already"), connection_limits.admitted("eve", "a"):
        pass
    for _ in range(AT_ONCE):  # whoever sits at the same address comes too fast, and is too many
        with contextlib.suppress(TooMany), connection_limits.admitted("eve", "a"):
            pass
    with (
        connection_limits.admitted("ada", "a"),
        pytest.raises(TooMany, match="short time"),
        connection_limits.admitted("ada", "a"),
    ):
        pass
    with connection_limits.admitted(
        "ada", "a"
    ):  # once it is closed, the next one is the first again
        pass
    for each in held:
        each.__exit__(None, None, None)
