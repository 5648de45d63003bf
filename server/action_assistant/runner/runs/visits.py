"""The visits of one action: exact from transitions, within bounds from snapshots.

A visit is one execution of an action's own code. The fold keeps a lower and an upper bound of its
begin and of its end. A bound that nothing proves is not set:

- An answer that was asked for at `asked_at` and came at `at` shows a state of some moment in between.
  Feedback that came at `at` shows a state of some earlier moment; how much earlier is not known: the
  engine empties its ring twice a second, a stop holds it up for seconds, networks delay.
- A visit has begun by the arrival of any snapshot that shows it running. It has not begun before the last
  answer that showed the action at rest was asked for; before any answer, not before the run was requested.
- A visit has ended by the arrival of any snapshot that shows the action at rest again, and not before the
  last answer that showed it running was asked for. That needs both snapshots to be of the same visit,
  which only the graph can tell (`once`, umrf.laps). For an action that may have begun anew in between, its
  begin alone bounds the end from below. A snapshot does not count after a pause either: code that returns
  while it is paused is shown running until it is resumed.
- ERROR is no end where a stop may have reached the action, which did not obey or threw: its code may go
  on, so that nothing bounds the end from above.
- Answers are in order, and so is feedback, but feedback may be older than an answer that came before it.
  An action that runs at most once only goes forward, so that a state which looks older is older. For any
  other action, feedback proves neither the end of a visit that an answer has shown nor a visit besides
  those, and borrows no lower bound from a recent answer (`_OLD_US`). The next answer does, which is asked
  for as soon as feedback comes.
- The number of visits is the smallest one that explains both orders, however they are mixed (`Changes`).
- The engine calls an action RUNNING a moment before its code begins, and a moment after it has ended;
  `MOMENT_US` is added to what such a snapshot proves.

Pure, and part of the fold of a run: old streams fold by the same rules.
"""

from typing import Final, Literal, TypeAlias, TypeVar

import msgspec
from msgspec.structs import replace

from action_assistant.runner.links.observations import ACTIVE, FAR, LogLevel, NodeResult

T = TypeVar("T")

Outcome: TypeAlias = Literal["true", "false", "error", "stopped"]
How: TypeAlias = Literal["observed", "inferred"]

#: Visits and messages of one action that a run keeps; older ones are in its events.
KEPT: Final = 100
#: Messages of one action that an engine keeps.
_RING: Final = 10
#: States of feedback that an action keeps, so that an answer finds those that came before it was asked for.
_FED: Final = 8
#: Microseconds that the engine's state may be ahead of, or behind, the action's code.
MOMENT_US: Final = 100_000
#: Microseconds within which feedback of an action that may run again is taken to have come: twice as long as a
#: stop that is not obeyed blocks an engine.
_OLD_US: Final = 10_000_000

_OUTCOMES: Final[dict[str, Outcome]] = {
    "on_true": "true",
    "on_false": "false",
    "on_error": "error",
    "on_stopped": "stopped",
}


class Visit(msgspec.Struct, frozen=True, gc=False, kw_only=True):
    """One execution of an action, in microseconds UTC. It began at `not_before` or later and at
    `start` or earlier; it ended at `until` or later (None: no end was seen) and at `not_after` or
    earlier (None: it may still go on). So `until` may lie before `start`: then there is no moment
    at which it was certainly going on. `how` says whether start and result were seen or inferred.
    `inputs`: the values that the engine reported during the visit; None when nobody saw them.
    `outputs`: those that an answer showed after it; None likewise."""

    start: int
    not_before: int
    until: int | None = None
    not_after: int | None = None
    result: Outcome | None = None
    how: How = "observed"
    inputs: dict[str, str] | None = None
    outputs: dict[str, str] | None = None

    @property
    def least(self) -> int:
        """The shortest time that it can have taken, in microseconds."""
        return max(0, (self.until or self.start) - self.start)

    @property
    def most(self) -> int | None:
        """The longest time that it can have taken, in microseconds; None when its end has no upper
        bound."""
        return None if self.not_after is None else self.not_after - self.not_before


