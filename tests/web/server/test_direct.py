"""A socket that is taken over, against the way that it would go otherwise: the same messages, the same
bytes, the same end, whatever a client sends and however it arrives."""

import asyncio
import itertools
import logging
import os
from typing import Any

import pytest
import uvicorn
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState

from action_assistant.web.server import direct
from action_assistant.web.server.direct import DirectSocket, direct_socket, framed
from support.doses import examples
from web.server.wire import LIMIT, REQUEST, Wire, end, frame, opened


class RecordingTaker:
    """Keeps what it hears; after each message in `stops` it wants a pause."""

    def __init__(self, socket: DirectSocket, stops: frozenset[int] = frozenset()) -> None:
        self.heard_so_far: list[bytes | None] = []
        self.is_gone = self.wants_a_pause = False
        self._socket = socket
        self._stops = stops

    def heard(self, message: bytes | None) -> None:
        self.heard_so_far.append(message)
        if len(self.heard_so_far) in self._stops:
            self.wants_a_pause = True
            self._socket.pause_hearing()

    def go_on(self) -> None:
        """The pause is over."""
        self.wants_a_pause = False
        self._socket.resume_hearing()

    def may_write(self) -> None:
        """Do nothing: no output waits."""

    def gone(self) -> None:
        self.is_gone = True


def said(message: Any) -> bytes | None:
    """Return the bytes of an ASGI event."""
    found: bytes | None = message.get("bytes")
    return found


async def turns(protocol: Any, most: int = 10_000) -> int:
    """Let the loop go round until everything that came was dealt with; how many turns that took."""
    for turn in range(most):
        if not getattr(protocol, "_waits", False):
            return turn
        await asyncio.sleep(0)
    raise AssertionError("it never ends")


async def usually(
    pieces: list[bytes], kind: type[Any] = WebSocketsSansIOProtocol
) -> tuple[list[bytes | None], bytes, bool, bool]:
    """Return the messages that ASGI receives, the answer, whether the client is gone, and
    whether the connection is closed."""
    heard: list[bytes | None] = []
    gone: list[bool] = []

    async def app(_: Any, receive: Any, send: Any) -> None:
        await receive()
        await send({"type": "websocket.accept"})
        while (event := await receive())["type"] == "websocket.receive":
            heard.append(said(event))
        gone.append(True)
        await asyncio.Event().wait()

    protocol, wire = await opened(kind, app)
    for piece in pieces:
        if not wire.is_closing():
            protocol.data_received(piece)
        await turns(protocol)
    for _ in range(30):
        await asyncio.sleep(0)
    end(protocol)
    return heard, wire.written, bool(gone), wire.is_closing()


async def directly(
    pieces: list[bytes], *, before: int = 0, stops: frozenset[int] = frozenset()
) -> tuple[list[bytes | None], bytes, bool, bool]:
    """Return the same as `usually`, for a socket that is taken over after `before` pieces have
    come."""
    taken: list[RecordingTaker] = []
    go = asyncio.Event()

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await receive()
        await send({"type": "websocket.accept"})
        await go.wait()
        socket = direct_socket(scope["extensions"])
        assert socket is not None
        taker = RecordingTaker(socket, stops)
        taken.append(taker)
        socket.take_over(taker)
        await asyncio.Event().wait()

    protocol, wire = await opened(DirectSocket, app)
    for n, piece in enumerate([*pieces, b""]):
        if n == before:
            go.set()
            for _ in range(3):
                await asyncio.sleep(0)
        if piece and not wire.is_closing():
            protocol.data_received(piece)
        await turns(protocol)
        for taker in taken:
            while taker.wants_a_pause:
                taker.go_on()
                await turns(protocol)
    (taker,) = taken
    end(protocol)
    return taker.heard_so_far, wire.written, taker.is_gone, wire.is_closing()


payloads = st.binary(max_size=20) | st.integers(100, LIMIT + 20).map(
    lambda n: bytes(range(256))[:1] * n
)
masks = st.binary(min_size=4, max_size=4)
honest = st.builds(frame, st.just(0x82), payloads, masks)
rare = st.builds(
    frame,
    st.sampled_from([0x82, 0x02, 0x00, 0x80, 0x01, 0x81, 0x88, 0x89, 0x8A, 0x09, 0xC2, 0x83, 0x8B]),
    payloads
    | st.sampled_from([b"\x03\xe8", b"\x03\xe8bye", b"\x03\xe8\xff", b"\x00", b"caf\xc3\xa9"]),
    masks,
    masked=st.sampled_from([True] * 9 + [False]),
    size=st.sampled_from([-1] * 20 + [3, 126, 1 << 17, 1 << 63]),
)
streams = st.lists(honest | honest | rare, min_size=1, max_size=8).map(b"".join)


def bytes_of(stream: bytes) -> list[bytes]:
    """One by one: the usual way loses, with what is wrong, all that came in one piece with it."""
    return [stream[n : n + 1] for n in range(len(stream))]


