"""Stops graphs that were not started from here: sent again until a get proves rest.

It ends by itself with the life of the engine, and when a minute since it was last asked for has
brought no proof; no start from here leaves before: a late stop would hit a run that only has the same
name. What an earlier process left is gone on with once the engine has shown that it is still the same.
"""

import logging
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Final

import anyio
import msgspec

from action_assistant.errors import NotFound, Refused
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import Answer, ForeignCommand, NoAnswer
from action_assistant.runner.robots.engine import KnownEngine, foreign_graphs
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.robot_events import (
    RobotEvent,
    StopAsked,
    StopUnproven,
    StopWasProven,
    left_unproven,
)
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runtime import Runtime
from action_assistant.runner.stop.doubtful_errors import DoubtfulErrors
from action_assistant.runner.stop.loading import LoadingWatch, in_words
from action_assistant.runner.stop.proof import SET_GOING, RestProof, send_stop

log: Final = logging.getLogger(__name__)

_GAP_S: Final = 0.1
_SLOWEST_S: Final = 1.0
_GET_S: Final = 1.0
_PATIENCE_S: Final = 60.0
_LOUD_S: Final = 2.0
_LOG_ENTRIES: Final = 500  # newest entries of a robot's log

_TAKEN_UP: Final = "the runner was started anew, and it is not proven yet"
_RESTARTED: Final = "the engine was restarted: look at the robot"
_UNKNOWN_LIFE: Final = "nobody knows whether this is the engine that ran it: look at the robot"
_NO_LINK: Final = "there is no link to this robot"
_REMOVED: Final = "the robot was taken out of the registry meanwhile: look at it"


class StoppedAll(msgspec.Struct, frozen=True):
    """The answer to a Stop of everything. `runs` are the runs that are being stopped, `graphs`
    those of other programs, by robot. `unknown` says, by robot, why it is not known what a robot
    runs: a graph there is not being stopped unless it was seen before."""

    runs: list[str]
    graphs: dict[str, list[str]] = {}
    unknown: dict[str, str] = {}


class _ForeignStop:
    """One Stop, not proven yet, of a graph that another program has started. `life`: the id
    (incarnation) of the engine process that was to stop the graph; `why`: why it is not proven, ""
    at first."""

    def __init__(self, robot: str, graph: str, life: str, why: str) -> None:
        self.robot = robot
        self.graph = graph
        self.life = life
        self.why = why
        self.patience = anyio.CancelScope(deadline=anyio.current_time() + _PATIENCE_S)
        self.disturbed = False  # by a command of another program since the last answer
        self.rest = RestProof(exact=False)
        self.loading = LoadingWatch(graph)
        self.doubts = DoubtfulErrors(reached=True)


