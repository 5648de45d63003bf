"""The requests of starts, and the rules that a start has to satisfy before it is stored or sent. Pure."""

import itertools
import re
from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Final, Literal, TypeAlias, TypeVar

import msgspec

from action_assistant.errors import BadInput, Conflict, TooLarge
from action_assistant.runner.links.port import CONDUCTED, SIMULATOR
from action_assistant.runner.links.simulator import slowed
from action_assistant.runner.runs.earlier import StartFrom
from action_assistant.runner.runs.events import Override, RunSubgraph
from action_assistant.runner.runs.sent_graphs import (
    Inner,
    SentGraph,
    SentSubgraph,
    graphs_in,
    read_inside,
    read_sent,
    tree_of,
)
from action_assistant.runner.start.casting import (
    people_of,
    placed_on,
    require_nobody_asked,
    require_robots,
    require_same_robots,
    without_preset,
)
from action_assistant.runner.start.levels import opened_levels, pinned_in, pinned_opened
from action_assistant.runner.start.piece_texts import PieceText, texts_of
from action_assistant.runner.start.start_from import Beginning, EarlierRun, beginning
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.check import blocking, check, forbids_start, is_final
from action_assistant.umrf.checks.actors import led_problems
from action_assistant.umrf.digest import digest
from action_assistant.umrf.facts import PINNED, EngineFacts
from action_assistant.umrf.files import codec
from action_assistant.umrf.hierarchy.opening import Levels
from action_assistant.umrf.kept_values import receiving, value_arrows
from action_assistant.umrf.laps import Laps, laps
from action_assistant.umrf.led_steps import as_one_step
from action_assistant.umrf.led_subgraphs import (
    Inside,
    actors_in,
    graphs_within,
    players,
    subgraph_obstacles,
)
from action_assistant.umrf.limits import (
    NO_LIMITS,
    Limit,
    LimitedInputs,
    Limits,
    OverLimit,
    inputs_of,
    over_limits,
)
from action_assistant.umrf.model import Action, Graph, Problem
from action_assistant.umrf.pieces import Obstacle, handed_by, obstacles, piece_name
from action_assistant.umrf.questions import (
    Asked,
    asked_in,
    is_asked,
    obstacles_of_questions,
    without_asked,
)
from action_assistant.umrf.run_size import RunSize, excess
from action_assistant.umrf.semantics import SCRIPT, Script, script_from
from action_assistant.umrf.start_values import (
    AskedInput,
    StartValues,
    WrongValue,
    asked_inputs,
    with_values,
)
from action_assistant.web.auth.graph_seals import Sight
from action_assistant.web.http.plain_texts import require_plain

T = TypeVar("T")

_Name = Annotated[str, msgspec.Meta(min_length=1, max_length=100)]

#: Made by the client, once per press; "" from a client that repeats nothing.
_PressId = Annotated[str, msgspec.Meta(max_length=200)]
_NameText = Annotated[str, msgspec.Meta(max_length=1000)]
Breakpoints = Annotated[tuple[Breakpoint, ...], msgspec.Meta(max_length=200)]

#: What sub-graphs are in a led run.
SubGraphs: TypeAlias = Literal["one_step", "opened"]

#: Who answers the questions of a graph, by actor.
People: TypeAlias = Annotated[dict[_NameText, _NameText], msgspec.Meta(max_length=100)]

#: True for each robot of which a person says that they watch it.
Watching: TypeAlias = Annotated[dict[_Name, bool], msgspec.Meta(max_length=100)]

_MOST_SHOWN: Final = 20  # problems in one refusal
_MOST_ENGINES: Final = 20  # of one group
_MOST_KEPT: Final = 40  # errors, and warnings, that a prepared start keeps


