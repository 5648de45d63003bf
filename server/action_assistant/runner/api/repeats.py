"""The routes of repeats: open, start the next run, close, open again, and the table of results."""

from typing import Annotated, Any, Final

import anyio
import msgspec
from litestar import Request, Response, get, post
from litestar.params import Parameter
from litestar.types import ControllerRouterHandler

from action_assistant.errors import Forbidden, Unavailable
from action_assistant.runner.api.caller import COUNTED, GRAPH_BODY, author_of, body_of
from action_assistant.runner.api.refused_starts import StartNeeds, noted, refusal_of
from action_assistant.runner.api.run_guard import unseen_by
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.repeats import tables
from action_assistant.runner.repeats.repeat import (
    MOST,
    CellLookRequest,
    NextRequest,
    ReopenRequest,
    Repeat,
    RepeatRequest,
)
from action_assistant.runner.repeats.results import columns_of
from action_assistant.runner.repeats.views import (
    RepeatShown,
    RepeatSummary,
    graphs_of,
    summary_of,
    view_of,
)
from action_assistant.runner.review.stored_runs import StoredRuns
from action_assistant.runner.runs import queries, views
from action_assistant.runner.runs.sight import HIDDEN_GRAPH, Unseen
from action_assistant.runner.start.admission import decoded
from action_assistant.runner.start.orders import engines_of
from action_assistant.runner.start.preflight import Preflight
from action_assistant.umrf.semantics import Script
from action_assistant.web.audit.events import StartRefused
from action_assistant.web.auth.access import Needs, identity_of, require
from action_assistant.web.server.openapi import FileBytes, answer, reads

_Asking = Request[Any, Any, Any]
_LISTED: Final = 100
_TRIES: Final = 10
_AGAIN_S: Final = 0.02  # between two of them


def routes(services: RunnerServices) -> list[ControllerRouterHandler]:
    """Return the routes of repeats."""

    @post(
        "/api/repeats",
        operation_id="openRepeat",
        description="`start` is a start, whose `request_id` names the repeat. A run of it has "
        "`repeat {id cell}`.",
        summary="Open a repeat of a start: N times, or a grid of values; on robots it starts nothing",
        opt=reads(RepeatRequest, Script=Script) | COUNTED,
        responses={200: answer(RepeatShown, text="It had been opened before")},
        guards=[StartNeeds(services, "start")],
        request_max_body_size=GRAPH_BODY,
    )
    async def open_(request: _Asking) -> Response[RepeatShown]:
        async with body_of(request, services.body_limit) as body:
            wanted = decoded(body, RepeatRequest)
            with noted(services, request, refusal_of(wanted.start)):
                if engines_of(wanted.start):
                    require(request, "operate")
                repeat, fresh = await services.repeats.open(
                    wanted, author_of(request), identity_of(request)
                )
        return Response(
            await _shown(services, request, repeat),
            status_code=201 if fresh else 200,
            headers={"location": f"/api/repeats/{repeat.id}"},
        )

    @get(
        "/api/repeats",
        operation_id="listRepeats",
        summary="Repeats, the one that changed last first",
        guards=[Needs("see")],
    )
    async def listed(
        request: _Asking, graph: Annotated[str | None, Parameter(max_length=100)] = None
    ) -> list[RepeatSummary]:
        unseen = unseen_by(services, request)
        return [
            summary_of(each)
            for each in await services.repeats.newest()
            if (unseen is None or not unseen.hides(graphs_of(each)))
            and (graph is None or graph == each.opened.graph)
        ][:_LISTED]

    @get(
        "/api/repeats/{repeat:str}",
        operation_id="getRepeat",
        summary="A repeat with the run of each cell",
        guards=[Needs("see")],
    )
    async def one(repeat: str, request: _Asking) -> RepeatShown:
        return await _shown(services, request, await services.repeats.find(repeat))

    @get(
        "/api/repeats/{repeat:str}/table",
        operation_id="exportRepeat",
        description="`parquet` of the repeat says whether that format is there, else it is 503.",
        summary="The table of a repeat as a file: csv, or parquet where pyarrow is installed",
        guards=[Needs("see")],
        responses={200: answer(FileBytes, media="text/csv")},
    )
    async def table(
        repeat: str,
        request: _Asking,
        form: Annotated[tables.Format, Parameter(query="format")] = "csv",
    ) -> Response[bytes]:
        if form == "parquet":
            tables.require_parquet()
        shown = await _shown(services, request, await services.repeats.find(repeat))
        columns = columns_of(shown)
        if form == "csv":
            content = tables.csv_of(columns)
        else:
            content = await services.run_in_worker(tables.parquet_of, columns)
        head = {"content-disposition": f'attachment; filename="repeat-{shown.id}.{form}"'}
        return Response(content, media_type=tables.MEDIA[form], headers=head)

    return [open_, listed, one, table, *_commands(services)]


