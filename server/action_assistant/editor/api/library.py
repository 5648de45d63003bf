"""Routes of the action library: its actions, the graphs that use them, and updates in both directions."""

from datetime import datetime
from typing import Annotated, Any
from urllib.parse import unquote

import msgspec
from litestar import Request, Response, get, post, put
from litestar.params import QueryParameter
from litestar.types import ControllerRouterHandler

from action_assistant.editor.api.graphs import MadeGraph, SeqOrNone, made_graph
from action_assistant.editor.catalogue.catalogue import GraphView
from action_assistant.editor.interchange.importing import Preview
from action_assistant.editor.library import library_updates
from action_assistant.editor.library.action_uses import GraphAsAction, LibraryAction
from action_assistant.editor.library.library import GraphMoment, UpdatedGraph
from action_assistant.editor.library.library_updates import ActionUse
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.services import EditorState
from action_assistant.editor.workers import encoded
from action_assistant.errors import BadInput
from action_assistant.umrf.action_updates import NO_RENAMES, Renames
from action_assistant.umrf.difference import Difference
from action_assistant.umrf.json.text import JsonObject
from action_assistant.web.auth.access import Needs, identity_of, person_of
from action_assistant.web.server.application import BODY_LIMIT
from action_assistant.web.server.openapi import answer, reads

Asking = Request[Any, Any, Any]
Pairs = Annotated[list[str] | None, QueryParameter(max_items=1000)]


class ActionUses(msgspec.Struct, frozen=True):
    """The graphs that use an action, and how updating them to its change `seq` would change them."""

    seq: int
    uses: tuple[ActionUse, ...]


