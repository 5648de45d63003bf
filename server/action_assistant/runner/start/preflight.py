"""The pre-flight: the items that are checked before a start. Pure: answers come in as values.

The page shows the items, a start refuses by the same ones: nobody is told something else than what
then happens.
"""

import os
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.errors import Conflict, Refused
from action_assistant.runner.analysis.course_checks import CheckedCourses
from action_assistant.runner.index_folders.comparison import (
    Differing,
    FileState,
    FolderLook,
    Hindered,
    Lacking,
    There,
    WritableGraph,
    held_against,
    same_to_engine,
)
from action_assistant.runner.index_folders.scan import IndexedFiles, scanned, shown_path
from action_assistant.runner.links.observations import Snapshot, failed_in
from action_assistant.runner.links.port import Answer, Standing
from action_assistant.runner.robots.engine import EngineIndex, foreign_graphs
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sent_graphs import graphs_in
from action_assistant.runner.start.admission import Admitted, Prepared
from action_assistant.runner.start.built_libraries import older_libraries
from action_assistant.safe_text import hold_names
from action_assistant.umrf.check import check, is_final
from action_assistant.umrf.codes import QUIET
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph, Problem

Verdict: TypeAlias = Literal["passed", "warned", "blocked"]

#: Problems that the index of an engine shows.
_OF_INDEX: Final = frozenset(
    {"unknown-action", "signature", "parameter-type", "recursion", "subgraph-twice"}
)
#: Those that no index makes better: the engine refuses the graph whatever a person says.
_REFUSED: Final = frozenset({"recursion", "subgraph-twice"})
_SHOWN: Final = 20
_NAMED: Final = 3  # names in one sentence


class Item(msgspec.Struct, frozen=True, kw_only=True):
    """One thing that was looked at. A person may override a blocked one where `overridable`, with
    the codes in `codes` and a reason. `folder`: where graphs could be written that the robot lacks."""

    code: str
    verdict: Verdict
    text: str
    codes: tuple[str, ...] = ()
    overridable: bool = False
    problems: tuple[Problem, ...] = ()
    folder: FolderLook | None = None

    def __post_init__(self) -> None:
        hold_names(self, "text")


class Preflight(msgspec.Struct, frozen=True):
    """What stands between a graph and its start on one engine. `override`: the codes that a person
    would have to answer for; `never`: something cannot be overridden; `digest`: of the graph that was
    looked at, `tree_digest`: of it together with the graphs inside."""

    engine: str
    digest: str
    tree_digest: str
    items: tuple[Item, ...]
    override: tuple[str, ...]
    never: bool


class Settled(msgspec.Struct, frozen=True):
    """A run of ours that somebody has seen at rest: the actions that were in ERROR then, by running name
    of their graph and full name, in this life of the engine."""

    engine: str
    run: str
    incarnation: str
    places: frozenset[tuple[str, str]]


class EngineView(msgspec.Struct, frozen=True, kw_only=True):
    """An engine at the moment of a pre-flight. `took_ms`: until it answered a get sent for it;
    `open_runs`: runs of ours that go on there; `settled`: those that somebody has seen at rest;
    `index_folder`: what it indexes, where the runner may write there."""

    name: str
    facts: EngineFacts
    standing: Standing
    answer: Answer
    index: EngineIndex
    took_ms: float
    open_runs: Collection[str] = ()
    settled: tuple[Settled, ...] = ()
    index_folder: Path | None = None


def with_verdict(engine: str, items: Sequence[Item], digest: str = "", tree: str = "") -> Preflight:
    """The items of one engine with what follows from them."""
    blocked = [item for item in items if item.verdict == "blocked"]
    codes = sorted({code for item in blocked if item.overridable for code in item.codes})
    never = any(not item.overridable for item in blocked)
    return Preflight(engine, digest, tree, tuple(items), tuple(codes), never)


def with_items(look: Preflight, more: Sequence[Item]) -> Preflight:
    """The same with items that stand in nobody's way."""
    return msgspec.structs.replace(look, items=(*look.items, *more))


def refusal_item(code: str, refused: Refused) -> Item:
    """A refusal as an item. Problems that a person may answer for stay so."""
    where = refused.where or {}
    found = where.get("problems")
    problems = msgspec.convert(found, tuple[Problem, ...]) if isinstance(found, list) else ()
    codes = tuple(sorted({problem.code for problem in problems}))
    return Item(
        code=code,
        verdict="blocked",
        text=refused.detail,
        codes=codes,
        overridable=bool(codes) and not any(map(is_final, problems)),
        problems=problems,
    )


