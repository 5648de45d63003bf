"""The socket of a room (docs/room-protocol.md)."""

from typing import Any, Final

import anyio
from litestar import WebSocket, websocket
from litestar.types import ControllerRouterHandler

from action_assistant.editor.api.conversation import (
    NORMAL,
    Conversation,
    converse,
    converse_directly,
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
    """The route; `y-websocket` appends the name of its room, which is always `room`."""

    @websocket("/api/graphs/{graph_id:str}/room")
    async def room(socket: Socket, graph_id: str) -> None:
        services, person = app_state.services, person_of(socket)
        stream = h.graph_stream(graph_id)
        address = socket.client.host if socket.client is not None else ""
        try:
            with services.connection_limits.admitted(person.id, address):
                if not services.rooms.is_joined(stream):  # to ask is a fifth of what coming costs
                    await services.catalogue.require(graph_id)
                await services.people.seen(person)
                async with services.rooms.enter(stream) as found:
                    await socket.accept()
                    if _knows_another(socket, services.epoch, found):
                        await _part(socket, services.epoch)
                        return
                    edits = allowed(person.role, "edit")
                    acks = _wants_acks(socket)
                    with services.colours.held(person.id) as colour:
                        member = Member(person, edits=edits, acks=acks, colour=colour)
                        member.post_epoch(services.epoch)
                        if services.rooms.is_deleted(stream):  # while this socket was let in
                            member.close(messages.NO_SUCH_GRAPH)
                        talk = Conversation(found, member, services.rate_limits)
                        with about("graph", graph_id):
                            code = await _converse(socket, talk)
                        services.rooms.metrics.closed[code] += 1
        except Refused as refused:
            await _refuse(socket, refused)

    return [room]


def _wants_acks(socket: Socket) -> bool:
    return bool(socket.query_params.get("acks") == "1")


def _knows_another(socket: Socket, epoch: str, room: Room) -> bool:
    """Whether the client knows another history: by its name, or since this one is shorter."""
    asked = socket.query_params
    if asked.get("epoch", epoch) != epoch:
        return True
    seq = asked.get("seq", "")
    number = int(seq) if seq.isascii() and seq.isdecimal() and len(seq) < 20 else 0
    return number > room.seq and room.damaged is None


async def _part(socket: Socket, epoch: str) -> None:
    """Send away who knows another history, with the name of this one."""
    with anyio.move_on_after(_GOODBYE):
        if _wants_acks(socket):
            await socket.send_bytes(messages.epoch(epoch))
        await socket.close(messages.OTHER_EPOCH, messages.REASONS[messages.OTHER_EPOCH])


async def _converse(socket: Socket, talk: Conversation) -> int:
    """Until one side ends it; the close code."""
    direct = direct_socket(socket.scope.get("extensions"))
    if direct is not None:
        code = await converse_directly(talk, direct)
    else:
        code = await converse(talk, *plain(socket))
    if code != NORMAL:
        with anyio.move_on_after(_GOODBYE):
            await socket.close(code, talk.member.said or messages.REASONS.get(code))
    return code


async def _refuse(socket: Socket, refused: Refused) -> None:
    """Answer the request for an upgrade with a plain refusal."""
    if socket.connection_state != "init":
        await socket.close(messages.RESTARTING, messages.REASONS[messages.RESTARTING])
        return
    await refuse(socket.scope, socket.receive, socket.send, refused)
