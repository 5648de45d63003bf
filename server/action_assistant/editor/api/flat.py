"""Routes that flatten a graph with its sub-graphs into one graph."""

from typing import Any

import msgspec
from litestar import Request, Response, get, post
from litestar.types import ControllerRouterHandler

from action_assistant.editor.api.graphs import Seq
from action_assistant.editor.catalogue.catalogue import GraphView
from action_assistant.editor.documents.contents import GraphAtSeq, Inside
from action_assistant.editor.services import EditorServices, EditorState
from action_assistant.editor.subgraphs.flat_graph import FlatGraph, flat_graph, flat_text
from action_assistant.editor.workers import encoded
from action_assistant.errors import Conflict
from action_assistant.web.auth.access import Needs, person_of


class FlatCopy(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to flatten a graph after its change `seq` into a new graph called `name`."""

    seq: int
    name: str


async def _whole(
    services: EditorServices, graph: str, seq: int | None
) -> tuple[GraphAtSeq, Inside]:
    """Return a graph after its change `seq` (None: the newest), with the present state of all
    graphs inside. `graph`: its id.

    Raise NotFound if there is no such graph; Conflict if it has no such change, or if more graphs
    are inside of it than are looked at; Unavailable if the log cannot be read.
    """
    await services.catalogue.require(graph, "graph")
    sight = await services.graph_reader.moment(graph, seq)
    inside = await services.graph_checks.inside(sight)
    if inside.cut:
        raise Conflict("More graphs are inside of it than are looked at.")
    return sight, inside


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the routes that flatten a graph with its sub-graphs into one graph."""

    @get(
        "/api/graphs/{graph_id:str}/flat",
        summary="A graph and those inside of it as one graph that does the same, or why there is none",
        operation_id="getFlatGraph",
    )
    async def get_flat(graph_id: str, at: Seq | None = None) -> FlatGraph:
        services = app_state.services
        whole = await _whole(services, graph_id, at)
        return encoded(FlatGraph, await services.graph_reader.ask(flat_graph, *whole))

    @post(
        "/api/graphs/{graph_id:str}/flat",
        summary="Make a new graph of a graph and those inside of it",
        operation_id="makeFlatGraph",
        guards=[Needs("edit")],
    )
    async def make_flat(
        graph_id: str, request: Request[Any, Any, Any], data: FlatCopy
    ) -> Response[GraphView]:
        services, person = app_state.services, person_of(request)
        whole = await _whole(services, graph_id, data.seq)
        await services.people.seen(person)
        text = await services.graph_reader.ask(flat_text, *whole, data.name)
        made, _ = await services.catalogue.create(text, person.id)
        return Response(made, status_code=201, headers={"location": f"/api/graphs/{made.id}"})

    return [get_flat, make_flat]
