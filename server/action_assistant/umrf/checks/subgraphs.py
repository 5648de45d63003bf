"""Checks actions that are graphs themselves: how a sub-graph affects the graph around it.

See docs/umrf-and-the-engine.md 2.6.
"""

from collections import Counter
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

import msgspec

from action_assistant.umrf.checks.flow import check_flow
from action_assistant.umrf.checks.places import Subject, more
from action_assistant.umrf.checks.structure import check_structure
from action_assistant.umrf.checks.trials import check_scenarios, halted
from action_assistant.umrf.checks.values import check_signature, check_values
from action_assistant.umrf.codes import FINAL, rank
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.model import (
    EXIT,
    PRECONDITIONS,
    Action,
    Graph,
    Key,
    PlaceInside,
    Problem,
    Severity,
    Signature,
)
from action_assistant.umrf.semantics.matching import unresolved
from action_assistant.umrf.semantics.values import slots_of
from action_assistant.umrf.signatures import signature_of_graph, with_inputs

#: The most errors of one sub-graph, with the graphs inside it, that are reported at each action that stands for it.
_ERRORS: Final = 20
#: Problems of a sub-graph that affect the graph around it: the engine ends, the graph never ends, or a stop does not
#: reach it.
_REACHES_OUT: Final = frozenset({"H4", "H5", "H8", "H12", "H14"})


@dataclass(frozen=True)
class _Finding:
    """A problem inside a sub-graph, at any depth. `place` names the levels from the sub-graph down
    to the problem."""

    severity: Severity
    place: PlaceInside


@dataclass(frozen=True)
class _Inner:
    """The results of the check of one sub-graph, computed once for all actions that stand for it.

    `halted`: in which case the sub-graph ends HALTED (in words), and whether it always does; None
    if no trial does.
    """

    signature: Signature
    findings: tuple[_Finding, ...]
    halted: tuple[str, bool] | None


@dataclass(frozen=True)
class Resolution:
    """Facts about how the names of sub-graphs were resolved to graphs.

    `several`: names that more than one graph has, of which the oldest was taken. `cut`: True if
    more graphs are inside than were examined. `hidden`: names that both a graph and an action of
    the library have.
    """

    several: Container[str] = frozenset()
    cut: bool = False
    hidden: Container[str] = frozenset()


#: Each name belongs to one graph, and all graphs were examined.
CERTAIN: Final = Resolution()


@dataclass(frozen=True)
class SubGraphs:
    """The graphs by name, the names of actions that take precedence over graphs of the same name
    (`known`), and the results of the check of each graph inside (`found`, the innermost first)."""

    by_name: Mapping[str, Graph]
    known: Container[str]
    resolution: Resolution
    found: dict[str, _Inner] = field(default_factory=dict)
    _recurring: dict[tuple[str, str], bool] = field(default_factory=dict)

    def of(self, name: str) -> Graph | None:
        """Return the graph for which an action of this name stands; None if it stands for no graph."""
        return None if name in self.known else self.by_name.get(name)

    def is_hidden(self, name: str) -> bool:
        """Return whether a graph has this name that no action can use, since an action of the
        library has the same name."""
        return name in self.resolution.hidden or (name in self.known and name in self.by_name)

    def recurs(self, name: str, within: str) -> bool:
        """Return whether the graph with this name contains itself, or contains the graph `within`
        in which an action stands for it.

        The names by which actions use graphs count; the name in a graph's own text does not.
        """
        if (name, within) not in self._recurring:
            self._recurring[name, within] = name == within or self._reaches(name, {name, within})
        return self._recurring[name, within]

    def _reaches(self, name: str, goals: set[str]) -> bool:
        seen = {name}
        stack = [name]
        while stack:
            for inner in self._inside(self.by_name[stack.pop()]):
                if inner in goals:
                    return True
                if inner not in seen:
                    seen.add(inner)
                    stack.append(inner)
        return False

    def _inside(self, graph: Graph) -> Iterator[str]:
        real = (action.name for action in graph.actions if not action.missing)
        return (name for name in real if self.of(name) is not None)

    def inmost_first(self, top: Graph) -> Iterator[str]:
        """Yield the name of each graph inside `top` that does not contain itself, the innermost
        graphs first.

        The search is iterative, since a hierarchy may be deeper than Python's stack.
        """
        seen: set[str] = set()
        levels = [(top.name, self._inside(top))]
        while levels:
            within, left = levels[-1]
            name = next(left, None)
            if name is None:
                levels.pop()
                if levels:
                    yield within
            elif name not in seen and not self.recurs(name, within):
                seen.add(name)
                levels.append((name, self._inside(self.by_name[name])))


