"""The registration of a robot, and the view of a robot that pages get. In events `at` is microseconds UTC."""

import re
from collections.abc import Callable, Iterator
from datetime import datetime
from typing import Any, ClassVar, Final, Literal, TypeAlias

import msgspec
from msgspec.structs import replace
from sqlalchemy import Row

from action_assistant.errors import BadInput, Conflict
from action_assistant.runner.links.hardware_stop import SignalKind
from action_assistant.runner.links.health import (
    Consequence,
    HealthKind,
    HealthNow,
    HealthState,
)
from action_assistant.runner.links.port import (
    CONDUCTED,
    SIMULATOR,
    EngineState,
    Generation,
    Registration,
)
from action_assistant.runner.robots.engine import KnownEngine
from action_assistant.runner.robots.practice_robot import is_practice
from action_assistant.runner.robots.rights import Drilled, RobotRights
from action_assistant.runner.runs.page_presence import PagePresence
from action_assistant.runner.runs.sight import HIDDEN_NAME, RunGraphs, Unseen
from action_assistant.runner.runs.views import time
from action_assistant.safe_text import hold_names
from action_assistant.umrf.facts import BadProfile, facts_of
from action_assistant.umrf.limits import Limit
from action_assistant.web.auth.keys import PersonRef

#: The stream of all registrations.
STREAM: Final = "robots"

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,63}")
#: Names in ROS 2 hold no two underscores in a row.
_SERVICE: Final = re.compile(r"(?!.*__)/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")

RobotState: TypeAlias = EngineState | Literal["no_link"]
#: Returns why it is not proven yet that a graph has stopped, given its robot and name: "" until a
#: reason is known, None if it is not being stopped.
StopTrouble: TypeAlias = Callable[[str, str], str | None]


class RobotRegistered(msgspec.Struct, frozen=True, kw_only=True):
    """A person registered a robot, or changed its registration."""

    kind: ClassVar[str] = "robot.registered.v1"

    at: int
    name: str
    domain: int
    rmw: str
    get_service: str
    profile: dict[str, object]
    led: bool = False


class RobotRemoved(msgspec.Struct, frozen=True, kw_only=True):
    """A person took a robot out of the registry. Its runs stay."""

    kind: ClassVar[str] = "robot.removed.v1"

    at: int
    name: str


_DRILLS: Final = 20  # that are shown of a robot


class HeldGraph(msgspec.Struct, frozen=True, kw_only=True):
    """A graph that an engine holds, also an ended one. `run`: the id of this runner's run, if it is
    one. `stopping`: why a Stop of it is not proven yet, "" at first; None without a Stop."""

    graph: str
    state: str
    active: bool
    run: str | None
    stopping: str | None = None


class OperatorShown(msgspec.Struct, frozen=True, kw_only=True):
    """A person or a group, by id, who may start on a robot. `until`: when that ends; null for never."""

    id: str
    name: str
    until: datetime | None = None


class HolderShown(msgspec.Struct, frozen=True, kw_only=True):
    """The holder of a baton. `here`: they have a page open; `falls_at`: when the baton falls if they
    open none, null while they are here."""

    person: PersonRef
    since: datetime
    here: bool
    falls_at: datetime | None


class LockShown(msgspec.Struct, frozen=True, kw_only=True):
    """A person who has put a robot out of service, since when, and why."""

    by: PersonRef
    at: datetime
    reason: str

    def __post_init__(self) -> None:
        hold_names(self, "reason")


class DrillShown(msgspec.Struct, frozen=True, kw_only=True):
    """A Stop drill: with which run, by whom, when Stop was pressed, and the milliseconds until rest was
    proven; null if it was not. `failure`: why it failed, "" if it passed."""

    run: str
    number: int
    by: PersonRef
    stopped_at: datetime
    proof_ms: int | None
    saw_it_stop: bool
    hardware_stop: bool
    failure: str


class HardwareStopShown(msgspec.Struct, frozen=True, kw_only=True):
    """Names the topic on which a robot reports its hardware stop. `age_s`: seconds after which the newest message is too old.
    Of `bool`, `pressed` is the value that means pressed; of `diagnostics`, the status with the name `status`
    at this `level` or above means pressed."""

    topic: str
    kind: SignalKind
    age_s: float
    pressed: bool
    status: str
    level: int


