"""A socket in a room, whose messages come and go directly, or by ASGI: nobody sees a difference."""

import asyncio
import socket
from collections.abc import Iterator
from typing import Any

import pytest
from pycrdt import Doc, Map

from action_assistant.editor.crdt import messages as wire
from action_assistant.web.auth.keys import Keys
from editor.api.test_sockets import acks, closed, masked, things, upgraded
from editor.process import Editor, running
from support.product import TOKEN
from support.waiting import wait_until


@pytest.fixture(scope="module", params=["direct", "asgi"])
def either(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Editor]:
    """An editor of each way."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ACTION_ASSISTANT_SOCKETS", request.param)
        with running(tmp_path_factory.mktemp("either") / "data") as editor:
            yield editor


def new_graph(editor: Editor) -> str:
    with editor.client() as client:
        made: str = client.post("/api/graphs", json={"name": "task"}).json()["id"]
        return made


def edits(count: int) -> list[bytes]:
    """Messages, each of which changes something."""
    doc: Doc[Any] = Doc()
    made: list[bytes] = []
    subscription = doc.observe(lambda event: made.append(wire.change(event.update)))
    for n in range(count):
        doc.get("positions", type=Map)[f"{n % 7}"] = float(n)
    doc.unobserve(subscription)
    return made


async def test_stock_clients_converge(either: Editor) -> None:
    one, two, graph = Doc[Any](), Doc[Any](), new_graph(either)
    async with either.joined(graph, one), either.joined(graph, two):
        one.get("meta", type=Map)["name"] = "renamed"
        await wait_until(lambda: things(one) == things(two) and things(two)["name"] == "renamed")


async def test_a_viewer_is_sent_the_epoch_at_once(either: Editor) -> None:
    keys = Keys(TOKEN)
    cookie = f"aa_{either.port}={keys.sealed(keys.new_session('Eve', role='viewer'))}"
    who = {"cookie": cookie, "origin": either.url}
    async with either.socket(new_graph(either), "?acks=1", **who) as session:
        assert (await session.receive_bytes(4))[0] == wire.EPOCH  # the first beat comes after ten


async def test_a_burst_is_taken_whole_and_in_order(either: Editor) -> None:
    """Far more than a socket may be ahead of the room, in one piece."""
    graph, doc = new_graph(either), Doc[Any]()
    burst = edits(1000)
    raw = upgraded(either, graph)
    try:
        async with either.joined(graph, doc), either.socket(graph, "?acks=1") as listener:
            await listener.send_bytes(wire.question(b"\x00"))
            await asyncio.to_thread(raw.sendall, b"".join(map(masked, burst)))
            await wait_until(lambda: doc.get("positions", type=Map).get("5") == 999.0)
            while (await acks(listener, 0, patience=20))[1] < 1001:
                pass
        assert len(doc.get("positions", type=Map)) == 7
    finally:
        raw.close()


async def test_a_message_in_pieces_is_one(either: Editor) -> None:
    graph, doc = new_graph(either), Doc[Any]()
    raw = upgraded(either, graph)
    (edit,) = edits(1)
    pieces = [masked(edit[:5]), masked(b"?"), masked(edit[5:])]
    for place, kind in enumerate((0x02, 0x89, 0x80)):
        pieces[place] = bytes((kind,)) + pieces[place][1:]
    try:
        async with either.joined(graph, doc):
            for byte in b"".join(pieces):
                raw.sendall(bytes((byte,)))
            await wait_until(lambda: doc.get("positions", type=Map).get("0") == 0.0)
        raw.settimeout(5)
        answer = b""
        while b"\x8a\x01?" not in answer:  # the pong
            answer += raw.recv(1 << 16)
    finally:
        raw.close()


@pytest.mark.parametrize(
    ("first", "payload", "code"),
    [(0x81, b"text", 1003), (0x81, b"\xff", 1007), (0x82, b"", 1007), (0xC2, b"packed", 1002)],
)
async def test_an_unreadable_message_closes_the_socket_with_its_code(
    either: Editor, first: int, payload: bytes, code: int
) -> None:
    raw = upgraded(either, new_graph(either))
    raw.sendall(bytes((first,)) + masked(payload)[1:])
    assert await asyncio.to_thread(close_code, raw) == code


async def test_a_message_beyond_the_limit_is_refused_by_its_head(either: Editor) -> None:
    raw = upgraded(either, new_graph(either))
    raw.sendall(b"\x82\xff" + (1 << 21).to_bytes(8, "big") + bytes(4))
    assert await asyncio.to_thread(close_code, raw) == 1009


async def test_a_close_frame_is_answered_by_a_close_frame(either: Editor) -> None:
    raw = upgraded(either, new_graph(either))
    raw.sendall(bytes((0x88,)) + masked(b"\x03\xe8")[1:])
    assert await asyncio.to_thread(close_code, raw) == 1000


async def test_a_graph_that_is_gone_closes_its_sockets(either: Editor) -> None:
    graph = new_graph(either)
    async with either.socket(graph) as session:
        await session.receive_bytes(timeout=5)
        with either.client() as client:
            assert client.delete(f"/api/graphs/{graph}").status_code == 204
        assert await closed(session) == wire.NO_SUCH_GRAPH


def close_code(raw: socket.socket) -> int:
    """Read to the end; the code of the last frame."""
    raw.settimeout(20)
    answer = b""
    with raw:
        while chunk := raw.recv(1 << 16):
            answer += chunk
            if (at := frames(answer)) is not None:
                return int.from_bytes(at[:2], "big")
    raise AssertionError("closed without a word")


def frames(answer: bytes) -> bytes | None:
    """Return the payload of the close frame; None when no close frame has come."""
    at = 0
    while len(answer) >= at + 2 and (size := answer[at + 1]) < 126:
        if answer[at] == 0x88:
            return answer[at + 2 : at + 2 + size]
        at += 2 + size
    return None
