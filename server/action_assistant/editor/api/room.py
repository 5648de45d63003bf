"""The socket of a room (docs/room-protocol.md)."""

import asyncio
import logging
from typing import Any, Final

import anyio
from litestar import WebSocket, websocket
from litestar.types import ControllerRouterHandler, Receive, Send

from action_assistant.editor.crdt import messages
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.rate_limits import ByteRateLimits
from action_assistant.editor.rooms.room import Room
from action_assistant.editor.services import EditorState
from action_assistant.errors import Refused
from action_assistant.logs.context import about
from action_assistant.web.auth.access import person_of, plain, refuse
from action_assistant.web.auth.roles import allowed

log: Final = logging.getLogger(__name__)

Socket = WebSocket[Any, Any, Any]

_NORMAL: Final = 1000
_GOODBYE: Final = 1.0  # seconds that a close frame gets


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """The route; `y-websocket` appends the name of its room, which is always `room`."""

    @websocket("/api/graphs/{graph_id:str}/room")
    async def room(socket: Socket, graph_id: str) -> None:
        services, person = app_state.services, person_of(socket)
        address = socket.client.host if socket.client is not None else ""
        try:
            with services.connection_limits.admitted(person.id, address):
                await services.catalogue.require(graph_id)
                await services.people.seen(person)
                async with services.rooms.enter(h.graph_stream(graph_id)) as found:
                    await socket.accept()
                    if _knows_another(socket, services.epoch, found):
                        await _part(socket, services.epoch)
                        return
                    edits = allowed(person.role, "edit")
                    acks = _wants_acks(socket)
                    with services.colours.held(person.id) as colour:
                        member = Member(person, edits=edits, acks=acks, colour=colour)
                        member.post_epoch(services.epoch)
                        with about("graph", graph_id):
                            code = await _converse(socket, found, member, services.rate_limits)
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


async def _converse(socket: Socket, room: Room, member: Member, rate_limits: ByteRateLimits) -> int:
    """Until one side ends it; the close code."""
    receive, send = plain(socket)
    room.join(member)
    # Two plain tasks: a thousand idle sockets are a thousand times what stands around each.
    tasks = [
        asyncio.create_task(_listen(receive, room, member, rate_limits)),
        asyncio.create_task(_speak(send, member)),
    ]
    for task in tasks:
        task.add_done_callback(lambda _: member.close(_NORMAL))
    try:
        code = await member.ended()
    finally:
        room.leave(member)
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)
    for task in tasks:
        if not task.cancelled():
            task.result()  # raises what went wrong
    if code != _NORMAL:
        with anyio.move_on_after(_GOODBYE):
            await socket.close(code, member.said or messages.REASONS.get(code))
    return code


async def _listen(
    receive: Receive, room: Room, member: Member, rate_limits: ByteRateLimits
) -> None:
    """What the client says. Ends the member when the client goes, or says what cannot be read."""
    while True:
        event: Any = await receive()
        if event["type"] == "websocket.disconnect":
            member.close(_NORMAL)
            return
        data = event.get("bytes")
        if data is None:
            member.refuse(messages.UNREADABLE)
            return
        try:
            message = messages.parse(data)
        except messages.Malformed as error:
            log.info("%s sent %s", member.person.id, error)
            member.refuse(messages.MALFORMED)
            return
        if message is not None:
            room.hear(member, message)
            if member.far_ahead:
                await member.until_heard()
            spend = rate_limits.spend if isinstance(message, messages.Edit) else rate_limits.speak
            wait = spend(member.person.id, len(data)) + member.toll()
            if wait > 0:
                await anyio.sleep(wait)


async def _speak(send: Send, member: Member) -> None:
    """What the client is told."""
    try:
        while not member.closed:
            for frame in await member.take():
                await send({"type": "websocket.send", "bytes": frame, "text": None})
    except (OSError, RuntimeError):
        member.close(_NORMAL)


async def _refuse(socket: Socket, refused: Refused) -> None:
    """Answer the request for an upgrade with a plain refusal."""
    if socket.connection_state != "init":
        await socket.close(messages.RESTARTING, messages.REASONS[messages.RESTARTING])
        return
    await refuse(socket.scope, socket.receive, socket.send, refused)
