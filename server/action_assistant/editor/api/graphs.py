"""Routes of graphs: the list, the content of one now or earlier, and its problems."""

from typing import Annotated, Any, Final, TypeAlias

import msgspec
from litestar import Request, Response, delete, get, patch, post, put
from litestar.params import Parameter, QueryParameter
from litestar.types import ControllerRouterHandler

from action_assistant.editor.catalogue import graph_pages
from action_assistant.editor.catalogue.catalogue import GraphView
from action_assistant.editor.catalogue.graph_pages import (
    GraphName,
    LabelCount,
    ThumbnailOf,
    Wanted,
)
from action_assistant.editor.catalogue.server_edits import store
from action_assistant.editor.documents import contents
from action_assistant.editor.documents.contents import GraphAtSeq, Inside
from action_assistant.editor.interchange import importing
from action_assistant.editor.interchange.edited_text import (
    MergingOutcome,
    TextEdit,
    edited_text,
    merging,
)
from action_assistant.editor.interchange.importing import ImportReport, Preview
from action_assistant.editor.log.graph_events import graph_stream
from action_assistant.editor.services import EditorServices, EditorState
from action_assistant.editor.workers import encoded
from action_assistant.errors import BadInput, Conflict
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.files import codec
from action_assistant.umrf.json.text import JsonObject, UmrfGraph
from action_assistant.umrf.model import Problem
from action_assistant.web.auth.access import Needs, identity_of, person_of
from action_assistant.web.auth.identity import Identity
from action_assistant.web.http.compression import COMPRESSED
from action_assistant.web.server.application import BODY_LIMIT
from action_assistant.web.server.openapi import MOST_NUMBER, answer, reads

Asking = Request[Any, Any, Any]
Seq = Annotated[int, Parameter(ge=1, le=MOST_NUMBER)]
SeqOrNone = Annotated[int | None, Parameter(ge=1, le=MOST_NUMBER)]
Limit: TypeAlias = Annotated[int | None, Parameter(ge=1, le=graph_pages.MOST)]
Offset: TypeAlias = Annotated[int, Parameter(ge=0, le=MOST_NUMBER)]
Search: TypeAlias = Annotated[str, Parameter(max_length=200)]
First: TypeAlias = Annotated[list[str] | None, QueryParameter(max_items=graph_pages.MOST_FIRST)]
Drawn: TypeAlias = Annotated[list[str], QueryParameter(max_items=graph_pages.MOST_DRAWN)]

_TOLD: Final = 50  # keys of a conflict that an answer lists
_LASTING: Final = "private, max-age=31536000, immutable"


class MadeGraph(GraphView, frozen=True, omit_defaults=True):
    """A new graph. `reading`: the report on the file it was read from, if any."""

    reading: ImportReport | None = None


class MergedGraph(msgspec.Struct, frozen=True):
    """The result of storing an edited text. `seq`: the last change of the graph; `merged`: whether others had
    changed the graph since the text was read; `problems`: errors that the text brought in."""

    seq: int
    merged: bool
    problems: tuple[Problem, ...]


