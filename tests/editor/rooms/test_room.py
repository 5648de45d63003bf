"""The rules of a room, one by one."""

import asyncio
import itertools
from collections.abc import Callable
from typing import Any

import pytest
from pycrdt import Doc, Map

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.loading import load
from action_assistant.editor.crdt.replica import ReplicaState
from action_assistant.editor.rooms.member import WAITING_FRAMES
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Overtaken, Unavailable
from action_assistant.journal.events import Addition, Draft
from action_assistant.journal.journal import Journal
from editor.client import STREAM, Client, bodies, settle, updates


class Gate:
    """Holds appends back, or lets them fail, as a slow or full disk would."""

    def __init__(self, journal: Journal, monkeypatch: pytest.MonkeyPatch) -> None:
        self.open = asyncio.Event()
        self.open.set()
        self.broken = False
        self._original = journal.append_then
        self._tasks: set[asyncio.Task[None]] = set()
        monkeypatch.setattr(journal, "append_then", self._append_then)

    def _append_then(self, addition: Addition, done: Callable[..., None]) -> None:
        task = asyncio.create_task(self._later(addition, done))
        self._tasks.add(task)

    async def _later(self, addition: Addition, done: Callable[..., None]) -> None:
        await self.open.wait()
        if self.broken:
            done(None, Unavailable("disk full"))
        else:
            self._original(addition, done)


@pytest.fixture
def gate(journal: Journal, monkeypatch: pytest.MonkeyPatch) -> Gate:
    return Gate(journal, monkeypatch)


async def test_an_edit_reaches_the_others_and_is_acknowledged(
    journal: Journal, rooms: Rooms
) -> None:
    ada, bob = Client("ada"), Client("bob")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        bob.join(room)
        await settle(ada, bob)
        ada.map["a"] = "1"
        await settle(ada, bob)
        assert bob.things == {"a": "1"}
        assert ada.durable == ada.sent == 2  # step 2 and the edit
        assert ada.seq == bob.seq == room.seq == 1
        (event,) = await journal.read(STREAM)
        assert (event.author, event.kind) == ("ada", "graph.updated.v1")


async def test_nobody_sees_an_edit_before_it_is_committed(rooms: Rooms, gate: Gate) -> None:
    ada, bob, cyd = Client("ada"), Client("bob"), Client("cyd")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        bob.join(room)
        await settle(ada, bob)
        gate.open.clear()
        ada.map["a"] = "1"
        ada.speak()
        cyd.join(room)  # in the middle of the commit
        cyd.speak()
        await asyncio.sleep(0.05)
        await bob.listen()
        await cyd.listen()
        await ada.listen()
        assert bob.things == cyd.things == {}
        assert ada.durable == 1
        gate.open.set()
        await settle(ada, bob, cyd)
        assert bob.things == cyd.things == {"a": "1"}
        assert ada.durable == 2


async def test_a_change_that_cannot_be_stored_reaches_nobody(
    journal: Journal, rooms: Rooms, gate: Gate
) -> None:
    ada, bob = Client("ada"), Client("bob")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        bob.join(room)
        await settle(ada, bob)
        gate.broken = True
        ada.map["a"] = "1"
        ada.speak()
        assert ada.member is not None
        assert bob.member is not None
        assert await ada.member.ended() == await bob.member.ended() == messages.NOT_STORED
        await bob.listen()
        assert bob.things == {}
        assert await journal.newest(STREAM) == 0
    gate.broken = False
    async with rooms.enter(STREAM) as again:
        assert again is not room
        ada.join(again)
        bob.join(again)
        await settle(ada, bob)
        assert bob.things == {"a": "1"}
        assert await journal.newest(STREAM) == 1


async def test_the_server_s_own_edit_hears_when_it_cannot_be_stored(
    rooms: Rooms, gate: Gate
) -> None:
    (update,) = updates(("a", "1"))
    async with rooms.enter(STREAM) as room:
        gate.broken = True
        with pytest.raises(Unavailable, match="disk full"):
            await room.submit(update, "server")
        with pytest.raises(Unavailable):
            await room.submit(update, "server")
        with pytest.raises(Unavailable):
            await room.now()


