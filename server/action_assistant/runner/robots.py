"""The engines that runs can go to: the simulator, always, and the robots that somebody registered."""

import logging
import re
from collections.abc import Callable, Iterator, Mapping
from datetime import datetime
from typing import ClassVar, Final, Literal, TypeAlias

import anyio
import msgspec
from anyio.abc import TaskGroup
from msgspec.structs import replace

from action_assistant.errors import BadInput, Conflict, NotFound
from action_assistant.journal.events import Draft
from action_assistant.runner.admission import SIMULATOR
from action_assistant.runner.driving import Clock
from action_assistant.runner.engines import Index, KnownEngine
from action_assistant.runner.events import Author
from action_assistant.runner.flight import (
    Commanded,
    EngineBecame,
    RobotEvent,
    draft_of,
    event_of,
    stream_of_robot,
)
from action_assistant.runner.history import Aside, Ledger
from action_assistant.runner.links.port import (
    Candidate,
    EngineState,
    ForeignCommand,
    Generation,
    Link,
    Reach,
    Registration,
)
from action_assistant.runner.recorder import Pen
from action_assistant.runner.shapes import time
from action_assistant.umrf.facts import PINNED, BadProfile, EngineFacts, facts_of

log: Final = logging.getLogger(__name__)

#: The stream of all registrations.
STREAM: Final = "robots"

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,63}")
_SERVICE: Final = re.compile(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")
_NO_LINK: Final = "Nothing can be started or stopped there from here."

RobotState: TypeAlias = EngineState | Literal["no_link"]


class Registered(msgspec.Struct, frozen=True, kw_only=True):
    """Somebody registered a robot, or registered it anew."""

    kind: ClassVar[str] = "robot.registered.v1"

    at: int
    name: str
    domain: int
    rmw: str
    get_service: str
    profile: dict[str, object]


class Removed(msgspec.Struct, frozen=True, kw_only=True):
    """Somebody took a robot out of the registry. Its runs stay."""

    kind: ClassVar[str] = "robot.removed.v1"

    at: int
    name: str


class Held(msgspec.Struct, frozen=True, kw_only=True):
    """A graph that an engine holds, ended ones too. `run`: the run of ours that it is."""

    graph: str
    state: str
    active: bool
    run: str | None


class Robot(msgspec.Struct, frozen=True, kw_only=True):
    """An engine as people see it. `why` explains any state but `answering`.

    `servers`: how many answer on the path of its get; `others`: publishers of starts beside us.
    `actions`, `graphs`: how many it has indexed; None before its first answer.
    """

    name: str
    simulated: bool
    state: RobotState
    why: str = ""
    since: datetime | None = None
    domain: int | None = None
    rmw: str = ""
    get_service: str = ""
    profile: dict[str, object] = {}
    heard_at: datetime | None = None
    took_ms: float | None = None
    restarted_at: datetime | None = None
    generation: Generation = "unknown"
    servers: int = 0
    others: int = 0
    actor: str = ""
    holds: tuple[Held, ...] = ()
    actions: int | None = None
    graphs: int | None = None


class Ground(msgspec.Struct, frozen=True):
    """What the registry stands on. `foreign` hears of each command of somebody else."""

    ledger: Ledger
    tasks: TaskGroup
    wall: Clock
    aside: Aside
    changed: Callable[[], None]
    foreign: Callable[[KnownEngine, ForeignCommand], Commanded]


class Robots:
    """The registry. `reach` makes links, or says why there are none; `links` are there already."""

    def __init__(
        self, links: Mapping[str, Link] | None = None, reach: Reach | str | None = None
    ) -> None:
        self._given: Final = dict(links or {})
        self._reach: Final = reach if reach is not None else "No link to robots was made."
        self._registered: dict[str, Registration] = {}
        self._engines: dict[str, KnownEngine] = {}
        self._scopes: dict[str, anyio.CancelScope] = {}
        self._pens: dict[str, Pen] = {}
        self._ground: Ground | None = None

    def open(self, ground: Ground) -> None:
        """Watch what was given, and from now on whatever is added."""
        self._ground = ground
        for name in self._given:
            self.add(Registration(name=name))

    # --- the registry -------------------------------------------------------------------------

    async def register(self, asked: Registration, author: Author) -> Robot:
        """Take a robot in, or change it. Raises BadInput, Conflict, Unavailable."""
        check_registration(asked)
        ground = self._standing()
        body = Registered(at=ground.wall(), **msgspec.structs.asdict(asked))
        draft = Draft(body.kind, author.id, msgspec.json.encode(body))
        await ground.ledger.append(STREAM, [draft])
        self.add(asked)
        ground.changed()
        return self.robot(asked.name)

    async def remove(self, name: str, author: Author) -> None:
        """Take a robot out. Raises NotFound, Unavailable."""
        self.registration(name)
        ground = self._standing()
        body = Removed(at=ground.wall(), name=name)
        draft = Draft(body.kind, author.id, msgspec.json.encode(body))
        await ground.ledger.append(STREAM, [draft])
        self._let_go(name)
        del self._registered[name]
        ground.changed()

    def add(self, registration: Registration) -> None:
        """Take in a robot that is stored; an older link to it is let go of."""
        name = registration.name
        if self._registered.get(name) == registration and name in self._engines:
            return
        self._let_go(name)
        self._registered[name] = registration
        link, facts = self._link(registration)
        if link is None:
            return
        ground = self._standing()
        engine = KnownEngine(
            registration,
            facts,
            link,
            wall=ground.wall,
            changed=ground.changed,
            became=self._note_state,
            foreign=self._note_command,
        )
        self._engines[name] = engine
        scope = self._scopes[name] = anyio.CancelScope()
        ground.tasks.start_soon(self._watch, engine, scope)

    def _link(self, registration: Registration) -> tuple[Link | None, EngineFacts]:
        try:
            facts = facts_of(registration.profile)
        except BadProfile:  # stored before it was checked: then nothing good is believed of it
            log.warning("the profile of %s cannot be read", registration.name)
            facts = PINNED
        given = self._given.get(registration.name)
        if given is not None:
            return given, facts
        if isinstance(self._reach, str):
            return None, facts
        return self._reach.link(registration, facts), facts

    def _let_go(self, name: str) -> None:
        self._engines.pop(name, None)
        scope = self._scopes.pop(name, None)
        if scope is not None:
            scope.cancel()

    async def _watch(self, engine: KnownEngine, scope: anyio.CancelScope) -> None:
        with scope:
            await engine.watch()

    def _standing(self) -> Ground:
        if self._ground is None:
            raise RuntimeError("the registry is not open")
        return self._ground

    # --- what there is ------------------------------------------------------------------------

    def all(self) -> Iterator[Robot]:
        """Every engine, the simulator first."""
        yield Robot(name=SIMULATOR, simulated=True, state="answering", generation="current")
        for name in sorted(self._registered):
            yield self.robot(name)

    def robot(self, name: str) -> Robot:
        """One robot as people see it. Raises NotFound."""
        known = self.registration(name)
        engine = self._engines.get(name)
        plain = Robot(
            name=name,
            simulated=False,
            state="no_link",
            why=f"{self._reach} {_NO_LINK}" if engine is None else engine.why,
            domain=known.domain,
            rmw=known.rmw,
            get_service=known.get_service,
            profile=known.profile,
        )
        return plain if engine is None else _seen(plain, engine)

    def registration(self, name: str) -> Registration:
        """How a robot is reached. Raises NotFound."""
        known = self._registered.get(name)
        if known is None:
            raise NotFound(f"No robot is called {name!r}.")
        return known

    def reachable(self, name: str) -> KnownEngine:
        """The engine of a robot. Raises BadInput for an unknown name, Conflict without a link."""
        engine = self._engines.get(name)
        if engine is not None:
            return engine
        if name in self._registered:
            raise Conflict(f"{name}: {self._reach} {_NO_LINK}", where={"path": "/engine"})
        raise BadInput(f"No robot is called {name!r}.", where={"path": "/engine"})

    def link(self, name: str) -> KnownEngine | None:
        """The engine of a robot, if there is a link."""
        return self._engines.get(name)

    async def index(self, name: str) -> Index:
        """What a robot can do, as far as is known. Raises NotFound."""
        self.registration(name)
        engine = self._engines.get(name)
        return Index() if engine is None else await engine.index(self._standing().aside)

    async def flight(self, name: str, most: int) -> list[tuple[int, RobotEvent]]:
        """The newest of what others told a robot, and of how its engine was, with their seqs.
        Raises NotFound, Unavailable."""
        self.registration(name)
        ledger, stream = self._standing().ledger, stream_of_robot(name)
        newest = await ledger.newest(stream)
        stored = await ledger.read(stream, after=max(0, newest - most))
        read = [(each.seq, event_of(each)) for each in stored]
        return [(seq, event) for seq, event in read if event is not None]

    async def commanded(self, name: str, seq: int) -> str:
        """The graph of a recorded command. Raises NotFound."""
        self.registration(name)
        stream = stream_of_robot(name)
        stored = await self._standing().ledger.read(stream, after=seq - 1, limit=1)
        event = event_of(stored[0]) if stored and stored[0].seq == seq else None
        if not isinstance(event, Commanded) or not event.umrf:
            raise NotFound("No graph was recorded with this.")
        return event.umrf

    def held(self, name: str, graph: str) -> str:
        """A graph as the engine wrote it in its last answer. Raises NotFound."""
        self.registration(name)
        engine = self._engines.get(name)
        answer = None if engine is None else engine.answer
        text = None if answer is None else answer.texts.get(graph)
        if text is None:
            raise NotFound(f"{name} has not shown a graph called {graph!r}.")
        return text

    async def candidates(self) -> tuple[Candidate, ...]:
        """Engines in sight that nobody registered yet."""
        if isinstance(self._reach, str):
            return ()
        known = {(each.domain, _path(each.get_service)) for each in self._registered.values()}
        return tuple(
            each
            for each in await self._reach.candidates()
            if (each.domain, _path(each.get_service)) not in known
            and each.actor not in self._registered
        )

    @property
    def no_reach(self) -> str:
        """Why no robot can be reached; "" when some can."""
        return self._reach if isinstance(self._reach, str) else ""

    # --- the flight recorder ------------------------------------------------------------------

    def _note_state(self, engine: KnownEngine) -> None:
        became = EngineBecame(
            at=self._standing().wall(),
            state=engine.state,
            why=engine.why,
            incarnation=engine.standing.incarnation,
        )
        self._write(engine.registration.name, draft_of(became, engine.registration.name))

    def _note_command(self, engine: KnownEngine, command: ForeignCommand) -> None:
        name = engine.registration.name
        if command.targets and name not in command.targets:
            return
        told = self._standing().foreign(engine, command)
        self._write(name, draft_of(told, command.sender))

    def _write(self, name: str, draft: Draft) -> None:
        pen = self._pens.get(name)
        if pen is None:
            ground = self._standing()
            pen = self._pens[name] = Pen(ground.ledger, stream_of_robot(name), -1)
            ground.tasks.start_soon(self._keep_writing, name, pen)
        pen.add(draft)

    async def _keep_writing(self, name: str, pen: Pen) -> None:
        await pen.find_end()
        await pen.run()


def _seen(plain: Robot, engine: KnownEngine) -> Robot:
    """A robot with what is known of its engine."""
    answer, standing = engine.answer, engine.standing
    seen = replace(
        plain,
        state=engine.state,
        since=time(engine.since),
        restarted_at=None if engine.restarted_at is None else time(engine.restarted_at),
        generation=standing.generation,
        servers=standing.servers,
        others=standing.others,
        actor=standing.actor,
    )
    if answer is None:
        return seen
    return replace(
        seen,
        heard_at=time(answer.at),
        took_ms=engine.took_ms,
        holds=tuple(
            Held(graph=each.graph, state=each.state, active=each.active, run=each.run)
            for each in answer.graphs
        ),
        actions=len(answer.known_actions),
        graphs=len(answer.known_graphs),
    )


def _path(service: str) -> str:
    return service.strip("/")


def check_registration(asked: Registration) -> None:
    """Refuse what cannot be on the wire or true of an engine. Raises BadInput, Conflict."""
    if asked.name.lower() == SIMULATOR:
        raise Conflict("The simulator is always there; a robot needs a name of its own.")
    if not _NAME.fullmatch(asked.name):
        raise BadInput(
            "A robot's name starts with a letter and has letters, digits, _ and - only, "
            "64 at most.",
            where={"path": "/name"},
        )
    if not _SERVICE.fullmatch(asked.get_service):
        raise BadInput("This is no name of a ROS 2 service.", where={"path": "/get_service"})
    try:
        facts_of(asked.profile)
    except BadProfile as wrong:
        raise BadInput(wrong.message, where={"path": f"/profile{wrong.path}"}) from wrong
