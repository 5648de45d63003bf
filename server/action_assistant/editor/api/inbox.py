"""Routes of a person's own inbox."""

from typing import Annotated, Any

import msgspec
from litestar import Request, get, post
from litestar.types import ControllerRouterHandler

from action_assistant.editor.inbox import Inbox
from action_assistant.editor.services import EditorState
from action_assistant.web.auth.access import Needs, PersonOnly, identity_of, person_of

_Key = Annotated[str, msgspec.Meta(max_length=200)]
_Asking = Request[Any, Any, Any]


class ReadMentions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The keys of mentions that the person has read."""

    keys: Annotated[tuple[_Key, ...], msgspec.Meta(max_length=100)]


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the routes under `/api/mentions`: each person has their own, programs have none."""

    @get(
        "/api/mentions",
        summary="The comments in which others have mentioned you, the newest first",
        operation_id="listMentions",
        guards=[PersonOnly(), Needs("see")],
    )
    async def list_mentions(request: _Asking) -> Inbox:
        services = app_state.services
        sees = await services.rights.sight(identity_of(request))
        return await services.inboxes.of(person_of(request).id, sees)

    @post(
        "/api/mentions/read",
        status_code=204,
        summary="Mark mentions of yourself as read",
        operation_id="readMentions",
        guards=[PersonOnly(), Needs("see")],
    )
    async def read_mentions(data: ReadMentions, request: _Asking) -> None:
        await app_state.services.inboxes.read(person_of(request).id, data.keys)

    return [list_mentions, read_mentions]
