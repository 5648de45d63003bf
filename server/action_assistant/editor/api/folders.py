"""Routes of folders of graphs."""

from typing import Any

import msgspec
from litestar import Request, Response, delete, get, patch, post, put
from litestar.types import ControllerRouterHandler

from action_assistant.editor.catalogue.catalogue import GraphView
from action_assistant.editor.catalogue.folders import Folder
from action_assistant.editor.services import EditorServices, EditorState
from action_assistant.web.auth.access import Needs, identity_of

Asking = Request[Any, Any, Any]


class NewFolder(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request for a folder in `parent`; null: in no folder."""

    name: str
    parent: str | None = None


class RenamingFolder(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Another name of a folder."""

    name: str


class MovingFolder(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A folder into which another one is moved; null: out of all folders."""

    parent: str | None


class Filing(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A folder into which a graph is moved; null: out of all folders."""

    folder: str | None


async def _check_target(services: EditorServices, folder: str | None, request: Asking) -> None:
    """Raise NotFound or Forbidden if the person may not see or edit the folder that a body names."""
    if folder is not None:
        await services.rights.check("folder", folder, identity_of(request), edits=True)


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the routes of folders, and the one that moves a graph into a folder."""

    @get(
        "/api/folders",
        summary="All folders of graphs, by name",
        operation_id="listFolders",
        guards=[Needs("see")],
    )
    async def list_folders(request: Asking) -> list[Folder]:
        return await app_state.services.folders.seen_by(identity_of(request))

    @post(
        "/api/folders",
        summary="Make a folder of graphs",
        operation_id="makeFolder",
        guards=[Needs("edit")],
    )
    async def make_folder(data: NewFolder, request: Asking) -> Response[Folder]:
        services, person = await app_state.acting(request)
        await _check_target(services, data.parent, request)
        made = await services.folders.make(data.name, data.parent, person.id)
        return Response(made, status_code=201, headers={"location": f"/api/folders/{made.id}"})

    @patch(
        "/api/folders/{folder_id:str}",
        summary="Rename a folder",
        operation_id="renameFolder",
        guards=[Needs("edit")],
    )
    async def rename_folder(folder_id: str, data: RenamingFolder, request: Asking) -> Folder:
        services, person = await app_state.acting(request)
        return await services.folders.rename(folder_id, data.name, person.id)

    @put(
        "/api/folders/{folder_id:str}/parent",
        summary="Move a folder with its contents into another one",
        operation_id="moveFolder",
        guards=[Needs("edit")],
    )
    async def move_folder(folder_id: str, data: MovingFolder, request: Asking) -> Folder:
        services, person = await app_state.acting(request)
        await _check_target(services, data.parent, request)
        return await services.folders.move(folder_id, data.parent, person.id)

    @delete(
        "/api/folders/{folder_id:str}",
        summary="Remove a folder; its graphs and folders go into the folder around it",
        operation_id="removeFolder",
        guards=[Needs("edit")],
    )
    async def remove_folder(folder_id: str, request: Asking) -> None:
        services, person = await app_state.acting(request)
        await services.folders.remove(folder_id, person.id)

    @put(
        "/api/graphs/{graph_id:str}/folder",
        summary="Move a graph into a folder",
        operation_id="fileGraph",
        description="`folder` null: out of all folders.",
        guards=[Needs("edit")],
    )
    async def file_graph(graph_id: str, data: Filing, request: Asking) -> GraphView:
        services, person = await app_state.acting(request)
        await _check_target(services, data.folder, request)
        await services.folders.file(graph_id, data.folder, person.id)
        return await services.catalogue.get(graph_id)

    return [list_folders, make_folder, rename_folder, move_folder, remove_folder, file_graph]
