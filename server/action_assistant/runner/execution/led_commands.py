"""The commands of people on led runs: wait, step, go on, a word about an outcome, and handing one over.

Whatever lets an action begin is a start: it is checked like one, and counts at most once.
"""

from collections.abc import Awaitable, Callable, Iterable, Mapping
from functools import partial
from typing import Final

from action_assistant.errors import BadInput, Conflict, Forbidden
from action_assistant.runner.execution.conducted_steps import UNLIMITED, GoOn, StepLimit, Word
from action_assistant.runner.execution.conductors import Conductors
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.robots.rights import Claim
from action_assistant.runner.runs.events import Author, Requested
from action_assistant.runner.runs.run import (
    Press,
    Run,
    go_on_press,
    outcome_press,
    step_press,
    wait_press,
)
from action_assistant.runner.runs.sight import RunSight, run_graphs
from action_assistant.runner.runs.views import microseconds, time
from action_assistant.runner.start.admission import (
    BreakpointsRequest,
    GoOnRequest,
    StepRequest,
    WaitRequest,
    WordRequest,
)
from action_assistant.runner.start.levels import pinned_for_text
from action_assistant.runner.start.orders import watched_in
from action_assistant.runner.start.rights_registry import RightsRegistry
from action_assistant.umrf.model import Precondition
from action_assistant.web.auth.caller import origin_of
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Person
from action_assistant.web.workers.lanes import RunInWorker

#: The outcomes that a person can give.
_OUTCOMES: Final[Mapping[str, Precondition]] = {
    "true": "on_true",
    "false": "on_false",
    "error": "on_error",
}


