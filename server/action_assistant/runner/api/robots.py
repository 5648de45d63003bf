"""The routes of robots: the registry, their state, commands of others, pre-flights, starts on
several robots."""

from datetime import datetime
from functools import partial
from typing import Annotated, Any, Final, Literal, assert_never

import msgspec
from litestar import Request, Response, delete, get, patch, post
from litestar.params import Parameter
from litestar.types import ControllerRouterHandler
from msgspec.structs import replace

from action_assistant.errors import BadInput, NotFound, Refused
from action_assistant.runner.api.caller import COUNTED, GRAPH_BODY, author_of, body_of
from action_assistant.runner.api.practice import practice_route
from action_assistant.runner.api.refused_starts import StartNeeds, noted, refusal_of
from action_assistant.runner.api.run_guard import require_all_on_robot, shown, unseen_by
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.links.behaviours.folder import BehaviourList
from action_assistant.runner.links.port import Candidate, Registration, Sighting
from action_assistant.runner.robots.practice_robot import NAME as PRACTICE
from action_assistant.runner.robots.practice_robot import PracticeRobot
from action_assistant.runner.robots.recordings import Recording
from action_assistant.runner.robots.registration import Robot
from action_assistant.runner.robots.rights import (
    BatonChange,
    BatonPassed,
    Drilled,
    Locked,
    RightsEvent,
    RightsSet,
    Unlocked,
)
from action_assistant.runner.robots.robot_events import (
    Commanded,
    EngineBecame,
    GraphFile,
    IndexWriteAsked,
    IndexWritten,
    RobotEvent,
    StopAsked,
    StopUnproven,
    StopWasProven,
)
from action_assistant.runner.runs import views
from action_assistant.runner.runs.sight import HIDDEN_NAME, names_seen, run_graphs
from action_assistant.runner.start.admission import (
    AskedInputsRequest,
    GroupRequest,
    decoded,
    read_group,
)
from action_assistant.runner.start.index_writer import (
    IndexWriteAnswer,
    IndexWriteRequest,
    read_index_write,
)
from action_assistant.runner.start.preflight import Preflight
from action_assistant.safe_text import hold_names
from action_assistant.umrf.facts import SECOND_PERSON
from action_assistant.umrf.files import codec
from action_assistant.umrf.files.action_files import write_action
from action_assistant.umrf.json.text import JsonObject, UmrfGraph
from action_assistant.umrf.model import Signature
from action_assistant.umrf.start_values import AskedInput
from action_assistant.web.auth.access import Needs, identity_of, require
from action_assistant.web.server.openapi import MOST_NUMBER, FileBytes, answer, reads

_EVENTS: Final = 200
_Asking = Request[Any, Any, Any]


class ReachStatus(msgspec.Struct, frozen=True):
    """All engines. `no_reach`: why this runner reaches none over ROS 2; "" when it can.
    `behaviours`: the Python behaviours that simulated runs can have; null where the runner was
    started without a folder of them."""

    engines: list[Robot]
    no_reach: str
    behaviours: BehaviourList | None = None


