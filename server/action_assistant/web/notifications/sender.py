"""Sends the messages of the outbox, for each receiver one after the other.

Receivers are spoken to on threads of their own: a slow one delays no other one, nor the event loop,
nor a commit.
"""

import asyncio
import logging
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Sequence
from contextlib import asynccontextmanager, suppress
from typing import Final, ParamSpec, TypeVar

import anyio

from action_assistant.errors import NotFound, TooMany, Unavailable
from action_assistant.journal.journal import Journal
from action_assistant.kit.clock import ClockUs, utc_us
from action_assistant.random_ids import random_id
from action_assistant.web.notifications.delivery import NotDelivered, deliver
from action_assistant.web.notifications.messages import TEST, Message
from action_assistant.web.notifications.outbox import DueMessage, Outbox, ReceiverState
from action_assistant.web.notifications.receivers import Receiver

log: Final = logging.getLogger(__name__)

P = ParamSpec("P")
T = TypeVar("T")

_LOOK_S: Final = 2.0  # between two looks into the outbox
_GAP_S: Final = 0.2  # between two messages to one receiver
_PRUNE_S: Final = 6 * 3600.0
_TRY_S: Final = 40.0  # longer than any try lasts

#: Returns whether everybody may see the graph that a message is about.
SeenByAll = Callable[[Message], Awaitable[bool]]
#: Sends a message to a receiver; the text is the public URL of the page. Blocks; raises NotDelivered.
Deliver = Callable[[Receiver, Message, str], None]


class _OwnFault(NotDelivered):
    """A message that this program could not send by a fault of its own: its receiver stays on."""


