"""A room that another editor has open, for edits of the server itself."""

from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Final, TypeAlias
from urllib.parse import quote, urlencode

import httpx
import msgspec

from action_assistant.editor.cluster.peers import Call, Peers, refusal
from action_assistant.editor.rooms.batch import DocumentState
from action_assistant.editor.rooms.room import Room
from action_assistant.errors import OutcomeUnknown, Refused, Unavailable

#: The path of rooms at the listener for other editors.
ROOMS: Final = "/rooms/"
SEQ: Final = "x-seq"
#: The parameters in the query of an edit: its author, and the number of the last change before it.
AUTHOR: Final = "author"
EXPECTED: Final = "expected"
#: The parameter with the id of a turn, which an answer has in the header; or, at first, with its author.
TURN: Final = "turn"
TURN_HEADER: Final = "x-turn"
_MOVED: Final = "This graph has just moved to another editor; try again."
_UNREADABLE: Final = "The answer of the editor that has this graph open was lost."


class SubmittedSeq(msgspec.Struct, frozen=True):
    """The answer to an edit that was submitted to a room."""

    seq: int


#: A room wherever it is open, for edits of the server itself.
AnyRoom: TypeAlias = "Room | RemoteRoom"


class RemoteRoom:
    """The room of a stream at the editor that owns it, with what edits of the server need of a
    room."""

    def __init__(self, stream: str, peers: Peers) -> None:
        self._target = ROOMS + quote(stream, safe="")
        self._stream = stream
        self._peers = peers
        #: The number of the last change, as far as it was heard of here.
        self.seq = 0

    async def submit(self, update: bytes, author: str, expected: int | None = None) -> int:
        """Do what `Room.submit` does. Raise OutcomeUnknown, too, if the answer was lost."""
        query = {AUTHOR: author} | ({} if expected is None else {EXPECTED: str(expected)})
        target = f"{self._target}?{urlencode(query)}"
        return await self._stored(Call("POST", target, body=update, is_inner=True))

    async def submit_in_turn(
        self, author: str, compute: Callable[[bytes, int], Awaitable[bytes]]
    ) -> int:
        """Do what `Room.submit_in_turn` does; the time for `compute` includes the way to the other
        editor. At an editor of the version before, edits of others do not wait. Raise OutcomeUnknown, too, if the answer was lost."""
        begin = Call("GET", f"{self._target}?{urlencode({TURN: author})}", is_inner=True)
        headers, state = await self._ask(begin)
        before = int(headers[SEQ])
        if (
            TURN_HEADER not in headers
        ):  # an editor of the version before, whose rooms wait for nobody
            return await self.submit(await compute(state, before), author, before)
        turn = f"{self._target}?{urlencode({TURN: headers[TURN_HEADER]})}"
        try:
            update = await compute(state, before)
        except BaseException:
            with suppress(Refused):  # or the room goes on by itself
                await self._ask(Call("DELETE", turn, is_inner=True))
            raise
        return await self._stored(Call("POST", turn, body=update, is_inner=True))

    async def now(self) -> DocumentState:
        """Return the document and the number of its last change, as `Room.now` does."""
        headers, state = await self._ask(Call("GET", self._target, is_inner=True))
        self.seq = int(headers[SEQ])
        return DocumentState(self.seq, state)

    async def _stored(self, call: Call) -> int:
        _, body = await self._ask(call)
        self.seq = msgspec.json.decode(body, type=SubmittedSeq).seq
        return self.seq

    async def _ask(self, call: Call) -> tuple[httpx.Headers, bytes]:
        """Return the header fields and the body of an answer. Raise the refusal of the other
        editor."""
        async with self._peers.answer(self._stream, call) as answer:
            if answer is None:
                raise Unavailable(_MOVED)
            try:
                body = await answer.aread()
            except httpx.HTTPError as error:
                raise OutcomeUnknown(_UNREADABLE) from error
            if not answer.is_success:
                raise refusal(body)
            return answer.headers, body
