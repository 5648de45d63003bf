"""The routes of the rights of robots: who may start there, batons, robots out of service."""

from datetime import UTC, datetime
from typing import Annotated, Any, Final, Literal

import anyio
import msgspec
from litestar import Request, delete, get, post, put
from litestar.types import ControllerRouterHandler

from action_assistant.errors import BadInput
from action_assistant.kit.moments import sent_us
from action_assistant.runner.api.caller import author_of
from action_assistant.runner.api.run_guard import require_run, unseen_by
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.links.hardware_stop import HardwareStop, SignalKind
from action_assistant.runner.links.health import (
    MOST_CHECKS,
    Consequence,
    HealthCheck,
    HealthKind,
)
from action_assistant.runner.robots.registration import DrillShown, Robot, drill_view
from action_assistant.runner.robots.rights import Operator, Rules
from action_assistant.runner.runs import views
from action_assistant.runner.runs.page_presence import PagePresence
from action_assistant.runner.start.drills import DrillRequest
from action_assistant.safe_text import hold_names
from action_assistant.umrf.limits import MOST as MOST_LIMITS
from action_assistant.umrf.limits import Limit
from action_assistant.web.audit.events import ReleaseTold
from action_assistant.web.auth.access import Needs, PersonOnly, identity_of
from action_assistant.web.auth.confirmations import LONGEST_S
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.auth.released_versions import Release

#: Minutes: older confirmations are not kept.
LONGEST_ASK_AGAIN: Final = round(LONGEST_S / 60)
_MOST: Final = 200  # people and groups of one robot
_Asking = Request[Any, Any, Any]
_Reason = Annotated[str, msgspec.Meta(max_length=500)]
_PersonId = Annotated[str, msgspec.Meta(max_length=40)]


