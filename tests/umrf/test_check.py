"""Problems that `check` reports for graphs."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.umrf.check import (
    STRUCTURAL,
    blocking,
    check,
    check_reading,
    refused_by_parser,
)
from action_assistant.umrf.facts import PINNED, SIMULATED
from action_assistant.umrf.files.codec import Unreadable, read
from action_assistant.umrf.model import Graph, Problem, Signature
from action_assistant.umrf.semantics import HazardEvent, NodeStateEvent, simulate
from strategies import graphs
from support.doses import examples
from support.growth import grows_with_its_size
from support.recordings import CORPUS, NO_CORPUS, engine_runs, facts, family, lines

SAFE = ["on_error -> ignore"]


def action(name: str, *, parents: Any = (), children: Any = (), **fields: Any) -> dict[str, Any]:
    """An action; parents and children by name, or as whole items."""
    sides = {
        "parents": [{"name": p, "conditions": SAFE} if isinstance(p, str) else p for p in parents],
        "children": [{"name": c} if isinstance(c, str) else c for c in children],
    }
    return {"name": name, "type": "sync"} | sides | fields


def file(*actions: dict[str, Any], entry: Any = ("A",), exits: Any = ("B",), **fields: Any) -> Any:
    """A graph file; ends by name, or as whole items."""
    ends = {
        "graph_entry": [{"name": e} if isinstance(e, str) else e for e in entry],
        "graph_exit": [
            {"name": e, "conditions": ["on_error -> run"]} if isinstance(e, str) else e
            for e in exits
        ],
    }
    return {"graph_name": "g", "actions": list(actions)} | ends | fields


def problems(value: Any, library: dict[str, Signature] | None = None) -> list[Problem]:
    return check_reading(read(json.dumps(value)), library)


def found(value: Any, library: dict[str, Signature] | None = None) -> dict[str, str]:
    """Return the codes of problems with their severity."""
    return {problem.code: problem.severity for problem in problems(value, library)}


A = action("A", children=["B"])
B = action("B", parents=["A"])
TEXT = {"pvf_type": "string"}


def test_a_sound_graph_has_no_problems() -> None:
    assert problems(file(A, B)) == []


@pytest.mark.parametrize(
    ("value", "code", "severity"),
    [
        (file(A, B, graph_name=""), "graph-name-empty", "error"),
        (file(A, B, graph_name=5), "value-type", "error"),
        (file(A, B, graph_description=[]), "value-type", "error"),
        (file(A | {"name": ""}, B, entry=[]), "name-empty", "error"),
        (file(A | {"type": ""}, B), "type-empty", "error"),
        (file(A | {"type": "magic"}, B), "type-unknown", "warning"),
        (file(A | {"actor": 5}, B), "value-type", "error"),
        (file(A | {"instance_id": 1.7}, B), "instance-id-cut", "warning"),
        (file(A | {"instance_id": -1}, B), "instance-id", "error"),
        (file(A | {"instance_id": 70000}, B), "instance-id", "error"),
        (file(A | {"parents": None}, B), "value-type", "error"),
        (file(A | {"name": "My Action"}, B, entry=["My Action"]), "name-class", "warning"),
        (file(A | {"name": "graph_entry"}, B), "H6", "error"),
        (file(A, B, B), "H6", "error"),
        (file(A, B, entry=["Z"]), "ghost", "error"),
        (file(A | {"children": [{"name": "B"}, {"name": "Z"}]}, B), "ghost", "error"),
        (file(A | {"input_parameters": {"p": TEXT | {"pvf_value": 5}}}, B), "parameter-illegal", "error"),
        (file(A | {"input_parameters": {"p": 5}}, B), "parameter-illegal", "error"),
        (file(A | {"input_parameters": []}, B), "value-type", "error"),
        (file(A | {"output_parameters": {"a:b": TEXT}}, B), "parameter-name", "warning"),
        (
            file(A | {"input_parameters": {"p": TEXT | {"pvf_value": "z", "pvf_allowed_values": ["a"]}}}, B),
            "parameter-allowed", "warning",
        ),
        (file(A, action("B", parents=[{"name": "A", "conditions": ["on_true -> skip"]}])), "condition-illegal", "error"),
        (file(A, action("B", parents=[{"name": "A", "required": "true"}])), "value-type", "error"),
        (file(action("A", children=[{"name": "B", "remap": {"a": "b"}}]), B), "remap-illegal", "error"),
        (file(action("A", children=[{"name": "B", "conditions": []}]), B), "wrong-side", "warning"),
        (file(A, action("B", parents=["A", "A"])), "relation-repeated", "warning"),
        (file(A | {"state": "FINISHED"}, B), "H1", "error"),
        (file(A, action("B")), "H2", "error"),
        (file(action("A"), B), "H2b", "error"),
        (file(A, action("B", parents=[{"name": "A"}])), "H3", "warning"),
        (file(A, action("B", parents=["A"]), action("C")), "unreachable", "warning"),
        (file(A, B, entry=[]), "no-entry", "error"),
        (file(A, B, exits=[]), "no-exit", "warning"),
        (file(entry=[], exits=[]), "empty", "warning"),
        (file(A | {"input_parameters": {"p": TEXT}}, B), "H7", "error"),
        (file(A, B | {"input_parameters": {"p": TEXT}}), "H8", "error"),
        (file(A | {"actor": "x"}, B | {"actor": "y"}), "actors", "warning"),
        (file(A, action("B", parents=[{"name": "A", "conditions": ["on_true -> restart", *SAFE]}])), "restart", "warning"),
        (
            file(A, action("B", parents=[{"name": "A", "required": False, "conditions": ["on_true -> pause", *SAFE]}]), entry=["A", "B"]),
            "H5", "warning",
        ),
    ],
)  # fmt: skip
def test_each_mistake_has_its_code(value: Any, code: str, severity: str) -> None:
    assert found(value).get(code) == severity


def test_a_way_back_that_is_required_is_named_and_can_be_mended() -> None:
    loop = file(
        action("A", parents=["B"], children=["B"]),
        action("B", parents=["A"], children=["A"]),
    )
    problem = next(p for p in problems(loop) if p.code == "H8")
    assert (problem.severity, problem.fix) == ("error", "not-required")
    assert problem.where.path == "/actions/0/parents/0"
    assert problem.where.relation == "a2>a1"
    assert "for ever" in problem.message
    loop["actions"][0]["parents"][0]["required"] = False
    assert "H8" not in found(loop)


def test_a_join_of_a_branch_that_never_runs_never_fires() -> None:
    graph = file(
        action("A", children=["C"]),
        action("B", children=["C"]),
        action("C", parents=["A", "B"]),
        exits=["C"],
    )
    assert found(graph) == {"H8": "error", "unreachable": "warning"}
    message = next(p.message for p in problems(graph) if p.code == "H8")
    assert "C_0 waits for B_0" in message


def test_two_branches_of_a_decision_that_the_exit_both_requires_are_found() -> None:
    graph = file(
        action("A", children=["B", "C"]),
        action("B", parents=[{"name": "A", "conditions": ["on_false -> ignore", *SAFE]}]),
        action("C", parents=[{"name": "A", "conditions": ["on_true -> ignore", *SAFE]}]),
        exits=["B", "C"],
    )
    found = [p for p in problems(graph) if p.code == "H8"]
    assert [(p.severity, p.where.path, p.fix) for p in found] == [
        ("error", "/graph_exit/1", "not-required"),
        ("warning", "/graph_exit/0", "not-required"),
    ]
    assert "If all goes well" in found[0].message
    assert "the exit waits for C_0, which then does not run" in found[0].message
    for end in graph["graph_exit"]:
        end["required"] = False
    assert problems(graph) == []


def test_a_loop_is_told_once_that_it_must_take_time() -> None:
    back = {"name": "B", "required": False, "conditions": ["on_false -> ignore", *SAFE]}
    graph = file(
        action("A", parents=[back], children=["B"]), action("B", parents=["A"], children=["A"])
    )
    (problem,) = [p for p in problems(graph) if p.code == "H5"]
    assert problem.severity == "warning"
    assert problem.message.startswith("A_0, B_0 are a loop. If all of them end at once")
    back["conditions"] = ["on_true -> ignore", "on_false -> ignore", *SAFE]
    assert "H5" not in found(graph)


@pytest.mark.parametrize(("said", "told"), [(True, False), (False, True), ("yes", True)])
def test_a_loop_of_an_action_that_is_said_to_take_time_is_none_without_time(
    said: object, told: bool
) -> None:
    back = {"name": "B", "required": False, "conditions": ["on_false -> ignore", *SAFE]}
    slow = action("A", parents=[back], children=["B"], gui_attributes={"takes_time": said})
    graph = file(slow, action("B", parents=["A"], children=["A"]))
    assert ("H5" in found(graph)) is told


@pytest.mark.parametrize("response", ["stop", "pause", "restart"])
def test_a_response_that_does_nothing_leaves_the_graph_running_for_ever(response: str) -> None:
    ask = {"name": "A", "conditions": [f"on_false -> {response}", *SAFE]}
    messages = [p.message for p in problems(file(A, action("B", parents=[ask]))) if p.code == "H8"]
    assert messages == [
        "If A_0 ends with on_false, the graph stays RUNNING for ever: nothing runs any more."
    ]


def test_a_spontaneous_action_before_a_loop_is_an_error() -> None:
    back = {"name": "C", "required": False, "conditions": SAFE}
    graph = file(
        action("A", children=["B"], type="spontaneous"),
        action("B", parents=["A", back], children=["C"]),
        action("C", parents=["B"], children=["B"]),
        exits=["C"],
    )
    assert found(graph)["H9"] == "error"


def test_a_graph_that_may_finish_while_others_run_is_warned_of() -> None:
    graph = file(
        action("A"), action("B"), entry=["A", "B"],
        exits=[{"name": "A", "required": False}, {"name": "B", "required": False}],
    )  # fmt: skip
    assert found(graph)["H12"] == "warning"


def test_renaming_what_does_not_exist_is_an_error_of_that_relation() -> None:
    remap = [{"from": "nope", "to": "p"}]
    graph = file(action("A", children=[{"name": "B", "remap": remap}]), B)
    problem = next(p for p in problems(graph) if p.code == "H2")
    assert problem.where.path == "/actions/0/children/0/remap"
    assert "aborts" in problem.message


def test_renaming_that_changes_the_order_of_outputs_loses_one() -> None:
    remap = [{"from": "alpha", "to": "zeta"}]
    outputs = {"alpha": TEXT, "beta": TEXT}
    graph = file(
        action("A", children=[{"name": "B", "remap": remap}], output_parameters=outputs),
        B | {"input_parameters": {"beta": TEXT, "zeta": TEXT}},
    )
    assert found(graph)["remap-order"] == "error"
    fits = file(
        action("A", children=[{"name": "B", "remap": [{"from": "alpha", "to": "aleph"}]}],
               output_parameters=outputs),
        B | {"input_parameters": {"beta": TEXT, "aleph": TEXT}},
    )  # fmt: skip
    assert problems(fits) == []


@given(st.dictionaries(st.sampled_from("abcdefg"), st.sampled_from("ABCDmnopqrst"), min_size=1))
@settings(max_examples=examples(60))
def test_renamings_that_hide_outputs_from_the_engine_are_errors(renamings: dict[str, str]) -> None:
    remap = [{"from": source, "to": target} for source, target in renamings.items()]
    outputs = {name: TEXT for name in "abcdefg"}  # noqa: C420 - values of JSON
    first = action("A", children=[{"name": "B", "remap": remap}], output_parameters=outputs)
    graph = file(first, B)
    trace = list(simulate(read(json.dumps(graph)).graph))
    crashed = any(isinstance(t, HazardEvent) and t.effect == "crash" for t in trace)
    assert ("H2" in found(graph)) == crashed


def test_renaming_several_outputs_out_of_order_aborts_the_engine() -> None:
    remap = [{"from": name, "to": f"z{name}"} for name in "abcd"]
    outputs = {name: TEXT for name in "abcd"}  # noqa: C420 - values of JSON
    first = action("A", children=[{"name": "B", "remap": remap}], output_parameters=outputs)
    (problem,) = [p for p in problems(file(first, B)) if p.code == "H2"]
    assert "does not find" in problem.message


def test_a_library_knows_names_types_and_what_is_optional() -> None:
    known = {"A": Signature(inputs={"p": "string"}, optional=frozenset({"p"})), "B": Signature()}
    assert found(file(A | {"input_parameters": {"p": TEXT}}, B), known) == {}
    assert found(file(A, B), known) == {"signature": "error"}
    number = A | {"input_parameters": {"p": {"pvf_type": "number", "pvf_value": 1}}}
    assert found(file(number, B), known) == {"parameter-type": "error"}
    assert found(file(A, B), {"A": Signature()}) == {"unknown-action": "warning"}


def test_structural_errors_block_whatever_is_overridden() -> None:
    twice = problems(file(A, B, B))
    assert {p.code for p in blocking(twice, overridden=["H6", "H2b"])} == {"H6"}
    silent = problems(file(A | {"input_parameters": {"p": TEXT}}, B))
    assert blocking(silent, overridden=["H7"]) == []
    assert {p.code for p in blocking(silent)} == {"H7"}


def test_facts_decide_which_hazards_there_are() -> None:
    fixed = msgspec.structs.replace(PINNED, bypass_fixed=True, synchronises=True)
    value = file(A | {"actor": "x"}, action("B", parents=[{"name": "A"}]) | {"actor": "y"})
    graph = read(json.dumps(value)).graph
    assert {p.code for p in check(graph)} == {"H3", "actors"}
    assert [p.code for p in check(graph, None, fixed)] == ["synchroniser"]
    assert check(graph, None, SIMULATED) == []


def test_the_first_thousand_of_equal_problems_are_reported() -> None:
    many = [{"name": f"Z{i}"} for i in range(5_000)]
    graph = file(A | {"children": [{"name": "B"}, *many]}, B)
    assert [p.code for p in problems(graph)] == ["ghost"] * 1_000


def test_errors_come_first_and_every_path_leads_somewhere() -> None:
    found_ = problems(file(A, B, B, action("C"), exits=[]))
    severities = [problem.severity for problem in found_]
    assert severities == sorted(severities)
    assert all(problem.where.path.startswith("/") for problem in found_ if problem.where.aid)


@given(graphs())
@settings(max_examples=examples(150))
def test_any_graph_is_checked(graph: Graph) -> None:
    for problem in check(graph):
        assert problem.message
        assert problem.severity in ("error", "warning")


@given(graphs())
@settings(max_examples=examples(150))
def test_an_action_that_check_says_never_runs_does_not_run(graph: Graph) -> None:
    never = {
        problem.where.aid
        for problem in check(graph)
        if problem.code in ("unreachable", "never-run") and problem.where.aid
    }
    names = {action.full_name for action in graph.actions if action.key in never}
    for trace in simulate(graph, max_events=500):
        if isinstance(trace, HazardEvent) and trace.effect == "crash":
            return
        assert not (isinstance(trace, NodeStateEvent) and trace.node in names)


@pytest.mark.long
def test_checking_ten_thousand_actions_costs_no_more_than_their_number() -> None:
    def checking(size: int) -> Callable[[], None]:
        names = [f"A{i}" for i in range(size)]
        actions = [
            action(name, parents=names[i - 1 : i], children=names[i + 1 : i + 2])
            for i, name in enumerate(names)
        ]
        graph = read(json.dumps(file(*actions, entry=names[:1], exits=names[-1:]))).graph

        def work() -> None:
            assert check(graph) == []

        return work

    grows_with_its_size(checking, 10_000)


# The engine's own verdicts


def test_we_refuse_exactly_what_the_engines_parser_refuses() -> None:
    differing = []
    cases = lines(family("engine") / "validation.jsonl")
    assert cases
    for case in cases:
        if case["case"].startswith("action:"):
            continue
        try:
            refused = [p for p in check_reading(read(case["input"])) if p.code in STRUCTURAL]
        except Unreadable:
            refused = [Problem(code="unreadable", severity="error", where=None, message="")]  # type: ignore[arg-type]
        if bool([p for p in refused if p.severity == "error"]) == case["accepted"]:
            differing.append(case["case"])
    assert differing == []


def accepted() -> list[Path]:
    verdicts = lines(CORPUS / "verdicts.jsonl")
    return [
        CORPUS / v["file"] for v in verdicts if v["accepted"] and v["file"].startswith("graphs/")
    ]


@pytest.mark.skipif(not accepted(), reason=NO_CORPUS)
def test_real_graphs_that_the_engine_reads_are_blocked_for_what_it_does_then() -> None:
    """Errors are only hazards that the engine's source or a recording shows, never refusals of
    its parser."""
    certain = {"H1", "H2", "H2b", "H7", "H8", "H12", "actors"}
    for path in accepted():
        reading = read(path.read_bytes())
        assert refused_by_parser(reading) == []
        assert {p.code for p in check_reading(reading) if p.severity == "error"} <= certain


@pytest.mark.parametrize("name", facts("engine").get("ran", ()))
def test_graphs_that_the_engine_ran_are_not_blocked(name: str) -> None:
    folder = engine_runs().get(name)
    if folder is None:
        pytest.skip("runs of graphs of other repositories are not here (UMRF_SHARED)")
    reading = read((folder / f"{name}.graph.json").read_bytes())
    assert blocking(check_reading(reading)) == []
