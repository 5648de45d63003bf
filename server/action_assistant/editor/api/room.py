"""The socket of a room (docs/room-protocol.md), connected with its room until one side closes it.

Under our own server the messages are read and written directly; under any other, by ASGI with two tasks and an
event for each message. Both ways keep the same rules.
"""

import asyncio
import logging
import time
from typing import Any, Final

import anyio
from litestar import WebSocket, websocket
from litestar.types import ControllerRouterHandler, Receive, Send

from action_assistant.editor.crdt import messages
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.rooms.member import ByteRateLimits, Member
from action_assistant.editor.rooms.room import Room
from action_assistant.editor.services import EditorState
from action_assistant.errors import Refused
from action_assistant.logs import about
from action_assistant.web.auth.access import Needs, identity_of, person_of, plain
from action_assistant.web.auth.caller import client_network, origin_of
from action_assistant.web.auth.graph_rules import MAY_NOT_EDIT
from action_assistant.web.auth.rights import Allowed, may
from action_assistant.web.http.refusals import refuse
from action_assistant.web.server.direct import DirectSocket, direct_socket

log: Final = logging.getLogger(__name__)

NORMAL: Final = 1000


class RoomConnection:
    """Reads the messages of one WebSocket and passes them to its room."""

    def __init__(self, room: Room, member: Member, rate_limits: ByteRateLimits) -> None:
        self.room: Final = room
        self.member: Final = member
        self._rate_limits = rate_limits

    def receive(self, data: bytes | None) -> float:
        """Handle one binary message of the socket. Close the socket if the message is malformed, or
        is a text message (None). Return for how many seconds the caller must not read the socket,
        since its person has sent much. `pause` waits for this time, and also while too many edits
        of the socket wait in the room."""
        member = self.member
        if data is None:
            member.refuse(messages.UNREADABLE)
            return 0.0
        try:
            message = messages.parse(data)
        except messages.Malformed as error:
            log.info("%s sent %s", member.person.id, error)
            member.refuse(messages.MALFORMED)
            return 0.0
        if message is None:
            return 0.0
        self.room.receive(member, message)
        limits = self._rate_limits
        spend = limits.spend if isinstance(message, messages.Edit) else limits.spend_on_presence
        return spend(member.person.id, len(data))

    def debt(self) -> float:
        """Return for how many seconds the socket must not be read, because of what its person sent
        on other sockets."""
        return self._rate_limits.spend(self.member.person.id, 0)

    async def pause(self, seconds: float) -> None:
        """Wait this many seconds, and until the socket may be read again."""
        await self.member.until_caught_up()
        wait = seconds + self.member.cpu_debt()
        if wait > 0:
            await anyio.sleep(wait)


async def serve_directly(connection: RoomConnection, socket: DirectSocket) -> int:
    """Serve a socket of this program's own server until it ends; return the close code. Raise the
    error that ended it."""
    directly = _Directly(connection, socket)
    connection.room.join(connection.member)
    socket.take_over(directly)
    try:
        return await connection.member.ended()
    finally:
        connection.room.leave(connection.member)
        directly.end()


class _Directly:
    """Reads a socket of this program's own server, and writes to it at most once per turn of the
    event loop."""

    def __init__(self, connection: RoomConnection, socket: DirectSocket) -> None:
        self._connection = connection
        self._member = connection.member
        self._socket = socket
        self._loop = asyncio.get_running_loop()
        self._turn_end = connection.room.turn_end
        self._unsent: list[bytes] = []
        self._is_due = False
        self._pause: asyncio.Task[None] | None = None
        self._failure: Exception | None = None
        connection.member.on_news = self._write_soon
        connection.member.write_now = self._write_now
        self._write_soon()  # messages may wait already
        if (debt := connection.debt()) > 0:
            self._hold(debt)

    def heard(self, message: bytes | None) -> None:
        """Handle one message of the client; None stands for a text message."""
        member = self._member
        if member.closed:
            return
        try:
            wait = self._connection.receive(message)
        except Exception as error:  # noqa: BLE001 - raised where the socket's task ends
            self._failure = error
            member.close(NORMAL)
            return
        if wait > 0 or member.is_far_ahead or member.is_over_cpu_budget:
            self._hold(wait)

    def _hold(self, seconds: float) -> None:
        self._socket.pause_hearing()
        self._pause = self._loop.create_task(self._hear_later(seconds))

    async def _hear_later(self, seconds: float) -> None:
        await self._connection.pause(seconds)
        self._socket.resume_hearing()

    def may_write(self) -> None:
        """Write the waiting messages, since the send buffer of the socket has room again."""
        self._write()

    def gone(self) -> None:
        """Close the member of the room, since the client has disconnected."""
        self._member.close(NORMAL)

    def end(self) -> None:
        """Hand the socket back to its server. Raise an error that a message caused meanwhile."""
        self._member.on_news = _nothing
        if self._pause is not None:
            self._pause.cancel()
        self._socket.let_go()
        if self._failure is not None:
            raise self._failure

    def _write_soon(self) -> None:
        if not self._is_due:
            self._is_due = True
            self._turn_end.do(self._write)

    def _write_now(self, framed: bytes) -> bool:
        """Write framed messages at once, and return True; return False if other messages have to be
        written before them or the socket accepts no data now."""
        return not self._is_due and not self._unsent and self._socket.write_framed(framed)

    def _write(self) -> None:
        """Write the waiting messages, as far as the client reads them."""
        self._is_due = False
        member, socket = self._member, self._socket
        if member.closed or not socket.is_writable:
            return
        unsent = self._unsent or member.gather()
        self._unsent = unsent[socket.write(unsent) :] if unsent else unsent
        if not self._unsent and socket.is_writable:
            member.all_sent()
            if member.has_news:  # after the messages that could not be sent earlier
                self._write_soon()


