"""`watch`: joins a graph's room as a stock Yjs client that never edits, and prints each change on a line."""

import argparse
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from datetime import datetime
from typing import Any, Final, Literal, TypeAlias

import anyio
import httpx
import msgspec
from anyio.streams.memory import MemoryObjectSendStream
from httpx_ws import (
    AsyncWebSocketSession,
    HTTPXWSException,
    WebSocketDisconnect,
    WebSocketUpgradeError,
    aconnect_ws,
)
from pycrdt import Doc, Provider
from pycrdt.websocket.websocket import HttpxWebsocket

from action_assistant.commands.answers import sentence
from action_assistant.commands.client import add_server, reach, running
from action_assistant.editor.crdt import messages
from action_assistant.editor.documents import document
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.safe_text import one_line
from action_assistant.umrf.difference import Difference, Field, difference
from action_assistant.umrf.model import Graph

Subject: TypeAlias = Literal["graph", "action", "arrow", "note", "comment"]

_LONGEST: Final = 120  # characters of a value


class GraphChange(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One difference. `name`: the full name of an action (the newer one), or the id of a note or
    comment; `before` and `after` are None if there was or is no value."""

    subject: Subject
    change: Literal["added", "removed", "changed"]
    words: str
    name: str = ""
    parent: str = ""
    child: str = ""
    field: str = ""
    before: Any = None
    after: Any = None


class ShownGraph(msgspec.Struct, frozen=True):
    """A graph and its comments."""

    graph: Graph
    comments: Mapping[str, object]


def changes(before: ShownGraph, after: ShownGraph) -> list[GraphChange]:
    """Return the differences between two states of a graph, one sentence each. A difference without
    a sentence of its own, for example of an order, is described as a change of the graph."""
    found = [
        *_of_graph(difference((0, before.graph), (0, after.graph))),
        *_of_texts("note", dict(before.graph.notes), dict(after.graph.notes)),
        *_of_texts("comment", before.comments, after.comments),
    ]
    if not found and before != after:
        found.append(GraphChange(subject="graph", change="changed", words="the graph changed"))
    return found


def _of_graph(different: Difference) -> Iterable[GraphChange]:
    for field in different.fields:
        yield _field("graph", "graph", field)
    for action in sorted(different.actions, key=lambda each: (each.name, each.aid)):
        words = f"action {action.name}"
        if action.change != "changed":
            yield GraphChange(
                subject="action",
                change=action.change,
                words=f"{words} {action.change}",
                name=action.name,
            )
        for field in action.fields:
            yield _field("action", words, field, name=action.name)
    for arrow in different.relations:
        words = f"arrow {arrow.parent} → {arrow.child}"
        ends = {"parent": arrow.parent, "child": arrow.child}
        if arrow.change != "changed":
            yield GraphChange(
                subject="arrow", change=arrow.change, words=f"{words} {arrow.change}", **ends
            )
        for field in arrow.fields:
            yield _field("arrow", words, field, **ends)


def _of_texts(
    subject: Subject, before: Mapping[str, object], after: Mapping[str, object]
) -> Iterable[GraphChange]:
    for name in sorted(before.keys() | after.keys()):
        if before.get(name) == after.get(name):
            continue
        change: Literal["added", "removed", "changed"] = (
            "added" if name not in before else "removed" if name not in after else "changed"
        )
        yield GraphChange(
            subject=subject,
            change=change,
            words=f"{subject} {change}",
            name=name,
            before=before.get(name),
            after=after.get(name),
        )


def _field(subject: Subject, who: str, field: Field, **ends: str) -> GraphChange:
    return GraphChange(
        subject=subject,
        change="changed",
        words=_field_words(subject, who, field),
        field=field.field,
        before=field.before,
        after=field.after,
        **ends,
    )


def _field_words(subject: Subject, who: str, field: Field) -> str:
    before, after = _shown(field.before), _shown(field.after)
    match subject, field.field:
        case "action", "position":
            return f"{who} moved"
        case "action", "name":
            return f"action {before} renamed to {after}"
        case "graph", "name":
            return f"graph {before} renamed to {after}"
    if subject == "arrow" and field.field.startswith("waypoints/"):
        return f"{who} {'straightened' if field.after is None else 'bent'}"
    name = field.field.removeprefix("in/")
    if subject == "action" and field.field.startswith("in/"):
        name = f"parameter {name}"
    elif subject == "action" and field.field.startswith("out/"):
        name = f"output {field.field.removeprefix('out/')}"
    if field.after is None:
        return f"{who}: {name} removed (was {before})"
    if field.before is None:
        return f"{who}: {name} added: {after}"
    return f"{who}: {name} is {after} (was {before})"


def _shown(value: object) -> str:
    """Return a value as text, shortened to fit into a line."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = value if isinstance(value, str) else str(value)
    if not text:
        return "empty"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def _add_watch(watch: argparse.ArgumentParser) -> None:
    add_server(watch, "patrol")
    watch.add_argument("graph", metavar="GRAPH", help="id or name")
    watch.add_argument("--json", action="store_true", help="one JSON object for each line")
    watch.set_defaults(handler=_watch)


COMMANDS: Final = {"watch": _add_watch}


_PAUSES: Final = (0.3, 1.0, 3.0, 10.0)  # seconds before coming again; the last one from then on
#: Refusals of the upgrade after which coming again leads nowhere.
_FINAL: Final = frozenset({401, 403, 404})
#: The final close codes, in words.
_CLOSED: Final = {
    messages.SESSION_ENDED: "The session has ended.",
    messages.FORBIDDEN: "This graph may not be seen any more.",
    messages.NO_SUCH_GRAPH: "The graph was deleted.",
}
#: The errors by which a connection is lost.
_LOST: Final = (
    HTTPXWSException,
    httpx.HTTPError,
    anyio.EndOfStream,
    anyio.ClosedResourceError,
    anyio.BrokenResourceError,
)


class _User(msgspec.Struct, frozen=True):
    name: str = ""


class _State(msgspec.Struct, frozen=True):
    user: _User = _User()


class Lines:
    """Prints changes to standard output and news of the connection to standard error."""

    def __init__(self, *, as_json: bool) -> None:
        self._as_json = as_json

    def change(self, seq: int, who: list[str], change: GraphChange) -> None:
        """Print one change to stdout. `seq`: the number of the moment; `who`: the names of the
        people who made it."""
        now = datetime.now().astimezone()
        if self._as_json:
            about = {"time": now.isoformat(timespec="milliseconds"), "seq": seq, "who": who}
            line = msgspec.json.encode(about | msgspec.to_builtins(change)).decode()
        else:
            line = f"{now:%H:%M:%S}  moment {seq}  {', '.join(who) or '-'}  {change.words}"
        print(one_line(line), flush=True)

    def news(self, text: str) -> None:
        """Print one line about the connection to stderr, since programs read stdout."""
        print(one_line(text), file=sys.stderr, flush=True)


class WatchedGraph:
    """The state of a followed graph: its document, the sequence number that was last printed, and
    people's names."""

    def __init__(self, lines: Lines) -> None:
        self._lines = lines
        self._names: dict[int, str] = {}
        self.ever_entered = False
        self._begin()
        self.enter()

    def _begin(self) -> None:
        self.doc: Doc[Any] = Doc()
        self._changed = False
        self._subscription = self.doc.observe(self._note)
        self._told: ShownGraph | None = None
        self._clocks: dict[int, int] = {}
        self._epoch = ""
        self._seq = 0

    def begin_anew(self) -> None:
        """Drop the document, since the server has another history now (an epoch)."""
        self.doc.unobserve(self._subscription)
        self._begin()

    def enter(self) -> None:
        """Call this when a connection begins; no change is printed until it is in sync."""
        self.in_sync = False
        self._greeted = False

    @property
    def claims(self) -> dict[str, str]:
        """Return the query parameters with which the room is entered (docs/room-protocol.md 1)."""
        known = {"epoch": self._epoch, "seq": str(self._seq)} if self._epoch else {}
        return {"acks": "1"} | known

    def hear(self, message: bytes) -> None:
        """Handle a message of the room. The document has all earlier messages and not yet this one:
        the provider applies each message before it reads the next one."""
        reader = messages.ByteReader(message)
        match reader.number():
            case messages.SYNC:
                self.in_sync |= reader.number() == messages.STEP_2
            case messages.AWARENESS:
                found = messages.parse(message)
                if isinstance(found, messages.Presence):
                    self._meet(found)
            case messages.EPOCH:
                self._epoch = reader.text().decode()
            case messages.READ_ONLY:
                self._lines.news(f"Nobody may change it: {reader.text().decode()}")
            case messages.ACKS if self.in_sync:
                reader.number()
                self._reach(reader.number())

    def _note(self, _: object) -> None:
        self._changed = True

    def _meet(self, presence: messages.Presence) -> None:
        for entry in presence.entries:
            with suppress(ValueError, RecursionError):
                state = msgspec.json.decode(entry.state, type=_State | None)
                if state is not None and state.user.name:
                    self._names[entry.client] = state.user.name

    def _reach(self, seq: int) -> None:
        """Print what has changed up to the change `seq`, once all of it was received."""
        self._seq = seq
        if not self._greeted and self._told is not None:
            self._lines.news(f"Connected again, at moment {seq}.")
        if self._told is None or self._changed:
            self._changed = False
            self._look(seq)
        self._greeted = self.ever_entered = True

    def _look(self, seq: int) -> None:
        maps = document.maps_of(self.doc)
        now = ShownGraph(document.read_maps(maps), maps["comments"])
        before, self._told = self._told, now
        who = self._who_wrote()
        if before is None:
            count = sum(not action.missing for action in now.graph.actions)
            self._lines.news(f"Watching {now.graph.name} at moment {seq}; actions: {count}.")
            return
        for change in changes(before, now):
            self._lines.change(seq, who, change)

    def _who_wrote(self) -> list[str]:
        """Return the names of the people who added content since the last call. People who only
        deleted are not visible."""
        reader = messages.ByteReader(self.doc.get_state())
        clocks = {reader.number(): reader.number() for _ in range(reader.number())}
        before, self._clocks = self._clocks, clocks
        wrote = {client for client, clock in clocks.items() if clock != before.get(client)}
        return sorted({self._names[client] for client in wrote & self._names.keys()})


class QuietSocket(HttpxWebsocket):
    """The provider's socket, which drops every message that could change the document. A stock
    provider answers each update with its echo, which the room ignores anyway."""

    def __init__(
        self,
        socket: AsyncWebSocketSession,
        graph: WatchedGraph,
        ended: "MemoryObjectSendStream[Exception]",
    ) -> None:
        super().__init__(socket, "room")
        self._graph = graph
        self._ended = ended

    async def send(self, message: bytes) -> None:
        """Send a message of the provider; drop everything but the first step of synchronisation."""
        if message[:2] != bytes((messages.SYNC, messages.STEP_1)):
            return
        try:
            await super().send(message)
        except Exception as error:  # noqa: BLE001 - told by who waits for the end
            self._end(error)

    async def recv(self) -> bytes:
        """Wait for the next message of the room, let the watched graph handle it, then return it to
        the provider. If this fails, report the error as the end of the connection, and raise it:
        the provider, which calls this method, ignores errors."""
        try:
            message: bytes = await super().recv()
            self._graph.hear(message)
        except Exception as error:
            self._end(error)
            raise
        return message

    def _end(self, error: Exception) -> None:
        with suppress(anyio.WouldBlock):  # the first one counts
            self._ended.send_nowait(error)


def _watch(options: argparse.Namespace) -> int:
    with suppress(KeyboardInterrupt):  # the usual way to end the command
        with running(options) as server:
            graph = server.graph_id(options.graph)
        anyio.run(_follow, options, graph)
    return 0


async def _follow(options: argparse.Namespace, graph: str) -> None:
    """Follow the room of a graph without end, and reconnect after each lost connection. Raise
    RequestRefused or CannotStart where reconnecting cannot help."""
    lines = Lines(as_json=options.json)
    watched = WatchedGraph(lines)
    failures = 0
    while True:
        why = await _visit(options, graph, watched)
        _raise_if_final(why, again=watched.ever_entered)
        if isinstance(why, WebSocketDisconnect) and why.code == messages.OTHER_EPOCH:
            lines.news("The history of the graphs was replaced; beginning anew.")
            watched.begin_anew()
            continue
        failures = 0 if watched.in_sync else failures
        if not failures:
            lines.news(f"Connection lost{_because(why)}; coming again.")
        await anyio.sleep(_PAUSES[min(failures, len(_PAUSES) - 1)])
        failures += 1


async def _visit(options: argparse.Namespace, graph: str, watched: WatchedGraph) -> Exception:
    """Stay in the room of a graph until the connection ends; return the error that ended it."""
    watched.enter()
    # Anew each time: while the server was away, anybody may have taken its place, and has to prove
    # itself before it is sent the token.
    try:
        found = reach(options)
    except CannotStart as error:
        return error
    # The answer to an upgrade has no body that ends; bodies of other answers are read by `_read`.
    auth = found["auth"]
    auth.requires_response_body = False
    hooks = {"response": [_read]}
    send, receive = anyio.create_memory_object_stream[Exception](1)
    path = f"/api/graphs/{graph}/room"
    try:
        with send, receive:
            async with (
                httpx.AsyncClient(**found, event_hooks=hooks) as client,
                aconnect_ws(
                    path, client, params=watched.claims, session_class=AsyncWebSocketSession
                ) as socket,
                Provider(watched.doc, QuietSocket(socket, watched, send)),
            ):
                return await receive.receive()
    except (*_LOST, CannotStart) as error:
        return error
    except ExceptionGroup as group:
        lost, other = group.split(_LOST)
        if other is not None or lost is None:
            raise
        return lost


async def _read(response: httpx.Response) -> None:
    if response.status_code != httpx.codes.SWITCHING_PROTOCOLS:
        await response.aread()


def _raise_if_final(why: Exception, *, again: bool) -> None:
    """Raise the reason why a connection ended if reconnecting cannot help; do nothing for others.
    `again`: the room was entered before."""
    match why:
        case WebSocketUpgradeError() if why.response.status_code in _FINAL:
            raise RequestRefused(sentence(why.response))
        case WebSocketDisconnect() if why.code in _CLOSED:
            raise RequestRefused(_CLOSED[why.code])
        case CannotStart() if again:  # another program listens there; the server may come back
            return
        case ExceptionGroup() | WebSocketDisconnect():
            return
    if not isinstance(why, _LOST):
        raise why


def _because(why: Exception) -> str:
    match why:
        case WebSocketDisconnect():
            return f" ({why.reason or why.code})"
        case WebSocketUpgradeError():
            return f" (status {why.response.status_code})"
        case CannotStart():
            return f" ({why})"
    return ""
