"""The pre-flight: the items that are checked before a start. A start is refused by the same items
that the page shows.

Answers of engines come in as values. `engine_items` also reads this computer's disk, and runs in a
worker.
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
    Hindered,
    IndexFolderState,
    Lacking,
    Present,
    WritableGraph,
    file_state,
    same_to_engine,
)
from action_assistant.runner.index_folders.scan import IndexedFiles, scanned, shown_path
from action_assistant.runner.links.observations import Snapshot, failed_in
from action_assistant.runner.links.port import Answer, Standing
from action_assistant.runner.robots.engine import EngineIndex, foreign_graphs
from action_assistant.runner.runs.earlier_views import EarlierShown
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sent_graphs import graphs_in
from action_assistant.runner.start.admission import Admitted, Prepared
from action_assistant.runner.start.built_libraries import older_libraries
from action_assistant.runner.start.orders import OrderLine
from action_assistant.runner.start.robot_graphs import not_matched, unseen_graphs
from action_assistant.safe_text import hold_names
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.check import check, forbids_start, is_final
from action_assistant.umrf.codes import QUIET
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.files import codec
from action_assistant.umrf.kept_values import KEEPER_PACKAGE, has_keeper
from action_assistant.umrf.model import Graph, Problem
from action_assistant.umrf.pieces import Obstacle

Verdict: TypeAlias = Literal["passed", "warned", "blocked"]

#: Codes of problems that the index of an engine shows.
_INDEX_CODES: Final = frozenset(
    {"unknown-action", "signature", "parameter-type", "recursion", "subgraph-twice"}
)
#: Codes that cannot be overridden: the engine refuses such a graph in any case.
_NEVER_TAKEN: Final = frozenset({"recursion", "subgraph-twice"})
SHOWN: Final = 20  # problems of one item
_NAMED: Final = 3  # names in one sentence


class Item(msgspec.Struct, frozen=True, kw_only=True):
    """One item of a pre-flight. A person may override a blocked one where `overridable`, with the
    codes in `codes` and a reason. `folder`: where graphs that the robot lacks could be written."""

    code: str
    verdict: Verdict
    text: str
    codes: tuple[str, ...] = ()
    overridable: bool = False
    problems: tuple[Problem, ...] = ()
    folder: IndexFolderState | None = None

    def __post_init__(self) -> None:
        hold_names(self, "text")


class Preflight(msgspec.Struct, frozen=True):
    """The pre-flight of a graph on one engine. `override`: the codes that a person would have to
    answer for; `never`: some item cannot be overridden; `digest`: of the graph that was checked,
    `tree_digest`: of it together with the graphs inside; `order_digest`: of all that a second person
    says yes to, "" where nobody has to, and `order` that in words; `earlier`: what the start takes for
    granted, on the first engine of it, null if it begins at the entry."""

    engine: str
    digest: str
    tree_digest: str
    items: tuple[Item, ...]
    override: tuple[str, ...]
    never: bool
    order_digest: str = ""
    earlier: EarlierShown | None = None
    order: tuple[OrderLine, ...] = ()


class Settled(msgspec.Struct, frozen=True):
    """A run of this runner that is known to be at rest: a person saw it, or its code was seen to end.

    `places` holds the actions that were in ERROR then, by running name of their graph and full name.
    `incarnation` names the life of the engine.
    """

    engine: str
    run: str
    incarnation: str
    places: frozenset[tuple[str, str]]


class EngineView(msgspec.Struct, frozen=True, kw_only=True):
    """An engine at the moment of a pre-flight. `took_ms`: milliseconds until it answered a get sent
    for it; `open_runs`: ids of this runner's runs that have no end yet; `settled`: runs that are
    known to be at rest; `index_folder`: the folder that it indexes, where the runner may write
    there; `names_graphs`: items may name graphs and actions of others, which they do where no graph has
    a rule."""

    name: str
    facts: EngineFacts
    standing: Standing
    answer: Answer
    index: EngineIndex
    took_ms: float
    open_runs: Collection[str] = ()
    settled: tuple[Settled, ...] = ()
    index_folder: Path | None = None
    names_graphs: bool = True


def with_verdict(engine: str, items: Sequence[Item], digest: str = "", tree: str = "") -> Preflight:
    """Return the items of one engine with the codes to override, and whether one cannot be
    overridden."""
    blocked = [item for item in items if item.verdict == "blocked"]
    codes = sorted({code for item in blocked if item.overridable for code in item.codes})
    never = any(not item.overridable for item in blocked)
    return Preflight(engine, digest, tree, tuple(items), tuple(codes), never)


def with_items(look: Preflight, warnings: Sequence[Item]) -> Preflight:
    """Return a pre-flight with more items, which only warn."""
    return msgspec.structs.replace(look, items=(*look.items, *warnings))


def with_approval(look: Preflight, approval: Item) -> Preflight:
    """Return a pre-flight with the item about the yes of a second person."""
    never = look.never or approval.verdict == "blocked"
    return msgspec.structs.replace(look, items=(*look.items, approval), never=never)


def refusal_item(code: str, refused: Refused) -> Item:
    """Return a refusal as an item. Its problems may be overridden as they could be elsewhere."""
    where = refused.where or {}
    listed = where.get("problems")
    problems = msgspec.convert(listed, tuple[Problem, ...]) if isinstance(listed, list) else ()
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
    """Return the item of the preflight list for the graph itself: passed, or warned if it has loud
    warnings or problems that were overridden. The graph was admitted, so the item is never a
    refusal."""
    overridden = tuple(filter(forbids_start, admitted.problems))[:SHOWN]
    warned = tuple(each for each in admitted.problems if not forbids_start(each))[:SHOWN]
    if overridden:
        text = f"{len(overridden)} certain problems are overridden."
        return Item(code="graph", verdict="warned", text=text, problems=(*overridden, *warned))
    loud = sum(each.code not in QUIET for each in warned)
    if loud:
        text = f"No certain hazard; {counted(loud, 'possible one')}."
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
    *,
    names_graphs: bool = True,
) -> Item:
    """Return the item for another run on the engine: an engine has one run at a time.

    A run of which at most an action is still loading can be overridden, after the longest loading
    time that a person has set for the robot (`longest_loading_ms`, 0 for none), by a start of a
    graph of another name: the Stop of that run goes on. `graph_name` is that of the graph to start;
    `now_us` is microseconds UTC; `names_graphs`: as of `EngineView`.
    """
    if other is None:
        return Item(code="free", verdict="passed", text=f"{engine} has no other run from here.")
    of = f" of {other.graph_name}" if names_graphs else ""
    text = (
        f"{engine} is taken by run {other.number}{of}, started by "
        f"{other.author.name or 'somebody'}; it is {other.state}."
    )
    if doubt := other.lost or other.doubt:
        text += f" {doubt.rstrip('.')}." if names_graphs else ""
        text += " Somebody has to see it at rest and confirm that in the run."
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
    """Return whether nothing of a run moves, as far as answers show, except an action that may be
    loading."""
    is_known = run.unknown_since is None and not run.lost and not run.unconfirmed
    return bool(run.loading) and is_known and not run.active


def answer_item(view: EngineView) -> Item:
    """Return the item for an engine that has answered a get."""
    return Item(
        code="answers",
        verdict="passed",
        text=f"{view.name} answered after {max(1, round(view.took_ms))} ms.",
    )


def silence_item(engine: str, why: str) -> Item:
    """Return the item for an engine that has not answered, with the reason `why`."""
    text = f"{engine} does not answer, so a stop could not be confirmed either. Nothing was sent. {why}"
    return Item(code="answers", verdict="blocked", text=text.rstrip())


def robot_items(view: EngineView, graph: Graph, inside: Collection[Graph] = ()) -> tuple[Item, ...]:
    """Return the items for a robot that has answered, as far as its answer and its standing decide
    them. `inside`: the sub-graphs."""
    return (
        answer_item(view),
        _proof(view),
        _actions(view, graph),
        _again(view, graph),
        _quiet(view, graph),
        _rest(view),
        _others(view),
        _actors(view, graph, inside),
    )


def require_clear(items: Sequence[Item], overridden: Collection[str]) -> None:
    """Refuse a start that an item blocks and that does not override it. Raise Conflict with the
    reasons."""
    for item in items:
        if not is_blocking(item, overridden):
            continue
        rule = " A person may override this with a reason." if item.overridable else ""
        raise Conflict(
            f"{item.text}{rule}",
            where={"path": "/engine", "item": item.code, "items": msgspec.to_builtins(list(items))},
        )


def is_blocking(item: Item, overridden: Collection[str]) -> bool:
    """Return whether an item blocks a start that overrides these codes."""
    is_answered = item.overridable and set(item.codes) <= set(overridden)
    return item.verdict == "blocked" and not is_answered


def _proof(view: EngineView) -> Item:
    """Check that one engine answers, hears commands, and speaks this generation of messages: a Stop
    can be proven."""
    standing, name = view.standing, view.name
    if standing.ids_unknown:
        text = f"For {name}, {standing.doubt}: no answer would prove a stop. See `doctor`."
        return Item(code="proof", verdict="blocked", text=text)
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
    """Check that the engine has indexed the actions of the graph, with the same parameters."""
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
        if each.code in _INDEX_CODES and (each.where.aid is None or each.where.aid in own)
    )
    if not problems:
        text = f"{view.name} knows all {counted(len(own), 'action')}, with the same parameters."
        return Item(code="actions", verdict="passed", text=text)
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    codes = {each.code for each in problems}
    return Item(
        code="actions",
        verdict="blocked",
        text=f"{view.name} would refuse the graph: {problems[0].message}{more}",
        codes=tuple(sorted(codes)),
        overridable=not codes & _NEVER_TAKEN,
        problems=problems[:SHOWN],
    )


def _again(view: EngineView, graph: Graph) -> Item:
    """Check that the engine does not hold a graph of this name, or can start it again.

    An engine holds a name until it is restarted, whoever started the graph and however it ended.
    """
    held = {each.graph for each in view.answer.graphs}
    if graph.name not in held:
        text = f"{view.name} holds no graph called {graph.name} from an earlier start."
        return Item(code="again", verdict="passed", text=text)
    unmatched = not_matched(graph, view.facts, view.index, held)
    if not unmatched:
        text = f"{view.name} can start {graph.name} again: nothing in it has to be looked up."
        return Item(code="again", verdict="passed", text=text)
    text = (
        f"{view.name} holds a graph called {graph.name} from an earlier start. Its engine does not "
        f"look up {_listed(unmatched)} when a name is started again: it aborts with every running graph, or "
        "does nothing. Restart the engine, or give the graph another name."
    )
    return Item(code="again", verdict="blocked", text=text)


def _listed(names: Sequence[str]) -> str:
    first = ", ".join(names[:_NAMED])
    return first if len(names) <= _NAMED else f"{first} and {len(names) - _NAMED} more"


def _quiet(view: EngineView, graph: Graph) -> Item:
    """Check that no graph of somebody else runs on the engine."""
    moving = foreign_graphs(view.answer, view.open_runs)
    if graph.name in moving:
        text = (
            f"A graph called {graph.name} runs on {view.name} already, started by somebody else: "
            "the engine would refuse this one and stop that one. Stop it first."
        )
        return Item(code="quiet", verdict="blocked", text=text)
    if moving:
        names = ", ".join(moving[:3]) if view.names_graphs else "a graph"
        text = f"{view.name} runs {names}, which nobody started from here."
        return Item(code="quiet", verdict="blocked", text=text, codes=("quiet",), overridable=True)
    text = f"Nothing runs on {view.name} that was started elsewhere."
    return Item(code="quiet", verdict="passed", text=text)


def _rest(view: EngineView) -> Item:
    """Check that no graph on the engine may still move although the engine calls it ERROR. Open
    runs of this runner are left out: they block as runs. So are runs that a person has seen at
    rest."""
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
        f"{', '.join(doubted[:3]) if view.names_graphs else 'A graph'} on {view.name} did not obey a stop, or failed while it was told to: "
        "the engine says ERROR, but the code may still run. Look at the robot; restart its engine."
    )
    return Item(code="rest", verdict="blocked", text=text, codes=("rest",), overridable=True)


def _is_settled(view: EngineView, shown: Snapshot) -> bool:
    """Return whether the graph `shown` is already known to be at rest.

    That is known of a run, by a person's word or by the end of its code. It counts if `shown` is the graph of that run or one of
    its sub-graphs, if the engine was not restarted since, and if every action of `shown` in ERROR
    was in ERROR at that time.
    """
    marks = {each.graph: each.run for each in view.answer.graphs if each.run is not None}
    for each in view.settled:
        top = next((name for name, run in marks.items() if run == each.run), None)
        is_part = top is not None and f"{shown.graph}__".startswith(f"{top}__")
        places = {(shown.graph, node) for node in failed_in(shown) or [shown.graph]}
        if is_part and each.incarnation == view.answer.incarnation and places <= each.places:
            return True
    return False


def _others(view: EngineView) -> Item:
    """Check that nobody else publishes start messages to the engine."""
    others = view.standing.others
    if others == 0:
        return Item(code="others", verdict="passed", text="Nobody else can start something there.")
    who = counted(others, "other program")
    text = f"{who} can publish starts to {view.name}: what runs there may change at any moment."
    return Item(code="others", verdict="blocked", text=text, codes=("others",), overridable=True)


def _actors(view: EngineView, graph: Graph, inside: Collection[Graph]) -> Item:
    """Check that all actions belong to this robot, or that its engine synchronises with others."""
    own = {"", view.name, view.standing.actor}
    named = {each: _named_in(each) - own for each in (graph, *inside)}
    foreign = sorted(frozenset[str]().union(*named.values()))
    if not foreign or view.facts.synchronises:
        return Item(code="actors", verdict="passed", text=f"The actions are {view.name}'s to do.")
    where = sorted(each.name for each, actors in named.items() if actors)
    is_inside = graph.name not in where
    text = (
        f"Actions {f'inside of {_listed(where)} ' if is_inside else ''}belong to {', '.join(foreign)}, "
        f"not to {view.name}, and its engine cannot synchronise with others: it refuses the graph. "
    )
    text += (
        "Name no actor inside, or flatten the graph."
        if is_inside
        else "The runner can lead several robots through it."
    )
    return Item(code="actors", verdict="blocked", text=text, codes=("actors",), overridable=True)


def _named_in(graph: Graph) -> frozenset[str]:
    return frozenset(each.actor for each in graph.actions if not each.missing)


def subgraph_items(
    view: EngineView, pinned: Mapping[str, Graph], *, limited: bool = False
) -> tuple[Item, ...]:
    """Return the item about the graphs inside: an engine runs what it has indexed under a name,
    whatever was sent (docs/umrf-and-the-engine.md 2.6). Empty where there are no graphs inside.
    `limited`: the robot has limits, to which only what was sent can be held."""
    if not pinned:
        return ()
    index = view.index
    if not index.actions and not index.graphs:
        text = (
            f"{view.name} names no graphs, so whether it runs {_listed(sorted(pinned))} as this version "
            "has it cannot be said."
        )
        if limited:
            text += f" Its values cannot be held to the limits of {view.name}."
            return (Item(code="subgraphs", verdict="blocked", text=text),)
        return (Item(code="subgraphs", verdict="warned", text=text),)
    lacking, other = differing_subgraphs(view, pinned)
    if not lacking and not other:
        text = f"{view.name} has indexed {_listed(sorted(pinned))} as this version has it."
        return (Item(code="subgraphs", verdict="passed", text=text),)
    sentences: list[str] = []
    if lacking:
        sentences.append(
            f"{view.name} has not indexed {_listed(lacking)}, and so refuses the graph."
        )
    if other:
        sentences.append(
            f"{view.name} has indexed {_listed(other)} otherwise than this version has it, and would "
            "run what it has."
        )
    if other and limited:
        sentences.append(f"Its values cannot be held to the limits of {view.name}.")
        return (Item(code="subgraphs", verdict="blocked", text=" ".join(sentences)),)
    codes = (*(["subgraph-differs"] if other else []), *(["unknown-action"] if lacking else []))
    item = Item(
        code="subgraphs", verdict="blocked", text=" ".join(sentences), codes=codes, overridable=True
    )
    return (item,)


def differing_subgraphs(
    view: EngineView, pinned: Mapping[str, Graph]
) -> tuple[list[str], list[str]]:
    """Return the names of graphs that the engine has not indexed, and of those that it has indexed
    with other contents."""
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
    """Return the state of a graph's file in the folder of an engine with this index."""
    return file_state(graph, files, facts, actions=index.actions, graphs=index.graphs)