class StartRequest(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    kw_only=True,
    rename={"start_from": "from"},
):
    """A start: the version by value, and the engine that runs it.

    `digest` is that of the graph that the person saw; `request_id` is made by the client, once per
    intended start. `like`: the robot whose engine the simulator plays, with its hazards.
    `behaviours`: actions with a Python behaviour on the runner do what that does, before what the
    script says. `subgraphs`: all graphs inside, by value, as the version has them; `tree_digest`:
    the digest of the graph together with them. For the engine `conducted`, `robots` gives the robot
    of each actor ("" for actions without one), `people` who answers the questions of each actor: the id
    of a person or of a group, "" for all who may run it; `lost`: see `Led`. `watching`: true for each robot of
    which the person says that they watch it, with its hardware stop within reach. `drill`: the start is
    for a Stop drill of its robot, and so needs no earlier one. `sight`: the rules of the
    version, as the editor seals them; without it, where there are rules, the run is for its starter
    and owners. `values`: those of inputs for which the graph asks; its digest stays that without them.
    `from`: where it begins, if not at the entry. `levels`: in a led run a sub-graph is one step, or it is
    opened: the actions inside of it are steps of their own.
    """

    version: str
    digest: str
    umrf: SentGraph
    engine: Annotated[str, msgspec.Meta(min_length=1, max_length=100)]
    request_id: Annotated[str, msgspec.Meta(min_length=1, max_length=200)]
    graph: str | None = None
    script: Annotated[msgspec.Raw, SCRIPT] = msgspec.field(default_factory=msgspec.Raw)
    override: Override | None = None
    like: str | None = None
    behaviours: bool = False
    subgraphs: tuple[SentSubgraph, ...] = ()
    tree_digest: str | None = None
    robots: dict[str, str] = {}
    people: People = {}
    lost: Literal["stop", "wait"] = "stop"
    watching: Watching = {}
    drill: bool = False
    sight: Sight | None = None
    breakpoints: Breakpoints = ()
    values: StartValues = {}
    start_from: StartFrom | None = None
    levels: SubGraphs = "one_step"


class GoOnRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Lets a held run go on. `since`: the `since` of `held`, as the person saw it; a run that has gone
    on meanwhile has another one. `request_id`: names this press; if it has counted already, a repeat
    changes nothing and is answered with the run as it is now. `watching`: as in `StartRequest`."""

    since: datetime
    request_id: _PressId = ""
    watching: Watching = {}


class StepRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Lets one action of a held run begin, then holds it again. `since`, `request_id`, `watching`: as in
    `GoOnRequest`. `action`: the full name of the one to begin, "" for the one that has waited longest;
    `until`: in place of it, all begin that come before this action; `over`: in place of both, all begin
    that are inside of this sub-graph, which is opened, as the `levels` of these actions name it."""

    since: datetime
    request_id: _PressId = ""
    watching: Watching = {}
    action: _NameText = ""
    until: _NameText = ""
    over: Annotated[tuple[_NameText, ...], msgspec.Meta(max_length=40)] = ()


class WaitRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Lets a led run begin nothing further. `reason`: shown to everybody; `request_id`: as in
    `GoOnRequest`."""

    reason: Annotated[str, msgspec.Meta(max_length=1000)] = ""
    request_id: _PressId = ""


class BreakpointsRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Sets the breakpoints of a led run. `was`: those that the person saw; if there are others now, it
    is refused. `watching`: as in `StartRequest`, if one of them is taken away."""

    breakpoints: Breakpoints
    was: Breakpoints
    watching: Watching = {}


class ResumeRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Lets a paused run go on. `watching`: as in `StartRequest`."""

    watching: Watching = {}


class WordRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The outcome of an action in a led run by the word of a person, with the reason. `action`:
    its full name; `piece`: the run of its piece that the person has seen, so that the word counts for
    no later visit; `request_id`: as in `GoOnRequest`."""

    action: str
    outcome: Literal["true", "false", "error"]
    reason: Annotated[str, msgspec.Meta(min_length=1, max_length=1000)]
    piece: str = ""
    request_id: _PressId = ""


