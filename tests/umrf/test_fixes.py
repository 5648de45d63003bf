"""A fix removes its problem and changes nothing else."""

import json
from typing import Any

import pytest
from hypothesis import given, settings

from action_assistant.umrf.check import check
from action_assistant.umrf.files.codec import read
from action_assistant.umrf.fixes import fix
from action_assistant.umrf.model import Graph
from strategies import graphs
from support.doses import examples


def graph_of(a: dict[str, Any], b: dict[str, Any], *more: dict[str, Any]) -> Graph:
    file = {
        "graph_name": "g", "graph_entry": [{"name": "A"}], "graph_exit": [{"name": "B"}],
        "actions": [{"name": "A", "type": "sync"} | a, {"name": "B", "type": "sync"} | b, *more],
    }  # fmt: skip
    return read(json.dumps(file)).graph


SAFE = {"name": "A", "conditions": ["on_error -> ignore"]}


@pytest.mark.parametrize(
    ("graph", "code"),
    [
        (graph_of({"children": [{"name": "B"}]}, {}), "H2"),
        (graph_of({}, {"parents": [SAFE]}), "H2b"),
        (graph_of({"children": [{"name": "B"}, {"name": "Z"}]}, {"parents": [SAFE]}), "ghost"),
        (graph_of({"children": [{"name": "B"}]}, {"parents": [SAFE, SAFE]}), "relation-repeated"),
        (graph_of({}, {}, {"name": "B", "type": "sync"}), "H6"),
        (graph_of({"instance_id": 70_000}, {}), "instance-id"),
        (graph_of({"type": ""}, {}), "type-empty"),
    ],
)
def test_a_fix_removes_its_problem(graph: Graph, code: str) -> None:
    problem = next(p for p in check(graph) if p.code == code)
    mended = fix(graph, problem)
    assert code not in {p.code for p in check(mended)}
    assert fix(mended, problem) == mended


@given(graphs())
@settings(max_examples=examples(100))
def test_fixes_end_and_bring_no_new_errors(graph: Graph) -> None:
    for _ in range(50):
        mendable = [p for p in check(graph) if p.fix]
        if not mendable:
            break
        graph = fix(graph, mendable[0])
    assert not [p for p in check(graph) if p.fix]