def _commands(services: RunnerServices) -> list[ControllerRouterHandler]:
    @post(
        "/api/repeats/{repeat:str}/look",
        operation_id="lookAtCell",
        status_code=200,
        summary="The pre-flight of the next run of a repeat as it is now; it changes nothing",
        opt=reads(CellLookRequest),
        guards=[Needs("simulate")],
    )
    async def look(repeat: str, request: _Asking) -> list[Preflight]:
        asked = decoded(await request.body(), CellLookRequest)
        await _seen(services, request, repeat)
        return await services.repeats.look(repeat, asked.watching, identity_of(request))

    @post(
        "/api/repeats/{repeat:str}/start",
        operation_id="startCell",
        description="Of people only. `cell` is the `next` one; starting one again answers its run.",
        summary="Say that all is set back, and start the next run of a repeat",
        opt=reads(NextRequest),
        responses={200: answer(views.RunShown, text="It had been started before")},
        guards=[StartNeeds(services, "start", of_people=True)],
    )
    async def start(repeat: str, request: _Asking) -> Response[views.RunShown]:
        asked = decoded(await request.body(), NextRequest)
        known = await _seen(services, request, repeat)
        with noted(services, request, _refusal_of(known)):
            if known.opened.robots:
                require(request, "operate")
            me = identity_of(request)
            started = await services.repeats.start(repeat, asked, author_of(request), me)
        return Response(
            views.run_view(started.run),
            status_code=201 if started.fresh else 200,
            headers={"location": f"/api/runs/{started.run.id}"},
        )

    @post(
        "/api/repeats/{repeat:str}/close",
        operation_id="closeRepeat",
        status_code=200,
        summary="Stop repeating: nothing more of a repeat is started; a run that goes on is not stopped",
        guards=[Needs("see")],
    )
    async def close(repeat: str, request: _Asking) -> RepeatShown:
        await _seen(services, request, repeat)
        closed = await services.repeats.close(repeat, author_of(request))
        return await _shown(services, request, closed)

    @post(
        "/api/repeats/{repeat:str}/open",
        operation_id="reopenRepeat",
        description="Of people only.",
        status_code=200,
        summary="Open a closed repeat again after a look; on robots it starts nothing",
        opt=reads(ReopenRequest),
        guards=[StartNeeds(services, "start", of_people=True)],
    )
    async def reopen(repeat: str, request: _Asking) -> RepeatShown:
        asked = decoded(await request.body(), ReopenRequest)
        known = await _seen(services, request, repeat)
        with noted(services, request, _refusal_of(known)):
            if known.opened.robots:
                require(request, "operate")
            author, me = author_of(request), identity_of(request)
            opened = await services.repeats.reopen(repeat, asked, author, me)
        return await _shown(services, request, opened)

    return [look, start, close, reopen]


async def _seen(services: RunnerServices, request: _Asking, repeat: str) -> Repeat:
    """Return a repeat. Raise NotFound if there is none, Forbidden if the caller may not see its graph."""
    found = await services.repeats.find(repeat)
    unseen = unseen_by(services, request)
    if unseen is not None and unseen.hides(graphs_of(found)):
        raise Forbidden(HIDDEN_GRAPH)
    return found


async def _shown(services: RunnerServices, request: _Asking, repeat: Repeat) -> RepeatShown:
    """Return a repeat with its runs. Raise Forbidden if the caller may not see its graph."""
    unseen = unseen_by(services, request)
    if unseen is not None and unseen.hides(graphs_of(repeat)):
        raise Forbidden(HIDDEN_GRAPH)
    for _ in range(_TRIES):
        rows = await _rows(services, repeat, unseen)
        if all(each.state != queries.OPEN for each in rows):
            known = msgspec.convert(msgspec.to_builtins(rows), list[views.Listed])
            return view_of(repeat, known)
        await anyio.sleep(_AGAIN_S)  # a run was stored, or ended, while the table was read
    raise Unavailable("The runs of this repeat are just changing. Ask again.")


class _Row(views.Listed, frozen=True, kw_only=True):
    """A run of the table, whose state may be that of an open one, which the table does not know."""

    state: Any


async def _rows(services: RunnerServices, repeat: Repeat, unseen: Unseen | None) -> list[_Row]:
    open_runs = {
        run: views.summary(opened.run, recorded=opened.recorder.recorded)
        for run, opened in services.control.shown.items()
        if opened.run.repeat is not None and opened.run.repeat.id == repeat.id
    }
    wanted = queries.Filter(repeat=repeat.id)
    text = await services.worker_queries.text(StoredRuns.listed, wanted, MOST, open_runs, unseen)
    return msgspec.json.decode(text, type=list[_Row])


def _refusal_of(repeat: Repeat) -> StartRefused:
    opened = repeat.opened
    return StartRefused(
        what="start",
        why="",
        engines=opened.robots or (opened.engine,),
        graph=opened.graph or "",
        version=opened.version,
    )