class GroupRequest(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    kw_only=True,
    rename={"start_from": "from"},
):
    """One version for several robots at once. Without version, digest and `request_id` it is only
    good for a pre-flight."""

    umrf: SentGraph
    version: str = ""
    digest: str = ""
    engines: Annotated[tuple[_Name, ...], msgspec.Meta(min_length=1, max_length=_MOST_ENGINES)]
    request_id: Annotated[str, msgspec.Meta(max_length=200)] = ""
    graph: str | None = None
    override: Override | None = None
    like: str | None = None
    behaviours: bool = False
    subgraphs: tuple[SentSubgraph, ...] = ()
    tree_digest: str | None = None
    robots: dict[str, str] = {}
    people: People = {}
    lost: Literal["stop", "wait"] = "stop"
    watching: Watching = {}
    drill: bool = False
    sight: Sight | None = None
    breakpoints: Breakpoints = ()
    values: StartValues = {}
    start_from: StartFrom | None = None
    levels: SubGraphs = "one_step"

    def for_engine(self, engine: str) -> StartRequest:
        """Return the start on one of these engines; its `request_id` is made of this one and the engine."""
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
            robots=self.robots if engine == CONDUCTED else {},
            people=self.people if engine == CONDUCTED else {},
            lost=self.lost,
            watching=self.watching
            if engine == CONDUCTED
            else {name: said for name, said in self.watching.items() if name == engine},
            drill=self.drill,
            sight=self.sight,
            breakpoints=self.breakpoints,
            values=self.values,
            start_from=self.start_from,
            levels=self.levels if engine == CONDUCTED else "one_step",
        )


class AskedInputsRequest(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"start_from": "from"}
):
    """A graph, of which the inputs are wanted for which a start asks. `from`: where that begins, if not
    at the entry; `graph`: the id of the graph, if it takes values of an earlier run."""

    umrf: SentGraph
    graph: str | None = None
    start_from: StartFrom | None = None


class Admitted(msgspec.Struct, frozen=True, kw_only=True):
    """A start whose graph passed all checks. `graph`: with the values of the start, `sent_digest` its
    digest; `digest`: that of the version. `problems`: warnings, and those that forbid a start and are
    overridden. `beyond`: values, or a part that is played alone, change what the version itself says.
    `beginning`: where it begins, None for the entry; `levels`: the sub-graphs around each action, if
    these are opened: then `inside` is empty."""

    graph: Graph
    graph_id: str | None
    script: Script
    script_text: str
    digest: str
    problems: tuple[Problem, ...] = ()
    subgraphs: tuple[RunSubgraph, ...] = ()
    inside: dict[str, Graph] = {}
    sent_digest: str = ""
    beyond: bool = False
    beginning: Beginning | None = None
    levels: dict[str, Levels] | None = None


class Prepared(msgspec.Struct, frozen=True, kw_only=True):
    """An admitted start without its graph, which only workers read: the name of the graph, the aid
    of each action by full name, and the text that will be sent, with the identity of the run in it.
    `problems`: at most as many as anybody is shown. `inner`: the names of actions inside of
    `subgraphs`. `is_led`: these are the actions of one robot, which gets them one by one; `handing`:
    the arrows by which these hand values to others. `digest`, `tree_digest`: of the version;
    `sent_digest`, `beyond`, `beginning`, `levels`: as of `Admitted`, `beginning` without its graph.
    `limits`: those in force on its robots; `over`: what is outside of them."""

    run: str
    name: str
    actions: dict[str, str]
    umrf: str
    graph_id: str | None
    script: str
    digest: str
    laps: Laps
    inner_laps: dict[str, Laps]
    problems: tuple[Problem, ...] = ()
    subgraphs: tuple[RunSubgraph, ...] = ()
    inner: tuple[str, ...] = ()
    tree_digest: str
    is_led: bool = False
    handing: tuple[Obstacle, ...] = ()
    sent_digest: str = ""
    beyond: bool = False
    beginning: Beginning | None = None
    levels: dict[str, Levels] | None = None
    limits: Limits = {}
    over: tuple[OverLimit, ...] = ()


