"""Access control of both processes: Host, Origin and credentials, before any route and any
upgrade.
"""

import asyncio
import getpass
import logging
import re
import time
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any, Final, NamedTuple

import anyio
from litestar.connection import ASGIConnection
from litestar.enums import ScopeType
from litestar.handlers.base import BaseRouteHandler
from litestar.types import ASGIApp, HTTPScope, Message, Receive, Scope, Send, WebSocketScope
from msgspec.structs import replace

from action_assistant.errors import (
    Forbidden,
    Refused,
    Unauthenticated,
    Withdrawn,
    WrongHost,
    WrongOrigin,
)
from action_assistant.logs import request_id
from action_assistant.web.auth.caller import Caller, Origin, network_address, set_caller
from action_assistant.web.auth.identity import (
    Credential,
    Identity,
    NoTokens,
    NoViews,
    Standing,
    Token,
    Tokens,
    View,
    Views,
)
from action_assistant.web.auth.keys import SERVER_OWNER, Keys, Person, ScrapeToken, Session
from action_assistant.web.auth.revocations import (
    SESSION_ENDED,
    Revocations,
    SessionGuards,
    sealed_standing,
)
from action_assistant.web.auth.rights import Denied, Thing, may, unconfirmed
from action_assistant.web.auth.roles import OWNER, Permission
from action_assistant.web.auth.standing import Standings
from action_assistant.web.http.plain_texts import require_plain_address
from action_assistant.web.http.refusals import answer, refuse
from action_assistant.web.network.addresses import Addresses

log: Final = logging.getLogger(__name__)

#: Under this name the state of a request has what wants to be told who asks.
KNOWN: Final = "known"
#: Cookies of one name: each is tried against our seal, and whoever plants more gains nothing.
_TRIED: Final = 50
_BLANKS: Final = " \t"
_CALLS: Final = frozenset({"http", "websocket"})
_SAFE: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_STOPS: Final = re.compile(r"/api/stop|/api/(runs|robots)/[^/]+/stop")
_LIVE: Final = "/api/live"
_EVENTS: Final = "/api/events"
_GOODBYE: Final = 1.0  # seconds that a close frame gets
_POLICY: Final = b"content-security-policy"
#: Stands for the program with the token for scraping, which reads the metrics only.
_SCRAPER: Final = Person("scrape", "Metrics", "viewer")
_HEADERS: Final = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
)
_UNFRAMED: Final = (b"x-frame-options", b"DENY")


def cookie_name(page_port: int) -> str:
    """Return the name of the session cookie. Browsers send cookies to every port of a host, so the
    name holds the port of the page."""
    return f"aa_{page_port}"


def device_cookie_name(page_port: int) -> str:
    """Return the name of the cookie that identifies a browser, whoever signs in."""
    return f"aa_{page_port}_device"


def identity_of(connection: ASGIConnection[Any, Any, Any, Any]) -> Identity:
    """Return the identity behind a request. Only routes behind the access control that are not
    `Open` may call this."""
    identity: Identity = connection.scope["state"]["identity"]
    return identity


def person_of(connection: ASGIConnection[Any, Any, Any, Any]) -> Person:
    """Return the person who sent a request, under the same condition as `identity_of`."""
    return identity_of(connection).person


def device_of(connection: ASGIConnection[Any, Any, Any, Any]) -> str:
    """Return the id of the browser; "" if it has none yet."""
    device: str = connection.scope["state"].get("device", "")
    return device


def session_of(connection: ASGIConnection[Any, Any, Any, Any]) -> Session | None:
    """Return the browser's session; None for programs with a token."""
    session: Session | None = connection.scope["state"].get("session")
    return session


def require(
    connection: ASGIConnection[Any, Any, Any, Any],
    permission: Permission,
    thing: Thing | None = None,
) -> None:
    """Raise Forbidden, with the reason, if the identity of this connection may not do this, or has to
    confirm first who they are. Reading asks for no confirmation."""
    identity = identity_of(connection)
    decision = may(identity, permission, thing, now=time.time())
    if isinstance(decision, Denied):
        raise Forbidden(decision.reason)
    is_change = connection.scope.get("method", "GET") not in _SAFE
    if is_change and (reason := unconfirmed(identity, permission)):
        raise Forbidden(reason, where={"item": "confirm"})


