"""The one place where the rules of graphs are enforced for the routes of the runner.

A route that names a run in its path is guarded here, unless it stops the run or shows the little that
everybody sees of it. Every other route is listed as one that leaves out what its caller may not see, or
that tells nothing of runs and their graphs. A route that is neither stops the program from starting.
"""

from collections.abc import Iterable
from contextlib import nullcontext
from typing import Any, Final, TypeVar

from litestar.connection import ASGIConnection
from litestar.handlers import HTTPRouteHandler
from litestar.handlers.base import BaseRouteHandler
from litestar.types import ControllerRouterHandler

from action_assistant.errors import CannotStart, Forbidden
from action_assistant.runner.api.refused_starts import StartNeeds
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.review.stored_runs import StoredRuns
from action_assistant.runner.runs import views
from action_assistant.runner.runs.sight import (
    HIDDEN_ON_ROBOT,
    HIDDEN_RUN,
    RunGraphs,
    Unseen,
)
from action_assistant.web.auth.access import identity_of, require
from action_assistant.web.auth.identity import ANYBODY

_Connection = ASGIConnection[Any, Any, Any, Any]
_View = TypeVar("_View", bound=views.RunSummary)

#: Routes of a run that answer everybody: Stop, and the run itself, which shows little then.
ANSWERING_ALL: Final = frozenset({"/api/runs/{run:str}", "/api/runs/{run:str}/stop"})
#: Routes that leave out what the caller may not see, or refuse by the graphs in what they are sent.
FILTERED: Final = frozenset(
    {
        *(
            "/api/runs",
            "/api/questions",
            "/api/groups",
            "/api/preflight",
            "/api/asked_inputs",
            "/api/starts/{request_id:path}",
            "/api/repeats",
            "/api/repeats/{repeat:str}",
            "/api/queue",
        ),
        *("/api/stop", "/api/robots/{name:str}/stop", "/api/live", "/api/labels"),
        *("/api/comparison", "/api/statistics", "/api/approvals", "/api/approvals/asked"),
        *("/api/expectations", "/api/expectations/{name:str}", "/api/expectations/check"),
        *("/api/robots", "/api/reach", "/api/robots/{name:str}", "/api/robots/{name:str}/known"),
        "/api/practice",
        *("/api/robots/{name:str}/events", "/api/robots/{name:str}/events/{seq:int}/umrf"),
        *("/api/robots/{name:str}/umrf", "/api/robots/{name:str}/recordings/{file:str}"),
        *("/api/robots/{name:str}/rights", "/api/robots/{name:str}/lock"),
        *("/api/robots/{name:str}/unlock", "/api/robots/{name:str}/drills"),
        *(
            f"/api/repeats/{{repeat:str}}/{each}"
            for each in ("table", "look", "start", "close", "open")
        ),
        *(f"/api/queue/{{entry:str}}/{each}" for each in ("look", "start", "move", "remove")),
        *("/api/queue/robots/{name:str}/close", "/api/queue/robots/{name:str}/open"),
        *(f"/api/robots/{{name:str}}/baton/{each}" for each in ("take", "hand", "drop")),
    }
)
#: Routes that tell nothing of runs or of graphs that they were not sent, and routes for owners only.
WITHOUT_RUNS: Final = frozenset(
    {
        *("/api/expectations/proposal", "/api/examples", "/api/archive", "/api/rights"),
        *("/api/candidates", "/api/candidates/now", "/api/graph-rules", "/api/audit"),
        *("/api/robots/{name:str}/known/{action:str}", "/api/robots/{name:str}/recordings"),
        *("/api/robots/{name:str}/index", "/api/releases/{version:str}"),
    }
)


