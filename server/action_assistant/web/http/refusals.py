"""Answers of requests and of upgrades to WebSockets that no route answers."""

import logging
from typing import Any, Final

from litestar.enums import ScopeType
from litestar.types import HTTPScope, Receive, Send, WebSocketScope

from action_assistant.errors import Refused
from action_assistant.web.http.problems import problem_of

log: Final = logging.getLogger(__name__)

#: Of a refused upgrade: who gets the same refusal without it is behind a proxy that passes none on.
REFUSED_SOCKET: Final = (b"x-refused", b"websocket")


async def refuse(
    scope: HTTPScope | WebSocketScope,
    receive: Receive,
    send: Send,
    refused: Refused,
    *,
    challenge: str = "Bearer",
) -> None:
    """Answer a request, or the upgrade request of a WebSocket, with a refusal. `challenge`: the scheme by
    which a stranger may show who they are."""
    log.info("refused %s: %s", scope["path"], refused.detail)
    body = problem_of(refused)
    fields = [(b"content-type", b"application/problem+json")]
    if scope["type"] == ScopeType.WEBSOCKET:
        fields.append(REFUSED_SOCKET)
    if refused.status == 401:
        fields.append((b"www-authenticate", challenge.encode()))
    if refused.status == 429:
        fields.append((b"retry-after", b"5"))
    if scope["type"] == ScopeType.WEBSOCKET:
        await refuse_socket(receive, send, refused.status, fields, body)
    else:
        await answer(send, refused.status, fields, body)


async def refuse_socket(
    receive: Receive, send: Send, status: int, fields: list[tuple[bytes, bytes]], body: bytes
) -> None:
    """Answer the upgrade request of a WebSocket with this status, these header fields and this body."""
    await receive()  # websocket.connect
    await answer(send, status, fields, body, prefix="websocket.")


async def answer(
    send: Send, status: int, fields: list[tuple[bytes, bytes]], body: bytes, prefix: str = ""
) -> None:
    """Answer a request with this status, these header fields and this body. `prefix`: of ASGI's messages; that
    of sockets is `websocket.`."""
    length = (b"content-length", str(len(body)).encode())
    start: Any = {
        "type": f"{prefix}http.response.start",
        "status": status,
        "headers": [*fields, length] if status != 204 else fields,
    }
    end: Any = {"type": f"{prefix}http.response.body", "body": body, "more_body": False}
    await send(start)
    await send(end)
