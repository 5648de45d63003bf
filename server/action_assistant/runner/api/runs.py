"""The routes of runs: starts, commands, queries, approvals, expected courses, and the live socket."""

from collections.abc import AsyncIterator
from datetime import UTC, datetime
from functools import partial
from typing import Annotated, Any, Final, get_args

import anyio
import msgspec
from litestar import Request, Response, WebSocket, delete, get, post, put, websocket
from litestar.exceptions import HTTPException
from litestar.openapi import ResponseSpec
from litestar.params import JSONBody, Parameter
from litestar.response import Stream
from litestar.types import ControllerRouterHandler

from action_assistant.errors import BadInput, NotFound, TooMany
from action_assistant.runner.analysis.course_checks import (
    ArrowProposal,
    CheckedCourses,
    CheckRequest,
    ProposalRequest,
    propose,
)
from action_assistant.runner.analysis.expected_runs import Expect, Expectation
from action_assistant.runner.api import (
    approvals,
    led_runs,
    questions,
    queues,
    repeats,
    review,
    rights,
    robots,
)
from action_assistant.runner.api.caller import COUNTED, GRAPH_BODY, author_of, body_of, start_of
from action_assistant.runner.api.live import (
    PageMessage,
    RunnerMessage,
    Stopping,
    attend,
    prepare_view,
)
from action_assistant.runner.api.refused_starts import StartNeeds, noted, refusal_of
from action_assistant.runner.api.review import json_of
from action_assistant.runner.api.run_guard import (
    guarded,
    is_hidden,
    require_command_role,
    require_run,
    shown,
    unseen_by,
)
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.execution.interventions import ModifyRequest, RestRequest
from action_assistant.runner.queues.entry import request_of
from action_assistant.runner.review import audit_facts
from action_assistant.runner.review.stored_runs import HistoryEvent, StoredRuns
from action_assistant.runner.runs import queries, views
from action_assistant.runner.runs.run import Run, State
from action_assistant.runner.runs.sight import run_graphs
from action_assistant.runner.start.admission import (
    ResumeRequest,
    StartRequest,
    decoded,
    read_request,
)
from action_assistant.runner.start.orders import engines_of
from action_assistant.umrf.semantics import Script
from action_assistant.web.audit.events import OwnerDid, StartRefused
from action_assistant.web.audit.routes import audit_routes
from action_assistant.web.audit.rows import AuditFilter
from action_assistant.web.auth.access import (
    Needs,
    PersonOnly,
    identity_of,
    person_of,
    require,
)
from action_assistant.web.auth.caller import client_network
from action_assistant.web.auth.graph_seals import Statement
from action_assistant.web.http.compression import COMPRESSED
from action_assistant.web.http.refusals import refuse
from action_assistant.web.server.openapi import MOST_NUMBER, answer, exchanges, reads

_PAGE: Final = 500  # events read at once
_STOP_BYTES: Final = 4_096  # of the body of a Stop; whatever comes after them is not read
_RULES_BODY: Final = 10_000_000  # bytes
_STOP_S: Final = 1.0  # for which a Stop waits for its body
_ALIVE_S: Final = 15.0  # between two comments that keep an event stream open
_LOOK_S: Final = 0.5  # after which a stream looks again whether its caller may see the run
_Asking = Request[Any, Any, Any]


class StopBody(msgspec.Struct, frozen=True):
    """The body of a Stop. The page makes one `stop_id` for each press, since one press may arrive
    on several ways. `again`: this is another try to send that press, since no answer came; a Stop of
    everything that has come before then reaches no run that was admitted since."""

    stop_id: str = ""
    again: bool = False


