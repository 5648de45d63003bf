"""Turns in the rooms of this editor in which another editor computes an edit of the server (decision 170)."""

import asyncio
from collections.abc import Callable
from typing import Any, Final

from action_assistant.editor.rooms.batch import DocumentState
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Overtaken
from action_assistant.random_ids import random_id

_OVER: Final = "To work this out took too long."


class _Turn:
    def __init__(self) -> None:
        loop = asyncio.get_running_loop()
        self.begun: Final[asyncio.Future[DocumentState]] = loop.create_future()
        self.update: Final[asyncio.Future[bytes]] = loop.create_future()
        self.done: asyncio.Task[int] | None = None

    async def compute(self, state: bytes, seq: int) -> bytes:
        """Let the other editor compute the edit."""
        self.begun.set_result(DocumentState(seq, state))
        return await self.update


class RemoteTurns:
    """The turns that have begun. One request begins a turn, another one brings its edit; without one the room
    goes on by itself."""

    def __init__(self, rooms: Callable[[], Rooms]) -> None:
        self._rooms = rooms
        self._turns: dict[str, _Turn] = {}

    async def begin(self, stream: str, author: str) -> tuple[str, DocumentState]:
        """Wait for a turn in the name of `author`; return its id, and the document as it is. Raise the errors
        of `Room.submit_in_turn`."""
        made, turn = random_id(), _Turn()
        task = turn.done = asyncio.create_task(self._take(stream, author, turn))
        self._turns[made] = turn
        task.add_done_callback(lambda _: self._over(made, task))
        try:
            waiting: list[asyncio.Future[Any]] = [task, turn.begun]
            await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        except BaseException:
            task.cancel()
            raise
        if not turn.begun.done():
            task.result()  # raises why there is no turn
        return made, turn.begun.result()

    async def end(self, made: str, update: bytes) -> int:
        """Store the edit of a turn, and return its number. Raise Overtaken if the turn is over."""
        turn = self._turns.pop(made, None)
        if turn is None or turn.done is None or turn.update.done():
            raise Overtaken(_OVER)
        turn.update.set_result(update)
        return await asyncio.shield(turn.done)

    def cancel(self, made: str) -> None:
        """Let the room go on without an edit, if the turn is not over."""
        turn = self._turns.pop(made, None)
        if turn is not None:
            turn.update.cancel()

    def _over(self, made: str, task: asyncio.Task[int]) -> None:
        """Forget a turn. Whoever waits for its edit is told why there is none; else nobody asks for that, and
        asyncio would log it."""
        self._turns.pop(made, None)
        if not task.cancelled():
            task.exception()

    async def _take(self, stream: str, author: str, turn: _Turn) -> int:
        async with self._rooms().enter(stream) as room:
            return await room.submit_in_turn(author, turn.compute)
