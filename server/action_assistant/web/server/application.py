"""The ASGI application of either process: Litestar inside, access control around it."""

import logging
from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import Annotated, Any, Final

import msgspec
from litestar import Litestar, MediaType, Request, Response, get
from litestar.connection import ASGIConnection
from litestar.handlers.base import BaseRouteHandler
from litestar.params import Parameter
from litestar.routes import HTTPRoute
from litestar.types import ASGIApp, ControllerRouterHandler, HTTPScope, Receive, Scope, Send

from action_assistant.errors import NotFound
from action_assistant.version import VERSION, commit
from action_assistant.web.auth.access import Access, Needs, require
from action_assistant.web.auth.keys import METRICS, Keys, ScrapeToken, ServerProof
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import Permission
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

BODY_LIMIT: Final = 10_000_000  # bytes; a graph file of 10 MB is refused with 413
_OPEN: Final = frozenset(
    {"/healthz", "/readyz", "/api/session", "/api/session/invitation", "/api/server"}
)
_SAFE: Final = frozenset({"GET", "HEAD", "OPTIONS"})


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
    page: Path | None = None,
    help_site: Path | None = None,
    runner_port: int | None = None,
    mount: str = "",
    body_limit: int = BODY_LIMIT,
) -> ASGIApp:
    """Return the whole ASGI application of a process. `title`: of its OpenAPI document; `keys`,
    `revoked`: how clients are authenticated; `addresses`, `page_port`: the hosts and origins that
    may call it; `lifespan`: contexts for as long as it runs. `body_limit`: bytes of a request body,
    unless a route has its own limit. `page`, `help_site`, `runner_port`: only for the editor, which
    serves the built page and the documentation, and names the runner in the
    Content-Security-Policy. `mount`: the path at which a proxy serves this process. `scraped`: the
    token that allows /metrics only."""
    handlers = [
        *route_handlers,
        *_health(monitoring),
        _proving(keys),
        *([misrouted(runner_port)] if runner_port is not None else []),
    ]
    openapi = OpenApiText()
    inner = _routed(handlers, title, lifespan, body_limit, openapi)

    def root_of(scope: HTTPScope) -> str:
        state: dict[str, Any] = scope.get("state", {})
        public = addresses.public_at(_host(scope))
        return str(state.get(MOUNT) or (public.path if public is not None else ""))

    built, is_public = _with_built(inner, page, help_site, root_of)
    outer: ASGIApp = Access(
        built,
        keys=keys,
        addresses=addresses,
        page_port=page_port,
        is_open=lambda path, html: _answers_strangers(path) or is_public(path, html),
        policy=lambda host: _policy(addresses, host, page_port, runner_port),
        revoked=revoked,
        scraped=scraped,
    )
    return _Described(Mounted(Requests(outer, _counts(monitoring)), mount), openapi)


def _counts(monitoring: Monitoring | None) -> RequestCounts:
    return RequestCounts() if monitoring is None else monitoring.requests


def _with_built(
    inner: ASGIApp,
    page: Path | None,
    help_site: Path | None,
    root_of: Callable[[HTTPScope], str],
) -> tuple[ASGIApp, Callable[[str, bool], bool]]:
    """Return the application `inner` behind the built page and documentation (None: without it),
    and a function that says which paths these answer. `root_of` returns the path prefix of the page
    for a request."""
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
    inner = Litestar(
        handlers,
        guards=[_undecided],
        exception_handlers=problem_handlers(),
        lifespan=list(lifespan),
        openapi_config=openapi_config(title, openapi),
        request_max_body_size=body_limit,
        logging_config=None,
    )
    decisions = _decisions(inner)
    openapi.make = lambda: document(inner, decisions, _answers_strangers)
    return inner


def _host(scope: HTTPScope) -> str:
    return dict(scope["headers"]).get(b"host", b"").decode("latin-1")


def _answers_strangers(path: str) -> bool:
    return path in _OPEN