class SnapshotEvidence(msgspec.Struct, frozen=True, gc=False, kw_only=True):
    """The facts about a snapshot that decide what it proves of an action. Times are microseconds
    UTC.

    `asked`: when it was asked for; None for feedback. `looked`: when the newest answer was asked
    for that showed the graph as it was known until now. `begun`: the action cannot have begun
    before. `once`: it runs at most once. `stoppable`: a person or an arrow may have stopped it.
    `followed`: an answer after this snapshot is recorded if it says more; older streams left out
    answers that repeated feedback.
    """

    at: int
    asked: int | None
    looked: int
    begun: int
    once: bool
    stoppable: bool
    followed: bool = True


class Message(msgspec.Struct, frozen=True, gc=False):
    """A message of an action, or a line of the engine's log. `level`: of a line; "" if unknown."""

    at: int
    text: str
    level: LogLevel = ""


class RestEvidence(msgspec.Struct, frozen=True, gc=False, array_like=True):
    """Times at which answers were asked for that showed an action at rest: the newest, and two
    older ones that lie at least `_OLD_US` apart."""

    newest: int = 0
    older: int = 0
    oldest: int = 0

    def and_at(self, asked: int) -> "RestEvidence":
        """Return this evidence with one more answer, requested at `asked` (µs UTC)."""
        if asked <= self.newest:
            return self
        if asked - self.older >= _OLD_US:
            return RestEvidence(asked, asked, self.older)
        return RestEvidence(asked, self.older, self.oldest)

    def by(self, moment: int) -> int:
        """Return the newest of the three times that is not later than `moment`; 0 without one."""
        kept = (self.newest, self.older, self.oldest)
        return next((each for each in kept if each <= moment), 0)


class Changes(msgspec.Struct, frozen=True, gc=False, array_like=True):
    """A state of an action that one source, answers or feedback, showed at `at` (microseconds UTC),
    and the smallest number of changes between rest and motion that can have led to it, `least`. In
    its n-th visit an action has made 2n - 1 changes, and 2n when that visit has ended."""

    state: str = "UNINITIALIZED"
    least: int = 0
    at: int = 0

    def to(self, state: str) -> int:
        """Return the smallest number of changes that can have led to `state`, if it was shown later
        than this one."""
        moves, moved = state in ACTIVE, self.least % 2 == 1
        if moves is not moved:
            return self.least + 1
        ran = not moves and state != self.state and state in {"FINISHED", "ERROR"}
        return self.least + 2 if ran else self.least


