"""Routes by which a person makes a token, or signs a program in by a code."""

from collections.abc import Awaitable, Callable
from typing import Annotated, Any, Final

import msgspec
from anyio import to_thread
from litestar import Request, Response, post
from litestar.params import JSONBody
from litestar.types import ControllerRouterHandler

from action_assistant.editor.services import EditorState
from action_assistant.errors import BadInput, TooMany
from action_assistant.kit.token_bucket import TokenBuckets
from action_assistant.web.auth.access import Needs, Open, PersonOnly, client_address, identity_of
from action_assistant.web.auth.caller import client_network
from action_assistant.web.auth.desk import Held
from action_assistant.web.auth.identity import Scope
from action_assistant.web.auth.login_codes import (
    Claimed,
    Confirmed,
    LoginBegun,
    LoginCodes,
    LoginRequest,
)
from action_assistant.web.auth.login_codes import claim as claim_login
from action_assistant.web.auth.token_routes import shared_token_routes
from action_assistant.web.auth.tokens import (
    NAME_LIMIT,
    MadeToken,
    TokenFiles,
    TokenRecord,
    completed,
)

_BODY: Final = 10_000  # bytes; strangers send it
_BEGUN_AT_ONCE: Final = 10  # logins of one address
_BEGUN_PER_MINUTE: Final = 5  # after that
_ASKED_AT_ONCE: Final = 60  # questions of one address
_ASKED_PER_MINUTE: Final = 60  # after that
_Asking = Request[Any, Any, Any]
_Make = Callable[[Confirmed], Awaitable[MadeToken]]
_Name = Annotated[str, msgspec.Meta(min_length=1, max_length=NAME_LIMIT)]
_Scopes = Annotated[tuple[Scope, ...], msgspec.Meta(min_length=1, max_length=6)]