class OperatorWanted(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A person or a group, by id, who may start on a robot. `name`: for sentences; `until`: when that
    ends, null for never."""

    id: Annotated[str, msgspec.Meta(min_length=1, max_length=40)]
    name: Annotated[str, msgspec.Meta(max_length=100)] = ""
    until: datetime | None = None


class LimitWanted(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The bounds of an input. `parameter`: its flat name, as `arm::torque`, or the end of it after `::`;
    `action`: the name of the action that has it, "" for every action; `least`, `most`: null for no bound,
    but not both."""

    parameter: Annotated[str, msgspec.Meta(min_length=1, max_length=1000)]
    action: Annotated[str, msgspec.Meta(max_length=1000)] = ""
    least: float | None = None
    most: float | None = None


class HardwareStopWanted(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Names the topic on which a robot reports its hardware stop. `age_s`: seconds after which the newest message is too old.
    Of `bool`, `pressed` is the value that means pressed; of `diagnostics`, a status with this name ("" for
    every status) at this `level` or above means pressed."""

    topic: Annotated[str, msgspec.Meta(max_length=200)]
    kind: SignalKind = "bool"
    age_s: float = 1.0
    pressed: bool = True
    status: Annotated[str, msgspec.Meta(max_length=200)] = ""
    level: Annotated[int, msgspec.Meta(ge=1, le=3)] = 2


class HealthWanted(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Names something of a robot's health, and what follows for a start there. Of `battery`, a share of
    charge below `below` percent is poor; of `diagnostics`, the status with the name `status` at this
    `level` or above (1: warning, 2: error). `age_s`: seconds after which the newest message says nothing any
    more; `poor`, `unknown`: what follows where it is that; `unknown` is null for the same as `poor`."""

    topic: Annotated[str, msgspec.Meta(max_length=200)]
    kind: HealthKind = "battery"
    below: float = 30.0
    status: Annotated[str, msgspec.Meta(max_length=200)] = ""
    level: Annotated[int, msgspec.Meta(ge=1, le=2)] = 2
    age_s: float = 30.0
    poor: Consequence = "warn"
    unknown: Consequence | None = None


class PagePresenceWanted(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The rule that the page of whoever is responsible for a run stays visible. Seconds without an
    answer of one: after `wait_s` a led run begins nothing further, after `stop_s` each run is
    stopped."""

    wait_s: float
    stop_s: float


class RightsWanted(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The rules of an owner for a robot. `operators`: who may start there, "all" for every operator;
    `baton`: only the holder of its baton may; `watched`: each start has the word of its person that
    they watch it; `drill_days`: its last Stop drill is so old at most, null for no such rule;
    `released_only`: only versions start there that an owner has released;
    `ask_again`: minutes after which whoever starts there confirms again that it is they, 0 for never;
    `limits`: of the numbers that are sent there; `hardware_stop`: where it is reported, null where it is not;
    `page_presence`: null where no page has to stay visible; `health`: looked at before a start; where one of
    these is missing, it stays as it is."""

    operators: (
        Literal["all"] | Annotated[tuple[OperatorWanted, ...], msgspec.Meta(max_length=_MOST)]
    ) = "all"
    baton: bool = False
    watched: bool = False
    drill_days: Annotated[int, msgspec.Meta(ge=1, le=3650)] | None = None
    released_only: bool = False
    ask_again: Annotated[int, msgspec.Meta(ge=0, le=LONGEST_ASK_AGAIN)] = 0
    limits: (
        Annotated[tuple[LimitWanted, ...], msgspec.Meta(max_length=MOST_LIMITS)] | msgspec.UnsetType
    ) = msgspec.UNSET
    hardware_stop: HardwareStopWanted | msgspec.UnsetType | None = msgspec.UNSET
    page_presence: PagePresenceWanted | msgspec.UnsetType | None = msgspec.UNSET
    health: (
        Annotated[tuple[HealthWanted, ...], msgspec.Meta(max_length=MOST_CHECKS)]
        | msgspec.UnsetType
    ) = msgspec.UNSET


class BatonTake(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Takes a baton. `reason`: why it is taken over from its holder."""

    reason: _Reason = ""


class BatonHand(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Hands a baton, or a run with all batons of its robots, to a person who has a page open."""

    to: _PersonId


class LockWanted(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Puts a robot out of service."""

    reason: _Reason


class UnlockWanted(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Takes one's own lock off a robot, or as an owner that of the person `of`."""

    of: _PersonId = ""


class RightShown(msgspec.Struct, frozen=True, kw_only=True):
    """The rights of the asker on a robot. `why`: why they may not start there, "" if they may, perhaps
    after they have confirmed who they are; `holds`:
    they hold its baton; `may_take`: they may take its baton, with a reason if somebody holds it."""

    robot: str
    why: str
    holds: bool
    may_take: bool

    def __post_init__(self) -> None:
        hold_names(self, "why")


class RightsShown(msgspec.Struct, frozen=True, kw_only=True):
    """The rights of the asker on all robots. `people`: those who have a page open and may start on
    robots, to whom a baton can be handed."""

    robots: list[RightShown]
    people: list[PersonRef]


def routes(services: RunnerServices) -> list[ControllerRouterHandler]:
    """Return the routes of the rights of robots."""
    return [
        *_rules(services),
        *_baton(services),
        *_service(services),
        *_drills(services),
        *_releases(services),
    ]


def _rules(services: RunnerServices) -> list[ControllerRouterHandler]:
    @put(
        "/api/robots/{name:str}/rights",
        summary="Set who may start on a robot, and whether it has a baton",
        operation_id="setRobotRights",
        description="What is missing is off, except `limits`, `hardware_stop`, `page_presence` and "
        "`health`, which stay then.",
        guards=[Needs("share")],
    )
    async def set_rights(name: str, data: RightsWanted, request: _Asking) -> Robot:
        rights = services.control.rights
        await rights.set_rules(name, _rules_of(data, rights.of(name).rules), author_of(request))
        return services.control.robot_view(name, unseen_by(services, request))

    @get(
        "/api/rights",
        summary="Where the asker may start, and why not elsewhere",
        operation_id="getRights",
        guards=[Needs("see")],
    )
    async def rights(request: _Asking) -> RightsShown:
        control, me = services.control, identity_of(request)
        people = [
            PersonRef(each.person.id, each.person.name) for each in control.rights.people_here()
        ]
        found = []
        for name in control.robots.names:
            refused = control.rights.refusals(name, me)
            held = control.rights.holder(name)
            holds = held is not None and held.person.id == me.person.id
            has_right = all(each.code != "right" for each in refused)
            found.append(
                RightShown(
                    robot=name,
                    why=" ".join(each.text for each in refused if each.code != "confirm"),
                    holds=holds,
                    may_take=control.rights.of(name).rules.baton and has_right and not holds,
                )
            )
        return RightsShown(robots=found, people=people)

    return [set_rights, rights]


def _baton(services: RunnerServices) -> list[ControllerRouterHandler]:
    @post(
        "/api/robots/{name:str}/baton/take",
        status_code=200,
        summary="Take the baton of a robot, with a reason from its holder",
        operation_id="takeBaton",
        guards=[Needs("operate")],
    )
    async def take(name: str, data: BatonTake, request: _Asking) -> Robot:
        rights, me = services.control.rights, identity_of(request)
        await rights.take(name, me, author_of(request), data.reason)
        return services.control.robot_view(name, unseen_by(services, request))

    @post(
        "/api/robots/{name:str}/baton/hand",
        status_code=200,
        summary="Hand the baton of a robot to a person who has a page open",
        operation_id="handBaton",
        guards=[Needs("operate")],
    )
    async def hand(name: str, data: BatonHand, request: _Asking) -> Robot:
        rights, me = services.control.rights, identity_of(request)
        await rights.hand(name, data.to, me, author_of(request))
        return services.control.robot_view(name, unseen_by(services, request))

    @post(
        "/api/robots/{name:str}/baton/drop",
        status_code=200,
        summary="Drop the baton of a robot",
        operation_id="dropBaton",
        guards=[Needs("operate")],
    )
    async def drop(name: str, request: _Asking) -> Robot:
        await services.control.rights.drop(name, identity_of(request), author_of(request))
        return services.control.robot_view(name, unseen_by(services, request))

    @post(
        "/api/runs/{run:str}/hand_over",
        status_code=200,
        summary="Hand a led run over to another person, with all batons of its robots: it goes on",
        operation_id="handOverRun",
        guards=[Needs("operate")],
    )
    async def hand_over(run: str, data: BatonHand, request: _Asking) -> views.RunShown:
        me = identity_of(request)
        return views.run_view(
            await services.control.hand_over(run, data.to, author_of(request), me)
        )

    return [take, hand, drop, hand_over]


def _service(services: RunnerServices) -> list[ControllerRouterHandler]:
    @post(
        "/api/robots/{name:str}/lock",
        status_code=200,
        summary="Put a robot out of service: nothing starts or goes on there, what runs is not stopped",
        operation_id="lockRobot",
        guards=[Needs("operate")],
    )
    async def lock(name: str, data: LockWanted, request: _Asking) -> Robot:
        rights, me = services.control.rights, identity_of(request)
        await rights.lock(name, me, author_of(request), data.reason)
        return services.control.robot_view(name, unseen_by(services, request))

    @post(
        "/api/robots/{name:str}/unlock",
        status_code=200,
        summary="Take one's own lock off a robot; owners those of others",
        operation_id="unlockRobot",
        guards=[Needs("operate")],
    )
    async def unlock(name: str, data: UnlockWanted, request: _Asking) -> Robot:
        rights, me = services.control.rights, identity_of(request)
        await rights.unlock(name, me, author_of(request), data.of)
        return services.control.robot_view(name, unseen_by(services, request))

    return [lock, unlock]


def _drills(services: RunnerServices) -> list[ControllerRouterHandler]:
    @post(
        "/api/robots/{name:str}/drills",
        summary="Record a Stop drill: a run there that was stopped, and what a person saw",
        operation_id="recordDrill",
        description="Of people only.",
        guards=[PersonOnly(), Needs("operate")],
    )
    async def record(name: str, data: DrillRequest, request: _Asking) -> Robot:
        await require_run(services, request, data.run)
        await services.control.record_drill(name, data, author_of(request))
        return services.control.robot_view(name, unseen_by(services, request))

    @get(
        "/api/robots/{name:str}/drills",
        summary="All Stop drills of a robot, newest first",
        operation_id="listDrills",
        guards=[Needs("see")],
    )
    async def drills(name: str) -> list[DrillShown]:
        services.control.robots.registration(name)
        return [drill_view(each) for each in reversed(services.control.rights.of(name).drills)]

    return [record, drills]


def _releases(services: RunnerServices) -> list[ControllerRouterHandler]:
    @put(
        "/api/releases/{version:str}",
        status_code=204,
        summary="Tell a runner on another computer that a version is released",
        operation_id="storeRelease",
        description="For a runner with a data folder of its own.",
        guards=[Needs("share")],
    )
    async def store(version: str, data: Release, request: _Asking) -> None:
        if version != data.version:
            where: dict[str, object] = {"path": "/version"}
            raise BadInput("The path names another version than the body.", where=where)
        me = identity_of(request).person
        release = msgspec.structs.replace(data, by=PersonRef(me.id, me.name))
        try:
            await anyio.to_thread.run_sync(services.released.add, release)
        finally:
            services.audit.note(ReleaseTold(version), me.id)

    @delete(
        "/api/releases/{version:str}",
        status_code=204,
        summary="Tell a runner on another computer that the release of a version was withdrawn",
        operation_id="dropRelease",
        guards=[Needs("share")],
    )
    async def drop(version: str, request: _Asking) -> None:
        try:
            await anyio.to_thread.run_sync(services.released.remove, version)
        finally:
            told = ReleaseTold(version, withdrawn=True)
            services.audit.note(told, identity_of(request).person.id)

    return [store, drop]


def _rules_of(wanted: RightsWanted, before: Rules) -> Rules:
    """Return the rules that an owner wants. Raise BadInput if somebody stands there twice, or a limit
    limits nothing."""
    limits = before.limits
    if wanted.limits is not msgspec.UNSET:
        limits = tuple(Limit(**msgspec.structs.asdict(each)) for each in wanted.limits)
    for index, limit in enumerate(limits):
        if limit.fault:
            raise BadInput(limit.fault, where={"path": f"/limits/{index}"})
    stop = before.hardware_stop
    if wanted.hardware_stop is None:
        stop = None
    elif wanted.hardware_stop is not msgspec.UNSET:
        stop = HardwareStop(**msgspec.structs.asdict(wanted.hardware_stop))
        if stop.fault:
            raise BadInput(stop.fault, where={"path": "/hardware_stop"})
    page = before.page_presence
    if wanted.page_presence is None:
        page = None
    elif wanted.page_presence is not msgspec.UNSET:
        page = PagePresence(**msgspec.structs.asdict(wanted.page_presence))
        if page.fault:
            raise BadInput(page.fault, where={"path": "/page_presence"})
    health = before.health
    if wanted.health is not msgspec.UNSET:
        health = tuple(map(_health_check, wanted.health))
    for index, check in enumerate(health):
        if check.fault:
            raise BadInput(check.fault, where={"path": f"/health/{index}"})
    operators: tuple[Operator, ...] | None = None
    if wanted.operators != "all":
        ids = [each.id for each in wanted.operators]
        if len(set(ids)) < len(ids):
            raise BadInput("Somebody is named twice.", where={"path": "/operators"})
        operators = tuple(map(_operator, wanted.operators))
    return Rules(
        operators=operators,
        baton=wanted.baton,
        watched=wanted.watched,
        drill_days=wanted.drill_days,
        released_only=wanted.released_only,
        ask_again=wanted.ask_again,
        limits=limits,
        hardware_stop=stop,
        page_presence=page,
        health=health,
    )


def _health_check(wanted: HealthWanted) -> HealthCheck:
    unknown = wanted.poor if wanted.unknown is None else wanted.unknown
    return HealthCheck(**msgspec.structs.asdict(msgspec.structs.replace(wanted, unknown=unknown)))


def _operator(wanted: OperatorWanted) -> Operator:
    until = wanted.until
    if until is not None and until.tzinfo is None:
        until = until.replace(tzinfo=UTC)
    return Operator(wanted.id, wanted.name, None if until is None else sent_us(until, "/operators"))