class RunGuard:
    """A guard that refuses what a caller asks of a run whose graph they may not see."""

    def __init__(self, services: RunnerServices) -> None:
        self._services = services

    async def __call__(self, connection: _Connection, handler: BaseRouteHandler) -> None:
        """Raise Forbidden if the caller may not see the run. Of a run that does not exist the route
        says so by itself."""
        own = (each for each in handler.guards or () if isinstance(each, StartNeeds))
        starting = next(own, None)
        with nullcontext() if starting is None else starting.noting(connection):
            await require_run(self._services, connection, str(connection.path_params["run"]))


def guarded(
    handlers: Iterable[ControllerRouterHandler], services: RunnerServices
) -> list[ControllerRouterHandler]:
    """Return the routes with a guard for those of one run. Raise CannotStart for a route that names
    no run in its path and is not known to need none."""
    guard = RunGuard(services)
    checked = list(handlers)
    for handler in checked:
        if not isinstance(handler, BaseRouteHandler):
            continue
        for path in handler.paths:
            if path in ANSWERING_ALL | FILTERED | WITHOUT_RUNS:
                continue
            if "{run:" not in path or not isinstance(handler, HTTPRouteHandler):
                raise CannotStart(f"{path} does not say how it treats runs that are hidden.")
            handler.guards = [*(handler.guards or ()), guard]
    return checked


async def require_command_role(services: RunnerServices, run: str, connection: _Connection) -> None:
    """Check the role of the caller for a command to the run with the id `run`: a run on a robot
    needs more than a simulated one. Raise Forbidden if it is too low, NotFound if there is no such
    run."""
    if not await services.control.simulates(run):
        require(connection, "operate")


def unseen_by(services: RunnerServices, connection: _Connection) -> Unseen | None:
    """Return the graphs that a caller may not see; None if they see everything."""
    return services.control.sight.unseen(identity_of(connection))


async def require_run(services: RunnerServices, connection: _Connection, run: str) -> None:
    """Raise Forbidden if a caller may not see the run, or the whole run of the piece, with this id."""
    if await is_hidden(services, connection, run):
        raise Forbidden(HIDDEN_RUN)


async def is_hidden(services: RunnerServices, connection: _Connection, run: str) -> bool:
    """Return whether a caller may not see the run with this id."""
    unseen = unseen_by(services, connection)
    if unseen is None:
        return False
    graphs = await _graphs_of(services, run)
    return graphs is not None and unseen.hides(graphs)


async def _graphs_of(services: RunnerServices, run: str) -> RunGraphs | None:
    found = services.control.graphs_now(run)
    if found is None:
        found = await services.worker_queries.value(StoredRuns.run_graphs, run)
        if found is not None:
            services.control.sight.remember(run, found)
    return found


async def is_seen_by_all(services: RunnerServices, run: str, graph: str) -> bool:
    """Return whether everybody may see a run, or a graph where no run is named (""). A run that does not
    exist is seen by nobody while there are rules."""
    unseen = services.sight.unseen(ANYBODY)
    if unseen is None:
        return True
    of = await _graphs_of(services, run) if run else RunGraphs("", (graph,))
    return of is not None and not unseen.hides(of)


def is_waiting_seen_by_all(services: RunnerServices, graphs: RunGraphs | None) -> bool:
    """Return whether everybody may see a start that waits, by its graphs; None for one that has left the
    queue, which is seen by nobody while there are rules."""
    unseen = services.sight.unseen(ANYBODY)
    return unseen is None or (graphs is not None and not unseen.hides(graphs))


def shown(
    services: RunnerServices, connection: _Connection, view: _View, graphs: RunGraphs
) -> _View:
    """Return the view of a run as its caller may see it. `graphs`: the graphs of the run."""
    unseen = unseen_by(services, connection)
    return view if unseen is None or not unseen.hides(graphs) else views.hidden(view)


def require_all_on_robot(services: RunnerServices, connection: _Connection) -> None:
    """Raise Forbidden if there are graphs that a caller may not see: for answers of which nobody knows
    whose graphs they hold."""
    unseen = unseen_by(services, connection)
    if unseen is not None and unseen.is_some:
        raise Forbidden(HIDDEN_ON_ROBOT)
