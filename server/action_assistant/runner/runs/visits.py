"""The visits of one action: exact from transitions, within bounds from snapshots.

A visit is one execution of an action's own code. Of its begin and its end the fold keeps a lower and
an upper bound each, and a bound that nothing proves is none:

- An answer that was asked for at `asked_at` and came at `at` shows a state of some moment in between.
  Feedback that came at `at` shows a state of some moment before; how long before, nothing tells: the
  engine empties its ring twice a second, a stop holds it up for seconds, networks delay.
- It has begun by the arrival of whatever shows it running, and not before the asking for the last
  answer that showed it at rest; before any answer, not before the run was requested.
- It has ended by the arrival of whatever shows it at rest again, and not before the asking for the
  last answer that showed it running. That needs that both sights are of the same visit, which only
  the graph can tell (`once`, umrf.laps); of an action that may have begun anew in between, nothing
  but its begin bounds the end from below. Nor does a sight count after a pause: code that returns
  while it is paused is shown running until it is resumed.
- ERROR is no end where a stop may have reached the action, which did not obey or threw at it: its code
  may go on, so nothing bounds the end from above.
- Feedback may be older than an answer that came before it. An action that runs at most once only goes
  forward, so what looks older is older. Of any other, feedback does not tell the end of what an answer
  has shown, and borrows no lower bound from a recent answer (`_OLD_US`); answers, which are ordered
  among themselves, do both, and one is asked for as soon as feedback comes.
- The engine calls an action RUNNING a moment before its code begins, and for a moment after it ended;
  `MOMENT_US` is added to what such a sight proves.

Pure, and part of the fold of a run: what stands in old streams folds by the same rules.
"""

from typing import Final, Literal, TypeAlias, TypeVar

import msgspec
from msgspec.structs import replace

from action_assistant.runner.links.observations import ACTIVE, FAR, NodeResult

T = TypeVar("T")

Outcome: TypeAlias = Literal["true", "false", "error", "stopped"]
How: TypeAlias = Literal["observed", "inferred"]

#: Visits and messages of one action that a run carries; older ones are in its events.
KEPT: Final = 100
#: Messages of one action that an engine keeps.
_RING: Final = 10
#: What may lie between a state of the engine and the action's code, in microseconds.
MOMENT_US: Final = 100_000
#: Feedback of actions that may run again is taken to be younger than this: twice what a stop that is
#: not obeyed holds an engine up for.
_OLD_US: Final = 10_000_000

_OUTCOMES: Final[dict[str, Outcome]] = {
    "on_true": "true",
    "on_false": "false",
    "on_error": "error",
    "on_stopped": "stopped",
}


class Visit(msgspec.Struct, frozen=True, gc=False, kw_only=True):
    """One execution of an action, in microseconds UTC.

    It began at `not_before` or later and at `start` or earlier; it ended at `until` or later (None:
    no end was seen) and at `not_after` or earlier (None: as far as is known it may still go on). So
    `until` may lie before `start`: then no moment is known at which it was going on for certain.
    `how` says whether start and result were seen or follow from other things. `inputs`: the values
    that the engine reported while it went on; None when nobody saw them.
    """

    start: int
    not_before: int
    until: int | None = None
    not_after: int | None = None
    result: Outcome | None = None
    how: How = "observed"
    inputs: dict[str, str] | None = None

    @property
    def least(self) -> int:
        """It took at least so long. Microseconds."""
        return max(0, (self.until or self.start) - self.start)

    @property
    def most(self) -> int | None:
        """It took at most so long; None when its end has no upper bound."""
        return None if self.not_after is None else self.not_after - self.not_before


class SnapshotEvidence(msgspec.Struct, frozen=True, gc=False, kw_only=True):
    """A snapshot as evidence. `asked`: when it was asked for; None for feedback. `looked`: when the
    newest answer was asked for that showed the graph as it was known until now. `begun`: when nothing
    can have happened before. `once`: the action runs at most once. `stoppable`: somebody or something
    may have stopped it. `followed`: an answer that comes after it is recorded, if that says more;
    older streams left out answers that said the same as feedback had."""

    at: int
    asked: int | None
    looked: int
    begun: int
    once: bool
    stoppable: bool
    followed: bool = True


class Message(msgspec.Struct, frozen=True, gc=False):
    """What an action had to say."""

    at: int
    text: str


class RestEvidence(msgspec.Struct, frozen=True, gc=False, array_like=True):
    """When answers were asked for that showed an action at rest: the newest, and two older ones that
    lie at least `_OLD_US` apart."""

    newest: int = 0
    older: int = 0
    oldest: int = 0

    def and_at(self, asked: int) -> "RestEvidence":
        """With one more."""
        if asked <= self.newest:
            return self
        if asked - self.older >= _OLD_US:
            return RestEvidence(asked, asked, self.older)
        return RestEvidence(asked, self.older, self.oldest)

    def by(self, moment: int) -> int:
        """The newest of these that is not later than `moment`."""
        kept = (self.newest, self.older, self.oldest)
        return next((each for each in kept if each <= moment), 0)


