"""Routes about the editor itself: configuration, people, and what happens as it happens."""

import asyncio
from collections.abc import AsyncIterator
from datetime import datetime
from typing import Annotated, Any, Final

import anyio
import msgspec
from litestar import Request, get
from litestar.params import Parameter
from litestar.response import ServerSentEvent, ServerSentEventMessage
from litestar.types import ControllerRouterHandler

from action_assistant import paths
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.log.inbox_events import inbox_stream
from action_assistant.editor.services import EditorState
from action_assistant.errors import BadInput
from action_assistant.journal.events import Event
from action_assistant.journal.slots import Cursor
from action_assistant.settings import RunLink, Site
from action_assistant.umrf.json.text import UmrfGraph
from action_assistant.version import VERSION, commit
from action_assistant.web.audit.events import is_audit
from action_assistant.web.auth.access import Needs, identity_of, person_of
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.auth.roles import OWNER
from action_assistant.web.network.addresses import Addresses
from action_assistant.web.server.openapi import answer

#: The form of a moment of the log: a number for each editor that has stored something.
_MOMENT: Final = r"^\d{1,14}(\.\d{1,14}){0,63}$"
_SILENCE: Final = 10.0  # seconds of silence after which a sign of life is sent


class Config(msgspec.Struct, frozen=True):
    """The settings that a page asks for first. `runner_url` has no slash at its end. `commit`: the commit of
    this program, null where it is unknown. `run_links`: from runs to what other programs recorded of them.
    `runners`: all of them, if there are several; the first is at `runner_url`."""

    mode: str
    version: str
    runner_url: str
    commit: str | None = None
    run_links: tuple[RunLink, ...] = ()
    runners: tuple[Site, ...] | msgspec.UnsetType = msgspec.UNSET


class StoredEvent(msgspec.Struct, frozen=True, omit_defaults=True):
    """The header of one event of the log. `seq` counts the events of `stream`."""

    position: int
    stream: str
    seq: int
    kind: str
    author: PersonRef
    at: datetime
    graph: str | None = None


class Example(msgspec.Struct, frozen=True):
    """A graph that comes with the program. Send `umrf` to create a copy of it."""

    name: str
    umrf: UmrfGraph


class Participant(msgspec.Struct, frozen=True):
    """A person who has acted on this server. `color`: unique among the people who are connected; grey for a
    person who has none."""

    id: str
    name: str
    color: str


def routes(app_state: EditorState, addresses: Addresses) -> list[ControllerRouterHandler]:
    """Return the routes that belong to no single graph: settings, people, examples and the stream
    of events. `addresses`: the addresses of this server for other people."""

    known = commit()

    @get(
        "/api/config",
        summary="What a page has to know",
        operation_id="getConfig",
        description="A route of the runner is `runner_url` and its path, behind a proxy too.",
        guards=[Needs("see")],
    )
    async def get_config(request: Request[Any, Any, Any]) -> Config:
        settings = app_state.services.settings
        host = request.headers.get("host", "")
        runner = addresses.runner_at(host, settings.runner_port)
        runners = addresses.sites_at(host, settings.sites) or msgspec.UNSET
        return Config("local", VERSION, runner, known, settings.run_links, runners)

    @get(
        "/api/people",
        summary="Everyone who acted here, and who asks",
        operation_id="listPeople",
        guards=[Needs("see")],
    )
    async def list_people(request: Request[Any, Any, Any]) -> list[Participant]:
        services, person = app_state.services, person_of(request)
        services.colours.given(person.id)
        everyone = services.people.everyone()
        if all(known.id != person.id for known in everyone):
            everyone.append(person)  # a person without an action yet is listed, too
        return [Participant(p.id, p.name, services.colours.of(p.id)) for p in everyone]

    @get(
        "/api/examples",
        summary="The graphs that come with the program, as UMRF",
        operation_id="listExamples",
        guards=[Needs("see")],
    )
    async def list_examples() -> list[Example]:
        files = [path async for path in anyio.Path(paths.examples()).glob("*.umrf.graph.json")]
        return [
            Example(
                path.name.removesuffix(".umrf.graph.json"), msgspec.Raw(await path.read_bytes())
            )
            for path in sorted(files)
        ]

    @get(
        "/api/events",
        summary="What is stored, as server-sent events; `after` and Last-Event-ID are moments of the log",
        operation_id="followEvents",
        description="Of graphs that one may see; of the audit for owners, of an inbox for its "
        "person.",
        guards=[Needs("see")],
        media_type="text/event-stream",
        responses={200: answer(StoredEvent, media="text/event-stream", text="An event each time")},
    )
    async def follow_events(
        request: Request[Any, Any, Any],
        after: Annotated[str | None, Parameter(pattern=_MOMENT)] = None,
    ) -> ServerSentEvent:
        last = request.headers.get("last-event-id")
        moment = after if last is None else last
        try:
            known = None if moment is None else Cursor.parse(moment)
        except ValueError:
            raise BadInput(
                "`after` and Last-Event-ID are the id of an event of this stream."
            ) from None
        return ServerSentEvent(_told(app_state, known, identity_of(request)))

    return [get_config, list_people, list_examples, follow_events]


async def _told(
    app_state: EditorState, after: Cursor | None, identity: Identity
) -> AsyncIterator[ServerSentEventMessage]:
    """Yield, as events of an HTTP event stream, the stored events after the moment `after` (None:
    no old ones), then new events as they are stored, without end. While none comes, yield a comment
    now and then."""
    services = app_state.services
    async with services.journal.follow() as events:
        done = await services.journal.cursor() if after is None else after
        while after is not None and (page := await services.journal.read_since(done)):
            sees = await services.rights.sight(identity)
            for event in page:
                done = done.after(event.position)
                graph = h.graph_of(event.stream)
                if _concerns(event.stream, identity) and (graph is None or sees(graph)):
                    yield _message(app_state, event, done)
        coming = asyncio.ensure_future(anext(events))
        try:
            while True:
                await asyncio.wait({coming}, timeout=_SILENCE)
                if not coming.done():
                    yield ServerSentEventMessage(comment="still here")
                    continue
                event = coming.result()
                coming = asyncio.ensure_future(anext(events))
                graph = h.graph_of(event.stream)
                hidden = graph is not None and not await services.rights.may_see(graph, identity)
                is_new, done = not done.has(event.position), done.after(event.position)
                if is_new and not hidden and _concerns(event.stream, identity):
                    yield _message(app_state, event, done)
        except StopAsyncIteration:  # the journal is closed
            return
        finally:
            coming.cancel()


def _concerns(stream: str, identity: Identity) -> bool:
    """Return whether somebody may be told of the events of a stream: the audit, which also says who
    edits graphs out of their sight, is for owners; an inbox for its person."""
    if identity.person.role == OWNER:
        return True
    is_inbox = stream.startswith(inbox_stream(""))
    is_own = stream == inbox_stream(identity.person.id)
    return not is_audit(stream) and (is_own or not is_inbox)


def _message(app_state: EditorState, event: Event, moment: Cursor) -> ServerSentEventMessage:
    happened = StoredEvent(
        event.position,
        event.stream,
        event.seq,
        event.kind,
        app_state.services.people.person(event.author),
        h.when(event.at),
        h.graph_of(event.stream),
    )
    data = msgspec.json.encode(happened).decode()
    return ServerSentEventMessage(data=data, event=event.kind, id=str(moment))