class ActionRun(msgspec.Struct, frozen=True, gc=False, kw_only=True):
    """The state of one action of a run. `older` counts visits that are not listed any more.

    `heard`: how many messages the engine has shown. `going`: the open visit ends at that moment or
    later. `since`: answers asked for until then showed the states before the present one. `by`,
    `changed_at`: what showed the present state first ("" for a transition), and when that came.
    `held`: it may have been paused during the visit. `joined`: it runs once unless an action fails.
    `doubted`: the present state is of feedback that may be older than the last answer; it may
    contradict `visits` until the next one. `call`: the number of the call that the last visit is,
    in a led run; `robot`: the engine that plays the action there; `piece`: the id of its newest
    piece. `answers`, `feedback`: the changes that each has shown. `levels`: the opened sub-graphs that
    it is inside of, the outermost first.
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
    doubted: bool = False
    call: int = 0
    robot: str = ""
    piece: str = ""
    answers: Changes = Changes()
    feedback: tuple[Changes, ...] = ()
    levels: tuple[str, ...] = ()

    @property
    def proven(self) -> int:
        """The least number of visits that explains all states which answers and feedback have
        shown."""
        fed = self.feedback[-1].least if self.feedback else 0
        return (max(self.answers.least, fed) + 1) // 2


def after_transition(
    action: ActionRun, state: str, at: int, inputs: dict[str, str] | None = None
) -> ActionRun:
    """Return the action after a transition to `state` at exactly `at` (µs UTC), which only the
    simulator reports. `inputs`: the values with which it began, None if unknown."""
    visits, older = action.visits, action.older
    if state in ACTIVE:
        if not is_open(action):
            visits, older = _kept(visits, older, Visit(start=at, not_before=at, inputs=inputs))
        elif inputs is not None and visits[-1].inputs is None:
            # An answer has shown this visit before, without inputs.
            visits = _and(visits[:-1], replace(visits[-1], inputs=inputs))
    elif is_open(action):
        result = visits[-1].result or _implied(action.state, state)
        may_go_on = state == "ERROR" and action.state == "STOPPING"
        after = None if may_go_on else at
        visits = _and(visits[:-1], replace(visits[-1], until=at, not_after=after, result=result))
    elif state == "ERROR" and action.state != "ERROR":  # it threw before it ran
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


def after_result(action: ActionRun, item: NodeResult) -> ActionRun:
    """Return the action after an exact result (`item`), which the simulator reports while the visit
    is open or right after its end."""
    visits = action.visits
    if visits:
        visits = _and(visits[:-1], replace(visits[-1], result=_OUTCOMES.get(item.result)))
    messages = action.messages
    if item.message is not None:
        messages = _and(messages[1 - KEPT :], Message(item.at, item.message))
    return replace(action, visits=visits, messages=messages)


def after_piece(
    action: ActionRun, call: int, state: str, visit: Visit | None, at: int
) -> ActionRun:
    """Return an action of a led run after its robot showed another state of the call with
    this number, at `at` (µs UTC). `visit`: that call, None as long as nothing of it was seen. An
    outcome that is there stays, unless the action is seen to go on."""
    visits, older = action.visits, action.older
    if visit is not None and action.call == call:
        last = visits[-1]
        if last.result is not None and visit.result is None and state not in ACTIVE:
            visit = replace(visit, result=last.result, how=last.how, outputs=last.outputs)
        visits = _and(visits[:-1], visit)
    elif visit is not None:
        visits, older = _kept(visits, older, visit)
    return replace(
        action,
        state=state,
        seen_at=at,
        visits=visits,
        older=older,
        call=call if visit is not None else action.call,
        heard=0 if visit is not None and action.call != call else action.heard,
        by="",
        changed_at=at,
    )


def after_outcome(
    action: ActionRun, call: int, outcome: str, how: How, outputs: dict[str, str] | None = None
) -> ActionRun:
    """Return an action of a led run after a call of it has its outcome, which its newest visit
    gets; unchanged if nothing was seen of that call. `call`: the number of the call; `how`:
    "observed" if an answer of its robot has shown the outcome, even where the visit (this one
    execution) was too short to be seen, else "inferred". `outputs`: the values that the answer
    showed, as texts for people."""
    if action.call != call or not action.visits:  # nothing of it was ever seen
        return action
    result = _OUTCOMES.get(outcome)
    ended = replace(action.visits[-1], result=result, how=how, outputs=outputs)
    return replace(action, visits=_and(action.visits[:-1], ended))


def with_possible_pause(action: ActionRun) -> ActionRun:
    """Return an open action as one that may be paused: from now on no snapshot of it proves that
    its code goes on."""
    return replace(action, held=True) if is_open(action) else action


def after_snapshot(
    action: ActionRun, state: str, sight: SnapshotEvidence, inputs: dict[str, str] | None = None
) -> ActionRun:
    """Return the action after a snapshot, which shows a state but not when that began. `sight`: the
    times and circumstances of the snapshot; `inputs`: the values in it, None if none were seen."""
    is_same = state == action.state
    if is_same and (sight.asked is None or not awaits_answer(action)):
        return action
    action = _counted(action, state, sight)
    if is_same and not action.doubted:
        return _confirmed(action, sight)
    action = _looked_at(action, sight)
    if _is_no_news(action, state, sight):
        asked = sight.asked or 0  # until then the known state was not shown
        return replace(action, since=max(action.since, asked)) if asked else action
    doubted = _may_be_old(action, sight)
    if (doubted or action.doubted) and not sight.followed:
        after = _blurred(action, state, sight)
    elif doubted:
        after = action
    elif state in ACTIVE:
        after = action if is_open(action) else _opened(action, sight, inputs)
    elif is_open(action):
        after = _closed(action, state, sight)
    elif state in {"FINISHED", "ERROR"} and not action.doubted:
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
        doubted=doubted,
    )


def _counted(action: ActionRun, state: str, sight: SnapshotEvidence) -> ActionRun:
    """Return the action with the least number of changes that can have led to the state in a
    snapshot (`sight`). Earlier snapshots of the same source precede it, and those of the other
    source where the times prove that."""
    fed, answers = action.feedback, action.answers
    if sight.asked is None:
        last = fed[-1] if fed else Changes()
        old = answers if answers.at <= sight.at - _OLD_US else Changes()
        shown = Changes(state, max(last.to(state), old.to(state)), sight.at)
        return replace(action, feedback=(*fed[1 - _FED :], shown))
    asked = sight.asked
    before = next((each for each in reversed(fed) if each.at <= asked), Changes())
    least = max(answers.to(state), before.to(state))
    return replace(action, answers=Changes(state, least, sight.at))


def awaits_answer(action: ActionRun) -> bool:
    """Return whether an answer that repeats the state shown by feedback would prove more than that."""
    return not action.once and action.by == "feedback" and (action.doubted or is_open(action))


def is_open(action: ActionRun) -> bool:
    """Return whether no end of the last visit was seen."""
    return bool(action.visits) and action.visits[-1].until is None


def _looked_at(action: ActionRun, sight: SnapshotEvidence) -> ActionRun:
    """Return the action with what follows from earlier answers that showed its present state: until
    the newest of them (`sight.looked`) it was at rest, or went on."""
    if sight.looked <= action.since:
        return action
    if action.state not in ACTIVE:
        return replace(action, rests=action.rests.and_at(sight.looked), since=sight.looked)
    if not sight.once or action.held or action.state not in {"RUNNING", "STOPPING"}:
        return action
    going = max(action.going, sight.looked - MOMENT_US)
    return replace(action, going=going, since=sight.looked)


def _is_no_news(action: ActionRun, state: str, sight: SnapshotEvidence) -> bool:
    """Return whether a snapshot may be older than what was seen so far, so that its state changes
    nothing."""
    if sight.once and _goes_back(action, state):
        return sight.asked is None or sight.asked < action.changed_at
    if sight.asked is not None:
        overtaken = action.by == "feedback" and sight.asked < action.changed_at
        return overtaken and not sight.once
    is_superseded = sight.followed and action.by == "get" and FAR.get(action.state, 0) > 0
    return is_superseded and not sight.once and state not in ACTIVE


def _may_be_old(action: ActionRun, sight: SnapshotEvidence) -> bool:
    """Return whether a snapshot is of feedback that may be older than the last answer, so that a
    visit in it may be one that answers have shown already."""
    if sight.once or sight.asked is not None or not action.visits:
        return False
    is_recent = sight.at - action.answers.at < _OLD_US
    return is_recent and (action.doubted or action.by == "get")


def _goes_back(action: ActionRun, state: str) -> bool:
    return FAR.get(state, 0) < FAR.get(action.state, 0)


def _confirmed(action: ActionRun, sight: SnapshotEvidence) -> ActionRun:
    """Return an action whose visit only feedback has shown so far, after an answer (`sight`) shows
    it running: the visit is the one in that answer, and began after the last answer that showed the
    action at rest."""
    if (sight.asked or 0) < action.changed_at:
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


def _blurred(action: ActionRun, state: str, sight: SnapshotEvidence) -> ActionRun:
    """Return an action of an older stream, in which no answer decides whether feedback is of the
    last visit or of another one: the last visit gets bounds that hold in both cases."""
    last = action.visits[-1]
    if state in ACTIVE and sight.asked is not None:
        last = replace(last, until=None, not_after=None, result=None)
    elif state in {"FINISHED", "ERROR"}:
        before, after = min(last.not_before, sight.begun), _not_after(state, sight)
        if after is not None and last.until is not None:
            after = None if last.not_after is None else max(after, last.not_after)
        last = replace(last, not_before=before, until=before, not_after=after)
    return replace(action, visits=_and(action.visits[:-1], last))


def _missed(action: ActionRun, state: str, sight: SnapshotEvidence) -> ActionRun:
    """Return the action with one more visit, which has ended (in `state`) and was never seen going
    on."""
    before = _not_before(action, sight)
    if action.by == "feedback" and not sight.once:  # its state may be older than the last answer
        before = min(before, max(action.rests.by(action.changed_at - _OLD_US), sight.begun))
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
    """Return the earliest time (µs UTC) at which a visit that a snapshot shows for the first time
    can have begun."""
    is_reliable = sight.once or sight.asked is not None
    rest = action.rests.newest if is_reliable else action.rests.by(sight.at - _OLD_US)
    return min(sight.at, max(rest, sight.begun))


def _not_after(state: str, sight: SnapshotEvidence) -> int | None:
    """Return the time (µs UTC) by which the action's code had certainly ended; None for an action
    that ended in ERROR and may have been stopped, since its code may go on."""
    return None if state == "ERROR" and sight.stoppable else sight.at


def with_messages(action: ActionRun, messages: tuple[str, ...], at: int) -> ActionRun:
    """Return the action with the new ones of these messages, which were shown at `at` (µs UTC): a
    snapshot repeats all messages that the engine still has."""
    first = len(messages) if is_heard(action, messages) else _known(action, messages)
    if first == len(messages):
        return action if first == action.heard else replace(action, heard=first)
    fresh = tuple(Message(at, text) for text in messages[first:])
    return replace(action, messages=(*action.messages, *fresh)[-KEPT:], heard=len(messages))


def is_heard(action: ActionRun, messages: tuple[str, ...]) -> bool:
    """Return whether all of these messages were seen before. An engine has the last ten, so that
    with each new one the oldest goes; that is noticed unless all of them have the same text."""
    if len(messages) != action.heard or not messages:
        return len(messages) <= action.heard
    last = action.messages[-len(messages) :]
    return len(messages) < _RING or messages == tuple(each.text for each in last)


def _known(action: ActionRun, messages: tuple[str, ...]) -> int:
    """Return how many of these messages, counted from the first, were seen before."""
    if len(messages) > action.heard:
        return action.heard
    last = tuple(each.text for each in action.messages[-len(messages) :])
    return next(n for n in range(len(last), -1, -1) if last[len(last) - n :] == messages[:n])


def _implied(before: str, after: str) -> Outcome | None:
    """Return the result that a change from the state `before` to `after` proves: "error",
    "stopped", or None."""
    if after == "ERROR":
        return "error"
    return "stopped" if before == "STOPPING" else None


def _and(items: tuple[T, ...], item: T) -> tuple[T, ...]:
    return items + (item,)  # noqa: RUF005 - the other way copies all of them twice


def _kept(visits: tuple[Visit, ...], older: int, visit: Visit) -> tuple[tuple[Visit, ...], int]:
    over = len(visits) + 1 - KEPT
    return (_and(visits[over:], visit), older + over) if over > 0 else (_and(visits, visit), older)
