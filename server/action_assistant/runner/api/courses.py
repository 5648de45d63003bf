"""The routes of expected courses: saved, removed, checked against a graph, and proposed."""

from typing import Any

from litestar import Request, Response, delete, get, post
from litestar.types import ControllerRouterHandler

from action_assistant.runner.analysis.course_checks import (
    ArrowProposal,
    CheckedCourses,
    CheckRequest,
    ProposalRequest,
    propose,
)
from action_assistant.runner.analysis.expected_runs import Expect, Expectation
from action_assistant.runner.api.caller import COUNTED, GRAPH_BODY, author_of, body_of
from action_assistant.runner.api.review import json_of
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.review.stored_runs import StoredRuns
from action_assistant.runner.start.admission import decoded
from action_assistant.web.auth.access import Needs
from action_assistant.web.server.openapi import reads

_Asking = Request[Any, Any, Any]


def routes(services: RunnerServices) -> list[ControllerRouterHandler]:
    """Return the routes of expected courses."""
    return [*_saving(services), *_checking(services)]


def _saving(services: RunnerServices) -> list[ControllerRouterHandler]:
    @get(
        "/api/expectations",
        summary="Courses that graphs are expected to take",
        operation_id="listExpectations",
    )
    async def listed() -> Response[list[Expectation]]:
        return json_of(
            await services.worker_queries.text(StoredRuns.expectations), list[Expectation]
        )

    @post(
        "/api/expectations",
        summary="Save the course of a run, or of a dry-run, as an expected course",
        operation_id="addExpectation",
        opt=reads(Expect) | COUNTED,
        guards=[Needs("edit")],
        request_max_body_size=GRAPH_BODY,
    )
    async def expect(request: _Asking) -> Expectation:
        async with body_of(request, services.body_limit) as body:
            wanted = decoded(body, Expect)
            return await services.review_service.expect(wanted, author_of(request))

    @delete(
        "/api/expectations/{name:str}",
        summary="Remove an expected course",
        operation_id="retireExpectation",
        guards=[Needs("edit")],
    )
    async def retire(name: str, request: _Asking) -> None:
        await services.review_service.retire(name, author_of(request))

    return [listed, expect, retire]


def _checking(services: RunnerServices) -> list[ControllerRouterHandler]:
    @post(
        "/api/expectations/check",
        operation_id="checkExpectations",
        status_code=200,
        summary="The expected courses of a graph against it as it is now, and what they cover",
        opt=reads(CheckRequest) | COUNTED,
        guards=[Needs("see")],
        request_max_body_size=GRAPH_BODY,
    )
    async def check(request: _Asking) -> Response[CheckedCourses]:
        async with body_of(request, services.body_limit) as body:
            check_request = decoded(body, CheckRequest)
            text = await services.worker_queries.text(
                StoredRuns.checked_courses,
                check_request.graph,
                bytes(check_request.umrf),
                check_request.subgraphs,
            )
        return json_of(text, CheckedCourses)

    @post(
        "/api/expectations/proposal",
        operation_id="proposeCourse",
        status_code=200,
        summary="What actions would have to do for an arrow to be taken, if anything makes it so",
        opt=reads(ProposalRequest) | COUNTED,
        guards=[Needs("see")],
        request_max_body_size=GRAPH_BODY,
    )
    async def proposal(request: _Asking) -> ArrowProposal:
        async with body_of(request, services.body_limit) as body:
            wanted = decoded(body, ProposalRequest)
            return await services.run_in_worker(
                propose, bytes(wanted.umrf), wanted.arrow, wanted.subgraphs
            )

    return [check, proposal]
