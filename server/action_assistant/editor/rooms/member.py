"""One socket in a room: its send queue, its back-pressure and its end (rule R5)."""

import asyncio
import time
from collections.abc import Callable
from enum import Enum
from functools import lru_cache
from typing import Final

from action_assistant.editor.crdt import messages
from action_assistant.editor.rooms.presence import NOBODYS, PresenceNews, PresenceOwner
from action_assistant.kit.token_bucket import Clock, TokenBucket, TokenBuckets
from action_assistant.settings import LoadLimits
from action_assistant.web.auth.caller import Origin
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.server.direct import framed

PER_MINUTE: Final = LoadLimits().mib_a_minute << 20  # bytes, of all sockets of a person
AT_ONCE: Final = 32 << 20  # bytes: a large graph after a day without a network
_MOVES: Final = 200  # presence messages that are allowed in a second without end
WAITING_FRAMES: Final = 256
WAITING_BYTES: Final = 1 << 20
_BURST_S: Final = 0.1  # processor time of the loop that edits of one socket may take at once
_LOOP_SHARE: Final = 0.2  # of the time, that they may take for long
_UNHANDLED_EDITS: Final = 256  # of one socket that may wait in the room


class ByteRateLimits:
    """Limits the bytes that each person sends per time. Without `limits` it never delays anyone."""

    def __init__(
        self, *, limits: bool, per_minute: int = PER_MINUTE, clock: Clock = time.monotonic
    ) -> None:
        self._limits = limits
        self._buckets: Final = TokenBuckets(AT_ONCE, per_minute / 60, clock)
        self._presence_bytes: Final = per_minute // (60 * _MOVES)

    def spend_on_presence(self, person: str, size: int) -> float:
        """Count a presence message of `size` bytes that a person sent; a short one counts as a
        longer one. Return for how many seconds no more data of this person may be read."""
        return self.spend(person, max(size, self._presence_bytes))

    def spend(self, person: str, size: int) -> float:
        """Count `size` bytes that a person sent. Return for how many seconds no more data of this
        person may be read; 0 within the limit."""
        if not self._limits:
            return 0.0
        bucket = self._buckets.of(person)
        bucket.spend(size)
        return bucket.debt()


class _SyncState(Enum):
    """The state of the document that the socket asked for."""

    NONE = "not asked for"
    WANTED = "still to be encoded"
    WAITS = "in the send queue"
    LEFT = "being sent"


