"""The checks of a start: read, check, ask the engine, decide. A pre-flight makes the same checks and lists
all that they find, instead of ending at the first refusal."""

import itertools
import os
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final, TypeAlias

import anyio
import msgspec

from action_assistant.errors import BadInput, Conflict, Refused, Unavailable
from action_assistant.random_ids import random_id
from action_assistant.ros_workspace import Workspace
from action_assistant.runner.analysis.course_checks import CheckedCourses
from action_assistant.runner.execution.accepted_start import AcceptedStart, LedStart
from action_assistant.runner.execution.conducted_steps import CONDUCTED_FACTS, leading_facts
from action_assistant.runner.execution.earlier_runs import EarlierRuns
from action_assistant.runner.execution.late_activity import LateActivity
from action_assistant.runner.execution.led_look import LedLook
from action_assistant.runner.execution.open_runs import OpenRuns
from action_assistant.runner.links.behaviours.folder import BehaviourFolder
from action_assistant.runner.links.port import (
    CONDUCTED,
    SIMULATOR,
    Answer,
    NoAnswer,
)
from action_assistant.runner.links.simulator import Simulator
from action_assistant.runner.robots.engine import KnownEngine
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import Author, Overridden, Requested
from action_assistant.runner.runs.sent_graphs import SentSubgraph
from action_assistant.runner.runs.sight import NO_RULES, RunSight, Unseen
from action_assistant.runner.runtime import Runtime
from action_assistant.runner.start import preflight
from action_assistant.runner.start.admission import (
    GroupRequest,
    Prepared,
    StartRequest,
    prepared,
    prepared_pieces,
)
from action_assistant.runner.start.approvals import Approvals, Approved
from action_assistant.runner.start.casting import require_not_led
from action_assistant.runner.start.led_items import (
    INDEXING,
    beginning_items,
    led_item,
    led_items,
    with_beginning,
)
from action_assistant.runner.start.orders import (
    Often,
    Ordered,
    claim_of,
    engines_of,
    ordered,
    overridden_in,
    require_plain,
    watched_in,
)
from action_assistant.runner.start.preflight import EngineView, Item, Preflight
from action_assistant.runner.start.rights_registry import (
    ReleaseOf,
    RightsRegistry,
    nothing_released,
)
from action_assistant.runner.start.start_from import EarlierRun
from action_assistant.runner.stop.foreign_stop import ForeignStopLoop
from action_assistant.umrf.check import forbids_start
from action_assistant.umrf.facts import SIMULATED, EngineFacts, facts_of
from action_assistant.umrf.kept_values import has_keeper
from action_assistant.web.auth.identity import Identity

#: Facts of the simulator when it plays no robot: there a paused run can be stopped.
_SIMULATOR_FACTS: Final = msgspec.structs.replace(SIMULATED, pauses_safely=True)
_GET_S: Final = 2.0
_COURSES_S: Final = 5.0  # a pre-flight waits at most so long for expected courses
_MOST_OVERRIDDEN: Final = 40  # overridden problems that are stored with a run

#: Checks the expected courses of a graph, by its id, against a text of it and the graphs inside.
CoursesOf: TypeAlias = Callable[
    [str, bytes, Sequence[SentSubgraph], Unseen | None], Awaitable[CheckedCourses]
]


class StartSources(msgspec.Struct, frozen=True):
    """Further sources that a start needs: the folder of Python `behaviours` of simulated actions,
    the check of expected `courses`, the index folders by robot, and the release of a graph by its
    digest (`release_of`), and who may see which graphs."""

    behaviours: BehaviourFolder | None = None
    courses: CoursesOf | None = None
    index_folders: Mapping[str, Path] = {}
    release_of: ReleaseOf = nothing_released
    sight: RunSight = NO_RULES


NO_SOURCES: Final = StartSources()


