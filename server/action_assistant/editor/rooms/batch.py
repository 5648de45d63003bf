"""What enters a room, and the outcome of a batch of it."""

import asyncio
import time
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeAlias, TypeVar

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
from action_assistant.errors import BadInput, Refused, TooLarge
from action_assistant.web.auth.caller import acting_for
from action_assistant.web.workers.lanes import Crashed, OutOfTime, RunInWorker

T = TypeVar("T")

LARGE: Final = 8 * 1024  # bytes of an update that is tried on a copy first, and by itself
_BATCH: Final = 200  # items of one commit
_BATCH_BYTES: Final = 512 * 1024
_DEATHS: Final = 2  # of processes that try an update, until it is taken for the cause
_MERGED: Final = 50  # updates merged at once; merging more costs their square
_MERGED_BYTES: Final = 128 * 1024


class Offer(msgspec.Struct, frozen=True):
    """An edit on its way in: from a socket, or from the server itself (`done` is told). `at`: when it
    came, by the clock of performance counters."""

    update: bytes
    author: str
    member: Member | None = None
    done: "asyncio.Future[int] | None" = None
    at: float = msgspec.field(default_factory=time.perf_counter)


class Ask(msgspec.Struct, frozen=True):
    """A socket wants what it lacks."""

    member: Member
    state: bytes


class Compare(msgspec.Struct, frozen=True):
    """A socket says what it shows, and wants to know whether that is right."""

    member: Member
    shown: messages.CompareMessage


class Look(msgspec.Struct, frozen=True):
    """Somebody wants to see the document at a moment when all of it is committed."""

    see: Callable[[Replica, int], Any]
    done: "asyncio.Future[Any]"


Item: TypeAlias = Offer | Ask | Compare | Look


class Taken:
    """What became of a batch."""

    def __init__(self) -> None:
        self.news: list[tuple[Offer, str]] = []  # to be stored, as which kind
        self.shown: list[bytes] = []  # what the others can make use of
        self.for_all = False  # something that waited is among it
        self.handled: list[Offer] = []
        self.asks: list[Ask] = []
        self.compares: list[Compare] = []
        self.looks: list[Look] = []
        self.panicked = False


class NotAllowed(Exception):
    """The edit of somebody who may only look."""


class NotNow(Exception):
    """The machine has no time for this edit; whoever sends it again may have more luck."""

    def __init__(self, cause: Refused) -> None:
        super().__init__(cause.detail)
        self.cause: Final = cause


#: Why an edit was not taken.
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

#: All of them, to be caught.
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


def refuse(offer: Offer, error: Objection) -> None:
    """Take nothing of an offer: its socket is closed, or whoever waits for it is told."""
    code, reason, said = _answer(error)
    if offer.member is not None:
        offer.member.refuse(code, said)
    if offer.done is not None and not offer.done.done():
        offer.done.set_exception(reason)


def _answer(error: Objection) -> tuple[int, Refused, str | None]:
    """The close code, the refusal, and what a socket is told beside the code."""
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


async def tried_first(offer: Offer, replica: Replica, tried: RunInWorker) -> UpdateOutline | None:
    """Its outline; None where it has to be read again, since in a document with depth also what
    lies beside something deep counts. Raises Malformed, Panicked, TooSlow, NotNow, QuotaExceeded."""
    read = None if len(offer.update) > LARGE else outline(offer.update)
    released = [] if read is None else replica.freed_by(read)
    freed = sum(map(len, released))
    small = read is not None and freed <= LARGE
    if small and not replica.opening.is_doubtful_with(len(offer.update) + freed):
        return read
    state = replica.state()
    waiting = replica.waiting if read is None else released
    found = await tried_for(offer.author, tried, state, offer.update, waiting)
    replica.opening.opened(found.opening, len(state))
    replica.opening.refuse(found)
    return None if replica.nesting.spans else found


