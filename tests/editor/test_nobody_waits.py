"""Whatever one person sends: the editor goes on answering the others."""

import asyncio
import json
import time
from collections.abc import Callable
from typing import Any

import httpx
import pytest
from pycrdt import Doc, Map

from action_assistant.editor.crdt import document_quota, messages, opening_time, trial
from action_assistant.editor.interchange import importing
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import TooLarge
from action_assistant.journal.journal import Journal
from editor.api.test_sockets import closed
from editor.client import Client, settle
from editor.process import BEARER, Editor

Body = dict[str, Any]


def arrows(count: int, *, parents: bool = False, name: str = "B") -> Body:
    """Return a graph with `count` equal arrows from one action to another."""
    one, other = ({"name": n, "instance_id": 0} for n in ("A", name))
    actions = [
        {"name": "A", "instance_id": 0, "type": "sync", "children": [other] * count},
        {"name": "B", "instance_id": 0, "type": "sync", "parents": [one] * count * parents},
    ]
    return {"graph_name": "g", "actions": actions, "graph_entry": [one], "graph_exit": [one]}


def wide(count: int) -> Body:
    """An action with so many parameters."""
    made = arrows(1, parents=True)
    made["actions"][0]["input_parameters"] = {f"p{n}": {"pvf_type": "number"} for n in range(count)}
    return made


def star(count: int) -> Body:
    """Arrows from so many actions to so many others."""
    many = [{"name": "A", "instance_id": n} for n in range(count)]
    actions = [{**one, "type": "sync", "children": many} for one in many]
    return {"graph_name": "g", "actions": actions, "graph_entry": many, "graph_exit": many}


async def assert_answers_during(editor: Editor, step: Callable[[], Any]) -> None:
    """Assert that the editor's longest silence is less than a third of what a step takes.

    A machine with other work adds silences of its own, but not to each of three tries; a step
    that holds the editor up does so each time.
    """
    for left in (2, 1, 0):
        longest, took = await _longest_silence(editor, step)
        if longest < took / 3 or not left:
            assert longest < took / 3
            return


async def _longest_silence(editor: Editor, step: Callable[[], Any]) -> tuple[float, float]:
    """Return the editor's longest silence during a step, and the duration of the step, in
    seconds."""
    longest = 0.0
    begun = time.perf_counter()
    task = asyncio.ensure_future(step())
    async with httpx.AsyncClient(base_url=editor.url, trust_env=False, timeout=60) as http:
        while not task.done():
            asked = time.perf_counter()
            (await http.get("/healthz")).raise_for_status()
            longest = max(longest, time.perf_counter() - asked)
            await asyncio.sleep(0.005)
    await task
    return longest, time.perf_counter() - begun


@pytest.mark.parametrize(
    ("path", "body"),
    [
        pytest.param("/api/graphs", arrows(4_900, parents=True), id="arrows"),
        pytest.param("/api/graphs", wide(8_000), id="parameters"),
        pytest.param("/api/graphs", arrows(30_000), id="30,000 arrows", marks=pytest.mark.long),
        pytest.param(
            "/api/graphs?preview=true", arrows(30_000), id="a preview", marks=pytest.mark.long
        ),
        pytest.param("/api/pieces", arrows(30_000), id="pieces", marks=pytest.mark.long),
        pytest.param("/api/graphs", star(100), id="a star", marks=pytest.mark.long),
    ],
)
async def test_a_large_file_holds_nobody_up(editor: Editor, path: str, body: Body) -> None:
    text = json.dumps(body).encode()

    async def bring() -> None:
        async with httpx.AsyncClient(base_url=editor.url, trust_env=False, timeout=120) as http:
            answer = await http.post(path, content=text, headers=BEARER)
            assert answer.status_code in {200, 201, 413}, answer.text

    await asyncio.to_thread(httpx.get, f"{editor.url}/api/graphs", headers=BEARER, trust_env=False)
    await bring()  # somebody is there to do it
    await assert_answers_during(editor, bring)