def routes(services: RunnerServices) -> list[ControllerRouterHandler]:
    """Return all routes of the runner."""
    every = [
        *_starts(services),
        *_commands(services),
        *led_runs.routes(services),
        *questions.routes(services),
        *repeats.routes(services),
        *queues.routes(services),
        *_queries(services),
        *approvals.routes(services),
        *robots.routes(services),
        *rights.routes(services),
        *_expected_courses(services),
        *_course_checks(services),
        *review.routes(services),
        *audit_routes(lambda wanted: _audit(services, wanted)),
        _live(services),
        _rules(services),
    ]
    return guarded(every, services)


async def _audit(services: RunnerServices, wanted: AuditFilter) -> bytes:
    return await services.run_in_worker(
        audit_facts.page_in_worker, services.journal.address, wanted
    )


def _starts(services: RunnerServices) -> list[ControllerRouterHandler]:
    @post(
        "/api/runs",
        summary="Start a version, at most once per request_id",
        operation_id="startRun",
        description="A start that rights refuse is 403 or 409 with `where.item` `right`, `baton`, "
        "`service`, `confirm`, `watched`, `drill`, `released`, `limit`, `pressed` or `health`. A run "
        "that its robot's hardware stop stopped has the alarm `hardware_stop`, one without a visible "
        "page `page_missing`, a led run that a limit stopped `led_limit`.",
        opt=reads(StartRequest, Script=Script) | COUNTED,
        responses={200: answer(views.RunShown, text="It had been started before")},
        guards=[StartNeeds(services, "start")],
        request_max_body_size=GRAPH_BODY,
    )
    async def start(request: _Asking) -> Response[views.RunShown]:
        async with body_of(request, services.body_limit) as body:
            start_request = read_request(body)
            with noted(services, request, refusal_of(start_request)):
                if engines_of(start_request):
                    require(request, "operate")
                started = await services.control.start(
                    start_request, author_of(request), identity_of(request)
                )
        view = await _run_view(services, started.run)
        return Response(
            shown(services, request, view, run_graphs(started.run)),
            status_code=201 if started.fresh else 200,
            headers={"location": f"/api/runs/{started.run.id}"},
        )

    @get(
        # As a path: the request id of a start out of the queue, or of a repeat, has slashes.
        "/api/starts/{request_id:path}",
        summary="The runs, or the entry of the queue, that a start has become, by its request_id",
        operation_id="getStart",
        description="Ids may have slashes; `queued` is the entry of the queue that it has become.",
        guards=[Needs("see")],
    )
    async def started(request_id: str, request: _Asking) -> views.StartShown:
        request_id = request_id.removeprefix("/")
        queues, history = services.queues, services.control.history
        # Before the query: a start that is not under way any more is stored.
        under_way = services.control.under_way(request_id) or queues.is_under_way(request_id)
        queued = await queues.queued(request_id)
        rows = list(await history.rows(queries.of_start(request_id)))
        if queued is not None:
            rows += await history.rows(queries.of_start(request_of(queued.entry)))
        runs = [await services.control.find(row.id) for row in rows]
        found = [
            shown(services, request, await _run_view(services, run), run_graphs(run))
            for run in runs
        ]
        return views.StartShown(
            request_id=request_id, under_way=under_way, runs=found, queued=queued
        )

    return [start, started]