class Describing(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A new name or description of a graph. A missing field does not change."""

    name: str | None = None
    description: str | None = None


class Problems(msgspec.Struct, frozen=True):
    """The problems of a graph after its change `seq`."""

    seq: int
    problems: tuple[Problem, ...]


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the routes under `/api/graphs`, except for versions, rooms and history."""
    return [*_lists(app_state), *_catalogue(app_state), *_contents(app_state)]


def made_graph(made: GraphView, told: bytes | None) -> Response[MadeGraph]:
    """Return the answer with the status 201 for a new document. `told`: the JSON of the
    `ImportReport` of its file, None without a file."""
    reading = None if told is None else encoded(ImportReport, told)
    body = MadeGraph(**msgspec.structs.asdict(made), reading=reading)
    return Response(body, status_code=201, headers={"location": f"/api/graphs/{made.id}"})


def _in_sight(
    services: EditorServices, view: GraphView, identity: Identity, *, restricted: bool
) -> GraphView:
    """Return a graph as an identity may see it: without the id of a folder that is out of its
    sight. `restricted`: not everybody may see or edit the graph."""
    sees_folder = services.rights.sees_folder(view.folder, identity)
    folder = view.folder if sees_folder else None
    return msgspec.structs.replace(view, folder=folder, restricted=restricted)


async def _previewed(services: EditorServices, body: bytes) -> bytes:
    """Return the JSON of a `Preview` of a UMRF file (`body`), checked with the stored graphs that
    would be inside."""
    name, uses = await services.workers.files(importing.names, body)
    inside = await services.graph_checks.inside_of(name, uses, partly=True)
    return await services.workers.files(importing.preview, body, inside)


async def _inside_with(services: EditorServices, then: GraphAtSeq, text: bytes) -> Inside:
    """Return the graphs inside of the graph `then`, in their present state. `text`: UMRF text that
    was edited from this graph; graphs that only the text uses are returned, too. Raise BadInput,
    NotUmrf or TooLarge if the text cannot be read."""
    _, uses = await services.workers.files(importing.names, text)
    return await services.graph_checks.inside(then, more=uses, partly=True)


def _lists(app_state: EditorState) -> list[ControllerRouterHandler]:
    @get(
        "/api/graphs",
        summary="All graphs, the last changed first; with `limit` a page of those that are searched by "
        "`q`, `folder` (empty: in none; `deep`: and in folders inside), and `label`, and their number "
        "in X-Total. `first`: ids of graphs that come before the others",
        operation_id="listGraphs",
        description="A graph out of the caller's sight is in no list, and 404 by its id; drafts are"
        " in none. Each word of `q` stands in name, description, robots, labels or people there "
        "now. What is not counted yet has no `problems`.",
        guards=[Needs("see")],
    )
    async def list_graphs(
        request: Asking,
        deleted: bool = False,
        limit: Limit = None,
        offset: Offset = 0,
        sort: graph_pages.Order = "changed",
        q: Search = "",
        folder: str | None = None,
        deep: bool = False,
        label: str | None = None,
        first: First = None,
    ) -> Response[list[GraphView]]:
        services, identity = app_state.services, identity_of(request)
        wanted = Wanted(q, folder, deep, label)
        if limit is None:
            if wanted != Wanted() or offset or first or sort != "changed":
                raise BadInput("A part of the list needs a `limit`.", where={"path": "/limit"})
            return Response(await _whole_list(services, identity, deleted=deleted))
        if deleted:
            raise BadInput("Deleted graphs are listed all at once.", where={"path": "/limit"})
        page = await services.graph_pages.page(
            identity, wanted, limit=limit, offset=offset, order=sort, first=first or ()
        )
        return Response(list(page.graphs), headers={"x-total": str(page.total)})

    @get(
        "/api/graphs/names",
        summary="The names of all graphs, sorted by name",
        operation_id="listGraphNames",
        guards=[Needs("see")],
    )
    async def list_names(request: Asking) -> tuple[GraphName, ...]:
        return await app_state.services.graph_pages.names(identity_of(request))

    @get(
        "/api/graphs/labels",
        summary="The labels of all graphs, or of those in a `folder` (empty: in none; `deep`: and in "
        "folders inside), with the number of graphs that have each",
        operation_id="listGraphLabels",
        guards=[Needs("see")],
    )
    async def list_labels(
        request: Asking, folder: str | None = None, deep: bool = False
    ) -> tuple[LabelCount, ...]:
        wanted = Wanted(folder=folder, deep=deep)
        return await app_state.services.graph_pages.labels(identity_of(request), wanted)

    @get(
        "/api/graphs/thumbnails",
        summary="Thumbnails of graphs, each named in `of` by its id, a dot and the digest that the list "
        "shows; those that have another digest now are left out",
        operation_id="listThumbnails",
        description="A complete answer may be kept for ever.",
        guards=[Needs("see")],
    )
    async def list_thumbnails(request: Asking, of: Drawn) -> Response[tuple[ThumbnailOf, ...]]:
        wanted = dict(_graph_and_digest(each) for each in of)
        found = await app_state.services.graph_pages.thumbnails(identity_of(request), wanted)
        # The address says what is answered, to those who may see it, unless something is left out.
        kept = _LASTING if len(found) == len(wanted) else "no-store"
        return Response(found, headers={"cache-control": kept, "vary": "cookie, authorization"})

    return [list_graphs, list_names, list_labels, list_thumbnails]


def _graph_and_digest(text: str) -> tuple[str, str]:
    graph, dot, digest = text.rpartition(".")
    if not dot:
        raise BadInput(
            f"A thumbnail is named by a graph, a dot and a digest, and not {text!r}.",
            where={"path": "/of"},
        )
    return graph, digest


async def _whole_list(
    services: EditorServices, identity: Identity, *, deleted: bool
) -> list[GraphView]:
    sees = await services.rights.sight(identity)
    is_restricted = await services.rights.restrictions()
    listed = await services.catalogue.all(deleted=deleted)
    return [
        _in_sight(services, view, identity, restricted=is_restricted(view.id))
        for view in listed
        if sees(view.id)
    ]


def _catalogue(app_state: EditorState) -> list[ControllerRouterHandler]:
    @post(
        "/api/graphs",
        summary="Make a graph of a UMRF file of any dialect, or an empty one of {name}, in a "
        "`folder`, with the rights of the graph `copy_of`; with `preview` only say what a file would "
        "become, and store nothing",
        operation_id="createGraph",
        guards=[Needs("edit")],
        opt=reads(JsonObject),
        responses={
            200: answer(Preview, text="What the file would become"),
            201: answer(MadeGraph, text="Made"),
        },
        request_max_body_size=BODY_LIMIT,
    )
    async def create_graph(
        request: Asking,
        preview: bool = False,
        folder: str | None = None,
        copy_of: str | None = None,
    ) -> Response[MadeGraph] | Response[Preview]:
        if preview:
            found = await _previewed(app_state.services, await request.body())
            return Response(encoded(Preview, found), status_code=200)
        services, person = await app_state.acting(request)
        if folder is not None:
            await services.rights.check("folder", folder, identity_of(request), edits=True)
            await services.folders.require(folder)
        rule = None
        if copy_of is not None:
            await services.rights.check("graph", copy_of, identity_of(request), edits=False)
            rule = await services.rights.rule_for_copy([copy_of], folder, person.id)
        body = await request.body()
        made, told = await services.catalogue.create(body, person.id, folder=folder, rule=rule)
        return made_graph(made, told)

    @get(
        "/api/graphs/{graph_id:str}",
        summary="One graph",
        operation_id="getGraph",
        guards=[Needs("see")],
    )
    async def get_graph(graph_id: str, request: Asking) -> GraphView:
        services, identity = app_state.services, identity_of(request)
        view = await services.catalogue.get(graph_id)
        restricted = await services.rights.is_restricted(graph_id)
        return _in_sight(services, view, identity, restricted=restricted)

    @patch(
        "/api/graphs/{graph_id:str}",
        summary="Change the name or description of a graph",
        operation_id="describeGraph",
        guards=[Needs("edit")],
    )
    async def describe_graph(graph_id: str, data: Describing, request: Asking) -> GraphView:
        services, person = await app_state.acting(request)
        return await services.catalogue.describe(
            graph_id, person.id, name=data.name, description=data.description
        )

    @delete(
        "/api/graphs/{graph_id:str}",
        summary="Delete a graph; it can be recovered",
        operation_id="deleteGraph",
        guards=[Needs("edit")],
    )
    async def delete_graph(graph_id: str, request: Asking) -> None:
        services, person = await app_state.acting(request)
        await services.catalogue.delete(graph_id, person.id)

    @post(
        "/api/graphs/{graph_id:str}/recover",
        status_code=200,
        summary="Bring a deleted graph back",
        operation_id="recoverGraph",
        guards=[Needs("edit")],
    )
    async def recover_graph(graph_id: str, request: Asking) -> GraphView:
        services, person = await app_state.acting(request)
        return await services.catalogue.recover(graph_id, person.id)

    return [create_graph, get_graph, describe_graph, delete_graph, recover_graph]


def _contents(app_state: EditorState) -> list[ControllerRouterHandler]:
    @get(
        "/api/graphs/{graph_id:str}/umrf",
        summary="A graph as UMRF, now or after its change `at`; `identities`: with those of its actions",
        operation_id="getUmrf",
        description="Answers the graph itself.",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
        responses={200: answer(UmrfGraph)},
    )
    async def get_umrf(
        graph_id: str, at: SeqOrNone = None, *, identities: bool = False
    ) -> Response[bytes]:
        services = app_state.services
        await services.catalogue.require(graph_id)
        sight = await services.graph_reader.moment(graph_id, at)
        stamp = codec.Stamp(graph_id, None, None) if identities else None
        text = await services.graph_reader.ask(contents.umrf, sight, stamp)
        return Response(text, media_type="application/json", headers={"x-seq": str(sight.seq)})

    @get(
        "/api/graphs/{graph_id:str}/problems",
        summary="What is wrong with a graph, now or after its change `seq`",
        operation_id="getProblems",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
    )
    async def get_problems(graph_id: str, seq: SeqOrNone = None) -> Problems:
        services = app_state.services
        await services.catalogue.require(graph_id)
        sight = await services.graph_reader.moment(graph_id, seq)
        return Problems(
            sight.seq, encoded(tuple[Problem, ...], await services.graph_checks.problems(sight))
        )

    @get(
        "/api/graphs/{graph_id:str}/breakpoints",
        summary="Where led runs of a graph wait, as a start of it after its change `at` names that; with "
        "`inside` also in the graphs inside, as they are now, for a start that opens them",
        operation_id="getBreakpoints",
        description="Answers what `breakpoints` of a start takes. Those of the graphs inside have "
        '`inside`, the name of their graph: a start with `levels: "opened"` keeps them wherever '
        "that stands, any other is refused with them.",
        guards=[Needs("see")],
    )
    async def get_breakpoints(
        graph_id: str, at: SeqOrNone = None, *, inside: bool = False
    ) -> list[Breakpoint]:
        services = app_state.services
        await services.catalogue.require(graph_id)
        return await services.versions.breakpoints(graph_id, at, inside=inside)

    @post(
        "/api/graphs/{graph_id:str}/rewriting",
        status_code=200,
        summary="What an edited text of a graph would change, key by key; stores nothing",
        operation_id="getRewriting",
        guards=[Needs("see")],
        opt=reads(UmrfGraph),
        request_max_body_size=BODY_LIMIT,
    )
    async def get_rewriting(graph_id: str, seq: Seq, request: Asking) -> TextEdit:
        services = app_state.services
        text = await request.body()
        await services.catalogue.require(graph_id)
        then = await services.graph_reader.at(graph_id, seq)
        inside = await _inside_with(services, then, text)
        return encoded(TextEdit, await services.workers.files(edited_text, then, text, inside))

    @put(
        "/api/graphs/{graph_id:str}/umrf",
        summary="Merge a text, edited from that of the change `seq`, into a graph: as one edit, or not at "
        "all where others have changed the same meanwhile",
        operation_id="putUmrf",
        description="`seq` of the answer is the number of this edit, `merged` whether changes after"
        " the `seq` of the request came before it. 409 with `where.keys`: others have changed "
        "these keys.",
        guards=[Needs("edit")],
        opt=reads(UmrfGraph),
        request_max_body_size=BODY_LIMIT,
    )
    async def put_umrf(graph_id: str, seq: Seq, request: Asking) -> MergedGraph:
        services, person = app_state.services, person_of(request)
        text = await request.body()
        await services.catalogue.require(graph_id, "graph")
        await services.people.seen(person)
        then = await services.graph_reader.at(graph_id, seq)
        inside = await _inside_with(services, then, text)

        async def compute(state: bytes, now: int) -> MergingOutcome:
            found = await services.workers.files(merging, then, state, text, inside)
            if found.conflicts:
                raise Conflict(
                    f"Since change {seq} others have changed {len(found.conflicts)} of the fields that "
                    "this text changes.",
                    where={"seq": now, "keys": list(found.conflicts[:_TOLD])},
                )
            return found

        async with services.rooms.reach(graph_stream(graph_id)) as room:
            edit = await store(room, person.id, compute, lambda found: found.update)
        return MergedGraph(edit.seq, edit.before > seq, edit.computed.problems)

    return [get_umrf, get_problems, get_breakpoints, get_rewriting, put_umrf]
