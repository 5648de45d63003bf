"""Presses of people, sent by commands: each counts once, also if its answer is lost."""

import time
import uuid
from typing import TYPE_CHECKING, Any, Final

from action_assistant.commands.client import Server
from action_assistant.errors import CannotStart

if TYPE_CHECKING:
    import httpx

_AGAIN_S: Final = 1.0  # after which an order without an answer is sent once more


def press(server: Server, path: str, body: dict[str, Any]) -> "httpx.Response":
    """Send an order to a led run (POST of `body` to `path`), and return the answer. If none comes, send
    it once more with the same request id, so that the two count once. Raise CannotStart if there is no
    answer then either."""
    press = body | {"request_id": str(uuid.uuid4())}
    try:
        return server.runner("POST", path, json=press)
    except CannotStart:
        time.sleep(_AGAIN_S)
        return server.runner("POST", path, json=press)
