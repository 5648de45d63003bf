"""The routes of review: replays, marks, comparisons, statistics, files, archiving."""

from collections.abc import AsyncIterator
from typing import Annotated, Any, Final, TypeVar, cast

import msgspec
from anyio import to_thread
from litestar import MediaType, Request, Response, get, patch, post
from litestar.params import Parameter
from litestar.response import Stream
from litestar.types import ControllerRouterHandler

from action_assistant import paths
from action_assistant.errors import BadInput
from action_assistant.kit.clock import utc_us
from action_assistant.runner.analysis import annotations, expected_runs
from action_assistant.runner.analysis.comparison import RunComparison
from action_assistant.runner.analysis.replay import RunReplay
from action_assistant.runner.analysis.statistics import Statistics
from action_assistant.runner.api.caller import COUNTED, GRAPH_BODY, author_of, body_of
from action_assistant.runner.api.run_guard import require_run, unseen_by
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.archives import examples
from action_assistant.runner.archives.raw_messages import RawMessages
from action_assistant.runner.archives.retention import SweepResult
from action_assistant.runner.review import audit_facts
from action_assistant.runner.review.incident import IncidentRequest, window
from action_assistant.runner.review.service import NoteText, RunMarks
from action_assistant.runner.review.stored_runs import CauseShown, Format, RunNote, StoredRuns
from action_assistant.runner.review.worker_queries import WorkerQueries
from action_assistant.runner.runs.sent_graphs import SentGraph, SentSubgraph
from action_assistant.runner.start.admission import decoded
from action_assistant.umrf.json.text import UmrfGraph
from action_assistant.web.audit.rows import AuditFilter
from action_assistant.web.auth.access import Needs
from action_assistant.web.http.compression import COMPRESSED
from action_assistant.web.server.openapi import MOST_NUMBER, FileBytes, answer, reads

T = TypeVar("T")

_MOST_DAYS: Final = 36_500.0
_Asking = Request[Any, Any, Any]
_TYPES: Final[dict[str, str]] = {
    "jsonl": "application/x-ndjson",
    "csv": "text/csv; charset=utf-8",
    "mcap": "application/octet-stream",
}


def json_of(text: bytes, _: type[T]) -> Response[T]:
    """Return a response with text that is JSON already. The second parameter, its type, is for
    OpenAPI only."""
    return cast("Response[T]", Response(text, media_type=MediaType.JSON))


class ScriptRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Another version of the graph of a run; `action` (a name of the run) may have a `fault`.
    `subgraphs`: the graphs inside, for a run that had opened them."""

    umrf: SentGraph
    subgraphs: tuple[SentSubgraph, ...] = ()
    action: str | None = None
    fault: expected_runs.Fault | None = None


#: Bytes of a request that brings the audit of the editor along.
_INCIDENT_BODY: Final = 4_000_000


class ArchiveRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to archive runs and raw messages that ended more than so many days ago; null
    archives none."""

    runs: Annotated[float, msgspec.Meta(ge=0, le=_MOST_DAYS)] | None = None
    raw: Annotated[float, msgspec.Meta(ge=0, le=_MOST_DAYS)] | None = None


def routes(services: RunnerServices) -> list[ControllerRouterHandler]:
    """Return the routes about stored runs: one run, many runs, and archives."""
    return [*_one_run(services), *_many_runs(services), _archiving(services)]


def _archiving(services: RunnerServices) -> ControllerRouterHandler:
    @post(
        "/api/archive",
        operation_id="archiveRuns",
        status_code=200,
        summary="Archive some old runs and raw messages; ask again while `more` is true",
        guards=[Needs("restore")],
    )
    async def archive(data: ArchiveRequest) -> SweepResult:
        return await services.retention.sweep(data.runs, data.raw)

    return archive


