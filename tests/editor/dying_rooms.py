"""Rooms on a real journal in small processes that die where they are told to.

`python -m editor.dying_rooms FOLDER` reads lines `STREAM POINT COUNT`, and for each forks a process that
serves the room of STREAM on FOLDER/socket and kills itself with SIGKILL when it passes POINT for the
COUNT-th time. Every second one commits on its event loop. It prints the number of each process, then
`dead`. The product knows nothing of this.
"""

import asyncio
import contextlib
import itertools
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from action_assistant.editor.crdt import messages
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.rooms.room import Room, UpdateBroadcast
from action_assistant.journal import commit_metrics
from action_assistant.journal.events import nothing
from action_assistant.journal.journal import Journal
from action_assistant.journal.sqlite import SqliteSession
from action_assistant.web.auth.keys import Person

#: Points at which a process can die while an edit passes through.
POINTS: Final = (
    "before the edit is applied",
    "before the append",
    "within the transaction",
    "before the commit",
    "after the commit",
    "before the broadcast",
    "within the broadcast",
    "before the acknowledgement",
    "after the acknowledgement",
)
NOWHERE: Final = "nowhere"


class Trap:
    """Springs when a point has been passed so many times."""

    def __init__(self, point: str, count: int) -> None:
        self._point = point
        self._left = count
        self._statement = ""

    def passes(self, point: str) -> None:
        if point == self._point:
            self._left -= 1
            if self._left == 0:
                os.kill(os.getpid(), signal.SIGKILL)

    def around(
        self, owner: Any, name: str, before: str | None = None, after: str | None = None
    ) -> None:
        """Pass a point before or after a method of a class."""
        method: Callable[..., Any] = getattr(owner, name)

        def trapped(*arguments: Any, **named: Any) -> Any:
            if before is not None:
                self.passes(before)
            result = method(*arguments, **named)
            if after is not None:
                self.passes(after)
            return result

        setattr(owner, name, trapped)

    def set(self) -> None:
        """Put it into the way of every edit."""
        self.around(Room, "_apply_batch", before="before the edit is applied")
        self.around(Journal, "append_then", before="before the append")
        self.around(SqliteSession, "store", after="after the commit")
        self.around(UpdateBroadcast, "send", before="before the broadcast")
        self.around(Member, "post", after="within the broadcast")
        self.around(Member, "post_ack", before="before the acknowledgement")
        original = SqliteSession.__init__

        def opened(session: Any, *arguments: Any) -> None:
            original(session, *arguments)
            session._raw.set_trace_callback(self._said)

        SqliteSession.__init__ = opened  # type: ignore[method-assign]

    def _said(self, statement: str) -> None:
        """SQLite is at a statement: at its beginning, then at each step of the trigger that it sets off, of
        which the last one comes right before the commit."""
        if statement.startswith("INSERT INTO event"):
            again = statement == self._statement
            self.passes("before the commit" if again else "within the transaction")
            self._statement = statement


class Pipe:
    """Frames over a stream: the length, then the bytes."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader = reader
        self._writer = writer

    async def receive_bytes(self) -> bytes:
        size = int.from_bytes(await self._reader.readexactly(4), "big")
        return await self._reader.readexactly(size)

    async def send_bytes(self, frame: bytes) -> None:
        self._writer.write(len(frame).to_bytes(4, "big") + frame)
        await self._writer.drain()

    def close(self) -> None:
        self._writer.close()


async def serve(folder: Path, stream: str, trap: Trap, at_once: bool) -> None:
    """Serve one room until the process is killed."""
    url = f"sqlite:///{folder / 'editor.db'}"
    journal = await Journal.open(url, branch="editor", fold=nothing, at_once=at_once)
    rooms = Rooms(journal)

    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        pipe = Pipe(reader, writer)
        name = (await pipe.receive_bytes()).decode()
        member = Member(Person(name, name), acks=True)
        async with rooms.enter(stream) as room:
            room.join(member)
            speaking = asyncio.create_task(_speak(pipe, member, trap))
            with contextlib.suppress(asyncio.IncompleteReadError, ConnectionError):
                while message := messages.parse(await pipe.receive_bytes()):
                    room.receive(member, message)
                    await member.until_caught_up()
            room.leave(member)
            speaking.cancel()

    server = await asyncio.start_unix_server(talk, folder / "socket.new")
    (folder / "socket.new").rename(folder / "socket")  # there only when it listens
    async with server:
        await server.serve_forever()


async def _speak(pipe: Pipe, member: Member, trap: Trap) -> None:
    while True:
        for frame in await member.take():
            await pipe.send_bytes(frame)
            if frame[0] == messages.ACKS:
                trap.passes("after the acknowledgement")


def main(folder: Path) -> None:
    # Commits count as quick from the second one on, whatever their share of the time. The values
    # are Final to all but this process, which is to die in commits on the loop as often as in those
    # of the thread.
    commit_metrics._KNOWN, commit_metrics._SHARE = 1, float("inf")  # type: ignore[misc]
    for line, at_once in zip(sys.stdin, itertools.cycle((False, True)), strict=False):
        stream, count, point = line.rstrip("\n").split(" ", 2)
        (folder / "socket").unlink(missing_ok=True)
        child = os.fork()
        if child == 0:
            trap = Trap(point, int(count))
            trap.set()
            asyncio.run(serve(folder, stream, trap, at_once))
        sys.stdout.write(f"{child}\n")
        sys.stdout.flush()
        _, status = os.waitpid(child, 0)
        sys.stdout.write("dead\n" if os.WIFSIGNALED(status) else f"ended {status}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