def _is_known(name: str, index: EngineIndex) -> bool:
    return name in index.graphs or name in index.actions


def _is_same(name: str, graph: Graph, index: EngineIndex, facts: EngineFacts) -> bool:
    """Return whether the engine would run exactly this graph; it takes an action of that name
    before a graph."""
    if name in index.actions:
        return False
    return same_to_engine(graph, index.graphs[name], facts)


def engine_items(view: EngineView, ready: Prepared, prefixes: Sequence[Path]) -> tuple[Item, ...]:
    """Return all items for a robot that has answered, also those that need this computer's disk.
    `prefixes`: those of the workspace that is sourced here. For workers."""
    graph, pinned = codec.read(ready.umrf).graph, graphs_in(ready.subgraphs)
    return (
        *robot_items(view, graph, pinned.values()),
        *_library_items(view, graph, prefixes),
        *_value_items(view, ready.handing),
        *(
            _with_folder(each, view, pinned)
            for each in subgraph_items(view, pinned, limited=view.name in ready.limits)
        ),
        *(
            _graphs_in_places_of_actions(view, graph, pinned)
            if ready.is_led or view.name in ready.limits
            else ()
        ),
    )


def _graphs_in_places_of_actions(
    view: EngineView, graph: Graph, pinned: Mapping[str, Graph]
) -> tuple[Item, ...]:
    """Return the item about actions that are graphs in the index of the engine and none in this
    version; () if there are no such actions. Their pieces would have the same name at each visit,
    and an engine aborts when it starts a name with a sub-graph again
    (docs/decisions/026-names-that-are-held.md)."""
    taken = sorted(unseen_graphs(graph, view.index) - pinned.keys())
    if not taken:
        return ()
    text = (
        f"{view.name} has indexed {_listed(taken)} as a graph, and this version has no graph of that "
        "name inside: the robot would run what nobody has seen here. Import that graph, or rename "
        "the action."
    )
    return (Item(code="subgraphs", verdict="blocked", text=text),)