class HealthCheckShown(msgspec.Struct, frozen=True, kw_only=True):
    """Names something of a robot's health, and what follows for a start there. Of `battery`, a share of
    charge below `below` percent is poor; of `diagnostics`, the status with the name `status` at this
    `level` or above. `age_s`: seconds after which the newest message says nothing any more; `poor`,
    `unknown`: what follows where it is that."""

    topic: str
    kind: HealthKind
    below: float
    status: str
    level: int
    age_s: float
    poor: Consequence
    unknown: Consequence


class HealthShown(msgspec.Struct, frozen=True, kw_only=True):
    """A report of a robot's health as it was when the robot was read. `text`: all of it in words, but its
    age; `follows`: for a start, null for nothing; `heard_at`: when its newest message came."""

    topic: str
    state: HealthState
    text: str
    follows: Consequence | None
    heard_at: datetime | None

    def __post_init__(self) -> None:
        hold_names(self, "text")


class Robot(msgspec.Struct, frozen=True, kw_only=True):
    """An engine as people see it. `why`: explains any state but `answering`.

    `heard_at`, `took_ms`: when its last answer came, and after how many milliseconds; `restarted_at`:
    when its last restart was seen, None for none; `holds`: the graphs in its last answer. `servers`:
    how many engines answer on the path of its get; `others`: publishers of starts besides this
    runner. `actions`, `graphs`: the size of its index; None before its first answer.
    `pauses`: pausing is safe on it. `operators`: who may start there, "all" for every operator;
    `baton`: only its `holder` may, null being nobody; `locks`: who has put it out of service;
    `watched`: each start has the word of its person that they watch it; `drill_days`: how old its last
    Stop drill may be; `drill_due`: why one has to be made before the next start, "" if none has to be;
    `drills`: the newest 20, the newest first; `released_only`: only released versions start there;
    `ask_again`: minutes after which whoever starts there confirms again that it is they, 0 for never;
    `limits`: of the numbers that are sent there; `hardware_stop`: where it is reported, null where it
    is not; `pressed`: why it counts as pressed, "" if it does not; `page_presence`: for how long the page
    of whoever is responsible for a run may be missing there, null where none is asked for;
    `health_checks`: looked at before a start; `health`: what they show. `practice_ended`: it is the
    practice robot, and nobody answers there, so `POST /api/practice` starts it again.
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
    led: bool = False
    heard_at: datetime | None = None
    took_ms: float | None = None
    restarted_at: datetime | None = None
    generation: Generation = "unknown"
    servers: int = 0
    others: int = 0
    actor: str = ""
    pauses: bool = False
    holds: tuple[HeldGraph, ...] = ()
    actions: int | None = None
    graphs: int | None = None
    operators: Literal["all"] | tuple[OperatorShown, ...] = "all"
    baton: bool = False
    holder: HolderShown | None = None
    locks: tuple[LockShown, ...] = ()
    watched: bool = False
    drill_days: int | None = None
    drill_due: str = ""
    drills: tuple[DrillShown, ...] = ()
    released_only: bool = False
    ask_again: int = 0
    limits: tuple[Limit, ...] = ()
    hardware_stop: HardwareStopShown | None = None
    pressed: str = ""
    page_presence: PagePresence | None = None
    health_checks: tuple[HealthCheckShown, ...] = ()
    health: tuple[HealthShown, ...] = ()
    practice_ended: bool = False


def registration_of(row: Row[Any]) -> Registration:
    """Return the registration in a row of the table."""
    return Registration(**{name: getattr(row, name) for name in Registration.__struct_fields__})


def check_registration(registration: Registration) -> None:
    """Check that ROS 2 allows a registration and that its profile is valid. Raise BadInput if not,
    Conflict if the name is that of the simulator."""
    if registration.name.lower() == SIMULATOR:
        raise Conflict("The simulator is always there; a robot needs a name of its own.")
    if registration.name.lower() == CONDUCTED:
        raise Conflict(f"“{CONDUCTED}” stands for runs of several robots; name this one otherwise.")
    if not _NAME.fullmatch(registration.name):
        raise BadInput(
            "A robot's name starts with a letter and has letters, digits, _ and - only, "
            "64 at most.",
            where={"path": "/name"},
        )
    if not _SERVICE.fullmatch(registration.get_service):
        raise BadInput("This is no name of a ROS 2 service.", where={"path": "/get_service"})
    try:
        facts_of(registration.profile)
    except BadProfile as wrong:
        raise BadInput(wrong.message, where={"path": f"/profile{wrong.path}"}) from wrong


def no_stops(_robot: str, _graph: str) -> None:
    """Return None: no graph is being stopped."""


def with_engine(plain: Robot, engine: KnownEngine, stopping: StopTrouble) -> Robot:
    """Return a robot with what is known of its engine."""
    answer, standing = engine.answer, engine.standing
    known = replace(
        plain,
        state=engine.state,
        since=time(engine.since),
        restarted_at=None if engine.restarted_at is None else time(engine.restarted_at),
        generation=standing.generation,
        servers=standing.servers,
        others=standing.others,
        actor=standing.actor,
        pauses=engine.pauses,
        practice_ended=is_practice(engine.registration)
        and standing.settled
        and standing.servers == 0,
    )
    if answer is None:
        return known
    return replace(
        known,
        heard_at=time(answer.at),
        took_ms=engine.took_ms,
        holds=tuple(
            HeldGraph(
                graph=each.graph,
                state=each.state,
                active=each.active,
                run=each.run,
                stopping=stopping(plain.name, each.graph),
            )
            for each in answer.graphs
        ),
        actions=len(answer.known_actions),
        graphs=len(answer.known_graphs),
    )


def drill_view(drill: Drilled) -> DrillShown:
    """Return a Stop drill as people see it."""
    return DrillShown(
        run=drill.run,
        number=drill.number,
        by=PersonRef(drill.author.id, drill.author.name),
        stopped_at=time(drill.stopped_at),
        proof_ms=None if drill.proof_us is None else round(drill.proof_us / 1000),
        saw_it_stop=drill.saw_it_stop,
        hardware_stop=drill.hardware_stop,
        failure=drill.failure,
    )


def with_health(plain: Robot, health: tuple[HealthNow, ...], now_us: int) -> Robot:
    """Return a robot with its health. `now_us`: microseconds UTC."""

    def shown(each: HealthNow) -> HealthShown:
        age_us = None if each.age_s is None else round(each.age_s * 1e6)
        return HealthShown(
            topic=each.check.full_topic,
            state=each.state,
            text=each.words,
            follows=each.consequence,
            heard_at=None if age_us is None else time(now_us - age_us),
        )

    return replace(plain, health=tuple(map(shown, health)))


def seen_by(
    robot: Robot, unseen: Unseen | None, graphs_of: Callable[[str], RunGraphs | None]
) -> Robot:
    """Return a robot without the names of graphs that a person may not see, and without sub-graphs of
    these. While there are such graphs, those that others started have no names either: nobody knows
    what these are. `graphs_of`: returns the facts about a run that decide who may see it, if they are known."""
    if unseen is None or not robot.holds:
        return robot
    everywhere = not unseen.is_some
    named = {}
    for each in robot.holds:
        if each.run is not None:
            graphs = graphs_of(each.run)
            named[each.graph] = everywhere if graphs is None else not unseen.hides(graphs)

    def seen() -> Iterator[HeldGraph]:
        for held in robot.holds:
            top = next((name for name in named if held.graph.startswith(f"{name}__")), None)
            if named.get(held.graph, everywhere if top is None else named[top]):
                yield held
            elif top is None or held.run is not None:
                stopping = None if held.stopping is None else ""
                yield replace(held, graph=HIDDEN_NAME, stopping=stopping)

    return replace(robot, holds=tuple(seen()))


def with_rights(
    plain: Robot, rights: RobotRights, holder: HolderShown | None, drill_due: str, pressed: str
) -> Robot:
    """Return a robot with its rights. `holder`: who holds its baton; `drill_due`: why a Stop drill has
    to be made, "" if none has to be; `pressed`: why its hardware stop counts as pressed."""
    rules = rights.rules
    operators: Literal["all"] | tuple[OperatorShown, ...] = "all"
    if rules.operators is not None:
        operators = tuple(
            OperatorShown(
                id=each.id,
                name=each.name,
                until=None if each.until is None else time(each.until),
            )
            for each in rules.operators
        )
    locks = tuple(
        LockShown(by=each.by, at=time(each.at), reason=each.reason) for each in rights.locks
    )
    return replace(
        plain,
        operators=operators,
        baton=rules.baton,
        holder=holder,
        locks=locks,
        watched=rules.watched,
        drill_days=rules.drill_days,
        drill_due=drill_due,
        drills=tuple(map(drill_view, reversed(rights.drills[-_DRILLS:]))),
        released_only=rules.released_only,
        ask_again=rules.ask_again,
        limits=rules.limits,
        hardware_stop=rules.hardware_stop
        and HardwareStopShown(**msgspec.structs.asdict(rules.hardware_stop)),
        pressed=pressed,
        page_presence=rules.page_presence,
        health_checks=tuple(
            HealthCheckShown(**msgspec.structs.asdict(each)) for each in rules.health
        ),
    )
