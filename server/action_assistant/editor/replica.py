"""A document in memory that says what each update brought."""

import itertools
import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from enum import Enum
from typing import Any, Final

import anyio
import anyio.lowlevel
import msgspec
from pycrdt import Doc, get_update

from action_assistant.editor.fullness import Fullness
from action_assistant.editor.happenings import DEFERRED, UPDATED
from action_assistant.editor.nesting import Nesting
from action_assistant.editor.scan import Outline, outline
from action_assistant.editor.tail import Damaged, Tail
from action_assistant.editor.wire import NOTHING_NEW, Malformed, Reader
from action_assistant.errors import Unavailable
from action_assistant.journal.events import Event, Snapshot
from action_assistant.journal.journal import Journal

log: Final = logging.getLogger(__name__)

WAITING_BYTES: Final = 4 << 20  # of one author, for something that may never come
WAITING_UPDATES: Final = 256


class Brought(Enum):
    """What an update did to a document."""

    NEWS = "changed it"
    NOTHING = "was known"
    WAITS = "waits for an earlier one"


class Foreign(Exception):
    """An update brings something in the name of a client that belongs to another person."""


class TooMuchWaits(Exception):
    """Of this author so much waits for something earlier that no more is kept."""


class Panicked(Exception):
    """The CRDT library panicked over an update; the document may be damaged."""


class Replica:
    """A Yjs document. Always `close` it: a document that is observed is never freed.

    What waits for an earlier update is held back here: the library loses edits when it holds several
    that wait. So the document never has anything pending. `owners` says whose a client is: that of
    the person who first used it.
    """

    def __init__(self) -> None:
        self.doc: Final[Doc[Any]] = Doc()
        self.owners: dict[int, str] = {}
        self.nesting = Nesting()
        self._fullness = Fullness(self.doc)
        self._known: dict[int, int] = {}
        self._fired = False
        self._waiting: dict[bytes, tuple[Outline, str]] = {}
        self._released: list[bytes] = []
        self._subscription = self.doc.observe(self._observed)

    def take(
        self, update: bytes, author: str, holder: Callable[[int], str | None] = lambda _: None
    ) -> Brought:
        """Apply an update. `holder` may know whose a client is that has written nothing yet.

        Raises Malformed, Foreign, Full, TooMuchWaits, Panicked; the document is then as before.
        """
        if update in self._waiting:
            return Brought.NOTHING
        read = outline(update)
        new = {client for client, _, end in read.brings if end > self._known.get(client, 0)}
        for client in new:
            if (self.owners.get(client) or holder(client) or author) != author:
                raise Foreign(f"client {client} is not {author}'s")
        if new:  # what is known is echoed by stock clients, and adds nothing
            self._fullness.check(update, read)
        if not read.ready(self._known):
            self._check_patience(update, author)
        brought = self._took(update, read, author)
        self.owners.update(dict.fromkeys(new, author))
        return brought

    def replay(self, events: Sequence[Event], *, learn: bool = True) -> None:
        """Apply events of the log in their order. Raises Malformed, Panicked.

        `learn`: also whose each client is and how deep things lie, for a document that goes on.
        """
        for kind, group in itertools.groupby(events, key=lambda event: event.kind):
            if kind not in {UPDATED, DEFERRED}:
                continue
            if learn or kind == DEFERRED or self._waiting:
                self._replay_one_by_one(list(group))
            else:
                self._apply(*(event.body for event in group))
                self._known = clocks(self.doc.get_state())

    def begin(self, state: bytes, owners: dict[int, str], nesting: Nesting) -> None:
        """Take up where a snapshot was made. Raises Malformed, Panicked."""
        self._apply(state)
        self._fullness.took(len(state))
        self.owners, self.nesting = owners, nesting
        self._known = clocks(self.doc.get_state())

    def _replay_one_by_one(self, events: list[Event]) -> None:
        together: list[bytes] = []
        for event in events:
            read = outline(event.body)
            for client, _, _ in read.brings:
                self.owners.setdefault(client, event.author)
            if event.kind == DEFERRED or self._waiting or not read.ready(self._known):
                self._apply(*together)
                together = []
                self._took(event.body, read, event.author)
            else:
                self._learn(read, len(event.body))
                together.append(event.body)
        self._apply(*together)

    def _learn(self, read: Outline, size: int) -> None:
        """What the log holds is not judged again."""
        with suppress(Malformed):
            self.nesting.learn(self.nesting.depths(read.placed, self._known))
        self._count(read, size)

    def _check_patience(self, update: bytes, author: str) -> None:
        sizes = [len(each) for each, (_, whose) in self._waiting.items() if whose == author]
        if len(sizes) >= WAITING_UPDATES or sum(sizes) + len(update) > WAITING_BYTES:
            raise TooMuchWaits

    def _took(self, update: bytes, read: Outline, author: str) -> Brought:
        if not read.ready(self._known):
            self._waiting[update] = read, author
            return Brought.WAITS
        if not self._applied(update, read):
            return Brought.NOTHING
        while self._waiting and self._release():
            pass
        return Brought.NEWS

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
        depths = self.nesting.depths(read.placed, self._known)
        self._apply(update)
        self.nesting.learn(depths)
        self._count(read, len(update))
        return self._fired

    def _count(self, read: Outline, size: int) -> None:
        self._fullness.took(size, read.actions)
        for client, _, end in read.brings:
            self._known[client] = max(end, self._known.get(client, 0))

    def _release(self) -> bool:
        """Apply what has become ready; whether there was any."""
        ready = [each for each, (read, _) in self._waiting.items() if read.ready(self._known)]
        for update in ready:
            read, _ = self._waiting.pop(update)
            try:
                if self._applied(update, read):
                    self._released.append(update)
            except Malformed as error:
                log.warning("an update that waited brings nothing: %s", error)
        return bool(ready)

    def _apply(self, *updates: bytes) -> None:
        if not updates:
            return
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