async def test_an_edit_with_an_expected_change_is_the_first_one_after_it_or_none(
    rooms: Rooms, gate: Gate
) -> None:
    one, two, three = updates(("a", "1"), ("b", "2"), ("c", "3"))
    async with rooms.enter(STREAM) as room:
        gate.open.clear()
        # Of two in one batch, each gets its own number; nothing that waits is overlooked.
        first = asyncio.create_task(room.submit(one, "server", 0))
        behind = asyncio.create_task(room.submit(two, "server"))
        late = asyncio.create_task(room.submit(three, "server", 0))
        await asyncio.sleep(0)
        gate.open.set()
        assert (await first, await behind) == (1, 2)
        with pytest.raises(Overtaken):
            await late
        for expected in (1, 3):
            with pytest.raises(Overtaken):
                await room.submit(three, "server", expected)
        assert await room.submit(one, "server", 2) == 2
        assert await room.submit(three, "server", 2) == 3


async def test_bytes_are_stored_as_they_came_and_only_if_they_bring_something(
    journal: Journal, rooms: Rooms
) -> None:
    one, two = updates(("a", "1"), ("b", "2"))
    async with rooms.enter(STREAM) as room:
        assert await room.submit(one, "ada") == 1
        assert await room.submit(one, "bob") == 1
        assert await room.submit(two, "ada") == 2
        assert await room.submit(messages.NOTHING_NEW, "bob") == 2
    assert await bodies(journal) == [one, two]


async def test_edits_in_the_wrong_order_end_as_in_the_right_one(
    journal: Journal, rooms: Rooms
) -> None:
    made = updates(("a", "1"), ("a", "2"), ("b", "3"), ("a", None), ("c", "4"))
    for number, order in enumerate(itertools.permutations(made)):
        stream = f"graph/{number}"
        ada = Client("ada")
        async with rooms.enter(stream) as room:
            ada.join(room)
            await settle(ada)
            for update in order:
                await room.submit(update, "x")
            await settle(ada)
            assert ada.things == {"b": "3", "c": "4"}
            ada.leave()
        loaded = await load(journal, stream)
        assert loaded.replica.doc.get("things", type=Map).to_py() == {"b": "3", "c": "4"}


async def test_an_edit_that_waits_for_an_earlier_one_is_stored(
    journal: Journal, rooms: Rooms
) -> None:
    one, two, three = updates(("a", "1"), ("a", "2"), ("a", None))
    async with rooms.enter(STREAM) as room:
        assert await room.submit(three, "ada") == 1
        assert await room.submit(two, "ada") == 2
        assert await room.submit(two, "ada") == 2  # again: known
        assert await room.submit(one, "ada") == 3
        assert not (await room.quiet()).waiting
    assert await bodies(journal) == [three, two, one]


async def test_a_newcomer_gets_what_waits_too(rooms: Rooms) -> None:
    one, two, three = updates(("a", "1"), ("b", "2"), ("a", None))
    ada = Client("ada")
    async with rooms.enter(STREAM) as room:
        await room.submit(two, "x")
        await room.submit(three, "x")
        ada.join(room)
        await settle(ada)
        await room.submit(one, "x")
        await settle(ada)
        assert ada.things == {"b": "2"}


async def test_a_snapshot_is_made_of_a_document_that_waits_and_of_what_waits(
    journal: Journal, rooms: Rooms
) -> None:
    one, two = updates(("a", "1"), ("a", None))
    async with rooms.enter(STREAM) as room:
        await room.submit(two, "x")
        await room.close_if_unused(lambda: True)
        kept = await journal.snapshot(STREAM)
        assert kept is not None
        assert kept.seq == 1
        await room.submit(one, "x")
        loaded = await load(journal, STREAM)
        assert (loaded.kept, loaded.seq, loaded.replica.waiting) == (1, 2, ())
        assert loaded.replica.doc.get("things", type=Map).to_py() == {}