def graph_item(admitted: Admitted | Prepared) -> Item:
    """The graph has been admitted; what warns does not stand in the way."""
    warned = tuple(each for each in admitted.problems if each.severity == "warning")[:_SHOWN]
    over = tuple(each for each in admitted.problems if each.severity == "error")[:_SHOWN]
    if over:
        text = f"{len(over)} certain problems are overridden."
        return Item(code="graph", verdict="warned", text=text, problems=(*over, *warned))
    loud = sum(each.code not in QUIET for each in warned)
    if loud:
        text = f"No certain hazard; {_count(loud, 'possible one')}."
        return Item(code="graph", verdict="warned", text=text, problems=warned)
    if warned:
        text = "No hazard is known but that of every bypass on this engine."
        return Item(code="graph", verdict="passed", text=text, problems=warned)
    return Item(code="graph", verdict="passed", text="No hazard is known.")


def free_item(
    engine: str,
    other: Run | None,
    graph_name: str = "",
    longest_loading_ms: int = 0,
    now_us: int = 0,
) -> Item:
    """Return the item for a run that goes on there; there is one run per robot. One of which only may be
    that an action still loads can be answered for once the time has passed that a person has set, by a
    start of another name: the Stop of that run goes on. `graph_name`: of the graph that is to start;
    `longest_loading_ms`: the time that was set, 0 for none."""
    if other is None:
        return Item(code="free", verdict="passed", text=f"{engine} has no other run from here.")
    text = (
        f"{engine} is taken by run {other.number} of {other.graph_name}, started by "
        f"{other.author.name or 'somebody'}; it is {other.state}."
    )
    if doubt := other.lost or other.doubt:
        text += f" {doubt.rstrip('.')}. Somebody has to see it at rest and confirm that in the run."
    if not _is_only_loading(other) or not longest_loading_ms:
        return Item(code="free", verdict="blocked", text=text)
    waited_s = (now_us - (other.loading_since or now_us)) / 1e6
    usual_s = longest_loading_ms / 1e3
    text += (
        f" It has loaded for {waited_s:.0f} s; {usual_s:g} s at most is what was set for {engine}."
    )
    if waited_s <= usual_s or graph_name == other.graph_name:
        if graph_name == other.graph_name:
            text += " A graph of another name could be started then; its Stop would hit this one."
        return Item(code="free", verdict="blocked", text=text)
    return Item(code="free", verdict="blocked", text=text, codes=("loading",), overridable=True)


def _is_only_loading(run: Run) -> bool:
    """Return whether nothing of a run moves, as far as answers show, but an action that may load."""
    is_known = run.unknown_since is None and not run.lost and not run.unconfirmed
    return bool(run.loading) and is_known and not run.active


def answer_item(view: EngineView) -> Item:
    """It has answered a get sent now."""
    return Item(
        code="answers",
        verdict="passed",
        text=f"{view.name} answered after {max(1, round(view.took_ms))} ms.",
    )


def silence_item(engine: str, why: str) -> Item:
    """It has not."""
    text = f"{engine} does not answer, so a stop could not be confirmed either. Nothing was sent. {why}"
    return Item(code="answers", verdict="blocked", text=text.rstrip())


def robot_items(view: EngineView, graph: Graph) -> tuple[Item, ...]:
    """All that an answering robot is looked at for."""
    return (
        answer_item(view),
        _proof(view),
        _actions(view, graph),
        _again(view, graph),
        _quiet(view, graph),
        _rest(view),
        _others(view),
        _actors(view, graph),
    )


def require_clear(items: Sequence[Item], overridden: Collection[str]) -> None:
    """Refuse a start that an item stands in the way of. Raises Conflict."""
    for item in items:
        if not is_blocking(item, overridden):
            continue
        rule = " A person may override this with a reason." if item.overridable else ""
        raise Conflict(
            f"{item.text}{rule}",
            where={"path": "/engine", "item": item.code, "items": msgspec.to_builtins(list(items))},
        )


def is_blocking(item: Item, overridden: Collection[str]) -> bool:
    """Return whether an item blocks a start that somebody answers for with these codes."""
    is_answered = item.overridable and set(item.codes) <= set(overridden)
    return item.verdict == "blocked" and not is_answered