class DeclaredRight:
    """A guard that declares who may call a route. A route without one stops the program."""

    async def __call__(
        self, connection: ASGIConnection[Any, Any, Any, Any], _: BaseRouteHandler
    ) -> None:
        """Raise a refusal unless the request may go on. This is a coroutine since a plain function
        would run in a thread, for which Stop had to wait."""


class Open(DeclaredRight):
    """Declares a route that answers strangers, too. The access control lets all requests to its
    path pass, so every route of that path has to be open."""


class SignedIn(DeclaredRight):
    """Declares a route for everybody who is signed in, and for all tokens."""


class PersonOnly(DeclaredRight):
    """Declares a route for everybody who is signed in, and for no token of a program."""

    async def __call__(
        self, connection: ASGIConnection[Any, Any, Any, Any], _: BaseRouteHandler
    ) -> None:
        """Raise Forbidden if a program asks."""
        if identity_of(connection).token is not None:
            raise Forbidden("A program's token may not do this: it takes a person.")


class OfLink(DeclaredRight):
    """Declares a route for links that show one thing, and for nobody else. The thing is in the key
    of the link, never in the path. Links reach no route that does not declare this."""

    async def __call__(
        self, connection: ASGIConnection[Any, Any, Any, Any], _: BaseRouteHandler
    ) -> None:
        """Raise Forbidden if a person or a program asks."""
        if "view" not in connection.scope["state"]:
            raise Forbidden("Only a link for looking at one thing opens this.")


class Needs(DeclaredRight):
    """Declares a route for those who have a permission. Others are refused before their request
    is read."""

    def __init__(self, permission: Permission) -> None:
        self.permission: Final = permission

    async def __call__(
        self, connection: ASGIConnection[Any, Any, Any, Any], _: BaseRouteHandler
    ) -> None:
        """Raise Forbidden if the identity lacks the permission."""
        require(connection, self.permission)


def view_of(connection: ASGIConnection[Any, Any, Any, Any]) -> View:
    """Return the link by which somebody looks. Only routes that are `OfLink` may call this."""
    view: View = connection.scope["state"]["view"]
    return view


def expired_session(connection: ASGIConnection[Any, Any, Any, Any]) -> Session | None:
    """Return the expired session of this browser; None if there is none. It proves only that the
    same person is back."""
    session: Session | None = connection.scope["state"].get("expired")
    return session


def is_expired(connection: ASGIConnection[Any, Any, Any, Any]) -> bool:
    """Return whether the session or token of an open socket has expired by now. It then allows
    nothing but Stop."""
    check: Callable[[], bool] = connection.scope["state"].get("is_expired", lambda: False)
    return check()


def live_session(connection: ASGIConnection[Any, Any, Any, Any]) -> Session:
    """Return the session of the browser. If there is none, raise the refusal that says why: for
    example, the session has ended."""
    state = connection.scope["state"]
    session: Session | None = state.get("session")
    if session is None:
        ended: Refused = state.get("ended") or _ended(None)
        raise ended
    return session


class Plain(NamedTuple):
    """A connection as the server below gave it: for sockets whose every message counts."""

    receive: Receive
    send: Send


def plain(connection: ASGIConnection[Any, Any, Any, Any]) -> Plain:
    """Return the receive and send functions of a connection as the server gave them, before the
    access layer wrapped `send`. Answers to requests need the wrapped function."""
    found: Plain = connection.scope["state"]["plain"]
    return found


