"""The route of the audit, which both processes have for their own log."""

from collections.abc import Awaitable, Callable
from datetime import datetime
from typing import Annotated

from litestar import Response, get
from litestar.params import Parameter
from litestar.types import ControllerRouterHandler

from action_assistant.errors import BadInput
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


def _us(moment: datetime | None, path: str) -> int | None:
    """Return a time in microseconds UTC; None for None. Raise BadInput, with `path` as its place,
    for one without an offset."""
    if moment is None:
        return None
    if moment.tzinfo is None:
        raise BadInput("A time needs its offset from UTC.", where={"path": path})
    return round(moment.timestamp() * 1_000_000)
