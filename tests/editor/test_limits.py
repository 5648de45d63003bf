"""Graphs have a largest size, and people a largest rate of edits."""

import asyncio
from typing import Any

import httpx
import pytest
from pycrdt import Doc, Map

from action_assistant.editor.crdt import document_quota, messages
from action_assistant.editor.rooms.member import AT_ONCE, PER_MINUTE, ByteRateLimits
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.rooms.room import Room
from action_assistant.errors import TooLarge
from action_assistant.journal.journal import Journal
from editor.api.test_sockets import closed, got
from editor.client import Client, settle
from editor.process import Editor

STREAM = "graph/g"


async def end_of(client: Client) -> int:
    assert client.member is not None
    return await client.member.ended()


def actions_of(client: Client) -> Any:
    return client.doc.get("actions", type=Map)


def add(client: Client, *aids: str) -> None:
    with client.doc.transaction():
        for aid in aids:
            actions_of(client)[aid] = "Go"
            actions_of(client)[f"{aid}|type"] = "sync"


async def test_a_setting_makes_graphs_smaller_and_larger_ones_only_stop_growing(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    rooms = Rooms(journal, linger=60, window=0)
    ada, eve = Client("ada"), Client("eve")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        add(ada, *(f"a{n}" for n in range(12)))
        await settle(ada)
    await rooms.close()
    monkeypatch.setenv("ACTION_ASSISTANT_LIMITS", "actions=10")
    rooms = Rooms(journal, linger=60, window=0)
    async with rooms.enter(STREAM) as room:
        eve.join(room)
        await settle(eve)
        actions_of(eve)["a0"] = "Renamed"
        await settle(eve)
        assert await seen(room) == 12, "nothing is lost"
        add(eve, "one more")
        await settle(eve)
        assert await end_of(eve) == messages.FULL
        assert eve.member is not None
        assert eve.member.close_text == "a graph may have 10 actions"
    await rooms.close()


async def seen(room: Room) -> int:
    return document_quota.actions_in((await room.quiet()).doc)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten actions, 64 KiB."""
    monkeypatch.setattr(document_quota, "MOST_ACTIONS", 10)
    monkeypatch.setattr(document_quota, "MOST_BYTES", 1 << 16)
    monkeypatch.setattr(document_quota, "_WORTH", 1 << 10)


@pytest.mark.usefixtures("small")
async def test_one_action_too_many_is_refused_to_its_maker_and_others_go_on(rooms: Rooms) -> None:
    ada, eve, vic = Client("ada"), Client("eve"), Client("vic")
    async with rooms.enter(STREAM) as room:
        for client in (ada, eve, vic):
            client.join(room, edits=client is not vic)
        add(ada, *(f"a{n}" for n in range(10)))
        await settle(ada, eve, vic)
        assert await seen(room) == 10
        add(eve, "e0")
        await settle(ada, eve, vic)
        assert await end_of(eve) == messages.FULL
        assert eve.member is not None
        assert eve.member.close_text == "a graph may have 10 actions"
        # Ada renames, deletes, and has room for one more; Vic sees all of it.
        actions_of(ada)["a0"] = "Renamed"
        del actions_of(ada)["a1"]
        await settle(ada, vic)
        add(ada, "a10")
        await settle(ada, vic)
        assert await seen(room) == 10
        assert ada.durable == ada.sent
        shown = vic.doc.get("actions", type=Map).to_py() or {}
        assert shown["a0"] == "Renamed"
        assert "a1" not in shown
        assert shown["a10"] == "Go"
        with pytest.raises(TooLarge, match="full"):
            await room.submit(difference(ada, "more"), "server")


def difference(client: Client, aid: str) -> bytes:
    """The edit of somebody else who has what this client has."""
    doc: Doc[Any] = Doc()
    doc.apply_update(client.doc.get_update())
    before = doc.get_state()
    doc.get("actions", type=Map)[aid] = "Go"
    return doc.get_update(before)


@pytest.mark.usefixtures("small")
async def test_a_person_who_removes_the_excess_can_enter_again_with_all_other_edits(
    rooms: Rooms,
) -> None:
    ada = Client("ada")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        add(ada, *(f"a{n}" for n in range(11)))
        actions_of(ada)["a0|description"] = "kept"
        await settle(ada)
        assert await end_of(ada) == messages.FULL
        assert await seen(room) == 0
        for key in ("a10", "a10|type"):
            del actions_of(ada)[key]
        ada.join(room)
        await settle(ada)
        assert ada.member is not None
        assert not ada.member.closed
        assert await seen(room) == 10


@pytest.mark.usefixtures("small")
async def test_a_document_of_too_many_bytes_takes_deletions_and_then_edits_again(
    rooms: Rooms,
) -> None:
    ada, eve = Client("ada"), Client("eve")
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        eve.join(room)
        for n in range(7):
            ada.map[f"k{n}"] = "x" * 8_000
        await settle(ada, eve)
        eve.map["more"] = "y" * 20_000
        await settle(ada, eve)
        assert await end_of(eve) == messages.FULL
        assert "more" not in ada.things
        del ada.map["k0"]
        del ada.map["k1"]
        ada.map["fits"] = "z" * 8_000
        await settle(ada)
        assert ada.durable == ada.sent
        bob = Client("bob")
        bob.join(room)
        await settle(bob)
        assert bob.things == ada.things


async def test_an_old_graph_that_is_too_large_opens_and_can_be_made_smaller(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    ada = Client("ada")
    before = Rooms(journal)
    async with before.enter(STREAM) as room:
        ada.join(room)
        add(ada, *(f"a{n}" for n in range(15)))
        await settle(ada)
        ada.leave()
    await before.close()
    monkeypatch.setattr(document_quota, "MOST_ACTIONS", 10)
    rooms = Rooms(journal)
    async with rooms.enter(STREAM) as room:
        ada.join(room)
        actions_of(ada)["a3"] = "Renamed"
        del actions_of(ada)["a4"]
        await settle(ada)
        assert await seen(room) == 14
        add(ada, "another")
        await settle(ada)
        assert ada.member is not None
        assert ada.member.closed
        assert await end_of(ada) == messages.FULL
    await rooms.close()


async def test_the_limit_is_5000_actions_on_every_way_in(
    editor: Editor, http: httpx.Client, graph: str
) -> None:
    def file(count: int) -> dict[str, object]:
        actions = [{"name": "A", "instance_id": n, "type": "sync"} for n in range(count)]
        return {"graph_name": "g", "actions": actions}

    refused = await asyncio.to_thread(http.post, "/api/graphs", json=file(5_001))
    assert (refused.status_code, refused.json()["type"]) == (413, "too-large")
    doc: Doc[Any] = Doc()
    with doc.transaction():
        for n in range(5_001):
            doc.get("actions", type=Map)[f"a{n:011}"] = "A"
    async with editor.socket(graph) as session:
        await session.send_bytes(messages.answer(doc.get_update()))
        assert await closed(session) == messages.FULL
    assert (await got(http, f"/api/graphs/{graph}/umrf")).json()["actions"] == []


def test_a_person_brings_so_many_bytes_a_minute_and_nobody_else_waits_for_that() -> None:
    now = 0.0
    rate_limits = ByteRateLimits(limits=True, clock=lambda: now)
    assert rate_limits.spend("ada", AT_ONCE) == 0
    assert rate_limits.spend("ada", PER_MINUTE) == 60
    assert rate_limits.spend("mari", 1000) == 0
    now = 60.0
    assert rate_limits.spend("ada", PER_MINUTE // 60) == pytest.approx(1)
    now = 600.0
    assert rate_limits.spend("ada", AT_ONCE) == 0
    assert ByteRateLimits(limits=False).spend("ada", 10 * AT_ONCE) == 0


def test_a_cursor_may_move_two_hundred_times_a_second_for_ever_and_not_faster() -> None:
    now = 0.0
    rate_limits = ByteRateLimits(limits=True, clock=lambda: now)
    for n in range(200 * 60 * 10):
        now = n / 200
        assert rate_limits.spend_on_presence("ada", 100) == 0
    waits = [rate_limits.spend_on_presence("eve", 100) for _ in range(60_000)]
    assert waits[0] == 0
    assert waits[-1] > 100


def test_a_crowd_of_people_is_not_remembered_for_ever() -> None:
    now = 0.0
    rate_limits = ByteRateLimits(limits=True, clock=lambda: now)
    for n in range(5_000):
        now += 1.0
        rate_limits.spend(f"person {n}", 1)
    assert len(rate_limits._buckets) <= 1_001