def _decisions(inner: Litestar) -> dict[tuple[str, str], Permission]:
    """Return the permission that each route needs, by path and method. Reading needs no more than
    being signed in. Other routes have to name their permission; routes that do not are missing in
    the result, and only owners may call them."""
    found: dict[tuple[str, str], Permission] = {}
    for route in inner.routes:
        if not isinstance(route, HTTPRoute) or _answers_strangers(route.path_format):
            continue
        for handler in route.route_handlers:
            said = _said(handler)
            for method in handler.http_methods:
                if said is not None:
                    found[route.path_format, method.lower()] = said
                elif method in _SAFE:
                    found[route.path_format, method.lower()] = "see"
    return found


def _said(handler: BaseRouteHandler) -> Permission | None:
    for guard in handler.guards or ():
        if isinstance(guard, Needs):
            return guard.permission
    return None


async def _undecided(
    connection: ASGIConnection[Any, Any, Any, Any], handler: BaseRouteHandler
) -> None:
    """Guard of all routes: let only owners call a writing route for which no permission was chosen.
    Raise Forbidden for others."""
    if connection.scope.get("method", "GET") in _SAFE or _said(handler) is not None:
        return
    if not _answers_strangers(connection.scope["path"]):
        require(connection, "restore")


class _Described:
    """The application, with its OpenAPI document for programs that generate types from it."""

    def __init__(self, outer: ASGIApp, openapi: OpenApiText) -> None:
        self._outer = outer
        self._openapi = openapi

    def openapi(self) -> bytes:
        """Return the OpenAPI document as JSON. This is slow."""
        return self._openapi.made()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await self._outer(scope, receive, send)


def _policy(addresses: Addresses, host: str, page_port: int, runner_port: int | None) -> str:
    connect = "'self'"
    public = addresses.public_at(host)
    if runner_port is not None and public is not None:
        connect += f" {_socket(public.origin)}"  # for older browsers it is not part of 'self'
    elif runner_port is not None and host_name(host):
        page, runner = (addresses.direct(host, port) for port in (page_port, runner_port))
        connect += f" {_socket(page)} {runner} {_socket(runner)}"
    return (
        "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
        f"img-src 'self' data: blob:; font-src 'self'; connect-src {connect}; object-src 'none'; "
        "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
    )


def _socket(url: str) -> str:
    return url.replace("http", "ws", 1)


_PASSED_ON: Final = ("x-forwarded-for", "forwarded", "via")


def _proving(keys: Keys) -> ControllerRouterHandler:
    keys.prove("", "")  # takes a moment, once

    @get(
        "/api/server",
        summary="That this server knows the token, before anybody shows it",
        operation_id="proveServer",
    )
    async def prove(
        request: Request[Any, Any, Any],
        challenge: Annotated[str, Parameter(min_length=20, max_length=100)],
    ) -> Response[ServerProof]:
        host, port = request.scope.get("server") or ("", 0)
        # Behind a proxy the address of a request proves nothing: anybody could pass it on.
        passed_on = any(name in request.headers for name in _PASSED_ON)
        proof = keys.prove(challenge, "" if passed_on else f"{host}:{port}")
        return Response(proof, headers={"cache-control": "no-store"})

    return prove


def _health(monitoring: Monitoring | None) -> list[ControllerRouterHandler]:
    health = Health("ok", VERSION, commit())

    @get("/healthz", summary="Whether the process answers", operation_id="getHealth")
    async def healthz() -> Health:
        return health

    @get(
        "/readyz",
        summary="Whether the process can do its work, and which part of it cannot",
        operation_id="getReadiness",
    )
    async def readyz() -> Response[Readiness]:
        found = await monitoring.readiness() if monitoring is not None else Readiness(ready=True)
        return Response(found, status_code=200 if found.ready else 503)

    @get(
        METRICS,
        media_type=MediaType.TEXT,
        summary="Measures, as Prometheus reads them",
        operation_id="getMetrics",
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
