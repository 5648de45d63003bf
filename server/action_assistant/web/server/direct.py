"""WebSockets whose messages go straight to whoever takes them: no queue, no task, no event for each.

A protocol for uvicorn (its setting `ws`), which stays the one that speaks: handshake, pings, closing and
everything that is wrong or rare are its own, and that of `websockets` below it. Here the bytes are only
cut into frames. A whole binary message is unmasked and handed over; every other frame goes the usual
way, whole, so that the usual parser always stands at the beginning of one. An application that takes
nothing over sees no difference.

Of each socket a few frames are dealt with in a turn of the loop, and pings of those who read nothing
wait: a client could send hundreds of thousands at once, for which everybody waited, also for a Stop.
"""

import asyncio
import logging
from collections.abc import Callable, Mapping, MutableMapping
from typing import Any, Final, Protocol

from uvicorn._types import ASGIReceiveEvent, ASGISendEvent
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.http11 import Request

from action_assistant.web.network.connections import has_unread

try:
    from websockets.speedups import apply_mask
except ImportError:  # where it was not compiled
    from websockets.utils import apply_mask

log: Final = logging.getLogger(__name__)

#: The extension of a scope that holds, as `socket`, a socket that can be taken over.
_EXTENSION: Final = "action_assistant.direct"
_WHOLE_BINARY: Final = 0x82  # the first byte of a message in one frame
_SHORT: Final = 126
_SHORT_HEADS: Final = tuple(bytes((_WHOLE_BINARY, size)) for size in range(_SHORT))
#: Kinds of frames: a second one of a message and those after it, a first one.
_CONTINUED, _BINARY = 0, 2
_KINDS: Final = frozenset({_CONTINUED, 1, _BINARY, 8, 9, 10})
_PING: Final = 0x89  # the first byte of a whole one
_WRITTEN_AT_ONCE: Final = 1 << 16  # bytes; more is written message by message
_IN_A_TURN: Final = 16  # frames of one socket that are dealt with before others have their turn
_PIECES: Final = 10_000  # of one message; empty ones would not end at the limit of its bytes
_TOO_BIG: Final = 1009
_RESTARTING: Final = 1012  # the close code of a server that ends


class WebSocketProtocol(WebSocketsSansIOProtocol):
    """uvicorn's protocol for one WebSocket, with two rules more: to end a socket raises nothing, in whatever state
    it is, and a peer that nobody reads from is not taken for dead.

    uvicorn ends its connections one after the other without a `try`: an error at one of them would leave all
    others as they are, and the process to end with a traceback.
    """

    def shutdown(self) -> None:
        """Close the socket, since the process shuts down. It raises no error in any state."""
        if not self.transport.is_closing():
            end_connection(self.transport, super().shutdown)
            return
        # All is said, and goes out as far as the peer reads it; another close frame would be an error.
        self.stop_keepalive()
        self.queue.put_nowait({"type": "websocket.disconnect", "code": _RESTARTING})

    def send_500_response(self) -> None:
        """Answer a request for an upgrade with the status 500, since the application did not answer
        it. If it was refused already, do nothing."""
        if not self.conn.eof_sent:  # else it was refused already, by the parser perhaps
            super().send_500_response()

    def keepalive_timeout(self) -> None:
        """End the connection after a missing pong, unless the pong may be received but not read
        yet."""
        if not self.may_be_unread():
            super().keepalive_timeout()
            return
        # The next ping asks again. Where the peer is gone, the kernel hears of none (TCP_USER_TIMEOUT).
        self.pong_timer = None
        self.pending_ping_payload = None
        self.schedule_ping()

    def may_be_unread(self) -> bool:
        """Return whether the answer to the last ping may be received but not read yet."""
        return self.read_paused or has_unread(self.transport.get_extra_info("socket"))


def end_connection(transport: asyncio.Transport, shutdown: Callable[[], None]) -> None:
    """End a connection by its protocol's `shutdown`; if that raises an error, log it and cut the
    connection off."""
    try:
        shutdown()
    except Exception as error:  # noqa: BLE001 - the next ones are to be ended, too
        log.warning("a connection is cut off, it cannot be ended otherwise: %r", error)
        transport.abort()


class MessageReceiver(Protocol):
    """Receives the messages of a socket. Called on the event loop; must not raise."""

    def heard(self, message: bytes | None) -> None:
        """Handle a binary message; None stands for a text message, whose content is not passed
        on."""

    def may_write(self) -> None:
        """Resume sending, since enough of the written data was sent."""

    def gone(self) -> None:
        """Handle the end of the socket: no message will come any more."""


class IgnoringReceiver:
    """Ignores the messages that come after a socket was released."""

    def heard(self, message: bytes | None) -> None:
        """Ignore a message of the socket."""

    def may_write(self) -> None:
        """Ignore that the socket can send again."""

    def gone(self) -> None:
        """Ignore that the socket has ended."""


