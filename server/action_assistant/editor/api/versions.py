"""Routes of versions."""

from typing import Any

import msgspec
from litestar import Request, Response, delete, get, post, put
from litestar.types import ControllerRouterHandler

from action_assistant.editor.api.graphs import SeqOrNone
from action_assistant.editor.catalogue.versions import InsideView, VersionView
from action_assistant.editor.interchange.subgraphs import zipped
from action_assistant.editor.services import EditorState
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.web.auth.access import Needs, person_of
from action_assistant.web.auth.graph_seals import Sight
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.http.compression import COMPRESSED
from action_assistant.web.server.openapi import FileBytes, answer


class Publishing(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to publish a version. `seq`: the change of the graph to publish, the newest if
    missing."""

    label: str = ""
    seq: int | None = None
    note: str = ""


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the routes of published versions: list, publish and get."""

    @get(
        "/api/graphs/{graph_id:str}/versions",
        summary="The versions of a graph, newest first, without their UMRF",
        operation_id="listVersions",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
    )
    async def list_versions(graph_id: str) -> list[VersionView]:
        services = app_state.services
        await services.catalogue.require(graph_id)
        return await services.versions.of(graph_id)

    @post(
        "/api/graphs/{graph_id:str}/versions",
        summary="Publish a graph as it is, or as it was after its change `seq`",
        operation_id="publishVersion",
        description="Without label and note an existing version with the same graphs inside is "
        "answered. 413 for a graph that is too large to be run.",
        guards=[Needs("edit")],
        responses={200: answer(VersionView, text="It had been published before")},
    )
    async def publish_version(
        graph_id: str, request: Request[Any, Any, Any], data: Publishing | None = None
    ) -> Response[VersionView]:
        services, person = app_state.services, person_of(request)
        await services.catalogue.require(graph_id)
        await services.people.seen(person)
        wanted = data or Publishing()
        version, new = await services.versions.publish(
            graph_id, person, label=wanted.label, note=wanted.note, seq=wanted.seq
        )
        return Response(
            version,
            status_code=201 if new else 200,
            headers={"location": f"/api/versions/{version.id}"},
        )

    @get(
        "/api/graphs/{graph_id:str}/subgraphs",
        summary="The graphs inside of a graph, as they are now, at all levels",
        operation_id="getSubgraphs",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
    )
    async def get_subgraphs(graph_id: str, at: SeqOrNone = None) -> InsideView:
        services = app_state.services
        await services.catalogue.require(graph_id)
        return await services.versions.inside(graph_id, at)

    @get(
        "/api/graphs/{graph_id:str}/subgraphs.zip",
        summary="These graphs as files for an engine to index, in a ZIP file",
        operation_id="downloadSubgraphs",
        guards=[Needs("see")],
        responses={200: answer(FileBytes, media="application/zip")},
    )
    async def download_subgraphs(graph_id: str, at: SeqOrNone = None) -> Response[bytes]:
        services = app_state.services
        await services.catalogue.require(graph_id)
        inside = await services.versions.inside(graph_id, at)
        graphs = [(each.name, bytes(each.umrf)) for each in inside.subgraphs]
        made = await services.workers.files(zipped, graphs)
        return Response(
            made,
            media_type="application/zip",
            headers={
                "content-disposition": 'attachment; filename="graphs_inside.zip"',
                "x-seq": str(inside.seq),
            },
        )

    @get(
        "/api/versions/{version_id:str}/breakpoints",
        summary="Where led runs of a version wait, as a start of it names that: in its graph as that was "
        "then, and in the graphs inside, as they are now, for a start that opens them",
        operation_id="getVersionBreakpoints",
        description="Answers what `breakpoints` of a start takes. Those of the graphs inside have "
        '`inside`, the name of their graph: a start with `levels: "opened"` keeps them wherever '
        "that stands, any other is refused with them.",
        guards=[Needs("see")],
    )
    async def get_version_breakpoints(version_id: str) -> list[Breakpoint]:
        return await app_state.services.versions.breakpoints_of(version_id)

    @get(
        "/api/versions/{version_id:str}",
        summary="One version with its UMRF",
        operation_id="getVersion",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
    )
    async def get_version(version_id: str) -> VersionView:
        return await app_state.services.versions.get(version_id)

    @get(
        "/api/versions/{version_id:str}/sight",
        summary="Who may see runs of a version, sealed for a start of it",
        operation_id="getSight",
        guards=[Needs("see")],
    )
    async def get_sight(version_id: str) -> Sight:
        services = app_state.services
        digest, graphs = await services.versions.graphs_in(version_id)
        return await services.rights.sight_of(version_id, digest, graphs)

    @put(
        "/api/versions/{version_id:str}/release",
        summary="Release a version: robots of which their owners demand that start no other",
        operation_id="releaseVersion",
        guards=[Needs("share")],
    )
    async def release(version_id: str, request: Request[Any, Any, Any]) -> VersionView:
        services, person = app_state.services, person_of(request)
        await services.people.seen(person)
        return await services.versions.release(version_id, PersonRef(person.id, person.name))

    @delete(
        "/api/versions/{version_id:str}/release",
        status_code=200,
        summary="Withdraw the release of a version",
        operation_id="withdrawRelease",
        guards=[Needs("share")],
    )
    async def withdraw(version_id: str, request: Request[Any, Any, Any]) -> VersionView:
        services, person = app_state.services, person_of(request)
        await services.people.seen(person)
        return await services.versions.withdraw(version_id, PersonRef(person.id, person.name))

    return [
        *(list_versions, publish_version, get_subgraphs, download_subgraphs),
        *(get_version, get_version_breakpoints, get_sight, release, withdraw),
    ]