class Notifications:
    """The receivers of one process, and the messages to them. `kinds`: those that this process
    sends; `page`: the public URL of the page, "" if there is none; `seen_by_all`: whether the graph of
    a message may be named, asked at each try."""

    def __init__(
        self,
        journal: Journal,
        receivers: Sequence[Receiver],
        kinds: Iterable[str],
        page: str,
        seen_by_all: SeenByAll,
        *,
        clock_us: ClockUs = utc_us,
        deliver: Deliver = deliver,
        look_s: float = _LOOK_S,
        gap_s: float = _GAP_S,
    ) -> None:
        self.outbox: Final = Outbox(journal)
        self.receivers: Final = tuple(receivers)
        self._kinds = tuple(kinds)
        self._page = page
        self._seen_by_all = seen_by_all
        self._clock_us = clock_us
        self._deliver = deliver
        self._look_s = look_s
        self._gap_s = gap_s
        self._testing: set[str] = set()

    @asynccontextmanager
    async def sending(self) -> AsyncIterator[None]:
        """Return a context in which waiting messages are sent. Without receivers nothing is done."""
        if not self.receivers:
            yield
            return
        async with anyio.create_task_group() as tasks:
            for each in self.receivers:
                tasks.start_soon(self._send_all, each)
            tasks.start_soon(self._prune)
            yield
            tasks.cancel_scope.cancel()

    async def states(self) -> list[ReceiverState]:
        """Return the state of each receiver. Raise Unavailable if the journal cannot be read."""
        return await self.outbox.states(self.receivers, self._kinds)

    async def test(self, name: str, person: str) -> ReceiverState:
        """Send a test message to the receiver `name`, and return the state of the receiver. A
        receiver that accepts the test is switched on again, if it was switched off after failures.
        `person`: the name of the person who asks for the test. Raise NotFound if there is no such
        receiver, TooMany while another test of this receiver is under way."""
        receiver = next((each for each in self.receivers if each.name == name), None)
        if receiver is None:
            raise NotFound(f"There is no receiver {name!r}.")
        if name in self._testing:
            raise TooMany("A test of this receiver goes on already.")
        now = self._clock_us()
        facts = {"receiver": name, "person": person or "an owner"}
        message = Message(id=f"test:{random_id()}:{name}", kind=TEST, at=now, facts=facts)
        self._testing.add(name)
        try:
            outcome = await self._try(receiver, message)
        finally:
            self._testing.discard(name)
        error = "" if outcome is None else str(outcome)
        await self.outbox.tested(receiver, message, error, self._clock_us())
        return next(each for each in await self.states() if each.name == name)

    async def _prune(self) -> None:
        while True:
            try:
                await self.outbox.prune(self._clock_us())
            except Unavailable as error:
                log.warning("old messages are not deleted yet: %s", error.detail)
            except Exception:  # no message may end a process, which others need for Stop
                log.exception("old messages cannot be deleted")
            await anyio.sleep(_PRUNE_S)

    async def _send_all(self, receiver: Receiver) -> None:
        while True:
            try:
                await self._send_in_turn(receiver)
            except Exception:  # no message may end a process, which others need for Stop
                log.exception("nothing can be sent to %s now", receiver.name)
            await anyio.sleep(self._look_s)

    async def _send_in_turn(self, receiver: Receiver) -> None:
        """Send the messages to a receiver, one after the other, until cancelled."""
        await self._until_stored(self.outbox.open, self.receivers)
        while True:
            try:
                due = await self.outbox.next(receiver.name, self._clock_us())
                off = "" if due is None else await self.outbox.off(receiver.name)
            except Unavailable:
                due, off = None, ""
            if due is None:
                await anyio.sleep(self._look_s)
            elif off:
                why = f"Not sent: {off}"
                await self._until_stored(self.outbox.give_up, due.message.id, why)
            else:
                await self._send(receiver, due)
                await anyio.sleep(self._gap_s)

    async def _send(self, receiver: Receiver, due: DueMessage) -> None:
        """Try one message, and record the outcome, which is repeated until it is stored. A message
        whose outcome was lost with this process is tried again, under the same id."""
        id_ = due.message.id
        failure = await self._try(receiver, await self._named(due.message))
        now = self._clock_us()
        if failure is None:
            await self._until_stored(self.outbox.sent, id_, now)
            return
        log.warning("%s was not sent to %s: %s", id_, receiver.name, failure)
        # One address that refuses takes the messages from no other one.
        others_took_it = bool(failure.left or due.message.left)
        is_own = isinstance(failure, _OwnFault)
        off = await self._until_stored(
            self.outbox.failed,
            due,
            str(failure),
            now,
            is_final=failure.is_final,
            left=failure.left,
            of=None if others_took_it or is_own else receiver,
        )
        if off:
            log.error("nothing is sent to %s any more: %s", receiver.name, off)

    async def _named(self, message: Message) -> Message:
        """Return a message as it may be sent now: without the name of a graph if not everybody may
        see the graph, or if this cannot be found out. A message about no graph has nothing to hide."""
        if "graph" not in message.facts:
            return message
        try:
            seen = await self._seen_by_all(message)
        except Exception:  # a failed look at rights holds no message back: it names nothing then
            log.exception("it is not known who may see the graph of %s", message.id)
            seen = False
        return message if seen else message.unnamed

    async def _until_stored(
        self, store: Callable[P, Awaitable[T]], *args: P.args, **kw: P.kwargs
    ) -> T:
        """Call `store` until the journal takes it, and return its result."""
        while True:
            try:
                return await store(*args, **kw)
            except Unavailable:
                await anyio.sleep(self._look_s)

    async def _try(self, receiver: Receiver, message: Message) -> NotDelivered | None:
        """Send a message on a thread of its own; return why it was not taken, None if it was."""
        loop = asyncio.get_running_loop()
        done: asyncio.Future[NotDelivered | None] = loop.create_future()

        def settle(outcome: NotDelivered | None) -> None:
            if not done.done():
                done.set_result(outcome)

        def run() -> None:
            outcome: NotDelivered | None = None
            try:
                self._deliver(receiver, message, self._page)
            except NotDelivered as error:
                outcome = error
            except Exception:
                log.exception("a message could not be sent")
                outcome = _OwnFault("This program has failed; its log says why.")
            with suppress(RuntimeError):  # the loop was closed meanwhile
                loop.call_soon_threadsafe(settle, outcome)

        # A daemon: an end of the process does not wait for a slow receiver.
        threading.Thread(target=run, name=f"to {receiver.name}", daemon=True).start()
        try:
            async with asyncio.timeout(_TRY_S):
                return await done
        except TimeoutError:
            return NotDelivered("It did not answer in time.")
