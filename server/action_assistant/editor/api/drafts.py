"""Routes of drafts: make, list, compare, propose, answer and merge them."""

from typing import Any

import msgspec
from litestar import Request, Response, delete, get, post
from litestar.types import ControllerRouterHandler

from action_assistant.editor.history.drafts.draft_merges import (
    AskedMerge,
    MergedDraft,
    MergePreview,
    WantedMerge,
)
from action_assistant.editor.history.drafts.drafts import DraftView, NewDraft, Remark
from action_assistant.editor.log.graph_events import DraftAnswered
from action_assistant.editor.services import EditorState
from action_assistant.web.auth.access import Needs

Asking = Request[Any, Any, Any]


class Proposing(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The note that goes with a proposal to merge a draft."""

    note: Remark = ""


class Answering(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An answer, yes or no, to a proposal by a person who has seen the draft after its change
    `seq`."""

    yes: bool
    seq: int
    note: Remark = ""


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the routes that only drafts have: list, make, propose, answer, preview and merge.
    `app_state` has the services once they are open."""
    return [*_drafts(app_state), *_proposals(app_state), *_merges(app_state)]


def _drafts(app_state: EditorState) -> list[ControllerRouterHandler]:
    @get(
        "/api/graphs/{graph_id:str}/drafts",
        summary="The drafts of a graph, the last changed first",
        operation_id="listDrafts",
        guards=[Needs("see")],
    )
    async def list_drafts(graph_id: str) -> list[DraftView]:
        return await app_state.services.drafts.of(graph_id)

    @post(
        "/api/graphs/{graph_id:str}/drafts",
        summary="Make a draft: a graph that begins as this one, to be worked on apart and merged",
        operation_id="makeDraft",
        guards=[Needs("edit")],
    )
    async def make_draft(
        graph_id: str, request: Asking, data: NewDraft | None = None
    ) -> Response[DraftView]:
        services, person = await app_state.acting(request)
        made = await services.drafts.make(graph_id, person.id, data or NewDraft())
        headers = {"location": f"/api/drafts/{made.id}"}
        return Response(made, status_code=201, headers=headers)

    @get(
        "/api/drafts/{draft_id:str}",
        summary="One draft",
        operation_id="getDraft",
        guards=[Needs("see")],
    )
    async def get_draft(draft_id: str) -> DraftView:
        return await app_state.services.drafts.get(draft_id)

    return [list_drafts, make_draft, get_draft]


def _proposals(app_state: EditorState) -> list[ControllerRouterHandler]:
    @post(
        "/api/drafts/{draft_id:str}/proposal",
        status_code=200,
        summary="Propose that a draft be merged",
        operation_id="proposeDraft",
        guards=[Needs("edit")],
    )
    async def propose_draft(draft_id: str, data: Proposing, request: Asking) -> DraftView:
        services, person = await app_state.acting(request)
        return await services.drafts.propose(draft_id, person.id, data.note)

    @delete(
        "/api/drafts/{draft_id:str}/proposal",
        status_code=200,
        summary="Take a proposal back",
        operation_id="withdrawProposal",
        guards=[Needs("edit")],
    )
    async def withdraw_proposal(draft_id: str, request: Asking) -> DraftView:
        services, person = await app_state.acting(request)
        return await services.drafts.withdraw(draft_id, person.id)

    @post(
        "/api/drafts/{draft_id:str}/answers",
        status_code=200,
        summary="Say yes or no to the proposal of a draft",
        operation_id="answerProposal",
        guards=[Needs("edit")],
    )
    async def answer_proposal(draft_id: str, data: Answering, request: Asking) -> DraftView:
        services, person = await app_state.acting(request)
        said = DraftAnswered(data.yes, data.note.strip(), data.seq)
        return await services.drafts.answer(draft_id, person.id, said)

    return [propose_draft, withdraw_proposal, answer_proposal]


def _merges(app_state: EditorState) -> list[ControllerRouterHandler]:
    @post(
        "/api/drafts/{draft_id:str}/preview",
        status_code=200,
        summary="What a merge would do now, what both sides changed, and the problems that would come "
        "with it; stores nothing",
        operation_id="previewMerge",
        guards=[Needs("see")],
    )
    async def preview_merge(draft_id: str, data: AskedMerge) -> MergePreview:
        return await app_state.services.draft_merges.preview(draft_id, data)

    @post(
        "/api/drafts/{draft_id:str}/merge",
        status_code=200,
        summary="Bring what a draft did into its graph, or the other way, as one edit that can be undone; "
        "409 where either was changed since, or a conflict has no choice",
        operation_id="mergeDraft",
        guards=[Needs("edit")],
    )
    async def merge_draft(draft_id: str, data: WantedMerge, request: Asking) -> MergedDraft:
        services, person = await app_state.acting(request)
        return await services.draft_merges.merge(draft_id, person.id, data)

    return [preview_merge, merge_draft]
