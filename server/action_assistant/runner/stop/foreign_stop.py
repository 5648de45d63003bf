"""Stops graphs that were not started from here: sent again until a get proves rest.

It ends by itself with the life of the engine, and when a minute since it was last asked for has
brought no proof; no start from here leaves before: a late stop would hit a run that only has the same
name.
"""

from collections.abc import Callable, Iterator
from typing import Final

import anyio
from anyio.abc import TaskGroup

from action_assistant.runner.clock import ClockUs
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import Answer, ForeignCommand, NoAnswer
from action_assistant.runner.robots.engine import KnownEngine
from action_assistant.runner.robots.robot_events import (
    RobotEvent,
    StopAsked,
    StopUnproven,
    StopWasProven,
)
from action_assistant.runner.runs.events import Author
from action_assistant.runner.stop.doubtful_errors import DoubtfulErrors
from action_assistant.runner.stop.proof import SET_GOING, RestProof, send_stop

_GAP_S: Final = 0.1
_SLOWEST_S: Final = 1.0
_GET_S: Final = 1.0
_PATIENCE_S: Final = 60.0
_LOUD_S: Final = 2.0


class ForeignStopLoop:
    """All such stops that go on. `note` records; `changed` is told when people see something else."""

    def __init__(
        self,
        tasks: TaskGroup,
        clock_us: ClockUs,
        note: Callable[[str, RobotEvent, str], None],
        changed: Callable[[], None],
    ) -> None:
        self._tasks = tasks
        self._clock_us = clock_us
        self._note = note
        self._changed = changed
        self._going: dict[tuple[str, str], str] = {}
        self._patience: dict[tuple[str, str], anyio.CancelScope] = {}
        self._disturbed: set[tuple[str, str]] = set()  # since the last answer

    def trouble(self, robot: str, graph: str) -> str | None:
        """None when the graph is not being stopped; else why that is not proven yet, "" at first."""
        return self._going.get((robot, graph))

    def going(self, robot: str) -> bool:
        """Whether something is being stopped there."""
        return any(name == robot for name, _ in self._going)

    def all_going(self) -> Iterator[tuple[str, str]]:
        """The robot of each graph that is being stopped, and why that is not proven yet."""
        return ((robot, why) for (robot, _), why in self._going.items())

    def stop(self, engine: KnownEngine, graph: str, author: Author) -> None:
        """Want a graph stopped. Never waits."""
        robot = engine.registration.name
        until = anyio.current_time() + _PATIENCE_S
        if (robot, graph) in self._going:
            self._patience[robot, graph].deadline = until
            return
        self._patience[robot, graph] = anyio.CancelScope(deadline=until)
        self._going[robot, graph] = ""
        asked = StopAsked(at=self._clock_us(), graph=graph, author=author)
        self._note(robot, asked, author.id)
        self._tasks.start_soon(self._stop, engine, graph, robot)
        self._changed()

    def hear_of(self, robot: str, command: ForeignCommand) -> None:
        """Somebody else may just have set it going: what was asked before proves nothing any more."""
        if command.command in SET_GOING and (robot, command.graph) in self._going:
            self._disturbed.add((robot, command.graph))

    async def _stop(self, engine: KnownEngine, graph: str, robot: str) -> None:
        try:
            with self._patience[robot, graph]:
                told = await self._until_proven(engine, graph, robot)
                self._note(robot, told, "")
                return
            why = self._going[robot, graph] or "no proof has come"
            self._note(robot, StopUnproven(at=self._clock_us(), graph=graph, why=why), "")
        finally:
            self._going.pop((robot, graph), None)
            self._patience.pop((robot, graph), None)
            self._disturbed.discard((robot, graph))
            self._changed()

    async def _until_proven(self, engine: KnownEngine, graph: str, robot: str) -> RobotEvent:
        began, gap = anyio.current_time(), _GAP_S
        life = engine.answer.incarnation if engine.answer is not None else ""
        rest, doubts = RestProof(exact=False), DoubtfulErrors(reached=True)
        while True:
            why = await send_stop(engine, graph)
            asked = anyio.current_time()
            answer = await _ask(engine)
            disturbed = (robot, graph) in self._disturbed
            self._disturbed.discard((robot, graph))
            if disturbed:
                rest.forget()
            if answer is None:
                why = why or engine.why or "the engine does not answer"
            elif len({life, answer.incarnation} - {""}) > 1:
                why = "the engine was restarted: look at the robot"
                return StopUnproven(at=self._clock_us(), graph=graph, why=why)
            elif engine.standing.servers != 1:
                why = f"{engine.standing.servers} engines are seen on the path of its answers"
            elif disturbed:
                why = "somebody has just set it going again"
            elif doubt := doubts.look(_shown(answer, graph)):
                why = doubt
            elif _at_rest(answer, graph, rest, asked) and not why:
                return StopWasProven(at=answer.at, graph=graph, asked_at=answer.asked_at)
            else:
                why = why or f"{graph} has not stopped yet"
            if anyio.current_time() - began >= _LOUD_S and self._going[robot, graph] != why:
                self._going[robot, graph] = why
                self._changed()
            await anyio.sleep(gap)
            gap = min(1.5 * gap, _SLOWEST_S)


async def _ask(engine: KnownEngine) -> Answer | None:
    try:
        with anyio.fail_after(_GET_S):
            return await engine.get()
    except (NoAnswer, TimeoutError):
        return None


def _at_rest(answer: Answer, graph: str, rest: RestProof, asked: float) -> bool:
    """Whether neither the graph nor a sub-graph of it moves, or will by itself."""
    shown = _shown(answer, graph)
    is_held = bool(shown) and shown[0].graph == graph
    return rest.seen(shown, asked) if is_held else rest.missing(shown, asked)


def _shown(answer: Answer, graph: str) -> list[Snapshot]:
    """A graph, if it is held, and then its sub-graphs."""
    own = [each for each in answer.graphs if each.graph == graph]
    return [*own, *(each for each in answer.graphs if each.graph.startswith(f"{graph}__"))]
