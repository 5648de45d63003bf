"""The routes of the queue: put a start there, look and start it at its turn, move and remove it, and
close and open the queue of a robot."""

from typing import Any

from litestar import Request, Response, get, post
from litestar.types import ControllerRouterHandler

from action_assistant.errors import Forbidden, NotFound
from action_assistant.runner.api.caller import COUNTED, GRAPH_BODY, author_of, body_of
from action_assistant.runner.api.refused_starts import StartNeeds, noted, refusal_of
from action_assistant.runner.api.run_guard import require_run, unseen_by
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.execution.start_pipeline import Grouped
from action_assistant.runner.links.port import SIMULATOR
from action_assistant.runner.queues.entry import (
    LookRequest,
    MoveRequest,
    OpenQueueRequest,
    QueueRequest,
    TurnRequest,
)
from action_assistant.runner.queues.robot_queue import Entry
from action_assistant.runner.queues.views import LookShown, QueueShown, look_view, queue_view
from action_assistant.runner.runs import views
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sight import HIDDEN_GRAPH
from action_assistant.runner.start.admission import decoded
from action_assistant.runner.start.kept_starts import group_of
from action_assistant.umrf.semantics import Script
from action_assistant.web.audit.events import StartRefused
from action_assistant.web.auth.access import Needs, identity_of, require
from action_assistant.web.server.openapi import answer, reads

_Asking = Request[Any, Any, Any]


class EntryStarted(views.RunShown, frozen=True, kw_only=True):
    """The run that an entry has become. Of a start on several robots: `others`, the runs beside it, and
    `failed`, the robots that nothing was sent to, and why."""

    others: list[views.RunShown]
    failed: dict[str, str]


def routes(services: RunnerServices) -> list[ControllerRouterHandler]:
    """Return the routes of the queue."""

    @get(
        "/api/queue",
        operation_id="getQueue",
        description="A graph out of sight has `hidden: true`: robots, state and person are given. "
        'The live socket says `{type: "queue", number, yours, ready_at}` when the queue has '
        "changed.",
        summary="The starts that wait, in their order, each with why it waits",
        guards=[Needs("see")],
    )
    async def shown(request: _Asking) -> QueueShown:
        return _shown(services, request)

    @post(
        "/api/queue",
        operation_id="enterQueue",
        description="`start` is a start, whose `request_id` names the entry. Answers the whole "
        "queue.",
        summary="Put a start into the queue of its robots; on robots it starts nothing",
        opt=reads(QueueRequest, Script=Script) | COUNTED,
        responses={200: answer(QueueShown, text="It had been put there before")},
        guards=[StartNeeds(services, "start")],
        request_max_body_size=GRAPH_BODY,
    )
    async def put(request: _Asking) -> Response[QueueShown]:
        async with body_of(request, services.body_limit) as body:
            wanted = decoded(body, QueueRequest)
            whole = group_of(wanted.start, wanted.engines) if wanted.engines else wanted.start
            with noted(services, request, refusal_of(whole)):
                if wanted.robots:
                    require(request, "operate")
                author, me = author_of(request), identity_of(request)
                entry, fresh = await services.queues.put(wanted, author, me)
        return Response(
            _shown(services, request),
            status_code=201 if fresh else 200,
            headers={"location": f"/api/queue/{entry.id}"},
        )

    return [shown, put, *_of_entry(services), *_of_robot(services)]


