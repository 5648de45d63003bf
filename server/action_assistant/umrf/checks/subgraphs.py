"""Actions that are graphs themselves: what the graph inside does to the one around it.

See docs/umrf-and-the-engine.md 2.6.
"""

from collections.abc import Container, Mapping
from dataclasses import dataclass
from typing import Final

from action_assistant.umrf.checks.flow import check_flow
from action_assistant.umrf.checks.places import Subject
from action_assistant.umrf.checks.scenarios import check_scenarios, halted
from action_assistant.umrf.checks.structure import check_structure
from action_assistant.umrf.checks.values import check_signature, check_values
from action_assistant.umrf.model import (
    EXIT,
    PRECONDITIONS,
    Action,
    Graph,
    Key,
    Problem,
    Severity,
    Signature,
)
from action_assistant.umrf.semantics.matching import unresolved
from action_assistant.umrf.semantics.values import slots_of
from action_assistant.umrf.signatures import signature_of_graph, with_inputs


@dataclass(frozen=True)
class _Inner:
    """What is the same wherever a sub-graph stands: found once, not once per action."""

    signature: Signature
    problems: tuple[tuple[str, Severity, str], ...]


@dataclass(frozen=True)
class Resolution:
    """How names were resolved to graphs. `several`: names of more than one graph, of which the oldest
    was taken; `cut`: there are more graphs inside than were looked at."""

    several: Container[str] = frozenset()
    cut: bool = False


#: Each name is that of one graph, and all were looked at.
CERTAIN: Final = Resolution()


def check_subgraphs(
    subject: Subject,
    graphs: Mapping[str, Graph],
    known: Container[str] = frozenset(),
    resolution: Resolution = CERTAIN,
) -> None:
    """Reports all of it. `known`: names of actions, which come before graphs of the same name."""
    if resolution.cut:
        message = (
            "There are more graphs inside this one than are looked at. What lies deeper was not checked, "
            "and a dry-run plays it as one action."
        )
        subject.report("not-tried", "warning", message)
    _check_each(subject, graphs, known, resolution)
    _check_again(subject, graphs, known)


def _check_each(
    subject: Subject, graphs: Mapping[str, Graph], known: Container[str], resolution: Resolution
) -> None:
    inner: dict[str, _Inner | None] = {}
    for action in subject.real:
        graph = graphs.get(action.name)
        if graph is None or action.name in known:
            continue
        if action.name in resolution.several:
            message = (
                f"Several graphs are called “{graph.name}”: the oldest of them is taken. Rename the "
                "others, so that nobody is mistaken."
            )
            subject.report("subgraph-ambiguous", "warning", message, action=action, member="/name")
        if action.name not in inner:
            contains = _contains(graph, {subject.graph.name, graph.name}, graphs, known)
            inner[action.name] = None if contains else _inner(subject, graph)
        found = inner[action.name]
        if found is None:
            message = (
                f"The sub-graph “{graph.name}” contains itself or the graph that it is in; the "
                "engine cannot resolve the graph."
            )
            subject.report("recursion", "error", message, action=action, member="/name")
            continue
        own = slots_of(action.inputs), slots_of(action.outputs)
        check_signature(subject, action, found.signature, *own)
        for code, severity, message in found.problems:
            subject.report(code, severity, message, action=action, member="/name")
        _check_pauses(subject, action)


def _check_again(subject: Subject, graphs: Mapping[str, Graph], known: Container[str]) -> None:
    """Sub-graphs that an engine has used up when it comes to them. Each engine resolves its own."""
    told: set[tuple[Key, str]] = set()
    for actor in sorted({action.actor for action in subject.real} - {""}) or [""]:

        def is_other(action: Action, own: tuple[str, str] = ("", actor)) -> bool:
            return action.actor not in own or action.name in known

        for found in unresolved(subject.graph, graphs, is_other):
            place = (found.action.key, found.name)
            if found.why == "recursion" or place in told:
                continue
            told.add(place)
            inside = "" if found.action.name == found.name else f" inside {found.action.full_name}"
            message = (
                f"The sub-graph “{found.name}”{inside} comes a second time: the engine has used it up "
                "then and cannot resolve the graph. Give the sub-graph another name for the second "
                "place, or put its actions there."
            )
            subject.report("subgraph-twice", "error", message, action=found.action, member="/name")


def _inner(subject: Subject, graph: Graph) -> _Inner:
    return _Inner(signature_of_graph(graph), tuple(_problems_of(subject, graph)))


def _contains(
    graph: Graph, above: set[str], graphs: Mapping[str, Graph], known: Container[str]
) -> bool:
    """Whether one of the graphs in which it is comes again inside."""
    seen: set[str] = set()
    stack = [graph]
    while stack:
        for action in stack.pop().actions:
            if action.name in known or action.name not in graphs:
                continue
            if action.name in above:
                return True
            if action.name not in seen:
                seen.add(action.name)
                stack.append(graphs[action.name])
    return False


def _problems_of(subject: Subject, graph: Graph) -> list[tuple[str, Severity, str]]:
    """Code, severity and message of what a sub-graph does wrong."""
    inside = Subject(with_inputs(graph), subject.facts)
    check_structure(inside)
    check_flow(inside)
    check_values(inside, None)
    check_scenarios(inside)
    errors: list[Problem] = [p for p in inside.problems if p.severity == "error"]
    if errors:
        message = (
            f"The sub-graph “{graph.name}” has an error ({errors[0].code}): {errors[0].message}"
        )
        return [("subgraph", "error", message)]
    for problem in inside.problems:
        if problem.code == "H8":
            message = f"The sub-graph “{graph.name}” may never end, and the graph with it: {problem.message}"
            return [("H8", "warning", message)]
    when = halted(inside)
    if when is None:
        return []
    certain = not inside.incoming.get(EXIT)
    message = (
        f"The sub-graph “{graph.name}” ends HALTED {when}, which nobody is told: this action then "
        "stays RUNNING for ever, and the graph with it."
    )
    return [("H8", "error" if certain else "warning", message)]


def _check_pauses(subject: Subject, action: Action) -> None:
    for relation in subject.incoming.get(action.key, []):
        if "pause" in {relation.conditions.answer(outcome) for outcome in PRECONDITIONS}:
            message = (
                f"{action.full_name} is a sub-graph: a pause of it never completes, and the engine "
                "obeys nothing any more."
            )
            subject.report("H5", "warning", message, relation=relation, member="/conditions")
