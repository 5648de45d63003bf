"""The one place where rights on graphs are enforced for routes that name a graph in their path.

Every route of the editor is either guarded here, or listed as one that filters what it answers or
that tells nothing of graphs. A route that is neither stops the program from starting.
"""

from collections.abc import Iterable
from typing import Any, Final

from litestar.connection import ASGIConnection
from litestar.handlers import WebsocketRouteHandler
from litestar.handlers.base import BaseRouteHandler
from litestar.types import ControllerRouterHandler

from action_assistant.editor.catalogue.graph_rights import Kind
from action_assistant.editor.services import EditorState
from action_assistant.errors import CannotStart
from action_assistant.web.auth.access import Needs, identity_of

#: The parameters of paths that name a thing with rights.
PARAMETERS: Final[dict[str, Kind]] = {
    "graph_id": "graph",
    "draft_id": "draft",
    "version_id": "version",
    "action_id": "action",
    "folder_id": "folder",
}
#: Routes that answer for several graphs: they leave out what the asker may not see.
FILTERED: Final = frozenset(
    {
        "/api/graphs",
        "/api/graphs/names",
        "/api/graphs/labels",
        "/api/graphs/thumbnails",
        "/api/folders",
        "/api/events",
        "/api/actions",
        "/api/actions/graphs",
        "/api/mentions",
    }
)
#: Routes whose answers tell nothing of any graph.
WITHOUT_GRAPHS: Final = frozenset(
    {
        *("/api/config", "/api/people", "/api/examples", "/api/pieces", "/api/values-package.zip"),
        *("/api/actions/deleted", "/api/graph-rules"),  # the latter is for owners
        "/api/mentions/read",
    }
)


class GraphGuard:
    """A guard that answers 404 for a thing that the asker may not see, as for one that does not
    exist, and 403 where they may only look at it."""

    def __init__(self, app_state: EditorState) -> None:
        self._app_state = app_state

    async def __call__(
        self, connection: ASGIConnection[Any, Any, Any, Any], handler: BaseRouteHandler
    ) -> None:
        """Raise NotFound or Forbidden as `GraphRights.check` does, for each thing in the path."""
        edits = any(isinstance(g, Needs) and g.permission != "see" for g in handler.guards or ())
        identity = identity_of(connection)
        for name, value in connection.path_params.items():
            kind = PARAMETERS.get(name)
            if kind is not None:
                rights = self._app_state.services.rights
                await rights.check(kind, str(value), identity, edits=edits)


def guarded(
    handlers: Iterable[ControllerRouterHandler], app_state: EditorState
) -> list[ControllerRouterHandler]:
    """Return the routes of graphs with their guard. Raise CannotStart for a route that names no
    thing with rights in its path and is not known to need none. Sockets check by themselves, since
    they answer refusals in their own way."""
    guard = GraphGuard(app_state)
    checked = list(handlers)
    for handler in checked:
        if not isinstance(handler, BaseRouteHandler) or isinstance(handler, WebsocketRouteHandler):
            continue
        for path in handler.paths:
            if any(f"{{{name}:" in path for name in PARAMETERS):
                handler.guards = [*(handler.guards or ()), guard]
            elif path not in FILTERED | WITHOUT_GRAPHS:
                raise CannotStart(f"{path} does not say how it treats rights on graphs.")
    return checked
