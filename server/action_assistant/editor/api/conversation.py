"""A socket in a room, until one side ends it: what it says, and what it is told.

Its messages come and go directly where the server below allows that; else as ASGI has it, by two tasks
and an event for each message. Both ways keep the same rules.
"""

import asyncio
import logging
from typing import Final

import anyio
from litestar.types import Receive, Send

from action_assistant.editor.crdt import messages
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.rate_limits import ByteRateLimits
from action_assistant.editor.rooms.room import Room
from action_assistant.web.server.direct import DirectSocket

log: Final = logging.getLogger(__name__)

NORMAL: Final = 1000


class Conversation:
    """Of one socket with its room."""

    def __init__(self, room: Room, member: Member, rate_limits: ByteRateLimits) -> None:
        self.room: Final = room
        self.member: Final = member
        self._rate_limits = rate_limits

    def hear(self, data: bytes | None) -> float:
        """What the client says; None for text. For how many seconds it is not to be read now, beside the
        time in which it is far ahead. Ends the member for what cannot be read."""
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
        self.room.hear(member, message)
        limits = self._rate_limits
        spend = limits.spend if isinstance(message, messages.Edit) else limits.speak
        return spend(member.person.id, len(data))

    def debt(self) -> float:
        """For how many seconds its person is not to be read, for what came by other sockets."""
        return self._rate_limits.spend(self.member.person.id, 0)

    async def pause(self, seconds: float) -> None:
        """Wait until more may be read."""
        await self.member.until_heard()
        wait = seconds + self.member.cpu_debt()
        if wait > 0:
            await anyio.sleep(wait)


async def converse_directly(talk: Conversation, socket: DirectSocket) -> int:
    """The code with which to close. Raises what went wrong."""
    directly = _Directly(talk, socket)
    talk.room.join(talk.member)
    socket.take_over(directly)
    try:
        return await talk.member.ended()
    finally:
        talk.room.leave(talk.member)
        directly.end()


class _Directly:
    """Hears a socket, and writes to it once for each turn of the loop."""

    def __init__(self, talk: Conversation, socket: DirectSocket) -> None:
        self._talk = talk
        self._member = talk.member
        self._socket = socket
        self._loop = asyncio.get_running_loop()
        self._turn_end = talk.room.turn_end
        self._unsent: list[bytes] = []
        self._is_due = False
        self._pause: asyncio.Task[None] | None = None
        self._failure: Exception | None = None
        talk.member.on_news = self._soon
        talk.member.write_now = self._write_now
        self._soon()  # something may wait already
        if (debt := talk.debt()) > 0:
            self._hold(debt)

    def heard(self, message: bytes | None) -> None:
        """A message has come; None for text."""
        member = self._member
        if member.closed:
            return
        try:
            wait = self._talk.hear(message)
        except Exception as error:  # noqa: BLE001 - raised where the socket's task ends
            self._failure = error
            member.close(NORMAL)
            return
        if wait > 0 or member.far_ahead or member.is_over_cpu_budget:
            self._hold(wait)

    def _hold(self, seconds: float) -> None:
        self._socket.pause_hearing()
        self._pause = self._loop.create_task(self._hear_later(seconds))

    async def _hear_later(self, seconds: float) -> None:
        await self._talk.pause(seconds)
        self._socket.resume_hearing()

    def may_write(self) -> None:
        """There is room for more."""
        self._write()

    def gone(self) -> None:
        """The client has left."""
        self._member.close(NORMAL)

    def end(self) -> None:
        """Let go of the socket. Raises what went wrong in between."""
        self._member.on_news = _nothing
        if self._pause is not None:
            self._pause.cancel()
        self._socket.let_go()
        if self._failure is not None:
            raise self._failure

    def _soon(self) -> None:
        if not self._is_due:
            self._is_due = True
            self._turn_end.do(self._write)

    def _write_now(self, framed: bytes) -> bool:
        """What nothing waits before."""
        return not self._is_due and not self._unsent and self._socket.write_framed(framed)

    def _write(self) -> None:
        """All that waits, as far as the client reads it."""
        self._is_due = False
        member, socket = self._member, self._socket
        if member.closed or not socket.is_writable:
            return
        unsent = self._unsent or member.gather()
        self._unsent = unsent[socket.write(unsent) :] if unsent else unsent
        if not self._unsent and socket.is_writable:
            member.all_sent()
            if member.has_news:  # behind what could not be sent earlier
                self._soon()


def _nothing() -> None:
    """Nobody is told."""


async def converse(talk: Conversation, receive: Receive, send: Send) -> int:
    """As `converse_directly`, under any server."""
    talk.room.join(talk.member)
    # Two plain tasks: a thousand idle sockets are a thousand times what stands around each.
    tasks = [
        asyncio.create_task(_listen(receive, talk)),
        asyncio.create_task(_speak(send, talk.member)),
    ]
    for task in tasks:
        task.add_done_callback(lambda _: talk.member.close(NORMAL))
    try:
        code = await talk.member.ended()
    finally:
        talk.room.leave(talk.member)
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)
    for task in tasks:
        if not task.cancelled():
            task.result()  # raises what went wrong
    return code


async def _listen(receive: Receive, talk: Conversation) -> None:
    """What the client says. Ends the member when the client goes."""
    if (debt := talk.debt()) > 0:
        await talk.pause(debt)
    while True:
        event = await receive()
        if event["type"] == "websocket.disconnect":
            talk.member.close(NORMAL)
        if event["type"] != "websocket.receive":
            return
        wait = talk.hear(event.get("bytes"))
        if talk.member.refused:
            return
        await talk.pause(wait)


async def _speak(send: Send, member: Member) -> None:
    """What the client is told."""
    try:
        while not member.closed:
            for frame in await member.take():
                await send({"type": "websocket.send", "bytes": frame, "text": None})
    except (OSError, RuntimeError):
        member.close(NORMAL)