class Member:
    """The send queue of one socket. The room posts messages; the owner of the socket takes and sends them."""

    def __init__(
        self,
        person: PersonRef,
        *,
        edits: bool = True,
        acks: bool = False,
        colour: str = NOBODYS,
        origin: Origin | None = None,
        identity: Identity | None = None,
    ) -> None:
        self.person: Final = person
        self.identity: Final = identity  # asked again when rights on the graph change
        self.origin: Final = origin
        self.presence_owner: Final = PresenceOwner(person, colour)
        self.edits = edits
        self.acks: Final = acks
        self.synced = False  # has been sent the document
        self.refused = False  # nothing more is taken from it
        self.close_text: str | None = None  # where the close code alone does not say enough
        self._cpu: Final = TokenBucket(
            _BURST_S, _LOOP_SHARE
        )  # seconds of the loop's processor time
        self.handled = 0  # edits of this socket that the room has dealt with
        self._received = 0  # edits that the socket sent
        self._frames: list[bytes] = []
        self._bytes = 0
        self._answer = _SyncState.NONE
        self._presence: PresenceNews | None = None
        self._ack: tuple[int, int] | None = None
        self._last_ack = -1, -1
        self._news: asyncio.Event | None = None  # while `take` waits
        #: Called when there is something to send, or the socket is to be closed.
        self.on_news: Callable[[], None] = self._wake_taker
        #: Writes framed messages at once and returns True; False where the owner of the socket cannot.
        self.write_now: Callable[[bytes], bool] = _never
        self._caught_up: asyncio.Event | None = None  # made for the few sockets that wait
        self._loop = asyncio.get_running_loop()
        self._taken_at = self._loop.time()
        self._closed: asyncio.Future[int] = self._loop.create_future()

    def post(self, frame: bytes) -> None:
        """Append a message to the send queue without waiting. Close the socket if the queue is
        full."""
        if self._closed.done():
            return
        if len(self._frames) >= WAITING_FRAMES or self._bytes > WAITING_BYTES:
            self.close(messages.TOO_SLOW)
            return
        self._frames.append(frame)
        self._bytes += len(frame)
        self.on_news()

    def send_now(self, news: bytes, durable: int | None = None) -> bool:
        """Write framed messages (`news`) to the socket at once, followed by the acknowledgement
        that everything up to `durable` is stored. Return False, without writing, if the queue is
        not empty or the socket accepts nothing now, so that they must be posted."""
        if self._frames or self._ack is not None or self._presence is not None:
            return False
        says = self._last_ack
        if durable is not None and self.acks and self.synced:
            says = self.handled, durable
            if says != self._last_ack:
                news += _framed_acks(*says)
        if not news:
            return True
        if self._closed.done() or not self.write_now(news):
            return False
        self._last_ack = says
        self._taken_at = self._loop.time()
        return True

    def begins_sync(self) -> bool:
        """Record that the socket asks for the document, and return True. Return False while an
        earlier answer is still on its way: later changes are sent after that answer, so a second
        answer would have nothing new."""
        if self._answer is not _SyncState.NONE:
            return False
        self._answer = _SyncState.WANTED
        return True

    def post_answer(self, frame: bytes) -> None:
        """Append the answer with the requested document to the send queue. No limit of the queue
        applies to `frame`."""
        self._answer = _SyncState.WAITS
        self._frames.append(frame)
        self.on_news()

    def post_epoch(self, epoch: str) -> None:
        """Send the epoch of the log to a client that understands this program's own messages."""
        if self.acks:
            self.post(messages.epoch(epoch))

    def post_read_only(self, why: str) -> None:
        """Send the reason why the document is read-only to a client that understands this program's
        own messages."""
        if self.acks:
            self.post(messages.read_only(why))

    def post_presence(self, news: PresenceNews) -> None:
        """Queue presence entries; of each client only the newest waits in the queue."""
        if news.entries:
            waiting = self._presence
            self._presence = news if waiting is None else waiting.followed_by(news)
            self.on_news()

    def post_ack(self, seq: int) -> None:
        """Queue an acknowledgement for the client: how many of its edits are handled, and that all
        changes of the document up to the number `seq` were sent to it. Only the newest
        acknowledgement waits in the queue."""
        if self.acks and self.synced:
            says = self.handled, seq
            if says != self._last_ack:
                self._last_ack = self._ack = says
                self.on_news()

    async def take(self) -> list[bytes]:
        """Wait for messages, and return them in order. The next call confirms that they have been sent."""
        self.all_sent()
        while not self.has_news and not self.closed:
            self._news = asyncio.Event()
            await self._news.wait()
        return self.gather()

    def _wake_taker(self) -> None:
        if self._news is not None:
            self._news.set()

    def all_sent(self) -> None:
        """Note that the messages that `gather` took out of the queue were sent. Until then no second
        request for the document is answered, since the first answer is on its way."""
        if self._answer is _SyncState.LEFT:
            self._answer = _SyncState.NONE

    @property
    def has_news(self) -> bool:
        """Return whether any message waits in the send queue."""
        return bool(self._frames or self._presence is not None or self._ack is not None)

    def gather(self) -> list[bytes]:
        """Empty the send queue and return its messages in order."""
        self._taken_at = self._loop.time()
        frames, self._frames = self._frames, []
        self._bytes = 0
        if self._answer is _SyncState.WAITS:
            self._answer = _SyncState.LEFT
        if self._presence is not None:
            frames.append(self._presence.frame)
            self._presence = None
        if self._ack is not None:
            frames.append(messages.acks(*self._ack))
            self._ack = None
        return frames

    def send_heartbeat(self, silence: float) -> None:
        """Send a heartbeat if nothing was sent for `silence` seconds (rule R10)."""
        if self._loop.time() - self._taken_at >= silence:
            self.post(messages.BEAT)

    def edit_received(self) -> None:
        """Count an edit that the socket has sent to the room."""
        self._received += 1

    def used_cpu(self, seconds: float) -> None:
        """Count `seconds` of processor time that an edit of this socket took from the event loop."""
        self._cpu.spend(seconds)

    @property
    def is_over_cpu_budget(self) -> bool:
        """Return whether edits of this socket took more of the loop than their share."""
        return self._cpu.is_overdrawn

    def cpu_debt(self) -> float:
        """Return for how many seconds the socket must not be read, so that others get their share
        of the processor."""
        return self._cpu.debt()

    def edit_handled(self) -> None:
        """Count an edit of this socket that the room has stored or refused."""
        self.handled += 1
        self._wake_reader()

    @property
    def is_far_ahead(self) -> bool:
        """Return whether so many edits of the socket wait in the room that reading has to stop."""
        return self._received - self.handled > _UNHANDLED_EDITS and not self.closed

    async def until_caught_up(self) -> None:
        """Wait while the socket is far ahead of the room."""
        while self.is_far_ahead:
            again = self._caught_up = asyncio.Event()
            await again.wait()

    def _wake_reader(self) -> None:
        if self._caught_up is not None:
            self._caught_up.set()

    def close(self, code: int) -> None:
        """Close the socket with a code. The first code counts."""
        if not self._closed.done():
            self._closed.set_result(code)
            self._wake_reader()
            self.on_news()

    def refuse(self, code: int, text: str | None = None) -> None:
        """Close the socket with a code and text, since the client has sent something that is not
        allowed, and ignore all later messages. If the socket is closed already, its first code and
        text stay."""
        self.refused = True
        self.close_text = self.close_text if self.closed else text
        self.close(code)

    @property
    def closed(self) -> bool:
        """Return whether the socket has been closed, by either side."""
        return self._closed.done()

    async def ended(self) -> int:
        """Wait until the socket is closed, and return the close code."""
        return await asyncio.shield(self._closed)


@lru_cache(64)  # all members that only receive are sent the same
def _framed_acks(handled: int, seq: int) -> bytes:
    return framed(messages.acks(handled, seq))


def _never(_: bytes) -> bool:
    """Return False: the owner of the socket cannot write messages at once."""
    return False
