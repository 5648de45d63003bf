"""The real server under clients that forge, flood, freeze and vanish: the others do not notice."""

import asyncio
import contextlib
import os
import socket
import time
from collections import Counter, defaultdict
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import httpx
import httpx_ws
import psutil
import pytest
from pycrdt import Doc, Map

from action_assistant.editor.crdt import messages
from action_assistant.web.network.connection_limits import AT_ONCE, OF_A_PERSON
from editor import forged_updates
from editor.api.test_sockets import acks, closed, goodbye, masked, upgraded
from editor.process import BEARER, Editor, running
from support.waiting import wait_until

TOGETHER = 1000
ROUNDS = max(1, int(os.environ.get("TEST_RECONNECTS", "1000")) // TOGETHER)
TRIES = 3
MB = 1 << 20


@pytest.fixture(scope="module")
def unlimited(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Editor]:
    """An editor that counts sockets but refuses none."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ACTION_ASSISTANT_LIMITS", "off")
        with running(tmp_path_factory.mktemp("floods") / "data") as editor:
            yield editor


@pytest.fixture
def calm(unlimited: Editor) -> str:
    """A graph of that editor."""
    return new_graph(unlimited)


@pytest.fixture
def own(tmp_path: Path) -> Iterator[Editor]:
    """An editor with its limits, for one test."""
    with running(tmp_path / "data") as editor:
        yield editor


def new_graph(editor: Editor) -> str:
    with editor.client() as client:
        made: str = client.post("/api/graphs", json={"name": "task"}).json()["id"]
        return made


def memory(editor: Editor) -> int:
    assert editor._process is not None
    found: int = psutil.Process(editor._process.pid).memory_info().rss
    return found


@contextlib.asynccontextmanager
async def healthy(editor: Editor, graph: str) -> AsyncIterator[list[float]]:
    """Edit all the while as one person, and measure how long each edit takes until it is
    durable."""
    taken: list[float] = []
    doc: Doc[Any] = Doc()
    things = doc.get("things", type=Map)
    made: list[bytes] = []
    subscription = doc.observe(lambda event: made.append(event.update))

    async def edit(session: httpx_ws.AsyncWebSocketSession) -> None:
        await session.send_bytes(messages.question(b"\x00"))
        while True:
            things["k"] = float(len(taken))
            begun = time.monotonic()
            await session.send_bytes(messages.change(made[-1]))
            await acks(session, len(taken) + 1, patience=60)
            taken.append(time.monotonic() - begun)
            await asyncio.sleep(0.02)

    async with editor.socket(graph, "?acks=1") as session:
        task = asyncio.create_task(edit(session))
        yield taken
        assert not task.done(), task
        before = len(taken)
        await wait_until(lambda: len(taken) > before)
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
    doc.unobserve(subscription)


async def test_a_forger_is_closed_and_the_victims_edit_survives(editor: Editor, graph: str) -> None:
    victim: Doc[Any] = Doc(client_id=4711)
    with editor.client() as http:
        token = {"authorization": http.headers["authorization"]}
        eve = await signed_in(editor, "Eve")
    async with editor.joined(graph, victim):
        victim.get("things", type=Map)["mine"] = "one"
        async with editor.socket(graph, **eve) as forger:
            await forger.send_bytes(messages.question(b"\x00"))
            await wait_until(lambda: True)
            while not isinstance(
                heard := messages.parse(await forger.receive_bytes(5)), messages.Edit
            ) or (b"mine" not in heard.update):
                pass
            await forger.send_bytes(
                messages.change(forged_updates.entry(4711, 1, "late", "stolen"))
            )
            assert await goodbye(forger) == (messages.FORBIDDEN, messages.OTHER_CLIENT)
        victim.get("things", type=Map)["late"] = "mine"
        reader: Doc[Any] = Doc()
        async with editor.socket(graph, **token), editor.joined(graph, reader):
            await wait_until(
                lambda: reader.get("things", type=Map).to_py() == {"mine": "one", "late": "mine"}
            )


async def signed_in(editor: Editor, name: str) -> dict[str, str]:
    """The headers of a browser's session under a name of its own."""
    from support.product import TOKEN

    origin = {"origin": editor.url}
    async with httpx.AsyncClient(base_url=editor.url, headers=origin, trust_env=False) as client:
        answer = await client.post("/api/session", json={"token": TOKEN, "name": name})
        assert answer.status_code < 300, answer.text
        cookies = "; ".join(f"{key}={value}" for key, value in client.cookies.items())
    return {**origin, "cookie": cookies}


async def sound_s(editor: Editor, things: int) -> float:
    """Return the seconds in which a sound update of so many things becomes durable in a new graph."""
    doc: Doc[Any] = Doc()
    doc.get("things", type=Map).update({f"k{n}": "" for n in range(things)})
    async with editor.socket(new_graph(editor), "?acks=1") as session:
        await session.send_bytes(messages.question(b"\x00"))
        begun = time.monotonic()
        await session.send_bytes(messages.change(doc.get_update()))
        await acks(session, 1, patience=60)
        return time.monotonic() - begun


async def test_updates_that_kill_the_library_are_refused_while_others_edit(
    unlimited: Editor, calm: str
) -> None:
    """No edit waits for a refusal as long as a sound update of the size takes, and edits of another graph
    go on meanwhile. The best of some tries counts, so that a busy computer is not taken for a fault."""
    killers = [
        forged_updates.nested_values(30_000),
        forged_updates.nested_values(300_000),
        forged_updates.nested_types(40_000),
        bytes.fromhex("0101cc86dce28bb68f0a6688cc865d7c0000"),
        bytes.fromhex("8be0cc71"),
        b"\xff" * 50,
        b"\x01\x01\x07\x00\x28\x01\x01m\x01k\x01\x75" + messages.number(2**40),
    ]
    sound = await sound_s(unlimited, 40_000)
    before = memory(unlimited)
    # By killer, and whether it came to the graph that is edited.
    held: dict[tuple[int, bool], list[float]] = defaultdict(list)
    refused_in: dict[int, list[float]] = defaultdict(list)  # in another graph
    async with healthy(unlimited, calm) as taken:
        for number, killer in enumerate(killers * TRIES):
            for graph in (calm, new_graph(unlimited)):
                first, begun = len(taken), time.monotonic()
                async with unlimited.socket(graph) as eve:
                    await eve.send_bytes(messages.change(killer))
                    assert await closed(eve, 60) == messages.MALFORMED
                last = len(taken)
                if graph != calm:
                    refused_in[number % len(killers)].append(time.monotonic() - begun)
                await wait_until(lambda last=last: len(taken) > last)
                held[number % len(killers), graph == calm].append(max(taken[first : last + 1]))
    assert max(map(min, held.values())) < sound
    slowest = max(refused_in, key=lambda killer: min(refused_in[killer]))
    assert min(held[slowest, False]) < min(refused_in[slowest]) / 2
    assert memory(unlimited) - before < 100 * MB


async def test_half_open_and_frozen_sockets_cost_little_and_end(
    unlimited: Editor, calm: str
) -> None:
    big = forged_updates.entry(5, 0, "big", "x" * 900_000)
    async with unlimited.socket(calm, "?acks=1") as session:
        await session.send_bytes(messages.change(big))
        await session.send_bytes(messages.question(b"\x00"))
        await acks(session, 1)
    before = memory(unlimited)
    frozen = [upgraded(unlimited, calm, receive_buffer=4096) for _ in range(20)]
    halves = [socket.create_connection(("127.0.0.1", unlimited.port)) for _ in range(20)]
    for raw in halves:
        raw.sendall(b"GET /api/graphs/x/room HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgr")
    for raw in frozen:
        for _ in range(50):  # asks for 45 MB and reads none of it
            raw.sendall(masked(messages.question(b"\x00")))
    async with healthy(unlimited, calm) as taken:
        await asyncio.sleep(2)
    assert memory(unlimited) - before < 20 * 5 * MB
    assert sorted(taken)[len(taken) // 2] < 0.5
    for raw in (*frozen, *halves):
        raw.close()


async def test_sockets_vanish_from_the_room_when_their_peers_do(
    unlimited: Editor, calm: str
) -> None:
    raws = [upgraded(unlimited, calm) for _ in range(50)]
    await until_sockets(unlimited, 50)
    for raw in raws:
        raw.close()
    await until_sockets(unlimited, 0)


async def until_sockets(editor: Editor, count: int) -> None:
    for _ in range(200):
        if await sockets(editor) == count:
            return
        await asyncio.sleep(0.05)
    raise AssertionError(f"{await sockets(editor)} sockets, not {count}")


async def sockets(editor: Editor) -> int:
    async with httpx.AsyncClient(headers=BEARER, trust_env=False) as client:
        text = (await client.get(f"{editor.url}/metrics")).text
    (line,) = [each for each in text.splitlines() if each.startswith("action_assistant_sockets ")]
    return int(line.split()[1])


@pytest.mark.slow
async def test_a_thousand_come_back_at_once(unlimited: Editor, calm: str) -> None:
    for _ in range(ROUNDS):
        begun = time.monotonic()
        async with healthy(unlimited, calm) as taken:
            answers = await asyncio.gather(
                *(greeted(unlimited, calm, synced=True) for _ in range(TOGETHER))
            )
        assert Counter(answers) == {101: TOGETHER}
        assert time.monotonic() - begun < 60
        assert max(taken) < 10


async def greeted(editor: Editor, graph: str, *, synced: bool = False) -> int:
    """Ask for an upgrade over a bare connection; the status. `synced`: wait for the document."""
    head, *_ = await asked(editor, graph, synced=synced)
    return int(head.split()[1])


async def asked(editor: Editor, graph: str, *, synced: bool = False) -> tuple[bytes, bytes]:
    """The head of the answer, and its body if it is a refusal."""
    reader, writer = await asyncio.open_connection("127.0.0.1", editor.port)
    try:
        writer.write(
            f"GET /api/graphs/{graph}/room HTTP/1.1\r\nHost: 127.0.0.1:{editor.port}\r\n"
            f"Authorization: {BEARER['authorization']}\r\nUpgrade: websocket\r\n"
            "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
        )
        head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), 60)
        body = b""
        if b" 101 " not in head:
            body = await asyncio.wait_for(reader.read(), 60)
        elif synced:
            writer.write(masked(messages.question(b"\x00")))
            await asyncio.wait_for(reader.readexactly(4), 60)
        return head, body
    finally:
        writer.close()


async def test_a_flood_of_upgrades_is_refused_before_it_costs_anything(own: Editor) -> None:
    graph = new_graph(own)
    async with healthy(own, graph) as taken:
        answers: Counter[int] = Counter()
        for _ in range(10):
            answers.update(await asyncio.gather(*(greeted(own, graph) for _ in range(100))))
    assert set(answers) == {101, 429}
    assert OF_A_PERSON <= answers[101] < 2 * AT_ONCE
    assert max(taken) < 5
    refused = b"".join(await asked(own, graph))
    assert b"\r\nretry-after: 5\r\n" in refused.lower()
    assert b'"type":"too-many"' in refused


async def test_one_person_has_so_many_sockets_and_no_more(own: Editor) -> None:
    graph = new_graph(own)
    held = [upgraded(own, graph) for _ in range(OF_A_PERSON)]
    assert await greeted(own, graph) == 429
    held.pop().close()
    for _ in range(100):
        await asyncio.sleep(0.05)
        if await greeted(own, graph) == 101:
            break
    else:
        raise AssertionError("never let in again")
    for raw in held:
        raw.close()
