"""The outbox: messages that wait, were sent or were given up, in the database of each process.

A row is written in the transaction of the event that causes the message, so nothing is sent that is
not stored, and nothing that is stored is forgotten. Its id is `stream:seq:receiver`.
"""

import logging
from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Any, Final, Literal
from urllib.parse import quote

import msgspec
from sqlalchemy import Connection, delete, func, insert, select, update

from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal
from action_assistant.kit.moments import moment
from action_assistant.schema import editor_tables
from action_assistant.web.notifications.messages import Message
from action_assistant.web.notifications.receivers import Receiver, Webhook, target_of

log: Final = logging.getLogger(__name__)

#: Seconds between the tries of a message; after the last one it is given up.
RETRIES_S: Final = (5, 300, 1_800, 7_200, 18_000, 36_000, 36_000)
_KEPT_US: Final = 30 * 24 * 3600 * 1_000_000  # after which a finished message is deleted
#: After which nobody wants to hear of it at all, as after a server was off for long.
_TOO_OLD_US: Final = 7 * 24 * 3600 * 1_000_000
_S: Final = 1_000_000
_GIVEN_UP: Final = "Its last try has failed, too; nothing is sent any more."
_LEFT: Final = "left"  # beside the facts of a row: `Message.left`

# The tables are the same for both branches.
_outbox, _off = editor_tables.outbox, editor_tables.receiver
_c = _outbox.c


class ReceiverState(msgspec.Struct, frozen=True, kw_only=True):
    """A receiver, and how it went. `to`: its host, or mail addresses; `kinds`: of messages that this
    process sends to it; `off`: why nothing is sent to it any more, "" if it is on; `waiting`: messages
    that are tried again; `failed`: messages that were given up in the last 30 days; `error`: the
    reason of the newest failure, "" if the newest try went well."""

    name: str
    way: Literal["webhook", "mail"]
    to: str
    kinds: tuple[str, ...]
    off: str = ""
    off_at: datetime | None = None
    sent_at: datetime | None = None
    tried_at: datetime | None = None
    error: str = ""
    waiting: int = 0
    failed: int = 0


class DueMessage(msgspec.Struct, frozen=True):
    """A message that is to be tried now. `tries`: how often it was tried before."""

    message: Message
    tries: int


def id_of(event: Event, receiver: str) -> str:
    """Return the id of the message to a receiver about an event. It is ASCII without a point, which
    separates the id in what a webhook signs."""
    stream = quote(event.stream, safe="/").replace(".", "%2E")
    return f"{stream}:{event.seq}:{receiver}"


def row(
    id_: str, receiver: str, kind: str, subject: str, at: int, facts: object
) -> dict[str, object]:
    """Return the values of a new row of the outbox, except for facts that are a query (`facts`)."""
    text = msgspec.json.encode(facts).decode() if isinstance(facts, dict) else facts
    return {
        "id": id_,
        "receiver": receiver,
        "kind": kind,
        "subject": subject,
        "at": at,
        "facts": text,
        "due": at,
        "tries": 0,
        "error": "",
    }