class LedCommands:
    """Carries out commands of people on led runs. `movable` finds an open run, or raises; `find` finds
    any run, `requested` its first event; `in_worker` calls a function in a worker. In its methods, `author` is the person in whose name the command is recorded."""

    def __init__(
        self,
        conductors: Conductors,
        rights: RightsRegistry,
        sight: RunSight,
        *,
        movable: Callable[[str], Awaitable[OpenRun]],
        find: Callable[[str], Awaitable[Run]],
        requested: Callable[[str], Awaitable[Requested]],
        in_worker: RunInWorker,
    ) -> None:
        self._conductors = conductors
        self._rights = rights
        self._sight = sight
        self._movable = movable
        self._find = find
        self._requested = requested
        self._in_worker = in_worker

    def require_rights(
        self, run: Run, author: Author, identity: Identity | None, claim: Claim | None = None
    ) -> None:
        """Raise Forbidden or Conflict unless the author may start on each robot of a run. `claim`: as
        for `RightsRegistry.refusals`."""
        self.require_robots(run.robots, author, identity, claim)

    def require_robots(
        self,
        robots: Iterable[str],
        author: Author,
        identity: Identity | None,
        claim: Claim | None = None,
    ) -> None:
        """Raise Forbidden or Conflict unless the author may start on each of these robots. `claim`: as
        for `RightsRegistry.refusals`."""
        by = identity or operator_of(author)
        self._rights.act(by)
        self._rights.require(robots, by, claim)

    def why_refused(self, robots: Iterable[str], identity: Identity) -> str:
        """Return why a person may not start on one of these robots now; "" if they may. This is no sign
        that they are there."""
        refused = (self._rights.refusals(name, identity) for name in robots)
        return next((each[0].text for each in refused if each), "")

    async def go_on(
        self, run: str, asked: GoOnRequest, author: Author, identity: Identity | None = None
    ) -> Run:
        """Let a held led run go on, which may start actions on its robots; return the run.
        `asked`: since when the person saw it held. A repeat of a request that was carried out
        changes nothing, and returns the run as it is now. Raise NotFound if there is no such run,
        Conflict if it is over, being stopped, not held since that time, or one of its robots does
        not answer or may begin nothing; Forbidden or Conflict if the author may not start on each of
        them."""
        press = go_on_press(author, microseconds(asked.since))
        return await self._go_on_once(run, asked, author, identity, press, UNLIMITED)

    async def step(
        self, run: str, asked: StepRequest, author: Author, identity: Identity | None = None
    ) -> Run:
        """Let one action of a held led run begin, or those before the action `asked.until`, or those inside
        of the sub-graph `asked.over`, then hold it again; return the run. Raise as `go_on` does, Conflict also if no action waits to begin, BadInput
        for a name that no action has."""
        if sum(map(bool, (asked.action, asked.until, asked.over))) > 1:
            raise BadInput(
                "A step has one goal: an action, until one, or over a sub-graph.",
                where={"path": "/until" if asked.until else "/over"},
            )
        is_one = not (asked.until or asked.over)
        limit = StepLimit(is_one, asked.action, asked.until, asked.over)
        since = microseconds(asked.since)
        press = step_press(author, since, asked.action, asked.until, asked.over)
        return await self._go_on_once(run, asked, author, identity, press, limit)

    async def wait(self, run: str, asked: WaitRequest, author: Author) -> Run:
        """Let a led run begin nothing further until a person lets it go on, and store that; return the
        run. Its actions that are under way go on. Raise NotFound if there is no such run, Conflict if
        it is over, being stopped or not led, OutcomeUnknown if it is not stored within 5 s."""
        async with self._conductors.once(run, asked.request_id):
            found = await self.repeated(run, asked.request_id, wait_press(author))
            if found is not None:
                return found
            opened = no_piece(await self._movable(run))
            if opened.run.led is None:
                raise Conflict("Its engine has the whole graph: only a run that is led can wait.")
            if opened.run.desired == "stopped":
                raise Conflict("The run is being stopped.")
            await self._conductors.wait(run, author, asked.reason, asked.request_id)
            return opened.run

    async def set_breakpoints(
        self, run: str, asked: BreakpointsRequest, author: Author, identity: Identity | None = None
    ) -> Run:
        """Let a led run wait at these breakpoints from now on, and return the run. To take one away is
        a start. Raise NotFound if there is no such run, Conflict if it is over, not led, or has other
        breakpoints than the author saw, BadInput for a place where no run can wait; Forbidden or
        Conflict if one is taken away and the author may not start on each robot of the run."""
        opened = no_piece(await self._movable(run))
        if opened.run.led is None:
            raise Conflict("Its engine has the whole graph: only a run that is led can wait.")
        first = await self._requested(run)
        wanted = await self._in_worker(pinned_for_text, first.umrf, asked.breakpoints)
        opened = no_piece(await self._movable(run))
        now = opened.run
        if now.breakpoints == wanted:
            return now
        if now.breakpoints != asked.was:
            text = "Somebody has set other breakpoints meanwhile. Look at them first."
            raise Conflict(text, where={"path": "/was"})
        if set(now.breakpoints) - set(wanted):
            watching = watched_in(asked.watching, now.robots)
            self.require_rights(now, author, identity, claim_of(now, watching))
        self._conductors.set_breakpoints(run, author, wanted)
        return opened.run

    async def _go_on_once(
        self,
        run: str,
        asked: GoOnRequest | StepRequest,
        author: Author,
        identity: Identity | None,
        press: Press,
        limit: StepLimit,
    ) -> Run:
        async with self._conductors.once(run, asked.request_id):
            found = await self.repeated(run, asked.request_id, press)
            return found or await self._go_on(run, asked, author, identity, limit)

    async def repeated(self, run: str, request_id: str, press: Press) -> Run | None:
        """Return the run as it is now if a press with this request id has counted in it; None if none
        has. Raise NotFound if there is no such run, Conflict if the request id belongs to another
        press."""
        if not request_id:
            return None
        found = await self._find(run)
        known = found.pressed.get(request_id)
        if known is None:
            return None
        if not known.is_repeated_by(press):
            raise Conflict(
                "This request_id belongs to another request.", where={"path": "/request_id"}
            )
        return found

    async def _go_on(
        self,
        run: str,
        asked: GoOnRequest | StepRequest,
        author: Author,
        identity: Identity | None,
        limit: StepLimit,
    ) -> Run:
        opened = await self._movable(run)
        held = opened.run.held
        if held is None:
            raise Conflict("The run is not held; it goes on already.")
        if time(held.at) != asked.since:
            raise Conflict(
                f"The run has gone on since and is held again: {held.why} Look at it first.",
                where={"path": "/since"},
            )
        if opened.run.desired == "stopped":
            raise Conflict("The run is being stopped.")
        watching = watched_in(asked.watching, opened.run.robots)
        self.require_rights(opened.run, author, identity, claim_of(opened.run, watching))
        lead = identity or operator_of(author)
        await self._conductors.go_on(run, GoOn(author, lead, asked.request_id, watching, limit))
        return opened.run

    async def hand_over(
        self, run: str, to: str, author: Author, identity: Identity | None = None
    ) -> Run:
        """Hand a led run over to a person who has a page open, with all batons of its robots. It
        goes on, unless it is held. Raise NotFound if there is no such run, Conflict or Forbidden if the
        author lacks a baton or the other person may not start on a robot of it, Unavailable if it
        could not be stored: then it is held."""
        opened = await self._movable(run)
        if opened.run.led is None:
            raise Conflict("Only a run that is led has further starts to hand over.")
        by, receiver = identity or operator_of(author), self._rights.require_present(to)
        if self._sight.hides(run_graphs(opened.run), receiver):
            raise Forbidden("That person may not see the graph of this run.")
        robots = opened.run.robots
        events = self._rights.handing(robots, run, receiver, by, author)
        self._rights.require(set(robots) - set(events), receiver)
        passing = partial(self._rights.carry_out_handing, events, receiver, author)
        await self._conductors.hand_over(run, author, receiver, passing)
        return opened.run

    async def give_outcome(
        self, run: str, asked: WordRequest, author: Author, identity: Identity | None = None
    ) -> Run:
        """Take the outcome of an action in a led run from a person, where the robot does not
        show it, and store it; return the run. A repeat of a request that was carried out changes
        nothing. Raise NotFound if there is no such run, Conflict if no outcome is asked for,
        OutcomeUnknown if it is not stored within 5 s, Forbidden or Conflict if the author may not start
        on each robot of the run: the next action may begin."""
        outcome = _OUTCOMES[asked.outcome]
        press = outcome_press(author, asked.action, outcome, asked.piece, asked.reason)
        word = Word(
            outcome=outcome,
            by=author,
            reason=asked.reason,
            piece=asked.piece,
            origin=origin_of(author.id),
            request_id=asked.request_id,
        )
        async with self._conductors.once(run, asked.request_id):
            found = await self.repeated(run, asked.request_id, press)
            if found is not None:
                return found
            opened = await self._movable(run)
            self.require_rights(opened.run, author, identity)
            await self._conductors.give_word(run, asked.action, word)
            return opened.run


def operator_of(author: Author) -> Identity:
    """Return an operator without groups, for commands that come from no route."""
    return Identity(Person(author.id, author.name, "operator"))


def claim_of(run: Run, watching: tuple[str, ...]) -> Claim:
    """Return what a run brings to the rules of its robots when a person who watches these robots lets
    it go on."""
    return Claim(
        digest=run.tree_digest or run.digest,
        watching=frozenset(watching),
        is_drill=run.drill,
        beyond=run.beyond,
        limits=run.limits if run.led is None else None,
        is_led=run.led is not None,
    )


def no_piece(opened: OpenRun) -> OpenRun:
    """Return the run unless it is a piece of a led run, to which only the conductor gives
    orders; raise Conflict then."""
    piece = opened.run.piece
    if piece is not None:
        raise Conflict(
            f"This is {piece.node} in run {piece.run}, which is led: it can be stopped, not paused or "
            "changed.",
            where={"path": "/run", "run": piece.run},
        )
    return opened
