"""The socket of a room (docs/room-protocol.md)."""

from typing import Any, Final

import anyio
from litestar import WebSocket, websocket
from litestar.types import ControllerRouterHandler

from action_assistant.editor.api.room_connection import (
    NORMAL,
    RoomConnection,
    serve_by_asgi,
    serve_directly,
)
from action_assistant.editor.crdt import messages
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.room import Room
from action_assistant.editor.services import EditorState
from action_assistant.errors import Refused
from action_assistant.logs.context import about
from action_assistant.web.auth.access import person_of, plain, refuse
from action_assistant.web.auth.roles import allowed
from action_assistant.web.server.direct import direct_socket

Socket = WebSocket[Any, Any, Any]

_GOODBYE: Final = 1.0  # seconds that a close frame gets


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the route of rooms. Stock clients (`y-websocket`) append the name of their room, always `room`."""

    @websocket("/api/graphs/{graph_id:str}/room")
    async def room(socket: Socket, graph_id: str) -> None:
        services, person = app_state.services, person_of(socket)
        stream = h.graph_stream(graph_id)
        address = socket.client.host if socket.client is not None else ""
        try:
            with services.connection_limits.admitted(person.id, address):
                if not services.rooms.is_joined(
                    stream
                ):  # asking the tables is a fifth of the cost of a connection
                    await services.catalogue.require(graph_id)
                await services.people.seen(person)
                async with services.rooms.enter(stream) as found:
                    await socket.accept()
                    if _has_other_history(socket, services.epoch, found):
                        await _refuse_history(socket, services.epoch)
                        return
                    edits = allowed(person.role, "edit")
                    acks = _wants_acks(socket)
                    with services.colours.held(person.id) as colour:
                        member = Member(person, edits=edits, acks=acks, colour=colour)
                        member.post_epoch(services.epoch)
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
    """Tell whether the client comes from another history of the log: its epoch differs, or it knows later
    changes than there are."""
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
    """Serve a socket until one side closes it; return the close code."""
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
    """Answer the request for an upgrade with an HTTP error."""
    if socket.connection_state != "init":
        await socket.close(messages.RESTARTING, messages.REASONS[messages.RESTARTING])
        return
    await refuse(socket.scope, socket.receive, socket.send, refused)
