"""Routes of C++ packages: list those of a graph's actions, read one, download all."""

from typing import Annotated

from litestar import Response, get
from litestar.params import QueryParameter
from litestar.types import ControllerRouterHandler

from action_assistant.editor.api.graphs import SeqOrNone
from action_assistant.editor.interchange import action_packages
from action_assistant.editor.interchange.action_packages import PackageContents, PackageList
from action_assistant.editor.services import EditorState
from action_assistant.editor.workers import encoded
from action_assistant.umrf.kept_values import KEEPER_PACKAGE
from action_assistant.web.auth.access import Needs
from action_assistant.web.server.openapi import FileBytes, answer

Packages = Annotated[list[str] | None, QueryParameter(name="package", max_items=1000)]


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the routes that generate C++ packages from graphs and actions. They store nothing."""

    @get(
        "/api/graphs/{graph_id:str}/packages",
        summary="The C++ packages of a graph's actions, now or after its change `at`, and why some "
        "have none",
        operation_id="listPackages",
        guards=[Needs("see")],
    )
    async def list_packages(graph_id: str, at: SeqOrNone = None) -> PackageList:
        services = app_state.services
        kind = await services.catalogue.require(graph_id)
        sight = await services.graph_reader.moment(graph_id, at)
        return encoded(
            PackageList, await services.workers.files(action_packages.listed, sight, kind)
        )

    @get(
        "/api/graphs/{graph_id:str}/packages/{package:str}",
        summary="The files of one of these packages",
        operation_id="getPackage",
        guards=[Needs("see")],
    )
    async def get_package(graph_id: str, package: str, at: SeqOrNone = None) -> PackageContents:
        services = app_state.services
        kind = await services.catalogue.require(graph_id)
        sight = await services.graph_reader.moment(graph_id, at)
        made = await services.workers.files(action_packages.contents, sight, kind, package)
        return encoded(PackageContents, made)

    @get(
        "/api/graphs/{graph_id:str}/packages.zip",
        summary="These packages, or all that there are, as a ZIP file",
        operation_id="downloadPackages",
        guards=[Needs("see")],
        responses={200: answer(FileBytes, media="application/zip")},
    )
    async def download_packages(
        graph_id: str, at: SeqOrNone = None, packages: Packages = None
    ) -> Response[bytes]:
        services = app_state.services
        kind = await services.catalogue.require(graph_id)
        sight = await services.graph_reader.moment(graph_id, at)
        made = await services.workers.files(action_packages.archive, sight, kind, packages or [])
        name = f"{packages[0]}.zip" if packages and len(packages) == 1 else "action_packages.zip"
        return Response(
            made,
            media_type="application/zip",
            headers={
                "content-disposition": f'attachment; filename="{name}"',
                "x-seq": str(sight.seq),
            },
        )

    @get(
        "/api/values-package.zip",
        summary="The package that keeps values, with which led runs can hand them from robot to "
        "robot, as a ZIP file",
        operation_id="downloadValuesPackage",
        guards=[Needs("see")],
        responses={200: answer(FileBytes, media="application/zip")},
    )
    async def download_values_package() -> Response[bytes]:
        return Response(
            await app_state.services.workers.files(action_packages.keeper_archive),
            media_type="application/zip",
            headers={"content-disposition": f'attachment; filename="{KEEPER_PACKAGE}.zip"'},
        )

    return [list_packages, get_package, download_packages, download_values_package]
