"""The rights of all robots of this process: decides changes, stores them, and lets batons fall.

A change is decided on the rights as decided before, without waiting, so that of two people who take a
baton at once exactly one has it. A right that ends counts as ended from that step on; one that begins
counts once it is stored: `refusals` asks both the decided and the stored rights. Where a change could not
be stored nobody knows who would hold the baton after a restart, so nobody holds it.
"""

import logging
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Final

import anyio
import msgspec
from msgspec.structs import replace
from sqlalchemy import Row

from action_assistant.errors import BadInput, Conflict, Forbidden, Refused, Unavailable
from action_assistant.runner.links.hardware_stop import HardwareStop
from action_assistant.runner.links.health import HealthCheck, HealthNow
from action_assistant.runner.links.port import SIMULATOR, NotSent
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.rights import (
    BatonPassed,
    Claim,
    Drilled,
    Holder,
    Lock,
    Refusal,
    RightsEvent,
    RobotRights,
    Rules,
)
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.page_presence import PagePresence
from action_assistant.runner.runtime import Runtime
from action_assistant.runner.start.preflight import Item, Verdict
from action_assistant.umrf.limits import Limit, Limits
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Person, PersonRef
from action_assistant.web.auth.released_versions import Release
from action_assistant.web.auth.rights import Denied, may

log: Final = logging.getLogger(__name__)

_OF_OTHERS: Final = "What others start there meanwhile is not stopped from here."

#: Seconds after which a baton falls whose holder has no page open.
GONE_S: Final = 1800.0
_POLL_S: Final = 1.0  # between two looks at the sessions of holders
_STORE_S: Final = 5.0
_SHORTEST_REASON: Final = 3
_NAMED: Final = 6  # limits in one sentence

#: Returns an identity as it is now, with the role and groups that count; None if it was ended.
IdentityNow = Callable[[Identity], Identity | None]


#: Returns the release of exactly the graph with a digest; None if there is none. Raises Unavailable if that
#: cannot be read.
ReleaseOf = Callable[[str], Release | None]


def nothing_released(_digest: str) -> None:
    """Return None: where no version is ever released."""


def unchanged(identity: Identity) -> Identity | None:
    """Return the identity: where nobody can be ended."""
    return identity


class _Record:
    """The rights of one robot. `decided`: after every change; `stored`: after those in the journal;
    `waiting`: the changes between them; `noted`: how many there were; `taken_by`: the identity by which
    the holder has the baton."""

    def __init__(self, rights: RobotRights) -> None:
        self.decided = self.stored = rights
        self.waiting: deque[RightsEvent] = deque()
        self.noted = 0
        self.taken_by: Identity | None = None