class StartChecks:
    """Decides whether a graph may be started on one engine. Nothing is stored, and an engine is
    only asked for its graphs."""

    def __init__(
        self,
        runs: OpenRuns,
        late_activity: LateActivity,
        robots: Robots,
        foreign_stops: ForeignStopLoop,
        runtime: Runtime,
        *,
        approvals: Approvals,
        look: LedLook,
        rights: RightsRegistry,
        simulator: Simulator,
        sources: StartSources,
        earlier: EarlierRuns,
    ) -> None:
        self._runs = runs
        self._earlier = earlier
        self._late_activity = late_activity
        self._robots = robots
        self._foreign_stops = foreign_stops
        self._approvals = approvals
        self._look_led = look
        self._rights = rights
        self._clock_us = runtime.clock_us
        self._run_in_worker = runtime.run_in_worker
        self._simulator = simulator
        self._sources = sources
        self._prefixes = Workspace.of(os.environ).prefixes

    async def require_sight(self, request: StartRequest | GroupRequest, starter: Identity) -> None:
        """Verify the sight of a version, and check that the starter may see all of its graphs. Raise
        what `RunSight.accept` raises."""
        sight, digests = self._sources.sight, (request.digest, request.tree_digest)
        await sight.accept(request.sight, request.version, digests, starter)
        sight.require_graphs(starter, request.graph, *(each.graph for each in request.subgraphs))

    def with_sight(
        self, requested: Requested, request: StartRequest, starter: Identity
    ) -> Requested:
        """Return the first event of a run with the sight of the request (the sealed rules of its
        graphs), or the note that it has none though rules exist. Raise Forbidden if the starter
        may not see the graph that the event names."""
        sight = self._sources.sight
        sight.require_graphs(starter, requested.graph)
        unsighted = request.sight is None and sight.has_rules
        return msgspec.structs.replace(requested, sight=request.sight, unsighted=unsighted)

    async def accept(
        self,
        request: StartRequest,
        starter: Identity,
        often: Often = None,
        together: Sequence[str] = (),
    ) -> AcceptedStart:
        """Take a request through all checks that may refuse it, and wait for the answer of the
        robot. `starter`: the person who starts; `often`: how often it is carried out; `together`: all
        robots of a start on several. Raise a subclass of Refused if one check does."""
        if request.drill and len(engines_of(request)) != 1:
            raise BadInput("A Stop drill is made on one robot.", where={"path": "/drill"})
        if self.leads(request.engine, request.robots):
            if request.drill:
                where: dict[str, object] = {"path": "/drill"}
                raise BadInput(
                    "A Stop drill is made with a graph that is handed over whole.", where=where
                )
            return await self._accept_conducted(request, starter, often)
        earlier = await self._earlier.read(request, starter)
        require_not_led(request.robots, request.people)
        watched_in(request.watching, engines_of(request))
        if request.engine == SIMULATOR:
            return await self._accept_simulation(request, earlier)
        robot, limits = (
            self._robots.reachable(request.engine),
            self._rights.limits([request.engine]),
        )
        require_plain(request)
        prepare = partial(prepared, earlier=earlier, limits=limits)
        ready = await self._run_in_worker(prepare, request, robot.facts, random_id())
        limits = self._rights.limits(together or [request.engine])
        codes = overridden_in(request)
        order = ordered(request, ready.tree_digest, codes, limits, often, together)
        return await self._accept_on(robot, request, ready, starter, order=order)

    def leads(self, engine: str, robots: Mapping[str, str]) -> bool:
        """Return whether a start on `engine` is that of a led run. `robots`: the robots that
        the start names, by actor; if it names none, a robot with the name `conducted` may be meant,
        registered before that name was reserved."""
        return engine == CONDUCTED and (bool(robots) or CONDUCTED not in self._robots.names)

    async def accept_all(
        self, requests: Sequence[StartRequest], starter: Identity, often: Often = None
    ) -> list[AcceptedStart]:
        """Accept the starts on several engines, all at the same time, and wait for their answers.
        `starter`, `often`: as for `accept`. Raise Conflict, with the reasons of all engines, if at
        least one start is refused."""
        names = [each.engine for each in requests]
        return await _all_accepted(requests, lambda each: self.accept(each, starter, often, names))

    async def _accept_on(
        self,
        robot: KnownEngine,
        request: StartRequest,
        ready: Prepared,
        starter: Identity,
        *,
        order: Ordered,
        is_led: bool = False,
    ) -> AcceptedStart:
        """Take a prepared start through the checks that concern its robot, and wait for its answer.
        `starter`: the id of the person; `order`: the whole order; `is_led`: it is the part of a led run
        on this robot.
        Raise Unavailable if the robot does not answer, Conflict if a check fails."""
        approved = await self._check(request, ready, robot, starter, order)
        try:
            view = await self._ask(robot)
        except NoAnswer as nothing:
            silence = preflight.silence_item(request.engine, str(nothing))
            raise Unavailable(silence.text, where={"path": "/engine", "item": "answers"}) from (
                nothing
            )
        accepted = await self._decide(request, ready, robot, view, starter, is_led=is_led)
        return msgspec.structs.replace(accepted, approved=approved)

    async def _accept_conducted(
        self, request: StartRequest, starter: Identity, often: Often
    ) -> AcceptedStart:
        """Take the start of a led run through all checks, with all its robots at the same
        time. `starter`: the person; `often`: as for `accept`. Raise Conflict, with the reasons of all robots, if a
        check refuses it."""
        require_plain(request)
        watched_in(request.watching, engines_of(request))
        earlier = await self._earlier.read(request, starter)
        limits = self._rights.limits(engines_of(request))
        prepare = partial(prepared_pieces, earlier=earlier, limits=limits)
        ready = await self._run_in_worker(prepare, request, CONDUCTED_FACTS, random_id())
        request = msgspec.structs.replace(request, robots=ready.robots, people=ready.people)
        items = (*beginning_items(ready.whole, request.start_from), *led_items(ready))
        overridden = overridden_in(request)
        order = ordered(request, ready.whole.tree_digest, overridden, limits, often)
        preflight.require_clear(items, overridden)
        parts = [
            msgspec.structs.replace(request, engine=name, robots={}, people={})
            for name in engines_of(request)
        ]

        async def accept(part: StartRequest) -> AcceptedStart:
            robot = self._robots.reachable(part.engine)
            require_led(robot)
            own = ready.by_robot[part.engine]
            return await self._accept_on(robot, part, own, starter, order=order, is_led=True)

        accepted = await _all_accepted(parts, accept)
        facts = leading_facts(is_simulated=not parts)
        led = frozenset(ready.whole.actions)
        engine = self._simulator(facts, ready.whole.script, self._clock_us, led=led)
        return AcceptedStart(
            request=request,
            prepared=ready.whole,
            link=engine,
            is_simulated=not parts,
            incarnation=ready.whole.run,
            despite=_each_once(
                _overridden(ready.whole, items), *(each.despite for each in accepted)
            ),
            approved=tuple(yes for each in accepted for yes in each.approved),
            led=LedStart(
                pieces=ready,
                lives={each.request.engine: each.incarnation for each in accepted},
                by_word={
                    each.request.engine: each.incarnation
                    for each in accepted
                    if any(problem.code == INDEXING for problem in each.despite)
                },
                keeping=tuple(each.request.engine for each in accepted if each.keeps),
                engine=engine,
            ),
        )

    async def _accept_simulation(
        self, request: StartRequest, earlier: EarlierRun | None
    ) -> AcceptedStart:
        facts = self._simulated_facts(request)
        prepare = partial(prepared, earlier=earlier)
        ready = await self._run_in_worker(prepare, request, facts, random_id())
        behaviours = await self._behaviours_for(ready) if request.behaviours else None
        link = self._simulator(facts, ready.script, self._clock_us, behaviours)
        return AcceptedStart(
            request=request,
            prepared=ready,
            link=link,
            is_simulated=True,
            incarnation=link.standing.incarnation,
            despite=_overridden(ready, ()),
        )

    async def _check(
        self,
        request: StartRequest,
        ready: Prepared,
        robot: KnownEngine,
        starter: Identity,
        order: Ordered,
    ) -> tuple[Approved, ...]:
        """Make the checks that need no answer of the engine: the rights of the robot, the yes of a second
        person, which is returned, whether a run keeps the robot, and whether anything is being stopped there.
        `starter`: the person; `order`: the whole order. Raise Conflict or Forbidden if one fails."""
        self._rights.require([request.engine], starter, claim_of(request, ready))
        demand = self._approvals.demand(order, request, starter.person.id)
        approved = await self._approvals.require(robot.registration, demand)
        overridden = overridden_in(request)
        preflight.require_clear([self._free_item(request.engine, ready.name)], overridden)
        if self._foreign_stops.is_stopping(request.engine):
            raise Conflict(
                f"Something is being stopped on {request.engine}; a start would be stopped with it.",
                where={"path": "/engine", "item": "quiet"},
            )
        return approved

    async def _ask(self, robot: KnownEngine) -> EngineView:
        """Send a get to the engine, in the same way that would confirm a Stop, after it has read
        its new index files. Return its answer together with what the runner knows of it. Raise
        NoAnswer if none comes in time."""
        await robot.indexed()
        name, began = robot.registration.name, anyio.current_time()
        open_runs = frozenset(self._runs.on(name))  # before the get: a run may move again meanwhile
        answer: Answer
        try:
            with anyio.fail_after(_GET_S):
                answer = await robot.get()
        except TimeoutError as late:
            raise NoAnswer(f"Asked for {_GET_S:.0f} s. {robot.standing.why}") from late
        took_ms = 1000 * (anyio.current_time() - began)
        return EngineView(
            name=name,
            facts=robot.facts,
            standing=robot.standing,
            answer=answer,
            index=await robot.index(self._run_in_worker),
            took_ms=took_ms,
            open_runs=open_runs,
            settled=self._late_activity.settled_on(name),
            index_folder=self._sources.index_folders.get(name),
            names_graphs=not self._sources.sight.has_rules,
        )

    async def _decide(
        self,
        request: StartRequest,
        ready: Prepared,
        robot: KnownEngine,
        view: EngineView,
        starter: Identity,
        *,
        is_led: bool,
    ) -> AcceptedStart:
        """Accept a start unless an item of its pre-flight blocks it and was not overridden; raise
        Conflict then. `view`: the answer of the engine; `is_led`: it is the part of a led
        run."""
        items = [
            *await self._run_in_worker(preflight.engine_items, view, ready, self._prefixes),
            *(
                await self._look_led.items(robot, view.answer, starter, claim_of(request, ready))
                if is_led
                else ()
            ),
        ]
        free = self._free_item(request.engine, ready.name)  # again: time has passed
        accepted = AcceptedStart(
            request=request,
            prepared=ready,
            link=robot,
            is_simulated=False,
            incarnation=view.answer.incarnation,
            doubt=view.standing.doubt,
            despite=_overridden(ready, (free, *items)),
            keeps=has_keeper(view.index.actions),
        )
        preflight.require_clear([free], accepted.overridden)
        preflight.require_clear(items, accepted.overridden)
        return accepted

    async def give_words(self, accepted: AcceptedStart, author: Author) -> None:
        """Store what the starter of an accepted led run vouches for: that engines index their
        files only once. Does nothing for other starts. Raise Unavailable if the journal cannot
        store it."""
        override = accepted.request.override
        if accepted.led is not None and override is not None:
            await self._look_led.give_words(accepted.led.by_word, author, override.reason)

    def require_free(self, accepted: AcceptedStart) -> None:
        """Raise Conflict if by now another run keeps one of the robots from an accepted start; one
        that was over may have moved again meanwhile."""
        name = accepted.prepared.name
        items = [self._free_item(each, name) for each in engines_of(accepted.request)]
        preflight.require_clear(items, accepted.overridden)

    def require_approved(self, accepted: AcceptedStart) -> None:
        """Raise NotSent unless the yes by which robots take a start still counts. Does not wait."""
        self._approvals.require_still(accepted.approved)

    def why_occupied(self, accepted: AcceptedStart) -> str:
        """Return the sentence that says which run by now keeps a robot from an accepted start; ""
        if none does."""
        for engine in engines_of(accepted.request):
            item = self._free_item(engine, accepted.prepared.name)
            if preflight.is_blocking(item, accepted.overridden):
                return item.text
        return ""

    def _free_item(self, engine: str, graph_name: str) -> Item:
        """Return the pre-flight item that says whether another run keeps the robot `engine` from
        starting a graph of this name."""
        longest_ms = self._robots.reachable(engine).facts.longest_loading_ms
        other = self._runs.occupying(engine, graph_name)
        names_graphs = not self._sources.sight.has_rules
        return preflight.free_item(
            engine, other, graph_name, longest_ms, self._clock_us(), names_graphs=names_graphs
        )

    async def _behaviours_for(self, ready: Prepared) -> BehaviourFolder:
        """Return the folder of Python behaviours of simulated actions, after a check that all those
        it has for actions of the graph and its sub-graphs can be used. Not every action needs one.
        Raise Conflict if this runner has no such folder, or the folder or a behaviour cannot be
        used."""
        where: dict[str, object] = {"path": "/behaviours"}
        folder = self._sources.behaviours
        if folder is None:
            raise Conflict(
                "This runner has no behaviours: whoever starts it names their folder.", where=where
            )
        own = {each.rpartition("_")[0] for each in ready.actions}
        names = sorted(own | set(ready.inner))
        found = await self._run_in_worker(folder.listed, names)
        if found.problem or found.refused:
            reasons = " ".join([found.problem, *found.refused.values()]).strip()
            raise Conflict(f"{reasons} Nothing was started.", where=where)
        return folder

    def _simulated_facts(self, request: StartRequest) -> EngineFacts:
        """Return what is true of the engine to simulate: of the simulator or, if the request says
        so (`like`), of the build of a registered robot. Raise NotFound if that robot is not
        registered."""
        if request.like is None:
            return _SIMULATOR_FACTS
        facts = facts_of(self._robots.registration(request.like).profile)
        return msgspec.structs.replace(facts, simulated=True)

    # --- pre-flight ---------------------------------------------------------------------------

    async def look(
        self, group: GroupRequest, starter: Identity, often: Often = None
    ) -> list[Preflight]:
        """Return the pre-flight of a start on each engine that `group` names. `starter`: the
        person who would start; `often`: as for `accept`. A refusal becomes an item of the pre-flight. Nothing is stored;
        engines are only asked for their graphs. Raise Unavailable if a worker dies."""
        if any(self.leads(engine, group.robots) for engine in group.engines):
            return await self._look_conducted(group.for_engine(CONDUCTED), starter, often)
        found: dict[str, Preflight] = {}
        courses: list[Item] = []
        refused: list[Refused] = []

        async def look(engine: str) -> None:
            found[engine] = await self._look(group.for_engine(engine), starter)

        async def check_courses() -> None:
            courses.extend(await self._course_items(group, starter))

        async def kept(work: Awaitable[None]) -> None:
            try:
                await work
            except Refused as error:  # such as a worker that has died; a task group would wrap it
                refused.append(error)

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(kept, check_courses())
            for engine in group.engines:
                tasks.start_soon(kept, look(engine))
        if refused:
            raise refused[0]
        looks = [preflight.with_items(found[engine], courses) for engine in group.engines]
        first, together = group.for_engine(group.engines[0]), group.engines
        together = () if SIMULATOR in together else together  # such a look is at each by itself
        return await self._approved(looks, first, starter, often, together)

    async def _look_conducted(
        self, request: StartRequest, starter: Identity, often: Often
    ) -> list[Preflight]:
        """Return the pre-flight of a led run: first that of the whole graph, then that of
        each robot. `starter`: the person who would start; `often`: as for `accept`."""
        try:
            earlier = await self._earlier.read(request, starter)
            limits = self._rights.limits(engines_of(request))
            prepare = partial(prepared_pieces, approved=False, earlier=earlier, limits=limits)
            ready = await self._run_in_worker(prepare, request, CONDUCTED_FACTS, "")
        except Refused as refused:
            item = preflight.refusal_item(_code_of(refused), refused)
            return [preflight.with_verdict(CONDUCTED, [item])]
        whole, start = ready.whole, request.start_from
        request = msgspec.structs.replace(request, robots=ready.robots, people=ready.people)
        marks = preflight.breakpoint_items(request.breakpoints, is_led=True)
        begins = beginning_items(whole, start)
        items = [preflight.graph_item(whole), *begins, *led_items(ready), *marks]
        first = preflight.with_verdict(CONDUCTED, items, whole.digest, whole.tree_digest)
        found = [with_beginning(first, whole, start)]
        for name in engines_of(request):
            try:
                robot = self._robots.reachable(name)
                require_led(robot)
            except Refused as refused:
                item = preflight.refusal_item("link", refused)
                found.append(preflight.with_verdict(name, [item]))
                continue
            own = ready.by_robot[name]
            listed = [
                self._free_item(name, own.name),
                *await self._engine_items(robot, own, starter, led=request),
            ]
            found.append(preflight.with_verdict(name, listed, whole.digest, whole.tree_digest))
        return await self._approved(found, request, starter, often)

    async def _look(self, request: StartRequest, starter: Identity) -> Preflight:
        """Return the pre-flight of one engine. `starter`: the person who would start. A
        refusal by one check becomes an item, and the next check is made all the same."""
        items: list[Item] = []
        robot: KnownEngine | None = None
        ready: Prepared | None = None
        try:
            if request.engine == SIMULATOR:
                facts = self._simulated_facts(request)
            else:
                robot = self._robots.reachable(request.engine)
                facts = robot.facts
        except Refused as refused:
            return preflight.with_verdict(request.engine, [preflight.refusal_item("link", refused)])
        try:
            earlier = await self._earlier.read(request, starter)
            limits = self._rights.limits([request.engine])
            prepare = partial(prepared, approved=False, earlier=earlier, limits=limits)
            ready = await self._run_in_worker(prepare, request, facts, "")
            items.append(preflight.graph_item(ready))
            items += beginning_items(ready, request.start_from)
            items += preflight.breakpoint_items(request.breakpoints, is_led=False)
            if request.behaviours:
                await self._behaviours_for(ready)
        except Refused as refused:
            items.append(preflight.refusal_item("graph", refused))
        if robot is not None:
            items.append(self._free_item(request.engine, ready.name if ready is not None else ""))
            items += self._rights.items(request.engine, starter, claim_of(request, ready))
            items += await self._engine_items(robot, ready, starter)
        if ready is None:
            return preflight.with_verdict(request.engine, items)
        found = preflight.with_verdict(request.engine, items, ready.digest, ready.tree_digest)
        return with_beginning(found, ready, request.start_from)

    async def _engine_items(
        self,
        robot: KnownEngine,
        ready: Prepared | None,
        starter: Identity,
        *,
        led: StartRequest | None = None,
    ) -> list[Item]:
        """Return the items that need an answer of the robot. `led`: the start of a led run, else
        None."""
        try:
            view = await self._ask(robot)
        except NoAnswer as nothing:
            return [preflight.silence_item(robot.registration.name, str(nothing))]
        if ready is None:
            return [preflight.answer_item(view)]
        items = await self._run_in_worker(preflight.engine_items, view, ready, self._prefixes)
        if led is None:
            return list(items)
        claim = claim_of(led, ready)
        return [*items, *await self._look_led.items(robot, view.answer, starter, claim)]

    async def _approved(
        self,
        looks: Sequence[Preflight],
        request: StartRequest,
        starter: Identity,
        often: Often,
        together: Sequence[str] = (),
    ) -> list[Preflight]:
        """Return the pre-flights of a start with the items about a second person, who says yes also to
        what it overrides; if it does not say that yet, to what all of them would. The order in words is
        remembered for those who are asked."""
        codes = overridden_in(request) or {code for each in looks for code in each.override}
        found: list[Preflight] = []
        is_led = self.leads(request.engine, request.robots)
        for look in looks:
            is_robot = look.engine not in {SIMULATOR, CONDUCTED} and look.tree_digest
            robot = self._robots.registration(look.engine) if is_robot else None
            robots = engines_of(request) if is_led else together or (look.engine,)
            limits = self._rights.limits(robots)
            order = ordered(request, look.tree_digest, codes, limits, often, together)
            demand = self._approvals.demand(order, request, starter.person.id)
            looked = robot and await self._approvals.look(robot, demand)
            if looked:
                lines = self._approvals.remember(demand, request.graph)
                look = msgspec.structs.replace(
                    preflight.with_approval(look, looked[0]), order_digest=order.digest, order=lines
                )
            found.append(look)
        return found

    async def _course_items(self, group: GroupRequest, starter: Identity) -> Sequence[Item]:
        """Return the items that say whether the graph takes its expected courses (recorded runs
        that it has to repeat); () if there is nothing to check. They only warn and never block a
        start, even if the courses could not be checked."""
        if self._sources.courses is None or group.graph is None:
            return ()
        try:
            with anyio.fail_after(_COURSES_S):
                unseen = self._sources.sight.unseen(starter)
                found = await self._sources.courses(
                    group.graph, bytes(group.umrf), group.subgraphs, unseen
                )
                return preflight.course_items(found)
        except TimeoutError:
            why = f"That takes longer than {_COURSES_S:.0f} s."
            return (preflight.unknown_courses_item(why),)
        except Refused as refused:
            return (preflight.unknown_courses_item(refused.detail),)


