"""The rights of a robot: who may start there, who holds its baton, and who has put it out of service.

All of this is pure. A change is decided on the value `RobotRights` and becomes one event, which carries
the value after it; the newest events of a robot are its rights (docs/decisions/117).
Times are microseconds UTC.
"""

from collections.abc import Iterable, Iterator
from typing import ClassVar, Final, Literal, TypeAlias

import msgspec
from msgspec.structs import replace

from action_assistant.errors import Conflict, Forbidden
from action_assistant.kit.moments import moment
from action_assistant.runner.links.hardware_stop import HardwareStop
from action_assistant.runner.links.health import HealthCheck
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.page_presence import PagePresence
from action_assistant.umrf.limits import Limit, Limits, OverLimit
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.auth.rights import Denied, may
from action_assistant.web.auth.roles import Permission

#: The codes of refusals, which are those of the items of a pre-flight.
RightCode: TypeAlias = Literal[
    "service",
    "right",
    "baton",
    "confirm",
    "watched",
    "drill",
    "released",
    "limit",
    "pressed",
    "health",
]
#: Those that concern the person alone, whatever is started.
OF_PEOPLE: Final[frozenset[RightCode]] = frozenset({"service", "right", "baton", "confirm"})
#: How a baton came to another person, or to nobody.
BatonChange: TypeAlias = Literal["taken", "handed", "forced", "dropped", "fell", "off"]
_NAMED: Final = 4
_DAY_US: Final = 86_400_000_000
_MOST_DRILLS: Final = 20  # of a robot within a day


class Operator(msgspec.Struct, frozen=True, omit_defaults=True):
    """A person or a group who may start on a robot. `name`: as it was when the right was given;
    `until`: when the right ends, in microseconds UTC."""

    id: str
    name: str
    until: int | None = None


