"""The room over real sockets: stock clients, refusals, close codes, silence."""

import asyncio
import contextlib
import json
import socket
from typing import Any

import httpx
import httpx_ws
import pytest
from pycrdt import Doc, Map

from action_assistant.editor.crdt import messages as wire
from editor.process import BEARER, Editor
from support.waiting import wait_until


async def got(http: httpx.Client, path: str, **query: int) -> httpx.Response:
    """Return the editor's answer to a GET."""
    return await asyncio.to_thread(http.get, path, params=query)


def things(doc: Doc[Any]) -> dict[str, Any]:
    found: dict[str, Any] = doc.get("meta", type=Map).to_py() or {}
    return found


async def acks(
    session: httpx_ws.AsyncWebSocketSession, messages: int, patience: float = 5
) -> tuple[int, int]:
    """Read until so many messages are durable; what was said then. `patience` in s for each frame."""
    while True:
        frame = await session.receive_bytes(timeout=patience)
        if frame[0] == wire.ACKS:
            reader = wire.ByteReader(frame[1:])
            durable, seq = reader.number(), reader.number()
            if durable >= messages:
                return durable, seq


async def goodbye(
    session: httpx_ws.AsyncWebSocketSession, patience: float = 5
) -> tuple[int, str | None]:
    """Read until the server closes; its code and what it says. `patience` in s for each frame."""
    try:
        while True:
            await session.receive(timeout=patience)
    except httpx_ws.WebSocketDisconnect as ended:
        return ended.code, ended.reason


async def closed(session: httpx_ws.AsyncWebSocketSession, patience: float = 5) -> int:
    """Read until the server closes; its code."""
    return (await goodbye(session, patience))[0]


async def test_stock_clients_converge(editor: Editor, http: httpx.Client, graph: str) -> None:
    one: Doc[Any] = Doc()
    two: Doc[Any] = Doc()
    async with editor.joined(graph, one), editor.joined(graph, two):
        assert things(one)["name"] == things(two)["name"] == "task"
        one.get("meta", type=Map)["name"] = "renamed by one"
        two.get("meta", type=Map)["description"] = "by two"
        named = {"schema", "name", "description", "direction"}
        await wait_until(lambda: things(one) == things(two) and things(one).keys() == named)
    view = (await got(http, f"/api/graphs/{graph}")).json()
    assert (view["name"], view["description"], view["seq"]) == ("renamed by one", "by two", 3)


async def test_an_edit_over_http_reaches_the_people_in_the_room(
    editor: Editor, http: httpx.Client, graph: str
) -> None:
    doc: Doc[Any] = Doc()
    async with editor.joined(graph, doc):
        await asyncio.to_thread(http.patch, f"/api/graphs/{graph}", json={"name": "new"})
        await wait_until(lambda: things(doc)["name"] == "new")


async def test_acknowledgements_are_for_those_who_ask(editor: Editor, graph: str) -> None:
    doc: Doc[Any] = Doc()
    doc.get("meta", type=Map)["name"] = "mine"
    update = doc.get_update()
    async with editor.socket(graph, "?acks=1") as session, editor.socket(graph) as plain:
        await session.send_bytes(wire.question(b"\x00"))
        assert await acks(session, 0) == (0, 1)
        await session.send_bytes(wire.change(update))
        assert await acks(session, 1) == (1, 2)
        await session.send_bytes(wire.change(update))  # changes nothing, is durable all the same
        assert await acks(session, 2) == (2, 2)
        await plain.send_bytes(wire.question(b"\x00"))
        await plain.send_bytes(wire.change(update))
        kinds = {(await plain.receive_bytes(timeout=5))[0] for _ in range(2)}
        assert kinds == {wire.SYNC}


async def test_an_acknowledged_edit_is_what_other_routes_answer(
    editor: Editor, http: httpx.Client, graph: str
) -> None:
    async with editor.socket(graph, "?acks=1") as session:
        await session.send_bytes(wire.question(b"\x00"))
        await acks(session, 0)
        for n in range(1, 30):
            doc: Doc[Any] = Doc()
            doc.get("meta", type=Map)["name"] = f"name {n}"
            await session.send_bytes(wire.change(doc.get_update()))
            _, seq = await acks(session, n)
            answer = await got(http, f"/api/graphs/{graph}/umrf", at=seq)
            assert answer.headers["x-seq"] == str(seq) == str(n + 1)


