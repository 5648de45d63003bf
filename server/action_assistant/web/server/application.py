"""The ASGI application of either process: Litestar inside, access control around it."""

import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path
from typing import Annotated, Any, Final, NamedTuple

import msgspec
from litestar import Litestar, MediaType, Request, Response, get
from litestar.handlers.base import BaseRouteHandler
from litestar.params import Parameter
from litestar.routes import ASGIRoute, BaseRoute, HTTPRoute, WebSocketRoute
from litestar.types import ASGIApp, ControllerRouterHandler, HTTPScope, Receive, Scope, Send

from action_assistant.errors import CannotStart, NotFound
from action_assistant.version import VERSION, commit
from action_assistant.web.auth.access import Access, DeclaredRight, Needs, OfLink, Open
from action_assistant.web.auth.identity import NoTokens, Tokens, Views
from action_assistant.web.auth.keys import METRICS, Keys, ScrapeToken, ServerProof
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import Permission
from action_assistant.web.auth.standing import Standings
from action_assistant.web.http.plain_texts import PlainRequest
from action_assistant.web.http.problems import problem_handlers
from action_assistant.web.http.requests import RequestCounts, Requests
from action_assistant.web.http.static_files import HelpSite, Page
from action_assistant.web.monitoring.monitoring import Monitoring
from action_assistant.web.monitoring.readiness import Readiness
from action_assistant.web.monitoring.status import ProcessStatus
from action_assistant.web.network.addresses import Addresses, host_name
from action_assistant.web.server.openapi import OpenApiText, document, openapi_config
from action_assistant.web.server.proxy import MOUNT, Mounted, misrouted

log: Final = logging.getLogger(__name__)

#: The path of the page that shows one thing by a link: the only one that a frame may show.
VIEW: Final = "/view"
BODY_LIMIT: Final = 10_000_000  # bytes; a graph file of 10 MB is refused with 413


class Health(msgspec.Struct, frozen=True):
    """The answer of a process that is alive. `commit`: of this program, null if unknown."""

    status: str
    version: str
    commit: str | None


Lifespan = Callable[[Litestar], AbstractAsyncContextManager[None]]


def application(
    route_handlers: Sequence[ControllerRouterHandler],
    *,
    title: str,
    keys: Keys,
    revoked: Revocations,
    addresses: Addresses,
    page_port: int,
    lifespan: Sequence[Lifespan] = (),
    monitoring: Monitoring | None = None,
    scraped: ScrapeToken | None = None,
    tokens: Tokens | None = None,
    views: Views | None = None,
    frames: Sequence[str] = (),
    standings: Standings | None = None,
    page: Path | None = None,
    help_site: Path | None = None,
    runner_port: int | None = None,
    more_runners: Sequence[int] = (),
    mount: str = "",
    body_limit: int = BODY_LIMIT,
    relay: Callable[[ASGIApp], ASGIApp] | None = None,
) -> "Application":
    """Return the whole ASGI application of a process. `title`: the title of its OpenAPI document;
    `keys`, `revoked`: how clients are authenticated; `addresses`, `page_port`: the hosts and
    origins that may call it; `lifespan`: contexts for as long as it runs. `body_limit`: bytes of a
    request body, unless a route has its own limit. `page`, `help_site`, `runner_port`: only for the
    editor, which serves the built page and the documentation, and names the runner in the
    Content-Security-Policy; `more_runners`: the ports of further ones on this computer. `mount`: the path at which a proxy serves this process. `scraped`: the
    token that allows /metrics only. `tokens`: the tokens of programs; `views`: the links that show
    one thing, `frames`: the origins of sites that may show these in a frame. `standings`: knows
    what sessions and tokens are worth now. `relay`: as `Access` takes it. Raise CannotStart if a route declares no right."""
    handlers = [
        *route_handlers,
        *_health(monitoring),
        _proving(keys, tokens or NoTokens()),
        *([misrouted(runner_port)] if runner_port is not None else []),
    ]
    runner_ports = () if runner_port is None else (runner_port, *more_runners)
    openapi = OpenApiText()
    refusals: list[CannotStart] = []
    inner = _routed(
        handlers, title, [_noted(each, refusals) for each in lifespan], body_limit, openapi
    )
    rights = _declared_rights(inner)
    openapi.make = lambda: document(inner, rights.needed, rights.open_paths.__contains__)

    def root_of(scope: HTTPScope) -> str:
        state: dict[str, Any] = scope.get("state", {})
        public = addresses.public_at(_host(scope))
        return str(state.get(MOUNT) or (public.path if public is not None else ""))

    built, is_public = _with_built(inner, page, help_site, root_of)
    access = Access(
        built,
        keys=keys,
        addresses=addresses,
        page_port=page_port,
        is_open=lambda path, html: path in rights.open_paths or is_public(path, html),
        policy=lambda host, path: _policy(
            addresses, host, page_port, runner_ports, frames if path == VIEW else ()
        ),
        revoked=revoked,
        is_of_link=rights.link_paths.__contains__,
        is_framed=lambda path: bool(frames) and path == VIEW,
        scraped=scraped,
        tokens=tokens,
        views=views,
        standings=standings,
        relay=relay,
    )
    outer = Mounted(Requests(access, _counts(monitoring)), mount)
    return Application(outer, openapi, access, refusals)


