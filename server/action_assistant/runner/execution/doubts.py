"""The watch for doubts: closes repeats and the queues of robots in the step in which a doubt is seen."""

from collections.abc import Callable, Iterable
from typing import Final, Generic, TypeVar

from action_assistant.kit.lru_cache import LruCache
from action_assistant.runner.execution.conducted_steps import RUNNER
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.author import Author
from action_assistant.runner.runs.doubts import Doubt, doubts_in
from action_assistant.runner.runs.run import Run

_SEEN: Final = 2000  # runs whose doubts are remembered: each counts once while it lasts


class Closable:
    """A part of this process that waits to start something on robots while it is open.

    `robots`: those that it waits for; `is_open`: set by `DoubtWatch.begin` alone; `doubts`: how many
    were seen, also while it was closed. `lives`, `holders`: the engine's process, and the holder of the
    baton, of each robot when it was opened.
    """

    def __init__(self, robots: tuple[str, ...]) -> None:
        self.robots = robots
        self.is_open = False
        self.doubts = 0
        self.lives: dict[str, str] = {}
        self.holders: dict[str, str] = {}

    def owns(self, run: str) -> bool:
        """Return whether a run is one of its own, or one that it has waited for."""
        raise NotImplementedError


C = TypeVar("C", bound=Closable)


class DoubtWatch(Generic[C]):
    """Watches runs, robots and Stops. `closables`: returns all that may be open; `close`: called at once
    with one that was open, and a doubt; `again`: with one that was closed already. Its owner calls `look_at` with each run that changes."""

    def __init__(
        self,
        control: ExecutionService,
        closables: Callable[[], Iterable[C]],
        close: Callable[[C, Doubt], None],
        again: Callable[[C, Doubt], None] = lambda _closable, _doubt: None,
    ) -> None:
        self._control = control
        self._closables = closables
        self._close = close
        self._again = again
        self._seen: LruCache[str, frozenset[tuple[str, int | None]]] = LruCache(_SEEN)
        control.watch_robots(self._robots_changed)
        control.watch_stops(self._stopped)

    def standing(self, closable: C) -> tuple[dict[str, str], dict[str, str]]:
        """Return the engine's process, and the holder of the baton, of each of its robots now."""
        names = closable.robots
        return {n: self._life(n) for n in names}, {n: self._holder(n) for n in names}

    def begin(self, closable: C) -> None:
        """Let it be open from now on, and remember how its robots are."""
        closable.is_open = True
        closable.lives, closable.holders = self.standing(closable)

    def meet(self, closable: C, doubt: Doubt) -> None:
        """Note a doubt about one of them."""
        closable.doubts += 1
        (self._close if closable.is_open else self._again)(closable, doubt)

    def look_at(self, run: Run) -> None:
        """Close whatever a change of a run concerns."""
        doubts = {(each.why, run.moves_again_at): each for each in doubts_in(run)}
        known = self._seen.get(run.id) or frozenset()
        self._seen.put(run.id, frozenset(doubts))
        for doubt in [each for key, each in doubts.items() if key not in known]:
            for each in tuple(self._closables()):
                if each.owns(run.id) or not set(run.robots).isdisjoint(each.robots):
                    self.meet(each, doubt)

    def _stopped(self, author: Author, robot: str, run: str) -> None:
        """Close what a Stop concerns: all, what waits for a robot, or what owns a run."""
        who = author.name or "Somebody"
        for each in tuple(self._closables()):
            if robot in each.robots if robot else not run or each.owns(run):
                what = f" of {robot}" if robot else "" if run else " of everything"
                text = f"{who} pressed Stop{what}."
                if author.id == RUNNER.id:
                    text = f"{robot or 'A run of it'} was stopped by {who}."
                self.meet(each, Doubt("stop", text, author, run))

    def _robots_changed(self) -> None:
        for each in tuple(self._closables()):
            for robot in each.robots if each.is_open else ():
                if (lost := self._why_lost(each, robot)) or (
                    self._holder(robot) != each.holders[robot]
                ):
                    text = lost or f"The baton of {robot} changed hands."
                    self.meet(each, Doubt("lost" if lost else "baton", text))
                    break

    def _why_lost(self, closable: C, robot: str) -> str:
        engine, life = self._control.robots.link(robot), closable.lives[robot]
        if engine is None:
            return f"There is no link to {robot} any more."
        if engine.state == "gone":
            return f"{robot} was lost. {engine.why}".strip()
        now = self._life(robot)
        if not life:
            closable.lives[robot] = now  # it was not known yet
        return f"The engine of {robot} was started again." if life and now not in {"", life} else ""

    def _life(self, robot: str) -> str:
        engine = self._control.robots.link(robot)
        return "" if engine is None else engine.standing.incarnation

    def _holder(self, robot: str) -> str:
        held = self._control.rights.of(robot).holder
        return "" if held is None else held.person.id
