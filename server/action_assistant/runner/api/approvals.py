"""The routes of approvals: the yes of a second person to a graph, which some robots demand before a
start."""

from datetime import datetime
from typing import Annotated, Any

import msgspec
from litestar import Request, get, post
from litestar.params import Parameter
from litestar.types import ControllerRouterHandler

from action_assistant.runner.api.caller import author_of
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.runs import views
from action_assistant.runner.runs.events import Author
from action_assistant.runner.start.approvals import ApprovalGiven, ApprovalRequest
from action_assistant.web.auth.access import Needs


class Approval(msgspec.Struct, frozen=True, kw_only=True):
    """A person's yes to exactly the graph with this digest."""

    digest: str
    author: Author
    at: datetime
    graph: str | None
    version: str
    note: str


def routes(services: RunnerServices) -> list[ControllerRouterHandler]:
    """Return the routes to read and to give approvals."""

    @get(
        "/api/approvals",
        summary="The approvals of a graph, by its digest",
        operation_id="listApprovals",
    )
    async def approvals(
        digest: Annotated[str, Parameter(min_length=64, max_length=64)],
    ) -> list[Approval]:
        return [_view(each) for each in await services.control.approvals.given_for(digest)]

    @post(
        "/api/approvals",
        summary="Say yes to exactly one graph, so that somebody else may start it on robots that "
        "demand a second person",
        operation_id="approve",
        guards=[Needs("operate")],
    )
    async def approve(data: ApprovalRequest, request: Request[Any, Any, Any]) -> Approval:
        return _view(await services.control.approvals.give(data, author_of(request)))

    return [approvals, approve]


def _view(given: ApprovalGiven) -> Approval:
    return Approval(
        digest=given.digest,
        author=given.author,
        at=views.time(given.at),
        graph=given.graph,
        version=given.version,
        note=given.note,
    )
