"""Routes of persons with personal links, and of groups: their rights, links, devices and end."""

from datetime import datetime
from typing import Annotated, Any

import msgspec
from anyio import to_thread
from litestar import Request, Response, delete, get, patch, post
from litestar.types import ControllerRouterHandler

from action_assistant.editor.api.qr_codes import qr_code
from action_assistant.editor.people.members import LINK_HOURS, Group, Member
from action_assistant.editor.services import EditorState
from action_assistant.errors import BadInput, Conflict
from action_assistant.web.audit.events import SessionEnded
from action_assistant.web.auth.access import Needs, identity_of, person_of
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.auth.rights import Allowed, may
from action_assistant.web.auth.roles import Role
from action_assistant.web.auth.session_files import SessionFiles
from action_assistant.web.network.addresses import Addresses
from action_assistant.web.server.openapi import answer

_Name = Annotated[str, msgspec.Meta(max_length=200)]
_Asking = Request[Any, Any, Any]


class Members(msgspec.Struct, frozen=True):
    """All persons with personal links, and all groups. `origins`: the addresses of the page for
    other people, the likeliest first."""

    people: list[Member]
    groups: list[Group]
    origins: tuple[str, ...]


class NewMember(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The request for a new person. `until`: when their right to do more than Stop ends; `hours`:
    for how long the link is valid."""

    name: _Name
    role: Role
    groups: tuple[str, ...] = ()
    until: datetime | None = None
    hours: float = LINK_HOURS


class MemberChange(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A change of a person; what is missing stays. `until`: null takes the date away."""

    name: _Name | msgspec.UnsetType = msgspec.UNSET
    role: Role | msgspec.UnsetType = msgspec.UNSET
    groups: tuple[str, ...] | msgspec.UnsetType = msgspec.UNSET
    until: datetime | msgspec.UnsetType | None = msgspec.UNSET


class NewLink(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The request for a new link of a person. `hours`: for how long it is valid."""

    hours: float = LINK_HOURS


class GroupName(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The name of a group."""

    name: _Name


class EndedSessions(msgspec.Struct, frozen=True):
    """The number of sessions that were ended."""

    ended: int


def routes(
    app_state: EditorState, addresses: Addresses, browsers: SessionFiles
) -> list[ControllerRouterHandler]:
    """Return the routes under `/api/members` and `/api/groups`. `addresses`: the addresses under
    which people reach the page, for links and their check; `browsers`: the sessions, which end with
    a person."""
    return [
        *_list(app_state, addresses),
        *_one(app_state, addresses),
        *_ends(app_state, browsers),
        *_groups(app_state),
    ]


def _list(app_state: EditorState, addresses: Addresses) -> list[ControllerRouterHandler]:
    @get(
        "/api/members",
        summary="Persons with personal links, and groups; owners see the links, too",
        operation_id="listMembers",
        guards=[Needs("see")],
    )
    async def list_members(request: _Asking) -> Members:
        members = app_state.services.members
        shares = may(identity_of(request), "share", now=0.0) == Allowed()
        return Members(
            members.all(with_links=shares),
            members.groups(),
            addresses.origins() if shares else (),
        )

    @post(
        "/api/members",
        summary="Add a person, with a link that lets one browser in, once",
        operation_id="addMember",
        guards=[Needs("share")],
    )
    async def add(data: NewMember, request: _Asking) -> Response[Member]:
        services, person = await app_state.acting(request)
        made = await services.members.add(
            data.name,
            data.role,
            person.id,
            groups=data.groups,
            until=data.until,
            hours=data.hours,
        )
        location = f"/api/members/{made.id}"
        return Response(made, status_code=201, headers={"location": location})

    return [list_members, add]


def _one(app_state: EditorState, addresses: Addresses) -> list[ControllerRouterHandler]:
    @patch(
        "/api/members/{person:str}",
        summary="Change the name, role, groups or last day of a person, everywhere at once",
        operation_id="changeMember",
        guards=[Needs("share")],
    )
    async def change(person: str, data: MemberChange, request: _Asking) -> Member:
        services, by = await app_state.acting(request)
        if person == by.id and data.role is not msgspec.UNSET and data.role != by.role:
            raise Conflict("You cannot change your own role: another owner can.")
        given = {
            name: value
            for name in ("name", "role", "groups", "until")
            if (value := getattr(data, name)) is not msgspec.UNSET
        }
        return await services.members.change(person, by.id, **given)

    @post(
        "/api/members/{person:str}/link",
        status_code=200,
        summary="Make a new link for a person; unused ones open nothing any more",
        operation_id="linkMember",
        guards=[Needs("share")],
    )
    async def link(person: str, data: NewLink, request: _Asking) -> Member:
        services, by = await app_state.acting(request)
        return await services.members.link(person, by.id, data.hours)

    @get(
        "/api/members/{person:str}/qr",
        summary="The newest link of a person as a QR code (SVG), for the page at `origin`",
        operation_id="getMemberCode",
        guards=[Needs("share")],
        responses={200: answer(str, media="image/svg+xml", text="The picture")},
    )
    async def code(person: str, origin: str) -> Response[bytes]:
        if not addresses.is_page(origin):
            raise BadInput("The page is not to be found there.", where={"path": "/origin"})
        links = app_state.services.members.get(person).links
        path = next((each.path for each in links if each.path is not None), None)
        if path is None:
            raise Conflict("No link of this person opens anything. Make a new one.")
        return qr_code(origin + path)

    return [change, link, code]


def _ends(app_state: EditorState, browsers: SessionFiles) -> list[ControllerRouterHandler]:
    @post(
        "/api/members/{person:str}/end",
        status_code=200,
        summary="End a person: all sessions, tokens and links, everywhere, at once and for good",
        operation_id="endMember",
        guards=[Needs("share")],
    )
    async def end(person: str, request: _Asking) -> Member:
        by = person_of(request)
        return await app_state.services.members.end(person, PersonRef(by.id, by.name))

    @post(
        "/api/people/{person:str}/sessions/end",
        status_code=200,
        summary="Sign a person out on all devices; they may come in again",
        operation_id="endSessionsOf",
        guards=[Needs("share")],
    )
    async def sign_out(person: str, request: _Asking) -> EndedSessions:
        ended = await to_thread.run_sync(browsers.end_all_of, person)
        for session in ended.ids:
            app_state.services.audit.note(SessionEnded(session), person_of(request).id)
        if ended.left is not None:
            raise ended.left
        return EndedSessions(len(ended.ids))

    return [end, sign_out]


def _groups(app_state: EditorState) -> list[ControllerRouterHandler]:
    @post(
        "/api/groups",
        summary="Make a group of persons",
        operation_id="makeGroup",
        guards=[Needs("share")],
    )
    async def make(data: GroupName, request: _Asking) -> Response[Group]:
        services, by = await app_state.acting(request)
        made = await services.members.make_group(data.name, by.id)
        return Response(made, status_code=201, headers={"location": f"/api/groups/{made.id}"})

    @patch(
        "/api/groups/{group:str}",
        summary="Rename a group",
        operation_id="renameGroup",
        guards=[Needs("share")],
    )
    async def rename(group: str, data: GroupName, request: _Asking) -> Group:
        services, by = await app_state.acting(request)
        return await services.members.rename_group(group, data.name, by.id)

    @delete(
        "/api/groups/{group:str}",
        status_code=204,
        summary="Remove a group, also from its persons",
        operation_id="removeGroup",
        guards=[Needs("share")],
    )
    async def remove(group: str, request: _Asking) -> None:
        services, by = await app_state.acting(request)
        await services.members.remove_group(group, by.id)

    return [make, rename, remove]
