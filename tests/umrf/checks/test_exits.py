"""The exit ends a graph when its parents and outputs are there, as on the real engine.

See docs/umrf-and-the-engine.md 2.3.

`MEASURED` is what the real node did with these graphs on 2026-11-22, each started once by itself:
whether it was FINISHED or stayed RUNNING with nothing running.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from action_assistant.umrf.check import blocking, check, check_reading
from action_assistant.umrf.files import codec
from action_assistant.umrf.fixes import fix
from action_assistant.umrf.model import Graph
from action_assistant.umrf.packages.structures import structure
from action_assistant.umrf.semantics import Behaviour, Engine, Script

ALL = {"on_true": "run", "on_false": "run", "on_error": "run", "on_stopped": "ignore"}
TEXT = {"pvf_type": "string"}


def only(outcome: str, response: str = "run") -> dict[str, str]:
    return dict.fromkeys(ALL, "ignore") | {outcome: response}


def work(number: int) -> dict[str, Any]:
    return {"name": "OxWork", "instance_id": number, "type": "sync"}


def echo(number: int, **leaf: Any) -> dict[str, Any]:
    """An action with an output."""
    given = {"text": TEXT | {"pvf_value": "x"}}
    fields = {"input_parameters": given, "output_parameters": {"text": TEXT | leaf}}
    return {"name": "OxEcho", "instance_id": number, "type": "sync"} | fields


Arrow = tuple[int, int, dict[str, str]]
Exit = tuple[int, dict[str, str], bool]


def graph(
    actions: list[dict[str, Any]], arrows: list[Arrow], entry: list[int], exits: list[Exit]
) -> Graph:
    """A graph by the places of its actions; an exit says whether it is required."""
    nodes: list[dict[str, Any]] = [{**each, "parents": [], "children": []} for each in actions]
    names = [{"name": each["name"], "instance_id": each["instance_id"]} for each in actions]

    def listed(place: int, answers: Mapping[str, str], required: bool = True) -> dict[str, Any]:
        said = [f"{outcome} -> {response}" for outcome, response in answers.items()]
        return names[place] | {"required": required, "conditions": said}

    for parent, child, answers in arrows:
        nodes[parent]["children"].append(names[child])
        nodes[child]["parents"].append(listed(parent, answers))
    file = {
        "graph_name": "g",
        "graph_entry": [names[place] for place in entry],
        "graph_exit": [listed(*each) for each in exits],
        "actions": nodes,
    }
    return codec.read(json.dumps(file)).graph


def decision(
    *, required: bool = False, answers: Mapping[str, str] = only("on_true"), turned: bool = False, **leaf: Any
) -> Graph:  # fmt: skip
    """Work 0 decides: true leads to work 1, false to echo 2, and either leads to the exit."""
    exits: list[Exit] = [(1, dict(answers), required), (2, dict(answers), required)]
    arrows: list[Arrow] = [(0, 1, only("on_true")), (0, 2, only("on_false"))]
    return graph([work(0), work(1), echo(2, **leaf)], arrows, [0], exits[::-1] if turned else exits)


def both(*actions: dict[str, Any], first: Mapping[str, str] = only("on_true")) -> Graph:
    """Two beside each other, both required; the second takes longer."""
    exits: list[Exit] = [(0, dict(first), True), (1, only("on_true"), True)]
    return graph(list(actions), [], [0, 1], exits)


BYPASS = only("on_true", "bypass")
MEASURED: dict[str, tuple[Graph, str, str]] = {
    "both required": (decision(required=True), "on_true", "RUNNING"),
    "neither required": (decision(), "on_true", "RUNNING"),
    "in the other order": (decision(turned=True), "on_true", "RUNNING"),
    "through the one with outputs": (decision(), "on_false", "FINISHED"),
    "outputs not required": (decision(pvf_required=False), "on_true", "FINISHED"),
    "nor through the other": (decision(pvf_required=False), "on_false", "FINISHED"),
    "nor turned": (decision(pvf_required=False, turned=True), "on_true", "FINISHED"),
    "an output with a value": (decision(pvf_value="z"), "on_true", "FINISHED"),
    "bypass": (decision(answers=BYPASS), "on_true", "FINISHED"),
    "bypass and required": (decision(answers=BYPASS, required=True), "on_true", "FINISHED"),
    "through the other": (decision(answers=BYPASS, required=True), "on_false", "FINISHED"),
    "beside each other": (both(echo(0), work(1)), "on_true", "FINISHED"),
    "and turned": (both(work(0), echo(1)), "on_true", "FINISHED"),
    "outputs of one that is ignored": (
        both(echo(0), work(1), first=only("on_false")), "on_true", "RUNNING",
    ),
    "two with the same output": (
        graph(
            [work(0), echo(1), echo(2)],
            [(0, 1, only("on_true")), (0, 2, only("on_false"))], [0],
            [(1, only("on_true"), False), (2, only("on_true"), False)],
        ), "on_true", "FINISHED",
    ),
    "one with outputs that is bypassed": (
        graph([work(0), echo(1)], [(0, 1, BYPASS)], [0], [(1, only("on_true"), True)]),
        "on_true", "RUNNING",
    ),
}  # fmt: skip


def ended(value: Graph, decided: str = "on_true") -> str:
    """The state of the graph when nothing more happens; `decided`: how the first action ends."""
    first, *rest = (action.full_name for action in value.actions)
    calls = {first: (Behaviour(after_s=0.2, result=decided),)}
    calls |= {name: (Behaviour(after_s=0.3 + n / 10),) for n, name in enumerate(rest)}
    engine = Engine(script=Script(calls))
    engine.start(value, 0.0)
    engine.advance(60_000.0)
    return engine.states()["g"].state


@pytest.mark.parametrize("name", MEASURED)
def test_a_graph_ends_or_stays_running_as_on_the_real_engine(name: str) -> None:
    value, decided, state = MEASURED[name]
    assert ended(value, decided) == state


@pytest.mark.parametrize("name", MEASURED)
def test_a_graph_that_may_stay_running_is_a_problem_and_no_other(name: str) -> None:
    value, _, _ = MEASURED[name]
    first = {action.full_name for action in value.actions[:1]}
    stuck = any(ended(value, decided) == "RUNNING" for decided in ("on_true", "on_false"))
    found = [p for p in check(value) if p.code == "H8"]
    assert bool(found) == stuck, first
    if ended(value) == "RUNNING":
        assert blocking(found)


@pytest.mark.parametrize(
    "value",
    [decision(required=True), decision(), decision(turned=True), both(echo(0), work(1), first=only("on_false"))],
)  # fmt: skip
def test_its_fixes_make_either_way_end_the_graph(value: Graph) -> None:
    for _ in range(4):
        found = [p for p in check(value) if p.code == "H8"]
        for problem in found:
            value = fix(value, problem)
    assert [p for p in check(value) if p.code == "H8"] == []
    assert {ended(value, decided) for decided in ("on_true", "on_false")} == {"FINISHED"}


def test_concurrent_actions_are_waited_for() -> None:
    """A branch that is not waited for would run on in a graph that no stop reaches any more."""
    value = graph(
        [work(0), work(1), work(2)],
        [(1, 2, only("on_true"))],
        [0, 1],
        [(0, only("on_true"), True), (2, only("on_true"), True), (1, only("on_false"), True)],
    )
    (problem,) = [p for p in check(value) if p.code == "H8"]
    assert problem.severity == "warning"
    assert "the exit waits for OxWork_2" in problem.message
    assert problem.fix is None


def test_a_sub_graph_gives_the_values_that_reached_its_exit() -> None:
    inner = decision(pvf_required=False)
    calls = {"OxWork_0": (Behaviour(result="on_false"),)}
    outer = codec.read(
        json.dumps(
            {
                "graph_name": "outer",
                "actions": [
                    {"name": "g", "type": "sync", "output_parameters": {"text": TEXT}},
                ],
            }
        )
    ).graph
    engine = Engine(library={"g": inner}, script=Script(calls))
    engine.start(outer, 0.0)
    engine.advance(60_000.0)
    assert engine.states()["outer"].state == "FINISHED"


def test_a_sub_graph_that_stays_running_is_found_in_the_graph_around_it() -> None:
    outer = codec.read(
        json.dumps(
            {
                "graph_name": "outer",
                "actions": [{"name": "g", "type": "sync", "output_parameters": {"text": TEXT}}],
            }
        )
    ).graph
    certain = [p.code for p in check(outer, graphs={"g": decision()}) if p.severity == "error"]
    assert certain == ["subgraph"]


CASES = Path(__file__).parent.parent / "cases"


def test_an_output_that_nobody_gives_is_its_first_allowed_value() -> None:
    """The product's own generated package does the same, and the engine FINISHES the graph."""
    reading = codec.read((CASES / "allowed_output_at_exit.graph.json").read_text())
    assert blocking(check_reading(reading)) == []
    engine = Engine()
    engine.start(reading.graph, 0.0)
    engine.advance(60_000.0)
    assert engine.states()["allowed_output_at_exit"].state == "FINISHED"