class ActionRun(msgspec.Struct, frozen=True, gc=False, kw_only=True):
    """One action of the run. `older` counts visits that are not listed any more.

    `going`: the visit that is open ended at that moment or later. `since`: up to which answer (the
    time of its asking) states before the present one were shown. `by`, `changed_at`: what showed the
    present state first, and when that came. `held`: it was paused during the visit.
    """

    aid: str | None = None
    state: str = "UNINITIALIZED"
    seen_at: int = 0
    visits: tuple[Visit, ...] = ()
    older: int = 0
    messages: tuple[Message, ...] = ()
    heard: int = 0
    once: bool = False
    joined: bool = False
    going: int = 0
    since: int = 0
    by: Literal["", "get", "feedback"] = ""
    changed_at: int = 0
    held: bool = False
    rests: RestEvidence = RestEvidence()


def changed(
    action: ActionRun, state: str, at: int, inputs: dict[str, str] | None = None
) -> ActionRun:
    """After an exact transition."""
    visits, older = action.visits, action.older
    if state in ACTIVE:
        if not is_open(action):
            visits, older = _kept(visits, older, Visit(start=at, not_before=at, inputs=inputs))
        elif inputs is not None and visits[-1].inputs is None:  # an answer had shown it before
            visits = _and(visits[:-1], replace(visits[-1], inputs=inputs))
    elif is_open(action):
        result = visits[-1].result or _implied(action.state, state)
        after = None if state == "ERROR" and action.state == "STOPPING" else at  # its code goes on
        visits = _and(visits[:-1], replace(visits[-1], until=at, not_after=after, result=result))
    elif state == "ERROR" and action.state != "ERROR":  # thrown while it was made ready
        visit = Visit(start=at, not_before=at, until=at, not_after=at, result="error")
        visits, older = _kept(visits, older, visit)
    rests = action.rests if state in ACTIVE else action.rests.and_at(at)
    return replace(
        action,
        state=state,
        seen_at=at,
        visits=visits,
        older=older,
        going=at,
        by="",
        changed_at=at,
        rests=rests,
    )


def resulted(action: ActionRun, item: NodeResult) -> ActionRun:
    """After an exact result; it comes while the visit is still open, or right after its end."""
    visits = action.visits
    if visits:
        visits = _and(visits[:-1], replace(visits[-1], result=_OUTCOMES.get(item.result)))
    messages = action.messages
    if item.message is not None:
        messages = _and(messages[1 - KEPT :], Message(item.at, item.message))
    return replace(action, visits=visits, messages=messages)


def paused(action: ActionRun) -> ActionRun:
    """Somebody may have paused it: from now on no sight of it proves that its code goes on."""
    return replace(action, held=True) if is_open(action) else action


def shown(
    action: ActionRun, state: str, sight: SnapshotEvidence, inputs: dict[str, str] | None = None
) -> ActionRun:
    """After a snapshot, which says how things are but not when they became so."""
    if state == action.state:
        return _confirmed(action, sight)
    action = _looked_at(action, sight)
    if _is_no_news(action, state, sight):
        asked = sight.asked or 0  # it does not show the state that is known
        return replace(action, since=max(action.since, asked)) if asked else action
    if state in ACTIVE:
        after = action if is_open(action) else _opened(action, sight, inputs)
    elif is_open(action):
        after = _closed(action, state, sight)
    elif state in {"FINISHED", "ERROR"} and _ran_meanwhile(action, sight):
        after = _missed(action, state, sight)
    else:
        after = action
    return replace(
        after,
        state=state,
        seen_at=sight.at,
        since=sight.looked,
        by="feedback" if sight.asked is None else "get",
        changed_at=sight.at,
        held=is_open(after) and (after.held or state in {"PAUSE_REQUESTED", "PAUSED"}),
        once=action.once and not _goes_back(action, state),
    )


def awaits_answer(action: ActionRun) -> bool:
    """Whether an answer that shows the same as feedback did before would still say more."""
    return not action.once and action.by == "feedback" and is_open(action)


def is_open(action: ActionRun) -> bool:
    """Whether a visit goes on, as far as is known."""
    return bool(action.visits) and action.visits[-1].until is None


def _looked_at(action: ActionRun, sight: SnapshotEvidence) -> ActionRun:
    """Once answers have shown it in its present state: what that proves."""
    if sight.looked <= action.since:
        return action
    if not is_open(action):
        return replace(action, rests=action.rests.and_at(sight.looked), since=sight.looked)
    if not sight.once or action.held or action.state not in {"RUNNING", "STOPPING"}:
        return action
    going = max(action.going, sight.looked - MOMENT_US)
    return replace(action, going=going, since=sight.looked)


def _is_no_news(action: ActionRun, state: str, sight: SnapshotEvidence) -> bool:
    """Whether this may be older than what is known, and so changes nothing."""
    if sight.once and _goes_back(action, state):
        return sight.asked is None or sight.asked < action.changed_at
    if sight.asked is not None:
        overtaken = action.by == "feedback" and sight.asked < action.changed_at
        return overtaken and not sight.once and state != action.state
    told = sight.followed and action.by == "get" and FAR.get(action.state, 0) > 0
    return told and not sight.once and state not in ACTIVE


