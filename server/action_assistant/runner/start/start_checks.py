"""The checks before a start is stored and sent, for each engine that it shall go to."""

import os
from collections.abc import Awaitable, Callable, Collection, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Final, TypeAlias

import anyio
import msgspec

from action_assistant.errors import BadInput, Conflict, Refused, Unavailable
from action_assistant.random_ids import random_id
from action_assistant.ros_workspace import Workspace
from action_assistant.runner.analysis.course_checks import CheckedCourses
from action_assistant.runner.clock import ClockUs
from action_assistant.runner.links.behaviours.folder import BehaviourFolder
from action_assistant.runner.links.port import SIMULATOR, Answer, Link, NoAnswer
from action_assistant.runner.links.simulator import Simulator
from action_assistant.runner.robots.engine import KnownEngine
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import Overridden, Override
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sent_graphs import SentGraph, SentSubgraph
from action_assistant.runner.start import preflight
from action_assistant.runner.start.admission import Prepared, StartRequest, decoded, prepared
from action_assistant.runner.start.approvals import Approvals
from action_assistant.runner.start.course_items import of_courses, of_unknown_courses
from action_assistant.runner.start.disk_items import looked_at
from action_assistant.runner.start.preflight import EngineView, Item, Preflight, Settled
from action_assistant.umrf.facts import SIMULATED, EngineFacts, facts_of
from action_assistant.web.workers.lanes import RunInWorker

#: The simulator as itself: a paused run can be stopped there.
_ITSELF: Final = msgspec.structs.replace(SIMULATED, pauses_safely=True)
_PREFLIGHT_S: Final = 2.0
_COURSES_S: Final = 5.0  # so long a look waits for what is behind others' questions
_MOST: Final = 20  # engines of one group
_TOLD: Final = 40  # overridden problems that are kept with a run

#: The expected courses of a graph (its id), held against its text and those of the graphs inside.
CoursesOf: TypeAlias = Callable[[str, bytes, Sequence[SentSubgraph]], Awaitable[CheckedCourses]]

_Name = Annotated[str, msgspec.Meta(min_length=1, max_length=100)]


class GroupRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One version for several robots at once. Without version, digest and `request_id` it can only
    be looked at."""

    umrf: SentGraph
    version: str = ""
    digest: str = ""
    engines: Annotated[tuple[_Name, ...], msgspec.Meta(min_length=1, max_length=_MOST)]
    request_id: Annotated[str, msgspec.Meta(max_length=200)] = ""
    graph: str | None = None
    override: Override | None = None
    like: str | None = None
    behaviours: bool = False
    subgraphs: tuple[SentSubgraph, ...] = ()
    tree_digest: str | None = None

    def of(self, engine: str) -> StartRequest:
        """The start on one of them."""
        return StartRequest(
            version=self.version,
            digest=self.digest,
            umrf=self.umrf,
            engine=engine,
            request_id=f"{self.request_id}/{engine}",
            graph=self.graph,
            override=self.override,
            like=self.like if engine == SIMULATOR else None,
            behaviours=self.behaviours and engine == SIMULATOR,
            subgraphs=self.subgraphs,
            tree_digest=self.tree_digest,
        )


def read_group(body: bytes) -> GroupRequest:
    """The body of a start on several robots, or of a look. Raises BadInput with the place."""
    asked = decoded(body, GroupRequest)
    if len(set(asked.engines)) < len(asked.engines):
        raise BadInput("A robot is named twice.", where={"path": "/engines"})
    return asked


class Cleared(msgspec.Struct, frozen=True, kw_only=True):
    """Nothing stands in the way: what will be sent, where, to which life of the engine, and which
    problems somebody answers for."""

    ready: Prepared
    link: Link
    own: bool
    incarnation: str
    despite: tuple[Overridden, ...] = ()


class Started(msgspec.Struct, frozen=True):
    """The answer to a start. `fresh` is false when the request had been carried out before."""

    run: Run
    fresh: bool


class Grouped(msgspec.Struct, frozen=True):
    """The answer to the start of a group. `failed`: the engines that nothing was sent to, and why."""

    group: str
    runs: list[Run]
    failed: dict[str, str]
    fresh: bool


class StartSources(msgspec.Struct, frozen=True):
    """What starts have besides robots: the folder of `behaviours`, `courses(graph, umrf)`, which holds
    what is expected of a graph against it, and the folders that robots index, by their names."""

    behaviours: BehaviourFolder | None = None
    courses: CoursesOf | None = None
    index_folders: Mapping[str, Path] = {}


NO_SOURCES: Final = StartSources()


class StartChecks:
    """Looks before starts. `taken(engine, graph_name)` is the run that keeps an engine from a start of a
    graph of that name, if any;
    `going(engine)` the ids of all that go on there; `settled(engine)` what somebody has seen at rest
    there."""

    def __init__(
        self,
        robots: Robots,
        *,
        clock_us: ClockUs,
        run_in_worker: RunInWorker,
        taken: Callable[[str, str], Run | None],
        going: Callable[[str], Collection[str]],
        settled: Callable[[str], Sequence[Settled]],
        simulator: Simulator,
        approvals: Approvals,
        sources: StartSources,
    ) -> None:
        self._robots = robots
        self._approvals = approvals
        self._courses = sources.courses
        self._clock_us = clock_us
        self._run_in_worker = run_in_worker
        self._taken = taken
        self._going = going
        self._settled = settled
        self._simulator = simulator
        self._behaviours = sources.behaviours
        self._index_folders = sources.index_folders
        self._prefixes = Workspace.of(os.environ).prefixes

    async def cleared(self, asked: StartRequest, starter: str) -> Cleared:
        """Look, and refuse what stands in the way of a start by this person. Raises Refused of many
        kinds."""
        if asked.engine == SIMULATOR:
            return await self._cleared_simulation(asked)
        robot = self._robots.reachable(asked.engine)
        if asked.like is not None:
            raise BadInput("Only the simulator plays a robot.", where={"path": "/like"})
        if asked.behaviours:
            raise BadInput("Only the simulator runs behaviours.", where={"path": "/behaviours"})
        ready = await self._run_in_worker(prepared, asked, robot.facts, random_id())
        await self._approvals.require(robot.registration, ready.tree_digest, starter)
        overridden = asked.override.codes if asked.override else ()
        preflight.check_items([self.free(asked.engine, ready.name)], overridden)
        if self._robots.foreign_stops.going(asked.engine):
            raise Conflict(
                f"Something is being stopped on {asked.engine}; a start would be stopped with it.",
                where={"path": "/engine", "item": "quiet"},
            )
        try:
            view = await self._view(robot)
        except NoAnswer as nothing:
            silence = preflight.of_silence(asked.engine, str(nothing))
            raise Unavailable(silence.text, where={"path": "/engine", "item": "answers"}) from (
                nothing
            )
        items = await self._run_in_worker(looked_at, view, ready, self._prefixes)
        free = self.free(asked.engine, ready.name)
        preflight.check_items([free], overridden)
        preflight.check_items(items, overridden)
        return Cleared(
            ready=ready,
            link=robot,
            own=False,
            incarnation=view.answer.incarnation,
            despite=_despite(ready, (free, *items)),
        )

    async def _cleared_simulation(self, asked: StartRequest) -> Cleared:
        facts = self._simulated(asked)
        ready = await self._run_in_worker(prepared, asked, facts, random_id())
        behaviours = await self._folder(ready) if asked.behaviours else None
        link = self._simulator(facts, ready.script, self._clock_us, behaviours)
        return Cleared(
            ready=ready,
            link=link,
            own=True,
            incarnation=link.standing.incarnation,
            despite=_despite(ready, ()),
        )

    async def all_cleared(self, starts: Sequence[StartRequest], starter: str) -> list[Cleared]:
        """Look at several engines at once, and refuse all if one has to be. Raises Conflict."""
        cleared: dict[str, Cleared] = {}
        refused: dict[str, Refused] = {}

        async def look(each: StartRequest) -> None:
            try:
                cleared[each.engine] = await self.cleared(each, starter)
            except Refused as why:
                refused[each.engine] = why

        async with anyio.create_task_group() as tasks:
            for each in starts:
                tasks.start_soon(look, each)
        if refused:
            told = " ".join(f"{name}: {why.detail}" for name, why in sorted(refused.items()))
            engines = {name: why.where or {} for name, why in refused.items()}
            raise Conflict(
                f"Nothing was started. {told}", where={"path": "/engines", "engines": engines}
            )
        return [cleared[each.engine] for each in starts]

    async def look(self, asked: GroupRequest, starter: str) -> list[Preflight]:
        """Look, and tell all of it. Never raises Refused; nothing is stored or sent but a get."""
        found: dict[str, Preflight] = {}
        expected: list[Item] = []

        async def look(engine: str) -> None:
            found[engine] = await self._look(asked.of(engine), starter)

        async def hold_against() -> None:
            expected.extend(await self._expected(asked))

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(hold_against)
            for engine in asked.engines:
                tasks.start_soon(look, engine)
        return [preflight.with_items(found[engine], expected) for engine in asked.engines]

    async def _expected(self, asked: GroupRequest) -> Sequence[Item]:
        """Whether the graph goes as it is expected to. That warns, and never stands in the way: not
        even when it cannot be looked at."""
        if self._courses is None or asked.graph is None:
            return ()
        try:
            with anyio.fail_after(_COURSES_S):
                found = await self._courses(asked.graph, bytes(asked.umrf), asked.subgraphs)
                return of_courses(found)
        except TimeoutError:
            return (of_unknown_courses(f"That takes longer than {_COURSES_S:.0f} s."),)
        except Refused as refused:
            return (of_unknown_courses(refused.detail),)

    async def _look(self, asked: StartRequest, starter: str) -> Preflight:
        items: list[Item] = []
        robot: KnownEngine | None = None
        ready: Prepared | None = None
        try:
            if asked.engine == SIMULATOR:
                facts = self._simulated(asked)
            else:
                robot = self._robots.reachable(asked.engine)
                facts = robot.facts
        except Refused as refused:
            return preflight.summed(asked.engine, [preflight.of_refusal("link", refused)])
        try:
            ready = await self._run_in_worker(partial(prepared, approved=False), asked, facts, "")
            items.append(preflight.of_graph(ready))
            if asked.behaviours:
                await self._folder(ready)
        except Refused as refused:
            items.append(preflight.of_refusal("graph", refused))
        if robot is not None:
            items.append(self.free(asked.engine, ready.name if ready is not None else ""))
            items += await self._look_at(robot, ready)
            items += await self._said_yes(robot, ready, starter)
        digests = (ready.digest, ready.tree_digest) if ready is not None else ("", "")
        return preflight.summed(asked.engine, items, *digests)

    def free(self, engine: str, graph_name: str) -> Item:
        """Return whether another run keeps a robot from the start of a graph of this name."""
        longest_ms = self._robots.reachable(engine).facts.longest_loading_ms
        other = self._taken(engine, graph_name)
        return preflight.of_taken(engine, other, graph_name, longest_ms, self._clock_us())

    async def _look_at(self, robot: KnownEngine, ready: Prepared | None) -> list[Item]:
        try:
            view = await self._view(robot)
        except NoAnswer as nothing:
            return [preflight.of_silence(robot.registration.name, str(nothing))]
        if ready is None:
            return [preflight.of_answer(view)]
        return list(await self._run_in_worker(looked_at, view, ready, self._prefixes))

    async def _said_yes(
        self, robot: KnownEngine, ready: Prepared | None, starter: str
    ) -> list[Item]:
        if ready is None:
            return []
        item = await self._approvals.item(robot.registration, ready.tree_digest, starter)
        return [] if item is None else [item]

    async def _view(self, robot: KnownEngine) -> EngineView:
        """The engine as it answers a get sent now, on the path that would confirm a stop; once it has read
        what was just written for it. Raises NoAnswer."""
        await robot.indexed()
        name, began = robot.registration.name, anyio.current_time()
        going = frozenset(self._going(name))  # what is taken back later on is in nobody's hand yet
        answer: Answer
        try:
            with anyio.fail_after(_PREFLIGHT_S):
                answer = await robot.get()
        except TimeoutError as late:
            raise NoAnswer(f"Asked for {_PREFLIGHT_S:.0f} s. {robot.standing.why}") from late
        took = 1000 * (anyio.current_time() - began)
        return EngineView(
            name=name,
            facts=robot.facts,
            standing=robot.standing,
            answer=answer,
            index=await robot.index(self._run_in_worker),
            took_ms=took,
            open_runs=going,
            settled=tuple(self._settled(name)),
            index_folder=self._index_folders.get(name),
        )

    async def _folder(self, ready: Prepared) -> BehaviourFolder:
        """Where the behaviours of a graph are, all of which can be run. Raises Conflict."""
        where: dict[str, object] = {"path": "/behaviours"}
        if self._behaviours is None:
            raise Conflict(
                "This runner has no behaviours: whoever starts it names their folder.", where=where
            )
        own = {each.rpartition("_")[0] for each in ready.actions}
        names = sorted(own | set(ready.inner))
        found = await self._run_in_worker(self._behaviours.listed, names)
        if found.problem or found.refused:
            told = " ".join([found.problem, *found.refused.values()]).strip()
            raise Conflict(f"{told} Nothing was started.", where=where)
        return self._behaviours

    def _simulated(self, asked: StartRequest) -> EngineFacts:
        """What is true of the simulator, as itself or playing a robot. Raises NotFound."""
        if asked.like is None:
            return _ITSELF
        facts = facts_of(self._robots.registration(asked.like).profile)
        return msgspec.structs.replace(facts, simulated=True)


def _despite(ready: Prepared, items: Sequence[Item]) -> tuple[Overridden, ...]:
    """What somebody overrides: of the graph, and of the robot that has answered."""
    found = [each for each in ready.problems if each.severity == "error"]
    told: list[Overridden] = []
    for item in items:
        if item.verdict != "blocked":
            continue
        found += item.problems
        if not item.problems:
            told.append(Overridden(code=item.code, text=item.text))
    told += [
        Overridden(code=each.code, text=each.message, aid=each.where.aid, path=each.where.path)
        for each in found
    ]
    return tuple(told[:_TOLD])