def _of_entry(services: RunnerServices) -> list[ControllerRouterHandler]:
    @post(
        "/api/queue/{entry:str}/look",
        operation_id="lookAtEntry",
        status_code=200,
        summary="The pre-flight of an entry as it is now, and what is not as it was; it changes nothing",
        opt=reads(LookRequest),
        guards=[Needs("simulate")],
    )
    async def look(entry: str, request: _Asking) -> LookShown:
        asked = decoded(await request.body(), LookRequest)
        _seen(services, request, entry)
        me = identity_of(request)
        return look_view(await services.queues.look(entry, asked.watching, me))

    @post(
        "/api/queue/{entry:str}/start",
        operation_id="startEntry",
        description="Of people only. `look` is that of the newest look: another one is 409 with "
        "`where.differs`. Starting an entry again answers its run, ",
        summary="Start an entry of the queue at its turn, exactly as it was looked at",
        opt=reads(TurnRequest),
        responses={200: answer(EntryStarted, text="It had been started before")},
        guards=[StartNeeds(services, "start", of_people=True)],
    )
    async def start(entry: str, request: _Asking) -> Response[EntryStarted]:
        asked = decoded(await request.body(), TurnRequest)
        known = _waits(services, entry)
        if known is not None:
            _seen(services, request, entry)
        with noted(services, request, _refusal_of(known)):
            if known is None or known.entered.robots:
                require(request, "operate")
            author, me = author_of(request), identity_of(request)
            started = await services.queues.start(entry, asked, author, me)
        runs = started.runs if isinstance(started, Grouped) else [started.run]
        if not started.fresh:
            for run in runs:
                await require_run(services, request, run.id)
        first, *others = (views.run_view(run) for run in runs)
        shown = EntryStarted(
            **{name: getattr(first, name) for name in first.__struct_fields__},
            others=others,
            failed=started.failed if isinstance(started, Grouped) else {},
        )
        return Response(
            shown,
            status_code=201 if started.fresh else 200,
            headers={"location": f"/api/runs/{first.id}"},
        )

    @post(
        "/api/queue/{entry:str}/move",
        operation_id="moveEntry",
        status_code=200,
        summary="Move an entry of the queue: one's own behind others, an owner any anywhere",
        opt=reads(MoveRequest),
        guards=[Needs("simulate")],
    )
    async def move(entry: str, request: _Asking) -> QueueShown:
        asked = decoded(await request.body(), MoveRequest)
        author, me = author_of(request), identity_of(request)
        await services.queues.move(entry, asked, author, me)
        return _shown(services, request)

    @post(
        "/api/queue/{entry:str}/remove",
        operation_id="removeEntry",
        status_code=200,
        summary="Take an entry out of the queue: one's own, an owner any",
        guards=[Needs("simulate")],
    )
    async def remove(entry: str, request: _Asking) -> QueueShown:
        await services.queues.remove(entry, author_of(request), identity_of(request))
        return _shown(services, request)

    return [look, start, move, remove]


def _of_robot(services: RunnerServices) -> list[ControllerRouterHandler]:
    @post(
        "/api/queue/robots/{name:str}/close",
        operation_id="closeQueue",
        status_code=200,
        summary="Close the queue of a robot: nothing of it is started; a run that goes on is not stopped",
        guards=[Needs("see")],
    )
    async def close(name: str, request: _Asking) -> QueueShown:
        services.queues.close(name, author_of(request))
        return _shown(services, request)

    @post(
        "/api/queue/robots/{name:str}/open",
        operation_id="openQueue",
        description="Of people only. `closing` is that of the closed queue: another one is 409 with"
        " `where.closing`.",
        status_code=200,
        summary="Open the closed queue of a robot again after a look; on robots it starts nothing",
        opt=reads(OpenQueueRequest),
        guards=[StartNeeds(services, "start", of_people=True)],
    )
    async def open_(name: str, request: _Asking) -> QueueShown:
        asked = decoded(await request.body(), OpenQueueRequest)
        with noted(services, request, StartRefused(what="start", why="", engines=(name[:100],))):
            if name != SIMULATOR:
                require(request, "operate")
            await services.queues.open(name, asked, author_of(request), identity_of(request))
        return _shown(services, request)

    return [close, open_]


def _shown(services: RunnerServices, request: _Asking) -> QueueShown:
    def run_of(run: str) -> Run | None:
        opened = services.control.open.get(run)
        return None if opened is None else opened.run

    return queue_view(services.queues, run_of, unseen_by(services, request))


def _waits(services: RunnerServices, entry: str) -> Entry | None:
    try:
        return services.queues.find(entry)
    except NotFound:
        return None


def _seen(services: RunnerServices, request: _Asking, entry: str) -> None:
    """Raise NotFound if an entry does not wait, Forbidden if the caller may not see its graph."""
    unseen = unseen_by(services, request)
    if unseen is not None and unseen.hides(services.queues.find(entry).graphs):
        raise Forbidden(HIDDEN_GRAPH)
    services.queues.find(entry)


def _refusal_of(entry: Entry | None) -> StartRefused:
    if entry is None:
        return StartRefused(what="start", why="")
    entered = entry.entered
    return StartRefused(
        what="start",
        why="",
        engines=entered.robots or (entered.engine,),
        graph=entered.graph or "",
        version=entered.version,
    )