class ForeignStopLoop:
    """Carries out all Stops of graphs that other programs have started on `robots`. `changed` is
    called when the page has to show a change."""

    def __init__(self, robots: Robots, runtime: Runtime, changed: Callable[[], None]) -> None:
        self._robots = robots
        self._tasks = runtime.tasks
        self._clock_us = runtime.clock_us
        self._run_in_worker = runtime.run_in_worker
        self._changed = changed
        self._going: dict[tuple[str, str], _ForeignStop] = {}

    def trouble(self, robot: str, graph: str) -> str | None:
        """Return why it is not proven yet that the graph has stopped on this robot; "" until a
        reason is known. Return None if the graph is not being stopped, or no longer."""
        found = self._going.get((robot, graph))
        return None if found is None else found.why

    def is_stopping(self, robot: str) -> bool:
        """Return whether any graph that another program has started is being stopped on a robot."""
        return any(name == robot for name, _ in self._going)

    def graphs(self) -> dict[str, list[str]]:
        """Return the graphs that are being stopped, by robot."""
        found: dict[str, list[str]] = {}
        for robot, graph in sorted(self._going):
            found.setdefault(robot, []).append(graph)
        return found

    def pending(self) -> Iterator[tuple[str, str]]:
        """Return, for each graph that is being stopped, its robot and why the stop is not proven yet."""
        return ((each.robot, each.why) for each in self._going.values())

    def stop(
        self, author: Author, own_runs: Callable[[str], Collection[str]], robot: str | None = None
    ) -> list[str]:
        """Begin to stop all graphs that other programs have started, on one robot or (None) on all
        robots, and return each as "robot: graph". `author`: who pressed Stop; `own_runs(robot)`
        returns the ids of this runner's open runs on a robot. The call never waits. Raise NotFound
        if the robot is not registered."""
        stopped: list[str] = []
        faults: list[Exception] = []
        for engine in self._robots.engines(robot):
            name, answer = engine.registration.name, engine.answer
            for graph in [] if answer is None else foreign_graphs(answer, own_runs(name)):
                try:
                    self._stop_graph(engine, graph, author)
                except Exception as fault:  # whatever it is: the others are stopped
                    log.exception("a Stop has failed")
                    faults.append(fault)
                stopped.append(f"{name}: {graph}")
        if faults:
            raise ExceptionGroup("a Stop has failed in part", faults)
        return stopped

    def _stop_graph(self, engine: KnownEngine, graph: str, author: Author) -> None:
        """Begin to stop a graph on a robot, and return at once; the Stop goes on in the
        background. If the graph is being stopped already, only extend the time until its Stop
        counts as unconfirmed. `author`: the person who pressed Stop."""
        robot = engine.registration.name
        known = self._going.get((robot, graph))
        if known is not None:
            known.patience.deadline = anyio.current_time() + _PATIENCE_S
            return
        life = engine.answer.incarnation if engine.answer is not None else ""
        asked = StopAsked(at=self._clock_us(), graph=graph, author=author, life=life)
        self._robots.robot_log.note(robot, asked, author.id)
        self._begin(_ForeignStop(robot, graph, life, ""), engine)

    async def take_up(self) -> None:
        """Continue the Stops that an earlier process has left unproven. The call waits for no
        engine. A robot whose log cannot be read is skipped."""
        for robot in self._robots.names:
            try:
                stored = await self._robots.robot_log.newest(robot, _LOG_ENTRIES)
            except Exception:  # the Stops on other robots must go on
                log.exception("whether something was being stopped on %s cannot be read", robot)
                continue
            for asked in left_unproven(event for _, event in stored):
                if (robot, asked.graph) not in self._going:
                    self._begin(_ForeignStop(robot, asked.graph, asked.life, _TAKEN_UP), None)

    def hear_of(self, robot: str, command: ForeignCommand) -> None:
        """Process a command that another program has sent to the robot. If it may just have started
        a graph that is being stopped, an answer requested before it proves nothing."""
        found = self._going.get((robot, command.graph))
        if command.command in SET_GOING and found is not None:
            found.disturbed = True
            found.loading.meddle()

    def shows(self, engine: KnownEngine, snapshots: tuple[Snapshot, ...]) -> None:
        """Process graphs (`snapshots`) that an engine shows, in an answer or by feedback; return at
        once."""
        for (robot, graph), wanted in self._going.items():
            if robot != engine.registration.name:
                continue
            if engine.standing.doubt:
                wanted.loading.meddle()
            else:
                wanted.loading.see(_parts_of(snapshots, graph))

    def _begin(self, wanted: _ForeignStop, engine: KnownEngine | None) -> None:
        self._going[wanted.robot, wanted.graph] = wanted
        self._tasks.start_soon(self._stop, wanted, engine)
        self._changed()

    async def _stop(self, wanted: _ForeignStop, engine: KnownEngine | None) -> None:
        try:
            with wanted.patience:
                try:
                    outcome = await self._until_proven(wanted, engine)
                except NotFound:
                    outcome = self._unproven(wanted, _REMOVED)
            if wanted.patience.cancelled_caught:
                outcome = self._unproven(wanted, wanted.why or "no proof has come")
            self._robots.robot_log.note(wanted.robot, outcome, "")
        finally:
            self._going.pop((wanted.robot, wanted.graph), None)
            self._changed()

    async def _until_proven(self, wanted: _ForeignStop, known: KnownEngine | None) -> RobotEvent:
        """Send stop messages for a graph until the Stop is proven or can never be proven; return
        the event for that. `known`: the engine if it is known to be the one to stop, else None;
        after a new link or a restart of the runner it has to show that first."""
        began, gap = anyio.current_time(), _GAP_S
        while True:
            engine = self._robots.present(wanted.robot)
            if engine is None:
                outcome: RobotEvent | str = _NO_LINK
            elif engine is known:
                outcome = await self._steadily(wanted, engine)
            else:
                wanted.rest.forget()
                outcome = await self._recognise(wanted, engine)
                if not outcome:
                    known = engine
                    continue
            if not isinstance(outcome, str):
                return outcome
            if anyio.current_time() - began >= _LOUD_S and wanted.why != outcome:
                wanted.why = outcome
                self._changed()
            await anyio.sleep(gap)
            gap = min(1.5 * gap, _SLOWEST_S)

    async def _recognise(self, wanted: _ForeignStop, engine: KnownEngine) -> StopUnproven | str:
        """Ask an engine, without sending a stop, whether it is the process that was to stop the
        graph (`wanted`). Return "" if it is, the reason if that cannot be known yet, or the event
        that it is another one."""
        answer = await _ask(engine)
        if answer is None:
            return engine.why or "the engine does not answer"
        if not wanted.life or not answer.incarnation:
            return self._unproven(wanted, _UNKNOWN_LIFE)
        return "" if answer.incarnation == wanted.life else self._unproven(wanted, _RESTARTED)

    async def _steadily(self, wanted: _ForeignStop, engine: KnownEngine) -> RobotEvent | str:
        """Do as `_once`, but log any exception and return it as the reason, so that the stop is
        sent again."""
        try:
            return await self._once(wanted, engine)
        except Exception as error:
            log.exception(
                "a stop of %s on %s failed, and is sent again", wanted.graph, wanted.robot
            )
            wanted.rest.forget()
            return f"the runner failed: {error!r}"

    async def _once(self, wanted: _ForeignStop, engine: KnownEngine) -> RobotEvent | str:
        """Send one stop message, ask the engine, and judge its answer. Return the event that ends
        the Stop `wanted`, or the reason why it is not proven yet."""
        why = await send_stop(engine, wanted.graph)
        asked = anyio.current_time()
        answer = await _ask(engine)
        disturbed, wanted.disturbed = wanted.disturbed, False
        if disturbed:
            wanted.rest.forget()
        if answer is None:
            return why or engine.why or "the engine does not answer"
        if len({wanted.life, answer.incarnation} - {""}) > 1:
            return self._unproven(wanted, _RESTARTED)
        if doubt := engine.standing.doubt:
            wanted.rest.forget()
            return doubt
        if disturbed:
            return "somebody has just set it going again"
        if doubt := wanted.doubts.look(_shown(answer, wanted.graph)):
            return doubt
        if not _at_rest(answer, wanted.graph, wanted.rest, asked) or why:
            return why or f"{wanted.graph} has not stopped yet"
        if loading := await self._still_loading(wanted, answer):
            return loading
        return StopWasProven(at=answer.at, graph=wanted.graph, asked_at=answer.asked_at)

    async def _still_loading(self, wanted: _ForeignStop, answer: Answer) -> str:
        """Return in words which actions of the graph may still be loading by this answer; "" for
        none. Sub-graphs of other starts count, too, since they cannot be distinguished."""
        shown = _shown(answer, wanted.graph)
        try:
            unread = wanted.loading.unread(shown)
            await wanted.loading.read(unread, answer.texts, self._run_in_worker)
        except Refused:  # no worker is free: every action that has not begun counts then
            pass
        return in_words(wanted.loading.actions(shown))

    def _unproven(self, wanted: _ForeignStop, why: str) -> StopUnproven:
        return StopUnproven(at=self._clock_us(), graph=wanted.graph, why=why)


async def _ask(engine: KnownEngine) -> Answer | None:
    try:
        with anyio.fail_after(_GET_S):
            return await engine.get()
    except (NoAnswer, TimeoutError):
        return None


def _at_rest(answer: Answer, graph: str, rest: RestProof, asked: float) -> bool:
    """Return whether this answer, requested at `asked` (seconds of the event loop), proves together
    with earlier ones (`rest`) that neither the graph nor a sub-graph moves."""
    shown = _shown(answer, graph)
    is_held = bool(shown) and shown[0].graph == graph
    return rest.seen(shown, asked) if is_held else rest.missing(shown, asked)


def _shown(answer: Answer, graph: str) -> list[Snapshot]:
    return _parts_of(answer.graphs, graph)


def _parts_of(snapshots: Sequence[Snapshot], graph: str) -> list[Snapshot]:
    """Return the snapshot of a graph, if it is among them, and then the snapshots of its
    sub-graphs."""
    own = [each for each in snapshots if each.graph == graph]
    return [*own, *(each for each in snapshots if each.graph.startswith(f"{graph}__"))]
