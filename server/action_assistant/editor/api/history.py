"""Routes of a graph's history: changes and their authors, earlier states, differences, and going back."""

from typing import Annotated, Any, Final

import msgspec
from litestar import Request, Response, get, post
from litestar.params import Parameter
from litestar.types import ControllerRouterHandler

from action_assistant.editor.api.graphs import Seq, SeqOrNone
from action_assistant.editor.catalogue.catalogue import GraphView
from action_assistant.editor.history import change_summaries
from action_assistant.editor.history.blame import DocumentStep, FieldBlame, FieldValue
from action_assistant.editor.history.course_search import AskingSince, SinceWhen
from action_assistant.editor.history.graph_history import HistoryEntry, without_hidden
from action_assistant.editor.history.restoring import EditsOfOne, GoneBack
from action_assistant.editor.log.graph_events import graph_stream
from action_assistant.editor.services import EditorServices, EditorState
from action_assistant.editor.workers import encoded
from action_assistant.errors import Conflict
from action_assistant.umrf.difference import Difference
from action_assistant.web.auth.access import Needs, identity_of, person_of
from action_assistant.web.http.compression import COMPRESSED
from action_assistant.web.server.openapi import MOST_NUMBER, answer

Asking = Request[Any, Any, Any]

_STEPS: Final = 5_000  # changes of keys in one answer


