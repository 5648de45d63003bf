"""The echo of a graph is the graph that an engine gives back."""

import json

from hypothesis import given, settings

from action_assistant.umrf.digest import digest
from action_assistant.umrf.echo import echo
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files.codec import read, write
from action_assistant.umrf.model import Graph
from strategies import graphs
from support.doses import examples
from support.recordings import family, lines


def echoed(text: str) -> str:
    return digest(echo(read(text).graph, PINNED))


def test_the_engine_prints_the_echo_of_the_graph_that_it_read() -> None:
    differing = []
    cases = lines(family("engine") / "validation.jsonl")
    assert cases
    for case in cases:
        printed = case.get("roundtrip") or {}
        if "graph_name" in printed and echoed(case["input"]) != echoed(json.dumps(printed)):
            differing.append(case["case"])
    # the engine leaves out actions that are called like its own ends: a problem for `check`
    assert set(differing) <= {"action named graph_exit id 1"}


@given(graphs(max_actions=4))
@settings(max_examples=examples(60))
def test_an_echo_echoes_itself(graph: Graph) -> None:
    once = echo(graph, PINNED)
    assert digest(echo(once, PINNED)) == digest(once)
    assert digest(echo(read(write(once)).graph, PINNED)) == digest(once)


def test_only_values_that_no_parent_hands_over_count() -> None:
    file = """{"graph_name": "g", "graph_entry": [{"name": "A"}], "graph_exit": [{"name": "B"}],
      "actions": [
        {"name": "A", "type": "sync", "output_parameters": {"out": {"pvf_type": "string"}},
         "children": [{"name": "B", "remap": [{"from": "out", "to": "text"}]}]},
        {"name": "B", "type": "sync", "parents": [{"name": "A"}], "input_parameters": {
          "text": {"pvf_type": "string", "pvf_value": "%s"},
          "other": {"pvf_type": "string", "pvf_value": "%s"}}}]}"""
    assert echoed(file % ("a", "x")) == echoed(file % ("b", "x"))
    assert echoed(file % ("a", "x")) != echoed(file % ("a", "y"))
