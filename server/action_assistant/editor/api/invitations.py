"""Routes of invitations, for owners: links with a role, who came in by them, and their end."""

from typing import Annotated, Any, Literal

import msgspec
from anyio import to_thread
from litestar import Request, Response, get, post
from litestar.types import ControllerRouterHandler

from action_assistant.editor.api.qr_codes import qr_code
from action_assistant.editor.people.invitations import Invitation
from action_assistant.editor.services import EditorState
from action_assistant.errors import BadInput, Conflict
from action_assistant.web.audit.events import SessionEnded
from action_assistant.web.auth.access import Needs, person_of
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.auth.session_files import OpenSession, SessionFiles
from action_assistant.web.network.addresses import Addresses
from action_assistant.web.server.openapi import answer


class Sharing(msgspec.Struct, frozen=True):
    """The addresses of this server for other people, and the invitation links.

    `origins`: the addresses of the page, the likeliest first; empty where the server listens on this computer
    only. `secure`: whether the connection is encrypted. `proxied`: whether a proxy serves the first address, so
    that the certificate is the proxy's.
    """

    origins: tuple[str, ...]
    secure: bool
    invitations: list[Invitation]
    proxied: bool = False


class Inviting(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The request for a new invitation; `label`: a note for whom it is."""

    role: Literal["viewer", "editor", "operator"]
    label: Annotated[str, msgspec.Meta(max_length=200)] = ""


def routes(
    app_state: EditorState, addresses: Addresses, browsers: SessionFiles
) -> list[ControllerRouterHandler]:
    """Return the routes under `/api/invitations` and `/api/sessions`."""
    return [
        *_links(app_state, addresses),
        *_one(app_state, addresses),
        *_sessions(app_state, browsers),
    ]


def _sessions(app_state: EditorState, browsers: SessionFiles) -> list[ControllerRouterHandler]:
    @get(
        "/api/sessions",
        summary="Browsers that are signed in, the newest first",
        operation_id="listSessions",
        guards=[Needs("share")],
    )
    async def list_sessions() -> list[OpenSession]:
        return await to_thread.run_sync(browsers.every)

    @post(
        "/api/sessions/{session:str}/end",
        status_code=204,
        summary="Sign a browser out",
        operation_id="endSession",
        guards=[Needs("share")],
    )
    async def end(session: str, request: Request[Any, Any, Any]) -> None:
        await to_thread.run_sync(browsers.end, session)
        app_state.services.audit.note(SessionEnded(session), person_of(request).id)

    return [list_sessions, end]


def _links(app_state: EditorState, addresses: Addresses) -> list[ControllerRouterHandler]:
    @get(
        "/api/invitations",
        summary="All links, the newest first, with who came in by them",
        operation_id="listInvitations",
        guards=[Needs("share")],
    )
    async def list_invitations() -> Sharing:
        links = app_state.services.invitations.all()
        return Sharing(
            addresses.origins(), addresses.is_encrypted, links, proxied=addresses.is_proxied
        )

    @post(
        "/api/invitations",
        summary="Make a link that lets people in with a role",
        operation_id="invite",
        guards=[Needs("share")],
    )
    async def invite(data: Inviting, request: Request[Any, Any, Any]) -> Response[Invitation]:
        services, person = await app_state.acting(request)
        made = await services.invitations.make(data.role, data.label, person.id)
        location = f"/api/invitations/{made.id}"
        return Response(made, status_code=201, headers={"location": location})

    return [list_invitations, invite]


def _one(app_state: EditorState, addresses: Addresses) -> list[ControllerRouterHandler]:
    @post(
        "/api/invitations/{invitation:str}/revoke",
        status_code=200,
        summary="End a link, and at once every session that came in by it",
        operation_id="revokeInvitation",
        guards=[Needs("share")],
    )
    async def revoke(invitation: str, request: Request[Any, Any, Any]) -> Invitation:
        person = person_of(request)
        return await app_state.services.invitations.revoke(
            invitation, PersonRef(person.id, person.name)
        )

    @get(
        "/api/invitations/{invitation:str}/qr",
        summary="A link as a QR code (SVG), for the page at `origin`",
        operation_id="getInvitationCode",
        guards=[Needs("share")],
        responses={200: answer(str, media="image/svg+xml", text="The picture")},
    )
    async def code(invitation: str, origin: str) -> Response[bytes]:
        if not addresses.is_page(origin):
            raise BadInput("The page is not to be found there.", where={"path": "/origin"})
        found = app_state.services.invitations.get(invitation)
        if found.path is None:
            raise Conflict("This link was revoked.")
        return qr_code(origin + found.path)

    return [revoke, code]
