"""Routes of one's own passkeys, and of confirming who one is with one."""

from datetime import UTC, datetime
from typing import Annotated, Any, Final, Literal

import msgspec
from anyio import to_thread
from litestar import Request, delete, get, patch, post, put
from litestar.params import FromPath, JSONBody
from litestar.types import ControllerRouterHandler

from action_assistant.web.audit.events import Confirmed, PasskeyChanged
from action_assistant.web.audit.log import AuditLog
from action_assistant.web.auth.access import Needs, PersonOnly, identity_of, live_session
from action_assistant.web.auth.confirmations import LONGEST_S, Confirmation, Confirmations
from action_assistant.web.auth.desk import Held
from action_assistant.web.auth.passkeys import Passkey, Passkeys

_BODY: Final = 20_000  # bytes
_MOST_MINUTES: Final = round(LONGEST_S / 60)
_Asking = Request[Any, Any, Any]
_Name = Annotated[str, msgspec.Meta(max_length=200)]


class PasskeyShown(msgspec.Struct, frozen=True):
    """A passkey in a list. `rp`: the host name at which it works; `counts_at`: from when on it
    confirms."""

    id: str
    name: str
    rp: str
    made_at: datetime
    counts_at: datetime


class OwnPasskeys(msgspec.Struct, frozen=True):
    """The passkeys of the person, and after how many minutes what only owners do needs a new
    confirmation of them; 0: never."""

    passkeys: list[PasskeyShown]
    ask_again: int


class NewPasskey(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A passkey that a browser has made: its `PublicKeyCredential` as JSON."""

    name: _Name
    credential: dict[str, Any]


class PasskeyName(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The new name of a passkey."""

    name: _Name


class PasskeyProof(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The answer of a passkey to a challenge, as JSON."""

    credential: dict[str, Any]


class PasskeyOptions(msgspec.Struct, frozen=True):
    """The options for `navigator.credentials`, as its functions for JSON take them."""

    options: dict[str, Any]


class OwnerAsked(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Minutes after which what only owners do needs a new confirmation of this owner; 0: never."""

    ask_again: Annotated[int, msgspec.Meta(ge=0, le=_MOST_MINUTES)]


def routes(
    passkeys: Held[Passkeys], confirmations: Confirmations, audit: AuditLog
) -> list[ControllerRouterHandler]:
    """Return the routes under `/api/passkeys`. They are for browsers: a token has no passkeys."""
    return [*_own(passkeys, audit), *_confirming(passkeys, confirmations, audit)]


def _own(passkeys: Held[Passkeys], audit: AuditLog) -> list[ControllerRouterHandler]:
    def note(request: _Asking, passkey: Passkey, what: Literal["registered", "removed"]) -> None:
        changed = PasskeyChanged(passkey.id, passkey.name, what)
        audit.note(changed, identity_of(request).person.id)

    @get(
        "/api/passkeys",
        summary="One's own passkeys",
        operation_id="listPasskeys",
        guards=[PersonOnly(), Needs("see")],
    )
    async def list_passkeys(request: _Asking) -> OwnPasskeys:
        person = live_session(request).person.id
        file = await to_thread.run_sync(passkeys.store.files.of, person)
        return OwnPasskeys([_shown(each) for each in file.passkeys], file.ask_again)

    @post(
        "/api/passkeys/challenge",
        summary="Begin to register a passkey: within two minutes, in this session",
        operation_id="beginPasskey",
        guards=[PersonOnly(), Needs("see")],
    )
    async def begin(request: _Asking) -> PasskeyOptions:
        session, by = live_session(request), identity_of(request)
        origin = request.headers.get("origin", "")
        return PasskeyOptions(await passkeys.call(Passkeys.begin_registration, by, session, origin))

    @post(
        "/api/passkeys",
        summary="Register a passkey that this browser has made",
        operation_id="registerPasskey",
        request_max_body_size=_BODY,
        guards=[PersonOnly(), Needs("see")],
    )
    async def register(data: JSONBody[NewPasskey], request: _Asking) -> PasskeyShown:
        session, by = live_session(request), identity_of(request)
        made = await passkeys.call(Passkeys.register, by, session, data.name, data.credential)
        note(request, made, "registered")
        return _shown(made)

    @patch(
        "/api/passkeys/{passkey:str}",
        summary="Give one of one's passkeys another name",
        operation_id="renamePasskey",
        guards=[PersonOnly(), Needs("see")],
    )
    async def rename(
        passkey: FromPath[str], data: JSONBody[PasskeyName], request: _Asking
    ) -> PasskeyShown:
        person = live_session(request).person.id
        return _shown(await passkeys.call(Passkeys.rename, person, passkey, data.name))

    @delete(
        "/api/passkeys/{passkey:str}",
        status_code=204,
        summary="Remove one of one's passkeys",
        operation_id="removePasskey",
        guards=[PersonOnly(), Needs("see")],
    )
    async def remove(passkey: FromPath[str], request: _Asking) -> None:
        person = live_session(request).person.id
        note(request, await passkeys.call(Passkeys.remove, person, passkey), "removed")

    return [list_passkeys, begin, register, rename, remove]


def _confirming(
    passkeys: Held[Passkeys], confirmations: Confirmations, audit: AuditLog
) -> list[ControllerRouterHandler]:
    @post(
        "/api/passkeys/confirm/challenge",
        summary="Begin to confirm who one is with a passkey: within two minutes, in this session",
        operation_id="beginPasskeyConfirmation",
        guards=[PersonOnly(), Needs("see")],
    )
    async def begin(request: _Asking) -> PasskeyOptions:
        session, by = live_session(request), identity_of(request)
        origin = request.headers.get("origin", "")
        return PasskeyOptions(await passkeys.call(Passkeys.begin_confirmation, by, session, origin))

    @post(
        "/api/passkeys/confirm",
        status_code=200,
        summary="Confirm who one is with a passkey",
        operation_id="confirmByPasskey",
        description="Answers the sealed confirmation. A challenge works once, in its session, for "
        "two minutes.",
        request_max_body_size=_BODY,
        guards=[PersonOnly(), Needs("see")],
    )
    async def confirm(data: JSONBody[PasskeyProof], request: _Asking) -> Confirmation:
        session, by = live_session(request), identity_of(request)
        await passkeys.call(Passkeys.verify, by, session, data.credential)
        made = await to_thread.run_sync(confirmations.confirm, session.id, "passkey")
        audit.note(Confirmed(session.id, "passkey"), by.person.id)
        return made

    @put(
        "/api/passkeys/ask-again",
        status_code=204,
        summary="Set after how many minutes what only owners do needs a new confirmation of oneself",
        operation_id="setOwnerAsked",
        guards=[PersonOnly(), Needs("share")],
    )
    async def ask_again(data: JSONBody[OwnerAsked], request: _Asking) -> None:
        by = identity_of(request)
        live_session(request)
        await passkeys.call(Passkeys.set_ask_again, by, data.ask_again)
        audit.note(PasskeyChanged("", str(data.ask_again), "asked"), by.person.id)

    return [begin, confirm, ask_again]


def _shown(passkey: Passkey) -> PasskeyShown:
    return PasskeyShown(
        passkey.id,
        passkey.name,
        passkey.rp,
        datetime.fromtimestamp(passkey.made_at, UTC),
        datetime.fromtimestamp(passkey.counts_at, UTC),
    )