def _proof(view: EngineView) -> Item:
    """A stop can be proven, and the messages are those that we speak."""
    standing, name = view.standing, view.name
    if standing.generation == "older":
        text = (
            f"{name} speaks an older generation of temoto_msgs: it would not understand a Stop. "
            "Update its engine."
        )
        return Item(code="proof", verdict="blocked", text=text)
    deaf = [each for each in ("start", "stop") if standing.listeners.get(each) == 0]
    if deaf:
        text = f"Nobody listens to {' and '.join(deaf)} messages for {name}: nothing would arrive."
        return Item(code="proof", verdict="blocked", text=text)
    if standing.servers != 1:
        text = (
            f"{standing.servers} engines answer on the path of {name}"
            if standing.servers
            else f"Discovery shows nobody who serves the path of {name}"
        )
        text += ", so no answer would prove a stop. Give each engine a domain of its own."
        return Item(code="proof", verdict="blocked", text=text, codes=("proof",), overridable=True)
    if standing.doubt:
        text = f"For {name}, {standing.doubt}: no answer would prove a stop. Wait, or end it."
        return Item(code="proof", verdict="blocked", text=text, codes=("proof",), overridable=True)
    if standing.generation == "unknown":
        text = (
            f"One engine answers for {name}; which generation of messages it speaks is not known."
        )
        return Item(code="proof", verdict="warned", text=text)
    return Item(code="proof", verdict="passed", text="A stop can be proven: one engine answers.")


def _actions(view: EngineView, graph: Graph) -> Item:
    """It has the actions, with the same parameters."""
    index = view.index
    if graph.name in index.graphs:
        text = (
            f"{view.name} has a graph called {graph.name} in its own index and so refuses another "
            "one of that name. Rename this one."
        )
        return Item(code="actions", verdict="blocked", text=text)
    if not index.actions and not index.graphs:
        text = f"{view.name} names no actions, so whether it knows these cannot be said."
        return Item(code="actions", verdict="warned", text=text)
    own = {action.key for action in graph.actions if action.actor in {"", view.name}}
    problems = tuple(
        each
        for each in check(graph, index.actions, view.facts, index.graphs)
        if each.code in _OF_INDEX and (each.where.aid is None or each.where.aid in own)
    )
    if not problems:
        text = f"{view.name} knows all {_count(len(own), 'action')}, with the same parameters."
        return Item(code="actions", verdict="passed", text=text)
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    codes = {each.code for each in problems}
    return Item(
        code="actions",
        verdict="blocked",
        text=f"{view.name} would refuse the graph: {problems[0].message}{more}",
        codes=tuple(sorted(codes)),
        overridable=not codes & _REFUSED,
        problems=problems[:_SHOWN],
    )


def _again(view: EngineView, graph: Graph) -> Item:
    """The engine does not hold a graph of this name already, or survives that it is started again.

    Whoever started that one, and however it ended: the name is held until the engine is restarted.
    """
    held = {each.graph for each in view.answer.graphs}
    if graph.name not in held:
        text = f"{view.name} holds no graph called {graph.name} from an earlier start."
        return Item(code="again", verdict="passed", text=text)
    lost = not_matched(graph, view.facts, view.index, held)
    if not lost:
        text = f"{view.name} can start {graph.name} again: nothing in it has to be looked up."
        return Item(code="again", verdict="passed", text=text)
    text = (
        f"{view.name} holds a graph called {graph.name} from an earlier start. Its engine does not "
        f"look up {_listed(lost)} when a name is started again: it aborts with every running graph, or "
        "does nothing. Restart the engine, or give the graph another name."
    )
    return Item(code="again", verdict="blocked", text=text)


def not_matched(
    graph: Graph, facts: EngineFacts, index: EngineIndex, held: Collection[str]
) -> tuple[str, ...]:
    """The full names of what an engine cannot build when it takes a graph without looking anything up
    in its index (a start of a name that it holds, a modify): sub-graphs, and what it does not know.
    Of one that names nothing, those sub-graphs that it `held`. Empty where it looks them up."""
    if facts.restart_matches:
        return ()
    silent = not index.actions and not index.graphs
    return tuple(
        action.full_name
        for action in graph.actions
        if not action.missing
        and (
            f"{graph.name}__{action.name}__{action.instance_id}" in held
            if silent
            else action.name not in index.actions
        )
    )


def not_matched_in(
    umrf: str, facts: EngineFacts, index: EngineIndex, held: Collection[str]
) -> tuple[str, ...]:
    """As `not_matched`, of a graph as it will be sent. For workers."""
    return not_matched(codec.read(umrf).graph, facts, index, held)


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:3])
    return shown if len(names) <= 3 else f"{shown} and {len(names) - 3} more"