def _code_of(refused: Refused) -> str:
    """Return the code of the pre-flight item for a graph that cannot be led: `subgraph-across` if a
    sub-graph has actions of several robots, which has a remedy of its own; else `graph`."""
    obstacles = (refused.where or {}).get("obstacles")
    is_shared = isinstance(obstacles, list | tuple) and any(
        each["code"] == "subgraph-across" for each in obstacles
    )
    return "subgraph-across" if is_shared else "graph"


def require_led(robot: KnownEngine) -> None:
    """Raise Conflict unless the owner of a robot allows runs that the runner leads step by step."""
    item = led_item(robot.registration)
    if item.verdict == "blocked":
        raise Conflict(item.text, where={"path": "/robots", "item": item.code})


async def _all_accepted(
    requests: Sequence[StartRequest], accept: Callable[[StartRequest], Awaitable[AcceptedStart]]
) -> list[AcceptedStart]:
    """Call `accept` for each request at the same time, and return the results in the order of the
    requests. Raise Conflict, with the reasons of all engines, if at least one start is refused."""
    accepted: dict[str, AcceptedStart] = {}
    refused: dict[str, Refused] = {}

    async def try_one(each: StartRequest) -> None:
        try:
            accepted[each.engine] = await accept(each)
        except Refused as why:
            refused[each.engine] = why

    async with anyio.create_task_group() as tasks:
        for each in requests:
            tasks.start_soon(try_one, each)
    if refused:
        reasons = " ".join(f"{name}: {why.detail}" for name, why in sorted(refused.items()))
        engines = {name: why.where or {} for name, why in refused.items()}
        raise Conflict(
            f"Nothing was started. {reasons}", where={"path": "/engines", "engines": engines}
        )
    return [accepted[each.engine] for each in requests]


def _each_once(*despite: Iterable[Overridden]) -> tuple[Overridden, ...]:
    """Return the overridden problems of the whole graph and of its robots, each of them once."""
    return tuple(dict.fromkeys(itertools.chain.from_iterable(despite)))[:_MOST_OVERRIDDEN]


def _overridden(ready: Prepared, items: Sequence[Item]) -> tuple[Overridden, ...]:
    """Return the problems that a person overrides: those of the graph that forbid a start, and
    those of `items` that block it on the robot."""
    problems = list(filter(forbids_start, ready.problems))
    found: list[Overridden] = []
    for item in items:
        if item.verdict != "blocked":
            continue
        problems += item.problems
        if not item.problems:
            found.append(Overridden(code=item.code, text=item.text))
    found += [
        Overridden(code=each.code, text=each.message, aid=each.where.aid, path=each.where.path)
        for each in problems
    ]
    return tuple(found[:_MOST_OVERRIDDEN])
