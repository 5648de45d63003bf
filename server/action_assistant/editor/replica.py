"""A document in memory that says what each update brought."""

from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from typing import Any, Final

import anyio
import anyio.lowlevel
import msgspec
from pycrdt import Doc, get_update, merge_updates

from action_assistant.editor.happenings import UPDATED
from action_assistant.editor.wire import NOTHING_NEW, Malformed, Reader
from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal

_SLICE: Final = 500  # events that are applied before others get a turn


class Brought(Enum):
    """What an update did to a document."""

    NEWS = "changed it"
    NOTHING = "was known"
    WAITS = "waits, in part or whole, for an earlier one"


class Panicked(Exception):
    """The CRDT library panicked over an update; the document may be damaged."""


class Replica:
    """A Yjs document. Always `close` it: a document that is observed is never freed."""

    def __init__(self) -> None:
        self.doc: Final[Doc[Any]] = Doc()
        self._fired = False
        self._waiting: list[bytes] = []
        self._subscription = self.doc.observe(self._observed)

    def take(self, update: bytes) -> Brought:
        """Apply an update. Raises Malformed, Panicked; the document is then as before."""
        check_counts(update)
        if update in self._waiting:
            return Brought.NOTHING
        self._fired = False
        self.apply(update)
        if self.lacks_before(update):
            self._waiting.append(update)
            return Brought.WAITS
        if not self._fired:
            return Brought.NOTHING
        if self._waiting:
            self._waiting = [each for each in self._waiting if self.lacks_before(each)]
        return Brought.NEWS

    def apply(self, *updates: bytes) -> None:
        """Apply updates without asking what they brought. Raises Malformed, Panicked."""
        with _guarded(), self.doc.transaction():
            for update in updates:
                self.doc.apply_update(update)

    def lacks_before(self, update: bytes) -> bool:
        """Whether something that an applied update builds on has not come yet."""
        rest = Reader(get_update(update, self.doc.get_state()))
        if rest.number() > 0:  # clients whose structs could not be placed
            return True
        clients = rest.number()  # of the delete set
        if clients == 0:
            return False
        known = clocks(self.doc.get_state())
        for _ in range(clients):
            end = known.get(rest.number(), 0)
            for _ in range(rest.number()):
                if rest.number() + rest.number() > end:
                    return True
        return False

    def adds_nothing(self, update: bytes) -> bool:
        """Whether an update that was not applied would leave the document as it is."""
        if update == NOTHING_NEW:
            return True
        check_counts(update)
        with _guarded():
            return bool(get_update(update, self.doc.get_state()) == NOTHING_NEW)

    def lacking(self, state: bytes) -> bytes:
        """What somebody with this state vector lacks, with what waits. Raises Malformed, Panicked."""
        if Reader(state).number() * 2 > len(state):
            raise Malformed("more clients than bytes")
        with _guarded():
            update: bytes = self.doc.get_update(state)
            return merge_updates(update, *self._waiting) if self._waiting else update

    @property
    def waiting(self) -> tuple[bytes, ...]:
        """Updates that wait for earlier ones. They are in no state that the document gives out."""
        return tuple(self._waiting)

    def wait_for_missing(self, updates: list[bytes]) -> None:
        """Of updates applied in bulk, remember those that wait."""
        self._waiting += [each for each in updates if self.lacks_before(each)]

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
    """The document of a stream, now or after its event `upto`: snapshot and tail, in slices."""
    kept = await journal.snapshot(stream)
    replica = Replica()
    seq = start = 0
    if kept is not None and (upto is None or kept.seq <= upto):
        try:
            replica.apply(kept.state)
            seq = start = kept.seq
        except (Malformed, Panicked):  # a snapshot is only a cache
            replica.close()
            replica = Replica()
    tail: list[bytes] = []
    while events := await journal.read(stream, after=seq, upto=upto, limit=_SLICE):
        updates = [event.body for event in events if event.kind == UPDATED]
        _replay(replica, updates, events)
        tail += updates
        seq = events[-1].seq
        await anyio.lowlevel.checkpoint()
    for n in range(0, len(tail), _SLICE):
        replica.wait_for_missing(tail[n : n + _SLICE])
        await anyio.lowlevel.checkpoint()
    return Loaded(replica, seq, start)


def _replay(replica: Replica, updates: list[bytes], events: list[Event]) -> None:
    try:
        replica.apply(*updates)
    except Malformed as error:
        replica.close()
        first, last = events[0], events[-1]
        raise Malformed(f"{first.stream} {first.seq}…{last.seq} is damaged: {error}") from error


def clocks(state: bytes) -> dict[int, int]:
    """A state vector as numbers: what is known of each client."""
    reader = Reader(state)
    return {reader.number(): reader.number() for _ in range(reader.number())}


def check_counts(update: bytes) -> None:
    """Refuse counts that the bytes cannot hold: the library allocates before it reads.

    Raises Malformed.
    """
    reader = Reader(update)
    clients = reader.number()
    if clients * 3 > reader.left:
        raise Malformed("more clients than bytes")
    if clients and reader.number() > reader.left:
        raise Malformed("more structs than bytes")
