"""The look at a robot before an action of a led run begins on it: the one place for its rules.

A led run begins actions at its start and with each piece, minutes later: the next one, one after a
*go on*, after a restart of the runner, or after an outcome by word. `LedLook.items` is called for each
of them, by a pre-flight too: a rule that is added there counts everywhere (docs/decisions/113).
"""

from collections.abc import Iterable
from typing import Final, get_args

import anyio
import msgspec

from action_assistant.errors import Conflict, Refused
from action_assistant.runner.execution.monitor import STOOD_S
from action_assistant.runner.execution.open_runs import OpenRuns
from action_assistant.runner.links.port import Answer, NoAnswer, NotSent
from action_assistant.runner.robots.engine import KnownEngine, foreign_graphs
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.rights import Claim, RightCode
from action_assistant.runner.runs.events import Author, Requested
from action_assistant.runner.runs.sight import RunSight
from action_assistant.runner.start.led_items import IndexingWords, indexing_item, led_item
from action_assistant.runner.start.preflight import Item, is_blocking
from action_assistant.runner.start.rights_registry import RightsRegistry
from action_assistant.runner.stop.foreign_stop import ForeignStopLoop
from action_assistant.umrf.limits import Limit
from action_assistant.web.auth.identity import Identity

_GET_S: Final = 2.0  # within which a robot has to answer before a piece leaves
_FRESH_S: Final = 3.0  # for which a look at a robot counts


#: Why nothing begins for a run that nobody has let go on since the runner's restart.
_NOBODY: Final = "nobody has let it go on since the runner was restarted"
#: The codes of the items about the rights of a robot.
_RIGHTS: Final = frozenset(get_args(RightCode))


class NotAllowed(NoAnswer):
    """The person for whom a run is led may begin nothing on a robot."""


class Cleared(msgspec.Struct, frozen=True):
    """A robot on which a piece may begin, as an answer has shown. `life`: the id of the engine's
    process (another one after a restart); `at`: when the answer came, in seconds of the event loop.
    """

    robot: KnownEngine
    life: str
    at: float

    def require_still(self) -> None:
        """Check once more, right before a piece is sent, that the piece may begin; do not wait.
        Raise NotSent if the engine was restarted since its answer, if its state is in doubt, or if
        its answer is more than 3 s old."""
        standing = self.robot.standing
        if standing.incarnation not in {"", self.life} or standing.doubt:
            raise NotSent("its robot has changed before it left")
        if anyio.current_time() - self.at > _FRESH_S:
            raise NotSent("its turn came too late after its robot was looked at")