@pytest.mark.parametrize(
    ("leaf", "given", "left"),
    [
        ({"pvf_value": "bad", "pvf_allowed_values": ["ok", "bad"]}, None, "bad"),
        ({"pvf_allowed_values": ["ok", "bad"]}, None, "ok"),
        ({"pvf_allowed_values": ["ok", "bad"]}, {"text": "bad"}, "bad"),
        ({"pvf_allowed_values": ["ok", "bad"]}, {"text": None}, "ok"),
        ({"pvf_allowed_values": []}, None, ""),
        ({}, None, ""),
    ],
)
def test_an_output_has_one_default_everywhere(
    leaf: dict[str, Any], given: dict[str, Any] | None, left: str
) -> None:
    """The simulator hands over what a generated package begins with."""
    kept = {"name": "OxEcho", "instance_id": 1, "type": "sync", "input_parameters": {"text": TEXT}}
    joined = graph([echo(0, **leaf), kept], [(0, 1, only("on_true"))], [0], [(1, ALL, True)])
    engine = Engine(script=Script({"OxEcho_0": (Behaviour(outputs=given),)}))
    engine.start(joined, 0.0)
    engine.advance(1_500.0)
    slot = engine.graphs["g"].nodes["OxEcho_1"].inputs["text"]
    assert slot.value == left
    if given is None:
        structs, _ = structure(joined.actions[0], "output_parameters")
        assert (structs.values[0].initial or "") == left


def test_a_problem_that_depends_on_an_output_value_is_not_certain() -> None:
    """The other end could give one of the values that the exit takes in."""
    ends = [work(0), echo(1), echo(2, pvf_allowed_values=["ok"])]
    ways = [(0, 1, only("on_true")), (0, 2, only("on_false"))]
    forked = graph(ends, ways, [0], [(1, ALL, False), (2, ALL, False)])
    (told,) = [each for each in check(forked) if each.code == "H8"]
    assert told.severity == "warning"


def test_an_output_that_no_end_has_is_missed_for_certain() -> None:
    ends = [work(0), work(1), echo(2, pvf_allowed_values=["ok"])]
    ways = [(0, 1, only("on_true")), (0, 2, only("on_false"))]
    forked = graph(ends, ways, [0], [(1, ALL, False), (2, ALL, False)])
    (told,) = [each for each in check(forked) if each.code == "H8"]
    assert told.severity == "error"