def _value_items(view: EngineView, handing: Sequence[Obstacle]) -> tuple[Item, ...]:
    """Return the item about values that steps of a led run on this robot hand to others: they
    can be read there only with the helper package. Empty without such values, or with the package."""
    if not handing or has_keeper(view.index.actions):
        return ()
    more = f" (and {len(handing) - 1} more)" if len(handing) > 1 else ""
    text = (
        f"{handing[0].text}{more}. A value can be read from {view.name} only with the package "
        f"{KEEPER_PACKAGE}: download it, build it there, and restart its engine."
    )
    return (Item(code="values", verdict="blocked", text=text),)


def _library_items(view: EngineView, graph: Graph, prefixes: Sequence[Path]) -> tuple[Item, ...]:
    """Return the item about action libraries of the graph that are older than their sources in the
    workspace on this computer; an empty tuple if none is. `prefixes`: the folders of
    AMENT_PREFIX_PATH, the nearest first."""
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
    """Return a blocked item with the files that could be written, where the runner may write into
    the index folder."""
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
            case Present():
                waiting += [name] if name in lacking or name in other else []
            case Lacking():
                writable.append(WritableGraph(name))
            case Differing(file):
                writable.append(WritableGraph(name, file.display_path))
            case Hindered(why):
                hindered[name] = why
    if writable and not os.access(folder, os.W_OK | os.X_OK):
        why = f"The runner may not write into {shown_path(str(folder))}."
        hindered |= {each.graph: why for each in writable}
        writable = []
    found = IndexFolderState(
        path=shown_path(str(folder)),
        writable=tuple(writable),
        waiting=tuple(waiting),
        hindered=hindered,
    )
    return msgspec.structs.replace(item, folder=found)


