"""Writes the streams of the audit in the background, and counts refusals so that a flood stays small.

Nobody waits for the audit: a Stop, a sign-in and a refusal go on while the journal cannot be
written. What is noted meanwhile is stored later, in its order; beyond `_WAITING` events it is only
counted, and the count is stored.
"""

import asyncio
import logging
from collections import Counter, deque
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import Final, Protocol, TypeAlias

import msgspec
from sqlalchemy import func, select

from action_assistant.errors import Unavailable
from action_assistant.journal.events import Draft
from action_assistant.journal.reader import JournalReader
from action_assistant.kit.clock import ClockUs, utc_us
from action_assistant.schema.editor_tables import editor_event
from action_assistant.web.audit.events import (
    STREAM,
    AuditEvent,
    EndedHere,
    OwnerDid,
    PersonStored,
    SessionEnded,
    SignedIn,
    StartRefused,
    StopPressed,
    StrangersRefused,
    Unlisted,
    ViewLinkMade,
    ViewLinkRevoked,
    draft_of,
    stream_at,
)
from action_assistant.web.auth.caller import (
    Origin,
    acting_for,
    network_address,
    network_of,
    origin_of,
)
from action_assistant.web.auth.keys import Session
from action_assistant.web.auth.people_files import PersonFile
from action_assistant.web.auth.sessions import EndableKind, SignInMeans
from action_assistant.web.auth.view_links import ViewRecord

log: Final = logging.getLogger(__name__)

#: Rows about strangers in one day (UTC), those that say how many have no row among them.
STRANGER_ROWS: Final = 1_000
#: Rows in one day about what programs may repeat: refused starts, and Stops that found nothing to stop.
REPEATED_ROWS: Final = 2_000
#: Of these, rows about one person: nobody hides what others do by repeating something else.
REPEATED_ROWS_OF_ONE: Final = 200
_KEPT_FREE: Final = 50  # of the rows of a day, for the counts of what has no row
_WAITING: Final = 10_000  # events that wait for the journal
_BATCH: Final = 200  # events of one transaction
_FIRST: Final = 200  # characters of the first path that strangers asked for
_MINUTE_US: Final = 60_000_000
_DAY_US: Final = 24 * 60 * _MINUTE_US
_TICK_S: Final = 5.0  # between two looks whether a minute is over
_UNLISTED_TICKS: Final = 720  # an hour: so often the number of what has no row is stored
_AGAIN_S: Final = 2.0  # between attempts of a journal that fails
_AT_THE_END_S: Final = 5.0  # as long as a lock of the database lasts that is not a fault


class AuditStore(Protocol):
    """The parts of a journal that the audit uses."""

    async def append(self, stream: str, drafts: Sequence[Draft]) -> int:
        """Store events at the end of a stream, and return the number of the last one. Raise
        Unavailable if that is not possible."""
        ...


class DailyRows:
    """Counts the rows of one day (UTC), of which there are at most `most`, and at most `most_of_one`
    about one person."""

    def __init__(self, most: int, most_of_one: int | None = None) -> None:
        self._most: Final = most
        self._most_of_one: Final = most if most_of_one is None else most_of_one
        self._of: Counter[str] = Counter()
        self._day = 0
        self.rows = 0
        self.unlisted = 0

    def take(self, at: int, who: str = "") -> bool:
        """Return whether one more row may be made at this time, and count it; if not, count what has
        no row. A part of the rows is kept for those counts. `who`: the id of the person."""
        self.begin(at)
        if self.rows >= self._most - _KEPT_FREE or self._of[who] >= self._most_of_one:
            self.unlisted += 1
            return False
        self.rows += 1
        self._of[who] += 1
        return True

    def take_count(self, at: int) -> int:
        """Return how many facts have no row since the last call, if a row may say so now; else 0."""
        self.begin(at)
        if not self.unlisted or self.rows >= self._most:
            return 0
        self.rows += 1
        found, self.unlisted = self.unlisted, 0
        return found

    def begin(self, at: int) -> None:
        """Set the counts of rows to zero if the time `at` (µs UTC) is in another day than the one
        counted so far."""
        day = at // _DAY_US
        if day != self._day:
            self._day, self.rows = day, 0
            self._of.clear()


