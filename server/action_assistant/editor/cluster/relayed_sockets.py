"""Relays sockets: each client's socket to this editor has an inner one, from here to the editor
that has the room.

Messages are passed unchanged, with back-pressure: where one side does not read, the library and the
server below stop reading from the other side, so the room sees a slow reader (rule R5).
"""

import asyncio
import logging
from collections.abc import Callable
from typing import Any, Final

import anyio
import websockets
from litestar.types import Receive, Send
from websockets.asyncio.client import ClientConnection

from action_assistant.editor.cluster.peers import Peers
from action_assistant.errors import Unavailable
from action_assistant.web.auth.access import Plain

log: Final = logging.getLogger(__name__)

_NORMAL: Final = 1000
_RESTARTING: Final = 1012
#: Of sockets that ended without a close frame.
_NO_FRAME: Final = frozenset({1006, 1015})
_EMPTY_FRAME: Final = 1005
_LOOK_S: Final = 1.0
_GOODBYE_S: Final = 1.0


class RelayedSocket:
    """One client whose room is open at another editor, at `url`."""

    def __init__(self, stream: str, url: str, inner: ClientConnection, outer: Plain) -> None:
        self.stream: Final = stream
        self.url: Final = url
        self._inner = inner
        self._outer = outer
        self._lost = asyncio.Event()

    def lose(self) -> None:
        """Close the client's socket, since the other editor does not have the room any more."""
        self._lost.set()

    async def served(self) -> tuple[int, str] | None:
        """Pass messages on until one side ends. Return the code and text with which the client's
        socket has to be closed; None if the client has left."""
        passing = [
            asyncio.create_task(self._pass_inward()),
            asyncio.create_task(self._pass_outward()),
        ]
        lost = asyncio.create_task(self._lost.wait())
        tasks = [*passing, lost]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            if any(task.result() for task in passing if task.done()):
                return None
            if not lost.done():
                await self._inner.wait_closed()
            return self._close_code()
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)

    async def aclose(self) -> None:
        """Close the socket to the other editor."""
        await self._inner.close(_NORMAL)

    async def _pass_inward(self) -> bool:
        """Pass on what the client sends. Return True when the client has left, False when the inner
        socket ends."""
        while True:
            event: Any = await self._outer.receive()
            if event["type"] != "websocket.receive":
                return True
            data = event.get("bytes")
            try:
                await self._inner.send(event.get("text") or "" if data is None else data)
            except websockets.ConnectionClosed:
                return False

    async def _pass_outward(self) -> bool:
        """Pass on what the room sends. Return True when the client has left, False when the inner
        socket ends."""
        while True:
            try:
                frame = await self._inner.recv(decode=False)
            except websockets.ConnectionClosed:
                return False
            try:
                await self._outer.send({"type": "websocket.send", "bytes": frame, "text": None})
            except (OSError, RuntimeError):
                return True

    def _close_code(self) -> tuple[int, str]:
        code, reason = self._inner.close_code, self._inner.close_reason
        if self._lost.is_set() or code is None or code in _NO_FRAME:
            return _RESTARTING, ""
        return _NORMAL if code == _EMPTY_FRAME else code, reason or ""


class RelayedSockets:
    """All relayed sockets of this editor. A socket to an editor that is frozen would stay open in
    silence, so the database is asked once a second whether that editor still owns the stream."""

    def __init__(self, peers: Callable[[], Peers]) -> None:
        self._peers = peers
        self._open: dict[str, set[RelayedSocket]] = {}  # by the URL of the other editor
        self._looking: asyncio.Task[None] | None = None
        self._ending: set[asyncio.Task[None]] = set()

    async def serve(self, socket: RelayedSocket, receive: Receive, send: Send) -> None:
        """Accept a client's socket, and pass its messages on until one side closes it. `receive`,
        `send`: of the client."""
        self._open.setdefault(socket.url, set()).add(socket)
        if self._looking is None or self._looking.done():
            self._looking = asyncio.create_task(self._look(), name="relayed sockets")
        try:
            await receive()  # websocket.connect
            await send({"type": "websocket.accept", "subprotocol": None, "headers": []})
            closing = await socket.served()
        finally:
            self._open[socket.url].discard(socket)
            # An editor that is frozen answers no close frame, and nobody waits for it.
            end = asyncio.create_task(socket.aclose())
            self._ending.add(end)
            end.add_done_callback(self._ending.discard)
        if closing is not None:
            code, reason = closing
            with anyio.move_on_after(_GOODBYE_S):
                await send({"type": "websocket.close", "code": code, "reason": reason})

    async def _look(self) -> None:
        while any(self._open.values()):
            await asyncio.sleep(_LOOK_S)
            for url, sockets in list(self._open.items()):
                try:
                    await self._close_lost(url, sockets)
                except Unavailable as error:  # rooms close by themselves if nothing can be stored
                    log.warning("it cannot be asked who owns relayed graphs: %s", error.detail)

    async def _close_lost(self, url: str, sockets: set[RelayedSocket]) -> None:
        """Close the sockets whose stream the editor at `url` does not own any more. Nearly always
        it lives and owns all, and one question is enough."""
        streams = {socket.stream for socket in sockets}
        for n, stream in enumerate(streams):
            if await self._peers().is_owner(stream, url):
                if n == 0:
                    return
                continue
            for socket in [each for each in sockets if each.stream == stream]:
                socket.lose()
