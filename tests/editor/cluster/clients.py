"""Stock clients of rooms, for tests of several editors."""

import asyncio
import contextlib
from collections.abc import Sequence
from contextlib import AbstractAsyncContextManager
from typing import Any, Final, Protocol

import httpx_ws
from pycrdt import (
    Doc,
    Map,
    YMessageType,
    create_sync_message,
    create_update_message,
    handle_sync_message,
)

#: Stock clients give a silent server up after 30 s; so do these, but sooner.
_SILENT_S: Final = 12.0


class Way(Protocol):
    """A way into rooms: an editor, or a proxy before several."""

    def socket(self, graph: str) -> AbstractAsyncContextManager[httpx_ws.AsyncWebSocketSession]: ...


async def closed(socket: httpx_ws.AsyncWebSocketSession) -> int:
    """Read until the server closes a socket, and return its code."""
    try:
        while True:
            await socket.receive_bytes(timeout=20)
    except httpx_ws.WebSocketDisconnect as end:
        return end.code


class Stubborn:
    """A stock client that connects again, by the same way or the next one, whatever happens, and
    counts what it wrote."""

    def __init__(self, name: str, ways: Sequence[Way], first: int, graph: str) -> None:
        self.doc = Doc[Any]()
        self.written: set[str] = set()
        self._name = name
        self._ways = ways
        self._at = first
        self._graph = graph
        self._things = self.doc.get("meta", type=Map)
        self._task = asyncio.create_task(self._stay_connected())

    def write(self) -> None:
        """Write something under a key of its own."""
        key = f"x/{self._name}-{len(self.written)}"
        self.written.add(key)
        self._things[key] = float(len(self.written))

    def has(self, keys: set[str]) -> bool:
        """Return whether it has all of these keys."""
        return keys <= set(self._things)

    async def _stay_connected(self) -> None:
        while True:
            way = self._ways[self._at % len(self._ways)]
            # Whatever ends a connection, and by which error of which library, such a client comes again.
            with contextlib.suppress(Exception):
                async with way.socket(self._graph) as session:
                    await self._serve(session)
            self._at += 1
            await asyncio.sleep(0.3)

    async def _serve(self, session: Any) -> None:
        """Speak the protocol of stock clients until the socket ends, or is silent for too long."""
        sent: list[bytes] = []
        news = asyncio.Event()

        def hear(event: Any) -> None:
            sent.append(event.update)
            news.set()

        async def tell() -> None:
            while True:
                await news.wait()
                news.clear()
                while sent:
                    await session.send_bytes(create_update_message(sent.pop(0)))

        subscription = self.doc.observe(hear)
        telling = asyncio.create_task(tell())
        try:
            await session.send_bytes(create_sync_message(self.doc))
            while not telling.done():
                message = await session.receive_bytes(timeout=_SILENT_S)
                if message[0] == YMessageType.SYNC:
                    answer = handle_sync_message(message[1:], self.doc)
                    if answer is not None:
                        await session.send_bytes(answer)
        finally:
            self.doc.unobserve(subscription)
            telling.cancel()

    async def aclose(self) -> None:
        """Leave for good."""
        self._task.cancel()
        await asyncio.wait([self._task])
