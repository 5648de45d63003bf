"""Requests that wait in the queue of a room, how they are grouped into batches, and the outcome of a batch."""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Sequence
from contextvars import Context
from typing import Final, NamedTuple, TypeAlias, TypeVar

import msgspec
from pycrdt import merge_updates

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.applying import Panicked
from action_assistant.editor.crdt.document_quota import QuotaExceeded
from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.replica import ForeignClient, Replica, TooMuchWaits
from action_assistant.editor.crdt.trial import OVERLONG, TooSlow, TriedOutline, adds_nothing, tried
from action_assistant.editor.crdt.updates.update_outline import UpdateOutline
from action_assistant.editor.crdt.updates.update_scan import outline
from action_assistant.editor.rooms.member import Member
from action_assistant.errors import BadInput, Overtaken, Refused, TooLarge, Unavailable
from action_assistant.web.auth.caller import Origin, acting_for, origin_of
from action_assistant.web.workers.lanes import Crashed, OutOfTime, RunInWorker

log: Final = logging.getLogger(__name__)

T = TypeVar("T")

LONGEST: Final = 0.01  # seconds; people do not notice it, and a busy room needs a fifth of the work
SHORTEST: Final = 0.001  # seconds in which what people do at the same time arrives
_BUSY: Final = 0.7  # share of its processor that the loop works, from which on windows are longest
_MEASURED_S: Final = 0.1  # over which that share is measured
#: Bytes of an update that is tried on a copy first, and is a batch of its own.
LARGE: Final = 8 * 1024
#: For how long the edits of others may wait at most while the server computes one.
HELD_S: Final = 3.0
CLOSING: Final = "This graph is being closed; try again."
_TOO_LONG: Final = (
    "To work this edit out takes too long to let the edits of others wait; try again."
)
_BATCH_ITEMS: Final = 200  # of one commit
_BATCH_BYTES: Final = 512 * 1024
_CRASHES: Final = 2  # of workers that try an update, after which the update counts as their cause
_MERGED: Final = 50  # updates merged at once; the time for it grows with their square
_MERGED_BYTES: Final = 128 * 1024


