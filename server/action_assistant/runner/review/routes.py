"""Routes for looking back: films, marks, comparisons, statistics, files, expectations."""

from collections.abc import Callable
from typing import Annotated, Any, Final

import msgspec
from anyio import to_thread
from litestar import Request, Response, delete, get, patch, post
from litestar.params import Parameter
from litestar.response import Stream
from litestar.types import ControllerRouterHandler

from action_assistant import places
from action_assistant.errors import BadInput
from action_assistant.runner import recorded_runs
from action_assistant.runner.admission import decoded
from action_assistant.runner.asking import author_of
from action_assistant.runner.described import FitOperation
from action_assistant.runner.review import about, again
from action_assistant.runner.review.compare import Comparison
from action_assistant.runner.review.desk import CauseShown, Desk, Expectation, Format, Marked
from action_assistant.runner.review.film import Film
from action_assistant.runner.review.raw import Raw
from action_assistant.runner.review.retention import Retention, Swept
from action_assistant.runner.review.statistics import Statistics
from action_assistant.web.access import Needs

_Asking = Request[Any, Any, Any]
_TYPES: Final[dict[str, str]] = {
    "jsonl": "application/x-ndjson",
    "csv": "text/csv; charset=utf-8",
    "mcap": "application/octet-stream",
}


class Expect(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A run whose course shall be expected from now on, under a name."""

    run: str
    name: str


class Fit(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Another version of the graph of a run; `action` (a name of the run) may have a `fault`."""

    umrf: msgspec.Raw
    action: str | None = None
    fault: again.Fault | None = None


class Sweep(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Put away what is older than so many days; null leaves it here."""

    runs: Annotated[float, msgspec.Meta(ge=0)] | None = None
    raw: Annotated[float, msgspec.Meta(ge=0)] | None = None


def routes(
    desk: Callable[[], Desk], retention: Callable[[], Retention]
) -> list[ControllerRouterHandler]:
    """All routes. `desk` and `retention` are there before the first request."""
    return [*_of_one(desk), *_of_many(desk), *_expecting(desk), _archiving(retention)]


def _archiving(retention: Callable[[], Retention]) -> ControllerRouterHandler:
    @post(
        "/api/archive",
        status_code=200,
        summary="Put some of what is old into archives; ask again while there is more",
        guards=[Needs("restore")],
    )
    async def archive(data: Sweep) -> Swept:
        return await retention().sweep(data.runs, data.raw)

    return archive


def _of_one(desk: Callable[[], Desk]) -> list[ControllerRouterHandler]:
    @get("/api/runs/{run:str}/film", summary="What every event of a run changed, a page at a time")
    async def film(run: str, after: Annotated[int, Parameter(ge=0)] = 0) -> Film:
        return await desk().film(run, after)

    @get("/api/runs/{run:str}/causes", summary="What is proven to be behind the end of a run")
    async def found_causes(run: str) -> list[CauseShown]:
        return await desk().causes(run)

    @get("/api/runs/{run:str}/umrf", summary="The graph of a run as it was sent")
    async def umrf(run: str) -> Response[bytes]:
        return Response(await desk().umrf(run), media_type="application/json")

    @get("/api/runs/{run:str}/marks", summary="What people noted about a run")
    async def marks(run: str) -> Marked:
        return await desk().marks(run)

    @patch("/api/runs/{run:str}/marks", summary="Pin, note or label a run", guards=[Needs("edit")])
    async def mark(run: str, data: about.Marks, request: _Asking) -> Marked:
        return await desk().mark(run, data, author_of(request))

    @get("/api/runs/{run:str}/script", summary="What a run did, as a script for the simulator")
    async def script(
        run: str, action: str | None = None, fault: again.Fault | None = None
    ) -> again.Recorded:
        return await desk().script(run, _fault(action, fault))

    @post(
        "/api/runs/{run:str}/script",
        status_code=200,
        summary="What a run did, as a script for another version of its graph",
        operation_class=FitOperation,
        guards=[Needs("see")],
    )
    async def fit(run: str, request: _Asking) -> again.Recorded:
        asked = decoded(await request.body(), Fit)
        return await desk().script(run, _fault(asked.action, asked.fault), bytes(asked.umrf))

    @get("/api/runs/{run:str}/export", summary="A run as a file: jsonl, csv or mcap")
    async def export(
        run: str, form: Annotated[Format, Parameter(query="format")]
    ) -> Response[bytes] | Stream:
        head = {"content-disposition": f'attachment; filename="run.{form}"'}
        if form == "jsonl":
            await desk().reels.reel(run)
            return Stream(desk().lines(run), media_type=_TYPES[form], headers=head)
        content = await desk().export(run, form)
        return Response(content, media_type=_TYPES[form], headers=head)

    @get("/api/runs/{run:str}/raw", summary="Where the raw messages from the time of a run are")
    async def raw(run: str) -> Raw:
        return await desk().raw(run)

    return [film, found_causes, umrf, marks, mark, script, fit, export, raw]


def _of_many(desk: Callable[[], Desk]) -> list[ControllerRouterHandler]:
    @get("/api/comparison", summary="Two runs side by side, and where they part")
    async def comparison(a: str, b: str) -> Comparison:
        return await desk().compare(a, b)

    @get("/api/statistics", summary="The newest runs of a graph together")
    async def statistics(
        graph: str,
        robot: str | None = None,
        last: Annotated[int, Parameter(ge=1, le=1000)] = 200,
    ) -> Statistics:
        return await desk().statistics(graph, robot, last)

    @post(
        "/api/examples",
        summary="Take in recorded runs that failed, as examples; each is there once",
        status_code=200,
        guards=[Needs("edit")],
    )
    async def take_in_examples(request: _Asking) -> list[str]:
        texts = await to_thread.run_sync(recorded_runs.shipped, places.examples())
        return await desk().take_in(texts, author_of(request))

    return [comparison, statistics, take_in_examples]


def _expecting(desk: Callable[[], Desk]) -> list[ControllerRouterHandler]:
    @get("/api/expectations", summary="Runs that shall go the same for ever")
    async def listed() -> list[Expectation]:
        return await desk().expectations()

    @post(
        "/api/expectations",
        summary="Save the course of a run as what is expected",
        guards=[Needs("edit")],
    )
    async def expect(data: Expect, request: _Asking) -> Expectation:
        return await desk().expect(data.run, data.name, author_of(request))

    @delete("/api/expectations/{name:str}", summary="Expect it no more", guards=[Needs("edit")])
    async def retire(name: str, request: _Asking) -> None:
        await desk().retire(name, author_of(request))

    return [listed, expect, retire]


def _fault(action: str | None, fault: again.Fault | None) -> tuple[str, again.Fault] | None:
    if (action is None) != (fault is None):
        raise BadInput("A fault belongs to an action: give both, or none.")
    return (action, fault) if action and fault else None
