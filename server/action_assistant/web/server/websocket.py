"""uvicorn's protocol for WebSockets, with two rules more: to end a socket raises nothing, in whatever
state it is, and a peer that nobody reads from is not taken for dead.

uvicorn ends its connections one after the other without a `try`: an error at one of them would leave
all others as they are, and the process to end with a traceback.
"""

import asyncio
import logging
from collections.abc import Callable
from typing import Final

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

log: Final = logging.getLogger(__name__)

_RESTARTING: Final = 1012  # the close code of a server that ends


class WebSocketProtocol(WebSocketsSansIOProtocol):
    """uvicorn's protocol for one WebSocket, made to end without an error in every state."""

    def shutdown(self) -> None:
        """Close the socket because the process shuts down."""
        if not self.transport.is_closing():
            end_connection(self.transport, super().shutdown)
            return
        # All is said, and goes out as far as the peer reads it; another close frame would be an error.
        self.stop_keepalive()
        self.queue.put_nowait({"type": "websocket.disconnect", "code": _RESTARTING})

    def send_500_response(self) -> None:
        """Answer a request for an upgrade that the application did not answer."""
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
        return self.read_paused


def end_connection(transport: asyncio.Transport, shutdown: Callable[[], None]) -> None:
    """End a connection as its protocol does it, by `shutdown`; where that fails, without a word."""
    try:
        shutdown()
    except Exception as error:  # noqa: BLE001 - the next ones are to be ended, too
        log.warning("a connection is cut off, it cannot be ended otherwise: %r", error)
        transport.abort()
