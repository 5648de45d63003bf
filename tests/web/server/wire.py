"""A socket of a server on a connection without another side, and the frames of a client."""

import asyncio
import logging
from typing import Any, Final

import uvicorn
from uvicorn.server import ServerState

LIMIT: Final = 300  # bytes of a message
REQUEST: Final = (
    b"GET / HTTP/1.1\r\nHost: here\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)


class Wire(asyncio.Transport):
    """A connection whose other side only looks at what was written."""

    def __init__(self) -> None:
        super().__init__()
        self.written = b""
        self.is_read = True
        self.is_cut_off = self._is_closing = False

    def write(self, data: Any) -> None:
        assert not self._is_closing or not data
        self.written += data

    def close(self) -> None:
        self._is_closing = True

    def abort(self) -> None:
        self.is_cut_off = self._is_closing = True

    def is_closing(self) -> bool:
        return self._is_closing

    def pause_reading(self) -> None:
        assert self.is_read
        self.is_read = False

    def resume_reading(self) -> None:
        assert not self.is_read
        self.is_read = True


async def opened(kind: type[Any], app: Any, **settings: Any) -> tuple[Any, Wire]:
    """A socket of a server that has accepted it."""
    config = uvicorn.Config(
        app, ws_max_size=LIMIT, ws_per_message_deflate=False, log_config=None, **settings
    )
    config.load()
    protocol, wire = kind(config, ServerState(), {}), Wire()
    protocol.connection_made(wire)
    protocol.data_received(REQUEST)
    for _ in range(3):
        await asyncio.sleep(0)
    assert wire.written.startswith(b"HTTP/1.1 101")
    wire.written = b""
    return protocol, wire


def end(protocol: Any) -> None:
    """Leave nothing behind."""
    protocol.stop_keepalive()
    protocol.logger = logging.getLogger("nobody reads it")
    protocol.logger.disabled = True
    for task in protocol.tasks:
        task.cancel()


def frame(first: int, payload: bytes, mask: bytes, *, masked: bool = True, size: int = -1) -> bytes:
    """A frame of a client; `size` is what it says of its length, if it lies."""
    length = len(payload) if size < 0 else size
    bit = 0x80 if masked else 0
    if length < 126:
        head = bytes((first, bit | length))
    elif length < 1 << 16:
        head = bytes((first, bit | 126)) + length.to_bytes(2, "big")
    else:
        head = bytes((first, bit | 127)) + length.to_bytes(8, "big")
    if not masked:
        return head + payload
    return head + mask + bytes(byte ^ mask[n % 4] for n, byte in enumerate(payload))