def fail(item: Item, reason: Refused) -> None:
    """Tell whoever waits for it that it will not be done."""
    if isinstance(item, Ask | Compare) or item.done is None or item.done.done():
        return
    item.done.set_exception(reason)


async def tried_for(
    person: str,
    run_in_worker: RunInWorker,
    state: bytes,
    update: bytes,
    released: Sequence[bytes] = (),
) -> TriedOutline:
    """The outline of an update that may be applied to a document of this state, and after it the
    updates that waited for it.

    Raises Malformed, Panicked, TooSlow; NotNow for what does not lie in the update.
    """
    return await _done_for(person, run_in_worker, tried, state, update, released)


async def adds_nothing_aside(offer: Offer, state: bytes, run_in_worker: RunInWorker) -> bool:
    """As `adds_nothing`: reading a large update takes long. Raises as `tried_for`."""
    return await _done_for(offer.author, run_in_worker, adds_nothing, state, offer.update)


async def _done_for(
    person: str, run_in_worker: RunInWorker, work: Callable[..., T], *arguments: object
) -> T:
    died = 0
    while True:
        try:
            with acting_for(person):
                return await run_in_worker(work, *arguments)
        except OutOfTime as error:
            raise TooSlow(OVERLONG) from error
        except Crashed as error:
            died += 1
            if died == _DEATHS:  # one may have been for want of memory
                raise Malformed("an update that ends the process") from error
        except TooLarge as error:
            raise TooSlow(f"This change cannot be taken: {error.detail}") from error
        except Refused as error:
            raise NotNow(error) from error


def batch_of(items: list[Item], *, one: bool = False) -> tuple[list[Item], list[Item]]:
    """What one commit takes, and the rest. Small enough for readers that keep up; a large update is
    alone; with `one` each is."""
    size = count = 0
    for item in items[: 1 if one else _BATCH]:
        own = len(item.update) if isinstance(item, Offer) else 0
        size += own
        if count and (size > _BATCH_BYTES or own > LARGE):
            break
        count += 1
        if own > LARGE:
            break
    return items[:count], items[count:]


def before_doubt(items: Sequence[Item], is_doubtful: Callable[[int], bool]) -> int:
    """How many of these, from the first one on, may be taken together without doubt that the document
    can be opened soon enough after them. `is_doubtful` is asked with a number of bytes."""
    size = 0
    for n, item in enumerate(items):
        if isinstance(item, Offer):
            size += len(item.update)
            if is_doubtful(size):
                return n
    return len(items)


def next_batch(waiting: list[Item], replica: Replica) -> tuple[list[Item], list[Item], bool]:
    """What is taken next, what then waits, and whether the one is an edit that has to be tried first."""
    match waiting:  # nearly always
        case [Offer(update)] if (
            len(update) <= LARGE
            and not replica.waits
            and not replica.opening.is_doubtful_with(len(update))
        ):
            return waiting, [], False
    much_waits = replica.waiting_bytes > LARGE
    batch, rest = batch_of(waiting, one=much_waits)
    freed = min(replica.waiting_bytes, LARGE)  # what more than that frees is looked at alone
    sure = before_doubt(batch, lambda size: replica.opening.is_doubtful_with(size + freed))
    count = max(sure, 1)
    rest = [*batch[count:], *rest]
    match batch[:count]:
        case [Offer(update)] as alone if much_waits or not sure or len(update) > LARGE:
            return alone, rest, True
        case several:
            return several, rest, False


def merged(updates: list[bytes]) -> list[bytes]:
    """The same changes in few updates; none so large that a client that echoes would be refused."""
    groups: list[list[bytes]] = []
    size = 0
    for update in updates:
        size += len(update)
        if not groups or len(groups[-1]) >= _MERGED or size > _MERGED_BYTES:
            groups.append([])
            size = len(update)
        groups[-1].append(update)
    return [merge_updates(*group) if len(group) > 1 else group[0] for group in groups]