def _noted(lifespan: Lifespan, refusals: list[CannotStart]) -> Lifespan:
    """Return the same context, which notes why it cannot be entered: what starts it only hears that it
    failed."""

    @asynccontextmanager
    async def noted(app: Litestar) -> AsyncIterator[None]:
        try:
            async with lifespan(app):
                yield
        except CannotStart as error:
            refusals.append(error)
            raise

    return noted


def _counts(monitoring: Monitoring | None) -> RequestCounts:
    return RequestCounts() if monitoring is None else monitoring.requests


def _with_built(
    inner: ASGIApp,
    page: Path | None,
    help_site: Path | None,
    root_of: Callable[[HTTPScope], str],
) -> tuple[ASGIApp, Callable[[str, bool], bool]]:
    """Return an application that answers the requests for files of the built page and
    documentation, and passes all others to `inner`. `page`, `help_site`: the folders of the built
    files, None without them. `root_of` returns the path prefix of the page for a request. The
    second result is a function (path, accepts HTML) that returns whether the page or the
    documentation answers the path."""
    shown = Page(inner, page, root_of) if page is not None else None
    helped = HelpSite(shown or inner, help_site) if help_site is not None else None

    def is_public(path: str, accepts_html: bool) -> bool:
        if helped is not None and helped.knows(path):
            return True
        return shown is not None and shown.knows(path, accepts_html)

    return helped or shown or inner, is_public


def _routed(
    handlers: list[ControllerRouterHandler],
    title: str,
    lifespan: Sequence[Lifespan],
    body_limit: int,
    openapi: OpenApiText,
) -> Litestar:
    """Return the Litestar application with its routes, error handlers and OpenAPI document, but
    without authentication."""
    return Litestar(
        handlers,
        request_class=PlainRequest,
        exception_handlers=problem_handlers(),
        lifespan=list(lifespan),
        openapi_config=openapi_config(title, openapi),
        request_max_body_size=body_limit,
        logging_config=None,
    )


def _host(scope: HTTPScope) -> str:
    return dict(scope["headers"]).get(b"host", b"").decode("latin-1")


class _Rights(NamedTuple):
    """The declared rights of all routes: the permission by path and method, the paths that answer
    strangers, and those that answer a link that shows one thing."""

    needed: dict[tuple[str, str], Permission]
    open_paths: frozenset[str]
    link_paths: frozenset[str]


def _declared_rights(inner: Litestar) -> _Rights:
    """Return the rights that all routes declare. Raise CannotStart if an HTTP route or a socket
    declares none, or if a path is open, or for links, by one method only."""
    needed: dict[tuple[str, str], Permission] = {}
    paths: dict[bool, set[str]] = {True: set(), False: set()}
    links: dict[bool, set[str]] = {True: set(), False: set()}
    for route in inner.routes:
        for method, handler in _methods(route):
            declared = [
                each for each in handler.resolve_guards() if isinstance(each, DeclaredRight)
            ]
            if not declared:
                raise CannotStart(f"{method} {route.path_format} does not declare who may call it.")
            paths[isinstance(declared[-1], Open)].add(route.path_format)
            links[isinstance(declared[-1], OfLink)].add(route.path_format)
            if isinstance(declared[-1], Needs):
                needed[route.path_format, method.lower()] = declared[-1].permission
    for path in sorted(paths[True] & paths[False]):
        raise CannotStart(f"{path} is open to strangers by some of its methods only.")
    for path in sorted(links[True] & links[False]):
        raise CannotStart(f"{path} is for links by some of its methods only.")
    return _Rights(needed, frozenset(paths[True]), frozenset(links[True]))


def _methods(route: BaseRoute) -> Iterator[tuple[str, BaseRouteHandler]]:
    """Yield the methods of a route, and their handlers. The answers to OPTIONS are Litestar's."""
    if isinstance(route, HTTPRoute):
        for handler in route.route_handlers:
            yield from ((method, handler) for method in handler.http_methods - {"OPTIONS"})
    elif isinstance(route, ASGIRoute | WebSocketRoute):
        yield "WEBSOCKET" if isinstance(route, WebSocketRoute) else "ASGI", route.route_handler


