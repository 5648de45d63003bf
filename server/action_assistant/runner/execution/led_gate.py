"""The gate of a led run, with the person for whom the run is led: it closes when that person may begin
nothing on one of its robots any more, and a person who may lets the run go on.

There is one gate. A person's *Wait*, the end of a step, a breakpoint, and each fault are reasons to
hold it, and only *go on* or a step opens it. A step opens it for one call.
"""

from collections.abc import Awaitable, Callable, Iterable, Mapping
from typing import Any, Final

from msgspec.structs import replace

from action_assistant.errors import BadInput, Conflict
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.execution.conducted_steps import (
    UNLIMITED,
    Gate,
    GoOn,
    LeftOpen,
    Step,
    StepLimit,
    Tell,
)
from action_assistant.runner.execution.led_look import LedLook
from action_assistant.runner.links.port import NotSent
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.rights import Claim
from action_assistant.runner.runs.events import (
    AlarmRaised,
    Author,
    BreakpointsSet,
    HandedOver,
    Held,
    HeldHow,
    PieceWaits,
    Released,
    Requested,
)
from action_assistant.runner.start.piece_texts import PieceText
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.model import Precondition
from action_assistant.umrf.semantics import Call
from action_assistant.web.auth.identity import Identity

#: Reasons that replace another one: whoever lets the run go on has seen the most serious.
_RANK: Final[Mapping[HeldHow, int]] = {"wait": 0, "step": 0, "breakpoint": 1, "trouble": 2}
_LONGEST_WHY: Final = 1_000  # characters of earlier reasons, from which on not all are shown


