"""Checks a graph and returns its problems, in words that say what would happen.

See docs/umrf-and-the-engine.md 3.
"""

from collections.abc import Collection, Mapping

from action_assistant.umrf.checks.actors import check_actors
from action_assistant.umrf.checks.flow import check_flow
from action_assistant.umrf.checks.places import Subject
from action_assistant.umrf.checks.questions import check_questions
from action_assistant.umrf.checks.structure import check_structure
from action_assistant.umrf.checks.subgraphs import (
    CERTAIN,
    Resolution,
    check_subgraphs,
)
from action_assistant.umrf.checks.trials import check_scenarios
from action_assistant.umrf.checks.values import check_static, check_values
from action_assistant.umrf.codes import FINAL, REFUSED, REFUSED_ALONE, STRUCTURAL, rank
from action_assistant.umrf.facts import PINNED, EngineFacts
from action_assistant.umrf.files.codec import ActionReading, Reading
from action_assistant.umrf.files.origins import placed
from action_assistant.umrf.files.writing import write
from action_assistant.umrf.model import ENTRY, EXIT, Graph, Problem, Signature
from action_assistant.umrf.questions import READY_SIGNATURES

__all__ = [
    "REFUSED",
    "STRUCTURAL",
    "blocking",
    "check",
    "check_action",
    "check_reading",
    "check_written",
    "forbids_start",
    "is_final",
    "refused_by_parser",
]


def check(
    graph: Graph,
    library: Mapping[str, Signature] | None = None,
    facts: EngineFacts = PINNED,
    graphs: Mapping[str, Graph] | None = None,
    resolution: Resolution = CERTAIN,
) -> list[Problem]:
    """Return all problems of a graph, the errors first, then by rank. No graph makes it raise an
    error. `library`: the actions that the engine has, by name; `facts`: its build. `graphs`: the
    graphs that the engine has indexed and can run as sub-graphs, by name; `resolution`: how these
    names were resolved. If `library` or `graphs` is None, it is unknown, and no problem is reported
    that depends on it."""
    subject = Subject(graph, facts)
    check_structure(subject)
    flow = check_flow(subject, set(graphs or ()) - set(library or ()))
    known = library if library is None else {**READY_SIGNATURES, **library}
    check_values(subject, known, graphs or {})
    inside = check_subgraphs(subject, graphs or {}, library or {}, resolution)
    check_actors(subject, inside, flow)
    check_questions(subject, inside)
    check_scenarios(subject)
    return sorted(subject.problems, key=rank)


def check_reading(
    reading: Reading,
    library: Mapping[str, Signature] | None = None,
    facts: EngineFacts = PINNED,
    graphs: Mapping[str, Graph] | None = None,
) -> list[Problem]:
    """Return all problems of a file that was read, with their places in the file: problems of the
    text, and problems of the graph in it. `library`, `graphs`: the actions and graphs that the
    engine has, by name, None if unknown; `facts`: its build."""
    found = check(reading.graph, library, facts, graphs)
    problems = [*reading.problems, *reading.placed(found)]
    return sorted(problems, key=rank)


def check_written(
    graph: Graph,
    graphs: Mapping[str, Graph] | None = None,
    resolution: Resolution = CERTAIN,
) -> list[Problem]:
    """Return every problem of a graph, with its place in the text that `write` produces for this
    graph. `graphs` and `resolution` are as in `check`."""
    found = check(graph, graphs=graphs, resolution=resolution)
    return placed(found, write(graph)) if found else []


def check_action(reading: ActionReading) -> list[Problem]:
    """Return all problems of a file that describes one action (`reading`: the file as read), with
    their places in it, errors first."""
    graph = Graph(name=reading.action.name or "action", actions=(reading.action,))
    subject = Subject(graph, PINNED)
    check_structure(subject)
    check_static(subject)
    problems = [*reading.problems, *reading.placed(subject.problems)]
    return sorted(problems, key=rank)


def refused_by_parser(reading: Reading) -> list[Problem]:
    """Return the problems for which the engine's parser refuses a file (`reading`: the file as
    read). The engine can run no part of a refused file."""
    subject = Subject(reading.graph, PINNED)
    check_structure(subject)
    ends = {ENTRY, EXIT}
    at_ends = {
        f"{r.parent}>{r.child}" for r in reading.graph.relations if {r.parent, r.child} & ends
    }

    def is_refusal(problem: Problem) -> bool:
        at_end = (problem.where.relation or "").split(";")[0] in at_ends
        return problem.severity == "error" and (
            problem.code in REFUSED or (problem.code == "ghost" and at_end)
        )

    seen = reading.placed(filter(is_refusal, subject.problems))
    return [*filter(is_refusal, reading.problems), *seen]


def blocking(problems: Collection[Problem], *, overridden: Collection[str] = ()) -> list[Problem]:
    """Return the problems that forbid a start on one robot.

    `overridden`: codes of errors that a person accepts. A final error forbids the start even if its
    code is overridden.
    """
    return [
        problem
        for problem in problems
        if forbids_start(problem) and (is_final(problem) or problem.code not in overridden)
    ]


def forbids_start(problem: Problem) -> bool:
    """Return whether a problem forbids a start on one robot, unless a person overrides it: an error,
    or a warning for which one engine refuses the graph."""
    return problem.severity == "error" or problem.code in REFUSED_ALONE


def is_final(problem: Problem) -> bool:
    """Return whether no person can override this error: its own code is final, or that of the
    problem in a sub-graph which it reports."""
    inner = problem.inside.code if problem.inside is not None else problem.code
    return problem.severity == "error" and not FINAL.isdisjoint({problem.code, inner})
