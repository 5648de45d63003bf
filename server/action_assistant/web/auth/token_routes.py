"""Routes of tokens, in both processes: their list, their end, and the record of one made elsewhere."""

from collections.abc import Awaitable, Callable
from typing import Annotated, Any, Final

import msgspec
from anyio import to_thread
from litestar import Request, get, post
from litestar.params import JSONBody
from litestar.types import ControllerRouterHandler

from action_assistant.errors import Forbidden, TooMany
from action_assistant.kit.token_bucket import TokenBuckets
from action_assistant.web.auth.access import Needs, Open, PersonOnly, SignedIn, identity_of
from action_assistant.web.auth.caller import client_network
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.roles import allowed
from action_assistant.web.auth.tokens import TokenFiles, TokenList, TokenRecord

_BODY: Final = 10_000  # bytes; strangers send it
_AT_ONCE: Final = 60  # records of one address
_PER_MINUTE: Final = 30  # after that
_Asking = Request[Any, Any, Any]


class Adopted(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The record of a token that the editor made. It is no secret, and its seal proves it."""

    record: TokenRecord


async def _untold(record: TokenRecord, person: str) -> None:
    """Do nothing: the default for a process in which nobody has to be notified that a token was
    revoked."""


def shared_token_routes(
    tokens: TokenFiles,
    *,
    revoked: Callable[[TokenRecord, str], Awaitable[None]] = _untold,
) -> list[ControllerRouterHandler]:
    """Return the routes of tokens that both processes have. `revoked` is called after a token was
    revoked, with its record and the id of the person who did it."""

    @get(
        "/api/tokens",
        summary="Tokens of programs, the newest first: one's own, for owners all",
        operation_id="listTokens",
        guards=[PersonOnly(), Needs("see")],
    )
    async def list_tokens(request: _Asking) -> TokenList:
        person = identity_of(request).person
        whose = None if allowed(person.role, "share") else person.id
        return TokenList(await to_thread.run_sync(tokens.every, whose), tokens.most_days)

    @post(
        "/api/tokens/{token:str}/revoke",
        status_code=204,
        summary="End a token, at once and for good",
        operation_id="revokeToken",
        guards=[SignedIn()],
    )
    async def revoke(token: Annotated[str, msgspec.Meta(max_length=40)], request: _Asking) -> None:
        by = identity_of(request)
        await revoked(await to_thread.run_sync(_revoke, tokens, token, by), by.person.id)

    return [list_tokens, revoke]


def adoption(tokens: TokenFiles, *, limits: bool) -> list[ControllerRouterHandler]:
    """Return the route of the runner that receives the record of a token which the editor has made.
    The runner needs this record to accept the token where it has a data folder of its own, as on
    another computer. `limits`: refuse too many requests from one network."""
    pace = TokenBuckets(_AT_ONCE, _PER_MINUTE / 60) if limits else None

    @post(
        "/api/tokens/records",
        status_code=204,
        summary="Make a token of the editor known here",
        operation_id="adoptToken",
        request_max_body_size=_BODY,
        guards=[Open()],
    )
    async def adopt(data: JSONBody[Adopted], request: _Asking) -> None:
        if pace is not None and not pace.of(client_network(request)).take():
            raise TooMany("Too many tokens from your address; wait a minute.")
        await to_thread.run_sync(tokens.adopt, data.record)

    return [adopt]


def _revoke(tokens: TokenFiles, token: str, by: Identity) -> TokenRecord:
    """Revoke a token and return its record. Raise Forbidden unless an owner, its maker or the token itself asks; raise
    NotFound if there is none with this id."""
    if by.token is not None and by.token.id != token:
        raise Forbidden("A program's token can end only itself: it takes a person.")
    record = tokens.get(token)
    if record.person.id != by.person.id and not allowed(by.person.role, "share"):
        raise Forbidden("This token is of another person: an owner can end it.")
    tokens.revoke(token)
    return record