class UpdatingUses(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to update uses of an action to its change `seq`. `renames`: parameters that have another name
    since."""

    seq: int
    graphs: tuple[GraphMoment, ...]
    renames: Renames = NO_RENAMES


class TakingOver(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The graph with the use whose parameters the library takes over, and the key (`aid`) of that
    action; if missing, the first use that differs."""

    graph: str
    aid: str | None = None


class BuildReport(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The result of the last build of an action's package; `at` is when the build ended."""

    package: Annotated[str, msgspec.Meta(max_length=200)]
    ended_well: bool
    at: datetime
    errors: Annotated[tuple[h.BuildFault, ...], msgspec.Meta(max_length=100)]


class LastBuild(msgspec.Struct, frozen=True):
    """The last reported build of an action's package; None if none was reported."""

    build: h.ActionBuilt | None


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the routes of the library of actions: actions, their uses, and builds."""
    return [*_actions(app_state), *_uses(app_state), *_builds(app_state)]


def _actions(app_state: EditorState) -> list[ControllerRouterHandler]:
    @get(
        "/api/actions",
        summary="The actions of the library, and those that only graphs know, by name",
        operation_id="listActions",
        description="The documents of these actions are graphs of `kind` `action`, at "
        "`/api/graphs/{graph_id}` and below.",
        guards=[Needs("see")],
    )
    async def list_actions() -> list[LibraryAction]:
        return encoded(list[LibraryAction], await app_state.services.library.all())

    @get(
        "/api/actions/graphs",
        summary="The graphs, each as the action that stands for it in another one, by name",
        operation_id="listGraphsAsActions",
        guards=[Needs("see")],
    )
    async def list_graphs_as_actions() -> list[GraphAsAction]:
        return encoded(list[GraphAsAction], await app_state.services.library.graphs())

    @get(
        "/api/actions/deleted",
        summary="Actions that were taken out of the library; each can be recovered as a graph can",
        operation_id="listDeletedActions",
        guards=[Needs("see")],
    )
    async def list_deleted_actions() -> list[GraphView]:
        return await app_state.services.catalogue.all(deleted=True, kind="action")

    @post(
        "/api/actions",
        summary="Make an action of its UMRF file, an empty one of {name}, or with `from_graphs` what "
        "graphs know of it; with `preview` only say what a file would become, and store nothing",
        operation_id="createAction",
        guards=[Needs("edit")],
        opt=reads(JsonObject),
        responses={
            200: answer(Preview, text="What the file would become"),
            201: answer(MadeGraph, text="Made"),
        },
        request_max_body_size=BODY_LIMIT,
    )
    async def create_action(
        request: Asking, preview: bool = False
    ) -> Response[MadeGraph] | Response[Preview]:
        services, person = app_state.services, person_of(request)
        body = await request.body()
        if preview:
            found = await services.workers.files(library_updates.preview, body)
            return Response(encoded(Preview, found), status_code=200)
        await services.people.seen(person)
        made, told = await services.library_edits.create(body, person.id)
        return made_graph(made, told)

    @get(
        "/api/actions/{action_id:str}/umrf",
        summary="The UMRF file of an action, now or after its change `at`",
        operation_id="getActionUmrf",
        guards=[Needs("see")],
        responses={200: answer(JsonObject)},
    )
    async def get_action_umrf(action_id: str, at: SeqOrNone = None) -> Response[bytes]:
        services = app_state.services
        await services.catalogue.require(action_id, "action")
        sight = await services.graph_reader.moment(action_id, at)
        text = await services.graph_reader.ask(library_updates.written, sight)
        return Response(text, media_type="application/json", headers={"x-seq": str(sight.seq)})

    @put(
        "/api/actions/{action_id:str}/umrf",
        summary="Make an action what its UMRF file says, as an edit that can be taken back; with `seq` "
        "only while that is its last change",
        operation_id="replaceAction",
        guards=[Needs("edit")],
        opt=reads(JsonObject),
        request_max_body_size=BODY_LIMIT,
    )
    async def replace_action(action_id: str, request: Asking, seq: SeqOrNone = None) -> GraphView:
        services, person = app_state.services, person_of(request)
        body = await request.body()
        await services.people.seen(person)
        return await services.library_edits.replace(action_id, body, person.id, seq)

    @post(
        "/api/actions/{action_id:str}/umrf",
        status_code=200,
        summary="What making an action what its UMRF file says would change; stores nothing",
        operation_id="compareWithFile",
        guards=[Needs("edit")],
        opt=reads(JsonObject),
        request_max_body_size=BODY_LIMIT,
    )
    async def compare_with_file(action_id: str, request: Asking) -> Difference:
        body = await request.body()
        return encoded(
            Difference, await app_state.services.library_edits.replacing_would(action_id, body)
        )

    return [
        *(list_actions, list_graphs_as_actions, list_deleted_actions, create_action),
        *(get_action_umrf, replace_action, compare_with_file),
    ]


def _uses(app_state: EditorState) -> list[ControllerRouterHandler]:
    @get(
        "/api/actions/{action_id:str}/uses",
        summary="The graphs that use an action, and what an update would change in each; `inputs` and "
        "`outputs` are renames, OLD:NEW, each of both percent-encoded",
        operation_id="listUses",
        guards=[Needs("see")],
    )
    async def list_uses(action_id: str, inputs: Pairs = None, outputs: Pairs = None) -> ActionUses:
        services = app_state.services
        await services.catalogue.require(action_id, "action")
        renames = Renames(_pairs("inputs", inputs), _pairs("outputs", outputs))
        seq, found = await services.library_edits.uses(action_id, renames)
        return ActionUses(seq, encoded(tuple[ActionUse, ...], found))

    @post(
        "/api/actions/{action_id:str}/uses",
        status_code=200,
        summary="Bring the uses in some graphs to what the action says: an edit of each, that can be "
        "taken back by its history",
        operation_id="updateUses",
        description="An error means that no graph was changed. If one was, each graph of which the"
        " edit failed says why in `refused`.",
        guards=[Needs("edit")],
    )
    async def update_uses(
        action_id: str, data: UpdatingUses, request: Asking
    ) -> list[UpdatedGraph]:
        services, person = app_state.services, person_of(request)
        await services.catalogue.require(action_id, "action")
        for each in data.graphs:
            await services.rights.check("graph", each.graph, identity_of(request), edits=True)
        await services.people.seen(person)
        return await services.library_edits.update_uses(
            action_id, data.seq, data.graphs, data.renames, person.id
        )

    @post(
        "/api/actions/{action_id:str}/take",
        status_code=200,
        summary="Give an action the parameters that a graph's use of it has",
        operation_id="takeOver",
        guards=[Needs("edit")],
    )
    async def take_over(action_id: str, data: TakingOver, request: Asking) -> GraphView:
        services, person = await app_state.acting(request)
        await services.rights.check("graph", data.graph, identity_of(request), edits=False)
        return await services.library_edits.take(action_id, data.graph, data.aid, person.id)

    return [list_uses, update_uses, take_over]


def _builds(app_state: EditorState) -> list[ControllerRouterHandler]:
    @get(
        "/api/actions/{action_id:str}/build",
        summary="How the last build of an action's package went, as `action-assistant builds` told",
        operation_id="getBuild",
        guards=[Needs("see")],
    )
    async def get_build(action_id: str) -> LastBuild:
        return LastBuild(await app_state.services.library_edits.last_build(action_id))

    @put(
        "/api/actions/{action_id:str}/build",
        summary="Tell how the last build of an action's package went",
        operation_id="putBuild",
        guards=[Needs("edit")],
    )
    async def put_build(action_id: str, data: BuildReport, request: Asking) -> LastBuild:
        services, person = await app_state.acting(request)
        build = h.ActionBuilt(data.package, data.ended_well, data.at, data.errors)
        await services.library_edits.built(action_id, build, person.id)
        return LastBuild(build)

    return [get_build, put_build]


def _pairs(place: str, texts: list[str] | None) -> tuple[tuple[str, str], ...]:
    pairs = []
    for text in texts or ():
        old, colon, new = text.partition(":")
        if not colon or not old or not new:
            raise BadInput("A rename is OLD:NEW.", where={"path": f"/{place}"})
        pairs.append((unquote(old), unquote(new)))
    return tuple(pairs)