class RightsRegistry:
    """Keeps the rights of robots. `changed` is called with the name of a robot in the step in which its
    rights change."""

    def __init__(
        self,
        robots: Robots,
        runtime: Runtime,
        changed: Callable[[str], None],
        now: IdentityNow = unchanged,
        release_of: ReleaseOf = nothing_released,
    ) -> None:
        self._release_of = release_of
        self._robots = robots
        self._runtime = runtime
        self._changed = changed
        self._now = now
        self._records: dict[str, _Record] = {}
        self._live: dict[str, list[Identity]] = {}  # by person, one for each open page
        self._gone_at: dict[str, float] = {}  # by person, in seconds of the event loop
        self._seen_at: dict[str, float] = {}  # by person: when a visible page was last known
        self._began = 0.0
        self._news = anyio.Event()
        #: Returns why the hardware stop of a robot counts as pressed, as a sentence; "" if it does not.
        self.why_pressed: Callable[[str], str] = _not_pressed
        self.health_now: Callable[[str], tuple[HealthNow, ...]] = _no_health

    def take_up(self, rows: Iterable[Row[Any]]) -> None:
        """Take over what is stored, and begin to watch the holders of batons. The time after which a
        baton falls counts anew: nobody knows for how long the page of its holder was closed."""
        self._began = anyio.current_time()
        for row in rows:
            self._records[row.name] = _Record(_rights_of(row))
        self._runtime.tasks.start_soon(self._watch)

    def of(self, robot: str) -> RobotRights:
        """Return the rights of a robot as decided."""
        return self._record(robot).decided

    def holder(self, robot: str) -> Holder | None:
        """Return who holds the baton of a robot, decided and stored."""
        record = self._record(robot)
        return record.decided.holder if record.decided.holder == record.stored.holder else None

    def _record(self, robot: str) -> _Record:
        record = self._records.get(robot)
        if record is None:
            record = self._records[robot] = _Record(RobotRights(name=robot))
        return record

    # --- what is refused ----------------------------------------------------------------------

    def refusals(
        self,
        robot: str,
        identity: Identity,
        claim: Claim | None = None,
        *,
        is_asking: bool = True,
        is_decided: bool = False,
    ) -> tuple[Refusal, ...]:
        """Return why an identity may not start on a robot now; empty if it may. `claim`: the claim
        of the start, None where no start is meant yet; `is_asking`: the sentences are for this
        person, else about them; `is_decided`: a right that begins counts before it is stored."""
        record, now = self._record(robot), self._runtime.clock_us() / 1e6
        who = identity.person.name or "The starter"
        current = self.current(identity)
        if current is None:
            return (Refusal("right", f"{who} is not signed in any more."),)
        denied = may(current, "operate", now=now)
        if isinstance(denied, Denied):
            text = denied.reason if is_asking else f"{who} may not run graphs on robots any more."
            return (Refusal("right", text),)
        found = tuple(record.decided.refusals(current, now, claim=claim, is_asking=is_asking))
        if why := self.why_pressed(robot):
            found = (Refusal("pressed", why), *found)
        rules = (record.decided.rules, record.stored.rules)
        if rules[0].hardware_stop != rules[1].hardware_stop:
            text = f"Where {robot} reports its hardware stop is just changing, and not stored yet."
            found = (Refusal("pressed", text), *found)
        if claim is not None and claim.is_start:
            found += tuple(
                Refusal("health", each.sentence())
                for each in self.health_now(robot)
                if each.consequence == "block"
            )
        if claim is not None and any(each.released_only for each in rules):
            found += self._not_released(robot, claim)
        if claim is not None:
            found += tuple(record.decided.over_limit(self.limits_of(robot), claim))
        if found or is_decided or record.stored is record.decided:
            return found
        pending = tuple(record.stored.refusals(current, now, claim=claim, is_asking=is_asking))
        text = f"The rights of {robot} are just changing, and that is not stored yet. Try it again."
        return tuple(Refusal(each.code, text) for each in pending[:1])

    def hardware_stop_of(self, robot: str) -> HardwareStop | None:
        """Return where the hardware stop of a robot is reported; None where it is not."""
        return self._record(robot).decided.rules.hardware_stop

    def page_presence_of(self, robot: str) -> PagePresence | None:
        """Return for how long a page may be missing during runs on a robot; None where none is asked
        for. A rule that is just being changed counts as long as that is not stored."""
        record = self._record(robot)
        decided, stored = record.decided.rules.page_presence, record.stored.rules.page_presence
        if decided is None or stored is None or decided == stored:
            return decided or stored
        return PagePresence(
            wait_s=min(decided.wait_s, stored.wait_s), stop_s=min(decided.stop_s, stored.stop_s)
        )

    def health_of(self, robot: str) -> tuple[HealthCheck, ...]:
        """Return what is checked of the health of a robot: also what is just being taken away."""
        record = self._record(robot)
        return tuple(dict.fromkeys(record.decided.rules.health + record.stored.rules.health))

    @property
    def asks_for_pages(self) -> bool:
        """Return whether a robot asks for visible pages."""
        return any(self.page_presence_of(name) is not None for name in self._robots.names)

    def page_presences(self, robots: Iterable[str]) -> dict[str, PagePresence]:
        """Return the rules in force about pages on these robots; robots without one are left out."""
        return {name: rule for name in robots if (rule := self.page_presence_of(name))}

    def health(self, robots: Iterable[str]) -> dict[str, tuple[HealthNow, ...]]:
        """Return the health of these robots now; robots of which nothing is checked are left out."""
        return {name: found for name in robots if (found := self.health_now(name))}

    def limits_of(self, robot: str) -> tuple[Limit, ...]:
        """Return the limits in force on a robot: also those that are just being taken away."""
        record = self._record(robot)
        return tuple(dict.fromkeys(record.decided.rules.limits + record.stored.rules.limits))

    def limits(self, robots: Iterable[str]) -> Limits:
        """Return the limits in force on these robots; robots without any are left out."""
        return {name: found for name in robots if (found := self.limits_of(name))}

    def _not_released(self, robot: str, claim: Claim) -> tuple[Refusal, ...]:
        """Return why a robot that takes released versions only takes no graph with this digest; empty
        if one was released."""
        try:
            is_released = self._release_of(claim.digest) is not None
            if is_released and not claim.beyond:
                return ()
            what = (
                "this changes values in one, or is a part of one"
                if is_released
                else "this is none of them"
            )
            why = f"{robot} takes only versions that an owner has released, and {what}."
        except Unavailable as unread:
            why = f"{robot} takes only versions that an owner has released. {unread.detail}"
        return (Refusal("released", why),)

    def current(self, identity: Identity) -> Identity | None:
        """Return an identity as it is now, or that of another open page of the same person where its
        session was ended; None if the person was ended."""
        for each in (identity, *self._live.get(identity.person.id, ())):
            if (found := self._now(each)) is not None:
                return replace(found, asked_at=identity.asked_at)
        return None

    def require(
        self,
        robots: Iterable[str],
        identity: Identity,
        claim: Claim | None = None,
        *,
        only: Collection[str] | None = None,
    ) -> None:
        """Raise Forbidden or Conflict, with the sentences of all robots, if an identity may not start
        on one of them. `claim`: as for `refusals`; `only`: codes of refusals that count, None for
        all."""
        found = {name: self.refusals(name, identity, claim) for name in robots if name != SIMULATOR}
        counted = {
            name: [each for each in refused if only is None or each.code in only]
            for name, refused in found.items()
        }
        reasons = {name: refused for name, refused in counted.items() if refused}
        if not reasons:
            return
        every = [each for refused in reasons.values() for each in refused]
        where: dict[str, object] = {
            "path": "/engine",
            "item": every[0].code,
            "robots": {name: refused[0].text for name, refused in reasons.items()},
        }
        is_forbidden = any(each.code in {"right", "confirm"} for each in every)
        refuse = Forbidden if is_forbidden else Conflict
        raise refuse(" ".join(each.text for each in every), where=where)

    def require_still(self, robots: Iterable[str], identity: Identity, claim: Claim) -> None:
        """Raise NotSent if an identity may not start on one of these robots any more. Call this in
        the same step of the event loop in which the message is sent."""
        try:
            self.require(robots, identity, claim)
        except Refused as why:
            raise NotSent(why.detail) from why

    def items(
        self, robot: str, identity: Identity, claim: Claim, *, is_asking: bool = True
    ) -> tuple[Item, ...]:
        """Return the items of a pre-flight: none for a robot without rules on which everybody with
        the role may start. `claim`: the claim of the start."""
        refused = self.refusals(robot, identity, claim, is_asking=is_asking)
        found = [
            Item(
                code=each.code,
                verdict="blocked",
                text=f"{each.text} {_OF_OTHERS}" if each.code == "pressed" else each.text,
            )
            for each in refused
        ]
        rules, blocked = self.of(robot).rules, {each.code for each in refused}
        if rules.operators is not None and "right" not in blocked:
            text = f"{_subject(identity, is_asking)} among those who may start on {robot}."
            found.append(Item(code="right", verdict="passed", text=text))
        if rules.baton and "baton" not in blocked and "right" not in blocked:
            who = "You hold" if is_asking else f"{identity.person.name or 'The starter'} holds"
            found.append(Item(code="baton", verdict="passed", text=f"{who} the baton of {robot}."))
        if rules.ask_again and not blocked & {"confirm", "right"}:
            text = f"Confirmed. {robot} asks again after {rules.ask_again} min."
            found.append(Item(code="confirm", verdict="passed", text=text))
        if rules.watched and "watched" not in blocked:
            who = "You watch" if is_asking else "Somebody watches"
            text = f"{who} {robot}, with its hardware stop within reach."
            found.append(Item(code="watched", verdict="passed", text=text))
        if rules.released_only and "released" not in blocked:
            release = self._release_of(claim.digest)
            by = "an owner" if release is None else release.by.name or "an owner"
            text = f"This version was released by {by}."
            found.append(Item(code="released", verdict="passed", text=text))
        rule = self.hardware_stop_of(robot)
        if rule is not None and "pressed" not in blocked:
            text = (
                f"The hardware stop of {robot} is not pressed: {rule.words()}. This is information."
            )
            found.append(Item(code="pressed", verdict="passed", text=text))
        if claim.is_start:
            for each in self.health_now(robot):
                if each.consequence != "block":
                    verdict: Verdict = "warned" if each.consequence == "warn" else "passed"
                    found.append(Item(code="health", verdict=verdict, text=each.sentence()))
        page = self.page_presence_of(robot)
        if page is not None:
            found.append(self._page_item(robot, page, identity, claim))
        limits = self.limits_of(robot)
        if limits and claim.limits is not None and "limit" not in blocked:
            said = ", ".join(each.words() for each in limits[:_NAMED])
            more = f" and {len(limits) - _NAMED} more" if len(limits) > _NAMED else ""
            text = f"Limits of {robot}, which the robot does not enforce: {said}{more}."
            found.append(Item(code="limit", verdict="passed", text=text))
        if "drill" not in blocked:
            found += self._drill_items(robot, claim)
        return tuple(found)

    def _page_item(self, robot: str, rule: PagePresence, identity: Identity, claim: Claim) -> Item:
        """Return the item that says what happens without a visible page. It blocks nothing."""
        text = rule.words(robot, is_led=claim.is_led)
        seen_at = self.seen_at(identity.person.id)
        if seen_at is not None and anyio.current_time() - seen_at < rule.wait_s:
            return Item(code="present", verdict="passed", text=text)
        who = identity.person.name or "the starter"
        text = f"{text} No visible page of {who} answers now."
        return Item(code="present", verdict="warned", text=text)

    def _drill_items(self, robot: str, claim: Claim) -> Iterator[Item]:
        """Yield the item about the last Stop drill of a robot that blocks no start: none if there was
        no drill and none is asked for."""
        rights = self.of(robot)
        due = rights.drill_due(self._runtime.clock_us() / 1e6)
        if claim.is_drill:
            text = (
                "This start is for a Stop drill: press Stop while it moves, and say what you saw."
            )
            yield Item(code="drill", verdict="warned", text=f"{due} {text}".strip())
        elif rights.drills:
            last = rights.drills[-1]
            verdict: Verdict = "warned" if last.failure else "passed"
            yield Item(code="drill", verdict=verdict, text=rights.drill_words(last))

    def with_baton(self, robots: Iterable[str]) -> tuple[str, ...]:
        """Return those of these robots that have a baton."""
        return tuple(name for name in robots if self.of(name).rules.baton)

    # --- who is here --------------------------------------------------------------------------

    @contextmanager
    def here(self, identity: Identity) -> Iterator[None]:
        """Count a page of a person as open until the end of the block."""
        person = identity.person.id
        self._live.setdefault(person, []).append(identity)
        self._tell_presence(person)
        try:
            yield
        finally:
            left = self._live[person]
            left.remove(identity)
            if not left:
                del self._live[person]
                self._gone_at[person] = anyio.current_time()
            self._tell_presence(person)

    def _tell_presence(self, person: str) -> None:
        self._news.set()
        for name, record in self._records.items():
            if record.decided.holder is not None and record.decided.holder.person.id == person:
                self._changed(name)

    def is_here(self, person: str) -> bool:
        """Return whether a person has a page open with a session that lasts."""
        return self.present(person) is not None

    def people_here(self) -> list[Identity]:
        """Return the people who have a page open and may start on robots, each once, by name."""
        found = [self.present(person) for person in self._live]
        now = self._runtime.clock_us() / 1e6
        able = [
            each
            for each in found
            if each is not None and not isinstance(may(each, "operate", now=now), Denied)
        ]
        return sorted(able, key=lambda each: (each.person.name.casefold(), each.person.id))

    def present(self, person: str) -> Identity | None:
        """Return a person who has a page open, as they are now; None for anybody else. Of several
        pages the one that was confirmed last counts."""
        pages = map(self._now, self._live.get(person, ()))
        found = max(filter(None, pages), key=lambda each: each.confirmed_at or 0.0, default=None)
        if found is None:
            return None
        return replace(found, asked_at=self._runtime.clock_us() / 1e6)

    def falls_at(self, person: str) -> float | None:
        """Return when a baton falls whose holder has no page open, in seconds of the event loop; None
        while the person is here."""
        if self.is_here(person):
            return None
        return self._gone_at.get(person, self._began) + GONE_S

    # --- changes ------------------------------------------------------------------------------

    async def set_rules(self, robot: str, rules: Rules, author: Author) -> None:
        """Set the rules of a robot. Raise Unavailable if that could not be stored."""
        self._robots.registration(robot)
        events = self.of(robot).set_rules(rules, author, self._runtime.clock_us())
        await self._carry_out({robot: events}, author.id)

    async def take(self, robot: str, by: Identity, author: Author, reason: str = "") -> None:
        """Take the baton of a robot, from its holder with a reason. Raise Forbidden or Conflict as
        `RobotRights.take` does, Unavailable if that could not be stored: then nobody holds it."""
        self._robots.registration(robot)
        reason = reason.strip()
        if reason and len(reason) < _SHORTEST_REASON:
            raise BadInput("Say why you take it over.", where={"path": "/reason"})
        self.act(by)
        event = self.of(robot).take(by, author, self._runtime.clock_us(), reason)
        if event is not None:
            await self._carry_out({robot: (event,)}, author.id, {robot: by})
        else:
            await self.settled(robot)

    async def hand(self, robot: str, to: str, by: Identity, author: Author) -> None:
        """Hand the baton of a robot to a person who has a page open. Raise Conflict or Forbidden as
        `RobotRights.hand` does, Unavailable if that could not be stored: then nobody holds it."""
        self._robots.registration(robot)
        self.act(by)
        receiver = self.require_present(to)
        event = self.of(robot).hand(by, author, receiver, self._runtime.clock_us())
        await self._carry_out({robot: (event,)}, author.id, {robot: receiver})

    def handing(
        self, robots: Iterable[str], run: str, to: Identity, by: Identity, author: Author
    ) -> dict[str, tuple[RightsEvent, ...]]:
        """Return the events by which all batons of these robots go to one person together with a run.
        Raise Conflict or Forbidden if one of them may not; nothing has changed then."""
        self.act(by)
        at = self._runtime.clock_us()
        names = self.with_baton(robots)
        if not names:
            raise Conflict("No robot of this run has a baton.")
        return {name: (self.of(name).hand(by, author, to, at, run),) for name in names}

    async def carry_out_handing(
        self, events: dict[str, tuple[RightsEvent, ...]], to: Identity, author: Author
    ) -> None:
        """Carry out the events of `handing`, in the step of the call. Raise Unavailable if they could
        not be stored: then nobody holds these batons."""
        await self._carry_out(events, author.id, dict.fromkeys(events, to))

    async def drop(self, robot: str, by: Identity, author: Author) -> None:
        """Drop the baton of a robot. Raise Conflict if this person does not hold it, Unavailable if
        that could not be stored."""
        self._robots.registration(robot)
        event = self.of(robot).drop(by, author, self._runtime.clock_us())
        await self._carry_out({robot: (event,)}, author.id)

    async def record_drill(self, robot: str, drill: Drilled) -> None:
        """Record a Stop drill of a robot. Raise Conflict as `RobotRights.require_drill` does,
        Unavailable if it could not be stored."""
        self.of(robot).require_drill(drill)
        await self._carry_out({robot: (drill,)}, drill.author.id)

    async def lock(self, robot: str, by: Identity, author: Author, reason: str) -> None:
        """Put a robot out of service. Raise BadInput without a reason, Unavailable if that could not
        be stored: it holds until this process ends all the same."""
        self._robots.registration(robot)
        if len(reason.strip()) < _SHORTEST_REASON:
            raise BadInput("Say why it is out of service.", where={"path": "/reason"})
        event = self.of(robot).lock(by, author, self._runtime.clock_us(), reason.strip())
        await self._carry_out({robot: (event,)}, author.id)

    async def unlock(self, robot: str, by: Identity, author: Author, of: str = "") -> None:
        """Take a lock off a robot. Raise Conflict or Forbidden as `RobotRights.unlock` does,
        Unavailable if that could not be stored."""
        self._robots.registration(robot)
        event = self.of(robot).unlock(by, author, self._runtime.clock_us(), of)
        await self._carry_out({robot: (event,)}, author.id)

    def act(self, identity: Identity) -> None:
        """Note that a person has just done something, which shows that they are there."""
        now = anyio.current_time()
        self._gone_at[identity.person.id] = now
        self.see(identity, now)

    def see(self, identity: Identity, at: float) -> None:
        """Note that a person had a visible page at this time, in seconds of the event loop. A program
        shows nothing about its person."""
        if identity.session is not None and identity.token is None:
            person = identity.person.id
            self._seen_at[person] = max(at, self._seen_at.get(person, at))

    def seen_at(self, person: str) -> float | None:
        """Return when a person last had a visible page, in seconds of the event loop; None if that is
        not known."""
        return self._seen_at.get(person)

    def require_present(self, person: str) -> Identity:
        """Return a person who has a page open. Raise Conflict for anybody else, who would not know
        that they hold a baton."""
        found = self.present(person)
        if found is None:
            raise Conflict(
                "That person has no page open here, and would not know of it.",
                where={"path": "/to"},
            )
        return found

    async def settled(self, robot: str) -> None:
        """Wait until all changes of a robot's rights are stored. Raise Unavailable if that takes more
        than five seconds."""
        record = self._record(robot)
        if record.waiting:
            await self._stored({robot: record.noted})

    async def _carry_out(
        self,
        events: dict[str, tuple[RightsEvent, ...]],
        author: str,
        taken_by: dict[str, Identity] | None = None,
    ) -> None:
        """Carry out changes in this step, then wait until they are stored."""
        for robot, changes in events.items():
            record = self._record(robot)
            record.taken_by = (taken_by or {}).get(robot, record.taken_by)
            for event in changes:
                self._decide(robot, event, author)
        try:
            await self._stored({robot: self._record(robot).noted for robot in events})
        except Unavailable:
            for robot in taken_by or {}:
                self._drop_unknown(robot, "It could not be stored who holds it.")
            raise

    def _decide(self, robot: str, event: RightsEvent, author: str) -> None:
        record = self._record(robot)
        record.decided = record.decided.after(event)
        record.waiting.append(event)
        record.noted += 1
        self._robots.robot_log.note(robot, event, author)
        self._news.set()
        self._changed(robot)

    async def _stored(self, marks: dict[str, int]) -> None:
        """Wait until the first so many changes of each robot are stored."""
        try:
            with anyio.fail_after(_STORE_S):
                for robot, mark in marks.items():
                    await self._settle(robot, mark)
        except TimeoutError as late:
            for robot, mark in marks.items():
                self._runtime.tasks.start_soon(self._settle, robot, mark)
            raise Unavailable("The runner's journal does not take anything in now.") from late

    async def _settle(self, robot: str, mark: int) -> None:
        await self._robots.robot_log.flushed(robot)
        record = self._record(robot)
        while record.waiting and record.noted - len(record.waiting) < mark:
            record.stored = record.stored.after(record.waiting.popleft())
        if not record.waiting:
            record.stored = record.decided
        self._changed(robot)

    # --- falling ------------------------------------------------------------------------------

    def _drop_unknown(self, robot: str, why: str) -> None:
        """Let the baton of a robot fall, and store that; nothing if nobody holds it. `why`: a sentence."""
        record = self._record(robot)
        event: BatonPassed | None = record.decided.fall(self._runtime.clock_us(), why)
        if event is not None:
            record.taken_by = None
            self._decide(robot, event, "")
            self._runtime.tasks.start_soon(self._settle, robot, record.noted)

    async def _watch(self) -> None:
        """Let batons fall whose holders are gone, until cancelled."""
        while True:
            self._news = anyio.Event()
            try:
                wait = self._look()
            except Exception:  # batons must go on falling
                log.exception("the holders of batons could not be looked at")
                wait = _POLL_S
            with anyio.move_on_after(wait):
                await self._news.wait()

    def _look(self) -> float:
        """Let batons fall that are due; return for how many seconds nothing has to be looked at."""
        wait = float("inf")
        for robot, record in self._records.items():
            holder = record.decided.holder
            if holder is None:
                continue
            name = holder.person.name or "the holder"
            taken_by = record.taken_by or Identity(
                Person(holder.person.id, holder.person.name, "operator")
            )
            falls_at = self.falls_at(holder.person.id)
            if self.current(taken_by) is None:
                self._drop_unknown(robot, f"The session of {name} was ended.")
            elif falls_at is not None and falls_at <= anyio.current_time():
                self._drop_unknown(robot, f"No page of {name} was open for 30 minutes.")
            else:
                wait = min(wait, _POLL_S)
        return wait


def _not_pressed(_robot: str) -> str:
    """Return "": before anybody listens to hardware stops."""
    return ""


def _no_health(_robot: str) -> tuple[HealthNow, ...]:
    """Return (): nobody has said that the health of a robot is checked."""
    return ()


def _subject(identity: Identity, is_asking: bool) -> str:
    return "You are" if is_asking else f"{identity.person.name or 'The starter'} is"


class _Stored(msgspec.Struct, frozen=True):
    """A row of the table of rights."""

    rules: Rules
    set_by: PersonRef | None
    holder: Holder | None
    locks: tuple[Lock, ...]
    drills: tuple[Drilled, ...]


def _rights_of(row: Row[Any]) -> RobotRights:
    """Return the rights in a row of the table. If they cannot be read, nobody holds the baton and
    nothing starts there."""
    try:
        found = msgspec.convert(
            {name: getattr(row, name) for name in _Stored.__struct_fields__}, _Stored
        )
    except msgspec.ValidationError:
        log.exception("the rights of %s cannot be read", row.name)
        return RobotRights(name=row.name, is_unread=True)
    return RobotRights(name=row.name, **msgspec.structs.asdict(found))