def check_subgraphs(
    subject: Subject,
    graphs: Mapping[str, Graph],
    known: Container[str] = frozenset(),
    resolution: Resolution = CERTAIN,
) -> SubGraphs:
    """Report all problems of the sub-graphs in `subject`, and return the results for each of them.
    `graphs`: the indexed graphs by name. `known`: names of actions, which take precedence over
    graphs of the same name. `resolution`: how names were resolved to graphs."""
    if resolution.cut:
        message = (
            "There are more graphs inside this one than are examined. Deeper graphs were not checked, "
            "and a dry-run plays it as one action."
        )
        subject.report("not-tried", "warning", message)
    inside = SubGraphs(graphs, known, resolution)
    for name in inside.inmost_first(subject.graph):
        inside.found[name] = _inner(name, subject.facts, inside)
    _check_each(subject, subject.graph.name, inside)
    _check_again(subject, graphs, known)
    return inside


def _check_each(subject: Subject, within: str, graphs: SubGraphs) -> None:
    """Report how each sub-graph of one graph (`subject`) affects this graph. `within`: the name by
    which the graph around uses it. `graphs`: has the results of the checks of the sub-graphs."""
    for action in subject.real:
        graph = graphs.of(action.name)
        if graph is None:
            if action.name != within and graphs.is_hidden(action.name):
                message = (
                    f"“{action.name}” is an action of the library and a graph, too: the action is taken, "
                    "never the graph. Rename one of them where the graph is meant."
                )
                subject.report("subgraph-hidden", "warning", message, action=action, member="/name")
            continue
        if action.name in graphs.resolution.several:
            message = (
                f"Several graphs are called “{graph.name}”: the oldest of them is taken. Rename the "
                "others to avoid mistakes."
            )
            subject.report("subgraph-ambiguous", "warning", message, action=action, member="/name")
        if graphs.recurs(action.name, within):
            message = (
                f"The sub-graph “{graph.name}” contains itself or the graph that it is in; the "
                "engine cannot resolve the graph."
            )
            subject.report("recursion", "error", message, action=action, member="/name")
            continue
        _report(subject, action, graph, graphs.found[action.name])
        _check_pauses(subject, action)


def _report(subject: Subject, action: Action, graph: Graph, found: _Inner) -> None:
    """Report the results of the check of a sub-graph (`found`) at the action that stands for it."""
    own = slots_of(action.inputs), slots_of(action.outputs)
    check_signature(subject, action, found.signature, *own)
    for each in found.findings:
        place = at_action(each.place, action)
        code = "subgraph" if each.severity == "error" else place.code
        message = _sentence(each.severity, place)
        subject.report(code, each.severity, message, action=action, member="/name", inside=place)
    if found.halted is not None:
        when, certain = found.halted
        message = (
            f"The sub-graph “{graph.name}” ends HALTED {when}, which nobody is told: this action then "
            "stays RUNNING for ever, and the graph with it."
        )
        severity: Severity = "error" if certain else "warning"
        subject.report("H8", severity, message, action=action, member="/name")


def _sentence(severity: Severity, place: PlaceInside) -> str:
    *above, _ = place.levels
    graph = f"The sub-graph “{place.graph}”" + (f" inside {' › '.join(above)}" if above else "")
    if severity == "error":
        return f"{graph} has an error ({place.code}): {place.message}"
    if place.code == "H8":
        return f"{graph} may never end, and the graph with it: {place.message}"
    return f"{graph} may go wrong: {place.message}"