def _goes_back(action: ActionRun, state: str) -> bool:
    return FAR.get(state, 0) < FAR.get(action.state, 0)


def _confirmed(action: ActionRun, sight: SnapshotEvidence) -> ActionRun:
    """An answer shows running what only feedback has shown so far: it is the visit of that answer
    from now on, which began after the last answer that showed rest."""
    if sight.asked is None or not awaits_answer(action) or sight.asked < action.changed_at:
        return action
    last = action.visits[-1]
    before = min(sight.at, max(last.not_before, action.rests.newest))
    anchored = replace(last, not_before=before, start=sight.at + MOMENT_US)
    return replace(action, visits=_and(action.visits[:-1], anchored), by="get", going=before)


def _opened(action: ActionRun, sight: SnapshotEvidence, inputs: dict[str, str] | None) -> ActionRun:
    before = _not_before(action, sight)
    visit = Visit(start=sight.at + MOMENT_US, not_before=before, inputs=inputs)
    visits, older = _kept(action.visits, action.older, visit)
    return replace(action, visits=visits, older=older, going=before, held=False)


def _closed(action: ActionRun, state: str, sight: SnapshotEvidence) -> ActionRun:
    last = action.visits[-1]
    if (
        action.by == "get" and sight.asked is None and not sight.once
    ):  # of this visit, or an older one
        before = min(last.not_before, max(action.rests.by(sight.at - _OLD_US), sight.begun))
        last, action = replace(last, not_before=before), replace(action, going=before)
    implied = last.result or _implied(action.state, state)
    how: How = "inferred" if implied is not None and last.result is None else last.how
    after = _not_after(state, sight)
    ended = replace(
        last,
        start=min(last.start, max(sight.at, last.not_before)),
        until=max(last.not_before, action.going),
        not_after=after if after is None else max(after, last.not_before, action.going),
        result=implied,
        how=how,
    )
    return replace(action, visits=_and(action.visits[:-1], ended))


def _ran_meanwhile(action: ActionRun, sight: SnapshotEvidence) -> bool:
    """Whether one state of rest after another says that it ran in between. Feedback that was older
    than an answer may have told the first."""
    return sight.once or action.by != "feedback" or FAR.get(action.state, 0) == 0


def _missed(action: ActionRun, state: str, sight: SnapshotEvidence) -> ActionRun:
    """It has ended, and was never seen going on."""
    before = _not_before(action, sight)
    visit = Visit(
        start=sight.at,
        not_before=before,
        until=before,
        not_after=_not_after(state, sight),
        result="error" if state == "ERROR" else None,
        how="inferred",
    )
    visits, older = _kept(action.visits, action.older, visit)
    return replace(action, visits=visits, older=older)


def _not_before(action: ActionRun, sight: SnapshotEvidence) -> int:
    """Since when it may have begun."""
    told = sight.once or sight.asked is not None
    rest = action.rests.newest if told else action.rests.by(sight.at - _OLD_US)
    return min(sight.at, max(rest, sight.begun))


def _not_after(state: str, sight: SnapshotEvidence) -> int | None:
    """When its code had ended; None of one that was told to stop and failed, which may go on."""
    return None if state == "ERROR" and sight.stoppable else sight.at


def heard(action: ActionRun, messages: tuple[str, ...], at: int) -> ActionRun:
    """A snapshot repeats all messages so far; only the new ones are added."""
    first = len(messages) if is_heard(action, messages) else _known(action, messages)
    if first == len(messages):
        return action if first == action.heard else replace(action, heard=first)
    fresh = tuple(Message(at, text) for text in messages[first:])
    return replace(action, messages=(*action.messages, *fresh)[-KEPT:], heard=len(messages))


def is_heard(action: ActionRun, messages: tuple[str, ...]) -> bool:
    """Whether none of these messages is new. An engine keeps the last ten: then the oldest goes with
    each new one, which shows as long as they do not all say the same."""
    if len(messages) != action.heard or not messages:
        return len(messages) <= action.heard
    last = action.messages[-len(messages) :]
    return len(messages) < _RING or messages == tuple(each.text for each in last)


def _known(action: ActionRun, messages: tuple[str, ...]) -> int:
    """How many of these messages, from the first on, are those that were heard last."""
    if len(messages) > action.heard:
        return action.heard
    last = tuple(each.text for each in action.messages[-len(messages) :])
    return next(n for n in range(len(last), -1, -1) if last[len(last) - n :] == messages[:n])


def _implied(before: str, after: str) -> Outcome | None:
    """The result that a pair of states leaves no doubt about."""
    if after == "ERROR":
        return "error"
    return "stopped" if before == "STOPPING" else None


def _and(items: tuple[T, ...], item: T) -> tuple[T, ...]:
    return items + (item,)  # noqa: RUF005 - the other way copies all of them twice


def _kept(visits: tuple[Visit, ...], older: int, visit: Visit) -> tuple[tuple[Visit, ...], int]:
    over = len(visits) + 1 - KEPT
    return (_and(visits[over:], visit), older + over) if over > 0 else (_and(visits, visit), older)
