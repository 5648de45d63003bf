"""Appends the events of a stream in order, in the background: nobody waits for the journal.

Facts about robots are shown first and stored at once. When the journal fails, `recorded` is false
and the appender goes on trying with the same events, in the same order.
"""

import logging
from collections import deque
from collections.abc import Callable, Sequence
from typing import Final, Protocol

import anyio

from action_assistant.errors import Conflict, Refused
from action_assistant.journal.events import Draft, Event
from action_assistant.runner.runs.events import RunEvent, draft_of

log: Final = logging.getLogger(__name__)

_PAUSES: Final = (0.05, 0.2, 0.5, 1.0, 2.0)  # seconds between attempts
_BATCH: Final = 500  # events in one transaction
_AT_THE_END_S: Final = 1.0  # for what is left when writing is cancelled


class Store(Protocol):
    """The parts of a journal that the recording of runs uses."""

    async def append(
        self, stream: str, drafts: Sequence[Draft], *, expected: int | None = None
    ) -> int:
        """Store drafts at the end of a stream, and return the seq of the last draft. Raise Conflict
        if the stream does not end at `expected`, Unavailable if the journal cannot store
        anything."""
        ...

    async def read(
        self, stream: str, *, after: int = 0, upto: int | None = None, limit: int | None = None
    ) -> list[Event]:
        """Return the events of a stream with `after` < seq ≤ `upto`, in order, at most `limit`;
        None for `upto` or `limit` sets no bound."""
        ...

    async def newest(self, stream: str) -> int:
        """Return the last seq of a stream; 0 when it is empty."""
        ...


def stream_of(run: str) -> str:
    """Return the name of the stream of a run."""
    return f"run/{run}"


class StreamAppender:
    """Appends events to one stream in the background. `seq`: the number of the last stored event,
    negative while unknown. `changed` is called after each change of `seq` or `recorded`."""

    def __init__(
        self, store: Store, stream: str, seq: int, changed: Callable[[], None] = lambda: None
    ) -> None:
        self.seq = seq
        self.recorded = True
        self._store = store
        self._stream = stream
        self._changed = changed
        self._waiting: deque[Draft] = deque()
        self._more = anyio.Event()
        self._done = anyio.Event()

    def add(self, draft: Draft) -> None:
        """Queue an event for storing. The call does not wait."""
        self._waiting.append(draft)
        self._more.set()

    @property
    def idle(self) -> bool:
        """True if every added event is stored."""
        return not self._waiting

    @property
    def waiting(self) -> int:
        """The number of events that are not stored yet."""
        return len(self._waiting)

    async def flushed(self) -> None:
        """Wait until all events added so far are stored."""
        while self._waiting:
            await self._done.wait()

    async def find_end(self) -> None:
        """Ask the journal for the end of the stream, again and again until it answers."""
        failures = 0
        while True:
            try:
                self.seq = await self._store.newest(self._stream)
            except Refused as refused:
                self._failed(refused.detail)
                await anyio.sleep(_PAUSES[min(failures, len(_PAUSES) - 1)])
                failures += 1
            else:
                return

    async def run(self) -> None:
        """Store queued events until cancelled; then try for one more second to store those that are
        left."""
        try:
            while True:
                await self._more.wait()
                self._more = anyio.Event()
                await self._write_all()
        except anyio.get_cancelled_exc_class():
            if self._waiting:
                with anyio.move_on_after(_AT_THE_END_S, shield=True):
                    await self._write_all()
            if self._waiting:
                log.error("%s lacks its last %d events", self._stream, len(self._waiting))
            raise

    async def _write_all(self) -> None:
        """Write all waiting events, with retries until the journal stores them."""
        if self.seq < 0:
            await self.find_end()
        failures = 0
        while self._waiting:
            if await self._write():
                failures = 0
            else:
                await anyio.sleep(_PAUSES[min(failures, len(_PAUSES) - 1)])
                failures += 1

    async def _write(self) -> bool:
        """Store one batch of events in a transaction; return whether it is stored. If the result of
        an earlier attempt got lost, the number of the last event that is expected (`expected`)
        prevents a second copy."""
        batch = [self._waiting[i] for i in range(min(len(self._waiting), _BATCH))]
        try:
            try:
                seq = await self._store.append(self._stream, batch, expected=self.seq)
            except Conflict:
                seq = await self._store.newest(self._stream)
                if not self.seq < seq <= self.seq + len(batch):
                    raise
        except Refused as refused:
            self._failed(refused.detail)
            return False
        except Exception as error:
            log.exception("the journal of the runner failed")
            self._failed(str(error))
            return False
        for _ in range(seq - self.seq):
            self._waiting.popleft()
        self.seq, self.recorded = seq, True
        self._done.set()
        self._done = anyio.Event()
        self._changed()
        return True

    def _failed(self, why: str) -> None:
        if self.recorded:
            log.error("%s is not being recorded: %s", self._stream, why)
        self.recorded = False
        self._changed()


class RunRecorder(StreamAppender):
    """Appends the events of one run."""

    def __init__(
        self, store: Store, run: str, seq: int, changed: Callable[[], None] = lambda: None
    ) -> None:
        super().__init__(store, stream_of(run), seq, changed)

    def put(self, event: RunEvent, author: str) -> None:
        """Queue an event of the run for storing. `author`: the id of a person, "" for the engine."""
        self.add(draft_of(event, author))