async def test_a_snapshot_is_made_every_thousand_events_and_changes_nothing(
    journal: Journal, rooms: Rooms
) -> None:
    many = updates(*((f"k{n % 7}", str(n)) for n in range(1100)))
    async with rooms.enter(STREAM) as room:
        await asyncio.gather(*(room.submit(update, "x") for update in many))
    kept = await journal.snapshot(STREAM)
    assert kept is not None
    assert 1000 <= kept.seq <= 1100
    await journal.append(STREAM, [Draft("graph.updated.v1", "y", updates(("z", "end"))[0])])
    loaded, plain = await load(journal, STREAM), Doc[Any]()
    for body in await bodies(journal):
        plain.apply_update(body)
    things = plain.get("things", type=Map).to_py()
    assert loaded.kept == kept.seq
    assert loaded.replica.doc.get("things", type=Map).to_py() == things
    then = await load(journal, STREAM, upto=500)
    assert then.seq == 500
    assert then.replica.doc.get("things", type=Map).to_py()["k2"] == "499"


async def test_edits_go_on_while_a_snapshot_is_stored(
    journal: Journal, rooms: Rooms, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The snapshot has the state of the moment at which it was begun."""
    monkeypatch.setattr("action_assistant.editor.rooms.housekeeping.SNAPSHOT_EVENTS", 10)
    may_be_stored, stored = asyncio.Event(), asyncio.Event()
    keep = journal.keep_snapshot

    async def slow(stream: str, seq: int, state: bytes) -> None:
        await may_be_stored.wait()
        await keep(stream, seq, state)
        stored.set()

    monkeypatch.setattr(journal, "keep_snapshot", slow)
    many = updates(*(("k", str(n)) for n in range(15)))
    async with rooms.enter(STREAM) as room:
        for update in many:
            await room.submit(update, "x")
        assert room.seq == 15
        assert await journal.snapshot(STREAM) is None
        may_be_stored.set()
        await stored.wait()
        kept = await journal.snapshot(STREAM)
        assert kept is not None
        assert kept.seq == 10
        replica = ReplicaState.replica(kept.state)
        assert replica is not None
        assert replica.doc.get("things", type=Map).to_py() == {"k": "9"}


async def test_a_snapshot_that_cannot_be_applied_is_passed_over(journal: Journal) -> None:
    await journal.append(STREAM, [Draft("graph.updated.v1", "x", u) for u in updates(("a", "1"))])
    await journal.keep_snapshot(STREAM, 1, b"\x01\x01nonsense")
    loaded = await load(journal, STREAM)
    assert loaded.replica.doc.get("things", type=Map).to_py() == {"a": "1"}


async def test_a_client_that_reads_too_slowly_is_closed_and_nobody_waits(rooms: Rooms) -> None:
    ada, bob, slow = Client("ada"), Client("bob"), Client("slow")
    async with rooms.enter(STREAM) as room:
        for client in (ada, bob, slow):
            client.join(room)
        await settle(ada, bob, slow)
        for n in range(WAITING_FRAMES + 10):
            ada.map["a"] = str(n)
            await settle(ada, bob)
        assert slow.member is not None
        assert await slow.member.ended() == messages.TOO_SLOW
        assert bob.things == ada.things
        assert bob.member is not None
        assert not bob.member.closed
        slow.join(room)
        await settle(slow)
        assert slow.things == ada.things


async def test_many_edits_between_two_commits_travel_as_one_message(
    rooms: Rooms, gate: Gate
) -> None:
    ada, bob = Client("ada"), Client("bob")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        bob.join(room)
        await settle(ada, bob)
        gate.open.clear()
        for n in range(40):
            ada.map["a"] = str(n)
            ada.speak()
            await asyncio.sleep(0)
        gate.open.set()
        await room.quiet()
        assert bob.member is not None
        frames = [f for f in await bob.member.take() if f[0] == messages.SYNC]
        assert len(frames) <= 2
        for frame in frames:
            bob.take(frame)
        assert bob.things == {"a": "39"}
        assert room.seq == 40


async def test_looking_shows_what_is_committed(rooms: Rooms, gate: Gate) -> None:
    (update,) = updates(("a", "1"))
    async with rooms.enter(STREAM) as room:
        gate.open.clear()
        submitting = asyncio.create_task(room.submit(update, "x"))
        await asyncio.sleep(0.02)
        looking = asyncio.create_task(room.now())
        await asyncio.sleep(0.02)
        assert not looking.done()
        gate.open.set()
        seq, state = await looking
        doc: Doc[Any] = Doc()
        doc.apply_update(state)
        assert (doc.get("things", type=Map).to_py(), seq) == ({"a": "1"}, 1)
        assert await submitting == 1