class LedGate(Gate):
    """Holds a led run and lets it go on. `first`: the first event of the run; `person`: for whom
    it is led, None until somebody lets it go on after a restart; `tell` shows and records an event."""

    def __init__(
        self,
        first: Requested,
        person: Identity | None,
        robots: Robots,
        look: LedLook,
        clock_us: ClockUs,
        tell: Tell,
    ) -> None:
        super().__init__()
        assert first.led is not None
        self.person = person
        #: What the rules of the robots ask about the run, with who watches them since the last start.
        self.claim = Claim(
            digest=first.tree_digest or first.digest,
            watching=frozenset(first.watching),
            beyond=first.beyond,
            is_led=True,
        )
        #: The robots that play actions of the run.
        self.robots: Final = frozenset(first.led.players.values())
        self._first = first
        self._look = look
        self._registry = robots
        self._clock_us = clock_us
        self._tell = tell
        self._reasons: set[str] = set()  # for which it is held now
        self._first_why, self._between = "", 0  # as far as it is shown, and how many are not
        self._ready: dict[int, Step] = {}  # the steps that wait before the gate, by call
        self._noted: set[int] = set()  # those of which that is recorded
        self._let: Step | None = None  # the only step that may pass, since a person let it
        self._let_by: Author | None = None
        self._limit = UNLIMITED  # how far it goes on, if not for one step
        self._levels = first.levels or {}
        #: Where the run waits, as its start or a person has set it.
        self.breakpoints = first.breakpoints
        self._calls: dict[str, set[int]] = {}  # that have begun so far, by full name of the action
        for number, node in first.before.calls.items() if first.before is not None else ():
            self._calls.setdefault(node, set()).add(number)
        self._reached: set[tuple[str, int]] = set()  # breakpoints before calls that were reached
        #: Called in the step in which the run is held.
        self.on_hold: Callable[[], None] = _ignore
        #: Returns why a person whose page is missing may not let the run go on, by robot; "" if they may.
        self.why_missing: Callable[[str, Identity], str] = _not_missing
        #: Stops the run in the name of the runner.
        self.stop_run: Callable[[], None] = _ignore

    def hold_run(
        self, why: str, by: Author | None = None, *, how: HeldHow = "trouble", node: str = ""
    ) -> None:
        """Hold the run and record that, unless it is stopped. If it is held already for a reason that is
        as serious, add this one to it, unless it says that already: whoever lets it go on has seen all
        of them. `by`: None for the runner; `node`: as in `Held`."""
        self._hold(Held(at=self._clock_us(), why=why, by=by, how=how, node=node))

    def wait_for_person(self, by: Author, reason: str, request_id: str) -> None:
        """Hold the run before its next action, since a person wants that; as `hold_run` if it is held.
        `reason`: given by the person, may be ""; `request_id`: the request id of the press."""
        why = f"{by.name} made it wait: {reason}" if reason else f"{by.name} made it wait."
        now = self._clock_us()
        held = Held(at=now, why=why, by=by, how="wait", reason=reason, request_id=request_id)
        self._hold(held, by.id)

    def _hold(self, held: Held, author: str = "") -> None:
        known = self.held
        if known is None:
            self._reasons, self._first_why = set(), ""
        is_told = held.why in self._reasons
        # Each press of a person counts, also one with the same words: nothing goes on past it.
        if self.is_final or (is_told and held.by is None):
            return
        self._reasons.add(held.why)
        if known is not None and _RANK[known.how] >= _RANK[held.how]:
            why = known.why if is_told else self._with(known.why, held.why)
            held = replace(held, how=known.how, why=why, node=known.node)
        self.hold(held)
        self.on_hold()
        self._let, self._let_by, self._limit = None, None, UNLIMITED
        self._tell(held, author)
        for step in self._ready.values():
            self._note_waiting(step)

    def _with(self, earlier: str, newest: str) -> str:
        """Return earlier reasons with the newest. When they have become long, the first ones and the
        newest are kept, and it is told how many stand between them."""
        if not self._first_why:
            if len(earlier) > _LONGEST_WHY:
                self._first_why, self._between = earlier, 0
            return f"{earlier} {newest}"
        self._between += 1
        others = "1 more reason stands" if self._between == 1 else f"{self._between} more stand"
        return f"{self._first_why} … {others} in the events of the run. {newest}"

    def _note_waiting(self, step: Step) -> None:
        call = step.call.number
        if call not in self._noted:
            self._noted.add(call)
            now = self._clock_us()
            self._tell(PieceWaits(at=now, call=call, node=step.node, engine=step.engine))

    async def admit(self, step: Step) -> None:
        """Wait until the gate lets the piece of this step pass, and record that it waits."""
        self.halt_before(step)
        if self.lets(step):
            return
        self._ready[step.call.number] = step
        try:
            if self.held is not None:
                self._note_waiting(step)
            while not self.lets(step):
                await self._opened.wait()
                self.halt_before(step)
        finally:
            del self._ready[step.call.number]
            self._noted.discard(step.call.number)

    def lets(self, step: Step) -> bool:
        """Return whether the piece of this step may leave now."""
        return self.is_open and self._let in (None, step)

    def halt_before(self, step: Step) -> None:
        """Hold the run if it is to wait before this step: since a person wants that, or at a
        breakpoint, once for each call."""
        self._calls.setdefault(step.node, set()).add(step.call.number)
        if step is self._let or (self.held is not None and self.held.how == "trouble"):
            return
        if self.is_open and self._ends_at(step):
            over = " › ".join(self._limit.over)
            why = f"It went over {over}: {step.node} waits to begin."
            if not over:
                why = f"It went on until {step.node}, which waits to begin."
            self.hold_run(why, self._let_by, how="step", node=step.node)
        call = step.call
        for each in self.breakpoints:
            if (
                each.is_at_end
                or each.action != step.node
                or (each.action, call.number) in self._reached
            ):
                continue
            if each.holds(self.visit(call), call.inputs):
                self._reached.add((each.action, call.number))
                self.hold_run(f"Breakpoint {each.words()}.", how="breakpoint", node=step.node)

    def _ends_at(self, step: Step) -> bool:
        """Return whether the run goes on only until this step is about to begin."""
        limit = self._limit
        return step.node == limit.until or (bool(limit.over) and not self._is_in(step, limit.over))

    def _is_in(self, step: Step, over: tuple[str, ...]) -> bool:
        """Return whether the action of a step is inside of this opened sub-graph."""
        return self._levels.get(step.node, ())[: len(over)] == over

    def take_up(self, left: LeftOpen) -> None:
        """Continue with the visits and breakpoints of a run that an earlier process left."""
        self.breakpoints = left.breakpoints
        for number, node in left.calls.items():
            self._calls.setdefault(node, set()).add(number)

    def visit(self, call: Call) -> int:
        """Return the number of a call among those of its action, from 1."""
        return sum(number <= call.number for number in self._calls.get(call.node, ()))

    def halt_after(self, step: Step, outcome: Precondition, outputs: Mapping[str, Any]) -> None:
        """Hold the run at the breakpoints after this step, which has ended, before anything follows.
        `outputs`: its values by flat name."""
        told = outcome.removeprefix("on_")
        for each in self.breakpoints:
            is_here = each.is_at_end and each.action == step.node and told in each.outcomes
            if is_here and each.holds(self.visit(step.call), outputs):
                self.hold_run(f"Breakpoint {each.words()}.", how="breakpoint", node=step.node)

    def set_breakpoints(self, author: Author, breakpoints: tuple[Breakpoint, ...]) -> None:
        """Let the run wait at these breakpoints from now on, and record that. A run that already
        waits at a breakpoint goes on waiting, even if that breakpoint is no longer among these."""
        self.breakpoints = breakpoints
        event = BreakpointsSet(at=self._clock_us(), author=author, breakpoints=breakpoints)
        self._tell(event, author.id)

    def passed(self, step: Step) -> None:
        """Hold the run again if this step was the only one that might pass: its piece has left, or
        it has ended without one."""
        if step is self._let:
            self.hold_run("One step was made.", self._let_by, how="step", node=step.node)

    def _next(self, limit: StepLimit) -> Step | None:
        """Return the only step that this limit lets pass; None if the limit lets several pass.
        Raise BadInput for a name that no action has. Raise Conflict if the step that should pass
        does not wait, or if the action before which the run should wait is already waiting to
        begin."""
        for path, name in (("/action", limit.action), ("/until", limit.until)):
            if name and name not in self._first.actions:
                raise BadInput(f"{name} is no action of this run.", where={"path": path})
        ready = [self._ready[call] for call in sorted(self._ready)]
        if limit.over:
            self._require_over(limit.over, ready)
        if limit.until in {step.node for step in ready}:
            text = f"{limit.until} waits to begin already: let it begin by a step."
            raise Conflict(text, where={"path": "/until"})
        if not limit.only:
            return None
        found = [step for step in ready if limit.action in {"", step.node}]
        if found:
            return found[0]
        names = ", ".join(f"{step.node} on {step.engine}" for step in ready)
        what = f"Only {names} waits to begin." if names else "No action waits to begin now."
        raise Conflict(f"No step was made. {what}", where={"path": "/action"})

    def _require_over(self, over: tuple[str, ...], ready: list[Step]) -> None:
        """Raise BadInput if the run has opened no such sub-graph; Conflict if no action inside of it waits
        to begin, or another one does."""
        where: dict[str, object] = {"path": "/over"}
        name = " › ".join(over)
        if all(levels[: len(over)] != over for levels in self._levels.values()):
            raise BadInput(f"{name} is no sub-graph that this run has opened.", where=where)
        outside = ", ".join(step.node for step in ready if not self._is_in(step, over))
        if outside or not ready:
            what = f"{outside} waits to begin" if outside else "No action waits to begin now"
            raise Conflict(f"No step was made. {what}.", where=where)

    def why_not_allowed(self, robot: str) -> str:
        """Return the reason why the person for whom the run is led may begin nothing on a robot
        now; "" if they may."""
        return self._look.why_not_allowed(robot, self.person, self.claim)

    def hold_to_limits(self, step: Step, text: PieceText) -> None:
        """Check the values of the piece that is sent for `step` against the present limits of its
        robot. If one is outside, hold the run, raise an alarm, stop the run and raise NotSent.
        `text`: the text of the piece."""
        over = text.over(self._look.limits_of(step.engine), step.call.inputs)
        if over is not None:
            why = over.sentence(step.engine)
            self.hold_run(why, node=step.node)
            self._tell(AlarmRaised(self._clock_us(), "led_limit", why))
            self.stop_run()
            raise NotSent(why)

    def rights_changed(self, robot: str) -> None:
        """Hold the run if the person for whom it is led may begin nothing on a robot any more."""
        if self.person is not None:
            why = self._look.why_not_allowed(robot, self.person, self.claim, is_decided=True)
            if why:
                self.hold_run(why)

    async def hand_over(
        self, author: Author, to: Identity, pass_batons: Callable[[], Awaitable[None]]
    ) -> None:
        """Lead the run for another person from now on; it goes on, unless one of its robots has to be
        watched, which that person has not said yet. `pass_batons`: hands over the batons of its robots
        in the step of its call, and waits until that is stored. Raise what it raises."""
        with self.waiting():
            self.person = to
            self.claim = replace(self.claim, watching=frozenset())
            person = Author(to.person.id, to.person.name)
            self._tell(HandedOver(at=self._clock_us(), author=author, to=person), author.id)
            await pass_batons()

    async def go_on(self, press: GoOn, names: Iterable[str]) -> None:
        """Wait for the answers of the robots with these names, then let a held run go on. Raise
        BadInput if the limit names no action of the run, Conflict if one of the robots may begin no
        piece, if the run is held no more as it was, if nothing waits for a step, or if the person may
        not start on one of its robots any more."""
        held, lead = self.held, press.lead
        step = self._next(press.limit)
        claim = replace(self.claim, watching=frozenset(press.watching))
        await self._look.before_going_on(self._registry, names, self._first, lead, claim)
        if held is None or self.held is not held or self.is_final:
            text = "The run has gone on, was stopped, or has another reason to wait meanwhile. Look at it first."
            raise Conflict(text)
        if step is not self._next(press.limit):
            raise Conflict("Another action waits to begin than before. Look at it first.")
        for name in sorted(self.robots):  # in the step in which the gate opens
            why = self._look.why_not_allowed(name, lead, claim) or self.why_missing(name, lead)
            if why:
                raise Conflict(f"Nothing has gone on. {why}", where={"path": "/robots"})
        self.person, self.claim = lead, claim
        self._let, self._let_by, self._limit = step, press.author, press.limit
        released = Released(
            at=self._clock_us(),
            author=press.author,
            since=held.at,
            request_id=press.request_id,
            watching=press.watching,
            step=step.node if step is not None else "",
            until=press.limit.until,
            over=press.limit.over,
        )
        self._tell(released, press.author.id)
        self.release()


def _ignore() -> None:
    """Do nothing: before the run is led."""


def _not_missing(_robot: str, _lead: Identity) -> str:
    """Return "": where no page is asked for."""
    return ""