async def test_the_server_stamps_who_is_there(editor: Editor, graph: str) -> None:
    async with editor.socket(graph) as one, editor.socket(graph) as two:
        entry = wire.PresenceEntry(9, 1, json.dumps({"user": {"name": "root of all"}}).encode())
        await one.send_bytes(wire.presence([entry]))
        while (frame := await two.receive_bytes(timeout=5))[0] != wire.AWARENESS:
            pass
        message = wire.parse(frame)
        assert isinstance(message, wire.Presence)
        user = json.loads(message.entries[0].state)["user"]
        assert user["id"] == "local"
        assert user["name"] != "root of all"
        await one.close()
        while (frame := await two.receive_bytes(timeout=5))[0] != wire.AWARENESS:
            pass
        assert wire.parse(frame) == wire.Presence((wire.PresenceEntry(9, 1, b"null"),))


@pytest.mark.parametrize(
    ("headers", "path", "status"),
    [
        ({}, "{graph}", 401),
        ({"authorization": "Bearer wrong"}, "{graph}", 401),
        ({**BEARER, "origin": "http://evil.example"}, "{graph}", 403),
        ({**BEARER, "host": "evil.example"}, "{graph}", 403),
        (BEARER, "nonsense", 404),
    ],
)
async def test_a_forbidden_client_is_refused_before_the_upgrade(
    editor: Editor, graph: str, headers: dict[str, str], path: str, status: int
) -> None:
    async with httpx.AsyncClient(trust_env=False) as client:
        with pytest.raises(httpx_ws.WebSocketUpgradeError) as refused:
            async with httpx_ws.aconnect_ws(
                editor.room(path.format(graph=graph)), client, headers={**headers}
            ):
                pass
    assert refused.value.response.status_code == status


@pytest.mark.parametrize(
    ("frame", "code"),
    [
        ("text", wire.UNREADABLE),
        (b"", wire.MALFORMED),
        (b"\x00\x02\xff", wire.MALFORMED),
        (b"\x00\x09\x00", wire.MALFORMED),
        (wire.change(b"nonsense"), wire.MALFORMED),
        (wire.question(b"\xff\xff\x03"), wire.MALFORMED),
        (wire.change(bytes(wire.UPDATE_LIMIT + 1)), wire.TOO_BIG),
    ],
)
async def test_a_message_outside_the_protocol_ends_the_socket(
    editor: Editor, http: httpx.Client, graph: str, frame: str | bytes, code: int
) -> None:
    async with editor.socket(graph) as session:
        if isinstance(frame, str):
            await session.send_text(frame)
        else:
            await session.send_bytes(frame)
        assert await closed(session) == code
    assert (await got(http, f"/api/graphs/{graph}")).json()["seq"] == 1


async def test_a_graph_that_is_deleted_sends_everyone_away(
    editor: Editor, http: httpx.Client, graph: str
) -> None:
    async with editor.socket(graph) as session:
        await session.receive_bytes(timeout=5)
        assert (await asyncio.to_thread(http.delete, f"/api/graphs/{graph}")).status_code == 204
        assert await closed(session) == wire.NO_SUCH_GRAPH


async def test_nobody_stays_in_a_graph_that_is_deleted_while_they_come(
    editor: Editor, http: httpx.Client, graph: str
) -> None:
    async def come(after: float) -> int:
        """Connect after `after` seconds, and return the refusal's status or the code of the
        close."""
        await asyncio.sleep(after)
        try:
            async with editor.socket(graph) as session:
                return await closed(session)
        except httpx_ws.WebSocketUpgradeError as refused:
            return refused.response.status_code

    for _ in range(3):
        crowd = [asyncio.create_task(come(n / 1000)) for n in range(0, 60, 3)]
        await asyncio.sleep(0.03)
        assert (await asyncio.to_thread(http.delete, f"/api/graphs/{graph}")).status_code == 204
        assert {*await asyncio.gather(*crowd)} <= {404, wire.NO_SUCH_GRAPH}
        assert await come(0) == 404
        back = await asyncio.to_thread(http.post, f"/api/graphs/{graph}/recover")
        assert back.is_success
        async with editor.socket(graph) as session, editor.socket(graph) as another:
            await session.receive_bytes(timeout=5)
            await another.receive_bytes(timeout=5)