class DirectSocket(WebSocketProtocol):
    """A WebSocket whose messages go directly to a `MessageReceiver`, once one has taken it over."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self._receiver: MessageReceiver | None = None
        self._rest = bytearray()  # of a frame that is not complete, or not to be read yet
        #: Bytes of a message of several frames that has begun; None where none has.
        self._in_pieces: int | None = None
        self._pieces = 0  # of that message
        self._is_held = False  # the receiver has paused reading
        self._held_until = 0.0  # in the time of the loop
        self._waits = False  # until other tasks had their turn
        self._late_ping: bytes | None = None  # the newest, of who reads nothing
        self._limit: Final = self.config.ws_max_size

    async def run_asgi(self) -> None:
        """Run the application with this socket in its scope. Called once."""
        extensions: MutableMapping[str, dict[object, object]] = self.scope["extensions"]
        extensions[_EXTENSION] = {"socket": self}
        await super().run_asgi()

    def handle_connect(self, event: Request) -> None:
        """Handle the request for an upgrade to a WebSocket, and free the memory of its headers."""
        super().handle_connect(event)
        event.headers.clear()  # the parser keeps it for as long as the socket is open

    async def receive(self) -> ASGIReceiveEvent:
        """Return the next event for an application that did not take the socket over."""
        event = await super().receive()
        if self._waits:
            self._pause_reading()  # the usual way goes on when all was fetched
        return event

    async def send(self, message: ASGISendEvent) -> None:
        """Send an ASGI message of an application that did not take the socket over."""
        await super().send(message)
        if message["type"] == "websocket.accept" and self.handshake_complete:
            self.response.headers.clear()  # sent
        if message["type"] == "websocket.http.response.body" and self.close_sent:
            self.handshake_complete = True  # refused: not the error that the usual way calls it

    # --- for whoever takes it over ------------------------------------------------------------

    def take_over(self, receiver: MessageReceiver) -> None:
        """Send every message to `receiver` from now on. Call it after the handshake."""
        self._receiver = receiver
        self.scope["headers"] = []  # the headers were read before the socket was accepted
        self._go_on()

    def let_go(self) -> None:
        """Release the socket: its messages are ignored from now on. The application may still close the socket."""
        self._receiver = IgnoringReceiver()
        self.resume_hearing()

    def pause_hearing(self) -> None:
        """Stop reading, so that the sender has to wait."""
        self._is_held = True
        self._pause_reading()

    def resume_hearing(self) -> None:
        """Resume reading, beginning with the data that was received already."""
        self._is_held = False
        self._held_until = self.loop.time()
        self._read_on()
        self._go_on()

    @property
    def is_writable(self) -> bool:
        """Return whether little enough is waiting to be sent."""
        return self.writable.is_set()

    def write_framed(self, data: bytes) -> bool:
        """Send `data`, which consists of whole WebSocket frames, without waiting, and return True.
        Return False if the socket is closing or its send buffer is full."""
        if (
            self.close_sent
            or self.disconnected
            or self.transport.is_closing()
            or not self.writable.is_set()
        ):
            return False
        self.transport.write(data)
        return True

    def write(self, messages: list[bytes]) -> int:
        """Send messages until the send buffer is full; return how many were sent. Send the others
        after `may_write`. If the socket is closed, all count as sent."""
        if self.close_sent or self.disconnected or self.transport.is_closing():
            return len(messages)
        if len(messages) == 1:
            self.transport.write(framed(messages[0]))
            return 1
        if sum(map(len, messages)) <= _WRITTEN_AT_ONCE:
            self.transport.write(b"".join(map(framed, messages)))
            return len(messages)
        for n, message in enumerate(messages):
            if not self.writable.is_set():
                return n
            self.transport.write(framed(message))
        return len(messages)

    # --- for the transport --------------------------------------------------------------------

    def data_received(self, data: bytes) -> None:
        """Handle received bytes of the connection. One short message, nearly always the case, takes
        a fast path."""
        if not self.handshake_initiated:
            super().data_received(data)
            return
        if (
            not (self._rest or self._is_held)
            and self._in_pieces is None
            and data[0] == _WHOLE_BINARY
        ):
            size = len(data) - 6
            if 0 <= size < _SHORT and data[1] == 0x80 | size and self._receiver is not None:
                self._tell(apply_mask(data[6:], data[2:6]))  # nearly always: one short message
                return
        self._rest += data
        if self._waits:
            self._pause_reading()
        self._handle_frames()

    def resume_writing(self) -> None:
        """Continue after the transport has room again: send a delayed ping and notify the receiver."""
        super().resume_writing()
        ping, self._late_ping = self._late_ping, None
        if ping is not None and not self.transport.is_closing():
            super().data_received(ping)
        if self._receiver is not None:
            self._receiver.may_write()

    def connection_lost(self, exc: Exception | None) -> None:
        """Report to the receiver that the connection is over."""
        super().connection_lost(exc)
        self._rest.clear()
        if self._receiver is not None:
            self._receiver.gone()

    def shutdown(self) -> None:
        """Close the socket, since the process shuts down."""
        super().shutdown()
        if self._receiver is not None:
            self._receiver.gone()

    def may_be_unread(self) -> bool:
        """Return whether the answer to the last ping may be received but not read yet."""
        # Bytes that were received during the pause are handled in turns, too.
        was_held = self._is_held or self._held_until >= self.ping_sent_at
        return was_held or self._waits or super().may_be_unread()

    # --- frames -------------------------------------------------------------------------------

    def _go_on(self) -> None:
        self._drain()
        self._handle_frames()

    def _handle_frames(self) -> None:
        """Handle complete frames while the receiver accepts them, up to a limit; then let other
        tasks run."""
        for _ in range(_IN_A_TURN):
            if self._is_held or self._waits or self.transport.is_closing():
                break
            start, end = self._frame()
            if end > len(self._rest):
                return
            frame = bytes(self._rest[:end])
            del self._rest[:end]  # the receiver may resume reading in this call
            self._handle_frame(frame, start)
        else:
            self._waits = True
            self._pause_reading()
            self.loop.call_soon(self._next_turn)
        if self.transport.is_closing():
            self._rest.clear()

    def _next_turn(self) -> None:
        self._waits = False
        self._handle_frames()
        if not self._is_held and self.queue.empty():
            self._read_on()

    def _frame(self) -> tuple[int, int]:
        """Return the offsets at which the payload of the next received frame begins and ends. The
        end lies beyond the received bytes while the frame is not complete. A frame that is not
        allowed has no payload and ends with the received bytes: the usual parser then refuses it.
        """
        rest, there = self._rest, len(self._rest)
        start = 6
        if there < 2:
            return 0, there + 1
        if not rest[1] & 0x80 or rest[0] & 0x0F not in _KINDS:
            return 0, there
        size = rest[1] & 0x7F
        if size >= _SHORT:
            width = 2 if size == _SHORT else 8
            if there < 2 + width:
                return 0, there + 1
            size = int.from_bytes(rest[2 : 2 + width], "big")
            start += width
        most = self._limit - (self._in_pieces or 0)
        return (start, start + size) if size <= most else (0, there)

    def _handle_frame(self, frame: bytes, start: int) -> None:
        """Handle one frame, whose payload begins at the offset `start`."""
        first = frame[0]
        usual = self._receiver is None or self._in_pieces is not None
        if first == _WHOLE_BINARY and start and not usual:
            self._tell(apply_mask(frame[start:], frame[start - 4 : start]))
            return
        if first == _PING and 0 < start >= len(frame) - 125 and not self.writable.is_set():
            self._late_ping = frame  # the newest of several may be answered alone (RFC 6455, 5.5.3)
            return
        kind = first & 0x0F
        if kind <= _BINARY:  # a control frame may come between two pieces
            has_begun = kind != _CONTINUED or self._in_pieces is not None
            so_far = (self._in_pieces or 0) + len(frame) - start
            self._in_pieces = so_far if has_begun and not first & 0x80 else None
            self._pieces = 0 if self._in_pieces is None else self._pieces + 1
        if self._pieces > _PIECES:
            self.conn.fail(_TOO_BIG, "too many pieces")
            self.handle_parser_exception()
            self._drain()
            return
        super().data_received(frame)
        self._drain()

    def _drain(self) -> None:
        """Hand the messages that uvicorn has queued to the receiver."""
        while self._receiver is not None and not self._is_held and not self.queue.empty():
            event = self.queue.get_nowait()
            if event["type"] == "websocket.receive":
                self._read_on()  # uvicorn reads nothing until this message was fetched
                self._receiver.heard(event.get("bytes"))
            elif event["type"] == "websocket.disconnect":
                self._receiver.gone()

    def _pause_reading(self) -> None:
        if not self.read_paused and not self.transport.is_closing():
            self.read_paused = True
            self.transport.pause_reading()

    def _read_on(self) -> None:
        if self.read_paused and not self._waits:
            self.read_paused = False
            if not self.transport.is_closing():
                self.transport.resume_reading()

    def _tell(self, message: bytes) -> None:
        if self._receiver is not None and not self.close_sent:
            self._receiver.heard(message)


def direct_socket(
    extensions: Mapping[str, Mapping[object, object]] | None,
) -> DirectSocket | None:
    """Return the socket in the `extensions` of an ASGI scope; None if it cannot be taken over."""
    found = (extensions or {}).get(_EXTENSION, {}).get("socket")
    return found if isinstance(found, DirectSocket) else None


def framed(message: bytes) -> bytes:
    """Return a binary message as an unmasked WebSocket frame."""
    size = len(message)
    if size < _SHORT:
        return _SHORT_HEADS[size] + message
    if size < 1 << 16:
        return b"\x82\x7e" + size.to_bytes(2, "big") + message
    return b"\x82\x7f" + size.to_bytes(8, "big") + message
