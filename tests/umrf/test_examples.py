"""The graphs that come with the program."""

from importlib import resources

import pytest

from action_assistant.umrf.check import check
from action_assistant.umrf.files.codec import read, write
from action_assistant.umrf.semantics import (
    GraphResultEvent,
    HazardEvent,
    NodeStateEvent,
    Script,
    Trace,
    script_from,
    simulate,
)

FOLDER = resources.files("action_assistant") / "examples"
EXAMPLES = {
    path.name.removesuffix(".umrf.graph.json"): path.read_text(encoding="utf-8")
    for path in FOLDER.iterdir()
    if path.name.endswith(".umrf.graph.json")
}


def results_of(name: str, script: Script | None = None) -> list[str]:
    traces = list(simulate(read(EXAMPLES[name]).graph, script=script))
    assert not [trace for trace in traces if isinstance(trace, HazardEvent)]
    return [trace.value for trace in traces if isinstance(trace, GraphResultEvent)]


def started(traces: list[Trace]) -> list[str]:
    return [t.node for t in traces if isinstance(t, NodeStateEvent) and t.state == "RUNNING"]


def test_examples_exist() -> None:
    assert len(EXAMPLES) >= 4


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_an_example_is_canonical_and_called_like_its_file(name: str) -> None:
    reading = read(EXAMPLES[name])
    assert reading.dialect == "D3"
    assert reading.graph.name == name
    assert write(reading.graph) == EXAMPLES[name]


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_an_example_has_no_problem_and_a_place_for_everything(name: str) -> None:
    graph = read(EXAMPLES[name]).graph
    assert list(check(graph)) == []
    assert graph.entry_position is not None
    assert graph.exit_position is not None
    assert all(action.position and action.description for action in graph.actions)


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_an_example_finishes(name: str) -> None:
    assert results_of(name) == ["on_true"]


def test_the_search_goes_on_until_something_is_found() -> None:
    calls = [{"result": "on_false"}, {"result": "on_false"}, {"result": "on_true"}]
    script = script_from({"behaviours": {"LookForPallet": calls}})
    graph = read(EXAMPLES["search_aisles"]).graph
    nodes = started(list(simulate(graph, script=script)))
    assert nodes.count("LookForPallet_0") == 3
    assert nodes.count("MarkOnMap_0") == 1


def test_the_search_ends_with_an_error_when_there_are_no_more_aisles() -> None:
    script = script_from({"behaviours": {"DriveToNextAisle": [{"result": "on_error"}]}})
    assert results_of("search_aisles", script) == ["on_error"]


@pytest.mark.parametrize("failing", ["DriveTo", "IsValveClosed", "CloseValve"])
def test_the_inspection_calls_a_person_when_something_fails(failing: str) -> None:
    behaviours = {"IsValveClosed": [{"result": "on_false"}], failing: [{"result": "on_error"}]}
    script = script_from({"behaviours": behaviours})
    traces = list(simulate(read(EXAMPLES["valve_inspection"]).graph, script=script))
    assert "CallOperator_0" in started(traces)
    assert "SendReport_0" not in started(traces)
