"""One socket in a room: what waits to be sent to it, and when it is too slow (rule R5)."""

import asyncio
from collections.abc import Callable
from enum import Enum
from functools import lru_cache
from typing import Final

from action_assistant.editor.crdt import messages
from action_assistant.editor.rooms.colours import NOBODYS
from action_assistant.editor.rooms.presence import PresenceNews, PresenceOwner
from action_assistant.kit.token_bucket import TokenBucket
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.server.direct import framed

WAITING_FRAMES: Final = 256
WAITING_BYTES: Final = 1 << 20
_BURST_S: Final = 0.1  # processor time of the loop that edits of one socket may take at once
_SHARE: Final = 0.2  # of the time, that they may take for long
_UNHANDLED_EDITS: Final = 256  # that a socket may have sent ahead of the room


class _Answer(Enum):
    """Where the document is that the socket asked for."""

    NONE = "nowhere"
    WANTED = "still to be made"
    WAITS = "waits to be taken"
    LEFT = "is being sent"


class Member:
    """Someone's socket. The room posts; whoever owns the socket takes and sends."""

    def __init__(
        self,
        person: PersonRef,
        *,
        edits: bool = True,
        acks: bool = False,
        colour: str = NOBODYS,
    ) -> None:
        self.person: Final = person
        self.presence_owner: Final = PresenceOwner(person, colour)
        self.edits = edits
        self.acks: Final = acks
        self.synced = False  # has been sent the document
        self.refused = False  # nothing more is taken from it
        self.said: str | None = None  # why, where the close code does not tell enough
        self._cpu: Final = TokenBucket(_BURST_S, _SHARE)  # seconds of the loop's processor time
        self.handled = 0  # edits of this socket that the room has dealt with
        self._heard = 0  # edits that the socket brought
        self._frames: list[bytes] = []
        self._bytes = 0
        self._answer = _Answer.NONE
        self._presence: PresenceNews | None = None
        self._ack: tuple[int, int] | None = None
        self._said = -1, -1  # with the last acknowledgement
        self._news: asyncio.Event | None = None  # while somebody takes what there is
        #: Called when there is something to be sent, or the end has come.
        self.on_news: Callable[[], None] = self._tell_taker
        #: Writes framed messages at once, where whoever owns the socket can: whether it did.
        self.write_now: Callable[[bytes], bool] = _never
        self._room_again: asyncio.Event | None = None  # few sockets are ever far ahead
        self._loop = asyncio.get_running_loop()
        self._taken_at = self._loop.time()
        self._closed: asyncio.Future[int] = self._loop.create_future()

    def post(self, frame: bytes) -> None:
        """Send a message some time soon; who has too much waiting is closed."""
        if self._closed.done():
            return
        if len(self._frames) >= WAITING_FRAMES or self._bytes > WAITING_BYTES:
            self.close(messages.TOO_SLOW)
            return
        self._frames.append(frame)
        self._bytes += len(frame)
        self.on_news()

    def sends(self, news: bytes, durable: int | None = None) -> bool:
        """Send framed messages at once, the same bytes as to many others, and behind them up to which
        event all is durable; False where that has to be posted, behind what waits."""
        if self._frames or self._ack is not None or self._presence is not None:
            return False
        says = self._said
        if durable is not None and self.acks and self.synced:
            says = self.handled, durable
            if says != self._said:
                news += _framed_acks(*says)
        if not news:
            return True
        if self._closed.done() or not self.write_now(news):
            return False
        self._said = says
        self._taken_at = self._loop.time()
        return True

    def asks(self) -> bool:
        """The socket wants the document; False when it is still on its way for an earlier wish.

        What changes meanwhile is sent behind it, so that a second one would tell nothing new.
        """
        if self._answer is not _Answer.NONE:
            return False
        self._answer = _Answer.WANTED
        return True

    def post_answer(self, frame: bytes) -> None:
        """Send the document, however large: it was asked for."""
        self._answer = _Answer.WAITS
        self._frames.append(frame)
        self.on_news()

    def post_epoch(self, epoch: str) -> None:
        """Say which history this is, to those who know our own messages."""
        if self.acks:
            self.post(messages.epoch(epoch))

    def post_read_only(self, why: str) -> None:
        """Say that nobody may change the document, to those who know our own messages."""
        if self.acks:
            self.post(messages.read_only(why))

    def post_presence(self, news: PresenceNews) -> None:
        """Tell who is where; only the last word of each client waits."""
        if news.entries:
            waiting = self._presence
            self._presence = news if waiting is None else waiting.followed_by(news)
            self.on_news()

    def post_ack(self, seq: int) -> None:
        """Say what is durable, and that everything up to `seq` was sent; the last word counts."""
        if self.acks and self.synced:
            says = self.handled, seq
            if says != self._said:
                self._said = self._ack = says
                self.on_news()

    async def take(self) -> list[bytes]:
        """What is to be sent next, in order; waits until there is something. Whoever takes again has
        sent what was taken before."""
        self.all_sent()
        while not self.has_news and not self.closed:
            self._news = asyncio.Event()
            await self._news.wait()
        return self.gather()

    def _tell_taker(self) -> None:
        if self._news is not None:
            self._news.set()

    def all_sent(self) -> None:
        """What was gathered has gone out."""
        if self._answer is _Answer.LEFT:
            self._answer = _Answer.NONE

    @property
    def has_news(self) -> bool:
        """Whether there is something to be sent."""
        return bool(self._frames or self._presence is not None or self._ack is not None)

    def gather(self) -> list[bytes]:
        """What is to be sent next, in order."""
        self._taken_at = self._loop.time()
        frames, self._frames = self._frames, []
        self._bytes = 0
        if self._answer is _Answer.WAITS:
            self._answer = _Answer.LEFT
        if self._presence is not None:
            frames.append(self._presence.frame)
            self._presence = None
        if self._ack is not None:
            frames.append(messages.acks(*self._ack))
            self._ack = None
        return frames

    def beat(self, silence: float) -> None:
        """Say something if nothing was said for so many seconds (rule R10)."""
        if self._loop.time() - self._taken_at >= silence:
            self.post(messages.BEAT)

    def heard_edit(self) -> None:
        """The socket brought an edit."""
        self._heard += 1

    def used_cpu(self, seconds: float) -> None:
        """Count the processor time that an edit of this socket took from the event loop."""
        self._cpu.spend(seconds)

    @property
    def is_over_cpu_budget(self) -> bool:
        """Tell whether edits of this socket took more of the loop than their share."""
        return self._cpu.is_overdrawn

    def cpu_debt(self) -> float:
        """Return for how many seconds the socket is not to be read, so that others get their share."""
        return self._cpu.debt()

    def edit_handled(self) -> None:
        """The room has dealt with the next edit of this socket, for good."""
        self.handled += 1
        self._let_on()

    @property
    def far_ahead(self) -> bool:
        """Whether the socket has said much that the room has not dealt with."""
        return self._heard - self.handled > _UNHANDLED_EDITS and not self.closed

    async def until_heard(self) -> None:
        """Wait while this socket is far ahead of the room."""
        while self.far_ahead:
            again = self._room_again = asyncio.Event()
            await again.wait()

    def _let_on(self) -> None:
        if self._room_again is not None:
            self._room_again.set()

    def close(self, code: int) -> None:
        """End this socket. The first reason counts."""
        if not self._closed.done():
            self._closed.set_result(code)
            self._let_on()
            self.on_news()

    def refuse(self, code: int, said: str | None = None) -> None:
        """End this socket for what it did; what it sent after that is not looked at."""
        self.refused = True
        self.said = self.said if self.closed else said
        self.close(code)

    @property
    def closed(self) -> bool:
        """Whether somebody ended it."""
        return self._closed.done()

    async def ended(self) -> int:
        """Wait for the end; the close code."""
        return await asyncio.shield(self._closed)


@lru_cache(64)  # those who only listen all hear the same
def _framed_acks(handled: int, seq: int) -> bytes:
    return framed(messages.acks(handled, seq))


def _never(_: bytes) -> bool:
    """Nothing can be written at once."""
    return False