class Rules(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The rules of an owner for a robot. `operators`: who may start there; None: every operator.
    `baton`: only its holder may; `watched`: each start has the word of its person that they watch
    the robot, with its hardware stop within reach; `ask_again`: minutes after which a person has to
    confirm again that it is they who start, 0 where nobody is asked; `drill_days`: the last Stop drill
    passed, and is so many days old at most; `released_only`: only versions start there that an owner
    has released; `limits`: of the numbers that are sent there; `hardware_stop`: where it
    is reported, None where it is not; `page_presence`: None where no page has to stay visible; `health`:
    that is looked at before a start."""

    operators: tuple[Operator, ...] | None = None
    baton: bool = False
    watched: bool = False
    ask_again: int = 0
    drill_days: int | None = None
    released_only: bool = False
    limits: tuple[Limit, ...] = ()
    hardware_stop: HardwareStop | None = None
    page_presence: PagePresence | None = None
    health: tuple[HealthCheck, ...] = ()


class Claim(msgspec.Struct, frozen=True, kw_only=True):
    """The part of a start that the rules of robots ask about, apart from its person. `digest`: of the
    graph that is sent together with those inside; `watching`: the robots that a person has said to
    watch; `is_drill`: the start is for a Stop drill, which may be due; `beyond`: it gives values to
    inputs that the graph does not leave open; `limits`: those by robot to which all that is sent was
    held, with what is `over` them; None where each piece is held to them by itself, as it leaves;
    `is_led`: the runner leads it; `is_start`: a run begins with it, so that the health of its robots is
    asked about."""

    digest: str
    watching: frozenset[str] = frozenset()
    is_drill: bool = False
    beyond: bool = False
    limits: Limits | None = None
    over: tuple[OverLimit, ...] = ()
    is_led: bool = False
    is_start: bool = False


class Holder(msgspec.Struct, frozen=True):
    """The person who holds the baton of a robot, since when in microseconds UTC."""

    person: PersonRef
    since: int


class Lock(msgspec.Struct, frozen=True):
    """A person has put a robot out of service. Several people may, and each lock counts."""

    by: PersonRef
    at: int
    reason: str


class RightsSet(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """An owner set the rules of a robot."""

    kind: ClassVar[str] = "robot.rights_set.v1"

    at: int
    author: Author
    rules: Rules


class BatonPassed(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The baton of a robot came from `was` to `holder`; None stands for nobody. `author`: None where
    it fell; `run`: the led run with which it was handed over."""

    kind: ClassVar[str] = "robot.baton_passed.v1"

    at: int
    how: BatonChange
    author: Author | None = None
    was: PersonRef | None = None
    holder: PersonRef | None = None
    reason: str = ""
    run: str = ""


class Locked(msgspec.Struct, frozen=True, kw_only=True):
    """A person put a robot out of service. `locks`: all locks from now on."""

    kind: ClassVar[str] = "robot.locked.v1"

    at: int
    author: Author
    reason: str
    locks: tuple[Lock, ...]


class Unlocked(msgspec.Struct, frozen=True, kw_only=True):
    """A person took a lock off a robot, their own or as an owner that of another (`of`). `locks`: those
    that are left."""

    kind: ClassVar[str] = "robot.unlocked.v1"

    at: int
    author: Author
    of: PersonRef
    locks: tuple[Lock, ...]


class Drilled(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A person recorded a Stop drill: the Stop of a run on this robot, and what they saw. Times are
    microseconds UTC. `stopped_at`: when Stop was pressed; `proof_us`: the time from then until an
    answer of the engine proved rest, None if none did; `saw_it_stop`: the person saw the robot stop;
    `hardware_stop`: they tried its hardware stop."""

    kind: ClassVar[str] = "robot.drilled.v1"

    at: int
    author: Author
    run: str
    number: int
    stopped_at: int
    proof_us: int | None
    saw_it_stop: bool
    hardware_stop: bool

    @property
    def failure(self) -> str:
        """Return why the drill failed, as the end of a sentence; "" if it passed."""
        if self.proof_us is None:
            return "its Stop was not proven"
        if not self.saw_it_stop:
            return "the robot was not seen to stop"
        return "" if self.hardware_stop else "the hardware stop was not tried"


RightsEvent: TypeAlias = RightsSet | BatonPassed | Locked | Unlocked | Drilled


class Refusal(msgspec.Struct, frozen=True):
    """The reason why a person may not start on a robot, as a sentence."""

    code: RightCode
    text: str


class RobotRights(msgspec.Struct, frozen=True, kw_only=True):
    """The rights of a robot at one moment. `set_by`: the owner who set its rules; `is_unread`: what was
    recorded of them cannot be read, so that nothing starts there until an owner has set them anew;
    `drills`: its Stop drills, oldest first."""

    name: str
    rules: Rules = Rules()
    set_by: PersonRef | None = None
    holder: Holder | None = None
    locks: tuple[Lock, ...] = ()
    is_unread: bool = False
    drills: tuple[Drilled, ...] = ()

    # --- what is refused ----------------------------------------------------------------------

    def refusal(self, identity: Identity, permission: Permission, now: float) -> str | None:
        """Return the sentence that says why an identity may not start here; None if it may, or for
        other permissions. `now`: seconds since 1970."""
        if permission != "operate":
            return None
        first = next(self.refusals(identity, now), None)
        return None if first is None else first.text

    def refusals(
        self,
        identity: Identity,
        now: float,
        *,
        claim: Claim | None = None,
        is_asking: bool = True,
    ) -> Iterator[Refusal]:
        """Yield every reason why an identity may not start here. `now`: seconds since 1970; `claim`: of
        the start, None where no start is meant yet; `is_asking`: the sentences are for this person, else
        about them."""
        who = "You" if is_asking else identity.person.name or "The starter"
        if self.is_unread:
            yield Refusal(
                "service", f"The rights of {self.name} cannot be read: an owner sets them."
            )
        elif self.locks:
            yield Refusal("service", self._out_of_service())
        if why := self._no_right(identity, who, now):
            yield Refusal("right", why)
        if why := self._no_baton(identity, who):
            yield Refusal("baton", why)
        if why := self._unconfirmed(identity, now, is_asking=is_asking):
            yield Refusal("confirm", why)
        if claim is not None and self.rules.watched and self.name not in claim.watching:
            yield Refusal("watched", self._unwatched(is_asking))
        if not (claim is not None and claim.is_drill) and (why := self.drill_due(now)):
            yield Refusal("drill", why)

    def drill_due(self, now: float) -> str:
        """Return why a Stop drill has to be made before the next start; "" if none has to be. A drill
        that is dated later than `now` (seconds since 1970) proves nothing: the clock has jumped."""
        days, now_us = self.rules.drill_days, round(now * 1e6)
        if days is None:
            return ""
        asked = f"its owner asks for one within {days} {'day' if days == 1 else 'days'}"
        for drill in reversed(self.drills):
            if drill.failure:
                return f"{self.drill_words(drill)} Make one that passes."
            if drill.at > now_us:
                continue
            if now_us - drill.stopped_at <= days * _DAY_US:
                return ""
            return f"The last Stop drill of {self.name} was on {_day(drill.stopped_at)}; {asked}."
        return f"No Stop drill of {self.name} has been made; {asked}."

    def over_limit(self, limits: tuple[Limit, ...], claim: Claim) -> Iterator[Refusal]:
        """Yield why a start may not send what it does. `limits`: those that are in force here."""
        if claim.limits is None:
            return
        if claim.limits.get(self.name, ()) != limits:
            text = f"The limits of {self.name} have changed since this was checked. Check it again."
            yield Refusal("limit", text)
        for each in claim.over[:_NAMED]:
            yield Refusal("limit", each.sentence(self.name))
        if len(claim.over) > _NAMED:
            more = len(claim.over) - _NAMED
            yield Refusal("limit", f"{more} more values are outside the limits of {self.name}.")

    def drill_words(self, drill: Drilled) -> str:
        """Return the sentence that says when a Stop drill was made, by whom, and how it ended."""
        by = f"{_day(drill.stopped_at)} by {_name(PersonRef(drill.author.id, drill.author.name))}"
        if drill.failure:
            return f"The Stop drill of {self.name} on {by} failed: {drill.failure}."
        took = (drill.proof_us or 0) / 1e6
        return f"The Stop drill of {self.name} on {by} passed: rest was proven after {took:.2f} s."

    def _unwatched(self, is_asking: bool) -> str:
        if is_asking:
            return (
                f"Say that you watch {self.name}, and that its hardware stop is within your reach."
            )
        return f"Nobody has said that they watch {self.name} with its hardware stop within reach."

    def _out_of_service(self) -> str:
        said = [f"{_name(each.by)}: “{each.reason.rstrip('. ')}”." for each in self.locks]
        return f"{self.name} is out of service. {' '.join(said[:_NAMED])} {self._unlocking()}"

    def _unlocking(self) -> str:
        names = _either([*(_name(each.by) for each in self.locks), "an owner"])
        return f"{names} can put {self.name} back into service."

    def _no_right(self, identity: Identity, who: str, now: float) -> str:
        """Return why the list of operators does not have an identity; "" if it has."""
        if self.rules.operators is None:
            return ""
        ids = {identity.person.id, *identity.groups}
        own = [each for each in self.rules.operators if each.id in ids]
        if any(each.until is None or now * 1e6 < each.until for each in own):
            return ""
        asked = self.set_by.name if self.set_by is not None and self.set_by.name else "an owner"
        if own:
            ended = _day(max(each.until or 0 for each in own))
            return f"{who} may not start on {self.name} any more: that right ended on {ended}. Ask {asked}."
        names = _either(each.name or each.id for each in self.rules.operators)
        may = f"only {names} may" if names else "its list names nobody"
        return f"{who} may not start on {self.name}: {may}. Ask {asked}."

    def _no_baton(self, identity: Identity, who: str) -> str:
        if not self.rules.baton:
            return ""
        if self.holder is None:
            return f"Nobody holds the baton of {self.name}: take it first."
        if self.holder.person.id == identity.person.id:
            return ""
        name = _name(self.holder.person)
        return (
            f"{who} may not start on {self.name}: {name} has its baton. Ask {name} to hand it over, or "
            "take it over with a reason."
        )

    def _unconfirmed(self, identity: Identity, now: float, *, is_asking: bool) -> str:
        """Return why the last confirmation of an identity does not count for a start here; "" if it
        does, or none is needed."""
        minutes = self.rules.ask_again
        if not minutes:
            return ""
        rule = f"A start on {self.name} needs a confirmation that is at most {minutes} min old"
        if identity.session is None:
            by = "the server's token" if identity.token is None else "a program"
            return f"{rule}, and {by} cannot give one: start on the page, in a browser."
        at = now if identity.asked_at is None else identity.asked_at
        if identity.confirmed_at is not None and identity.confirmed_at >= at - minutes * 60:
            return ""
        if is_asking:
            return f"{rule}: confirm that it is you."
        return f"{rule}: {identity.person.name or 'the starter'} has given none."

    # --- changes ------------------------------------------------------------------------------

    def after(self, event: RightsEvent) -> "RobotRights":
        """Return the rights after an event."""
        match event:
            case RightsSet(author=author, rules=rules):
                by = PersonRef(author.id, author.name)
                return replace(self, rules=rules, set_by=by, is_unread=False)
            case BatonPassed(holder=person, at=at):
                return replace(self, holder=None if person is None else Holder(person, at))
            case Locked(locks=locks) | Unlocked(locks=locks):
                return replace(self, locks=locks)
            case Drilled():
                return replace(self, drills=(*self.drills, event))

    def set_rules(self, rules: Rules, author: Author, at: int) -> tuple[RightsEvent, ...]:
        """Return the events by which an owner sets the rules. Without a baton nobody holds one."""
        event = RightsSet(at=at, author=author, rules=rules)
        if rules.baton or self.holder is None:
            return (event,)
        off = BatonPassed(at=at, how="off", author=author, was=self.holder.person)
        return (event, off)

    def take(self, by: Identity, author: Author, at: int, reason: str = "") -> BatonPassed | None:
        """Return the event by which a person takes the baton, from its holder if they give a reason;
        None if they hold it. Raise Forbidden if they may not start here, Conflict if somebody else
        holds it or there is none."""
        self._require_baton(by, at, "You")
        me = PersonRef(by.person.id, by.person.name)
        if self.holder is None:
            return BatonPassed(at=at, how="taken", author=author, holder=me)
        was = self.holder.person
        if was.id == me.id:
            return None
        if not reason:
            raise Conflict(
                f"{_name(was)} has the baton of {self.name}. Ask {_name(was)} to hand it over, or take it "
                "over with a reason.",
                where={"path": "/reason", "item": "baton"},
            )
        return BatonPassed(at=at, how="forced", author=author, was=was, holder=me, reason=reason)

    def hand(
        self, by: Identity, author: Author, to: Identity, at: int, run: str = ""
    ) -> BatonPassed:
        """Return the event by which the holder hands the baton to another person. Raise Conflict if
        `by` does not hold it, Forbidden if `to` may not start here."""
        was = self._require_holder(by)
        name = to.person.name or "that person"
        if to.person.id == was.id:
            raise Conflict(f"You hold the baton of {self.name} already.", where={"path": "/to"})
        self._require_baton(to, at, name)
        holder = PersonRef(to.person.id, to.person.name)
        return BatonPassed(at=at, how="handed", author=author, was=was, holder=holder, run=run)

    def drop(self, by: Identity, author: Author, at: int) -> BatonPassed:
        """Return the event by which the holder drops the baton. Raise Conflict if they do not hold
        it."""
        return BatonPassed(at=at, how="dropped", author=author, was=self._require_holder(by))

    def fall(self, at: int, why: str) -> BatonPassed | None:
        """Return the event by which the baton falls; None if nobody holds it."""
        if self.holder is None:
            return None
        return BatonPassed(at=at, how="fell", was=self.holder.person, reason=why)

    def lock(self, by: Identity, author: Author, at: int, reason: str) -> Locked:
        """Return the event by which a person puts the robot out of service; a lock of theirs that
        exists gets the new reason."""
        me = PersonRef(by.person.id, by.person.name)
        others = tuple(each for each in self.locks if each.by.id != me.id)
        return Locked(at=at, author=author, reason=reason, locks=(*others, Lock(me, at, reason)))

    def unlock(self, by: Identity, author: Author, at: int, of: str = "") -> Unlocked:
        """Return the event by which a person takes off their own lock, or an owner the lock of the
        person `of`. Raise Conflict if there is no such lock, Forbidden if it is somebody else's."""
        if not self.locks:
            raise Conflict(f"{self.name} is in service already.")
        is_owner = not isinstance(may(by, "share", now=at / 1e6), Denied)
        wanted = of or by.person.id
        found = next((each for each in self.locks if each.by.id == wanted), None)
        if found is None and is_owner and not of and len(self.locks) == 1:
            found = self.locks[0]
        if found is None and of:
            raise Conflict("That person has not locked it.", where={"path": "/of"})
        if found is None or (found.by.id != by.person.id and not is_owner):
            raise Forbidden(self._unlocking())
        left = tuple(each for each in self.locks if each is not found)
        return Unlocked(at=at, author=author, of=found.by, locks=left)

    def require_drill(self, drill: Drilled) -> None:
        """Raise Conflict if a drill may not be recorded: its run has one already that failed, or
        passed like this one, or there were too many within a day."""
        same = [each for each in self.drills if each.run == drill.run]
        if any(each.failure or not drill.failure for each in same):
            raise Conflict(
                f"The Stop drill with run {drill.number} is recorded already; make another one.",
                where={"path": "/run"},
            )
        if sum(drill.at - each.at < _DAY_US for each in self.drills) >= _MOST_DRILLS:
            raise Conflict(f"{_MOST_DRILLS} drills of {self.name} within a day are enough.")

    def _require_holder(self, by: Identity) -> PersonRef:
        if not self.rules.baton:
            raise Conflict(f"{self.name} has no baton: an owner can switch it on.")
        if self.holder is None:
            raise Conflict(f"Nobody holds the baton of {self.name}.", where={"item": "baton"})
        if self.holder.person.id != by.person.id:
            raise Conflict(
                f"{_name(self.holder.person)} has the baton of {self.name}, not you.",
                where={"item": "baton"},
            )
        return self.holder.person

    def _require_baton(self, identity: Identity, at: int, who: str) -> None:
        """Raise Conflict if the robot has no baton, Forbidden if this person may not start here."""
        if not self.rules.baton:
            raise Conflict(f"{self.name} has no baton: an owner can switch it on.")
        if not isinstance(may(identity, "operate", now=at / 1e6), Denied):
            why = self._no_right(identity, who, at / 1e6)
        else:
            why = f"{who} may not start on robots, so {self.name}'s baton is for others."
        if why:
            raise Forbidden(why, where={"item": "right"})


def _name(person: PersonRef) -> str:
    return person.name or "somebody without a name"


def _either(names: Iterable[str]) -> str:
    """Return names as "A, B or C"."""
    found = list(names)
    if len(found) > _NAMED:
        found = [*found[: _NAMED - 1], f"{len(found) - _NAMED + 1} others"]
    return " or ".join(filter(None, [", ".join(found[:-1]), *found[-1:]]))


def _day(us: int) -> str:
    """Return the day of a moment on the runner's computer."""
    return moment(us).astimezone().date().isoformat()
