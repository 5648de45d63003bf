"""Acts on pages of operators that are missing: the gate of a led run closes, later the run is stopped.

A page answers while it is visible. That is no enabling device: it shows that a window is in view, not
that somebody looks. Stop itself knows nothing of this, and a page that comes back opens nothing.
"""

import logging
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import Final

import anyio

from action_assistant.runner.execution.open_runs import OpenRuns
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.runs.page_presence import PagePresence
from action_assistant.runner.runs.run import Run
from action_assistant.runner.start.rights_registry import RightsRegistry
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import PersonRef

log: Final = logging.getLogger(__name__)

_POLL_S: Final = 0.25
_STALL_S: Final = 1.0  # a look that is so late: this process stood still
_FRESH_S: Final = 2.0  # in which pages answer anew after that
_REST_S: Final = 10.0  # between two such times: stalls that repeat do not switch the watch off
_MOST_STALLS: Final = 100


class _Duty:
    """The people of a run of whom one has to have a visible page for a robot. `began`: since when the
    robot asks for it in this run; `seen`: when one of those who had to be there last was, in seconds of
    the event loop. Whoever takes a baton on a page is there at that moment; a program that does so
    gives the run no time."""

    def __init__(self, rule: PagePresence, now: float) -> None:
        self.rule = rule
        self.began = self.seen = now
        self.people: tuple[PersonRef, ...] = ()

    def ask(self, people: tuple[PersonRef, ...], seen: Iterable[float | None]) -> None:
        """Ask these people from now on. `seen`: when each of them was there last."""
        self.people = people
        self.seen = max([self.seen, *(at for at in seen if at is not None)])


class OperatorPages:
    """Watches the pages of operators for the runs that go on. `hold` is called with the id of a led
    run and the reason, at each look while a page is missing; `stop` with a run, a robot and the
    reason."""

    def __init__(
        self,
        rights: RightsRegistry,
        runs: OpenRuns,
        hold: Callable[[str, str], None],
        stop: Callable[[OpenRun, str, str], None],
    ) -> None:
        self._rights = rights
        self._runs = runs
        self._hold = hold
        self._stop = stop
        self._duties: dict[tuple[str, str], _Duty] = {}  # by run and robot
        self._stalls: deque[tuple[float, float]] = deque(maxlen=_MOST_STALLS)  # when over, how long
        self._looked_at: float | None = None
        self._fresh_until = 0.0
        self._news = anyio.Event()

    def look(self) -> None:
        """Look again now: a rule has changed."""
        self._news.set()

    async def run(self) -> None:
        """Look at all runs until cancelled; without a rule, wait for one."""
        while True:
            self._news = anyio.Event()
            is_asking = self._rights.asks_for_pages
            if is_asking:
                try:
                    self._look()
                except Exception:  # whatever it is: the next look comes
                    log.exception("the pages of operators could not be looked at")
            else:
                self._looked_at = None
                self._duties.clear()
            with anyio.move_on_after(_POLL_S if is_asking else None):
                await self._news.wait()

    def why_missing(self, run: str, robot: str, lead: Identity) -> str:
        """Return why a person whose page is missing may not let a run go on, as a sentence; "" if they
        may. Whoever does it on a page is there."""
        duty = self._duties.get((run, robot))
        if duty is None or self._rights.page_presence_of(robot) is None:
            return ""
        people = self._with_holder(robot, PersonRef(lead.person.id, lead.person.name))
        if self._missing_s(people, duty.began) < duty.rule.wait_s:
            return ""
        return self._why(robot, people, duty.rule.wait_s)

    # --- looking ------------------------------------------------------------------------------

    def _look(self) -> None:
        now = anyio.current_time()
        stood_s = 0.0 if self._looked_at is None else now - self._looked_at - _POLL_S
        self._looked_at = now
        is_stalled = stood_s > _STALL_S
        if is_stalled:
            log.warning("the runner stood still for %.1f s: pages are asked anew", stood_s)
            self._stalls.append((now, stood_s))
            if now >= self._fresh_until + _REST_S:
                self._fresh_until = now + _FRESH_S
        before, self._duties = self._duties, {}
        for opened, robot, rule in self._asking():
            key = opened.run.id, robot
            duty = before.get(key)
            if duty is None or duty.rule != rule:
                duty = _Duty(rule, now)
            self._duties[key] = duty
            people = self._with_holder(robot, _responsible(opened.run))
            # Who handed it over since the last look was there then.
            asked = (*duty.people, *people)
            duty.ask(people, [self._rights.seen_at(each.id) for each in asked])
            try:
                if is_stalled:
                    text = f"This runner stood still for {stood_s:.0f} s: visible pages are asked anew."
                    opened.alarm("page_asked_anew", text)
                elif now >= self._fresh_until:
                    self._act(opened, robot, duty)
            except Exception:  # the other runs are looked at
                log.exception("a missing page could not be acted on")

    def _asking(self) -> Iterator[tuple[OpenRun, str, PagePresence]]:
        """Yield the runs that go on, with each robot that asks for a visible page."""
        for opened in tuple(self._runs.by_id.values()):
            run = opened.run
            if run.end is not None or run.desired == "stopped":
                continue
            # A piece is watched with its run, unless that could not be read after a restart.
            if opened.is_led and run.piece is not None and run.piece.run in self._runs.by_id:
                continue
            for robot in run.robots:
                rule = self._rights.page_presence_of(robot)
                if rule is not None:
                    yield opened, robot, rule

    def _act(self, opened: OpenRun, robot: str, duty: _Duty) -> None:
        missing_s = self._missing_s(duty.people, duty.seen)
        rule = duty.rule
        if missing_s >= rule.wait_s and opened.run.led is not None:
            self._hold(opened.run.id, self._why(robot, duty.people, rule.wait_s))
        if missing_s >= rule.stop_s and opened.run.desired != "stopped":
            self._stop(opened, robot, self._why(robot, duty.people, rule.stop_s))

    def _missing_s(self, people: tuple[PersonRef, ...], since: float) -> float:
        """Return for how many seconds none of these people had a visible page, from `since` on, without
        those in which this process stood still."""
        seen = [self._rights.seen_at(each.id) for each in people]
        last = max([since, *(at for at in seen if at is not None)])
        stood_s = sum(long for over, long in self._stalls if over > last)
        return anyio.current_time() - last - stood_s

    def _with_holder(self, robot: str, person: PersonRef) -> tuple[PersonRef, ...]:
        holder = self._rights.holder(robot)
        if holder is None or holder.person.id == person.id:
            return (person,)
        return person, holder.person

    def _why(self, robot: str, people: tuple[PersonRef, ...], seconds: float) -> str:
        names = " or ".join(each.name or "the starter" for each in people)
        if any(self._rights.seen_at(each.id) is not None for each in people):
            return (
                f"No visible page of {names} has answered for {seconds:g} s: {robot} asks for one."
            )
        return (
            f"It is unknown whether {names} is there: no visible page has answered yet, for "
            f"{seconds:g} s. {robot} asks for one."
        )


def _responsible(run: Run) -> PersonRef:
    """Return whoever started a run; of a led one, whoever let it go on last or was handed it."""
    author = run.lead or run.author
    return PersonRef(author.id, author.name)