class RefusalCounts:
    """Counts refused strangers by address and minute. Each refusal costs one entry of a dictionary at
    most, and no more than `STRANGER_ROWS` entries exist."""

    def __init__(self, clock_us: ClockUs) -> None:
        self._clock_us = clock_us
        self._counts: dict[tuple[str, int], tuple[int, str]] = {}
        self.rows: Final = DailyRows(STRANGER_ROWS)

    def count(self, address: str, what: str) -> None:
        """Count one refused request of an address; `what`: its method and path."""
        at = self._clock_us()
        key = (address, at - at % _MINUTE_US)
        found = self._counts.get(key)
        if found is not None:
            self._counts[key] = found[0] + 1, found[1]
        elif self.rows.take(at):
            self._counts[key] = 1, what[:_FIRST]

    def over(self, *, all_of_them: bool = False) -> list[StrangersRefused]:
        """Remove and return the counts of minutes that are over, or all counts."""
        at = self._clock_us()
        done = [key for key in self._counts if all_of_them or key[1] + _MINUTE_US <= at]
        return [StrangersRefused(*key, *self._counts.pop(key)) for key in sorted(done)]


#: A fact that a program may repeat each second.
Repeated: TypeAlias = StartRefused | StopPressed


class RepeatCounts:
    """Counts facts that repeat within a minute: the first one gets a row at once, the others one
    together."""

    def __init__(self, clock_us: ClockUs) -> None:
        self._clock_us = clock_us
        #: By author, connection and fact: the minute, and how often it came again.
        self._seen: dict[tuple[str, Origin | None, Repeated], tuple[int, int]] = {}
        self.rows: Final = DailyRows(REPEATED_ROWS, REPEATED_ROWS_OF_ONE)

    def is_first(self, event: Repeated, author: str) -> bool:
        """Return whether a fact gets a row now. If it was repeated within the minute, or too many
        rows were made today, it is only counted. `author`: the id of the person."""
        at = self._clock_us()
        key = (author, origin_of(author), event)
        found = self._seen.get(key)
        if found is not None:
            self._seen[key] = found[0], found[1] + 1
            return False
        if not self.rows.take(at, author):
            return False
        self._seen[key] = at - at % _MINUTE_US, 0
        return True

    def over(self, *, all_of_them: bool = False) -> list[Draft]:
        """Forget the facts whose minute is over, or all facts with `all_of_them`. For each that
        was repeated, return one event with the number of repetitions after the first time."""
        at = self._clock_us()
        repeated: list[Draft] = []
        for key, (minute, times) in list(self._seen.items()):
            if all_of_them or minute + _MINUTE_US <= at:
                del self._seen[key]
                author, origin, event = key
                if times:
                    with acting_for(author, origin):
                        again = msgspec.structs.replace(event, times=times)
                        repeated.append(draft_of(again, author))
        return repeated


