"""Sends requests and sockets of a graph to the editor that owns it (decision 175).

It stands behind the access control, so the identity of the client is known and is relayed too.
Requests that another editor has relayed do not pass here, so nothing is relayed twice.
"""

import asyncio
import logging
import re
from collections.abc import Callable, Iterable
from contextlib import AbstractAsyncContextManager
from typing import Any, Final

import httpx
from litestar.enums import ScopeType
from litestar.types import ASGIApp, HTTPScope, Receive, Scope, Send, WebSocketScope

from action_assistant.editor.cluster.owners import Elsewhere, Owner
from action_assistant.editor.cluster.peers import Call, OpenSocket, Peers, Refusal, plain_target
from action_assistant.editor.cluster.relayed_sockets import RelayedSocket, RelayedSockets
from action_assistant.editor.log.graph_events import graph_stream
from action_assistant.errors import OutcomeUnknown, Refused, TooLarge
from action_assistant.web.http.refusals import refuse, refuse_socket
from action_assistant.web.server.application import BODY_LIMIT

log: Final = logging.getLogger(__name__)

#: Called with a stream. Returns a context with its owner.
Owned = Callable[[str], AbstractAsyncContextManager[Owner]]

_OF_A_GRAPH: Final = re.compile(
    r"/api/graphs/(?!(?:names|labels|thumbnails)(?:/|$))([^/]+)(?:/.*)?|/api/actions/([^/]+)/umrf"
)
#: Header fields that go along: what an answer depends on, and nothing by which anybody is let in.
_PASSED: Final = frozenset(
    {b"accept", b"accept-encoding", b"accept-language", b"content-type", b"if-none-match"}
)
#: Header fields of an answer that are of its connection, or that each server writes itself.
_OWN: Final = frozenset(
    {b"connection", b"keep-alive", b"transfer-encoding", b"date", b"server", b"content-length"}
)


def stream_of(path: str) -> str | None:
    """Return the stream to whose owner a request for this path belongs; None for paths that every
    editor answers itself. Those with `.` or `..` are such: no route has one, and a client that
    sends them on resolves them to another path."""
    if not {".", ".."}.isdisjoint(path.split("/")):
        return None
    found = _OF_A_GRAPH.fullmatch(path)
    return None if found is None else graph_stream(found[1] or found[2])


class Relay:
    """An ASGI middleware that relays requests about graphs of other editors, and passes all others
    to `app`. `owned` says who owns a stream."""

    def __init__(self, app: ASGIApp, owned: Owned, peers: Callable[[], Peers]) -> None:
        self._app = app
        self._owned = owned
        self._peers = peers
        self._sockets: Final = RelayedSockets(peers)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or relay it. The parameters are those of ASGI."""
        is_call = scope["type"] in {ScopeType.HTTP, ScopeType.WEBSOCKET}
        stream = stream_of(scope["path"]) if is_call else None
        if stream is None or "identity" not in scope["state"]:
            await self._app(scope, receive, send)
            return
        call: Any = scope
        try:
            async with self._owned(stream) as owner:
                if isinstance(owner, Elsewhere):
                    relay = self._http if scope["type"] == ScopeType.HTTP else self._socket
                    await relay(stream, call, receive, send)
                else:
                    await self._app(scope, receive, send)
        except Refused as refused:
            await refuse(call, receive, send, refused)

    # --- requests ---------------------------------------------------------------------------------

    async def _http(self, stream: str, scope: HTTPScope, receive: Receive, send: Send) -> None:
        body = await whole_body(receive)
        call = _call_of(scope, scope["method"], body)
        async with self._peers().answer(stream, call) as answer:
            if answer is None:  # it can be answered here by now
                await self._app(scope, Replayed(body, receive), send)
                return
            passing = asyncio.create_task(_pass_answer(answer, send))
            leaving = asyncio.create_task(_disconnected(receive))
            try:
                await asyncio.wait([passing, leaving], return_when=asyncio.FIRST_COMPLETED)
                if passing.done():
                    passing.result()
            finally:
                passing.cancel()
                leaving.cancel()

    async def _socket(
        self, stream: str, scope: WebSocketScope, receive: Receive, send: Send
    ) -> None:
        found = await self._peers().socket(stream, _call_of(scope, "GET", b""))
        match found:
            case None:
                await self._app(scope, receive, send)
            case Refusal(status, headers, body):
                fields = [(name.encode(), value.encode("latin-1")) for name, value in headers]
                await refuse_socket(receive, send, status, _kept(fields), body)
            case OpenSocket(url, inner):
                socket = RelayedSocket(stream, url, inner, scope["state"]["plain"])
                await self._sockets.serve(socket, receive, send)


class Replayed:
    """Gives a body that was read once more, and then what follows it."""

    def __init__(self, body: bytes, receive: Receive) -> None:
        self._body: bytes | None = body
        self._receive = receive

    async def __call__(self) -> Any:
        """Return the next message of the request."""
        body, self._body = self._body, None
        if body is None:
            return await self._receive()
        return {"type": "http.request", "body": body, "more_body": False}


def _call_of(scope: Any, method: str, body: bytes) -> Call:
    target = plain_target(scope.get("raw_path") or scope["path"].encode(), scope["query_string"])
    headers = [
        (name.decode("latin-1"), value.decode("latin-1"))
        for name, value in scope["headers"]
        if name.lower() in _PASSED
    ]
    client = scope.get("client")
    return Call(method, target, headers, body, client[0] if client else "")


async def whole_body(receive: Receive) -> bytes:
    """Return the body of a request. Raise TooLarge beyond what any route takes."""
    pieces: list[bytes] = []
    size, more = 0, True
    while more:
        message: Any = await receive()
        if message["type"] != "http.request":
            raise OutcomeUnknown("The client has left.")
        pieces.append(message.get("body", b""))
        size += len(pieces[-1])
        more = message.get("more_body", False)
        if size > BODY_LIMIT:
            raise TooLarge(f"At most {BODY_LIMIT // 1_000_000} MB are read.")
    return b"".join(pieces)


async def _disconnected(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass


async def _pass_answer(answer: httpx.Response, send: Send) -> None:
    """Send the answer of another editor to the client. If it ends early, the connection of the
    client ends, as it would at the other editor."""
    start: Any = {
        "type": "http.response.start",
        "status": answer.status_code,
        "headers": _kept(answer.headers.raw),
    }
    await send(start)
    try:
        async for piece in answer.aiter_raw():
            await send({"type": "http.response.body", "body": piece, "more_body": True})
    except httpx.HTTPError as error:
        raise ConnectionError("the answer of another editor ended early") from error
    await send({"type": "http.response.body", "body": b"", "more_body": False})


def _kept(fields: Iterable[tuple[bytes, bytes]]) -> list[tuple[bytes, bytes]]:
    return [(name.lower(), value) for name, value in fields if name.lower() not in _OWN]