class Access:
    """An ASGI middleware that authenticates each request and refuses strangers.

    `is_open(path, accepts_html)` says which paths need no credentials; `policy(host, path)` returns
    the Content-Security-Policy for a page at this path under that Host header, and `is_framed(path)`
    whether other sites may show it in a frame. `tokens` knows the tokens of programs, `views` the
    links that show one thing; `is_of_link(path)` says which paths such a link may ask for: every
    other one is refused. `relay`: a middleware that sends some requests to other editors of this server;
    None for a server with one. `standings`: knows what sessions and tokens are worth now; without it they are
    worth what they say themselves.
    """

    def __init__(
        self,
        app: ASGIApp,
        *,
        keys: Keys,
        addresses: Addresses,
        page_port: int,
        is_open: Callable[[str, bool], bool],
        policy: Callable[[str, str], str],
        revoked: Revocations,
        is_of_link: Callable[[str], bool] = lambda _: False,
        is_framed: Callable[[str], bool] = lambda _: False,
        scraped: ScrapeToken | None = None,
        tokens: Tokens | None = None,
        views: Views | None = None,
        standings: Standings | None = None,
        relay: Callable[[ASGIApp], ASGIApp] | None = None,
    ) -> None:
        self._app = app
        self._relaying = app if relay is None else relay(app)
        self._standings = standings
        self._scraped = scraped or ScrapeToken()
        self._tokens = tokens or NoTokens()
        self._views = views or NoViews()
        self._is_of_link = is_of_link
        self._is_framed = is_framed
        self._keys = keys
        self._addresses = addresses
        self._cookie = cookie_name(page_port)
        self._device_cookie = device_cookie_name(page_port)
        self._is_open = is_open
        self._policy = policy
        self._revoked = revoked
        self._leashes = SessionGuards(revoked, self._standing_while_open)
        self._local = Person(SERVER_OWNER, _user_name(), OWNER)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse, or pass on with `state.identity` set."""
        if scope["type"] not in _CALLS:  # lifespan
            await self._app(scope, receive, send)
            return
        headers = _headers(scope)
        scope.setdefault("state", {})["plain"] = Plain(receive, send)
        send = self._dressed(headers, scope["path"], send)
        try:
            preflight = self._admit(scope, headers)
        except Refused as refused:
            await refuse(scope, receive, send, refused)
            return
        if preflight:
            await answer(send, 204, [(b"cache-control", b"no-store")], b"")
            return
        identity: Identity | None = scope["state"].get("identity")
        if identity is not None and identity.person is _SCRAPER:
            identity = None  # as nobody: there is nothing else to be found out
        way = _Way.of(scope, headers)
        del headers  # of a socket they would be kept for as long as it is open
        await self._pass(self._relaying, scope, receive, send, identity, way)

    async def relayed(
        self,
        scope: HTTPScope | WebSocketScope,
        receive: Receive,
        send: Send,
        identity: Identity,
    ) -> None:
        """Pass on a request that another editor of this server has admitted for `identity`, and end it when
        the session or token ends."""
        state = scope.setdefault("state", {})
        state |= {"plain": Plain(receive, send), "identity": identity, "device": identity.device}
        credential = identity.session or identity.token
        state |= {} if identity.session is None else {"session": identity.session}
        if credential is not None:
            state["is_expired"] = lambda: self._standing(credential).expired
        way = _Way.of(scope, _headers(scope))
        await self._pass(self._app, scope, receive, send, identity, way)

    async def _pass(
        self,
        app: ASGIApp,
        scope: HTTPScope | WebSocketScope,
        receive: Receive,
        send: Send,
        identity: Identity | None,
        way: "_Way",
    ) -> None:
        """Pass a request that was admitted on to `app`, with its client as the caller. `identity`: None for a
        stranger, and for whoever looks by a link."""
        asked: Receive | None = None
        if scope["type"] == ScopeType.HTTP:
            receive, asked = _after_body(receive, has_body=way.has_body)
        view: View | None = scope["state"].get("view")
        if identity is not None:
            scope["state"].get(KNOWN, _nobody)(identity.person.id)
            set_caller(_caller(identity, asked))
        else:  # who looks by a link waits for nobody but others with this link
            set_caller(None if view is None else Caller(f"view-{view.id}", asked))
        credential = view if identity is None else identity.session or identity.token
        if credential is None or not way.lasts:
            await app(scope, receive, send)
        else:
            await self._leashed(credential, app, scope, receive, send)

    async def _leashed(
        self,
        credential: Credential,
        app: ASGIApp,
        scope: HTTPScope | WebSocketScope,
        receive: Receive,
        send: Send,
    ) -> None:
        """Pass the request on, and end it when the session or token ends. A socket for Stop goes on
        if the session has only expired."""
        begun = over = False

        async def sent(message: Message) -> None:
            nonlocal begun, over
            begun = True
            over = message["type"] == "websocket.close" or message.get("more_body") is False
            await send(message)

        # What is shown for long shows only what the person may still see; a request goes on.
        is_stream = scope["type"] == ScopeType.WEBSOCKET or scope["path"] == _EVENTS
        with self._leashes.hold(
            credential, outlives=scope["path"] == _LIVE, follows_groups=is_stream
        ) as leash:
            try:
                await app(scope, receive, sent)
                if not leash.is_cut:
                    return
                await asyncio.sleep(0)  # the cancellation may still be on its way
            except asyncio.CancelledError:
                if not leash.is_cut:
                    raise
        leash.let_go()
        log.info("a session has ended: %s is closed", scope["path"])
        last: Any = {"type": "http.response.body", "body": b"", "more_body": False}
        if scope["type"] == ScopeType.WEBSOCKET:
            last = {"type": "websocket.close", "code": SESSION_ENDED, "reason": "session ended"}
        elif not begun:
            await refuse(scope, receive, send, self._over(credential))
            return
        if not over:
            with anyio.move_on_after(_GOODBYE):
                await send(last)

    def _admit(self, scope: HTTPScope | WebSocketScope, headers: dict[str, str]) -> bool:
        """Authenticate a request, and let it pass. Return True if it is a CORS preflight (an
        OPTIONS request of a browser) that is answered here without a session, False for any other
        request that may pass. Raise WrongHost, WrongOrigin or another refusal for the rest."""
        if not self._addresses.allows_host(headers.get("host")):
            raise WrongHost(f"This server is not called {headers.get('host', '')!r}.")
        origin = headers.get("origin")
        if origin is not None and not self._addresses.allows_origin(origin):
            raise WrongOrigin(f"Pages of {origin!r} may not talk to this server.")
        if origin is not None and scope["path"].startswith(
            "/api/"
        ):  # the page itself has to say it
            replaced = self._addresses.replaced_host(headers.get("host"), origin)
            if replaced is not None:
                raise WrongHost(replaced)
        method = scope.get("method", "GET") if scope["type"] == ScopeType.HTTP else "WEBSOCKET"
        if method == "OPTIONS" and "access-control-request-method" in headers:
            return True
        self._identify(scope, headers, method=str(method), origin=origin)
        if not _is_stop(str(method), scope["path"]):
            require_plain_address(scope.get("raw_path", b""), scope["query_string"])
        return False

    def _identify(
        self,
        scope: HTTPScope | WebSocketScope,
        headers: dict[str, str],
        *,
        method: str,
        origin: str | None,
    ) -> None:
        state = scope.setdefault("state", {})
        path = scope["path"]
        device = state["device"] = self._device(headers)
        address = client_address(scope)
        scheme, _, text = headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer":
            view = self._views.opens(text.strip())
            if view is not None:
                if method != "GET" or not self._is_of_link(path):
                    raise Forbidden("This link shows one thing, and opens nothing else.")
                state["view"] = view
                return
            found = self._program(text.strip(), method, path)
            if found is not None:
                state["identity"] = replace(found, device=device, address=address)
                token = found.token
                if token is not None:
                    self._tokens.note_use(token.id, address)
                    state["is_expired"] = lambda: self._standing(token).expired
                return
        genuine = self._sessions(headers)
        state["sessions"] = genuine
        stops = _is_stop(method, path)
        session = self._lasting(genuine, stops=stops)
        ended = session is not None and self._revoked.ends(session)
        if session is not None and not ended:
            standing = self._standing(session, stops=stops)
        if session is not None and not ended and (not standing.expired or stops):
            if origin is None and method not in _SAFE:
                raise WrongOrigin("A browser says which page is asking; this request does not.")
            if headers.get("sec-fetch-site") == "cross-site" and path.startswith("/api/"):
                raise WrongOrigin("Other sites may not use this session.")
            if self._standings is not None and not standing.expired:
                self._standings.browsers.use(session.id)
            state["session"] = session
            state["identity"] = Identity(
                standing.person,
                standing.groups,
                session,
                device=device,
                address=address,
                confirmed_at=standing.confirmed_at,
                asked_at=time.time(),
                ask_again=standing.ask_again,
            )
            state["is_expired"] = lambda: self._standing(session).expired
            return
        if session is not None and not self._revoked.ended(session):
            state["expired"] = session  # good for nothing but being the same person again
        state["ended"] = _ended(None) if session is None else self._over(session)
        if not self._is_open(path, "text/html" in headers.get("accept", "")):
            raise state["ended"]

    def _program(self, text: str, method: str, path: str) -> Identity | None:
        """Return the identity of a program with this token; None if the text is no token of this
        server. Raise Unauthenticated or Withdrawn for a token that opens nothing any more."""
        if self._keys.opens(text):
            return Identity(self._local)
        if self._scraped.opens(method, path, text):
            return Identity(_SCRAPER)
        token = self._tokens.opens(text)
        if token is None:
            return None
        stops = _is_stop(method, path)
        standing = self._standing(token, stops=stops)
        if self._revoked.ends(token) or (standing.expired and not stops):
            raise self._over(token)
        return Identity(standing.person, standing.groups, token=token)

    def _standing_while_open(self, credential: Credential) -> Standing:
        """Return the standing of an open connection, which counts as use of its session."""
        standing = self._standing(credential)
        in_use = isinstance(credential, Session) and not standing.expired
        if self._standings is not None and in_use:
            self._standings.browsers.use(credential.id)
        return standing

    def _standing(self, credential: Credential, *, stops: bool = False) -> Standing:
        """Return the present standing. Before a Stop (`stops`) that of the credential itself counts
        where the present one cannot be read: neither a role nor a confirmation decides about it."""
        if self._standings is None:
            return sealed_standing(credential)
        try:
            return self._standings.of(credential)
        except Exception:
            if not stops:
                raise
            log.exception("a Stop goes on without the present rights of its person")
            return sealed_standing(credential)

    def _over(self, credential: Credential) -> Refused:
        """Return the refusal for a session, token or link that has expired or was ended."""
        if isinstance(credential, View):
            return over_view(is_revoked=self._revoked.view_ended(credential.id))
        if self._revoked.person_ended(credential.person.id):
            return Withdrawn("Your access was ended by an owner. Ask for a new link.")
        if isinstance(credential, Token):
            if self._revoked.token_ended(credential.id):
                return Withdrawn(f"The token {credential.name!r} was revoked.")
            return Unauthenticated(f"The token {credential.name!r} has expired.")
        signed_out = self._revoked.ended(credential)
        return _ended(credential, signed_out=signed_out, expired=self._standing(credential).expired)

    def _sessions(self, headers: dict[str, str]) -> list[Session]:
        """Return the sessions of all cookies that this server sealed. A browser may send several,
        one for each path at which this server was reachable."""
        tried = map(self._keys.session, cookie_values(headers.get("cookie", ""), self._cookie))
        return [each for each in tried if each is not None]

    def _device(self, headers: dict[str, str]) -> str:
        """Return the id of the browser from the first cookie that this server sealed; "" if there
        is none."""
        given = cookie_values(headers.get("cookie", ""), self._device_cookie)
        return next(filter(None, map(self._keys.device, given)), "")

    def _lasting(self, genuine: list[Session], *, stops: bool = False) -> Session | None:
        """Return the first session that is neither expired nor revoked. If there is none, return
        the first session, or None if `genuine` is empty."""
        lasting = (
            each
            for each in genuine
            if not (self._standing(each, stops=stops).expired or self._revoked.ends(each))
        )
        return next(lasting, genuine[0] if genuine else None)

    def _dressed(self, headers: dict[str, str], path: str, send: Send) -> Send:
        """Add the headers that every answer carries, also refusals."""
        extra = list(_HEADERS) if self._is_framed(path) else [*_HEADERS, _UNFRAMED]
        origin = headers.get("origin")
        if origin is not None and self._addresses.allows_origin(origin):
            extra += [
                (b"access-control-allow-origin", origin.encode()),
                (b"access-control-allow-credentials", b"true"),
                (b"access-control-allow-methods", b"GET, POST, PATCH, PUT, DELETE"),
                (b"access-control-allow-headers", b"authorization, content-type, last-event-id"),
                (b"access-control-expose-headers", b"location, x-request-id, x-total"),
                (b"access-control-max-age", b"600"),
                (b"vary", b"origin"),
            ]
        name = request_id()
        if name is not None:
            extra.append((b"x-request-id", name.encode()))
        public = self._addresses.public_at(headers.get("host", ""))
        if public is not None and public.is_signed_for:
            extra.append((b"strict-transport-security", b"max-age=31536000"))
        policy = self._policy(headers.get("host", ""), path).encode("latin-1", "replace")

        async def dressed(message: Message) -> None:
            if message["type"] in {"http.response.start", "websocket.http.response.start"}:
                own = list(message.get("headers", []))
                # The documentation has a stricter one.
                if all(name != _POLICY for name, _ in own):
                    own.append((_POLICY, policy))
                message["headers"] = [*own, *extra]
            await send(message)

        return dressed


class _Way(NamedTuple):
    """The way that a request goes on: `lasts` as `_lasts` says, `has_body` if there is one to be read."""

    lasts: bool
    has_body: bool

    @classmethod
    def of(cls, scope: HTTPScope | WebSocketScope, headers: dict[str, str]) -> "_Way":
        return cls(_lasts(scope, headers), headers.get("content-length", "0") != "0")


def _after_body(receive: Receive, *, has_body: bool) -> tuple[Receive, Receive]:
    """Return two functions for the messages of one request: for its route, and for whoever waits
    until its client has disconnected. The latter takes nothing of the body, which a guard that works
    for long would lose: it waits until the route has read it."""
    is_read = anyio.Event()
    if not has_body:
        is_read.set()

    async def for_route() -> Any:
        message = await receive()
        if not message.get("more_body", False):
            is_read.set()
        return message

    async def after_body() -> Any:
        await is_read.wait()
        return await receive()

    return for_route, after_body


def _caller(identity: Identity, receive: Receive | None) -> Caller:
    """Return the client of a request, with the connection by which its person acts."""
    return Caller(identity.person.id, receive, identity.device, origin_by(identity), identity)


def origin_by(identity: Identity) -> Origin:
    """Return the connection by which an identity acts, as events keep it."""
    session, token = identity.session, identity.token
    own = "server" if session is None else ""
    return Origin(
        name=identity.person.name,
        session="" if session is None else session.id,
        token=own if token is None else token.id,
        address=identity.address,
    )


def client_address(scope: HTTPScope | WebSocketScope) -> str:
    """Return the address of the client on the network; "" for this computer itself, and for text
    that is no address."""
    client = scope.get("client")
    return network_address(client[0] if client else "")


def _nobody(_: str) -> None:
    """Ignore which person a connection belongs to."""


def _ended(session: Session | None, *, signed_out: bool = False, expired: bool = False) -> Refused:
    """Return the refusal for a client whose session is missing, signed out, expired or revoked."""
    if session is None:
        return Unauthenticated(
            "Open the link that the server printed, or send its token as a Bearer token."
        )
    if signed_out:
        return Unauthenticated("This session was ended: come in by a link again.")
    if expired:
        return Unauthenticated("Your session has ended: open the link that the server printed.")
    return Withdrawn("The link that you came in by was revoked. Ask for another one.")


def over_view(*, is_revoked: bool) -> Refused:
    """Return the refusal for a link to one thing that was revoked or has expired."""
    if is_revoked:
        return Withdrawn("This link was revoked. Ask for another one.")
    return Unauthenticated("This link has expired. Ask for another one.")


def _lasts(scope: HTTPScope | WebSocketScope, headers: dict[str, str]) -> bool:
    """Return whether a connection may stay open for long: a WebSocket or a stream of events."""
    if scope["type"] == ScopeType.WEBSOCKET:
        return True
    return "text/event-stream" in headers.get("accept", "") or scope["path"].endswith("/events")


def _is_stop(method: str, path: str) -> bool:
    return method == "POST" and _STOPS.fullmatch(path) is not None


def _headers(scope: HTTPScope | WebSocketScope) -> dict[str, str]:
    """Return the header fields by lower-case name. The values of a repeated field are joined, so
    that a repeated Host or Origin matches nothing."""
    found: dict[str, str] = {}
    for raw, value in scope["headers"]:
        name = raw.decode("latin-1").lower()
        text = value.decode("latin-1")
        joiner = "; " if name == "cookie" else ", "
        found[name] = f"{found[name]}{joiner}{text}" if name in found else text
    return found


def _user_name() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # no such user in this container
        return "operator"


def cookie_values(header: str, name: str) -> Iterator[str]:
    """Yield the values of the cookies of this name in a Cookie header, in order. Never raises.

    `http.cookies` gives up at the first malformed cookie, such as `g_state={"i_l":0}`. Browsers
    (RFC 6265, 5.4) send the cookies of all programs of this host, on any port.
    """
    pairs = (each.partition("=") for each in header.split(";"))
    ours = (value for found, sign, value in pairs if sign and found.strip(_BLANKS) == name)
    for value in islice(ours, _TRIED):
        plain = value.strip(_BLANKS)
        yield plain[1:-1] if len(plain) > 1 and plain[0] == plain[-1] == '"' else plain