def read_request(body: bytes) -> StartRequest:
    """Decode the body of a start. Raises BadInput with the place."""
    return decoded(body, StartRequest)


def read_group(body: bytes) -> GroupRequest:
    """Decode the body of a start on several robots, or of a pre-flight. Raises BadInput with the
    place."""
    group = decoded(body, GroupRequest)
    if len(set(group.engines)) < len(group.engines):
        raise BadInput("A robot is named twice.", where={"path": "/engines"})
    if group.drill and len(group.engines) > 1:
        raise BadInput("A Stop drill is made on one robot at a time.", where={"path": "/drill"})
    return group


def decoded(body: bytes, kind: type[T]) -> T:
    """Decode a JSON body as this type. Raises BadInput with the place."""
    require_plain(body)
    try:
        return msgspec.json.decode(body, type=kind)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        message, where = _placed(str(error))
        raise BadInput(message, where=where) from error


def admit(
    request: StartRequest,
    facts: EngineFacts,
    *,
    approved: bool = True,
    earlier: EarlierRun | None = None,
) -> Admitted:
    """Check the graphs of a start request, and return them as read. If the start is not `approved`,
    its digests may be missing. `earlier`: the run from which it takes outcomes. Raise NotUmrf if a text
    is no UMRF graph, Conflict if a digest differs or a problem forbids the start, TooLarge if the graphs
    are too large, BadInput for another fault. Except for its size, a graph is refused only for problems
    that its checks show too."""
    text, reading = read_sent(bytes(request.umrf))
    stamp = codec.stamp_of(text)
    found = digest(reading.graph)
    if found != request.digest and (approved or request.digest):
        raise Conflict(
            "The graph that was sent is not the one that was approved: its digest is "
            f"{found[:12]}…, not {request.digest[:12]}…. Nothing was started.",
            where={"path": "/digest"},
        )
    subgraphs, inside = read_inside(
        request.subgraphs, found, request.tree_digest, approved=approved
    )
    _check_size(text, reading.graph, subgraphs, inside)
    begins = _beginning(request, reading.graph, tree_of(found, subgraphs), earlier)
    levels = begins.levels if begins is not None else None
    if begins is None:
        graph = _given(reading.graph, request.values)
    else:
        graph = begins.graph if begins.before else _given(begins.graph, request.values)
    if request.levels == "opened":
        is_whole = begins is None and request.engine == CONDUCTED
        graph, levels = opened_levels(graph, inside, is_whole=is_whole)
        _check_size(codec.write(graph).encode(), graph, (), {})
    inside = inside if levels is None else {}
    found_problems = check(graph, None, facts, inside)
    is_whole = begins is None and levels is None
    problems = [
        *reading.problems,
        *(reading.placed(found_problems) if is_whole else found_problems),
    ]
    if request.engine != CONDUCTED and any(map(is_asked, graph.actions)):
        require_nobody_asked(graph, request.engine, script_of(request)[0])
    _check_problems(problems, request.override)
    script, script_text = script_of(request)
    return Admitted(
        graph=graph,
        graph_id=request.graph or stamp.graph,
        script=script,
        script_text=script_text,
        digest=found,
        sent_digest=digest(graph) if request.values or not is_whole else found,
        beyond=_is_beyond(reading.graph, request.values)
        or levels is not None
        or (begins is not None and begins.is_part),
        beginning=begins,
        levels=levels,
        problems=tuple(problems),
        subgraphs=subgraphs,
        inside=inside,
    )


