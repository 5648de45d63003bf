"""A socket when the process ends, and one that nobody reads from: taken over, and as ASGI has it."""

import asyncio
import logging
from typing import Any, Final

import pytest
import uvicorn
from uvicorn.server import ServerState

from action_assistant.web.server.direct import DirectSocket, WebSocketProtocol, direct_socket
from web.server.wire import REQUEST, Wire, end, frame, opened

EITHER: Final = pytest.mark.parametrize("kind", [DirectSocket, WebSocketProtocol])
SOON: Final = {"ws_ping_interval": 0.02, "ws_ping_timeout": 0.02}  # seconds
LONG: Final = 0.3  # seconds; many times as long
GOODBYE: Final = frame(0x88, b"\x03\xe8", b"mask")
NO_PONG: Final = (1011).to_bytes(2, "big") + b"keepalive ping timeout"


class Ended:
    """Takes a socket over, to hear that it is over."""

    def __init__(self) -> None:
        self.is_gone = False

    def heard(self, message: bytes | None) -> None:
        """Ignore the message."""

    def may_write(self) -> None:
        """Do nothing: no output waits."""

    def gone(self) -> None:
        self.is_gone = True


async def silent(_: Any, receive: Any, send: Any) -> None:
    """An application that fetches no message."""
    await receive()
    await send({"type": "websocket.accept"})
    await asyncio.Event().wait()


async def taken_over(**settings: Any) -> tuple[Any, Wire, Ended]:
    """A socket that somebody has taken over."""
    taker = Ended()

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await receive()
        await send({"type": "websocket.accept"})
        socket = direct_socket(scope["extensions"])
        assert socket is not None
        socket.take_over(taker)
        await asyncio.Event().wait()

    protocol, wire = await opened(DirectSocket, app, **settings)
    return protocol, wire, taker


# --- the end of the process -------------------------------------------------------------------


@EITHER
async def test_the_end_of_the_process_says_nothing_to_who_has_said_goodbye(kind: type[Any]) -> None:
    protocol, wire = await opened(kind, silent)
    protocol.data_received(GOODBYE)
    assert wire.is_closing()  # as long as bytes wait that the client does not read
    said = wire.written
    protocol.shutdown()
    assert (wire.written, wire.is_cut_off, protocol.ping_timer) == (said, False, None)
    end(protocol)


@EITHER
async def test_the_end_of_the_process_is_1012_for_who_has_not(kind: type[Any]) -> None:
    protocol, wire = await opened(kind, silent)
    protocol.shutdown()
    assert wire.written == b"\x88\x02" + (1012).to_bytes(2, "big")
    assert wire.is_closing()
    end(protocol)


async def test_a_taker_hears_of_the_end_also_when_the_connection_only_lingers() -> None:
    protocol, wire, taker = await taken_over()
    protocol.send_keepalive_ping()
    protocol.keepalive_timeout()
    assert wire.is_closing()
    assert not taker.is_gone
    protocol.shutdown()
    assert taker.is_gone
    end(protocol)


async def test_an_application_hears_of_the_end_also_when_the_connection_only_lingers() -> None:
    heard: list[Any] = []

    async def app(_: Any, receive: Any, send: Any) -> None:
        await receive()
        await send({"type": "websocket.accept"})
        heard.append(await receive())

    protocol, wire = await opened(WebSocketProtocol, app)
    protocol.send_keepalive_ping()
    protocol.keepalive_timeout()
    assert wire.is_closing()
    protocol.shutdown()
    await asyncio.wait(protocol.tasks, timeout=LONG)
    assert heard == [{"type": "websocket.disconnect", "code": 1012}]
    end(protocol)


@EITHER
async def test_an_upgrade_that_the_parser_has_refused_is_ended_as_well(kind: type[Any]) -> None:
    config = uvicorn.Config(silent, log_config=None)
    config.load()
    protocol, wire = kind(config, ServerState(), {}), Wire()
    protocol.connection_made(wire)
    protocol.data_received(REQUEST[:-2] + b"x: y\r\n" * 200 + b"\r\n")  # 128 are allowed
    protocol.shutdown()
    assert (wire.is_closing(), wire.is_cut_off) == (True, False)
    end(protocol)


@EITHER
async def test_a_fault_at_the_end_of_one_socket_affects_no_other(
    kind: type[Any], caplog: pytest.LogCaptureFixture
) -> None:
    protocol, wire = await opened(kind, silent)
    protocol.conn.send_close(1000)  # behind the back of the protocol
    protocol.shutdown()
    assert wire.is_cut_off
    (line,) = [each for each in caplog.records if each.levelno >= logging.WARNING]
    assert "InvalidState" in line.getMessage()
    assert line.exc_info is None
    end(protocol)


# --- who is not read --------------------------------------------------------------------------


async def test_a_throttled_client_is_not_taken_for_dead_and_is_pinged_again_afterwards() -> None:
    protocol, wire, _ = await taken_over(**SOON)
    protocol.pause_hearing()
    await asyncio.sleep(LONG)
    assert not wire.is_closing()
    assert NO_PONG not in wire.written
    protocol.resume_hearing()
    await asyncio.sleep(LONG)
    assert wire.written.endswith(NO_PONG)  # of who is read, and says nothing
    assert wire.is_closing()
    end(protocol)


async def test_a_client_that_was_throttled_until_now_has_time_to_be_read() -> None:
    protocol, wire, _ = await taken_over(ws_ping_interval=60, ws_ping_timeout=60)
    protocol.stop_keepalive()
    protocol.send_keepalive_ping()
    protocol.pause_hearing()
    protocol.resume_hearing()
    protocol.keepalive_timeout()
    assert not wire.is_closing()
    assert protocol.ping_timer is not None
    end(protocol)


async def test_a_pong_behind_a_flood_is_not_late_before_its_turn() -> None:
    protocol, wire, _ = await taken_over(**SOON)
    protocol.stop_keepalive()
    protocol.send_keepalive_ping()
    protocol.data_received(frame(0x82, b"x", b"mask") * 64)
    protocol.keepalive_timeout()
    assert not wire.is_closing()
    end(protocol)


@EITHER
async def test_a_client_whose_messages_wait_to_be_fetched_is_not_taken_for_dead(
    kind: type[Any],
) -> None:
    protocol, wire = await opened(kind, silent, **SOON)
    protocol.data_received(frame(0x82, b"x", b"mask"))
    await asyncio.sleep(LONG)
    assert not wire.is_closing()
    end(protocol)


@EITHER
async def test_a_client_that_is_read_and_answers_no_ping_is_taken_for_dead(kind: type[Any]) -> None:
    protocol, wire = await opened(kind, silent, **SOON)
    await asyncio.sleep(LONG)
    assert wire.written.endswith(NO_PONG)
    assert wire.is_closing()
    end(protocol)