def _commands(services: RunnerServices) -> list[ControllerRouterHandler]:
    @post(
        "/api/stop",
        operation_id="stopAll",
        status_code=202,
        summary="Stop everything",
        opt=reads(StopBody | None),
        guards=[Needs("stop")],
    )
    async def stop_all(request: _Asking) -> Stopping:
        body = await _stop_body(request)
        stopped = services.control.stop_all(author_of(request), body.stop_id, body.again)
        return Stopping.everything(body.stop_id, stopped, partial(unseen_by, services, request))

    @post(
        "/api/runs/{run:str}/stop",
        operation_id="stopRun",
        status_code=202,
        summary="Stop a run",
        opt=reads(StopBody | None),
        guards=[Needs("stop")],
    )
    async def stop(run: str, request: _Asking) -> Stopping:
        stop_id = (await _stop_body(request)).stop_id
        return Stopping(stop_id, await services.control.stop(run, author_of(request), stop_id))

    @post(
        "/api/runs/{run:str}/pause",
        operation_id="pauseRun",
        status_code=202,
        summary="Pause a run",
        guards=[Needs("simulate")],
    )
    async def pause(run: str, request: _Asking) -> views.RunShown:
        await require_command_role(services, run, request)
        return views.run_view(await services.control.pause(run, author_of(request)))

    @post(
        "/api/runs/{run:str}/resume",
        operation_id="resumeRun",
        status_code=202,
        summary="Let a paused run go on",
        opt=reads(ResumeRequest | None),
        guards=[StartNeeds(services, "go_on")],
    )
    async def resume(run: str, request: _Asking) -> views.RunShown:
        asked = decoded(await request.body() or b"{}", ResumeRequest)
        with noted(services, request, StartRefused(what="go_on", why="", run=run[:100])):
            await require_command_role(services, run, request)
            author, me = author_of(request), identity_of(request)
            return views.run_view(await services.control.resume(run, author, me, asked))

    @post(
        "/api/runs/{run:str}/modify",
        operation_id="modifyRun",
        status_code=202,
        summary="Change a running graph, where its engine makes that safe",
        opt=reads(ModifyRequest) | COUNTED,
        guards=[StartNeeds(services, "change")],
        request_max_body_size=GRAPH_BODY,
    )
    async def modify(run: str, request: _Asking) -> views.RunShown:
        with noted(services, request, StartRefused(what="change", why="", run=run[:100])):
            await require_command_role(services, run, request)
            async with body_of(request, services.body_limit) as body:
                me = identity_of(request)
                changed = await services.control.modify(run, body, author_of(request), me)
                return views.run_view(changed)

    @post(
        "/api/runs/{run:str}/at_rest",
        operation_id="confirmRest",
        status_code=200,
        summary="Confirm that a run is at rest which no answer of its engine can prove so",
        opt=reads(RestRequest),
        guards=[PersonOnly(), Needs("operate")],
    )
    async def at_rest(run: str, request: _Asking) -> views.RunShown:
        asked = decoded(await request.body(), RestRequest)
        return views.run_view(await services.control.confirm_rest(run, asked, author_of(request)))

    return [stop_all, stop, pause, resume, modify, at_rest]