def prepared(
    request: StartRequest,
    facts: EngineFacts,
    run: str,
    *,
    approved: bool = True,
    earlier: EarlierRun | None = None,
    limits: Limits = NO_LIMITS,
) -> Prepared:
    """Admit a start and write the text that will be sent as this run. For workers: it takes long
    with large graphs. Raises what `admit` raises. `earlier`: as for `admit`; `limits`: the limits
    in force on the robot that gets the whole graph."""
    admitted = admit(request, facts, approved=approved, earlier=earlier)
    graph = admitted.graph
    inside = [action for each in admitted.inside.values() for action in each.actions]
    overridden = list(filter(forbids_start, admitted.problems))
    warnings = [each for each in admitted.problems if not forbids_start(each)]
    return Prepared(
        run=run,
        name=graph.name,
        actions={each.full_name: each.key for each in graph.actions if not each.missing},
        umrf=codec.write(graph, codec.Stamp(admitted.graph_id, request.version, run)),
        graph_id=admitted.graph_id,
        script=admitted.script_text,
        digest=admitted.digest,
        laps=laps(graph),
        inner_laps={name: laps(each, inside=True) for name, each in admitted.inside.items()},
        problems=(*overridden[:_MOST_KEPT], *warnings[:_MOST_KEPT]),
        subgraphs=admitted.subgraphs,
        inner=tuple(sorted({each.name for each in inside if not each.missing})),
        tree_digest=tree_of(admitted.digest, admitted.subgraphs),
        sent_digest=admitted.sent_digest,
        beyond=admitted.beyond,
        beginning=admitted.beginning
        and msgspec.structs.replace(admitted.beginning, graph=Graph(name=graph.name)),
        levels=admitted.levels,
        limits=limits,
        over=_over(limits.get(request.engine, ()), inputs_of(graph, admitted.inside)),
    )


def _over(limits: Sequence[Limit], inputs: LimitedInputs) -> tuple[OverLimit, ...]:
    return tuple(itertools.islice(over_limits(limits, inputs), _MOST_SHOWN))


def _beginning(
    request: StartRequest, graph: Graph, tree: str, earlier: EarlierRun | None
) -> Beginning | None:
    """Return where a start begins; None for the entry. Raise what `beginning` raises."""
    start = request.start_from
    if start is None:
        return None
    if start.continues and request.engine != CONDUCTED:
        text = "Only a run that is led step by step is continued where it ended."
        raise BadInput(text, where={"path": "/engine"})
    return beginning(graph, tree, request.values, start, earlier)


def asked_for(wanted: AskedInputsRequest, earlier: EarlierRun | None) -> tuple[AskedInput, ...]:
    """Return the inputs for which a start of a sent graph asks; none if it continues a run, which has
    its values. For workers. `earlier`: the run from which it takes outcomes. Raise what `read_sent` and
    `beginning` raise."""
    graph, start = read_sent(bytes(wanted.umrf))[1].graph, wanted.start_from
    if start is None:
        return asked_inputs(graph)
    return () if start.continues else asked_inputs(beginning(graph, "", {}, start, earlier).graph)


def _given(graph: Graph, values: StartValues) -> Graph:
    """Return the graph with the values of a start. Raise BadInput, with the place, for a wrong one."""
    try:
        return with_values(graph, values)
    except WrongValue as why:
        raise BadInput(str(why), where={"path": why.path}) from why


def _is_beyond(graph: Graph, values: StartValues) -> bool:
    """Return whether values are given to inputs that the graph does not leave open. The marks of its
    author, which allow that, are none of its digest."""
    if not values:
        return False
    left_open = {(each.action, each.name) for each in asked_inputs(graph) if each.open}
    return any((name, each) not in left_open for name, given in values.items() for each in given)


def _check_size(text: bytes, graph: Graph, subgraphs: Sequence[RunSubgraph], inside: Inner) -> None:
    """Refuse a start larger than the editor would publish. Raise TooLarge then."""
    texts = len(text) + sum(len(each.umrf.encode()) for each in subgraphs)
    actions = sum(len(each.actions) for each in (graph, *inside.values()))
    too_large = excess(RunSize(texts, actions, len(inside)))
    if too_large is not None:
        raise TooLarge(too_large)


