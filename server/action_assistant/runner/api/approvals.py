"""The routes of approvals: who has said yes to an order, the yes of a second person, and the question to
others."""

from datetime import datetime
from typing import Annotated, Any

import msgspec
from litestar import Request, get, post
from litestar.params import Parameter
from litestar.types import ControllerRouterHandler

from action_assistant.runner.api.caller import author_of
from action_assistant.runner.api.run_guard import unseen_by
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.runs import views
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.sight import Unseen
from action_assistant.runner.start.approvals import (
    HIDDEN_ORDER,
    ApprovalAsked,
    ApprovalGiven,
    ApprovalQuestion,
    ApprovalRequest,
)
from action_assistant.runner.start.orders import OrderLine
from action_assistant.umrf.start_values import StartValues
from action_assistant.web.auth.access import Needs, PersonOnly, identity_of, session_of

_Asking = Request[Any, Any, Any]


class Approval(msgspec.Struct, frozen=True, kw_only=True):
    """A person's yes to exactly the graph with this digest."""

    digest: str
    author: Author
    at: datetime
    graph: str | None
    version: str
    note: str


class ApprovalWanted(msgspec.Struct, frozen=True, kw_only=True):
    """A person's question for the yes of others to a start: `digest` is that of its whole order, and
    `order` says all of it in words, by a look of the runner (nothing where that is not known);
    `values` are those that it gives the graph, `tree_digest` is that of its version, "" if not known.
    `hidden`: why the reader sees no more than who asks and for which robots, "" if they see all of it."""

    digest: str
    author: Author
    at: datetime
    robots: tuple[str, ...]
    version: str
    values: StartValues
    order: tuple[OrderLine, ...]
    tree_digest: str
    hidden: str = ""


class AskedOthers(msgspec.Struct, frozen=True):
    """The number of receivers to which the question is sent."""

    receivers: int


def routes(services: RunnerServices) -> list[ControllerRouterHandler]:
    """Return the routes of approvals."""

    @get(
        "/api/approvals",
        summary="The approvals of a graph, by its digest, of people who may still give them",
        operation_id="listApprovals",
        description="Of a start with values, overrides or several robots `digest` is the "
        "`order_digest` of its pre-flight, which says the same in words (`order`), else the tree digest. "
        "That of a repeat, or of a turn in the queue, comes with its own `look`.",
        guards=[Needs("see")],
    )
    async def given_for(
        request: _Asking,
        digest: Annotated[str, Parameter(min_length=64, max_length=64)],
    ) -> list[Approval]:
        unseen = unseen_by(services, request)
        given = await services.control.approvals.given_for(digest)
        return [
            _approval(each)
            for each in given
            if services.control.approvals.counts(each)
            and (unseen is None or each.graph not in unseen.graphs)
        ]

    @post(
        "/api/approvals",
        summary="Say yes to exactly one graph, so that somebody else may start it on robots that "
        "demand a second person",
        operation_id="approve",
        guards=[PersonOnly(), Needs("operate")],
    )
    async def approve(data: ApprovalRequest, request: _Asking) -> Approval:
        me, approvals = identity_of(request), services.control.approvals
        services.control.sight.require_graphs(me, data.graph)
        await approvals.require_seen(data.digest, data.graph, me)
        session = session_of(request)
        is_named = session is None or session.personal
        return _approval(await approvals.give(data, author_of(request), is_named=is_named))

    @post(
        "/api/approvals/asked",
        status_code=202,
        summary="Ask others for their yes to exactly one graph, where messages are sent",
        operation_id="askApproval",
        guards=[PersonOnly(), Needs("operate")],
    )
    async def ask(data: ApprovalQuestion, request: _Asking) -> AskedOthers:
        services.control.sight.require_graphs(identity_of(request), data.graph)
        await services.control.approvals.ask(data, author_of(request))
        receivers = services.notifications.receivers
        return AskedOthers(sum("approval.asked" in each.kinds for each in receivers))

    @get(
        "/api/approvals/asked",
        summary="For which starts of a graph people asked others for their yes within the last day, the "
        "newest first",
        operation_id="listAskedApprovals",
        guards=[Needs("see")],
    )
    async def wanted(
        request: _Asking, graph: Annotated[str, Parameter(max_length=100)]
    ) -> list[ApprovalWanted]:
        services.control.sight.require_graphs(identity_of(request), graph)
        found = await services.control.approvals.questions_of(graph)
        unseen = unseen_by(services, request)
        return [shown_to(each, unseen) for each in found]

    return [given_for, approve, ask, wanted]


def shown_to(asked: ApprovalAsked, unseen: Unseen | None) -> ApprovalWanted:
    """Return a question as people see it. `unseen`: the graphs that the reader may not see."""
    who: dict[str, Any] = {
        "author": asked.author,
        "at": views.time(asked.at),
        "robots": asked.robots,
    }
    if unseen is not None and unseen.hides(asked.graphs):
        blank: dict[str, Any] = {
            "digest": "",
            "version": "",
            "values": {},
            "order": (),
            "tree_digest": "",
        }
        return ApprovalWanted(**who, **blank, hidden=HIDDEN_ORDER)
    return ApprovalWanted(
        **who,
        digest=asked.digest,
        version=asked.version,
        values=asked.values,
        order=asked.order,
        tree_digest=asked.tree_digest,
    )


def _approval(given: ApprovalGiven) -> Approval:
    return Approval(
        digest=given.digest,
        author=given.author,
        at=views.time(given.at),
        graph=given.graph,
        version=given.version,
        note=given.note,
    )
