"""Expected courses: runs as scripts for the simulator, and the course that a script has to take
again.

A recorded run becomes a script in which every action does what it was seen to do. An expectation is
a graph, such a script and the course that they took; simulating it later, with a newer graph or a
newer product, must take the same course. `at` is microseconds UTC.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Final, Literal, TypeAlias

import msgspec
from sqlalchemy import Executable
from sqlalchemy.dialects.sqlite import insert as upsert

from action_assistant.errors import BadInput, Conflict
from action_assistant.journal.events import Event
from action_assistant.runner.analysis.levels import LevelPlace, part_of, places_of
from action_assistant.runner.runs.durations import of_visit
from action_assistant.runner.runs.events import Author, RunSubgraph
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sent_graphs import (
    SentGraph,
    SentSubgraph,
    SubgraphShown,
    graphs_in,
    read_inside,
    read_sent,
    subgraphs_shown,
)
from action_assistant.runner.runs.visits import ActionRun, Visit
from action_assistant.safe_text import hold_names
from action_assistant.schema.runner_tables import expectation
from action_assistant.umrf.files import codec
from action_assistant.umrf.json.text import JsonObject, UmrfGraph
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics import SCRIPT, script_from, steps
from action_assistant.umrf.semantics.script import script_json
from action_assistant.umrf.semantics.steps import ExpectedStep

#: The stream of all expectations.
STREAM: Final = "expectations"

Fault: TypeAlias = Literal["error", "false", "hang", "init_error"]


class Expect(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A request to expect a course under a name: that of a `run`, or that of a graph in a dry-run
    with this script. `subgraphs`: the graphs inside of that graph."""

    name: str
    run: str = ""
    graph: str = ""
    umrf: SentGraph = msgspec.field(default_factory=msgspec.Raw)
    script: Annotated[msgspec.Raw, SCRIPT] = msgspec.field(default_factory=msgspec.Raw)
    subgraphs: tuple[SentSubgraph, ...] = ()


class Expectation(msgspec.Struct, frozen=True, kw_only=True):
    """A saved expectation, with everything that simulating it again takes. `subgraphs`: the graphs
    inside; `opened`: the run had opened them, and `umrf` is the opened graph."""

    name: str
    run: str
    graph: str | None
    graph_name: str
    author: Author
    umrf: UmrfGraph
    script: JsonObject
    course: list[ExpectedStep]
    subgraphs: list[SubgraphShown]
    opened: bool


class Doubt(msgspec.Struct, frozen=True):
    """A fact that the run does not show, so that the script had to guess it."""

    action: str
    text: str

    def __post_init__(self) -> None:
        hold_names(self, "text")


class Recorded(msgspec.Struct, frozen=True):
    """A run as a script (`behaviours`, docs/contracts.md 5.2), and where the script is a guess."""

    behaviours: dict[str, list[dict[str, Any]]]
    doubts: list[Doubt]


class Expected(msgspec.Struct, frozen=True, kw_only=True):
    """The event of an expectation: a graph with this script is to take this course from now on. `opened`:
    with its sub-graphs opened, as in the run; `umrf` is the opened graph then."""

    kind: ClassVar[str] = "expectation.saved.v1"

    at: int
    name: Annotated[str, msgspec.Meta(min_length=1, max_length=100)]
    author: Author
    run: str
    graph: str | None
    graph_name: str
    umrf: str
    script: str
    course: tuple[ExpectedStep, ...]
    subgraphs: tuple[RunSubgraph, ...] = ()
    opened: bool = False


class Retired(msgspec.Struct, frozen=True):
    """The event that ends an expectation."""

    kind: ClassVar[str] = "expectation.retired.v1"

    at: int
    name: str
    author: Author


def recorded(run: Run, fault: tuple[str, Fault] | None = None) -> Recorded:
    """Return a run as a script. `fault`: an action (full name) and the fault with which its last
    visit ends instead."""
    behaviours: dict[str, list[dict[str, Any]]] = {}
    doubts: list[Doubt] = []
    for name, action in run.actions.items():
        if not action.visits:
            continue
        if action.older:
            doubts.append(Doubt(name, f"Its first {action.older} visits are not kept singly."))
        messages = iter(_spread(action))
        behaviours[name] = [
            _behaviour(name, visit, next(messages, ""), doubts) for visit in action.visits
        ]
        doubts += [
            Doubt(name, f"Its result is the word of {each.by.name}; nothing showed it.")
            for each in run.said.get(name, ())
        ]
    if fault is not None:
        name, how = fault
        behaviours[name] = [*behaviours.get(name, [])[:-1], _failing(how)]
    return Recorded(behaviours, doubts)