class Restoring(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The change to whose state the graph is restored; with `of` only the action, arrow or note
    with this key is."""

    seq: int
    of: str | None = None


class PastDocument(msgspec.Struct, frozen=True):
    """The root maps of a document as they were after its change `seq` (docs/contracts.md 1)."""

    meta: dict[str, Any]
    actions: dict[str, Any]
    relations: dict[str, Any]
    positions: dict[str, Any]
    comments: dict[str, Any]


async def _moment(services: EditorServices, graph: str, seq: int | None, place: str) -> int:
    """Return the number of a change of a graph: `seq`, or the newest one for None, after the index
    of changes has caught up to it. Raise Conflict, with `place` as its place, if there is no such
    change."""
    at = await services.journal.newest(graph_stream(graph)) if seq is None else seq
    upto = await services.change_index.upto(graph, at)
    if upto < at:
        raise Conflict(
            f"This graph has the changes 1 to {upto}; there is no {at}.", where={"path": place}
        )
    return at


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the routes that read the history of a graph, and that restore or revert."""
    return [*_looking(app_state), *_blaming(app_state), *_going(app_state)]


def _looking(app_state: EditorState) -> list[ControllerRouterHandler]:
    @get(
        "/api/graphs/{graph_id:str}/history",
        summary="What was done to a graph, newest first",
        operation_id="getHistory",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
    )
    async def get_history(
        graph_id: str,
        request: Asking,
        limit: Annotated[int, Parameter(ge=1, le=1000)] = 100,
        before: SeqOrNone = None,
    ) -> list[HistoryEntry]:
        services = app_state.services
        await services.catalogue.require(graph_id)
        found = await services.history.of(graph_id, limit=limit, before=before)
        sees = await services.rights.sight(identity_of(request))
        return encoded(list[HistoryEntry], without_hidden(found, sees))

    @get(
        "/api/graphs/{graph_id:str}/document",
        summary="The document of a graph as it was after its change `at`",
        operation_id="getDocument",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
        responses={200: answer(PastDocument)},
    )
    async def get_document(graph_id: str, at: Seq) -> Response[bytes]:
        services = app_state.services
        await services.catalogue.require(graph_id)
        moment = await _moment(services, graph_id, at, "/at")
        text = await services.change_index.value(change_summaries.document_at, graph_id, moment)
        return Response(text, media_type="application/json")

    @get(
        "/api/graphs/{graph_id:str}/changes",
        summary="The newest changes of keys after the change `after` up to `upto`, in order of time: "
        "the steps between two documents",
        operation_id="getChanges",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
    )
    async def get_changes(
        graph_id: str,
        after: Annotated[int, Parameter(ge=0, le=MOST_NUMBER)],
        upto: Seq,
        limit: Annotated[int, Parameter(ge=1, le=_STEPS)] = _STEPS,
    ) -> list[DocumentStep]:
        services = app_state.services
        await services.catalogue.require(graph_id)
        newest = await services.journal.newest(graph_stream(graph_id))
        found = await services.blame.changes(graph_id, after, min(upto, newest), limit)
        return encoded(list[DocumentStep], found)

    @get(
        "/api/graphs/{graph_id:str}/diff",
        summary="What differs between two changes of a graph; `to` is now when left out",
        operation_id="getDifference",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
    )
    async def get_difference(
        graph_id: str,
        before: Annotated[int, Parameter(query="from", ge=1, le=MOST_NUMBER)],
        after: Annotated[int | None, Parameter(query="to", ge=1, le=MOST_NUMBER)] = None,
    ) -> Difference:
        services = app_state.services
        await services.catalogue.require(graph_id)
        then = await _moment(services, graph_id, before, "/from")
        later = await _moment(services, graph_id, after, "/to")
        return encoded(
            Difference,
            await services.change_index.text(change_summaries.differing, graph_id, then, later),
        )

    return [get_history, get_document, get_changes, get_difference]


def _blaming(app_state: EditorState) -> list[ControllerRouterHandler]:
    @get(
        "/api/graphs/{graph_id:str}/blame",
        summary="Who gave each field of an action, arrow or note the value that it has, and when",
        operation_id="getBlame",
        description='`of` is the key of an action, arrow or note; "" is the graph.',
        guards=[Needs("see")],
        middleware=[COMPRESSED],
    )
    async def get_blame(graph_id: str, of: str, at: SeqOrNone = None) -> list[FieldBlame]:
        services = app_state.services
        await services.catalogue.require(graph_id)
        return encoded(list[FieldBlame], await services.blame.of(graph_id, of, at))

    @get(
        "/api/graphs/{graph_id:str}/blame/values",
        summary="All values that a field of an action, arrow or note has had, newest first",
        operation_id="getValues",
        guards=[Needs("see")],
        middleware=[COMPRESSED],
    )
    async def get_values(
        graph_id: str, of: str, field: str, at: SeqOrNone = None
    ) -> list[FieldValue]:
        services = app_state.services
        await services.catalogue.require(graph_id)
        return encoded(list[FieldValue], await services.blame.of_field(graph_id, of, field, at))

    @post(
        "/api/graphs/{graph_id:str}/since",
        status_code=200,
        summary="Since which change a graph goes another way, by simulating it at past moments; stores "
        "nothing",
        operation_id="getSince",
        guards=[Needs("see")],
    )
    async def get_since(graph_id: str, data: AskingSince) -> SinceWhen:
        services = app_state.services
        await services.catalogue.require(graph_id)
        return await services.course_search.since(graph_id, data)

    return [get_blame, get_values, get_since]


def _going(app_state: EditorState) -> list[ControllerRouterHandler]:
    @post(
        "/api/graphs/{graph_id:str}/restore",
        status_code=200,
        summary="Make a graph, or one action of it, what it was after an earlier change, as an edit "
        "that can be undone",
        operation_id="restoreGraph",
        guards=[Needs("edit")],
    )
    async def restore_graph(graph_id: str, data: Restoring, request: Asking) -> GraphView:
        services, person = app_state.services, person_of(request)
        await services.catalogue.require(graph_id)
        await services.people.seen(person)
        if data.of is None:
            await services.restoring.restore(graph_id, person.id, data.seq)
        else:
            await services.restoring.restore_one(graph_id, person.id, data.seq, data.of)
        return await services.catalogue.get(graph_id)

    @post(
        "/api/graphs/{graph_id:str}/revert",
        status_code=200,
        summary="Take back what one person changed, where nobody has changed it since, as an edit "
        "that can be undone",
        operation_id="revertGraph",
        guards=[Needs("edit")],
    )
    async def revert_graph(graph_id: str, data: EditsOfOne, request: Asking) -> GoneBack:
        services, person = app_state.services, person_of(request)
        await services.catalogue.require(graph_id)
        await services.people.seen(person)
        return await services.restoring.revert(graph_id, person.id, data)

    return [restore_graph, revert_graph]