def _quiet(view: EngineView, graph: Graph) -> Item:
    """Nothing of somebody else runs there."""
    moving = foreign_graphs(view.answer, view.open_runs)
    if graph.name in moving:
        text = (
            f"A graph called {graph.name} runs on {view.name} already, started by somebody else: "
            "the engine would refuse this one and stop that one. Stop it first."
        )
        return Item(code="quiet", verdict="blocked", text=text)
    if moving:
        names = ", ".join(moving[:3])
        text = f"{view.name} runs {names}, which nobody started from here."
        return Item(code="quiet", verdict="blocked", text=text, codes=("quiet",), overridable=True)
    return Item(code="quiet", verdict="passed", text=f"Nothing else runs on {view.name}.")


def _rest(view: EngineView) -> Item:
    """Nothing there may still move that its engine calls ERROR. Runs of ours stand in the way as runs,
    until somebody has seen them at rest."""
    doubted = sorted(
        each.graph
        for each in view.answer.graphs
        if (each.state == "ERROR" or each.stoppable)
        and each.run not in view.open_runs
        and not _is_settled(view, each)
    )
    if not doubted:
        text = f"No action on {view.name} is known to have been given up by its engine."
        return Item(code="rest", verdict="passed", text=text)
    text = (
        f"{', '.join(doubted[:3])} on {view.name} did not obey a stop, or failed while it was told to: "
        "the engine says ERROR, but the code may still run. Look at the robot; restart its engine."
    )
    return Item(code="rest", verdict="blocked", text=text, codes=("rest",), overridable=True)


def _is_settled(view: EngineView, shown: Snapshot) -> bool:
    """Whether somebody has seen at rest just what is in doubt here: the graph of that run or a part of
    it, in the same life of the engine, with no other action in ERROR."""
    marks = {each.graph: each.run for each in view.answer.graphs if each.run is not None}
    for each in view.settled:
        top = next((name for name, run in marks.items() if run == each.run), None)
        is_part = top is not None and f"{shown.graph}__".startswith(f"{top}__")
        places = {(shown.graph, node) for node in failed_in(shown) or [shown.graph]}
        if is_part and each.incarnation == view.answer.incarnation and places <= each.places:
            return True
    return False


def _others(view: EngineView) -> Item:
    """Nobody else publishes starts."""
    others = view.standing.others
    if others == 0:
        return Item(code="others", verdict="passed", text="Nobody else can start something there.")
    who = _count(others, "other program")
    text = f"{who} can publish starts to {view.name}: what runs there may change at any moment."
    return Item(code="others", verdict="blocked", text=text, codes=("others",), overridable=True)


def _actors(view: EngineView, graph: Graph) -> Item:
    """The actions are this robot's, or the engines synchronise."""
    named = {action.actor for action in graph.actions if not action.missing} - {""}
    foreign = sorted(named - {view.name, view.standing.actor})
    if not foreign or view.facts.synchronises:
        return Item(code="actors", verdict="passed", text=f"The actions are {view.name}'s to do.")
    text = (
        f"Actions belong to {', '.join(foreign)}, not to {view.name}, and its engine cannot "
        "synchronise with others: it refuses the graph."
    )
    return Item(code="actors", verdict="blocked", text=text, codes=("actors",), overridable=True)


def subgraph_items(view: EngineView, pinned: Mapping[str, Graph]) -> tuple[Item, ...]:
    """Whether it has indexed the graphs that were sent along; nothing where there are none. Pure."""
    if not pinned:
        return ()
    index = view.index
    if not index.actions and not index.graphs:
        text = (
            f"{view.name} names no graphs, so whether it runs {_listed(sorted(pinned))} as this version "
            "has it cannot be said."
        )
        return (Item(code="subgraphs", verdict="warned", text=text),)
    lacking, other = differing_subgraphs(view, pinned)
    if not lacking and not other:
        text = f"{view.name} has indexed {_listed(sorted(pinned))} as this version has it."
        return (Item(code="subgraphs", verdict="passed", text=text),)
    told: list[str] = []
    if lacking:
        told.append(f"{view.name} has not indexed {_listed(lacking)}, and so refuses the graph.")
    if other:
        told.append(
            f"{view.name} has indexed {_listed(other)} otherwise than this version has it, and would "
            "run what it has."
        )
    codes = (*(["subgraph-differs"] if other else []), *(["unknown-action"] if lacking else []))
    item = Item(
        code="subgraphs", verdict="blocked", text=" ".join(told), codes=codes, overridable=True
    )
    return (item,)