class AuditLog:
    """Takes facts of the audit at any time, and stores them while `writing`."""

    def __init__(self, clock_us: ClockUs = utc_us) -> None:
        self._clock_us = clock_us
        self._waiting: deque[Draft] = deque()
        self._handed_over = 0  # of the first that wait: the journal has them, and has not answered
        self._lost = 0
        self._strangers = RefusalCounts(clock_us)
        self._repeats = RepeatCounts(clock_us)
        self._news = asyncio.Event()
        self._closing = False

    def note(self, event: AuditEvent, author: str = "") -> None:
        """Queue a fact for storing. Never waits and never fails. `author`: the id of the person."""
        self._add(draft_of(event, author))

    def signed_in(self, session: Session, how: SignInMeans) -> None:
        """Queue that the person of a session has signed in."""
        person = session.person
        came = SignedIn(how, person.role, person.name, session.id, session.invitation or "")
        self.note(came, person.id)

    def signed_out(self, session: Session) -> None:
        """Queue that the person of a session has ended it."""
        self.note(SessionEnded(session.id, own=True), session.person.id)

    def view_link_made(self, link: ViewRecord, author: str) -> None:
        """Queue that a person made a link that shows one thing."""
        expires = int(link.expires.timestamp() * 1_000_000)
        self.note(ViewLinkMade(link.id, link.kind, link.thing, link.label, expires), author)

    def view_link_revoked(self, link: ViewRecord, author: str) -> None:
        """Queue that a person revoked such a link."""
        self.note(ViewLinkRevoked(link.id, link.kind, link.thing), author)

    def ended_here(self, what: EndableKind, id_: str, author: str) -> None:
        """Queue that a person told this process of the end of something."""
        self.note(EndedHere(what, id_), author)

    def person_stored(self, person: PersonFile, author: str) -> None:
        """Queue that a person told this process the state of somebody."""
        stored = PersonStored(person.id, person.name, person.role, person.groups, person.until)
        self.note(stored, author)

    def receiver_tested(self, receiver: str, author: str) -> None:
        """Queue that a person sent a test to a receiver of messages."""
        self.note(OwnerDid("receiver_tested", receiver), author)

    def refused_stranger(self, address: str, what: str) -> None:
        """Count a refused request without valid credentials. `what`: its method and path."""
        self._strangers.count(network_of(network_address(address)), what)

    def note_repeated(self, event: Repeated, author: str) -> None:
        """Queue a fact that a program may repeat. The same fact within a minute is counted instead."""
        if self._repeats.is_first(event, author):
            self.note(event, author)

    @asynccontextmanager
    async def writing(self, journal: "AuditStore") -> AsyncIterator[None]:
        """Return a context during which facts are stored as they are noted; at its end the
        remainder is stored, for five seconds at most."""
        if isinstance(journal, JournalReader):
            await self._recall(journal)
        self._closing = False
        tasks = [asyncio.create_task(self._write(journal)), asyncio.create_task(self._tick())]
        try:
            yield
        finally:
            tasks[1].cancel()
            self._take_counts(all_of_them=True)
            self._closing = True
            self._news.set()
            await asyncio.wait(tasks[:1], timeout=_AT_THE_END_S)
            tasks[0].cancel()
            await asyncio.wait(tasks)
            if lacking := len(self._waiting) - self._handed_over:
                log.error("the audit lacks its last %d events", lacking)
            if self._handed_over:  # a journal that is closed stores what it has
                text = "%d events of the audit are being stored; nobody waits for that any longer"
                log.warning(text, self._handed_over)

    def _add(self, draft: Draft) -> None:
        if len(self._waiting) >= _WAITING:
            self._lost += 1
            return
        self._waiting.append(draft)
        self._news.set()

    async def _write(self, journal: "AuditStore") -> None:
        most = _BATCH
        while True:
            await self._news.wait()
            self._news.clear()
            while self._waiting:
                batch = [self._waiting[n] for n in range(min(len(self._waiting), most))]
                self._handed_over = len(batch)
                try:
                    await journal.append(stream_at(self._clock_us()), batch)
                except Unavailable as refused:
                    self._handed_over = 0
                    log.warning("the audit is not stored yet: %s", refused.detail)
                    await asyncio.sleep(_AGAIN_S)
                    continue
                except Exception:  # of one event, which must not hold up those after it
                    log.exception("%d events of the audit cannot be stored", len(batch))
                    if most > 1:
                        self._handed_over, most = 0, 1
                        continue
                    self._lost += 1
                most = min(_BATCH, 2 * most)
                self._handed_over = 0
                for _ in batch:
                    self._waiting.popleft()
                if self._lost:
                    lost, self._lost = self._lost, 0
                    self._add(draft_of(Unlisted("lost", lost)))
            if self._closing:
                return

    async def _tick(self) -> None:
        ticks = 0
        while True:
            await asyncio.sleep(_TICK_S)
            ticks += 1
            self._take_counts(counts_unlisted=ticks % _UNLISTED_TICKS == 0)

    def _take_counts(
        self, *, all_of_them: bool = False, counts_unlisted: bool | None = None
    ) -> None:
        """Queue the counts of minutes that are over, and, once an hour and at the end, how many
        facts have no row."""
        at = self._clock_us()
        for refused in self._strangers.over(all_of_them=all_of_them):
            self._add(draft_of(refused))
        for repeated in self._repeats.over(all_of_them=all_of_them):
            self._add(repeated)
        if counts_unlisted or all_of_them:
            if count := self._strangers.rows.take_count(at):
                self._add(draft_of(Unlisted("strangers_refused", count)))
            if count := self._repeats.rows.take_count(at):
                self._add(draft_of(Unlisted("repeated", count)))

    async def _recall(self, journal: JournalReader) -> None:
        """Count the rows of this day that an earlier process has stored."""
        at = self._clock_us()
        event = editor_event.c
        chosen = select(event.kind, func.count()).where(
            event.stream.in_((STREAM, stream_at(at))),
            event.at >= at - at % _DAY_US,
            event.kind.in_((StrangersRefused.kind, StartRefused.kind, StopPressed.kind)),
        )
        for row in await journal.query(chosen.group_by(event.kind)):
            kind, count = tuple(row)
            rows = self._strangers.rows if kind == StrangersRefused.kind else self._repeats.rows
            rows.begin(at)
            rows.rows += count