def _one_run(services: RunnerServices) -> list[ControllerRouterHandler]:
    @get(
        "/api/runs/{run:str}/film",
        summary="The changes of a run by each event, page by page",
        operation_id="getReplay",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
    )
    async def film(
        run: str, after: Annotated[int, Parameter(ge=0, le=MOST_NUMBER)] = 0
    ) -> Response[RunReplay]:
        return json_of(await services.worker_queries.text(StoredRuns.replay, run, after), RunReplay)

    @get(
        "/api/runs/{run:str}/causes",
        summary="The proven causes of a run's end",
        operation_id="listCauses",
        guards=[Needs("see")],
    )
    async def found_causes(run: str) -> Response[list[CauseShown]]:
        return json_of(await services.worker_queries.text(StoredRuns.causes, run), list[CauseShown])

    @get(
        "/api/runs/{run:str}/umrf",
        summary="The graph of a run as it was sent",
        operation_id="getRunUmrf",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
        responses={200: answer(UmrfGraph)},
    )
    async def umrf(run: str) -> Response[bytes]:
        return json_of(await services.worker_queries.value(StoredRuns.umrf, run), bytes)

    @get(
        "/api/runs/{run:str}/marks",
        summary="The marks that people gave a run",
        operation_id="getMarks",
        guards=[Needs("see")],
    )
    async def marks(run: str) -> RunMarks:
        return await services.review_service.marks(run)

    @patch(
        "/api/runs/{run:str}/marks",
        summary="Pin, note or label a run",
        operation_id="setMarks",
        guards=[Needs("edit")],
    )
    async def mark(run: str, data: annotations.Marks, request: _Asking) -> RunMarks:
        return await services.review_service.mark(run, data, author_of(request))

    @get(
        "/api/runs/{run:str}/notes",
        summary="The notes that people wrote for moments of a run",
        operation_id="listRunNotes",
        guards=[Needs("see")],
    )
    async def notes(run: str) -> Response[list[RunNote]]:
        await services.control.find(run)
        return json_of(await services.worker_queries.text(StoredRuns.notes, run), list[RunNote])

    @post(
        "/api/runs/{run:str}/notes",
        summary="Write a note for a moment of a run; notes are only added",
        operation_id="addRunNote",
        guards=[Needs("edit")],
    )
    async def note(run: str, data: NoteText, request: _Asking) -> Response[list[RunNote]]:
        found = await services.control.find(run)
        await services.review_service.note(found, data, author_of(request))
        found_notes = await services.worker_queries.text(StoredRuns.notes, run)
        return json_of(found_notes, list[RunNote])

    @get(
        "/api/runs/{run:str}/script",
        summary="The course of a run, as a script for the simulator",
        operation_id="getScript",
        guards=[Needs("see")],
    )
    async def script(
        run: str, action: str | None = None, fault: expected_runs.Fault | None = None
    ) -> Response[expected_runs.Recorded]:
        text = await services.worker_queries.text(StoredRuns.script, run, _fault(action, fault))
        return json_of(text, expected_runs.Recorded)

    @post(
        "/api/runs/{run:str}/script",
        operation_id="makeScript",
        status_code=200,
        summary="The course of a run, as a script for another version of its graph",
        opt=reads(ScriptRequest) | COUNTED,
        guards=[Needs("see")],
        request_max_body_size=GRAPH_BODY,
    )
    async def fit(run: str, request: _Asking) -> Response[expected_runs.Recorded]:
        async with body_of(request, services.body_limit) as body:
            wanted = decoded(body, ScriptRequest)
            fault = _fault(wanted.action, wanted.fault)
            text = await services.worker_queries.text(
                StoredRuns.script, run, fault, bytes(wanted.umrf), wanted.subgraphs
            )
        return json_of(text, expected_runs.Recorded)

    @get(
        "/api/runs/{run:str}/export",
        summary="A run as a file: jsonl, csv or mcap",
        operation_id="exportRun",
        guards=[Needs("see")],
        responses={200: answer(FileBytes, media="application/octet-stream")},
    )
    async def export(
        run: str, form: Annotated[Format, Parameter(query="format")]
    ) -> Response[bytes] | Stream:
        head = {"content-disposition": f'attachment; filename="run.{form}"'}
        if form == "jsonl":
            seq, first = await services.worker_queries.value(StoredRuns.lines, run, 0)
            lines = _lines(services.worker_queries, run, seq, first)
            return Stream(lines, media_type=_TYPES[form], headers=head)
        content = await services.worker_queries.value(StoredRuns.export, run, form)
        return Response(content, media_type=_TYPES[form], headers=head)

    @get(
        "/api/runs/{run:str}/raw",
        summary="The places of the raw messages from the time of a run",
        operation_id="getRawMessages",
        guards=[Needs("see")],
    )
    async def raw(run: str) -> Response[RawMessages]:
        found = await services.control.find(run)
        recordings = services.control.robots.recordings
        robots = () if recordings is None else found.robots
        here = {each: await recordings.listed(each) for each in robots if recordings is not None}
        text = await services.worker_queries.text(StoredRuns.raw, run, here, utc_us())
        return json_of(text, RawMessages)

    return [
        *(film, found_causes, umrf, marks, mark, notes, note, script, fit, export, raw),
        _incident(services),
    ]