class Application:
    """The application of a process, with its OpenAPI document for programs that generate types from it.
    `access`: its access control; `entrance`: what answers other editors of the server at a listener of
    its own, None without one; `drain`: called when the process is told to end, before its connections
    are closed, to let other processes take over; `end`: lets the process end in order, None before it
    serves; `refusals`: why it cannot start or go on."""

    end: Callable[[], None] | None = None
    entrance: ASGIApp | None = None
    drain: Callable[[], Awaitable[None]] | None = None

    def __init__(
        self,
        outer: ASGIApp,
        openapi: OpenApiText,
        access: Access,
        refusals: list[CannotStart],
    ) -> None:
        self.refusals: Final = refusals
        self._outer = outer
        self._openapi = openapi
        self.access: Final = access

    def give_up(self, why: CannotStart) -> None:
        """Let the process end in order, as one that cannot go on."""
        self.refusals.append(why)
        if self.end is not None:
            self.end()

    def openapi(self) -> bytes:
        """Return the OpenAPI document as JSON. This is slow."""
        return self._openapi.made()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await self._outer(scope, receive, send)


def _policy(
    addresses: Addresses,
    host: str,
    page_port: int,
    runner_ports: Sequence[int],
    frames: Sequence[str],
) -> str:
    connect = "'self'"
    public = addresses.public_at(host)
    if runner_ports and public is not None:
        connect += f" {_socket(public.origin)}"  # for older browsers it is not part of 'self'
    elif runner_ports and host_name(host):
        connect += f" {_socket(addresses.direct(host, page_port))}"
        runners = (addresses.direct(host, port) for port in runner_ports)
        connect += "".join(f" {runner} {_socket(runner)}" for runner in runners)
    none = "'none'"
    return (
        "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
        f"img-src 'self' data: blob:; font-src 'self'; connect-src {connect}; object-src 'none'; "
        f"base-uri 'none'; form-action 'self'; frame-ancestors {' '.join(frames) or none}"
    )


def _socket(url: str) -> str:
    return url.replace("http", "ws", 1)


_PASSED_ON: Final = ("x-forwarded-for", "forwarded", "via")


def _proving(keys: Keys, tokens: Tokens) -> ControllerRouterHandler:
    keys.prove("", "")  # takes a moment, once

    @get(
        "/api/server",
        summary="That this server knows the token, before anybody shows it",
        operation_id="proveServer",
        guards=[Open()],
    )
    async def prove(
        request: Request[Any, Any, Any],
        challenge: Annotated[str, Parameter(min_length=20, max_length=100)],
        token: Annotated[str, Parameter(max_length=40)] = "",
    ) -> Response[ServerProof]:
        host, port = request.scope.get("server") or ("", 0)
        # Behind a proxy the address of a request proves nothing: anybody could pass it on.
        passed_on = any(name in request.headers for name in _PASSED_ON)
        address = "" if passed_on else f"{host}:{port}"
        proof = keys.prove(challenge, address)
        if token:
            of_token = tokens.prove(token, challenge, address)
            proof = ServerProof(proof.address, proof.proof, of_token)
        return Response(proof, headers={"cache-control": "no-store"})

    return prove


def _health(monitoring: Monitoring | None) -> list[ControllerRouterHandler]:
    health = Health("ok", VERSION, commit())

    @get(
        "/healthz", summary="Whether the process answers", operation_id="getHealth", guards=[Open()]
    )
    async def healthz() -> Health:
        return health

    @get(
        "/readyz",
        summary="Whether the process can do its work, and which part of it cannot",
        operation_id="getReadiness",
        guards=[Open()],
    )
    async def readyz() -> Response[Readiness]:
        found = await monitoring.readiness() if monitoring is not None else Readiness(ready=True)
        return Response(found, status_code=200 if found.ready else 503)

    @get(
        METRICS,
        media_type=MediaType.TEXT,
        summary="Measures, as Prometheus reads them",
        operation_id="getMetrics",
        guards=[Needs("scrape")],
    )
    async def metrics() -> Response[str]:
        text = await monitoring.exposition() if monitoring is not None else ""
        return Response(text, media_type="text/plain; version=0.0.4")

    @get(
        "/api/status",
        guards=[Needs("restore")],
        summary="How the process is: versions, room, queues, what goes on",
        operation_id="getStatus",
    )
    async def status() -> ProcessStatus:
        if monitoring is None:
            raise NotFound("Nobody looks at this process.")
        return await monitoring.status()

    return [healthz, readyz, metrics, status]