def _check_problems(problems: Sequence[Problem], override: Override | None) -> None:
    if override is not None and not override.reason.strip():
        raise BadInput("Say why the problems do not matter.", where={"path": "/override/reason"})
    codes = override.codes if override is not None else ()
    left = blocking(list(problems), overridden=codes)
    if not left:
        return
    final = sorted({problem.code for problem in left if is_final(problem)})
    first = left[0]
    more = f" (and {len(left) - 1} more)" if len(left) > 1 else ""
    rule = (
        f" {', '.join(final)} cannot be overridden."
        if final
        else " A person may override this with a reason."
    )
    raise Conflict(
        f"{first.message}{more}{rule}",
        where={
            "path": f"/umrf{first.where.path}",
            "problems": msgspec.to_builtins(left[:_MOST_SHOWN]),
        },
    )


def script_of(request: StartRequest) -> tuple[Script, str]:
    """Return the script of a start, and its text. Raise BadInput, with the place, for a wrong one."""
    raw = bytes(request.script).strip()
    if raw in {b"", b"null"}:
        return Script({}), ""
    is_asked_only = request.engine == CONDUCTED and not request.robots
    if SIMULATOR not in {request.engine, *request.robots.values()} and not is_asked_only:
        raise BadInput("Only the simulator follows a script.", where={"path": "/script"})
    try:
        script = script_from(msgspec.json.decode(raw))
    except ValueError as error:
        raise BadInput(f"The script: {error}", where={"path": "/script"}) from error
    return slowed(script), raw.decode()


def _placed(text: str) -> tuple[str, dict[str, object] | None]:
    """Split a message of msgspec, which may end with "- at `$.a[0]`", into its text and the place as a JSON
    pointer."""
    message, found, place = text.partition(" - at `$")
    if not found:
        return text, None
    path = re.sub(r"\[(\d+)\]", r"/\1", place.rstrip("`").replace(".", "/").replace("[...]", ""))
    return message, {"path": path}


class PreparedPieces(msgspec.Struct, frozen=True, kw_only=True):
    """An admitted start of a led run: the whole graph, and what robots get of it.

    `players`: the robot of each action that a robot plays, by full name; `texts`: the pieces;
    `by_robot`: all actions of a robot as one graph without arrows, which is looked at
    before the start and never sent. `problems`: what leading the graph means; `remedies`: what
    would take a problem away, by its code, as a sentence; `breakpoints`: where the run will wait;
    `robots`, `people`: those of the request that the graph needs, by actor; `asked`: the actions that
    people answer, or for which the runner waits."""

    whole: Prepared
    players: dict[str, str]
    texts: dict[str, PieceText]
    by_robot: dict[str, Prepared]
    problems: tuple[Problem, ...]
    remedies: dict[str, str] = {}
    breakpoints: tuple[Breakpoint, ...] = ()
    robots: dict[str, str] = {}
    people: dict[str, str] = {}
    asked: dict[str, Asked] = {}