class TurnEnd:
    """Calls functions of many rooms and sockets together at the end of a turn of the event loop, in
    the order of registration."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._context = Context()  # the work belongs to no request
        self._work: list[Callable[[], None]] = []

    def do(self, work: Callable[[], None]) -> None:
        """Call `work` once at the end of the present turn of the event loop."""
        if not self._work:
            self._loop.call_soon(self._all, context=self._context)
        self._work.append(work)

    def _all(self) -> None:
        work, self._work = self._work, []
        for each in work:
            try:
                each()
            except Exception:  # a fault in one must not keep the others from running
                log.exception("something failed at the end of a turn")


class BatchWindow:
    """Decides when the rooms of a process act: a millisecond after the first edit, then once per
    window for all edits since, as one transaction, one broadcast and one write to each socket.

    A window lasts `longest` seconds at most; it is shorter, by the square, the more time the event
    loop has to spare. With 0 it opens at every turn of the loop.
    """

    def __init__(self, longest: float = LONGEST) -> None:
        self._longest = longest
        self._shortest = min(SHORTEST, longest)
        self._loop = asyncio.get_running_loop()
        self._next = 0.0
        #: Runs the work of a window, and what is sent because of it.
        self.turn_end: Final = TurnEnd()
        self._waiting: list[Callable[[], None]] = []
        self._looked_at = self._loop.time()
        self._worked = time.thread_time()
        self._length = self._shortest

    def when_open(self, work: Callable[[], None]) -> None:
        """Call `work` when the window opens next, together with all other waiting functions."""
        if not self._longest:
            self.turn_end.do(work)
            return
        if not self._waiting:
            at = max(self._next, self._loop.time() + self._shortest)
            self._loop.call_at(at, self._open)
        self._waiting.append(work)

    def _open(self) -> None:
        now = self._loop.time()
        if now - self._looked_at > _MEASURED_S:
            self._adapt_length(now)
        self._next = now + self._length
        waiting, self._waiting = self._waiting, []
        for work in waiting:
            self.turn_end.do(work)

    def _adapt_length(self, now: float) -> None:
        """Set the length of windows by the share of the time, up to `now` (seconds of the event
        loop), that the loop has worked lately."""
        worked = time.thread_time()
        busy = (worked - self._worked) / (now - self._looked_at)
        self._worked, self._looked_at = worked, now
        self._length = max(self._shortest, self._longest * min(1.0, busy / _BUSY) ** 2)


class SubmittedEdit(msgspec.Struct, frozen=True):
    """An edit that waits in the queue of a room, from a socket (`member`) or from the server itself (`done`
    gets the sequence number after the commit). `at`: when it was received, in seconds of `perf_counter`.
    `origin`: the connection of the author, if it is known. `expected`: the change that has to be the last one
    when the edit is applied; None: any."""

    update: bytes
    author: str
    member: Member | None = None
    done: "asyncio.Future[int] | None" = None
    at: float = msgspec.field(default_factory=time.perf_counter)
    origin: Origin | None = None
    expected: int | None = None


class SyncRequest(msgspec.Struct, frozen=True):
    """A socket asks for the part of the document that it lacks. `state`: its state vector (what it
    has of each Yjs client)."""

    member: Member
    state: bytes


class ComparisonRequest(msgspec.Struct, frozen=True):
    """A socket sends a fingerprint of the document that it shows, and asks whether it is right."""

    member: Member
    shown: messages.CompareMessage


class DocumentState(NamedTuple):
    """A committed document as one Yjs update (`state`), and the number of its last change."""

    seq: int
    state: bytes


class StateRequest(msgspec.Struct, frozen=True):
    """The server asks for the document when all earlier edits are committed."""

    done: "asyncio.Future[DocumentState]"


class NameRequest(msgspec.Struct, frozen=True):
    """The server asks for the name of the graph when all earlier edits are committed."""

    done: "asyncio.Future[str]"


class HeldTurn:
    """A request of the server to compute an edit in the name of `author` while no other edit is
    applied."""

    def __init__(self, author: str) -> None:
        loop = asyncio.get_running_loop()
        self._author = author
        self._done: asyncio.Future[int] = loop.create_future()
        self._begun: asyncio.Future[DocumentState] = loop.create_future()
        self._edit: asyncio.Future[SubmittedEdit] = (
            loop.create_future()
        )  # cancelled if there is none

    async def take(self, compute: Callable[[bytes, int], Awaitable[bytes]]) -> int:
        """Wait for the turn, compute the update in it, and return the number of the edit after its
        commit. Raise what `compute` raises; Overtaken if it takes longer than `HELD_S` seconds."""
        try:
            seq, state = await self._begun
            async with asyncio.timeout(HELD_S):
                update = await compute(state, seq)
            if self._edit.cancelled():
                raise Unavailable(CLOSING)
            origin = origin_of(self._author)
            self._edit.set_result(
                SubmittedEdit(update, self._author, done=self._done, origin=origin, expected=seq)
            )
        except TimeoutError:
            raise Overtaken(_TOO_LONG) from None
        finally:
            self._edit.cancel()  # if there is none: the room goes on
        return await self._done

    async def begin(self, document: DocumentState) -> SubmittedEdit | None:
        """Begin the turn with the document as it is. Return the edit once it is computed; None if
        there is none."""
        if not self._begun.done():  # else the caller has left
            self._begun.set_result(document)
        await asyncio.wait([self._edit])
        return None if self._edit.cancelled() else self._edit.result()

    def end(self, reason: Refused) -> None:
        """Raise `reason` where the server waits for the turn or its edit, or let no edit come of it."""
        if not self._begun.done():
            self._begun.set_exception(reason)
        if not self._edit.cancel() and not self._edit.cancelled():
            fail(self._edit.result(), reason)


ReadRequest: TypeAlias = StateRequest | NameRequest
QueueItem: TypeAlias = SubmittedEdit | SyncRequest | ComparisonRequest | ReadRequest | HeldTurn


class BatchOutcome:
    """The outcome of applying one batch: events to store, updates to send, and requests to answer
    after the commit."""

    def __init__(self) -> None:
        #: Edits to be stored, each with the kind of its event.
        self.to_store: list[tuple[SubmittedEdit, str]] = []
        #: Updates that the members can apply.
        self.to_send: list[bytes] = []
        #: True if `to_send` has updates that waited until now: they go to the author of this batch, too.
        self.authors_lack_some = False
        #: Edits to be acknowledged.
        self.handled: list[SubmittedEdit] = []
        self.sync_requests: list[SyncRequest] = []
        self.comparisons: list[ComparisonRequest] = []
        self.reads: list[ReadRequest] = []
        #: True after a panic of the CRDT library: the document has to be loaded anew.
        self.panicked = False

    def seq_for(self, edit: SubmittedEdit, seq: int) -> int:
        """Return the number that the server code that waits for `edit` gets. `seq`: that of the last
        committed change. An edit with an `expected` change was the first to be stored after it, if
        it was stored."""
        if edit.expected is None:
            return seq
        return edit.expected + any(stored is edit for stored, _ in self.to_store[:1])


class NotAllowed(Exception):
    """A person who may only view sent an edit that would change the document."""


class NotNow(Exception):
    """The machine has no time to try this edit; the client may send it again."""

    def __init__(self, cause: Refused) -> None:
        super().__init__(cause.detail)
        self.cause: Final = cause


#: Reasons to refuse an edit.
Objection: TypeAlias = (
    Malformed
    | ForeignClient
    | QuotaExceeded
    | TooMuchWaits
    | Panicked
    | NotAllowed
    | TooSlow
    | NotNow
)

#: The classes of `Objection` as a tuple, for `except`.
OBJECTIONS: Final = (
    Malformed,
    ForeignClient,
    QuotaExceeded,
    TooMuchWaits,
    Panicked,
    NotAllowed,
    TooSlow,
    NotNow,
)


def refuse(edit: SubmittedEdit, error: Objection) -> None:
    """Refuse an edit for the reason `error`: close its socket with the reason, or raise it in the
    server code that waits for the edit."""
    code, reason, text = _answer(error)
    if edit.member is not None:
        edit.member.refuse(code, text)
    if edit.done is not None and not edit.done.done():
        edit.done.set_exception(reason)


def _answer(error: Objection) -> tuple[int, Refused, str | None]:
    """Return the close code for a socket, the error for server code, and the text of the close,
    None if there is none."""
    match error:
        case Malformed():
            return messages.MALFORMED, BadInput(f"The update cannot be read: {error}."), None
        case Panicked():
            return messages.MALFORMED, BadInput("The update cannot be read."), None
        case ForeignClient():
            reason = BadInput("The update speaks for somebody else.")
            return messages.FORBIDDEN, reason, messages.OTHER_CLIENT
        case QuotaExceeded():
            return messages.FULL, TooLarge(f"The graph is full: {error}."), str(error)
        case TooMuchWaits():
            return messages.TOO_BIG, TooLarge("Too much waits for what never came."), None
        case TooSlow():
            return messages.TOO_BIG, TooLarge(f"{error}."), str(error)
        case NotAllowed():
            return messages.FORBIDDEN, BadInput("Not allowed."), None
        case NotNow():
            return messages.TOO_SLOW, error.cause, "the server is busy, come again"


async def tried_first(
    edit: SubmittedEdit, replica: Replica, run_in_worker: RunInWorker
) -> UpdateOutline | None:
    """Try an edit on a copy of the document (`replica`) in a worker process if that is needed, and
    return its outline. Return None if the outline has to be read again, since in a document with
    nested types it depends on the present neighbours. Raise Malformed, Panicked, TooSlow or
    QuotaExceeded for a bad edit, NotNow if the trial itself fails."""
    read = None if len(edit.update) > LARGE else outline(edit.update)
    released = [] if read is None else replica.freed_by(read)
    freed = sum(map(len, released))
    small = read is not None and freed <= LARGE
    if small and not replica.opening.is_doubtful_with(len(edit.update) + freed):
        return read
    state = replica.state()
    waiting = replica.waiting if read is None else released
    found = await tried_for(edit.author, run_in_worker, state, edit.update, waiting)
    replica.opening.opened(found.opening, len(state))
    replica.opening.refuse(found)
    return None if replica.nesting.spans else found


def fail(item: QueueItem, reason: Refused) -> None:
    """Raise `reason` where the server waits for this item. Sockets are closed by the room."""
    match item:
        case HeldTurn():
            item.end(reason)
        case SubmittedEdit(done=done) | StateRequest(done) | NameRequest(done):
            if done is not None and not done.done():
                done.set_exception(reason)


async def tried_for(
    person: str,
    run_in_worker: RunInWorker,
    state: bytes,
    update: bytes,
    released: Sequence[bytes] = (),
) -> TriedOutline:
    """Try an update on a document of this state in a worker process, and after it the updates that
    waited for it (`released`); return its outline. `person`: on whose account the worker's time
    goes. Raise Malformed, Panicked or TooSlow for a bad update, NotNow if the trial itself fails.
    """
    return await _done_for(person, run_in_worker, tried, state, update, released)


async def adds_nothing_aside(edit: SubmittedEdit, state: bytes, run_in_worker: RunInWorker) -> bool:
    """Return whether a large edit would change nothing in a document with the state vector `state`;
    it is examined in a worker process. Raise Malformed, Panicked or TooSlow for a bad edit, NotNow
    if the examination itself fails."""
    return await _done_for(edit.author, run_in_worker, adds_nothing, state, edit.update)


async def _done_for(
    person: str, run_in_worker: RunInWorker, work: Callable[..., T], *arguments: object
) -> T:
    crashes = 0
    while True:
        try:
            with acting_for(person):
                return await run_in_worker(work, *arguments)
        except OutOfTime as error:
            raise TooSlow(OVERLONG) from error
        except Crashed as error:
            crashes += 1
            if crashes == _CRASHES:  # the first one may have lacked memory
                raise Malformed("an update that ends the process") from error
        except TooLarge as error:
            raise TooSlow(f"This change cannot be taken: {error.detail}") from error
        except Refused as error:
            raise NotNow(error) from error


def batch_of(
    items: list[QueueItem], *, one: bool = False
) -> tuple[list[QueueItem], list[QueueItem]]:
    """Return the items of the next commit, and the remaining items. A batch is small enough for
    clients that read in time; a large update and a held turn are batches of their own; with `one`
    every item is."""
    size = count = 0
    for item in items[: 1 if one else _BATCH_ITEMS]:
        own = len(item.update) if isinstance(item, SubmittedEdit) else 0
        is_alone = own > LARGE or isinstance(item, HeldTurn)
        size += own
        if count and (size > _BATCH_BYTES or is_alone):
            break
        count += 1
        if is_alone:
            break
    return items[:count], items[count:]


def before_doubt(items: Sequence[QueueItem], is_doubtful: Callable[[int], bool]) -> int:
    """Return how many items, counted from the first, can be applied before it is in doubt whether
    the document still opens in time. `is_doubtful` is called with a number of bytes."""
    size = 0
    for n, item in enumerate(items):
        if isinstance(item, SubmittedEdit):
            size += len(item.update)
            if is_doubtful(size):
                return n
    return len(items)


def next_batch(
    waiting: list[QueueItem], replica: Replica
) -> tuple[list[QueueItem], list[QueueItem], bool]:
    """Return the next batch of the `waiting` items, the remaining items, and whether the batch is
    one edit that has to be tried on a copy of the document (`replica`) first."""
    match waiting:  # nearly always
        case [SubmittedEdit(update)] if (
            len(update) <= LARGE
            and not replica.waits
            and not replica.opening.is_doubtful_with(len(update))
        ):
            return waiting, [], False
    much_waits = replica.waiting_bytes > LARGE
    batch, rest = batch_of(waiting, one=much_waits)
    freed = min(replica.waiting_bytes, LARGE)  # an edit that could free more is a batch of its own
    sure = before_doubt(batch, lambda size: replica.opening.is_doubtful_with(size + freed))
    count = max(sure, 1)
    rest = [*batch[count:], *rest]
    match batch[:count]:
        case [SubmittedEdit(update)] as alone if much_waits or not sure or len(update) > LARGE:
            return alone, rest, True
        case several:
            return several, rest, False


def merged(updates: list[bytes]) -> list[bytes]:
    """Return fewer updates with the same effect, none so large that a client that sends it back
    would be refused."""
    groups: list[list[bytes]] = []
    size = 0
    for update in updates:
        size += len(update)
        if not groups or len(groups[-1]) >= _MERGED or size > _MERGED_BYTES:
            groups.append([])
            size = len(update)
        groups[-1].append(update)
    return [merge_updates(*group) if len(group) > 1 else group[0] for group in groups]