def fitted(found: Recorded, run: Run, graph: Graph) -> Recorded:
    """Return a run as a script (`found`) for another version of its graph: renamed actions keep
    their behaviour, and so do those inside of them. An action that never ran gets the simulator's
    default, and a doubt."""
    by_aid = {action.aid: name for name, action in run.actions.items() if action.aid is not None}
    behaviours: dict[str, list[dict[str, Any]]] = {}
    used: set[str] = set()
    doubts: list[Doubt] = []
    names: dict[str, str] = {}  # in this version, by that of the run
    for action in graph.actions:
        if action.missing:
            continue
        name = by_aid.get(action.key, action.full_name)
        names[name] = action.full_name
        if name in found.behaviours:
            used.add(name)
            behaviours[action.full_name] = found.behaviours[name]
        else:
            why = "It never ran in that run" if name in run.actions else "That run did not have it"
            doubts.append(Doubt(action.full_name, f"{why}; it ends true after a second."))
    for name, place in places_of(run).items():
        if name in found.behaviours and name not in used and (place.levels or not place.known):
            now = name if not place.levels else _named_inside(place, graph, names)
            if now is not None:
                used.add(name)
                behaviours[now] = found.behaviours[name]
    gone = sorted(found.behaviours.keys() - used)
    doubts += [Doubt(name, "This version does not have it any more.") for name in gone]
    kept = [doubt for doubt in found.doubts if doubt.action in used]
    return Recorded(behaviours, [*kept, *doubts])


def _named_inside(place: LevelPlace, graph: Graph, names: Mapping[str, str]) -> str | None:
    """Return the running name in another version (`graph`) of an action inside of sub-graphs; None if the
    outermost of these is not there any more. `names`: of the actions of that version, by those of the
    run."""
    first, *deeper = place.levels
    if first not in names:
        return None
    part = part_of(graph.name, names[first])
    for level in deeper:
        part = part_of(part, level)
    return f"{part}/{place.name}"


def _spread(action: ActionRun) -> Iterable[str]:
    """Yield one message for each visit of an action, "" if it has none, since a script can repeat
    one message per visit."""
    for visit in action.visits:
        until = visit.not_after
        yield next(
            (
                each.text
                for each in action.messages
                if each.at >= visit.not_before and (until is None or each.at <= until)
            ),
            "",
        )


def _behaviour(name: str, visit: Visit, said: str, doubts: list[Doubt]) -> dict[str, Any]:
    span = of_visit(visit)
    if span is None or visit.result == "stopped":
        return {"never": True}
    if span.most is None:
        doubts.append(Doubt(name, "No end of its code was seen; in the script it never ends."))
        return {"never": True, "ignores_stop": True}
    took = round((span.least + span.most) / 2, 3) if span.exact is None else span.exact
    if visit.result is None:
        doubts.append(Doubt(name, "Its result was not seen; the script says true."))
    if span.exact is None:
        text = (
            f"It took between {span.least:.1f} and {span.most:.1f} s; the script says {took:.1f} s."
        )
        doubts.append(Doubt(name, text))
    found: dict[str, Any] = {"after_s": took, "result": f"on_{visit.result or 'true'}"}
    return found | ({"message": said} if said else {})


def _failing(how: Fault) -> dict[str, Any]:
    match how:
        case "hang":
            return {"never": True, "ignores_stop": True}
        case "init_error":
            return {"init_error": True}
        case "error" | "false":
            return {"after_s": 0.1, "result": f"on_{how}"}


def fold(event: Event) -> Sequence[Executable]:
    """Return the statements that an event of the stream of expectations means for the table."""
    match event.kind:
        case Expected.kind:
            saved = msgspec.json.decode(event.body, type=Expected)
            fields = {
                "graph": saved.graph,
                "graph_name": saved.graph_name,
                "run": saved.run,
                "at": saved.at,
                "seq": event.seq,
            }
            statement = upsert(expectation).values(name=saved.name, **fields)
            return (statement.on_conflict_do_update(index_elements=["name"], set_=fields),)
        case Retired.kind:
            gone = msgspec.json.decode(event.body, type=Retired)
            return (expectation.delete().where(expectation.c.name == gone.name),)
        case _:
            return ()