@pytest.mark.parametrize("way", [importing.imported, importing.preview, importing.pieces])
@pytest.mark.parametrize(
    ("body", "place"),
    [
        (arrows(20_001), "/actions"),
        (arrows(5_001), "/actions/0/children"),
        (arrows(5_001, name="ghost"), "/actions/0/children"),
        ({**arrows(1), "graph_entry": [{"name": "A"}] * 5_001}, "/graph_entry"),
        ({**arrows(1), "actions": [{}] * 5_001}, "/actions"),
        ({"graph_name": "g", "umrf_actions": [{"effect": "x"}] * 5_001}, "/umrf_actions"),
    ],
    ids=["graph", "action", "to a ghost", "entry", "actions", "an old file"],
)
def test_a_file_with_too_much_is_refused_with_the_place(
    way: Callable[[bytes], object], body: Body, place: str
) -> None:
    with pytest.raises(TooLarge, match="may have") as refused:
        way(json.dumps(body).encode())
    assert refused.value.where == {"path": place}


@pytest.mark.parametrize("path", ["/api/graphs", "/api/graphs?preview=true", "/api/pieces"])
def test_a_refused_file_leaves_no_graph(http: httpx.Client, path: str) -> None:
    before = len(http.get("/api/graphs").json())
    refused = http.post(path, content=json.dumps(arrows(5_001)).encode(), timeout=120)
    assert refused.status_code == 413, refused.text[:300]
    assert refused.json()["where"]["path"] == "/actions/0/children"
    assert "may have" in refused.json()["detail"]
    assert len(http.get("/api/graphs").json()) == before


