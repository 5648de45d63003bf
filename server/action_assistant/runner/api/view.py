"""Routes of links that show one run to people without a name: its record, and its state as it goes on.

They take no message and stop nothing: whoever looks is no person (decision 125).
"""

from collections.abc import AsyncIterator, Callable
from typing import Any, Final
from weakref import WeakKeyDictionary

import anyio
import msgspec
from litestar import Request, Response, get
from litestar.response import Stream
from litestar.types import ControllerRouterHandler

from action_assistant.errors import NotFound
from action_assistant.runner.api.live import EncodedMessage, EncodedRun, Hub
from action_assistant.runner.api.review import json_of
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.review.stored_runs import StoredRuns
from action_assistant.runner.runs import views
from action_assistant.runner.runs.shared_view import (
    SharedBeat,
    SharedRun,
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
    states, streams = EncodedStates(lambda: services.hub), ViewStreams()

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
            if opened not in services.sent:
                sent = await services.worker_queries.value(StoredRuns.sent, view.thing)
                services.sent[opened] = sent
            state, umrf = await states.of(opened), services.sent[opened].umrf
            found = msgspec.json.encode(
                _EncodedShared(msgspec.Raw(state.run), msgspec.Raw(umrf.encode()))
            )
        if not again:
            links.note_opening(view)
        return json_of(found, SharedRun)

    @get(
        "/api/view/run/events",
        summary="The states of the run of a link, as they come, until it is over (SSE)",
        operation_id="followViewedRun",
        description='Sends `{type: "run", run}`, and each second `{type: "beat", at, seen}` until '
        "the run is over.",
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


class _EncodedShared(msgspec.Struct, frozen=True):
    """A `SharedRun` whose parts are encoded already."""

    run: msgspec.Raw
    umrf: msgspec.Raw


class EncodedStates:
    """Encodes the state of an open run once for all who look at it by links, however many these are and
    however often they ask."""

    def __init__(self, hub: Callable[[], Hub]) -> None:
        self._hub = hub
        self._frames: WeakKeyDictionary[OpenRun, EncodedRun] = WeakKeyDictionary()
        self._turns: WeakKeyDictionary[OpenRun, anyio.Lock] = WeakKeyDictionary()

    async def of(self, opened: OpenRun) -> EncodedRun:
        """Return the state of an open run as it is now, or later: as a message, and alone. Wait while
        it was encoded too often. The loop stays free while a large one is made."""
        wanted = opened.revision
        async with self._turns.setdefault(opened, anyio.Lock()):
            frame = self._frames.get(opened)
            if frame is not None:
                if frame.revision >= wanted:
                    return frame
                await anyio.sleep(max(0.0, frame.next - anyio.current_time()))
            hub = self._hub()
            began = anyio.current_time()
            await hub.prepare_view(opened)
            revision = opened.revision
            state = msgspec.json.encode(shared_state(hub.run_view(opened)))
            text = msgspec.json.encode(EncodedMessage(msgspec.Raw(state))).decode()
            now = anyio.current_time()
            next_ = now + _SHARE * (now - began)
            frame = EncodedRun(revision, text, now - began, next_, state)
            self._frames[opened] = frame
            return frame


async def _followed(
    services: RunnerServices, states: EncodedStates, streams: ViewStreams, view: View
) -> AsyncIterator[bytes]:
    """Yield the states of the run of a link as server-sent events, and a beat each second, until it
    is over and stored."""
    with streams.opened(view):
        revision = None
        while (opened := services.control.open.get(view.thing)) is not None:
            if opened.revision != revision:
                frame = await states.of(opened)
                revision = frame.revision
                yield _event(frame.text.encode())
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
