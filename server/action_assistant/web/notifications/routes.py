"""The routes of notifications, which both processes have for their own messages."""

from collections.abc import Callable
from typing import Any

from litestar import Request, get, post
from litestar.types import ControllerRouterHandler

from action_assistant.web.auth.access import Needs, person_of
from action_assistant.web.notifications.outbox import ReceiverState
from action_assistant.web.notifications.sender import Notifications


def notification_routes(
    notifications: Callable[[], Notifications], tested: Callable[[str, str], None]
) -> list[ControllerRouterHandler]:
    """Return the routes under `/api/notifications`, for owners. `notifications` returns the sender
    of notifications, which exists only once the process is set up. `tested` records a test: it is
    called with the name of the receiver and the id of the person who sent the test."""

    @get(
        "/api/notifications",
        summary="Receivers of messages by webhook and mail, as this process sends to them",
        operation_id="listReceivers",
        guards=[Needs("share")],
    )
    async def list_receivers() -> list[ReceiverState]:
        return await notifications().states()

    @post(
        "/api/notifications/{name:str}/test",
        status_code=200,
        summary="Send a test to a receiver; one that takes it is on again",
        operation_id="testReceiver",
        guards=[Needs("share")],
    )
    async def test_receiver(name: str, request: Request[Any, Any, Any]) -> ReceiverState:
        state = await notifications().test(name, person_of(request).name)
        tested(name, person_of(request).id)
        return state

    return [list_receivers, test_receiver]
