"""Routes of sub-graphs: make one of chosen actions, unpack one, and flatten a graph with all of its own."""

import asyncio
from typing import Annotated, Any

import msgspec
from litestar import Request, Response, get, post
from litestar.types import ControllerRouterHandler

from action_assistant.editor.api.graphs import SeqOrNone
from action_assistant.editor.catalogue.catalogue import CalledUses, GraphView, fit
from action_assistant.editor.documents.contents import GraphAtSeq, Inside
from action_assistant.editor.interchange.edited_text import KeyChange
from action_assistant.editor.interchange.subgraphs import (
    ChosenActions,
    ExtractionLook,
    FlatGraph,
    UnpackingLook,
    extraction_look,
    flat_graph,
    flat_text,
    name_of_action,
    subgraph_file,
    unpacking_look,
)
from action_assistant.editor.services import EditorServices, EditorState
from action_assistant.editor.workers import encoded
from action_assistant.errors import Conflict, NotFound
from action_assistant.umrf.model import Key, Position
from action_assistant.web.auth.access import Needs, identity_of, person_of
from action_assistant.web.http.compression import COMPRESSED


class Extracting(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to move actions into a new sub-graph called `name`. `seq`: the change of the graph
    that the page shows, the newest if missing. `otherwise`: do it even if the graph may then behave
    otherwise."""

    actions: tuple[Key, ...]
    name: str
    seq: int | None = None
    otherwise: bool = False


class MadeSubGraph(msgspec.Struct, frozen=True):
    """A new graph, and the changes that put an action for it into the document of the outer graph.
    The page makes these changes."""

    graph: GraphView
    changes: tuple[KeyChange, ...]


class UnpackingAction(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to replace an action by the actions of the graph that it stands for. `seq`: the
    change of the graph that the page shows, the newest if missing. `at`: where the action is drawn,
    if it has no stored position."""

    action: Key
    seq: int | None = None
    at: Position | None = None


class CallingUses(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to rename the actions called `before` in `graphs` to `name`, after the graph that
    they stand for was renamed."""

    before: str
    name: str
    graphs: Annotated[tuple[str, ...], msgspec.Meta(max_length=1000)]


class FlatCopy(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to flatten a graph after its change `seq` into a new graph called `name`."""

    seq: int
    name: str


async def _chosen(
    services: EditorServices, graph: str, data: Extracting
) -> tuple[GraphAtSeq, ChosenActions]:
    """Return the outer graph (`graph`: its id) after the change that the request names, and the
    request for a sub-graph of its chosen actions."""
    await services.catalogue.require(graph, "graph")
    name, _ = fit(data.name, "")
    taken = await services.graph_checks.is_taken(name)
    chosen = ChosenActions(data.actions, name, taken, data.otherwise)
    return await services.graph_reader.moment(graph, data.seq), chosen


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the routes that make a sub-graph of chosen actions, say what would replace an action
    that stands for a graph, give the actions that stand for a graph its new name, and flatten a
    graph."""
    # If two people make a sub-graph of the same name at once, the second is refused.
    making = asyncio.Lock()

    @post(
        "/api/graphs/{graph_id:str}/extraction",
        status_code=200,
        summary="What a sub-graph of chosen actions would be, or why there is none; stores nothing",
        operation_id="lookAtExtraction",
        description="The caller applies the `changes` in the room of the graph around it.",
        guards=[Needs("see")],
    )
    async def look_at_extraction(graph_id: str, data: Extracting) -> ExtractionLook:
        services = app_state.services
        chosen = await _chosen(services, graph_id, data)
        return encoded(ExtractionLook, await services.workers.files(extraction_look, *chosen))

    @post(
        "/api/graphs/{graph_id:str}/subgraphs",
        summary="Make a new graph of chosen actions, in the folder of the graph around it, which is "
        "changed by who asks",
        operation_id="makeSubGraph",
        description="409 if the task may differ and `otherwise` is not true.",
        guards=[Needs("edit")],
    )
    async def make_subgraph(
        graph_id: str, request: Request[Any, Any, Any], data: Extracting
    ) -> Response[MadeSubGraph]:
        services, person = await app_state.acting(request)
        async with making:
            chosen = await _chosen(services, graph_id, data)
            found = await services.workers.files(subgraph_file, *chosen)
            folder = await services.catalogue.folder_of(graph_id)
            made, _ = await services.catalogue.bring(
                found.umrf,
                person.id,
                keys=found.keys,
                folder=folder,
                rule=await services.rights.rule_for_copy([graph_id], folder, person.id),
            )
        body = MadeSubGraph(made, encoded(tuple[KeyChange, ...], found.changes))
        return Response(body, status_code=201, headers={"location": f"/api/graphs/{made.id}"})

    @post(
        "/api/graphs/{graph_id:str}/unpacking",
        status_code=200,
        summary="What a graph would have instead of an action that stands for another, or why nothing; "
        "stores nothing",
        operation_id="lookAtUnpacking",
        description="The caller applies the `changes` in the room of the graph.",
        guards=[Needs("see")],
    )
    async def look_at_unpacking(graph_id: str, data: UnpackingAction) -> UnpackingLook:
        services = app_state.services
        await services.catalogue.require(graph_id, "graph")
        sight = await services.graph_reader.moment(graph_id, data.seq)
        name = await services.graph_reader.ask(name_of_action, sight, data.action)
        known = await services.graph_checks.named(name)
        if known is None or known.graph == graph_id:
            raise NotFound(f"“{name}” stands for no graph.")
        inside = await services.graph_reader.now(known.graph)
        return encoded(
            UnpackingLook,
            await services.workers.files(unpacking_look, sight, data.action, data.at, inside),
        )

    @post(
        "/api/graphs/{graph_id:str}/uses",
        status_code=200,
        summary="Give the actions that stand for a graph in others its new name",
        operation_id="callUses",
        description="An error means that no graph was changed. If one was, the answer names in"
        " `refused` each graph of which the edit failed.",
        guards=[Needs("edit")],
    )
    async def call_uses(
        graph_id: str, request: Request[Any, Any, Any], data: CallingUses
    ) -> CalledUses:
        services, person = await app_state.acting(request)
        await services.catalogue.require(graph_id, "graph")
        for graph in data.graphs:
            await services.rights.check("graph", graph, identity_of(request), edits=True)
        return await services.catalogue.call_uses(data.graphs, data.before, data.name, person.id)

    return [*_flat(app_state), look_at_extraction, make_subgraph, look_at_unpacking, call_uses]


async def _whole(
    services: EditorServices, graph: str, seq: int | None
) -> tuple[GraphAtSeq, Inside]:
    """Return a graph (its id) after its change `seq` (None: the newest), and all graphs inside in
    their present state. Raise NotFound if there is no such graph; Conflict if it has no such
    change, or more graphs are inside of it than are examined; Unavailable if the log cannot be
    read."""
    await services.catalogue.require(graph, "graph")
    sight = await services.graph_reader.moment(graph, seq)
    inside = await services.graph_checks.inside(sight)
    if inside.cut:
        raise Conflict("More graphs are inside of it than are looked at.")
    return sight, inside


def _flat(app_state: EditorState) -> list[ControllerRouterHandler]:
    @get(
        "/api/graphs/{graph_id:str}/flat",
        summary="A graph and those inside of it as one graph that does the same, or why there is none",
        operation_id="getFlatGraph",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
    )
    async def get_flat(graph_id: str, at: SeqOrNone = None) -> FlatGraph:
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
        folder = await services.catalogue.folder_of(graph_id)
        parts = [graph_id, *(part.graph for _, part in whole[1].graphs)]
        made, _ = await services.catalogue.create(
            text,
            person.id,
            folder=folder,
            rule=await services.rights.rule_for_copy(parts, folder, person.id),
        )
        return Response(made, status_code=201, headers={"location": f"/api/graphs/{made.id}"})

    return [get_flat, make_flat]