def differing_subgraphs(
    view: EngineView, pinned: Mapping[str, Graph]
) -> tuple[list[str], list[str]]:
    """The names of graphs that the engine has not indexed, and of those that it has otherwise."""
    index = view.index
    lacking = [each for each in sorted(pinned) if not _is_known(each, index)]
    other = [
        name
        for name, graph in sorted(pinned.items())
        if _is_known(name, index) and not _is_same(name, graph, index, view.facts)
    ]
    return lacking, other


def folder_state(
    graph: Graph, files: IndexedFiles, index: EngineIndex, facts: EngineFacts
) -> FileState:
    """How a graph is in the folder of an engine that has named this index."""
    return held_against(graph, files, facts, actions=index.actions, graphs=index.graphs)


def _is_known(name: str, index: EngineIndex) -> bool:
    return name in index.graphs or name in index.actions


def _is_same(name: str, graph: Graph, index: EngineIndex, facts: EngineFacts) -> bool:
    """Whether the engine would run just this; an action of that name comes before a graph."""
    if name in index.actions:
        return False
    return same_to_engine(graph, index.graphs[name], facts)


def engine_items(view: EngineView, ready: Prepared, prefixes: Sequence[Path]) -> tuple[Item, ...]:
    """Every item of this start. `prefixes`: of the workspace that is sourced here."""
    graph, pinned = codec.read(ready.umrf).graph, graphs_in(ready.subgraphs)
    return (
        *robot_items(view, graph),
        *_built(view, graph, prefixes),
        *(_with_folder(each, view, pinned) for each in subgraph_items(view, pinned)),
    )


def _built(view: EngineView, graph: Graph, prefixes: Sequence[Path]) -> tuple[Item, ...]:
    """No library of its actions is older than its source, as far as this computer has the workspace."""
    older = older_libraries(graph, prefixes)
    if not older:
        return ()
    first = older[0]
    more = f" (and {len(older) - 1} more)" if len(older) > 1 else ""
    text = (
        f"{first.library.name} in the workspace that is sourced here is older than "
        f"{first.source.name}{more}: {view.name} would run {first.action} as it was before. Call "
        "`colcon build` and restart its engine."
    )
    codes = ("older-library",)
    return (Item(code="built", verdict="blocked", text=text, codes=codes, overridable=True),)


def _with_folder(item: Item, view: EngineView, pinned: Mapping[str, Graph]) -> Item:
    """The item with what could be done about it where the runner has the folder itself."""
    if item.verdict != "blocked" or view.index_folder is None:
        return item
    folder = view.index_folder
    lacking, other = differing_subgraphs(view, pinned)
    files = scanned(folder, pinned.keys())
    writable: list[WritableGraph] = []
    waiting: list[str] = []
    hindered: dict[str, str] = {}
    for name in sorted(pinned):  # all of them are written or none
        match folder_state(pinned[name], files, view.index, view.facts):
            case There():
                waiting += [name] if name in lacking or name in other else []
            case Lacking():
                writable.append(WritableGraph(name))
            case Differing(file):
                writable.append(WritableGraph(name, file.shown))
            case Hindered(why):
                hindered[name] = why
    if writable and not os.access(folder, os.W_OK | os.X_OK):
        why = f"The runner may not write into {shown_path(str(folder))}."
        hindered |= {each.graph: why for each in writable}
        writable = []
    look = FolderLook(
        path=shown_path(str(folder)),
        writable=tuple(writable),
        waiting=tuple(waiting),
        hindered=hindered,
    )
    return msgspec.structs.replace(item, folder=look)


def course_items(found: CheckedCourses) -> tuple[Item, ...]:
    """Whether the graph goes as it is expected to; nothing where nothing is expected."""
    courses = found.courses
    if not courses:
        return ()
    other = [each for each in courses if each.same is False]
    unknown = sum(each.same is None for each in courses)
    if not other and not unknown:
        text = f"It goes as expected: {_count(len(courses), 'expected course')}."
        return (Item(code="courses", verdict="passed", text=text),)
    told = [f"{each.name}: {each.why}" for each in other[:_NAMED]]
    if len(other) > _NAMED:
        told.append(f"{len(other) - _NAMED} more go another way.")
    if unknown:
        told.append(f"{_count(unknown, 'expected course')} could not be looked at in time.")
    if other:
        of = _count(len(courses), "expected course")
        told.insert(0, f"It does not go as expected, in {len(other)} of {of}.")
    return (Item(code="courses", verdict="warned", text=" ".join(told)),)


def unknown_courses_item(why: str) -> Item:
    """Whether it goes as expected is not known."""
    text = f"Whether it goes as expected is not known. {why}"
    return Item(code="courses", verdict="warned", text=text)


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