async def test_a_socket_that_vanishes_takes_its_entry_along(editor: Editor, graph: str) -> None:
    async with editor.socket(graph) as watcher:
        raw = upgraded(editor, graph)
        raw.sendall(masked(wire.presence([wire.PresenceEntry(77, 1, b"{}")])))
        states: list[bytes] = []
        while b"null" not in states:
            message = wire.parse(await watcher.receive_bytes(timeout=5))
            if isinstance(message, wire.Presence):
                states += [entry.state for entry in message.entries if entry.client == 77]
                raw.close()
        assert len(states) == 2


@pytest.mark.slow
async def test_an_idle_socket_hears_something_every_fifteen_seconds(
    editor: Editor, graph: str
) -> None:
    async with editor.socket(graph) as session:
        await session.receive_bytes(timeout=5)
        for _ in range(2):
            assert await session.receive_bytes(timeout=15) == wire.BEAT


async def test_a_frozen_reader_is_dropped_while_others_go_on(editor: Editor, graph: str) -> None:
    frozen = upgraded(editor, graph, receive_buffer=4096)
    frozen.sendall(masked(wire.question(b"\x00")))
    writer, reader = Doc[Any](), Doc[Any]()
    made: list[bytes] = []
    subscription = writer.observe(lambda event: made.append(event.update))
    async with editor.socket(graph, "?acks=1") as session, editor.joined(graph, reader):
        await session.send_bytes(wire.question(b"\x00"))
        for n in range(40):
            writer.get("positions", type=Map)[f"k{n}"] = "x" * 500_000
            await session.send_bytes(wire.change(made[-1]))
            await acks(session, n + 1)
        await wait_until(lambda: len(reader.get("positions", type=Map)) == 40)
    writer.unobserve(subscription)
    frozen.settimeout(10)
    received = 0
    with contextlib.suppress(ConnectionResetError):
        while data := await asyncio.to_thread(frozen.recv, 1 << 20):
            received += len(data)
    frozen.close()
    assert received < 40 * 500_000


def test_no_compression_is_agreed_on(editor: Editor, graph: str) -> None:
    """A frame of some bytes could otherwise unfold into a hundred mebibytes."""
    offer = "Sec-WebSocket-Extensions: permessage-deflate; client_max_window_bits\r\n"
    raw = upgraded(editor, graph, more=offer)
    try:
        raw.sendall(masked(b"\x00\x00\x01\x00").replace(b"\x82", b"\xc2", 1))  # says it is packed
        raw.settimeout(5)
        answer = b""
        while chunk := raw.recv(1 << 16):
            answer += chunk
        assert b"permessage" not in answer
    finally:
        raw.close()


def upgraded(
    editor: Editor, graph: str, *, receive_buffer: int | None = None, more: str = ""
) -> socket.socket:
    """A bare socket that has become a WebSocket, with no extension whatever `more` asks for."""
    raw = socket.socket()
    if receive_buffer is not None:
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
    raw.connect(("127.0.0.1", editor.port))
    raw.sendall(
        f"GET /api/graphs/{graph}/room HTTP/1.1\r\nHost: 127.0.0.1:{editor.port}\r\n"
        f"Authorization: {BEARER['authorization']}\r\nUpgrade: websocket\r\n"
        "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        f"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n{more}\r\n".encode()
    )
    answer = b""
    while b"\r\n\r\n" not in answer:
        answer += raw.recv(1)
    assert b" 101 " in answer
    assert b"extensions" not in answer.lower()
    return raw


def masked(frame: bytes) -> bytes:
    """A short binary frame as clients send it."""
    assert len(frame) < 126
    return bytes((0x82, 0x80 | len(frame))) + bytes(4) + frame
