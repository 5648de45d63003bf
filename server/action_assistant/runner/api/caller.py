"""The caller of a route: the person, the address, and the body that they send."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, Final

import anyio
from litestar import Request
from litestar.connection import ASGIConnection
from litestar.exceptions.http_exceptions import RequestEntityTooLarge

from action_assistant.errors import Unavailable
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.sent_graphs import MOST, counted
from action_assistant.web.auth.access import identity_of, person_of, session_of
from action_assistant.web.http.problems import BODY_LIMIT_TOLD
from action_assistant.web.network.connection_limits import ConcurrencyLimit

#: Bytes of a body without a graph.
SMALL: Final = 100_000
#: Bytes of one with a graph: twice `sent_graphs.MOST`, since as a string its text may be escaped.
GRAPH_BODY: Final = 2 * MOST
#: The key in `opt=` of a route for the limit that OpenAPI and refusals name.
COUNTED: Final[dict[str, object]] = {BODY_LIMIT_TOLD: MOST}
_BODY_S: Final = 60.0


def author_of(connection: ASGIConnection[Any, Any, Any, Any]) -> Author:
    """Return the person who sent a request or opened a socket (`connection`). A caller with a
    session counts as a browser, a caller that sends the token instead counts as a program."""
    person, token = person_of(connection), identity_of(connection).token
    return Author(
        person.id,
        person.name,
        by="program" if session_of(connection) is None else "browser",
        address=identity_of(connection).address,
        program="" if token is None else token.name,
    )


@asynccontextmanager
async def body_of(
    request: Request[Any, Any, Any], body_limit: ConcurrencyLimit
) -> AsyncIterator[bytes]:
    """Return a context with the body of a request that carries a graph. It waits for its turn,
    since only few bodies of each person are in memory at once. Raise TooLarge if too many wait,
    Unavailable if the body does not arrive in time, Litestar's RequestEntityTooLarge if it is too
    large."""
    async with bytes_of(request, body_limit) as body:
        if len(body) > MOST and counted(body) > MOST:
            raise RequestEntityTooLarge
        yield body


@asynccontextmanager
async def bytes_of(
    request: Request[Any, Any, Any], body_limit: ConcurrencyLimit
) -> AsyncIterator[bytes]:
    """Return a context with the body of a request, whatever it is, as `body_of` does; its route says how
    large it may be."""
    async with body_limit.turn(person_of(request).id):
        try:
            with anyio.fail_after(_BODY_S):
                body = await request.body()
        except TimeoutError as late:
            raise Unavailable(f"The body did not come within {_BODY_S:.0f} s.") from late
        yield body


async def start_of(request: Request[Any, Any, Any], most: int, seconds: float) -> bytes:
    """Return the first `most` bytes of the body of a request, or the part of them that arrives
    within so many seconds. Raise Litestar's HTTPException if the client disconnects before, or the
    body is too large."""
    found = b""
    with anyio.move_on_after(seconds):
        async for part in request.stream():
            found += part[: most - len(found)]
            if len(found) >= most:
                break
    return found