class LedLook:
    """Checks a robot before a start, or a piece, of a led run begins there."""

    def __init__(
        self,
        runs: OpenRuns,
        foreign_stops: ForeignStopLoop,
        indexing: IndexingWords,
        rights: RightsRegistry,
        sight: RunSight,
    ) -> None:
        self._runs = runs
        self._sight = sight
        self._rights = rights
        self._foreign_stops = foreign_stops
        self._indexing = indexing

    async def items(
        self,
        robot: KnownEngine,
        answer: Answer,
        lead: Identity,
        claim: Claim,
        cleared: str = "",
    ) -> list[Item]:
        """Return an item of each rule for a robot that has just given this answer. `lead`: the
        person for whom the run is led; `claim`: the claim of its start; `cleared`: the life of its
        engine that was looked at before the start, "" before that, when `lead` reads the items.
        Raise Unavailable if the journal cannot be read."""
        indexing = await self._indexing_item(robot, answer.incarnation, cleared)
        name = robot.registration.name
        rights = self._rights.items(name, lead, claim, is_asking=not cleared)
        return [led_item(robot.registration), indexing, *rights]

    def limits_of(self, robot: str) -> tuple[Limit, ...]:
        """Return the limits in force on a robot now."""
        return self._rights.limits_of(robot)

    def why_not_allowed(
        self, robot: str, lead: Identity | None, claim: Claim, *, is_decided: bool = False
    ) -> str:
        """Return why a run that is led for `lead` may begin nothing on a robot now; "" if it may.
        `lead` is None if nobody has let it go on since the runner's restart. `claim`: the claim of
        the run; `is_decided`: a change counts before it is stored."""
        if lead is None:
            return _NOBODY
        refused = self._rights.refusals(robot, lead, claim, is_asking=False, is_decided=is_decided)
        return refused[0].text if refused else ""

    async def _indexing_item(self, robot: KnownEngine, life: str, cleared: str) -> Item:
        name, standing = robot.registration.name, robot.standing
        if life == cleared and standing.indexes is None:  # how it was started does not change
            standing = msgspec.structs.replace(standing, indexes=False)
        word = await self._indexing.of(name, life) if standing.indexes is None else None
        return indexing_item(name, robot.facts, standing, word)

    async def before_piece(
        self, robot: KnownEngine, run: Requested, lead: Identity | None, claim: Claim
    ) -> Cleared:
        """Ask a robot, wait for its answer, and return the proof that a piece of a led run may
        begin on it. `claim`: the claim of the run. Raise NoAnswer with the reason if the robot does
        not answer, and also if its answer or a check forbids a piece."""
        assert run.led is not None
        name = robot.registration.name
        if lead is None:
            raise NotAllowed(_NOBODY)
        if why := self.why_not_allowed(name, lead, claim):
            raise NotAllowed(why)
        await robot.indexed()
        try:
            answer = await _asked(robot)
        except TimeoutError as late:
            raise NoAnswer(f"it has not answered for {_GET_S:.0f} s. {robot.why}") from late
        at = anyio.current_time()  # what follows may wait, and makes the answer no newer
        if answer.incarnation != run.led.lives.get(name):
            raise NoAnswer("its engine was restarted since the start of this run")
        if robot.standing.doubt:
            raise NoAnswer(robot.standing.doubt)
        if self._foreign_stops.is_stopping(name):
            raise NoAnswer("something that others have started is being stopped there")
        others = foreign_graphs(answer, self._runs.on(name))
        if others:
            what = "a graph" if self._sight.has_rules else others[0]
            raise NoAnswer(f"somebody else runs {what} there")
        taken = self._runs.occupying(name, apart_from=run.run)
        if taken is not None:
            raise NoAnswer(f"run {taken.number} is {taken.state} there")
        self._require_known(name, run.run)
        try:
            items = await self.items(robot, answer, lead, claim, answer.incarnation)
        except Refused as unreadable:
            raise NoAnswer(unreadable.detail) from unreadable
        overridden = run.override.codes if run.override is not None else ()
        for item in items:
            if is_blocking(item, overridden):
                raise (NotAllowed if item.code in _RIGHTS else NoAnswer)(item.text)
        return Cleared(robot, answer.incarnation, at)

    def _require_known(self, name: str, run: str) -> None:
        """Raise NoAnswer with the reason if the robot `name` has a piece of this run that is
        unknown, lost, unconfirmed or moving again: it gets no further one. `run`: the id of the
        led run."""
        for opened in self._runs.on(name).values():
            piece = opened.run
            if piece.piece is None or piece.piece.run != run:
                continue
            node = piece.piece.node
            if piece.unknown_since is not None:
                raise NoAnswer(f"it does not answer, and may still carry out {node}")
            if piece.moves_again_at is not None:
                raise NoAnswer(f"{node} moves again there")
            if why := piece.lost or piece.unconfirmed:
                raise NoAnswer(f"nobody knows whether {node} has ended there: {why}")

    async def before_going_on(
        self,
        robots: Robots,
        names: Iterable[str],
        run: Requested,
        lead: Identity,
        claim: Claim,
    ) -> None:
        """Check the robots with these names at the same time, before a held run goes on, and wait
        for their answers. `run`: its first event; `lead`: the person who lets it go on; `claim`:
        the claim of the run from then on. Raise Conflict with the reasons of all robots on which no
        piece may begin."""
        found: dict[str, str] = {}

        async def look(name: str) -> None:
            try:
                await self.before_piece(robots.reachable(name), run, lead, claim)
            except NoAnswer as why:
                found[name] = str(why)
            except Refused as why:
                found[name] = why.detail

        async with anyio.create_task_group() as tasks:
            for name in names:
                tasks.start_soon(look, name)
        if found:
            reasons = " ".join(f"{name}: {found[name].rstrip('. ')}." for name in sorted(found))
            where: dict[str, object] = {"path": "/robots", "robots": found}
            raise Conflict(f"Nothing has gone on. {reasons}", where=where)

    async def give_words(self, lives: dict[str, str], author: Author, reason: str) -> None:
        """Store that the person `author` vouches that these engines index their files only once.
        `lives`: the id of each engine's process, by robot; `reason`: given by the person. Raise
        Unavailable if the journal cannot store it."""
        for robot, life in lives.items():
            await self._indexing.give(robot, life, author, reason)


async def _asked(robot: KnownEngine) -> Answer:
    """Ask a robot, and return its answer; ask once more if this process stood still meanwhile.
    Raise NoAnswer or TimeoutError if it does not answer."""
    began = anyio.current_time()
    try:
        with anyio.fail_after(_GET_S):
            return await robot.get()
    except (NoAnswer, TimeoutError):
        if anyio.current_time() - began < _GET_S + STOOD_S:
            raise
    with anyio.fail_after(_GET_S):
        return await robot.get()
