"""The routes by which a person confirms on another device who they are.

The runner carries this alone, over its live sockets, so that it also works while the editor is away.
"""

from typing import Annotated, Any, Final

import msgspec
from anyio import to_thread
from litestar import Request, delete, get, post
from litestar.params import JSONBody
from litestar.types import ControllerRouterHandler

from action_assistant.errors import NotFound
from action_assistant.runner.api.confirmation_requests import ConfirmationRequest, RequestState
from action_assistant.runner.api.services import RunnerServices
from action_assistant.web.audit.events import Confirmed
from action_assistant.web.auth.access import Needs, PersonOnly, identity_of, live_session
from action_assistant.web.auth.browser_names import browser_name
from action_assistant.web.auth.confirmations import Confirmation, Confirmations

_ROBOTS: Final = 50
_Asking = Request[Any, Any, Any]
_Robot = Annotated[str, msgspec.Meta(max_length=64)]


class ConfirmationWanted(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A wish to be confirmed. `robots`: on which the person wants to start; empty for other things."""

    robots: Annotated[tuple[_Robot, ...], msgspec.Meta(max_length=_ROBOTS)] = ()


class ConfirmationAsked(msgspec.Struct, frozen=True):
    """A request, for the device that made it. `devices`: how many other devices of the person show it
    now; `seconds`: until it is over; `record`: the sealed confirmation, once another device has said
    yes."""

    id: str
    number: str
    seconds: float
    state: RequestState
    devices: int
    record: Confirmation | None = None


class ConfirmationAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The answer of the person on another device: whether it is they who ask."""

    yes: bool


def routes(services: RunnerServices, confirmations: Confirmations) -> list[ControllerRouterHandler]:
    """Return the routes for a session that asks and for the device that answers."""
    return [*_asking(services), _answering(services, confirmations)]


def _asking(services: RunnerServices) -> list[ControllerRouterHandler]:
    def shown(found: ConfirmationRequest) -> ConfirmationAsked:
        return ConfirmationAsked(
            found.id,
            found.number,
            services.requests.left(found),
            found.state,
            services.hub.devices_shown(found),
            found.record,
        )

    @post(
        "/api/confirmations",
        summary="Ask one's other devices to confirm who one is",
        operation_id="askToConfirm",
        description='One\'s other devices get `{type: "confirm", asked}` over the live socket. An '
        "answer counts once, from another device.",
        guards=[PersonOnly(), Needs("see")],
    )
    async def ask(data: JSONBody[ConfirmationWanted], request: _Asking) -> ConfirmationAsked:
        known = services.control.robots.names
        for robot in data.robots:
            if robot not in known:
                raise NotFound(f"There is no robot {robot!r}.")
        browser = browser_name(request.headers.get("user-agent", ""))
        session = live_session(request)
        return shown(services.requests.ask(identity_of(request), session, browser, data.robots))

    @get(
        "/api/confirmations/{request_id:str}",
        summary="What became of a request of one's own",
        operation_id="getConfirmationRequest",
        guards=[PersonOnly(), Needs("see")],
    )
    async def look(request_id: str, request: _Asking) -> ConfirmationAsked:
        return shown(services.requests.of(request_id, live_session(request)))

    @delete(
        "/api/confirmations/{request_id:str}",
        status_code=204,
        summary="Withdraw a request of one's own",
        operation_id="cancelConfirmationRequest",
        guards=[PersonOnly(), Needs("see")],
    )
    async def cancel(request_id: str, request: _Asking) -> None:
        services.requests.cancel(request_id, live_session(request))

    return [ask, look, cancel]


def _answering(services: RunnerServices, confirmations: Confirmations) -> ControllerRouterHandler:
    @post(
        "/api/confirmations/{request_id:str}/answer",
        status_code=204,
        summary="Say on another device of the same person whether it is they who ask",
        operation_id="answerConfirmationRequest",
        guards=[PersonOnly(), Needs("see")],
    )
    async def answer(request_id: str, data: JSONBody[ConfirmationAnswer], request: _Asking) -> None:
        by = identity_of(request)
        found = services.requests.answer(request_id, by, yes=data.yes)
        if data.yes:
            if services.identity_now(found.identity) is None:
                raise NotFound("The device that asked is not signed in any more.")
            session = found.session.id
            found.record = await to_thread.run_sync(confirmations.confirm, session, "device")
            found.state = "confirmed"
        services.audit.note(
            Confirmed(found.session.id, "device", refused=not data.yes), by.person.id
        )

    return answer