def _incident(services: RunnerServices) -> ControllerRouterHandler:
    @post(
        "/api/runs/{run:str}/incident",
        operation_id="keepIncident",
        description="The run is never archived.",
        status_code=200,
        summary="Keep a run from being archived, and get all that is known of it as a ZIP file",
        guards=[Needs("share")],
        responses={200: answer(FileBytes, media="application/zip")},
        request_max_body_size=_INCIDENT_BODY,
    )
    async def incident(run: str, data: IncidentRequest, request: _Asking) -> Response[bytes]:
        found = await services.control.find(run)
        author, now = author_of(request), utc_us()
        await services.review_service.keep_incident(run, data.reason, author)
        since, until = window(found.requested_at, found.ended_at, now)
        wanted = AuditFilter(since=since, until=until, limit=1000)
        audit = await services.run_in_worker(
            audit_facts.rows_in_worker, services.journal.address, wanted
        )
        content = await services.worker_queries.value(
            StoredRuns.incident_file, run, data, author.name or author.id, now, audit
        )
        head = {"content-disposition": f'attachment; filename="incident-{found.number}.zip"'}
        return Response(content, media_type="application/zip", headers=head)

    return incident


async def _lines(queries: WorkerQueries, run: str, seq: int, page: bytes) -> AsyncIterator[bytes]:
    """Yield the stored events of a run as lines of JSON in pages, then those of its pieces, if it
    is led, and the notes at its moments. `page`: its first page, which ends with event number `seq`."""
    for each in (run, *await queries.value(StoredRuns.pieces, run)):
        if each != run:
            seq, page = await queries.value(StoredRuns.lines, each, 0)
        while page:
            yield page
            seq, page = await queries.value(StoredRuns.lines, each, seq)
    yield await queries.value(StoredRuns.note_lines, run)


def _many_runs(services: RunnerServices) -> list[ControllerRouterHandler]:
    @get(
        "/api/comparison",
        summary="Two runs side by side, and where they part",
        operation_id="compareRuns",
        guards=[Needs("see")],
    )
    async def comparison(a: str, b: str, request: _Asking) -> Response[RunComparison]:
        for each in (a, b):
            await require_run(services, request, each)
        return json_of(await services.worker_queries.text(StoredRuns.compare, a, b), RunComparison)

    @get(
        "/api/statistics",
        summary="The newest runs of a graph together",
        operation_id="getStatistics",
        guards=[Needs("see")],
    )
    async def statistics(
        request: _Asking,
        graph: str,
        robot: str | None = None,
        last: Annotated[int, Parameter(ge=1, le=1000)] = 200,
    ) -> Response[Statistics]:
        return json_of(
            await services.worker_queries.text(
                StoredRuns.statistics, graph, robot, last, unseen_by(services, request)
            ),
            Statistics,
        )

    @post(
        "/api/examples",
        summary="Take in recorded runs that failed, as examples; each is there once",
        operation_id="importExamples",
        status_code=200,
        guards=[Needs("edit")],
    )
    async def take_in_examples(request: _Asking) -> list[str]:
        texts = await to_thread.run_sync(examples.shipped, paths.examples())
        return await services.review_service.take_in(texts, author_of(request))

    return [comparison, statistics, take_in_examples]


def _fault(
    action: str | None, fault: expected_runs.Fault | None
) -> tuple[str, expected_runs.Fault] | None:
    if (action is None) != (fault is None):
        raise BadInput("A fault belongs to an action: give both, or none.")
    return (action, fault) if action and fault else None