def course_items(found: CheckedCourses) -> tuple[Item, ...]:
    """Return the item about the expected courses of the graph: it warns and never blocks. Empty
    without courses."""
    courses = found.courses
    if not courses:
        return ()
    other = [each for each in courses if each.same is False]
    unknown = sum(each.same is None for each in courses)
    if not other and not unknown:
        text = f"It goes as expected: {counted(len(courses), 'expected course')}."
        return (Item(code="courses", verdict="passed", text=text),)
    sentences = [f"{each.name}: {each.why}" for each in other[:_NAMED]]
    if len(other) > _NAMED:
        sentences.append(f"{len(other) - _NAMED} more go another way.")
    if unknown:
        sentences.append(f"{counted(unknown, 'expected course')} could not be looked at in time.")
    if other:
        total = counted(len(courses), "expected course")
        sentences.insert(0, f"It does not go as expected, in {len(other)} of {total}.")
    return (Item(code="courses", verdict="warned", text=" ".join(sentences)),)


def breakpoint_items(breakpoints: Sequence[Breakpoint], *, is_led: bool) -> tuple[Item, ...]:
    """Return the item about the breakpoints of a start, if it has any. `is_led`: the runner leads it;
    an engine that gets the whole graph knows none."""
    if not breakpoints:
        return ()
    number = counted(len(breakpoints), "breakpoint")
    if is_led:
        inner = [each.inside for each in breakpoints if each.inside]
        more = f", {len(inner)} of them inside of {_listed(sorted(set(inner)))}" if inner else ""
        return (
            Item(code="breakpoints", verdict="passed", text=f"The run waits at {number}{more}."),
        )
    text = f"The whole graph is handed over at once: {number} of it will hold nothing."
    return (Item(code="breakpoints", verdict="warned", text=text),)


def unknown_courses_item(why: str) -> Item:
    """Return the item for expected courses that could not be checked, with the reason."""
    text = f"Whether it goes as expected is not known. {why}"
    return Item(code="courses", verdict="warned", text=text)


def counted(number: int, what: str) -> str:
    """Return a number with what is counted, in the plural unless it is 1."""
    return f"{number} {what}{'' if number == 1 else 's'}"