class Kept(msgspec.Struct, frozen=True, array_like=True):
    """What a snapshot keeps of a document that holds nothing pending."""

    version: int
    owners: dict[int, str]
    spans: dict[int, list[tuple[int, int, int]]]
    state: bytes

    @classmethod
    def of(cls, replica: Replica) -> bytes:
        """As bytes."""
        state = replica.doc.get_update()
        return msgspec.msgpack.encode(cls(1, replica.owners, replica.nesting.spans, state))

    @classmethod
    def replica(cls, kept: bytes) -> Replica | None:
        """The document again; None when these bytes are none of ours."""
        try:
            found = msgspec.msgpack.decode(kept, type=cls)
        except (msgspec.DecodeError, UnicodeDecodeError):
            return None
        replica = Replica()
        try:
            replica.begin(found.state, found.owners, Nesting(found.spans))
        except (Malformed, Panicked):
            replica.close()
            return None
        return replica


class Loaded(msgspec.Struct, frozen=True):
    """A document read from the log, at `seq`. `kept` is the seq of the snapshot it began from.

    `damaged`: the log goes on, and this is why the document does not.
    """

    replica: Replica
    seq: int
    kept: int
    damaged: Damaged | None = None


async def load(
    journal: Journal, stream: str, upto: int | None = None, *, learn: bool | None = None
) -> Loaded:
    """The document of a stream, now or after its event `upto`: snapshot and tail, in slices.

    `learn`: what only editing needs; by default for a document as it is now. Raises Unavailable.
    """
    learn = upto is None if learn is None else learn
    snapshot = await _snapshot(journal, stream)
    replica = None
    if snapshot is not None and (upto is None or snapshot.seq <= upto):
        replica = Kept.replica(snapshot.state)
    start = snapshot.seq if snapshot is not None and replica is not None else 0
    replica = replica or Replica()
    tail = Tail(journal, stream, start, upto)
    while events := await tail.next():
        try:
            replica.replay(events, learn=learn)
        except (Malformed, Panicked):
            replica.close()
            bad = await _first_bad(journal, stream, events)
            good = await load(journal, stream, bad.seq - 1, learn=learn)
            return msgspec.structs.replace(good, damaged=bad)
        await anyio.lowlevel.checkpoint()
    replica.released()
    return Loaded(replica, tail.seq, start, tail.damaged)


async def _snapshot(journal: Journal, stream: str) -> Snapshot | None:
    """The snapshot; none where it cannot even be read, since the log says all that it could."""
    try:
        return await journal.snapshot(stream)
    except Unavailable as error:
        log.warning("%s: no use of the snapshot: %s", stream, error.detail)
        return None


async def _first_bad(journal: Journal, stream: str, events: Sequence[Event]) -> Damaged:
    """Which of these events, that stand as they were written, cannot be applied."""
    loaded = await load(journal, stream, events[0].seq - 1, learn=True)
    try:
        for event in events:
            try:
                loaded.replica.replay([event])
            except (Malformed, Panicked) as error:
                log.error("%s %d cannot be applied: %s", stream, event.seq, error)
                return Damaged(event.seq, str(error))
    finally:
        loaded.replica.close()
    raise Unavailable(f"{stream} reads otherwise each time.")


def clocks(state: bytes) -> dict[int, int]:
    """A state vector as numbers: what is known of each client."""
    reader = Reader(state)
    return {reader.number(): reader.number() for _ in range(reader.number())}
