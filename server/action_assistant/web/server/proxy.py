"""Behind a proxy: the address of a request, and the part of its path that is the proxy's."""

import ipaddress
import re
from typing import Any, Final

from litestar import route
from litestar.params import FromPath
from litestar.types import (
    ASGIApp,
    ControllerRouterHandler,
    HTTPScope,
    Message,
    Receive,
    Scope,
    Send,
    WebSocketScope,
)

from action_assistant.errors import Misrouted
from action_assistant.public_url import RUNNER, Network
from action_assistant.web.auth.access import Needs
from action_assistant.web.http.requests import PROXIED

#: The key, in the state of a request, of the path at which the client sees the page.
MOUNT: Final = "mount"
#: The key, in the state of a request, of the function to call with the address of a proxy's client.
ASKED: Final = "asked"
_CALLS: Final = frozenset({"http", "websocket"})
_WITH_PORT: Final = re.compile(r"\[(.+)\](?::\d+)?|([0-9.]+):\d+")
_Address = ipaddress.IPv4Address | ipaddress.IPv6Address


class Forwarded:
    """An ASGI middleware that sets `scope["client"]` to the client that asked the last trusted
    proxy.

    Of `X-Forwarded-For` only the end counts, which trusted proxies wrote; everybody can write its
    beginning. Nothing else that proxies say is read: the public address is a setting.
    """

    def __init__(self, app: ASGIApp, proxies: tuple[Network, ...]) -> None:
        self._app = app
        self._proxies = proxies

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on to the application. If it comes from a trusted proxy, the client's
        address is replaced by the address that the proxy names in its header. The parameters are
        those of ASGI."""
        if scope["type"] in _CALLS and self._proxies:
            peer: Any = scope.get("client")
            if peer and self.is_proxy(peer[0]):
                scope.setdefault("state", {})[PROXIED] = True
            found = self._client_behind(peer[0], _forwarded(scope)) if peer else None
            if found is not None:
                scope.get("state", {}).get(ASKED, _ignore_client)(found)
                changed: Any = {**scope, "client": (found, 0)}
                scope = changed
        await self._app(scope, receive, send)

    def _client_behind(self, peer: str, chain: list[str]) -> str | None:
        """Return the address of the client behind trusted proxies; None if the peer itself is the
        client. `chain`: the addresses of X-Forwarded-For, the last proxy's client at the end; it is
        used up."""
        found = None
        address = _address(peer)
        while address is not None and self._believes(address) and chain:
            address = _address(chain.pop())
            found = str(address) if address is not None else found
        return found

    def is_proxy(self, peer: str) -> bool:
        """Return whether the address `peer` is that of a trusted proxy."""
        address = _address(peer)
        return address is not None and self._believes(address)

    def _believes(self, address: _Address) -> bool:
        return any(address in each for each in self._proxies)


class Mounted:
    """An ASGI middleware that removes the path `mount` at which a proxy shows this server.

    Proxies pass paths on unchanged. A path without the mount is answered too: it comes from this
    computer, or through a proxy that removes the mount itself.
    """

    def __init__(self, app: ASGIApp, mount: str) -> None:
        self._app = app
        self._mount = mount
        self._raw = mount.encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on without the mount in its path. The parameters are those of ASGI."""
        if not self._mount or scope["type"] not in _CALLS:
            await self._app(scope, receive, send)
            return
        call: Any = scope
        path: str = call["path"]
        if path == self._mount and call["type"] == "http":
            await _lead(send, f"{path}/")
            return
        if path.startswith(f"{self._mount}/"):
            raw: bytes = call.get("raw_path") or path.encode()
            call = {
                **call,
                "path": path.removeprefix(self._mount),
                "raw_path": raw.removeprefix(self._raw),
            }
            call.setdefault("state", {})[MOUNT] = self._mount
            send = self._located(send)
        await self._app(call, receive, send)

    def _located(self, send: Send) -> Send:
        """Return a `send` that adds the mount to the Location header."""

        async def located(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [
                    (name, self._raw + value)
                    if name.lower() == b"location" and value.startswith(b"/")
                    else (name, value)
                    for name, value in message.get("headers", [])
                ]
            await send(message)

        return located


def misrouted(runner_port: int) -> ControllerRouterHandler:
    """Return the editor's route for requests that a proxy should have sent to the runner, at
    `runner_port`. It answers each with an error that says so."""

    @route(
        f"{RUNNER}/{{rest:path}}",
        http_method=["GET", "POST", "PATCH", "DELETE"],
        guards=[Needs("see")],
        include_in_schema=False,
    )
    async def astray(rest: FromPath[str]) -> None:
        raise Misrouted(
            f"The proxy leads what is below {RUNNER}/ to the editor; it has to lead it to the runner, "
            f"on port {runner_port}."
        )

    return astray


def _ignore_client(_: str) -> None:
    """Ignore the address of the client, since no part asked for it."""


async def _lead(send: Send, location: str) -> None:
    fields = [(b"location", location.encode()), (b"content-length", b"0")]
    start: Any = {"type": "http.response.start", "status": 308, "headers": fields}
    end: Any = {"type": "http.response.body", "body": b"", "more_body": False}
    await send(start)
    await send(end)


def _forwarded(scope: HTTPScope | WebSocketScope) -> list[str]:
    """Return the addresses in the X-Forwarded-For headers of a request; the last is the client of
    the last proxy. Empty without such a header."""
    fields = (
        value.decode("latin-1")
        for name, value in scope["headers"]
        if name.lower() == b"x-forwarded-for"
    )
    return [each.strip() for field in fields for each in field.split(",")]


def _address(text: str) -> _Address | None:
    """Parse an address, also one with a port as some proxies write it; return None for any other
    text."""
    found = _WITH_PORT.fullmatch(text)
    try:
        address = ipaddress.ip_address(found[1] or found[2] if found else text)
    except ValueError:
        return None
    return getattr(address, "ipv4_mapped", None) or address