def _queries(services: RunnerServices) -> list[ControllerRouterHandler]:
    @get(
        "/api/runs",
        summary="Runs, newest first",
        operation_id="listRuns",
        description="A run of a graph out of sight has `hidden: true` and only engines, state, times, "
        "proof, and who started and stopped it. Its other routes are 403; Stop is 202.",
        guards=[Needs("see")],
    )
    async def listed(
        request: _Asking,
        graph: str | None = None,
        robot: str | None = None,
        run_state: Annotated[str | None, Parameter(query="state")] = None,
        failed: bool | None = None,
        version: str | None = None,
        person: str | None = None,
        text: str | None = None,
        label: str | None = None,
        pinned: bool | None = None,
        since: datetime | None = None,
        until: datetime | None = None,
        before: str | None = None,
        limit: Annotated[int, Parameter(ge=1, le=1000)] = 200,
    ) -> Response[list[views.Listed]]:
        states = _states(run_state)
        wanted = queries.Filter(
            graph=graph,
            engine=robot,
            states=states,
            failed=failed,
            version=version,
            person=person,
            text=text.strip() or None if text is not None else None,
            label=label,
            pinned=pinned,
            since=_us(since),
            until=_us(until),
            before=before,
        )
        open_runs = {
            run: views.summary(opened.run, recorded=opened.recorder.recorded)
            for run, opened in services.control.shown.items()
        }
        unseen = unseen_by(services, request)
        found = await services.worker_queries.text(
            StoredRuns.listed, wanted, limit, open_runs, unseen
        )
        return json_of(found, list[views.Listed])

    @get(
        "/api/labels",
        summary="Labels of runs, the most used first",
        operation_id="listLabels",
        guards=[Needs("see")],
    )
    async def every_label(request: _Asking) -> list[str]:
        unseen = unseen_by(services, request)
        rows = await services.control.history.rows(queries.all_labels(unseen))
        return [row.label for row in rows]

    @get(
        "/api/runs/{run:str}",
        summary="A run, and the graph as it was sent",
        operation_id="getRun",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
    )
    async def one(run: str, request: _Asking) -> Response[views.RunWhole]:
        is_all = not await is_hidden(services, request, run)
        opened = services.control.open.get(run)
        if opened is None:
            return json_of(
                await services.worker_queries.text(StoredRuns.whole, run, is_all), views.RunWhole
            )
        if opened not in services.sent:
            services.sent[opened] = await services.worker_queries.value(StoredRuns.sent, run)
        opened = services.control.open.get(run, opened)
        await services.hub.prepare_view(opened)
        whole = views.whole_view(
            opened.run,
            services.sent[opened],
            recorded=opened.recorder.recorded,
            cache=services.hub.view_cache(opened),
        )
        seen = whole if is_all else views.hidden(whole)
        return json_of(msgspec.json.encode(seen), views.RunWhole)

    @get(
        "/api/runs/{run:str}/events",
        summary="A run's events as they are stored (SSE)",
        operation_id="followRun",
        guards=[Needs("see")],
        responses={
            200: answer(HistoryEvent, media="text/event-stream", text="An event each time"),
            204: ResponseSpec(None, description="All of them are known, and no more will come"),
        },
    )
    async def events(run: str, request: _Asking) -> Stream | Response[None]:
        after = _last_event_id(request)
        opened = services.control.open.get(run)
        # Before `newest`: a run that is over and stored by now has all its events in that.
        is_over = opened is None or (opened.run.end is not None and opened.recorder.idle)
        newest = await services.worker_queries.newest(run)
        if not newest:
            raise NotFound("There is no such run.")
        if newest <= after and is_over:
            return Response(None, status_code=204)  # tells an EventSource not to reconnect
        return Stream(
            _tail(services, run, after, request),
            media_type="text/event-stream",
            headers={"cache-control": "no-store"},
        )

    return [listed, every_label, one, events]


def _live(services: RunnerServices) -> ControllerRouterHandler:
    @websocket(
        "/api/live",
        opt=exchanges(RunnerMessage=RunnerMessage, PageMessage=PageMessage),
        guards=[Needs("see")],
    )
    async def live(socket: WebSocket[Any, Any, Any]) -> None:
        try:
            with services.connection_limits.admitted(person_of(socket).id, client_network(socket)):
                await attend(socket, services.hub)
        except TooMany as refused:
            await refuse(socket.scope, socket.receive, socket.send, refused)

    return live


def _rules(services: RunnerServices) -> ControllerRouterHandler:
    @put(
        "/api/graph-rules",
        status_code=204,
        summary="Store the rules that say who may see which graphs, as the editor has sealed them",
        operation_id="storeGraphRules",
        guards=[Needs("share")],
        request_max_body_size=_RULES_BODY,
    )
    async def store(data: JSONBody[Statement], request: _Asking) -> None:
        await services.control.sight.store(data)
        services.audit.note(OwnerDid("rules_told"), person_of(request).id)

    return store


async def _stop_body(request: _Asking) -> StopBody:
    """Return the body of a Stop request, with an id of at most 100 characters; an empty one for any
    other body: a Stop is never refused for its form. Wait for the body only a short time."""
    try:
        body = msgspec.json.decode(await start_of(request, _STOP_BYTES, _STOP_S), type=StopBody)
    except (msgspec.DecodeError, UnicodeDecodeError, HTTPException, BadInput, RecursionError):
        return StopBody()
    return StopBody(body.stop_id[:100], body.again)