def prepared_pieces(
    request: StartRequest,
    facts: EngineFacts,
    run: str,
    *,
    approved: bool = True,
    earlier: EarlierRun | None = None,
    limits: Limits = NO_LIMITS,
) -> PreparedPieces:
    """Admit the start of a led run and write the texts of its pieces. For workers. Raises what
    `admit` raises, BadInput for an actor without a robot or a robot without an actor, Conflict for
    a graph that cannot run as pieces. `earlier`: as for `admit`; `limits`: the limits in force on
    its robots."""
    whole = prepared(request, facts, run, approved=approved, earlier=earlier)
    whole = msgspec.structs.replace(whole, limits=limits)
    graph = codec.read(whole.umrf).graph
    inside = graphs_in(whole.subgraphs) if whole.levels is None else {}
    for_robots = without_asked(graph)
    actors = actors_in(for_robots, inside)
    if whole.beginning is not None:  # what is skipped needs no robot
        robots = {actor: robot for actor, robot in request.robots.items() if actor in actors}
        request = msgspec.structs.replace(request, robots=robots)
    require_robots(request.robots, actors)
    people = people_of(graph, request.people, is_part=whole.beginning is not None)
    if whole.beginning is not None and whole.beginning.before is not None:
        require_same_robots(request.robots, earlier)
    skipped = whole.beginning.earlier.skipped if whole.beginning is not None else ()
    if whole.levels is None:
        breakpoints = pinned_in(graph, request.breakpoints, skipped=skipped)
    else:
        closed = _given(read_sent(bytes(request.umrf))[1].graph, request.values)
        opens = closed, graphs_in(whole.subgraphs), whole.levels
        breakpoints = pinned_opened(graph, request.breakpoints, *opens)
    hindering = (
        *obstacles_of_questions(inside),
        *subgraph_obstacles(for_robots, inside, request.robots),
        *obstacles(graph),
    )
    if hindering:
        raise Conflict(
            _in_words(hindering),
            where={"path": "/umrf", "obstacles": msgspec.to_builtins(hindering[:_MOST_SHOWN])},
        )
    played = players(for_robots, inside, request.robots)
    placed = placed_on(graph, played)
    problems = led_problems(placed, PINNED)
    by_robot: dict[str, list[Action]] = {}
    for action in graph.actions:
        robot = played.get(action.full_name, SIMULATOR)
        if robot != SIMULATOR:
            by_robot.setdefault(robot, []).append(action)
    moving = {name: robot for name, robot in played.items() if robot != SIMULATOR}
    asked = asked_in(graph, people, moving)
    if not moving:
        asked = without_preset(graph, asked, whole.script)
    return PreparedPieces(
        whole=whole,
        players=moving,
        texts=texts_of(graph, inside, codec.Stamp(whole.graph_id, request.version, run)),
        by_robot={
            robot: _part_of(whole, graph, robot, actions, inside)
            for robot, actions in by_robot.items()
        },
        problems=tuple(problems),
        remedies=as_one_step(placed, problems, PINNED),
        breakpoints=breakpoints,
        robots=request.robots,
        people=people,
        asked=asked,
    )


def _part_of(
    whole: Prepared, graph: Graph, robot: str, actions: Sequence[Action], inside: Inside
) -> Prepared:
    """Return all actions of a robot as one graph without arrows, with the graphs inside of them."""
    name = piece_name(graph.name, robot)
    alone = tuple(msgspec.structs.replace(each, actor="") for each in actions)
    within = frozenset[str]().union(*(graphs_within(each, inside) for each in actions))
    return msgspec.structs.replace(
        whole,
        name=name,
        umrf=codec.write(Graph(name=name, actions=alone)),
        actions={each.full_name: each.key for each in actions},
        inner_laps={name: laps for name, laps in whole.inner_laps.items() if name in within},
        subgraphs=tuple(each for each in whole.subgraphs if each.name in within),
        is_led=True,
        handing=handed_by(graph, {each.key for each in actions}),
        over=_over(
            whole.limits.get(robot, ()),
            inputs_of(
                msgspec.structs.replace(graph, actions=tuple(actions)),
                {name: inside[name] for name in sorted(within)},
                receiving(graph, tuple(value_arrows(graph))),
            ),
        ),
    )


def _in_words(hindering: Sequence[Obstacle]) -> str:
    """Return the first obstacle of each kind, with how many more there are of that kind."""
    by_code: dict[str, list[Obstacle]] = {}
    for each in hindering:
        by_code.setdefault(each.code, []).append(each)
    return " ".join(
        f"{alike[0].text}{f' (and {len(alike) - 1} more)' if len(alike) > 1 else ''}"
        for alike in by_code.values()
    )
