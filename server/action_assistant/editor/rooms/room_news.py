"""What the members of a room are told of what is committed, and which moment they show."""

import asyncio
from collections.abc import Collection
from typing import Final

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.messages import Malformed
from action_assistant.editor.crdt.replica import Replica
from action_assistant.editor.rooms.batch import Ask, Look, Taken, merged
from action_assistant.editor.rooms.comparisons import Comparisons
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.room_metrics import RoomMetrics
from action_assistant.web.server.direct import framed

_PATIENCE: Final = 1.5  # times as long as usual a moment waits for something to go along with


class RoomNews:
    """Told to the members of the moment. Those who only listen hear which moment they show every
    `moments` seconds at most: half of all messages of a busy room would say nothing else."""

    def __init__(self, members: Collection[Member], moments: float, metrics: RoomMetrics) -> None:
        self._members = members
        self._metrics = metrics
        self._moments = moments
        self._loop = asyncio.get_running_loop()
        self._next_moment = 0.0
        self._naming: asyncio.TimerHandle | None = None
        self._seq = 0

    def tell(self, taken: Taken, seq: int) -> None:
        """What is committed: to the others as news, to those who sent it as an acknowledgement."""
        self._seq = seq
        authors: dict[Member, None] = {}
        for offer in taken.handled:
            if offer.member is not None:
                authors[offer.member] = None
                offer.member.edit_handled()
            if offer.done is not None and not offer.done.done():
                offer.done.set_result(seq)
        frames = [messages.change(update) for update in merged(taken.shown)]
        names = bool(taken.news) and self._names_moment()
        own = {offer.member for offer, _ in taken.news}
        alone = own.pop() if len(own) == 1 and not taken.for_all else None
        packed = b"".join(map(framed, frames))
        for member in self._members if frames or names else authors:
            hears = member is not alone and member.synced
            durable = seq if names or member in authors else None
            if member.sends(packed if hears else b"", durable):
                continue
            for frame in frames if hears else ():
                member.post(frame)
            if durable is not None:
                member.post_ack(seq)
        self._metrics.acknowledged(taken.handled)

    def end(self) -> None:
        """Nobody is told anything any more."""
        if self._naming is not None:
            self._naming.cancel()

    def _names_moment(self) -> bool:
        """Whether the moment goes along with what is told now. A word of its own is said only where
        nothing follows that could take it along."""
        now = self._loop.time()
        if now < self._next_moment:
            if self._naming is None:
                wait = _PATIENCE * self._moments
                self._naming = self._loop.call_later(wait, self._name_moment)
            return False
        self._next_moment = now + self._moments
        if self._naming is not None:
            self._naming.cancel()
            self._naming = None
        return True

    def _name_moment(self) -> None:
        self._naming = None
        self._next_moment = self._loop.time() + self._moments
        for member in self._members:
            member.post_ack(self._seq)


def answer_all(taken: Taken, replica: Replica, seq: int, comparisons: Comparisons) -> None:
    """Whoever asked for something, once what came before it is committed."""
    for ask in taken.asks:
        _answer(ask, replica, seq)
    for compare in taken.compares:
        comparisons.ask(compare)
    for look in taken.looks:
        _show(look, replica, seq)


def _answer(ask: Ask, replica: Replica, seq: int) -> None:
    """Sync step 2: what the client lacks."""
    try:
        lacking = replica.lacking(ask.state)
    except Malformed:
        ask.member.refuse(messages.MALFORMED)
        return
    ask.member.post_answer(messages.answer(lacking))
    ask.member.synced = True
    ask.member.post_ack(seq)


def _show(look: Look, replica: Replica, seq: int) -> None:
    if look.done.done():  # nobody waits any more
        return
    try:
        look.done.set_result(look.see(replica, seq))
    except Exception as error:  # noqa: BLE001 - the looker's own
        look.done.set_exception(error)
