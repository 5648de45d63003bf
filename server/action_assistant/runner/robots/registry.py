"""The registry: the engines that runs can go to, which are the simulator and registered robots."""

import logging
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import Final

import anyio
import msgspec

from action_assistant.errors import BadInput, Conflict, NotFound
from action_assistant.logs import begin
from action_assistant.runner.links.hardware_stop import HardwareStop, StopSignal
from action_assistant.runner.links.health import HealthCheck, HealthSignal
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
from action_assistant.runner.robots.engine import EngineIndex, EngineListeners, KnownEngine
from action_assistant.runner.robots.recordings import Recordings
from action_assistant.runner.robots.registration import (
    STREAM,
    Robot,
    RobotRegistered,
    RobotRemoved,
    StopTrouble,
    check_registration,
    no_stops,
    with_engine,
)
from action_assistant.runner.robots.robot_events import (
    EngineBecame,
    RobotLog,
)
from action_assistant.runner.runs.events import Author, draft_of
from action_assistant.runner.runtime import Runtime
from action_assistant.umrf.facts import PINNED, BadProfile, EngineFacts, facts_of

log: Final = logging.getLogger(__name__)

_NO_LINK: Final = "This runner cannot start or stop anything on it."
_NOT_YET: Final = "It has not answered yet."
_ANSWERS: Final = frozenset({"answering", "restarted"})


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
        self._opened: tuple[Runtime, EngineListeners] | None = None
        self._robot_log: RobotLog | None = None

    def open(
        self,
        runtime: Runtime,
        *,
        changed: Callable[[], None],
        commanded: Callable[[KnownEngine, ForeignCommand], None],
        shows: Callable[[KnownEngine, tuple[Snapshot, ...]], None],
    ) -> None:
        """Start to watch the robots of `links`, and from now on every robot that is added. The
        functions are called with what robots report, like the fields of `EngineListeners`."""
        self._opened = (
            runtime,
            EngineListeners(
                changed=changed, became=self._note_state, commanded=commanded, shows=shows
            ),
        )
        self._robot_log = RobotLog(runtime.journal, runtime.tasks)
        if self.recordings is not None:
            runtime.tasks.start_soon(self.recordings.run)
        for name in self._given:
            self.add(Registration(name=name))

    # --- the registry -------------------------------------------------------------------------

    async def register(self, registration: Registration, author: Author) -> Robot:
        """Store a new or changed registration, and link to the robot. Raise BadInput if it is not
        valid, Conflict if it has the name of the simulator, Unavailable if the journal cannot
        store it."""
        check_registration(registration)
        runtime, listeners = self._while_open()
        body = RobotRegistered(at=runtime.clock_us(), **msgspec.structs.asdict(registration))
        await runtime.journal.append(STREAM, [draft_of(body, author.id)])
        self.add(registration)
        listeners.changed()
        return self.robot(registration.name)

    async def remove(self, name: str, author: Author) -> None:
        """Store that a robot is removed, and close its link. Raise NotFound if the robot is not
        registered, Unavailable if the journal cannot store that."""
        self.registration(name)
        runtime, listeners = self._while_open()
        body = RobotRemoved(at=runtime.clock_us(), name=name)
        await runtime.journal.append(STREAM, [draft_of(body, author.id)])
        self._close(name)
        del self._registered[name]
        listeners.changed()

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
        runtime, listeners = self._while_open()
        engine = KnownEngine(
            registration,
            facts,
            link,
            clock_us=runtime.clock_us,
            listeners=listeners,
            recordings=self.recordings,
            indexes=name in self._indexing,
        )
        self._engines[name] = engine
        scope = self._scopes[name] = anyio.CancelScope()
        runtime.tasks.start_soon(self._watch, engine, scope)

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

    def _while_open(self) -> tuple[Runtime, EngineListeners]:
        if self._opened is None:
            raise RuntimeError("the registry is not open")
        return self._opened

    # --- what there is ------------------------------------------------------------------------

    def all(self, stopping: StopTrouble = no_stops) -> Iterator[Robot]:
        """Yield every engine, the simulator first. `stopping`: as for `robot`."""
        yield Robot(
            name=SIMULATOR, simulated=True, state="answering", generation="current", pauses=True
        )
        for name in sorted(self._registered):
            yield self.robot(name, stopping)

    def robot(self, name: str, stopping: StopTrouble = no_stops) -> Robot:
        """Return one robot as people see it. `stopping` tells which of its graphs are being stopped.
        Raise NotFound if the robot is not registered."""
        known = self.registration(name)
        engine = self._engines.get(name)
        plain = Robot(
            **msgspec.structs.asdict(known),
            simulated=False,
            state="no_link",
            why=f"No link: {self._reach} {_NO_LINK}" if engine is None else engine.why,
        )
        if engine is None:
            return plain
        return with_engine(plain, engine, stopping)

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

    def engines(self, name: str | None = None) -> list[KnownEngine]:
        """Return all linked engines, or that of the robot `name` if it has one. Raise NotFound if
        that robot is not registered."""
        if name is None:
            return list(self._engines.values())
        engine = self.present(name)
        return [] if engine is None else [engine]

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
            else await engine.index(self._while_open()[0].run_in_worker)
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
        """Return the engines that discovery shows and that are not registered, none without ROS 2.
        The call waits until discovery has had its time."""
        if isinstance(self._reach, str):
            return ()
        return self._strangers(await self._reach.candidates())

    async def stop_signal(
        self, name: str, rule: HardwareStop, changed: Callable[[], None]
    ) -> StopSignal:
        """Listen to the hardware stop of a robot, as `Reach.stop_signal` does."""
        return await self._reached.stop_signal(*self._place(name), rule, changed)

    async def health_signal(self, name: str, check: HealthCheck) -> HealthSignal:
        """Listen to something of a robot's health, as `Reach.health_signal` does."""
        return await self._reached.health_signal(*self._place(name), check)

    @property
    def _reached(self) -> Reach:
        if isinstance(self._reach, str):
            raise RuntimeError(self._reach)
        return self._reach

    def _place(self, name: str) -> tuple[Registration, EngineFacts]:
        engine = self._engines.get(name)
        return self.registration(name), PINNED if engine is None else engine.facts

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
        at = self._while_open()[0].clock_us()
        became = EngineBecame(at=at, state=engine.state, why=engine.why, incarnation=incarnation)
        self.robot_log.note(name, became, name)

    @property
    def robot_log(self) -> RobotLog:
        """The log of commands that others sent to the robots."""
        if self._robot_log is None:
            raise RuntimeError("the registry is not open")
        return self._robot_log


def _path(service: str) -> str:
    return service.strip("/")
