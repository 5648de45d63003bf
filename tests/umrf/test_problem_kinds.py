"""Kinds and counts of problems agree with the vectors that the page reads, too."""

import json
from pathlib import Path
from typing import Any, Final

import msgspec
import pytest

from action_assistant.editor.documents import document
from action_assistant.umrf.check import check_written
from action_assistant.umrf.codes import CODES
from action_assistant.umrf.model import Problem, Severity, Where
from action_assistant.umrf.problem_kinds import (
    MISTAKES,
    UNWRITTEN,
    ProblemCounts,
    kind_of,
    problem_counts,
)

VECTORS: Final = json.loads(
    (Path(__file__).parents[1] / "vectors" / "problem-kinds.json").read_text(encoding="utf-8")
)


@pytest.mark.parametrize(("code", "severity", "path", "kind"), VECTORS["kinds"])
def test_problems_are_of_the_kind_that_the_vectors_say(
    code: str, severity: Severity, path: str, kind: str
) -> None:
    problem = Problem(code=code, severity=severity, where=Where(path=path), message="")
    assert kind_of(problem) == kind


def test_the_vectors_know_every_code_in_every_severity_that_it_has() -> None:
    known = {(code, severity) for code, severity, _, _ in VECTORS["kinds"]}
    assert known >= {(name, each) for name, code in CODES.items() for each in code.severities}
    assert set(CODES) >= UNWRITTEN | MISTAKES


@pytest.mark.parametrize("vector", VECTORS["graphs"], ids=lambda vector: vector["about"])
def test_a_graph_has_as_many_of_each_as_the_vectors_say(vector: dict[str, Any]) -> None:
    graph = document.read_maps(vector["maps"])
    problems = check_written(graph)
    wanted = msgspec.convert(vector["problems"], list[Problem])
    assert list(map(_said, problems)) == list(map(_said, wanted))
    assert problem_counts(problems, graph) == ProblemCounts(vector["wrong"], vector["to_fill_in"])


def _said(problem: Problem) -> tuple[str | None, ...]:
    where = problem.where
    return (
        problem.code,
        problem.severity,
        problem.message,
        where.path,
        where.aid,
        where.relation,
    )
