"""Routes of links that show one graph to people without a name, and the first facts of their page.

They give the text of the graph, never its room: the document in a room holds comments, and ids of who
wrote what (decision 125).
"""

from collections.abc import AsyncIterator, Sequence
from typing import Any, Final

import anyio
import msgspec
from litestar import Request, get
from litestar.response import Stream
from litestar.types import ControllerRouterHandler

from action_assistant.editor.documents import contents
from action_assistant.editor.log.graph_events import graph_of
from action_assistant.editor.services import EditorState
from action_assistant.editor.workers import encoded
from action_assistant.umrf.files import codec
from action_assistant.umrf.json.text import UmrfGraph
from action_assistant.umrf.model import Problem
from action_assistant.web.auth.access import OfLink, Open, view_of
from action_assistant.web.auth.identity import View
from action_assistant.web.auth.view_links import ViewLinks
from action_assistant.web.auth.view_routes import ViewAudit, ViewStreams, view_link_routes
from action_assistant.web.network.addresses import Addresses
from action_assistant.web.server.openapi import answer

_GAP_S: Final = 1.0  # between two messages that the graph has changed
_ALIVE_S: Final = 10.0
_Asking = Request[Any, Any, Any]


class ViewPlaces(msgspec.Struct, frozen=True):
    """The address of the runner, without a slash at its end, and the origins of sites that may show
    links in a frame. `more_runners`: the addresses of further runners, one of which may have the run of
    the link; absent with one."""

    runner_url: str
    frame_origins: list[str]
    more_runners: tuple[str, ...] | msgspec.UnsetType = msgspec.UNSET


class SharedGraph(msgspec.Struct, frozen=True):
    """A graph as a link shows it, as it is now. `problems`: of the graph alone, without those of the
    graphs that its actions stand for."""

    umrf: UmrfGraph
    problems: tuple[Problem, ...]


class SharedGraphChanged(msgspec.Struct, frozen=True):
    """The graph of a link may have changed; sent once for many changes."""


def routes(
    app_state: EditorState,
    links: ViewLinks,
    addresses: Addresses,
    audit: ViewAudit,
    frames: Sequence[str],
) -> list[ControllerRouterHandler]:
    """Return the routes by which a link shows its graph, and those by which owners make links.
    `audit`: keeps who made and revoked them; `frames`: the origins of sites that may show the page of a link in a frame."""
    streams = ViewStreams()

    async def require(graph: str) -> None:
        await app_state.services.catalogue.require(graph, "graph")

    @get(
        "/api/view",
        summary="Where the page of a link finds the runner, and which sites may show it in a frame",
        operation_id="getViewPlaces",
        guards=[Open()],
    )
    async def places(request: _Asking) -> ViewPlaces:
        host = request.headers.get("host", "")
        settings = app_state.services.settings
        runner = addresses.runner_at(host, settings.runner_port)
        more = tuple(each.url for each in addresses.sites_at(host, settings.sites)[1:])
        return ViewPlaces(runner, list(frames), more or msgspec.UNSET)

    @get(
        "/api/view/graph",
        summary="The graph of a link as it is now; `again`: the page is open already",
        operation_id="viewGraph",
        guards=[OfLink()],
    )
    async def one(request: _Asking, *, again: bool = False) -> SharedGraph:
        view, reader = view_of(request), app_state.services.graph_reader
        await require(view.thing)
        now = await reader.now(view.thing)
        text = await reader.ask(contents.umrf, now, codec.Stamp(view.thing, None, None))
        problems = await reader.ask(contents.problems, now)
        if not again:
            links.note_opening(view)
        return SharedGraph(msgspec.Raw(text), encoded(tuple[Problem, ...], problems))

    @get(
        "/api/view/graph/events",
        summary="Tells that the graph of a link has changed, without an end (SSE)",
        operation_id="followViewedGraph",
        description="Sends `{}` when the graph may have changed.",
        guards=[OfLink()],
        responses={
            200: answer(SharedGraphChanged, media="text/event-stream", text="A change each time")
        },
    )
    async def events(request: _Asking) -> Stream:
        view = view_of(request)
        streams.require(view)
        await require(view.thing)
        return Stream(
            _changes(app_state, streams, view),
            media_type="text/event-stream",
            headers={"cache-control": "no-store"},
        )

    return [places, one, events, *view_link_routes(links, require, audit)]


async def _changes(
    app_state: EditorState, streams: ViewStreams, view: View
) -> AsyncIterator[bytes]:
    """Yield a server-sent event without a content when the graph of a link has changed, once a
    second at most, and a comment now and then."""
    news = anyio.Event()

    async def listen() -> None:
        async with app_state.services.journal.follow() as stored:
            async for event in stored:
                if graph_of(event.stream) == view.thing:
                    news.set()

    with streams.opened(view):
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(listen)
            while True:
                with anyio.move_on_after(_ALIVE_S) as waited:
                    await news.wait()
                news = anyio.Event()
                yield b": alive\n\n" if waited.cancelled_caught else b"data: {}\n\n"
                await anyio.sleep(_GAP_S)