class MakeToken(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The request for a new token. `days`: its life; by default 90, or less where the server says
    so."""

    name: _Name
    scopes: _Scopes
    days: float | None = None


class BeginLogin(MakeToken, frozen=True, forbid_unknown_fields=True):
    """The request of a program for a token that a person confirms."""


class LoginSecret(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The secret that the program got when it began the login."""

    secret: Annotated[str, msgspec.Meta(max_length=100)]


class LoginCode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The code that the program shows, as a person types it."""

    code: Annotated[str, msgspec.Meta(max_length=40)]


class ConfirmLogin(MakeToken, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The word of a person for a login: the name and the scopes, which are among those that the
    program asked for."""

    code: Annotated[str, msgspec.Meta(max_length=40)]


def routes(
    app_state: EditorState, tokens: TokenFiles, codes: Held[LoginCodes], *, limits: bool
) -> list[ControllerRouterHandler]:
    """Return the routes of tokens."""

    async def make(word: Confirmed) -> MadeToken:
        made = await to_thread.run_sync(
            lambda: tokens.make(word.by, word.name, word.scopes, word.days)
        )
        await app_state.services.token_log.made(made.record)
        return made

    async def revoked(record: TokenRecord, person: str) -> None:
        await app_state.services.token_log.revoked(record, person)

    return [
        *shared_token_routes(tokens, revoked=revoked),
        _making(make),
        *_of_programs(tokens, codes, make, limits=limits),
        *_of_people(tokens, codes),
    ]


def _making(make_token: _Make) -> ControllerRouterHandler:
    @post(
        "/api/tokens",
        summary="Make a token for a program; its text is answered once",
        operation_id="makeToken",
        guards=[PersonOnly(), Needs("see")],
    )
    async def make(data: JSONBody[MakeToken], request: _Asking) -> Response[MadeToken]:
        made = await make_token(Confirmed(identity_of(request), data.name, data.scopes, data.days))
        headers = {"location": f"/api/tokens/{made.record.id}", "cache-control": "no-store"}
        return Response(made, status_code=201, headers=headers)

    return make


def _of_programs(
    tokens: TokenFiles, codes: Held[LoginCodes], make: _Make, *, limits: bool
) -> list[ControllerRouterHandler]:
    """Return the routes by which a program that is not signed in asks for a token."""
    begun = TokenBuckets(_BEGUN_AT_ONCE, _BEGUN_PER_MINUTE / 60)
    asked = TokenBuckets(_ASKED_AT_ONCE, _ASKED_PER_MINUTE / 60)

    def admit(pace: TokenBuckets, request: _Asking) -> None:
        if limits and not pace.of(client_network(request)).take():
            raise TooMany("Too many tries from your address; wait a minute.")

    @post(
        "/api/logins",
        status_code=200,
        summary="Ask for a token that a person confirms by a code",
        operation_id="beginLogin",
        request_max_body_size=_BODY,
        guards=[Open()],
    )
    async def begin(data: JSONBody[BeginLogin], request: _Asking) -> Response[LoginBegun]:
        admit(begun, request)
        tokens.check(data.name, data.days)
        wanted = tuple(sorted(completed(data.scopes)))
        address, network = client_address(request.scope), client_network(request)
        answer = await codes.call(LoginCodes.begin, data.name, wanted, data.days, address, network)
        return Response(answer, headers={"cache-control": "no-store"})

    @post(
        "/api/logins/claim",
        status_code=200,
        summary="Fetch the token, once a person has confirmed the code",
        operation_id="claimLogin",
        description="`state` is `waiting`, `slower`, `granted`, `refused` or `gone`.",
        request_max_body_size=_BODY,
        guards=[Open()],
    )
    async def claim(data: JSONBody[LoginSecret], request: _Asking) -> Response[Claimed]:
        admit(asked, request)
        answer = await claim_login(codes, data.secret, make)
        return Response(answer, headers={"cache-control": "no-store"})

    @post(
        "/api/logins/cancel",
        status_code=204,
        summary="Give a login up",
        operation_id="cancelLogin",
        request_max_body_size=_BODY,
        guards=[Open()],
    )
    async def cancel(data: JSONBody[LoginSecret], request: _Asking) -> None:
        admit(asked, request)
        await codes.call(LoginCodes.cancel, data.secret)

    return [begin, claim, cancel]


def _of_people(tokens: TokenFiles, codes: Held[LoginCodes]) -> list[ControllerRouterHandler]:
    """Return the routes by which a person answers a program that waits."""

    @post(
        "/api/logins/look",
        status_code=200,
        summary="The program that waits with a code, and what it asks for",
        operation_id="lookAtLogin",
        guards=[PersonOnly(), Needs("see")],
    )
    async def look(data: JSONBody[LoginCode], request: _Asking) -> LoginRequest:
        return await codes.call(LoginCodes.look, data.code, identity_of(request).person.id)

    @post(
        "/api/logins/confirm",
        status_code=204,
        summary="Let a program in that waits with a code",
        operation_id="confirmLogin",
        guards=[PersonOnly(), Needs("see")],
    )
    async def confirm(data: JSONBody[ConfirmLogin], request: _Asking) -> None:
        by = identity_of(request)
        asked = await codes.call(LoginCodes.look, data.code, by.person.id)
        beyond = completed(data.scopes) - set(asked.scopes)
        if beyond:
            raise BadInput(
                f"The program did not ask for {', '.join(sorted(beyond))}.",
                where={"path": "/scopes"},
            )
        tokens.require(by, data.name, completed(data.scopes), data.days)
        word = Confirmed(by, data.name, data.scopes, data.days)
        await codes.call(LoginCodes.confirm, data.code, word)

    @post(
        "/api/logins/refuse",
        status_code=204,
        summary="Refuse a program that waits with a code",
        operation_id="refuseLogin",
        guards=[PersonOnly(), Needs("see")],
    )
    async def refuse(data: JSONBody[LoginCode], request: _Asking) -> None:
        await codes.call(LoginCodes.refuse, data.code, identity_of(request).person.id)

    return [look, confirm, refuse]
