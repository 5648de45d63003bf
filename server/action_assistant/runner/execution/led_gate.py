"""The gate of a led run, with the person for whom the run is led: it closes when that person may begin
nothing on one of its robots any more, and a person who may lets the run go on.
"""

from collections.abc import Awaitable, Callable, Iterable
from typing import Final

from msgspec.structs import replace

from action_assistant.errors import Conflict
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.execution.conducted_steps import Gate, Tell
from action_assistant.runner.execution.led_look import LedLook
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.rights import Claim
from action_assistant.runner.runs.events import Author, HandedOver, Held, Released, Requested
from action_assistant.web.auth.identity import Identity


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
            digest=first.tree_digest or first.digest, watching=frozenset(first.watching)
        )
        #: The robots that play actions of the run.
        self.robots: Final = frozenset(first.led.players.values())
        self._first = first
        self._look = look
        self._registry = robots
        self._clock_us = clock_us
        self._tell = tell

    def hold_run(self, why: str, by: Author | None = None) -> None:
        """Hold the run and record that, unless it is held or stopped already. `by`: None for the
        runner."""
        if self.held is None and not self.is_final:
            held = Held(at=self._clock_us(), why=why, by=by)
            self.hold(held)
            self._tell(held)

    def why_not_allowed(self, robot: str) -> str:
        """Return why the person for whom the run is led may begin nothing on a robot now; "" if they
        may."""
        return self._look.why_not_allowed(robot, self.person, self.claim)

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

    async def go_on(
        self,
        author: Author,
        lead: Identity,
        names: Iterable[str],
        request_id: str,
        watching: tuple[str, ...],
    ) -> None:
        """Wait for the answers of the robots with these names, then let a held run go on for `lead`.
        Raise Conflict if one of them may begin no piece, if the run is held no more as it was, or if
        `lead` may not start on one of its robots any more. `request_id`: of the press, "" for none;
        `watching`: the robots that `lead` says to watch."""
        held = self.held
        claim = replace(self.claim, watching=frozenset(watching))
        await self._look.before_going_on(self._registry, names, self._first, lead, claim)
        if held is None or self.held is not held or self.is_final:
            raise Conflict("The run has gone on, or was stopped, meanwhile.")
        for name in sorted(self.robots):  # in the step in which the gate opens
            if why := self._look.why_not_allowed(name, lead, claim):
                raise Conflict(f"Nothing has gone on. {why}", where={"path": "/robots"})
        self.person, self.claim = lead, claim
        released = Released(
            at=self._clock_us(),
            author=author,
            since=held.at,
            request_id=request_id,
            watching=watching,
        )
        self._tell(released, author.id)
        self.release()
