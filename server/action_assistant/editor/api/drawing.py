"""Routes that help to draw and keep nothing: UMRF text as pieces to paste, and rehearsals."""

from typing import Any, Final

from litestar import Request, post
from litestar.types import ControllerRouterHandler

from action_assistant.editor.interchange import importing
from action_assistant.editor.interchange.importing import Pieces
from action_assistant.editor.interchange.rehearsal import Rehearsal, Rehearsing, rehearsed
from action_assistant.editor.services import EditorState
from action_assistant.editor.workers import encoded
from action_assistant.umrf.json.text import JsonObject
from action_assistant.umrf.semantics import Script
from action_assistant.web.auth.access import Needs
from action_assistant.web.server.application import BODY_LIMIT
from action_assistant.web.server.openapi import reads

_SCRIPT: Final = 1_000_000  # bytes of a body that says what to play


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the routes that read pasted UMRF text, and that compute what a graph would do in a
    run. `app_state` has the services once they are open."""

    @post(
        "/api/pieces",
        status_code=200,
        summary="Read UMRF text of any dialect, a graph or one action, as pieces of a document; "
        "nothing is stored",
        operation_id="readPieces",
        guards=[Needs("see")],
        opt=reads(JsonObject),
        request_max_body_size=BODY_LIMIT,
    )
    async def read_pieces(request: Request[Any, Any, Any]) -> Pieces:
        found = await app_state.services.workers.files(importing.pieces, await request.body())
        return encoded(Pieces, found)

    @post(
        "/api/graphs/{graph_id:str}/rehearsal",
        status_code=200,
        summary="What a graph would do by the engine's rules: its trace; nothing is recorded",
        operation_id="rehearse",
        opt=reads(Rehearsing, Script=Script),
        guards=[Needs("see")],
        request_max_body_size=_SCRIPT,
    )
    async def rehearse(graph_id: str, data: Rehearsing) -> Rehearsal:
        services = app_state.services
        await services.catalogue.require(graph_id)
        sight = await services.graph_reader.moment(graph_id, data.seq)
        inside = await services.graph_checks.inside(sight)
        found = await services.workers.files(rehearsed, sight, data, inside)
        return encoded(Rehearsal, found)

    return [read_pieces, rehearse]
