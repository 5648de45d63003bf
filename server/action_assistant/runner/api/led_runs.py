"""The routes for the commands of people to led runs."""

from typing import Any

from litestar import Request, post, put
from litestar.types import ControllerRouterHandler

from action_assistant.runner.api.caller import author_of
from action_assistant.runner.api.refused_starts import StartNeeds, noted
from action_assistant.runner.api.run_guard import require_command_role
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.runs import views
from action_assistant.runner.start.admission import (
    BreakpointsRequest,
    GoOnRequest,
    StepRequest,
    WaitRequest,
    WordRequest,
    decoded,
)
from action_assistant.web.audit.events import StartRefused
from action_assistant.web.auth.access import Needs, PersonOnly, identity_of
from action_assistant.web.server.openapi import reads

_Asking = Request[Any, Any, Any]


def routes(services: RunnerServices) -> list[ControllerRouterHandler]:
    """Return the routes: wait, go on, step, breakpoints, and outcomes by word."""

    @post(
        "/api/runs/{run:str}/go_on",
        operation_id="goOn",
        description="Answered once stored.",
        status_code=202,
        summary="Let a held run go on: its robots may begin to move",
        opt=reads(GoOnRequest),
        guards=[StartNeeds(services, "go_on", of_people=True)],
    )
    async def go_on(run: str, request: _Asking) -> views.RunShown:
        asked = decoded(await request.body(), GoOnRequest)
        with noted(services, request, StartRefused(what="go_on", why="", run=run[:100])):
            await require_command_role(services, run, request)
            me = identity_of(request)
            return views.run_view(await services.control.go_on(run, asked, author_of(request), me))

    @post(
        "/api/runs/{run:str}/step",
        operation_id="stepRun",
        description="Answered once stored. `over` names an opened sub-graph as `levels` of its "
        "actions do.",
        status_code=202,
        summary="Let one action of a held run begin, then hold it again: a robot may begin to move",
        opt=reads(StepRequest),
        guards=[StartNeeds(services, "go_on", of_people=True)],
    )
    async def step(run: str, request: _Asking) -> views.RunShown:
        asked = decoded(await request.body(), StepRequest)
        with noted(services, request, StartRefused(what="go_on", why="", run=run[:100])):
            await require_command_role(services, run, request)
            me = identity_of(request)
            return views.run_view(await services.control.step(run, asked, author_of(request), me))

    @post(
        "/api/runs/{run:str}/wait",
        operation_id="waitRun",
        description="Answered once stored. `held.how` is `trouble`, `wait`, `step` or `breakpoint`;"
        " absent: `trouble`.",
        status_code=202,
        summary="Let a led run begin nothing further; what is under way goes on",
        opt=reads(WaitRequest | None),
        guards=[Needs("simulate")],
    )
    async def wait(run: str, request: _Asking) -> views.RunShown:
        asked = decoded(await request.body() or b"{}", WaitRequest)
        await require_command_role(services, run, request)
        return views.run_view(await services.control.wait(run, asked, author_of(request)))

    @put(
        "/api/runs/{run:str}/breakpoints",
        operation_id="setBreakpoints",
        description="The `test` of a value is `==`, `!=`, `<`, `<=`, `>` or `>=`.",
        status_code=202,
        summary="Set where a led run waits; taking one away is a start",
        opt=reads(BreakpointsRequest),
        guards=[StartNeeds(services, "go_on", of_people=True)],
    )
    async def breakpoints(run: str, request: _Asking) -> views.RunShown:
        asked = decoded(await request.body(), BreakpointsRequest)
        with noted(services, request, StartRefused(what="go_on", why="", run=run[:100])):
            await require_command_role(services, run, request)
            author, me = author_of(request), identity_of(request)
            return views.run_view(await services.control.set_breakpoints(run, asked, author, me))

    @post(
        "/api/runs/{run:str}/outcome",
        operation_id="giveOutcome",
        description="Of people only.",
        status_code=200,
        summary="Give the outcome of an action in a led run, where nothing shows it",
        opt=reads(WordRequest),
        guards=[PersonOnly(), Needs("operate")],
    )
    async def outcome(run: str, request: _Asking) -> views.RunShown:
        asked = decoded(await request.body(), WordRequest)
        me = identity_of(request)
        return views.run_view(
            await services.control.give_outcome(run, asked, author_of(request), me)
        )

    return [go_on, step, wait, breakpoints, outcome]
