"""Routes of one's own devices: the list, the end of one, and *add a device*."""

from typing import Any

import msgspec
from anyio import to_thread
from litestar import Request, Response, delete, get, post
from litestar.types import ControllerRouterHandler

from action_assistant.editor.api.qr_codes import qr_code
from action_assistant.errors import BadInput, NotFound
from action_assistant.web.audit.events import SessionEnded
from action_assistant.web.audit.log import AuditLog
from action_assistant.web.auth.access import Needs, PersonOnly, live_session
from action_assistant.web.auth.desk import Held
from action_assistant.web.auth.device_codes import DeviceAsking, DeviceCode, DeviceCodes
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.session_files import OpenSession, SessionFiles
from action_assistant.web.network.addresses import Addresses
from action_assistant.web.server.openapi import answer

_Asking = Request[Any, Any, Any]


class OwnDevices(msgspec.Struct, frozen=True):
    """The open sessions of the person; `this`: the id of the one that asks. `origins`: the
    addresses of the page for other devices, the likeliest first. `ends`: by session the seal with
    which a runner that has a data folder of its own is told of its end."""

    sessions: list[OpenSession]
    this: str
    origins: tuple[str, ...]
    ends: dict[str, str]


class DeviceIsMine(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The answer of the person to a device that has sent their code."""

    yes: bool


def routes(
    codes: Held[DeviceCodes],
    browsers: SessionFiles,
    addresses: Addresses,
    audit: AuditLog,
    keys: Keys,
) -> list[ControllerRouterHandler]:
    """Return the routes under `/api/devices`. They are for browsers: a token has no devices.
    `audit` keeps which sessions were ended; `keys` seal their ends."""
    return [*_own(browsers, addresses, audit, keys), *_adding(codes, browsers, addresses)]


def _own(
    browsers: SessionFiles, addresses: Addresses, audit: AuditLog, keys: Keys
) -> list[ControllerRouterHandler]:
    def own(person: str) -> list[OpenSession]:
        return [each for each in browsers.every() if each.person.id == person]

    @get(
        "/api/devices",
        summary="The devices on which one is signed in oneself",
        operation_id="listDevices",
        guards=[PersonOnly(), Needs("see")],
    )
    async def list_devices(request: _Asking) -> OwnDevices:
        session = live_session(request)
        found = await to_thread.run_sync(own, session.person.id)
        person = session.person.id
        ends = {each.id: keys.end_seal(each.id, person) for each in found}
        return OwnDevices(found, session.id, addresses.origins(), ends)

    @post(
        "/api/devices/{session:str}/end",
        status_code=204,
        summary="Sign out on one of one's own devices",
        operation_id="endDevice",
        guards=[PersonOnly(), Needs("see")],
    )
    async def end(session: str, request: _Asking) -> None:
        mine = await to_thread.run_sync(own, live_session(request).person.id)
        if session not in {each.id for each in mine}:
            raise NotFound(f"You have no open session {session!r}.")
        await to_thread.run_sync(browsers.end, session)
        audit.note(SessionEnded(session), live_session(request).person.id)

    @post(
        "/api/devices/end",
        status_code=204,
        summary="Sign out on all of one's other devices",
        operation_id="endOtherDevices",
        guards=[PersonOnly(), Needs("see")],
    )
    async def end_others(request: _Asking) -> None:
        session = live_session(request)
        ended = await to_thread.run_sync(
            lambda: browsers.end_all_of(session.person.id, but=session.id)
        )
        for each in ended.ids:
            audit.note(SessionEnded(each), session.person.id)
        if ended.left is not None:
            raise ended.left

    return [list_devices, end, end_others]


def _adding(
    codes: Held[DeviceCodes], browsers: SessionFiles, addresses: Addresses
) -> list[ControllerRouterHandler]:
    @post(
        "/api/devices/codes",
        summary="Make a code with which another device of one's own signs in, valid for 2 minutes",
        operation_id="makeDeviceCode",
        description="The other device sends the code to `POST /api/session/device` and asks `POST "
        "/api/session/device/answer` until it is signed in.",
        guards=[PersonOnly(), Needs("see")],
    )
    async def make(request: _Asking) -> DeviceCode:
        session = live_session(request)
        await to_thread.run_sync(browsers.require_room, session.person.id)
        return await codes.call(DeviceCodes.open, session)

    @get(
        "/api/devices/codes/{code:str}",
        summary="Which device has sent a code",
        operation_id="lookAtDevice",
        guards=[PersonOnly(), Needs("see")],
    )
    async def look(code: str, request: _Asking) -> DeviceAsking:
        return await codes.call(DeviceCodes.look, code, live_session(request))

    @post(
        "/api/devices/codes/{code:str}/answer",
        status_code=204,
        summary="Confirm that the device which has sent a code is one's own, or refuse it",
        operation_id="answerDevice",
        guards=[PersonOnly(), Needs("see")],
    )
    async def say(code: str, data: DeviceIsMine, request: _Asking) -> None:
        session = live_session(request)
        await codes.call(DeviceCodes.answer, code, session, is_mine=data.yes)

    @delete(
        "/api/devices/codes/{code:str}",
        status_code=204,
        summary="Make a code invalid",
        operation_id="cancelDeviceCode",
        guards=[PersonOnly(), Needs("see")],
    )
    async def cancel(code: str, request: _Asking) -> None:
        await codes.call(DeviceCodes.cancel, code, live_session(request))

    @get(
        "/api/devices/codes/{code:str}/qr",
        summary="A code as a QR code (SVG) that opens the page at `origin`",
        operation_id="getDeviceQrCode",
        guards=[PersonOnly(), Needs("see")],
        responses={200: answer(str, media="image/svg+xml", text="The picture")},
    )
    async def picture(code: str, origin: str, request: _Asking) -> Response[bytes]:
        if not addresses.is_page(origin):
            raise BadInput("The page is not to be found there.", where={"path": "/origin"})
        text = await codes.call(DeviceCodes.text, code, live_session(request))
        return qr_code(f"{origin}/#d={text}")

    return [make, look, say, cancel, picture]
