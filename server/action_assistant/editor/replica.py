"""A document in memory that says what each update brought."""

import itertools
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from typing import Any, Final

import anyio
import anyio.lowlevel
import msgspec
from pycrdt import Doc, get_update

from action_assistant.editor.happenings import DEFERRED, UPDATED
from action_assistant.editor.scan import Outline, outline
from action_assistant.editor.wire import NOTHING_NEW, Malformed, Reader
from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal

log: Final = logging.getLogger(__name__)

_SLICE: Final = 500  # events that are applied before others get a turn


class Brought(Enum):
    """What an update did to a document."""

    NEWS = "changed it"
    NOTHING = "was known"
    WAITS = "waits for an earlier one"


class Panicked(Exception):
    """The CRDT library panicked over an update; the document may be damaged."""


class Replica:
    """A Yjs document. Always `close` it: a document that is observed is never freed.

    What waits for an earlier update is held back here: the library loses edits when it holds several
    that wait. So the document never has anything pending.
    """

    def __init__(self) -> None:
        self.doc: Final[Doc[Any]] = Doc()
        self._known: dict[int, int] = {}
        self._fired = False
        self._waiting: dict[bytes, Outline] = {}
        self._released: list[bytes] = []
        self._subscription = self.doc.observe(self._observed)

    def take(self, update: bytes) -> Brought:
        """Apply an update. Raises Malformed, Panicked; the document is then as before."""
        if update in self._waiting:
            return Brought.NOTHING
        read = outline(update)
        if not read.ready(self._known):
            self._waiting[update] = read
            return Brought.WAITS
        if not self._applied(update, read):
            return Brought.NOTHING
        while self._waiting and self._release():
            pass
        return Brought.NEWS

    def replay(self, updates: list[bytes]) -> None:
        """Apply updates that once were news, in that order. Raises Malformed, Panicked."""
        if self._waiting:
            for update in updates:
                self.take(update)
            return
        self._apply(*updates)
        self._known = clocks(self.doc.get_state())

    def released(self) -> list[bytes]:
        """Updates that waited and do not any more, since this was asked last."""
        released, self._released = self._released, []
        return released

    @property
    def waiting(self) -> tuple[bytes, ...]:
        """Updates that wait for earlier ones."""
        return tuple(self._waiting)

    def _applied(self, update: bytes, read: Outline) -> bool:
        """Apply what is ready; whether it changed anything."""
        self._fired = False
        self._apply(update)
        for client, _, end in read.brings:
            self._known[client] = max(end, self._known.get(client, 0))
        return self._fired

    def _release(self) -> bool:
        """Apply what has become ready; whether there was any."""
        ready = [each for each, read in self._waiting.items() if read.ready(self._known)]
        for update in ready:
            read = self._waiting.pop(update)
            try:
                if self._applied(update, read):
                    self._released.append(update)
            except Malformed as error:
                log.warning("an update that waited brings nothing: %s", error)
        return bool(ready)

    def _apply(self, *updates: bytes) -> None:
        with _guarded(), self.doc.transaction():
            for update in updates:
                self.doc.apply_update(update)

    def adds_nothing(self, update: bytes) -> bool:
        """Whether an update that was not applied would leave the document as it is."""
        if update == NOTHING_NEW:
            return True
        outline(update)
        with _guarded():
            return bool(get_update(update, self.doc.get_state()) == NOTHING_NEW)

    def lacking(self, state: bytes) -> bytes:
        """What somebody with this state vector lacks. Raises Malformed, Panicked."""
        if Reader(state).number() * 2 > len(state):
            raise Malformed("more clients than bytes")
        with _guarded():
            return self.doc.get_update(state)

    def close(self) -> None:
        """Let the document be freed."""
        self.doc.unobserve(self._subscription)

    def _observed(self, event: object) -> None:
        update: bytes = event.update  # type: ignore[attr-defined]
        if update != NOTHING_NEW:
            self._fired = True


@contextmanager
def _guarded() -> Iterator[None]:
    """Around a call of the CRDT library with foreign bytes, and nothing else."""
    try:
        yield
    except (ValueError, RuntimeError) as error:
        raise Malformed(f"not a Yjs update: {error}") from error
    except BaseException as error:
        if type(error).__name__ != "PanicException":  # pyo3's, derived from BaseException
            raise
        raise Panicked(str(error)) from error


class Loaded(msgspec.Struct, frozen=True):
    """A document read from the log, at `seq`. `kept` is the seq of the snapshot it began from."""

    replica: Replica
    seq: int
    kept: int


async def load(journal: Journal, stream: str, upto: int | None = None) -> Loaded:
    """The document of a stream, now or after its event `upto`: snapshot and tail, in slices.

    Raises Malformed when the log holds what cannot be applied.
    """
    kept = await journal.snapshot(stream)
    replica = Replica()
    seq = start = 0
    if kept is not None and (upto is None or kept.seq <= upto):
        try:
            replica.replay([kept.state])
            seq = start = kept.seq
        except (Malformed, Panicked):  # a snapshot is only a cache
            replica.close()
            replica = Replica()
    while events := await journal.read(stream, after=seq, upto=upto, limit=_SLICE):
        try:
            _replay(replica, events)
        except (Malformed, Panicked) as error:
            replica.close()
            first, last = events[0].seq, events[-1].seq
            raise Malformed(f"{stream} {first}…{last} is damaged: {error}") from error
        seq = events[-1].seq
        await anyio.lowlevel.checkpoint()
    replica.released()
    return Loaded(replica, seq, start)


def _replay(replica: Replica, events: list[Event]) -> None:
    for kind, group in itertools.groupby(events, key=lambda event: event.kind):
        bodies = [event.body for event in group]
        if kind == UPDATED:
            replica.replay(bodies)
        elif kind == DEFERRED:
            for body in bodies:
                replica.take(body)


def clocks(state: bytes) -> dict[int, int]:
    """A state vector as numbers: what is known of each client."""
    reader = Reader(state)
    return {reader.number(): reader.number() for _ in range(reader.number())}