@pytest.mark.parametrize("way", [importing.imported, importing.preview, importing.pieces])
def test_a_file_whose_actions_say_too_much_together_is_refused(
    way: Callable[[bytes], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(document_quota, "MOST_FIELDS", 1_000)
    assert way(json.dumps(wide(900)).encode())
    with pytest.raises(TooLarge, match="1,000 fields"):
        way(json.dumps(wide(1_000)).encode())


async def test_a_document_takes_so_many_fields_and_no_more(
    rooms: Rooms, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(document_quota, "MOST_FIELDS", 100)
    ada, eve = Client("ada"), Client("eve")
    async with rooms.enter("graph/g") as room:
        ada.join(room)
        eve.join(room)
        fields = ada.doc.get("actions", type=Map)
        with ada.doc.transaction():
            for n in range(100):
                fields[f"a|{n}"] = n
        await settle(ada, eve)
        fields["a|7"] = "written over"
        await settle(ada, eve)
        assert ada.durable == ada.sent
        eve.doc.get("actions", type=Map)["a|more"] = 1
        await settle(ada, eve)
        assert eve.member is not None
        assert await eve.member.ended() == messages.FULL
        assert eve.member.close_text == "a graph may have 100 fields"
        del fields["a|8"]
        fields["a|9 and another"] = 1
        await settle(ada)
        assert ada.durable == ada.sent


def test_a_graph_that_was_accepted_can_be_opened_and_edited(http: httpx.Client) -> None:
    made = http.post("/api/graphs", content=json.dumps(wide(8_000)).encode()).json()
    renamed = http.patch(f"/api/graphs/{made['id']}", json={"name": "other"})
    assert renamed.status_code == 200
    assert (renamed.json()["name"], renamed.json()["seq"]) == ("other", 2)


async def test_abandoned_requests_are_not_finished(editor: Editor) -> None:
    text = json.dumps(arrows(30_000)).encode()

    async def pieces(content: bytes, patience: float) -> float:
        begun = time.perf_counter()
        async with httpx.AsyncClient(base_url=editor.url, trust_env=False) as http:
            answer = await http.post(
                "/api/pieces", content=content, headers=BEARER, timeout=patience
            )
        assert answer.status_code in {200, 413}
        return time.perf_counter() - begun

    small = json.dumps(arrows(1)).encode()
    await pieces(small, 60)
    whole = await pieces(text, 60)
    for _ in range(5):
        with pytest.raises(httpx.ReadTimeout):
            await pieces(text, whole / 8)
    assert await pieces(small, 60) < 2 * whole  # the five would take five times as long


def at_once(count: int, client: int = 7, clock: int = 0, *, needs: int | None = None) -> bytes:
    """Return an update with `count` values of one key that know nothing of each other, perhaps
    after a missing update."""
    number, text = messages.number, messages.text
    items = count + (needs is not None)
    made = b"\x01" + number(items) + number(client) + number(clock)
    if needs is not None:
        made += b"\x88" + number(needs) + b"\x00\x01\x7e"
    return made + (b"\x28\x01\x01a" + text(b"k") + b"\x01\x7e") * count + b"\x00"


@pytest.fixture
def strict(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lower the limit of a trial to 0.05 s."""
    monkeypatch.setattr(trial, "SECONDS", 0.05)


@pytest.mark.usefixtures("strict")
async def test_an_update_that_takes_long_is_refused_and_others_go_on(rooms: Rooms) -> None:
    ada, eve = Client("ada"), Client("eve")
    async with rooms.enter("graph/g") as room:
        ada.join(room)
        eve.join(room)
        await settle(ada, eve)
        eve.deliver(messages.change(at_once(8_000)))
        await room.quiet()
        assert eve.member is not None
        assert await eve.member.ended() == messages.TOO_BIG
        assert "so long" in (eve.member.close_text or "")
        ada.map["k"] = "v"
        await settle(ada)
        assert ada.durable == ada.sent
        assert room.seq == 1


@pytest.mark.turns
@pytest.mark.timeout(300)  # a busy machine asks to come again, each time after 8 s
async def test_an_update_that_would_hold_the_process_up_is_refused_to_its_sender(
    editor: Editor, http: httpx.Client, graph: str
) -> None:
    async def bring() -> None:
        ended = messages.TOO_SLOW
        while ended == messages.TOO_SLOW:  # a busy machine asks to come again
            async with editor.socket(graph) as session:
                # Three times what may be.
                await session.send_bytes(messages.change(at_once(16_000)))
                ended = await closed(session, 60)
        assert ended == messages.TOO_BIG

    await assert_answers_during(editor, bring)
    patched = await asyncio.to_thread(http.patch, f"/api/graphs/{graph}", json={"name": "goes on"})
    assert patched.status_code == 200


async def test_a_large_edit_of_an_honest_client_is_taken(rooms: Rooms) -> None:
    ada, bob = Client("ada"), Client("bob")
    async with rooms.enter("graph/g") as room:
        ada.join(room)
        bob.join(room)
        await settle(ada, bob)
        for n in range(5):
            with ada.doc.transaction():
                for m in range(2_000):
                    ada.map[f"key {m}"] = n
            ada.map["last"] = n
        await settle(ada, bob)
        assert bob.things == ada.things
        assert ada.durable == ada.sent


def two_edits() -> tuple[bytes, bytes]:
    doc, made = Doc[Any](client_id=9), list[bytes]()
    subscription = doc.observe(lambda event: made.append(event.update))
    for n in range(2):
        doc.get("things", type=Map)[f"k{n}"] = n
    doc.unobserve(subscription)
    return made[0], made[1]


@pytest.mark.usefixtures("strict")
async def test_a_waiting_update_is_tried_before_it_is_applied(rooms: Rooms) -> None:
    """The waiting update would be applied together with the small update that it waits for."""
    ada, eve = Client("ada"), Client("eve")
    first, _ = two_edits()
    async with rooms.enter("graph/g") as room:
        for client in (ada, eve):
            client.join(room)
        await settle(ada, eve)
        eve.deliver(messages.change(at_once(8_000, client=11, needs=9)))
        await settle(ada, eve)
        assert (await room.quiet()).waiting_bytes > 50_000
        ada.map["k"] = "v"
        await settle(ada)
        assert ada.durable == ada.sent
        eve.deliver(messages.change(first))
        await room.quiet()
        assert eve.member is not None
        assert await eve.member.ended() == messages.TOO_BIG
        ada.map["k"] = "w"
        await settle(ada)
        assert ada.durable == ada.sent


@pytest.mark.usefixtures("strict")
async def test_a_harmless_waiting_update_is_applied(rooms: Rooms) -> None:
    first, second = two_edits()
    large = at_once(1_500, client=11, needs=9)
    async with rooms.enter("graph/g") as room:
        assert await room.submit(large, "eve") == 1
        assert await room.submit(second, "eve") == 2
        assert await room.submit(first, "eve") == 3
        assert (await room.quiet()).waiting == ()


async def test_many_small_updates_make_no_graph_that_takes_long_to_open(
    rooms: Rooms, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each update alone is as quick as others; together they would delay everybody again and
    again."""
    monkeypatch.setattr(opening_time, "SECONDS", 0.02)
    ada, eve = Client("ada"), Client("eve")
    async with rooms.enter("graph/g") as room:
        for client in (ada, eve):
            client.join(room)
        ada.map["k"] = "v"
        await settle(ada, eve)
        for clock in range(0, 18_000, 600):
            eve.deliver(messages.change(at_once(600, clock=clock)))
        await settle(ada, eve)
        assert eve.member is not None
        assert await eve.member.ended() == messages.FULL
        assert eve.member.close_text == "a graph may take 0.0 s to open; go on with a copy of it"
        del ada.map["k"]
        await settle(ada)
        assert ada.durable == ada.sent
        state = (await room.quiet()).doc.get_update()
    begun = time.process_time()
    Doc[Any]().apply_update(state)
    assert time.process_time() - begun < 0.2  # 0.8 s otherwise


async def test_opening_a_graph_often_does_not_raise_its_limit(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(opening_time, "SECONDS", 0.02)
    ended = None
    for clock in range(0, 18_000, 600):
        eve, rooms = Client("eve"), Rooms(journal, window=0)
        async with rooms.enter("graph/g") as room:
            eve.join(room)
            await settle(eve)
            eve.deliver(messages.change(at_once(600, clock=clock)))
            await room.quiet()
            assert eve.member is not None
            if eve.member.closed:
                ended = clock, await eve.member.ended()
        await rooms.close()
        if ended is not None:
            break
    assert ended is not None
    assert ended[1] == messages.FULL
    assert ended[0] < 12_000


def page_edit(n: int, own: int = 200) -> bytes:
    """Return the update of the n-th page, a client of its own, which overwrites the page before
    it and an earlier one."""
    number, text = messages.number, messages.text

    def value(key: bytes, after: int, clock: int) -> bytes:
        if after < 0:
            return b"\x28\x01\x01a" + text(key) + b"\x01\x79"
        return b"\xa8" + number(1_000_000 + 7 * after) + number(clock) + b"\x01\x79"

    head = b"\x01\x02" + number(1_000_000 + 7 * n) + b"\x00"
    return head + value(b"shared", n - 1, 0) + value(b"own %d" % (n % own), n - own, 1) + b"\x00"


async def test_thousands_of_pages_that_edit_one_graph_are_hardly_ever_tried(
    journal: Journal,
) -> None:
    """Each page that is opened is a client of its own, which overwrites what others wrote."""
    tries = 0

    async def counted(work: Callable[..., Any], *values: Any) -> Any:
        nonlocal tries
        tries += 1
        return work(*values)

    rooms = Rooms(journal, linger=60, window=0, tried=counted)
    async with rooms.enter("graph/g") as room:
        for n in range(0, 4_000, 20):
            await asyncio.gather(*(room.submit(page_edit(m), "ada") for m in range(n, n + 20)))
        assert room.seq == 4_000
        assert (await room.quiet()).doc.get("a", type=Map)["shared"] is False
    await rooms.close()
    assert tries < 30


async def test_an_update_that_waits_for_ever_causes_no_trial_of_every_edit(
    journal: Journal,
) -> None:
    tries = 0

    async def counted(work: Callable[..., Any], *values: Any) -> Any:
        nonlocal tries
        tries += 1
        return work(*values)

    rooms = Rooms(journal, linger=60, window=0, tried=counted)
    async with rooms.enter("graph/g") as room:
        await room.submit(at_once(2_500, client=11, needs=9), "eve")
        before = tries
        for n in range(60):
            await room.submit(page_edit(n), "ada")
        assert room.seq == 61
    await rooms.close()
    assert tries == before
