"""Routes of confirmations that both processes have: one's own last one, and one that was made elsewhere."""

from typing import Any, Final

import msgspec
from anyio import to_thread
from litestar import Request, get, post
from litestar.params import JSONBody
from litestar.types import ControllerRouterHandler

from action_assistant.errors import TooMany
from action_assistant.kit.token_bucket import TokenBuckets
from action_assistant.web.auth.access import Needs, Open, PersonOnly, live_session
from action_assistant.web.auth.caller import client_network
from action_assistant.web.auth.confirmations import Confirmation, Confirmations

_BODY: Final = 2_000  # bytes; strangers send it
_AT_ONCE: Final = 60  # records of one address
_PER_MINUTE: Final = 30  # after that
_Asking = Request[Any, Any, Any]


class OwnConfirmation(msgspec.Struct, frozen=True):
    """The last confirmation of the session that asks; null if there was none."""

    last: Confirmation | None


def confirmation_routes(
    confirmations: Confirmations, *, limits: bool
) -> list[ControllerRouterHandler]:
    """Return the routes by which a page brings a confirmation from one process to the other one,
    which may have a data folder of its own, or a full disk."""
    pace = TokenBuckets(_AT_ONCE, _PER_MINUTE / 60) if limits else None

    @get(
        "/api/confirmations/mine",
        summary="The last confirmation of this session",
        operation_id="getConfirmation",
        guards=[PersonOnly(), Needs("see")],
    )
    async def mine(request: _Asking) -> OwnConfirmation:
        session = live_session(request)
        return OwnConfirmation(await to_thread.run_sync(confirmations.last, session.id))

    @post(
        "/api/confirmations/records",
        status_code=204,
        summary="Make a confirmation of the other process known here",
        operation_id="adoptConfirmation",
        request_max_body_size=_BODY,
        guards=[Open()],
    )
    async def adopt(data: JSONBody[Confirmation], request: _Asking) -> None:
        if pace is not None and not pace.of(client_network(request)).take():
            raise TooMany("Too many confirmations from your address; wait a minute.")
        await to_thread.run_sync(confirmations.adopt, data)

    return [mine, adopt]