class Outbox:
    """Reads and updates the outbox of a journal. Methods raise Unavailable while the journal cannot
    be read or written."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal

    async def open(self, receivers: Iterable[Receiver]) -> None:
        """Switch receivers on again whose address has changed, and give up messages for receivers
        that the setting does not name any more."""
        targets = {each.name: target_of(each) for each in receivers}

        def begin(connection: Connection) -> None:
            for name, target in connection.execute(select(_off.c.name, _off.c.target)).all():
                if targets.get(name) != target:
                    connection.execute(delete(_off).where(_off.c.name == name))
            gone = update(_outbox).where(_c.due.is_not(None), _c.receiver.not_in(targets))
            connection.execute(gone.values(due=None, error="The setting names no such receiver."))

        await self._journal.derive(begin)

    async def next(self, receiver: str, now: int) -> DueMessage | None:
        """Return the message for a receiver that is due for the longest time; None if none is. One
        that cannot be read is given up. `now`: microseconds UTC."""
        chosen = (
            select(_c.id, _c.kind, _c.at, _c.facts, _c.tries)
            .where(_c.receiver == receiver, _c.due <= now)
            .order_by(_c.due, _c.id)
            .limit(1)
        )
        rows = await self._journal.query(chosen)
        if not rows:
            return None
        found = rows[0]
        try:
            facts = msgspec.json.decode(found.facts, type=dict[str, Any])
        except (ValueError, RecursionError) as error:
            log.error("the message %s cannot be read: %s", found.id, error)
            await self.give_up(found.id, "It cannot be read.")
            return None
        kept = facts.pop(_LEFT, [])
        left = tuple(map(str, kept)) if isinstance(kept, list) else ()
        message = Message(id=found.id, kind=found.kind, at=found.at, facts=facts, left=left)
        return DueMessage(message, found.tries)

    async def off(self, receiver: str) -> str:
        """Return why nothing is sent to a receiver; "" if it is on."""
        rows = await self._journal.query(select(_off.c.why).where(_off.c.name == receiver))
        return rows[0].why if rows else ""

    async def sent(self, id_: str, now: int) -> None:
        """Record that a message was taken."""
        values = {"due": None, "tried_at": now, "sent_at": now, "error": ""}
        await self._change(id_, tries=_c.tries + 1, **values)

    async def failed(
        self,
        due: DueMessage,
        why: str,
        now: int,
        *,
        is_final: bool = False,
        left: tuple[str, ...] = (),
        of: Receiver | None = None,
    ) -> str:
        """Record that a try has failed, and when the next one is. If there is none, since that was
        the last one (`is_final`: in any case), nothing is sent to the receiver `of` from now on.
        Return why it was switched off, "" if it was not.

        `why`: a sentence; `now`: microseconds UTC; `left`: the mail addresses that have refused the
        message while others took it, and that alone get it again; `of`: None where a failure of this
        message says nothing against its receiver."""
        is_last = is_final or due.tries >= len(RETRIES_S)
        again = None if is_last else now + RETRIES_S[due.tries] * _S
        values: dict[str, object] = {"tries": due.tries + 1, "due": again, "tried_at": now}
        if left:
            facts = {**due.message.facts, _LEFT: left}
            values |= {"facts": msgspec.json.encode(facts).decode(), "sent_at": now}
        change = update(_outbox).where(_c.id == due.message.id).values(**values, error=why)
        reason = why if is_final else f"{why} {_GIVEN_UP}"

        def keep(connection: Connection) -> None:
            connection.execute(change)
            if is_last and of is not None:
                _switch_off(connection, of, reason, now)

        # In one transaction: no message after the last try is tried once more.
        await self._journal.derive(keep)
        return reason if is_last and of is not None else ""

    async def give_up(self, id_: str, why: str) -> None:
        """Record that a message is not tried any more. `why`: a sentence."""
        await self._change(id_, due=None, error=why)

    async def tested(self, receiver: Receiver, message: Message, error: str, now: int) -> None:
        """Record the outcome of a test. A receiver that has taken it is on again. `error`: the reason
        of a failure, "" for none."""
        values = row(message.id, receiver.name, message.kind, "test", message.at, message.facts)
        values |= {"due": None, "tries": 1, "tried_at": now, "error": error}
        values["sent_at"] = None if error else now

        def keep(connection: Connection) -> None:
            connection.execute(insert(_outbox).values(values))
            if not error:
                connection.execute(delete(_off).where(_off.c.name == receiver.name))

        await self._journal.derive(keep)

    async def prune(self, now: int) -> None:
        """Delete finished messages that are old, and give up unsent ones that are too old."""

        def drop(connection: Connection) -> None:
            old = update(_outbox).where(_c.due.is_not(None), _c.at < now - _TOO_OLD_US)
            connection.execute(old.values(due=None, error="It was too old to be sent."))
            connection.execute(delete(_outbox).where(_c.due.is_(None), _c.at < now - _KEPT_US))

        await self._journal.derive(drop)

    async def states(
        self, receivers: Sequence[Receiver], kinds: Iterable[str]
    ) -> list[ReceiverState]:
        """Return the state of each receiver. `kinds`: those that this process sends."""
        of_process = frozenset(kinds)

        def read(connection: Connection) -> list[ReceiverState]:
            off = {each.name: each for each in connection.execute(select(_off)).all()}
            return [_state(connection, each, of_process, off.get(each.name)) for each in receivers]

        return await self._journal.ask(read)

    async def _change(self, id_: str, **values: Any) -> None:
        change = update(_outbox).where(_c.id == id_).values(values)
        await self._journal.derive(lambda connection: connection.execute(change))


def _switch_off(connection: Connection, receiver: Receiver, why: str, now: int) -> None:
    values = {"name": receiver.name, "target": target_of(receiver), "off_at": now, "why": why}
    connection.execute(delete(_off).where(_off.c.name == receiver.name))
    connection.execute(insert(_off).values(values))


def _state(
    connection: Connection, receiver: Receiver, kinds: frozenset[str], off: Any
) -> ReceiverState:
    mine = _c.receiver == receiver.name
    newest = select(_c.tried_at, _c.error).where(mine, _c.tried_at.is_not(None))
    last = connection.execute(newest.order_by(_c.tried_at.desc()).limit(1)).first()
    sent = connection.scalar(select(func.max(_c.sent_at)).where(mine))
    waiting = select(func.count()).where(mine, _c.due.is_not(None), _c.tries > 0)
    given_up = select(func.count()).where(
        mine, _c.due.is_(None), _c.sent_at.is_(None), _c.kind != "test"
    )
    return ReceiverState(
        name=receiver.name,
        way="webhook" if isinstance(receiver, Webhook) else "mail",
        to=receiver.shown,
        kinds=tuple(sorted(receiver.kinds & kinds)),
        off="" if off is None else off.why,
        off_at=None if off is None else moment(off.off_at),
        sent_at=None if sent is None else moment(sent),
        tried_at=None if last is None else moment(last.tried_at),
        error="" if last is None else last.error,
        waiting=connection.scalar(waiting) or 0,
        failed=connection.scalar(given_up) or 0,
    )
