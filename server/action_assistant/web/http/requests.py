"""Gives each request an id that its answer, its problem and its log lines share."""

import logging
import re
import secrets
import time
from collections import Counter
from collections.abc import Callable
from typing import Any, Final

from litestar.enums import ScopeType
from litestar.types import ASGIApp, Message, Receive, Scope, Send

from action_assistant.logs import begin

log: Final = logging.getLogger(__name__)

#: The key, in the state of a request, that is set if a trusted proxy has sent it.
PROXIED: Final = "proxied"
HEADER: Final = b"x-request-id"

_CALLS: Final = frozenset({"http", "websocket"})
#: Statuses of refusals for lack of credentials, of another host or origin, and of too many tries.
_REFUSALS: Final = frozenset({401, 403, 429})
#: The state of a request has one of these if it is known who sent it.
_KNOWN: Final = frozenset({"person", "identity"})
_ID: Final = re.compile(rb"[\w.:/+=-]{1,64}", re.ASCII)
#: The kind of thing that a path names.
_SUBJECT: Final = re.compile(r"/api/(run|graph)s/([^/]{1,64})(?=/|$)")


class RequestCounts:
    """Counts answered requests and open connections. Only the event loop may change it."""

    def __init__(self) -> None:
        self.answered: Final[Counter[int]] = Counter()  # requests, by status
        self.open: Final[Counter[str]] = Counter()  # connections that are busy, by kind
        #: Called with the address, and method and path, of each refused request of a stranger.
        self.refused_stranger: Callable[[str, str], None] = _ignore_stranger


def _ignore_stranger(_address: str, _what: str) -> None:
    """Ignore a refused request of a stranger."""


class Requests:
    """An ASGI middleware that names and counts requests."""

    def __init__(self, app: ASGIApp, counts: RequestCounts) -> None:
        self._app = app
        self._counts = counts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass an HTTP or WebSocket request on with a request id, and count it while it is open.
        The parameters are those of ASGI."""
        if scope["type"] not in _CALLS:  # lifespan
            await self._app(scope, receive, send)
            return
        kind = str(scope["type"])
        ids = {"request": _id_of(scope)}
        about = _SUBJECT.match(scope["path"])
        if about is not None:
            ids[about[1]] = about[2]
        begin(ids)
        self._counts.open[kind] += 1
        try:
            if kind == ScopeType.HTTP:
                await self._answer(scope, receive, send)
            else:  # a WebSocket: its messages are passed on without a wrapper
                await self._app(scope, receive, send)
                self._count_stranger(scope)
        finally:
            self._counts.open[kind] -= 1

    async def _answer(self, scope: Any, receive: Receive, send: Send) -> None:
        begun, status = time.perf_counter(), 0

        async def sent(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                self._counts.answered[status] += 1
                if status in _REFUSALS:
                    self._count_stranger(scope)
            await send(message)

        await self._app(scope, receive, sent)
        if log.isEnabledFor(logging.DEBUG):
            took = 1e3 * (time.perf_counter() - begun)
            log.debug("%s %s: %d in %.1f ms", scope["method"], scope["path"], status, took)

    def _count_stranger(self, scope: Any) -> None:
        """Count a refused request, unless it is known who sent it."""
        if not _KNOWN & scope.get("state", {}).keys():
            client = scope.get("client")
            what = f"{scope.get('method', 'WEBSOCKET')} {scope['path']}"
            self._counts.refused_stranger(client[0] if client else "", what)


def _id_of(scope: Any) -> str:
    """Return the request id that a trusted proxy gave to a request, or else a new one."""
    if scope.get("state", {}).get(PROXIED):
        for name, value in scope["headers"]:
            if name.lower() == HEADER and _ID.fullmatch(value):
                return str(value.decode())
    return secrets.token_hex(8)
