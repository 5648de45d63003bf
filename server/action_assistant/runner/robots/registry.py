"""The registry: the engines that runs can go to, which are the simulator and registered robots."""

import logging
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import Final, Protocol, TypeAlias

import anyio
import msgspec

from action_assistant.errors import BadInput, Conflict, NotFound
from action_assistant.journal.events import Draft
from action_assistant.kit.clock import ClockUs
from action_assistant.logs.context import begin
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import (
    SIMULATOR,
    Candidate,
    ForeignCommand,
    Link,
    Reach,
    Registration,
    Sighting,
)
from action_assistant.runner.robots.engine import EngineIndex, KnownEngine, foreign_graphs
from action_assistant.runner.robots.recordings import Recordings
from action_assistant.runner.robots.registration import (
    STREAM,
    Robot,
    RobotRegistered,
    RobotRemoved,
    check_registration,
    with_engine,
)
from action_assistant.runner.robots.robot_events import (
    Commanded,
    EngineBecame,
    RobotEvent,
    RobotLog,
    StopAsked,
    left_unproven,
)
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.history import RunnerJournal
from action_assistant.umrf.facts import PINNED, BadProfile, EngineFacts, facts_of
from action_assistant.web.auth.caller import BackgroundTasks
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_NO_LINK: Final = "This runner cannot start or stop anything on it."
_NOT_YET: Final = "It has not answered yet."
_ANSWERS: Final = frozenset({"answering", "restarted"})
_TOLD: Final = 500  # newest entries of a flight record


class ForeignStops(Protocol):
    """The part of `ForeignStopLoop` that the registry uses: it stops graphs that others have
    started."""

    def trouble(self, robot: str, graph: str) -> str | None:
        """Return why a Stop of this graph is not proven yet; "" as long as no reason is known, None
        when no Stop of the graph is wanted."""
        ...

    def is_stopping(self, robot: str) -> bool:
        """Return whether any graph on this robot is being stopped."""
        ...

    def graphs(self) -> dict[str, list[str]]:
        """Return the graphs that are being stopped, by robot."""
        ...

    def pending(self) -> Iterator[tuple[str, str]]:
        """Yield, for each graph that is being stopped, its robot and the reason why the Stop is not
        proven yet."""
        ...

    def stop(self, engine: KnownEngine, graph: str, author: Author) -> None:
        """Begin to stop a graph. The call never waits."""
        ...

    def take_up(self, robot: str, asked: StopAsked) -> None:
        """Continue a Stop that an earlier process has left without a proof. The call never waits."""
        ...

    def hear_of(self, robot: str, command: ForeignCommand) -> None:
        """Note a command of somebody else that may have started the graph again."""
        ...

    def shows(self, engine: KnownEngine, snapshots: tuple[Snapshot, ...]) -> None:
        """Note the graphs that an engine shows in an answer or by feedback. The call never waits."""
        ...


Note: TypeAlias = Callable[[str, RobotEvent, str], None]
Present: TypeAlias = Callable[[str], KnownEngine | None]


class RegistryContext(msgspec.Struct, frozen=True):
    """The services that the registry uses. `foreign`: called with each command of somebody else,
    returns its event; `shows`: called with all graphs that an engine shows; `stops`: makes the
    object that stops foreign graphs."""

    journal: RunnerJournal
    tasks: BackgroundTasks
    clock_us: ClockUs
    run_in_worker: RunInWorker
    changed: Callable[[], None]
    foreign: Callable[[KnownEngine, ForeignCommand], Commanded]
    shows: Callable[[KnownEngine, tuple[Snapshot, ...]], None]
    stops: Callable[
        [BackgroundTasks, ClockUs, RunInWorker, Note, Callable[[], None], Present], ForeignStops
    ]