def pieces_of(stream: bytes, cuts: list[int]) -> list[bytes]:
    """The stream as it arrives."""
    places = sorted({0, len(stream), *(cut % (len(stream) + 1) for cut in cuts)})
    return [stream[a:b] for a, b in itertools.pairwise(places)]


@settings(max_examples=examples(400), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    streams,
    st.lists(st.integers(0, 4000), max_size=6),
    st.integers(0, 3),
    st.frozensets(st.integers(1, 6), max_size=3),
    st.sampled_from([1, 2, 64]),
)
def test_a_socket_taken_over_receives_sends_and_ends_as_the_usual_one_does(
    stream: bytes, cuts: list[int], before: int, stops: frozenset[int], in_a_turn: int
) -> None:
    pieces = pieces_of(stream, cuts)
    usual = asyncio.run(usually(bytes_of(stream)))
    before = min(before, len(pieces))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(direct, "_IN_A_TURN", in_a_turn)
        assert asyncio.run(directly(pieces, before=before, stops=stops)) == usual
        # The same holds for a socket that nobody takes over.
        assert asyncio.run(usually(pieces, DirectSocket)) == usual


async def test_an_upgrade_that_is_refused_is_no_error_of_ours(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def app(_: Any, receive: Any, send: Any) -> None:
        await receive()
        await send({"type": "websocket.http.response.start", "status": 401, "headers": []})
        await send({"type": "websocket.http.response.body", "body": b"no"})

    config = uvicorn.Config(app, log_config=None)
    config.load()
    protocol, wire = DirectSocket(config, ServerState(), {}), Wire()
    protocol.connection_made(wire)
    protocol.data_received(REQUEST)
    await asyncio.gather(*protocol.tasks)
    assert wire.written.startswith(b"HTTP/1.1 401 ")
    assert wire.is_closing()
    assert [each for each in caplog.records if each.levelno > logging.INFO] == []


async def flooded(stream: bytes) -> tuple[Any, Wire]:
    """A socket that nobody has taken over, to which all of this has come at once."""

    async def app(_: Any, receive: Any, send: Any) -> None:
        await receive()
        await send({"type": "websocket.accept"})
        while (await receive())["type"] == "websocket.receive":
            pass
        await asyncio.Event().wait()

    protocol, wire = await opened(DirectSocket, app)
    if stream:
        protocol.data_received(stream)
    return protocol, wire


@pytest.mark.parametrize("first", [0x82, 0x81, 0x89])
async def test_others_have_their_turn_while_a_client_floods(first: int) -> None:
    protocol, wire = await flooded(frame(first, b"x", b"mask") * 6_400)
    assert not wire.is_read
    assert await turns(protocol) >= 99
    await asyncio.sleep(0)
    assert wire.is_read
    assert wire.written == (b"\x8a\x01x" * 6_400 if first == 0x89 else b"")
    end(protocol)


async def test_pings_of_who_reads_nothing_do_not_pile_up() -> None:
    protocol, wire = await flooded(b"")
    protocol.pause_writing()
    protocol.data_received(b"".join(frame(0x89, bytes([n]), b"mask") for n in range(200)))
    await turns(protocol)
    assert (wire.written, wire.is_read) == (b"", True)
    protocol.resume_writing()
    assert wire.written == b"\x8a\x01\xc7"
    end(protocol)


async def test_a_message_of_pieces_without_end_is_refused() -> None:
    begun, piece = frame(0x02, b"", b"mask"), frame(0x00, b"", b"mask")
    protocol, wire = await flooded(begun + piece * 9_000)
    await turns(protocol)
    assert not wire.is_closing()
    protocol.data_received(piece * 2_000)
    await turns(protocol)
    assert wire.is_closing()
    assert wire.written[2:4] == (1009).to_bytes(2, "big")
    end(protocol)


def test_every_byte_by_itself_makes_no_difference() -> None:
    mask = os.urandom(4)
    stream = b"".join(
        [
            frame(0x82, b"x" * 200, mask),
            frame(0x02, b"in ", mask),
            frame(0x89, b"there?", mask),
            frame(0x80, b"pieces", mask),
            frame(0x82, b"", mask),
            frame(0x88, b"\x03\xe8bye", mask),
        ]
    )
    whole = asyncio.run(directly([stream]))
    assert whole[0] == [b"x" * 200, b"in pieces", b""]
    assert asyncio.run(directly(bytes_of(stream))) == whole


def test_pieces_beyond_the_limit_are_refused_by_the_head_of_the_last() -> None:
    mask = os.urandom(4)
    begun = frame(0x02, b"x" * 175, mask)
    stream = begun + frame(0x80, b"y" * 126, mask)[: LIMIT - 175]
    assert len(begun) < len(stream)
    heard, written, is_gone, is_over = asyncio.run(directly([begun, stream[len(begun) :]]))
    assert (heard, is_gone, is_over) == ([], True, True)
    assert written[2:4] == (1009).to_bytes(2, "big")


@pytest.mark.parametrize("size", [0, 1, 125, 126, 65_535, 65_536])
def test_each_written_frame_is_one_message(size: int) -> None:
    message = os.urandom(size)
    assert framed(message) == frame(0x82, message, b"", masked=False)
