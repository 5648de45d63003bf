"""Routes of links that show one run to people without a name: its record, and its state as it goes on.

They take no message and stop nothing: whoever looks is no person (decision 125).
"""

from collections.abc import AsyncIterator
from typing import Any, Final
from weakref import WeakKeyDictionary

import anyio
import msgspec
from litestar import Request, Response, get
from litestar.response import Stream
from litestar.types import ControllerRouterHandler

from action_assistant.errors import NotFound
from action_assistant.runner.api.live import EncodedRun
from action_assistant.runner.api.review import json_of
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.review.stored_runs import StoredRuns
from action_assistant.runner.runs import views
from action_assistant.runner.runs.shared_view import (
    SharedBeat,
    SharedRun,
    SharedState,
    SharedStateMessage,
    shared_state,
)
from action_assistant.web.auth.access import OfLink, view_of
from action_assistant.web.auth.identity import View
from action_assistant.web.auth.view_links import ViewLinks
from action_assistant.web.auth.view_routes import ViewStreams, view_link_routes
from action_assistant.web.server.openapi import answer

_GAP_S: Final = 0.5  # between two states
_SHARE: Final = 40  # at most one part in so many of the time goes into encoding one run
_BEAT_S: Final = 1.0
_Asking = Request[Any, Any, Any]


def routes(services: RunnerServices, links: ViewLinks) -> list[ControllerRouterHandler]:
    """Return the routes by which a link shows its run, and those by which owners make links."""
    states, streams = _EncodedStates(services), ViewStreams()

    async def require(run: str) -> None:
        if not await services.worker_queries.newest(run):
            raise NotFound("There is no such run.")

    @get(
        "/api/view/run",
        summary="The run of a link, and the graph as it was sent; `again`: the page is open already",
        operation_id="viewRun",
        guards=[OfLink()],
    )
    async def one(request: _Asking, *, again: bool = False) -> Response[SharedRun]:
        view = view_of(request)
        opened = services.control.open.get(view.thing)
        if opened is None:
            found = await services.worker_queries.text(StoredRuns.shared, view.thing)
        else:
            sent = await services.worker_queries.value(StoredRuns.sent, view.thing)
            state = await states.of(opened)
            found = msgspec.json.encode(SharedRun(state, msgspec.Raw(sent.umrf.encode())))
        if not again:
            links.note_opening(view)
        return json_of(found, SharedRun)

    @get(
        "/api/view/run/events",
        summary="The states of the run of a link, as they come, until it is over (SSE)",
        operation_id="followViewedRun",
        guards=[OfLink()],
        responses={
            200: answer(
                SharedStateMessage | SharedBeat, media="text/event-stream", text="A state each time"
            )
        },
    )
    async def events(request: _Asking) -> Stream:
        view = view_of(request)
        streams.require(view)
        return Stream(
            _followed(services, states, streams, view),
            media_type="text/event-stream",
            headers={"cache-control": "no-store"},
        )

    return [one, events, *view_link_routes(links, require, services.audit)]


class _EncodedStates:
    """Encodes the state of an open run once for all who look at it by links."""

    def __init__(self, services: RunnerServices) -> None:
        self._services = services
        self._frames: WeakKeyDictionary[OpenRun, EncodedRun] = WeakKeyDictionary()

    async def of(self, opened: OpenRun) -> SharedState:
        """Return the present state of an open run. The loop stays free while it is made."""
        await self._services.hub.prepare_view(opened)
        return shared_state(self._services.hub.run_view(opened))

    async def text(self, opened: OpenRun) -> str:
        """Return the present state as the text of a message. Wait while it was encoded too often."""
        frame = self._frames.get(opened)
        if frame is None or frame.revision != opened.revision:
            if frame is not None:
                await anyio.sleep(frame.next - anyio.current_time())
            began, revision = anyio.current_time(), opened.revision
            text = msgspec.json.encode(SharedStateMessage(await self.of(opened))).decode()
            now = anyio.current_time()
            frame = EncodedRun(revision, text, now - began, now + _SHARE * (now - began))
            self._frames[opened] = frame
        return frame.text


async def _followed(
    services: RunnerServices, states: _EncodedStates, streams: ViewStreams, view: View
) -> AsyncIterator[bytes]:
    """Yield the states of the run of a link as server-sent events, and a beat each second, until it
    is over and stored."""
    with streams.opened(view):
        revision = None
        while (opened := services.control.open.get(view.thing)) is not None:
            if opened.revision != revision:
                revision = opened.revision
                yield _event((await states.text(opened)).encode())
                await anyio.sleep(_GAP_S)
            with anyio.move_on_after(_BEAT_S):
                await services.control.change(view.thing, revision)
            seen = opened.watch.seen_at
            beat = SharedBeat(
                views.time(services.hub.clock_us()), None if seen is None else views.time(seen)
            )
            yield _event(msgspec.json.encode(beat))


def _event(text: bytes) -> bytes:
    return b"data: " + text + b"\n\n"