class Robots:
    """Keeps the registered robots and watches their engines. `reach` makes links, or is the reason
    why there are none; `links` exist already, by robot. `recordings` store raw messages.
    `indexing`: the robots whose index folder the runner writes into."""

    def __init__(
        self,
        links: Mapping[str, Link] | None = None,
        reach: Reach | str | None = None,
        recordings: Recordings | None = None,
        indexing: Collection[str] = (),
    ) -> None:
        self.recordings: Final = recordings
        self._indexing: Final = frozenset(indexing)
        self._given: Final = dict(links or {})
        self._reach: Final = reach if reach is not None else "No link to robots was made."
        self._registered: dict[str, Registration] = {}
        self._engines: dict[str, KnownEngine] = {}
        self._scopes: dict[str, anyio.CancelScope] = {}
        self._context: RegistryContext | None = None
        self._robot_log: RobotLog | None = None
        self._foreign_stops: ForeignStops | None = None

    def open(self, context: RegistryContext) -> None:
        """Start to watch the robots of `links`, and from now on every robot that is added."""
        self._context = context
        self._robot_log = RobotLog(context.journal, context.tasks)
        self._foreign_stops = context.stops(
            context.tasks,
            context.clock_us,
            context.run_in_worker,
            self._robot_log.note,
            lambda: context.changed(),
            self.present,
        )
        if self.recordings is not None:
            context.tasks.start_soon(self.recordings.run)
        for name in self._given:
            self.add(Registration(name=name))

    async def take_up_stops(self) -> None:
        """Continue the Stops of foreign graphs that an earlier process left without a proof. The
        call waits for no engine. A robot whose log cannot be read is skipped."""
        for name in self.names:
            try:
                stored = await self.robot_log.newest(name, _TOLD)
            except Exception:  # the Stops on other robots must go on
                log.exception("whether something was being stopped on %s cannot be read", name)
                continue
            for asked in left_unproven(event for _, event in stored):
                self.foreign_stops.take_up(name, asked)

    # --- the registry -------------------------------------------------------------------------

    async def register(self, registration: Registration, author: Author) -> Robot:
        """Store a new or changed registration, and link to the robot. Raise BadInput if it is not
        valid, Conflict if it has the name of the simulator, Unavailable if the journal cannot
        store it."""
        check_registration(registration)
        context = self._open_context()
        body = RobotRegistered(at=context.clock_us(), **msgspec.structs.asdict(registration))
        draft = Draft(body.kind, author.id, msgspec.json.encode(body))
        await context.journal.append(STREAM, [draft])
        self.add(registration)
        context.changed()
        return self.robot(registration.name)

    async def remove(self, name: str, author: Author) -> None:
        """Store that a robot is removed, and close its link. Raise NotFound if the robot is not
        registered, Unavailable if the journal cannot store that."""
        self.registration(name)
        context = self._open_context()
        body = RobotRemoved(at=context.clock_us(), name=name)
        draft = Draft(body.kind, author.id, msgspec.json.encode(body))
        await context.journal.append(STREAM, [draft])
        self._close(name)
        del self._registered[name]
        context.changed()

    def add(self, registration: Registration) -> None:
        """Link to a robot whose registration is stored already. An older link to the robot is
        closed if the registration has changed."""
        name = registration.name
        if self._registered.get(name) == registration and name in self._engines:
            return
        self._close(name)
        self._registered[name] = registration
        link, facts = self._link(registration)
        if link is None:
            return
        context = self._open_context()
        engine = KnownEngine(
            registration,
            facts,
            link,
            clock_us=context.clock_us,
            changed=context.changed,
            became=self._note_state,
            foreign=self._note_command,
            shows=self._show,
            recordings=self.recordings,
            indexes=name in self._indexing,
        )
        self._engines[name] = engine
        scope = self._scopes[name] = anyio.CancelScope()
        context.tasks.start_soon(self._watch, engine, scope)

    def _link(self, registration: Registration) -> tuple[Link | None, EngineFacts]:
        try:
            facts = facts_of(registration.profile)
        except BadProfile:  # of an earlier version, which did not check it
            log.warning("the profile of %s cannot be read", registration.name)
            facts = PINNED
        given = self._given.get(registration.name)
        if given is not None:
            return given, facts
        if isinstance(self._reach, str):
            return None, facts
        return self._reach.link(registration, facts), facts

    def _close(self, name: str) -> None:
        self._engines.pop(name, None)
        scope = self._scopes.pop(name, None)
        if scope is not None:
            scope.cancel()

    async def _watch(self, engine: KnownEngine, scope: anyio.CancelScope) -> None:
        begin({"robot": engine.registration.name})
        with scope:
            await engine.watch()

    def _open_context(self) -> RegistryContext:
        if self._context is None:
            raise RuntimeError("the registry is not open")
        return self._context

    @property
    def foreign_stops(self) -> ForeignStops:
        """The Stops of graphs that others run on robots."""
        if self._foreign_stops is None:
            raise RuntimeError("the registry is not open")
        return self._foreign_stops

    def stop_foreign_graphs(
        self, author: Author, own_runs: Callable[[str], Collection[str]], name: str | None = None
    ) -> list[str]:
        """Begin to stop all graphs that others have started, on the robot `name` or on all robots,
        and return each as "robot: graph". `own_runs(robot)` returns the ids of this runner's
        open runs on a robot. The call never waits. Raise NotFound if the robot is not
        registered."""
        if name is not None:
            self.registration(name)
        stopped: list[str] = []
        for robot, engine in self._engines.items():
            if name in {None, robot}:
                answer = engine.answer
                for graph in [] if answer is None else foreign_graphs(answer, own_runs(robot)):
                    self.foreign_stops.stop(engine, graph, author)
                    stopped.append(f"{robot}: {graph}")
        return stopped

    # --- what there is ------------------------------------------------------------------------

    def all(self) -> Iterator[Robot]:
        """Yield every engine, the simulator first."""
        yield Robot(
            name=SIMULATOR, simulated=True, state="answering", generation="current", pauses=True
        )
        for name in sorted(self._registered):
            yield self.robot(name)

    def robot(self, name: str) -> Robot:
        """Return one robot as people see it. Raise NotFound if the robot is not registered."""
        known = self.registration(name)
        engine = self._engines.get(name)
        plain = Robot(
            name=name,
            simulated=False,
            state="no_link",
            why=f"No link: {self._reach} {_NO_LINK}" if engine is None else engine.why,
            domain=known.domain,
            rmw=known.rmw,
            get_service=known.get_service,
            profile=known.profile,
        )
        if engine is None:
            return plain
        return with_engine(plain, engine, self.foreign_stops.trouble)

    def unheard(self) -> dict[str, str]:
        """Return the robots whose running graphs are unknown now: name → reason."""
        found: dict[str, str] = {}
        for name in self.names:
            engine = self._engines.get(name)
            if engine is None:
                found[name] = f"No link: {self._reach} {_NO_LINK}"
            elif engine.answer is None or engine.state not in _ANSWERS:
                found[name] = engine.why or _NOT_YET
        return found

    @property
    def names(self) -> list[str]:
        """The names of all registered robots, sorted."""
        return sorted(self._registered)

    def last_answers(self) -> dict[str, int]:
        """Return when each robot last answered: name → microseconds UTC. Robots that never answered
        are left out."""
        return {
            name: engine.answer.at
            for name, engine in self._engines.items()
            if engine.answer is not None
        }

    def registration(self, name: str) -> Registration:
        """Return the registration of a robot. Raise NotFound if the robot is not registered."""
        known = self._registered.get(name)
        if known is None:
            raise NotFound(f"No robot is called {name!r}.")
        return known

    def reachable(self, name: str) -> KnownEngine:
        """Return the engine of a robot, so that a graph can be started on it. Raise BadInput if the
        robot is not registered, Conflict if there is no link to it."""
        engine = self._engines.get(name)
        if engine is not None:
            return engine
        if name in self._registered:
            raise Conflict(
                f"No link to {name}: {self._reach} {_NO_LINK}", where={"path": "/engine"}
            )
        raise BadInput(
            f"No robot called {name!r} is registered here, so nothing can be started on it.",
            where={"path": "/engine"},
        )

    def present(self, name: str) -> KnownEngine | None:
        """Return the engine of a robot; None if there is no link to it. Raise NotFound if the robot
        is not registered."""
        self.registration(name)
        return self._engines.get(name)

    def link(self, name: str) -> KnownEngine | None:
        """Return the engine of a robot; None if there is no link to it or the robot is not
        registered."""
        return self._engines.get(name)

    async def index(self, name: str) -> EngineIndex:
        """Return the actions and graphs that a robot's engine has indexed; an empty index if there
        is no link to the robot. Raise NotFound if the robot is not registered."""
        self.registration(name)
        engine = self._engines.get(name)
        return (
            EngineIndex()
            if engine is None
            else await engine.index(self._open_context().run_in_worker)
        )

    def held_graph(self, name: str, graph: str) -> str:
        """Return the text of a graph as the robot's engine wrote it in its last answer. Raise
        NotFound if the robot is not registered or the answer does not have the graph."""
        self.registration(name)
        engine = self._engines.get(name)
        answer = None if engine is None else engine.answer
        text = None if answer is None else answer.texts.get(graph)
        if text is None:
            raise NotFound(f"{name} has not shown a graph called {graph!r}.")
        return text

    async def candidates(self) -> tuple[Candidate, ...]:
        """Return the engines in sight that are not registered. The call waits until discovery has
        had its time."""
        if isinstance(self._reach, str):
            return ()
        return self._strangers(await self._reach.candidates())

    async def sighting(self) -> Sighting:
        """Return the engines in sight now that are not registered, and for how many seconds others
        may still appear."""
        if isinstance(self._reach, str):
            return Sighting((), 0.0)
        seen = await self._reach.sighting()
        return Sighting(self._strangers(seen.engines), seen.left_s)

    def _strangers(self, engines: Iterable[Candidate]) -> tuple[Candidate, ...]:
        known = {(each.domain, _path(each.get_service)) for each in self._registered.values()}
        return tuple(
            each
            for each in engines
            if (each.domain, _path(each.get_service)) not in known
            and each.actor not in self._registered
        )

    @property
    def no_reach(self) -> str:
        """The reason why no robot can be reached; "" if robots can be reached."""
        return self._reach if isinstance(self._reach, str) else ""

    # --- the flight recorder ------------------------------------------------------------------

    def _note_state(self, engine: KnownEngine) -> None:
        name = engine.registration.name
        incarnation = engine.standing.incarnation
        at = self._open_context().clock_us()
        became = EngineBecame(at=at, state=engine.state, why=engine.why, incarnation=incarnation)
        self.robot_log.note(name, became, name)

    def _show(self, engine: KnownEngine, snapshots: tuple[Snapshot, ...]) -> None:
        self.foreign_stops.shows(engine, snapshots)
        self._open_context().shows(engine, snapshots)

    def _note_command(self, engine: KnownEngine, command: ForeignCommand) -> None:
        name = engine.registration.name
        if not command.targets or name in command.targets:
            self.foreign_stops.hear_of(name, command)
            event = self._open_context().foreign(engine, command)
            self.robot_log.note(name, event, command.sender)

    @property
    def robot_log(self) -> RobotLog:
        """The log of commands that others sent to the robots."""
        if self._robot_log is None:
            raise RuntimeError("the registry is not open")
        return self._robot_log


def _path(service: str) -> str:
    return service.strip("/")