def _nothing() -> None:
    """Ignore events of a socket that has ended."""


async def serve_by_asgi(connection: RoomConnection, receive: Receive, send: Send) -> int:
    """Serve a socket of any ASGI server, by its functions `receive` and `send`, until it ends;
    return the close code. Raise the error that ended it."""
    connection.room.join(connection.member)
    # Two plain tasks: a thousand idle sockets are a thousand times what stands around each.
    tasks = [
        asyncio.create_task(_read_messages(receive, connection)),
        asyncio.create_task(_send_messages(send, connection.member)),
    ]
    for task in tasks:
        task.add_done_callback(lambda _: connection.member.close(NORMAL))
    try:
        code = await connection.member.ended()
    finally:
        connection.room.leave(connection.member)
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)
    for task in tasks:
        if not task.cancelled():
            task.result()  # raises what went wrong
    return code


async def _read_messages(receive: Receive, connection: RoomConnection) -> None:
    """Read messages of the client and handle them until it disconnects, which closes the member of
    the room, or is refused."""
    if (debt := connection.debt()) > 0:
        await connection.pause(debt)
    while True:
        event = await receive()
        if event["type"] == "websocket.disconnect":
            connection.member.close(NORMAL)
        if event["type"] != "websocket.receive":
            return
        wait = connection.receive(event.get("bytes"))
        if connection.member.refused:
            return
        await connection.pause(wait)


async def _send_messages(send: Send, member: Member) -> None:
    """Send the messages of the member until it is closed."""
    try:
        while not member.closed:
            for frame in await member.take():
                await send({"type": "websocket.send", "bytes": frame, "text": None})
    except (OSError, RuntimeError):
        member.close(NORMAL)


Socket = WebSocket[Any, Any, Any]

_GOODBYE: Final = 1.0  # seconds that a close frame gets


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the route of rooms (WebSockets of graphs). Common clients (`y-websocket`) append the
    name of their room to the path, always `room`."""

    @websocket("/api/graphs/{graph_id:str}/room", guards=[Needs("see")])
    async def room(socket: Socket, graph_id: str) -> None:
        """Admit a socket to the room of a graph, and serve it until it ends."""
        services, person = app_state.services, person_of(socket)
        stream = h.graph_stream(graph_id)
        try:
            with services.connection_limits.admitted(person.id, client_network(socket)):
                if not services.rooms.is_joined(
                    stream
                ):  # asking the tables is a fifth of the cost of a connection
                    await services.catalogue.require(graph_id)
                identity = identity_of(socket)
                await services.rights.check("graph", graph_id, identity, edits=False)
                await services.people.seen(person)
                async with services.rooms.enter(stream) as found:
                    await socket.accept()
                    if _has_other_history(socket, services.epoch, found):
                        await _refuse_history(socket, services.epoch)
                        return
                    edits = may(identity, "edit", now=time.time()) == Allowed()
                    acks = _wants_acks(socket)
                    # For those who only look as well; nothing may wait from here until they have joined.
                    may_edit_here = await services.rights.admit(graph_id, identity)
                    with services.colours.held(person.id) as colour:
                        origin = origin_of(person.id)
                        member = Member(
                            person,
                            edits=edits and may_edit_here,
                            acks=acks,
                            colour=colour,
                            origin=origin,
                            identity=identity,
                        )
                        member.post_epoch(services.epoch)
                        if edits and not member.edits:
                            member.post_read_only(MAY_NOT_EDIT)
                        if services.rooms.is_deleted(stream):  # while this socket was let in
                            member.close(messages.NO_SUCH_GRAPH)
                        connection = RoomConnection(found, member, services.rate_limits)
                        with about("graph", graph_id):
                            code = await _serve(socket, connection)
                        services.rooms.metrics.closed[code] += 1
        except Refused as refused:
            await _refuse(socket, refused)

    return [room]


def _wants_acks(socket: Socket) -> bool:
    return bool(socket.query_params.get("acks") == "1")


def _has_other_history(socket: Socket, epoch: str, room: Room) -> bool:
    """Return whether the client has another history of the log, as after a restored backup: its
    epoch differs, or it knows later changes than the room."""
    asked = socket.query_params
    if asked.get("epoch", epoch) != epoch:
        return True
    seq = asked.get("seq", "")
    number = int(seq) if seq.isascii() and seq.isdecimal() and len(seq) < 20 else 0
    return number > room.seq and room.damaged is None


async def _refuse_history(socket: Socket, epoch: str) -> None:
    """Close the socket of a client with another history, and send it the epoch of this one."""
    with anyio.move_on_after(_GOODBYE):
        if _wants_acks(socket):
            await socket.send_bytes(messages.epoch(epoch))
        await socket.close(messages.OTHER_EPOCH, messages.REASONS[messages.OTHER_EPOCH])


async def _serve(socket: Socket, connection: RoomConnection) -> int:
    """Serve the socket of a member of a room until one side closes it; return the close code."""
    direct = direct_socket(socket.scope.get("extensions"))
    if direct is not None:
        code = await serve_directly(connection, direct)
    else:
        code = await serve_by_asgi(connection, *plain(socket))
    if code != NORMAL:
        with anyio.move_on_after(_GOODBYE):
            await socket.close(code, connection.member.close_text or messages.REASONS.get(code))
    return code


async def _refuse(socket: Socket, refused: Refused) -> None:
    """Answer the request for a WebSocket with an HTTP error, or, if it is open already, close it as
    for a restart."""
    if socket.connection_state != "init":
        await socket.close(messages.RESTARTING, messages.REASONS[messages.RESTARTING])
        return
    await refuse(socket.scope, socket.receive, socket.send, refused)
