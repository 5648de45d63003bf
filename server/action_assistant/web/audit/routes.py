"""The routes of the audit: both processes answer for their own log."""

from collections.abc import Awaitable, Callable
from datetime import datetime
from typing import Annotated, Any

import msgspec
from litestar import Request, Response, get, post
from litestar.params import Parameter
from litestar.types import ControllerRouterHandler

from action_assistant.errors import BadInput
from action_assistant.web.audit.events import AuditKept
from action_assistant.web.audit.rows import AuditFilter, AuditPage, kinds_of
from action_assistant.web.auth.access import Needs
from action_assistant.web.server.openapi import MOST_NUMBER, answer


def audit_routes(
    page: Callable[[AuditFilter], Awaitable[bytes]],
) -> list[ControllerRouterHandler]:
    """Return the route of the audit, for owners. `page` returns an `AuditPage` as JSON."""

    @get(
        "/api/audit",
        summary="Who did what, when and from where, as this process has it; the newest first",
        operation_id="listAudit",
        description="`before` is the cursor of the next page.",
        guards=[Needs("share")],
        responses={200: answer(AuditPage)},
    )
    async def list_audit(
        before: Annotated[int | None, Parameter(ge=1, le=MOST_NUMBER)] = None,
        limit: Annotated[int, Parameter(ge=1, le=1000)] = 100,
        person: str = "",
        robot: str = "",
        graph: str = "",
        kind: str = "",
        since: datetime | None = None,
        until: datetime | None = None,
        text: str = "",
    ) -> Response[bytes]:
        try:
            kinds = kinds_of(filter(None, kind.split(",")))
        except ValueError as error:
            raise BadInput(f"{error}.", where={"path": "/kind"}) from error
        wanted = AuditFilter(
            before=before,
            limit=limit,
            person=person,
            robot=robot,
            graph=graph,
            kinds=kinds,
            since=_us(since, "/since"),
            until=_us(until, "/until"),
            text=text,
        )
        return Response(await page(wanted), media_type="application/json")

    return [list_audit]


class KeptAudit(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The time around a run that an owner keeps as an incident: no row of the audit in it is dropped."""

    run: Annotated[str, msgspec.Meta(min_length=1, max_length=100)]
    since: datetime
    until: datetime


def keeping_routes(
    keep: Callable[[AuditKept, Request[Any, Any, Any]], Awaitable[None]],
) -> list[ControllerRouterHandler]:
    """Return the route by which the editor is told of an incident, for owners: the runner, which has
    it, does not know the editor. `keep` stores it."""

    @post(
        "/api/audit/kept",
        summary="Keep the audit of this process from being dropped around a run that is an incident",
        operation_id="keepAudit",
        guards=[Needs("share")],
        status_code=204,
    )
    async def keep_audit(data: KeptAudit, request: Request[Any, Any, Any]) -> None:
        since, until = _us(data.since, "/since"), _us(data.until, "/until")
        if since is None or until is None or until < since:
            raise BadInput("The end is before the beginning.", where={"path": "/until"})
        await keep(AuditKept(data.run, since, until), request)

    return [keep_audit]


def _us(moment: datetime | None, path: str) -> int | None:
    """Return a time in microseconds UTC; None for None. Raise BadInput, with `path` as its place,
    for one without an offset."""
    if moment is None:
        return None
    if moment.tzinfo is None:
        raise BadInput("A time needs its offset from UTC.", where={"path": path})
    return round(moment.timestamp() * 1_000_000)