def _check_again(subject: Subject, graphs: Mapping[str, Graph], known: Container[str]) -> None:
    """Report sub-graphs that occur twice where the engine can use them only once. Each engine
    (actor) resolves only its own actions. `known`: names of actions, which take precedence over
    graphs."""
    reported: set[tuple[Key, str]] = set()
    for found in unresolved(subject.graph, graphs, known):
        place = (found.action.key, found.name)
        if found.why == "recursion" or place in reported:
            continue
        reported.add(place)
        inside = "" if found.action.name == found.name else f" inside {found.action.full_name}"
        message = (
            f"The sub-graph “{found.name}”{inside} comes a second time: the engine has used it up "
            "then and cannot resolve the graph. Give the sub-graph another name for the second "
            "place, or put its actions there."
        )
        subject.report("subgraph-twice", "error", message, action=found.action, member="/name")


def _inner(name: str, facts: EngineFacts, graphs: SubGraphs) -> _Inner:
    """Check the sub-graph called `name`, and return the results. The graphs inside it must have
    been checked before. `facts`: the engine build."""
    graph = graphs.by_name[name]
    inside = Subject(with_inputs(graph), facts)
    check_structure(inside)
    check_flow(inside, {each.name for each in inside.real if graphs.of(each.name) is not None})
    check_values(inside, None)
    _check_each(inside, name, graphs)
    check_scenarios(inside)
    findings = _findings(inside)
    when = None if any(_needs_no_trial(each) for each in findings) else halted(inside)
    ends = None if when is None else (when, not inside.incoming.get(EXIT))
    return _Inner(signature_of_graph(graph), findings, ends)


def _needs_no_trial(finding: _Finding) -> bool:
    """Return whether a finding makes it needless to try how the sub-graph ends: it is an error, or
    says that the sub-graph may never end (H8)."""
    return finding.severity == "error" or finding.place.code == "H8"


def _findings(inside: Subject) -> tuple[_Finding, ...]:
    """Return the problems of a sub-graph (`inside`) as findings for the graph around it. With
    errors: the first `_ERRORS` of them, errors that no person can override first; the last one says
    how many more there are. Without errors: the first problem of each code that affects the graph
    around, with the number of further problems of this code."""
    problems = sorted(inside.problems, key=rank)
    errors = [each for each in problems if each.severity == "error"]
    errors.sort(key=lambda each: each.code not in FINAL)  # final errors are always among them
    if errors:
        reported, left = errors[:_ERRORS], len(errors) - _ERRORS
        return (
            *(_finding(inside, each) for each in reported[:-1]),
            _finding(inside, reported[-1], left),
        )
    kinds = Counter(each.code for each in problems)
    first = {each.code: each for each in reversed(problems) if each.code in _REACHES_OUT}
    return tuple(
        _finding(inside, each, kinds[each.code] - 1) for each in sorted(first.values(), key=rank)
    )


def _finding(inside: Subject, problem: Problem, left: int = 0) -> _Finding:
    """Return a problem of a sub-graph (`inside`) as a finding for the graph around. `left`: how
    many further problems this finding stands for."""
    place = place_inside(inside, problem)
    message = place.message + more(left, "problem", "problems")
    return _Finding(problem.severity, msgspec.structs.replace(place, message=message))


def place_inside(inside: Subject, problem: Problem) -> PlaceInside:
    """Return the place of a problem of the sub-graph `inside`. A problem from a deeper graph keeps
    its place there."""
    return problem.inside or PlaceInside(
        levels=(),
        aids=(),
        graph=inside.graph.name,
        code=problem.code,
        message=problem.message,
        where=problem.where,
    )


def at_action(place: PlaceInside, action: Action) -> PlaceInside:
    """Return a place within a sub-graph as seen from the graph around, in which `action` stands for
    this sub-graph."""
    levels, aids = (action.full_name, *place.levels), (action.key, *place.aids)
    return msgspec.structs.replace(place, levels=levels, aids=aids)


def _check_pauses(subject: Subject, action: Action) -> None:
    for relation in subject.incoming.get(action.key, []):
        if "pause" in {relation.conditions.answer(outcome) for outcome in PRECONDITIONS}:
            message = (
                f"{action.full_name} is a sub-graph: a pause of it never completes, and the engine "
                "obeys nothing any more."
            )
            subject.report("H5", "warning", message, relation=relation, member="/conditions")