def name_of(given: str) -> str:
    """Return the given name of an expectation with single spaces. Raise BadInput unless it has 1 to
    100 characters."""
    name = " ".join(given.split())
    if not 1 <= len(name) <= 100:
        raise BadInput("A name has 1 to 100 characters.", where={"path": "/name"})
    return name


def of_run(
    found: Run,
    umrf: str,
    name: str,
    author: Author,
    now: int,
    subgraphs: tuple[RunSubgraph, ...] = (),
) -> Expected:
    """Return the event that expects the course of a run that is over. `umrf`, `subgraphs`: as they
    were sent; `author`: who expects it; `now`: µs UTC. Raise Conflict if the simulator does not
    take the same course."""
    script = {"behaviours": recorded(found).behaviours}
    graph, inside = codec.read(umrf.encode()).graph, graphs_in(subgraphs)
    course = steps.course(graph, script_from(script), inside=inside)
    check_alike(found, course)
    return Expected(
        at=now,
        name=name,
        author=author,
        run=found.id,
        graph=found.graph,
        graph_name=found.graph_name,
        umrf=umrf,
        script=msgspec.json.encode(script).decode(),
        course=course,
        subgraphs=subgraphs,
        opened=has_opened(found),
    )


def has_opened(run: Run) -> bool:
    """Return whether a run was led with its sub-graphs opened."""
    return any(action.levels for action in run.actions.values())


def of_dry_run(wanted: Expect, name: str, author: Author, now: int) -> Expected:
    """Return the event that expects the course that a graph takes in the simulator. `wanted`: the
    graph and the script; `author`: who expects it; `now`: µs UTC. Raise BadInput, NotUmrf or
    TooLarge if the graph or script cannot be used, or no action runs."""
    if wanted.graph == "":
        raise BadInput("Of which graph?", where={"path": "/graph"})
    text, reading = read_sent(bytes(wanted.umrf))
    try:
        script = script_from(msgspec.json.decode(bytes(wanted.script) or b"{}"))
    except ValueError as wrong:
        raise BadInput(str(wrong), where={"path": "/script"}) from wrong
    subgraphs, inside = read_inside(wanted.subgraphs, "", None, approved=False)
    course = steps.course(reading.graph, script, inside=inside)
    if not any(step.node for step in course):
        raise BadInput("No action runs in it, so nothing can be expected.", where={"path": "/umrf"})
    return Expected(
        at=now,
        name=name,
        author=author,
        run="",
        graph=wanted.graph,
        graph_name=reading.graph.name,
        umrf=text.decode(),
        script=msgspec.json.encode(script_json(script)).decode(),
        course=course,
        subgraphs=subgraphs,
    )


def expectation_view(saved: Expected) -> Expectation:
    """Return a saved expectation as the API shows it."""
    return Expectation(
        name=saved.name,
        run=saved.run,
        graph=saved.graph,
        graph_name=saved.graph_name,
        author=saved.author,
        umrf=msgspec.Raw(saved.umrf.encode()),
        script=msgspec.Raw(saved.script.encode()),
        course=list(saved.course),
        subgraphs=subgraphs_shown(saved.subgraphs),
        opened=saved.opened,
    )


def check_alike(found: Run, course: tuple[ExpectedStep, ...]) -> None:
    """Raise Conflict if the simulated `course` does not repeat the run `found`: an expectation of
    it would fail without any change."""
    simulated: dict[str, list[str]] = {}
    for step in course:
        if step.what == "result":
            own = step.graph == found.graph_name
            name = step.node if own else f"{step.graph}/{step.node}"
            simulated.setdefault(name, []).append(step.how.removeprefix("on_"))
    for name, action in found.actions.items():
        seen = [visit.result for visit in action.visits if visit.result not in {None, "stopped"}]
        simulated_results = [each for each in simulated.get(name, []) if each != "stopped"]
        if len(seen) == len(action.visits) and seen != simulated_results:
            raise Conflict(
                f"The simulator does not repeat this run: {name} ended {', '.join(simulated_results) or 'never'} "
                f"there, and {', '.join(map(str, seen)) or 'never'} in the run. Its arrows may "
                "depend on something that was not recorded.",
                where={"path": "/run", "action": name},
            )