async def _run_view(services: RunnerServices, run: Run) -> views.RunShown:
    """Return the present view of a run, with pauses for other tasks while it is made."""
    opened = services.control.open.get(run.id)
    if opened is not None:
        await services.hub.prepare_view(opened)
        return services.hub.run_view(opened)
    cache = views.ActionViewCache()
    await prepare_view(run, cache)
    return views.run_view(run, cache=cache)


def _states(asked: str | None) -> tuple[str, ...]:
    """Split a list of states of runs at its commas; () for None. Raise BadInput for an unknown
    state."""
    states = tuple(each.strip() for each in (asked or "").split(",") if each.strip())
    if unknown := [each for each in states if each not in get_args(State)]:
        raise BadInput(f"No run is ever {unknown[0]!r}.", where={"path": "/state"})
    return states


def _us(moment: datetime | None) -> int | None:
    if moment is None:
        return None
    whole = moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)
    return round(whole.timestamp() * 1_000_000)


def _last_event_id(request: _Asking) -> int:
    asked = request.headers.get("last-event-id", "0")
    if not (asked.isascii() and asked.isdigit() and len(asked) < len(str(MOST_NUMBER))):
        raise BadInput("Last-Event-ID is the seq of the last event that was read.")
    return int(asked)


async def _tail(
    services: RunnerServices, run: str, after: int, request: _Asking
) -> AsyncIterator[bytes]:
    """Yield the stored events of a run after number `after` in the format of an HTTP event stream,
    then later ones as they are stored, until the run is over or the caller may not see it any more.
    While nothing comes, yield a comment now and then to keep the connection."""
    alive_at = anyio.current_time() + _ALIVE_S
    identity = identity_of(request)
    while True:
        unseen = services.control.sight.unseen(services.identity_now(identity))
        graphs = services.control.graphs_now(run)
        if unseen is not None and (graphs is None or unseen.hides(graphs)):
            return
        opened = services.control.open.get(run)
        revision = opened.revision if opened is not None else 0
        if await services.worker_queries.newest(run) > after:
            after, page = await services.worker_queries.value(StoredRuns.streamed, run, after)
            yield page
            continue
        if opened is None:
            return
        with anyio.move_on_after(_LOOK_S):
            await services.control.change(run, revision)
        if anyio.current_time() >= alive_at:
            alive_at = anyio.current_time() + _ALIVE_S
            yield b": alive\n\n"


def _expected_courses(services: RunnerServices) -> list[ControllerRouterHandler]:
    @get(
        "/api/expectations",
        summary="Courses that graphs are expected to take",
        operation_id="listExpectations",
        guards=[Needs("see")],
    )
    async def listed(request: _Asking) -> Response[list[Expectation]]:
        found = await services.worker_queries.text(
            StoredRuns.expectations, unseen_by(services, request)
        )
        return json_of(found, list[Expectation])

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
            if wanted.run:
                await require_run(services, request, wanted.run)
            graphs = (wanted.graph, *(each.graph for each in wanted.subgraphs))
            services.control.sight.require_graphs(identity_of(request), *graphs)
            unseen = unseen_by(services, request)
            return await services.review_service.expect(wanted, author_of(request), unseen)

    @delete(
        "/api/expectations/{name:str}",
        summary="Remove an expected course",
        operation_id="retireExpectation",
        guards=[Needs("edit")],
    )
    async def retire(name: str, request: _Asking) -> None:
        unseen = unseen_by(services, request)
        await services.review_service.retire(name, author_of(request), unseen)

    return [listed, expect, retire]


def _course_checks(services: RunnerServices) -> list[ControllerRouterHandler]:
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
            graphs = (check_request.graph, *(each.graph for each in check_request.subgraphs))
            services.control.sight.require_graphs(identity_of(request), *graphs)
            text = await services.worker_queries.text(
                StoredRuns.checked_courses,
                check_request.graph,
                bytes(check_request.umrf),
                check_request.subgraphs,
                unseen_by(services, request),
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