class RobotChange(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The fields of a registration to change; null leaves a field as it is."""

    domain: int | None = None
    rmw: str | None = None
    get_service: str | None = None
    profile: dict[str, object] | None = None
    led: bool | None = None


class KnownAction(msgspec.Struct, frozen=True):
    """An action that a robot has indexed."""

    name: str
    inputs: dict[str, str]
    outputs: dict[str, str]


class RobotKnowledge(msgspec.Struct, frozen=True):
    """The actions and graphs that a robot has indexed. `unread`: how many files of its index cannot
    be read."""

    actions: list[KnownAction]
    graphs: list[str]
    unread: int


class RobotLogLine(msgspec.Struct, frozen=True, kw_only=True):
    """A line of a robot's flight record. `has_graph`: its graph can be fetched; `graphs`: names of
    graphs for its index; `files`: the files that were written for it. Of a change of its rights,
    `sender`: who made it, "" for the runner; `how`: how its baton passed, from `was` to `to`."""

    seq: int
    at: datetime
    kind: Literal[
        "commanded",
        "became",
        "stop_asked",
        "stop_proven",
        "stop_unproven",
        "index_write_asked",
        "index_written",
        "rights_set",
        "baton",
        "locked",
        "unlocked",
        "drilled",
    ]
    command: str = ""
    graph: str = ""
    sender: str = ""
    state: str = ""
    why: str = ""
    run: str | None = None
    number: int | None = None
    has_graph: bool = False
    graphs: tuple[str, ...] = ()
    files: tuple[GraphFile, ...] = ()
    how: BatonChange | Literal[""] = ""
    was: str = ""
    to: str = ""

    def __post_init__(self) -> None:
        hold_names(self, "why")


class RobotStopped(msgspec.Struct, frozen=True):
    """The targets of a Stop of a robot: the ids of this runner's runs, and the names of graphs that
    others started."""

    runs: list[str]
    graphs: list[str]


class GroupShown(msgspec.Struct, frozen=True, kw_only=True):
    """The runs that were started together. `failed`: robots that nothing was sent to, and why."""

    id: str
    runs: list[views.RunShown]
    failed: dict[str, str]


def routes(services: RunnerServices) -> list[ControllerRouterHandler]:
    """Return the routes about robots: the registry, one robot, starts on several, and index
    folders."""
    return [
        *_registry(services),
        *_one_robot(services),
        *_starts(services),
        _index(services),
    ]


def _registry(services: RunnerServices) -> list[ControllerRouterHandler]:
    practice = PracticeRobot()

    @get(
        "/api/robots",
        summary="Engines that runs can go to",
        operation_id="listRobots",
        guards=[Needs("see")],
    )
    async def robots(request: _Asking) -> list[Robot]:
        return services.control.robot_views(unseen_by(services, request))

    @get(
        "/api/reach",
        summary="All engines, and whether robots can be reached over ROS 2 from here",
        operation_id="getReach",
        guards=[Needs("see")],
    )
    async def reach(request: _Asking) -> ReachStatus:
        control = services.control
        engines = control.robot_views(unseen_by(services, request))
        return ReachStatus(engines, control.robots.no_reach, await _behaviours(services))

    @get(
        "/api/candidates",
        summary="Engines in sight that nobody registered yet, once discovery has had its seconds",
        operation_id="findEngines",
        guards=[Needs("see")],
    )
    async def candidates() -> list[Candidate]:
        return list(await services.control.robots.candidates())

    @get(
        "/api/candidates/now",
        summary="Engines in sight now that nobody registered yet, and for how long others may still appear",
        operation_id="getFoundEngines",
        guards=[Needs("see")],
    )
    async def sighting() -> Sighting:
        return await services.control.robots.sighting()

    @post(
        "/api/robots",
        summary="Register a robot",
        operation_id="registerRobot",
        guards=[Needs("register")],
    )
    async def register(data: Registration, request: _Asking) -> Response[Robot]:
        _require_owner_to_loosen(services, data.name, data, request)
        await services.control.register(data, author_of(request))
        robot = services.control.robot_view(data.name, unseen_by(services, request))
        return Response(robot, status_code=201, headers={"location": f"/api/robots/{robot.name}"})

    @patch(
        "/api/robots/{name:str}",
        summary="Change a robot",
        operation_id="changeRobot",
        guards=[Needs("register")],
    )
    async def change(name: str, data: RobotChange, request: _Asking) -> Robot:
        known = services.control.robots.registration(name)
        fields = {k: v for k, v in msgspec.structs.asdict(data).items() if v is not None}
        changed = msgspec.structs.asdict(known) | fields
        try:
            registration = msgspec.convert(changed, Registration)
        except msgspec.ValidationError as wrong:
            raise BadInput(str(wrong)) from wrong
        _require_owner_to_loosen(services, name, registration, request)
        await services.control.register(registration, author_of(request))
        return services.control.robot_view(registration.name, unseen_by(services, request))

    @delete(
        "/api/robots/{name:str}",
        summary="Forget a robot",
        operation_id="forgetRobot",
        guards=[Needs("register")],
    )
    async def remove(name: str, request: _Asking) -> None:
        _require_owner_to_loosen(services, name, None, request)
        await services.control.remove(name, author_of(request))
        if name == PRACTICE:
            practice.end()

    started = practice_route(services, practice)
    return [robots, reach, candidates, sighting, register, started, change, remove]


def _require_owner_to_loosen(
    services: RunnerServices, name: str, wanted: Registration | None, request: _Asking
) -> None:
    """Raise Forbidden if somebody who is no owner lets a robot start without a second person from now
    on. `wanted`: its new registration, None if it is to be forgotten."""
    robots = services.control.robots
    known = robots.registration(name) if name in robots.names else None
    asks = known is not None and known.profile.get(SECOND_PERSON) is True
    if asks and (wanted is None or wanted.profile.get(SECOND_PERSON) is not True):
        require(request, "share")


def _one_robot(services: RunnerServices) -> list[ControllerRouterHandler]:
    @get(
        "/api/robots/{name:str}",
        summary="One engine",
        operation_id="getRobot",
        guards=[Needs("see")],
    )
    async def robot(name: str, request: _Asking) -> Robot:
        return services.control.robot_view(name, unseen_by(services, request))

    @get(
        "/api/robots/{name:str}/known",
        summary="Actions and graphs that a robot has indexed",
        operation_id="getRobotIndex",
        guards=[Needs("see")],
    )
    async def known(name: str, request: _Asking) -> RobotKnowledge:
        unseen = unseen_by(services, request)
        index = await services.control.robots.index(name)
        actions = [_action(action, index.actions[action]) for action in sorted(index.actions)]
        graphs = [] if unseen is not None and unseen.is_some else sorted(index.graphs)
        return RobotKnowledge(actions, graphs, index.unread)

    @get(
        "/api/robots/{name:str}/known/{action:str}",
        summary="An action that a robot has indexed, as its UMRF file",
        operation_id="getIndexedAction",
        guards=[Needs("see")],
        responses={200: answer(JsonObject)},
    )
    async def known_action(name: str, action: str) -> Response[bytes]:
        index = await services.control.robots.index(name)
        found = index.described.get(action)
        if found is None:
            raise NotFound(f"{name} has not indexed an action {action!r}.")
        file = await services.run_in_worker(write_action, found)
        return Response(file.encode(), media_type="application/json")

    @get(
        "/api/robots/{name:str}/events",
        summary="The flight record of a robot, newest first",
        operation_id="getRobotLog",
        guards=[Needs("see")],
    )
    async def events(name: str, request: _Asking) -> list[RobotLogLine]:
        services.control.robots.registration(name)
        found = await services.control.robots.robot_log.newest(name, _EVENTS)
        unseen = unseen_by(services, request)
        lines = [_line(seq, event) for seq, event in reversed(found)]
        return lines if unseen is None or not unseen.is_some else list(map(_without_graphs, lines))

    @get(
        "/api/robots/{name:str}/events/{seq:int}/umrf",
        summary="The graph of a command, as UMRF",
        operation_id="getCommandedGraph",
        guards=[Needs("see")],
        responses={200: answer(UmrfGraph)},
    )
    async def commanded(
        name: str, seq: Annotated[int, Parameter(ge=0, le=MOST_NUMBER)], request: _Asking
    ) -> Response[bytes]:
        require_all_on_robot(services, request)
        services.control.robots.registration(name)
        return await _umrf(services, await services.control.robots.robot_log.graph(name, seq))

    @get(
        "/api/robots/{name:str}/umrf",
        summary="A graph that a robot holds, as UMRF",
        operation_id="getHeldGraph",
        guards=[Needs("see")],
        responses={200: answer(UmrfGraph)},
    )
    async def held(name: str, graph: str, request: _Asking) -> Response[bytes]:
        """Return the graph that a robot holds, without its run state, since a graph with a state
        must not be sent again."""
        seen = services.control.robot_view(name, unseen_by(services, request)).holds
        if all(each.graph != graph for each in seen):
            require_all_on_robot(services, request)
        return await _umrf(services, services.control.robots.held_graph(name, graph))

    @get(
        "/api/robots/{name:str}/recordings",
        summary="Recordings of an engine's messages, by the hour",
        operation_id="listRecordings",
        guards=[Needs("see")],
    )
    async def recorded(name: str) -> list[Recording]:
        services.control.robots.registration(name)
        recordings = services.control.robots.recordings
        return [] if recordings is None else await recordings.listed(name)

    @get(
        "/api/robots/{name:str}/recordings/{file:str}",
        summary="A recording of one hour, as JSON lines, gzipped",
        operation_id="downloadRecording",
        guards=[Needs("see")],
        responses={200: answer(FileBytes, media="application/gzip")},
    )
    async def recording(name: str, file: str, request: _Asking) -> Response[bytes]:
        require_all_on_robot(services, request)
        services.control.robots.registration(name)
        recordings = services.control.robots.recordings
        if recordings is None:
            raise NotFound("Nothing is recorded here.")
        return Response(await recordings.file(name, file), media_type="application/gzip")

    @post(
        "/api/robots/{name:str}/stop",
        operation_id="stopRobot",
        status_code=202,
        summary="Stop whatever a robot runs",
        guards=[Needs("stop")],
    )
    async def stop(name: str, request: _Asking) -> RobotStopped:
        runs, graphs = services.control.stop_robot(name, author_of(request))
        names = names_seen({name: graphs}, partial(unseen_by, services, request))
        return RobotStopped(runs, names[name])

    return [robot, known, known_action, events, commanded, held, recorded, recording, stop]


def _starts(services: RunnerServices) -> list[ControllerRouterHandler]:
    @post(
        "/api/preflight",
        operation_id="runPreflight",
        status_code=200,
        summary="The pre-flight of a start, engine by engine",
        opt=reads(GroupRequest) | COUNTED,
        guards=[Needs("simulate")],
        request_max_body_size=GRAPH_BODY,
    )
    async def look(request: _Asking) -> list[Preflight]:
        async with body_of(request, services.body_limit) as body:
            group, me = read_group(body), identity_of(request)
            return await services.control.look(group, me.person.id, me)

    @post(
        "/api/asked_inputs",
        operation_id="findAskedInputs",
        status_code=200,
        summary="The inputs for which a start of a graph asks",
        opt=reads(AskedInputsRequest) | COUNTED,
        guards=[Needs("simulate")],
        request_max_body_size=GRAPH_BODY,
    )
    async def asked(request: _Asking) -> list[AskedInput]:
        async with body_of(request, services.body_limit) as body:
            wanted = decoded(body, AskedInputsRequest)
            return list(await services.control.asked_inputs(wanted, identity_of(request)))

    @post(
        "/api/groups",
        summary="Start a version on several robots",
        operation_id="startGroup",
        opt=reads(GroupRequest) | COUNTED,
        responses={200: answer(GroupShown, text="It had been started before")},
        guards=[StartNeeds(services, "start", "operate")],
        request_max_body_size=GRAPH_BODY,
    )
    async def start(request: _Asking) -> Response[GroupShown]:
        async with body_of(request, services.body_limit) as body:
            group = read_group(body)
            with noted(services, request, refusal_of(group)):
                grouped = await services.control.start_group(
                    group, author_of(request), identity_of(request)
                )
        runs = [
            shown(services, request, views.run_view(run), run_graphs(run)) for run in grouped.runs
        ]
        started = GroupShown(id=grouped.group, runs=runs, failed=grouped.failed)
        return Response(started, status_code=201 if grouped.fresh else 200)

    return [look, asked, start]


def _index(services: RunnerServices) -> ControllerRouterHandler:
    @post(
        "/api/robots/{name:str}/index",
        operation_id="writeIntoIndex",
        description="409 with all obstacles.",
        status_code=200,
        summary="Write graphs inside of a task into the folder that a robot indexes",
        opt=reads(IndexWriteRequest) | COUNTED,
        guards=[Needs("operate")],
        request_max_body_size=GRAPH_BODY,
    )
    async def write_into_index(name: str, request: _Asking) -> IndexWriteAnswer:
        async with body_of(request, services.body_limit) as body:
            write_request = read_index_write(body)
            # Nothing moves by it, so a robot out of service may be prepared, and nobody need watch.
            services.control.rights.require([name], identity_of(request), only=("right", "baton"))
            return await services.index_writer.write(name, write_request, author_of(request))

    return write_into_index


def _action(name: str, signature: Signature) -> KnownAction:
    return KnownAction(name, signature.inputs, signature.outputs)


def _line(seq: int, event: RobotEvent) -> RobotLogLine:
    at = views.time(event.at)
    match event:
        case Commanded():
            return RobotLogLine(
                seq=seq,
                at=at,
                kind="commanded",
                command=event.command,
                graph=event.graph,
                sender=event.sender,
                run=event.run,
                number=event.number,
                has_graph=event.umrf != "",
            )
        case EngineBecame():
            return RobotLogLine(seq=seq, at=at, kind="became", state=event.state, why=event.why)
        case StopAsked():
            by = event.author.name
            return RobotLogLine(seq=seq, at=at, kind="stop_asked", graph=event.graph, sender=by)
        case StopWasProven():
            return RobotLogLine(seq=seq, at=at, kind="stop_proven", graph=event.graph)
        case StopUnproven():
            return RobotLogLine(
                seq=seq, at=at, kind="stop_unproven", graph=event.graph, why=event.why
            )
        case IndexWriteAsked():
            by, names = event.author.name, tuple(each.name for each in event.graphs)
            return RobotLogLine(seq=seq, at=at, kind="index_write_asked", sender=by, graphs=names)
        case IndexWritten():
            return RobotLogLine(
                seq=seq,
                at=at,
                kind="index_written",
                sender=event.author.name,
                files=event.files,
                why=event.why,
            )
        case RightsSet() | BatonPassed() | Locked() | Unlocked() | Drilled():
            return _rights_line(seq, event)
        case _:
            assert_never(event)


def _without_graphs(line: RobotLogLine) -> RobotLogLine:
    """Return a line without the names of graphs, and without texts that may name them: for a person
    who may not see some graph, since nobody knows whose graphs these are."""
    is_about_graphs = line.kind not in {"became", "rights_set", "baton", "locked", "unlocked"}
    why = "" if is_about_graphs else line.why
    graph = HIDDEN_NAME if line.graph else ""
    return replace(line, graph=graph, has_graph=False, graphs=(), files=(), why=why)


def _rights_line(seq: int, event: RightsEvent) -> RobotLogLine:
    at = views.time(event.at)
    by = "" if event.author is None else event.author.name
    match event:
        case RightsSet():
            return RobotLogLine(seq=seq, at=at, kind="rights_set", sender=by)
        case BatonPassed(how=how, was=was, holder=holder, reason=why):
            return RobotLogLine(
                seq=seq,
                at=at,
                kind="baton",
                sender=by,
                why=why,
                how=how,
                was="" if was is None else was.name,
                to="" if holder is None else holder.name,
            )
        case Locked(reason=why):
            return RobotLogLine(seq=seq, at=at, kind="locked", sender=by, why=why)
        case Unlocked(of=of):
            return RobotLogLine(seq=seq, at=at, kind="unlocked", sender=by, was=of.name)
        case Drilled() as drill:
            return RobotLogLine(
                seq=seq,
                at=at,
                kind="drilled",
                sender=by,
                why=drill.failure,
                run=drill.run,
                number=drill.number,
            )


async def _behaviours(services: RunnerServices) -> BehaviourList | None:
    """Return the list of Python behaviours (code that plays actions in simulated runs), or None if
    this runner has no folder of them. If the folder cannot be read, the list has that as its
    `problem`; an error would look on the page like a runner that does not answer."""
    if services.behaviours is None:
        return None
    try:
        return await services.run_in_worker(services.behaviours.listed)
    except Refused as refused:
        return BehaviourList(problem=refused.detail)


async def _umrf(services: RunnerServices, text: str) -> Response[bytes]:
    return Response(await services.run_in_worker(canonical, text), media_type="application/json")


def canonical(text: str) -> bytes:
    """Return the graph of a UMRF text as canonical UMRF in UTF-8, which the editor can import. Call
    this in a worker process. Raise NotFound if the text is no UMRF graph."""
    try:
        graph = codec.read(text).graph
    except codec.Unreadable as wrong:
        raise NotFound(f"What was sent is no UMRF graph: {wrong.message}") from wrong
    return codec.write(graph).encode()
