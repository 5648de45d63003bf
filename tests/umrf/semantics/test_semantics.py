"""The simulated engine, rule by rule; the recordings are compared elsewhere.

See docs/umrf-and-the-engine.md 2.
"""

import json
from collections.abc import Callable

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.umrf.files.codec import read
from action_assistant.umrf.model import RESPONSES, Conditions, Graph
from action_assistant.umrf.semantics import (
    Behaviour,
    HazardEvent,
    NodeStateEvent,
    Script,
    Trace,
    script_from,
    simulate,
)
from strategies import graphs
from support.doses import examples
from support.growth import grows_with_its_size
from umrf.semantics.traces import graph_of, graph_states, hazards, optional, results, script, states


def test_a_sequence_runs_one_after_the_other_and_finishes() -> None:
    traces = list(simulate(graph_of("entry>A", "A>B", "B>exit")))
    assert states(traces, "A") == states(traces, "B") == ["INITIALIZED", "RUNNING", "FINISHED"]
    assert graph_states(traces) == ["UNINITIALIZED", "RUNNING", "FINISHED"]
    assert results(traces) == ["on_true"]
    assert traces[-1] == NodeStateEvent(2000.0, "g", "B_0", "FINISHED")


def test_a_join_waits_for_all_required_parents_and_the_last_one_decides() -> None:
    graph = graph_of("entry>A", "entry>B", "A>C", "B>C", "C>exit", BC=Conditions("ignore"))
    slow_b = script(B=[Behaviour(after_s=2)])
    assert states(list(simulate(graph, script=slow_b)), "C") == []
    slow_a = script(A=[Behaviour(after_s=2)])
    traces = list(simulate(graph, script=slow_a))
    assert states(traces, "C") == ["INITIALIZED", "RUNNING", "FINISHED"]


def test_a_parent_that_is_not_required_runs_the_child_again() -> None:
    graph = optional(graph_of("entry>A", "entry>B", "A>C", "B>C", "C>D", "D>exit"), "A>C", "B>C")
    calls = script(B=[Behaviour(after_s=2.5)], D=[Behaviour(after_s=9)])
    traces = list(simulate(graph, script=calls))
    assert states(traces, "C").count("RUNNING") == 2


def test_a_parent_that_has_reported_counts_in_every_lap() -> None:
    graph = optional(
        graph_of("entry>A", "entry>B", "A>C", "B>C", "C>A", "C>exit", CA=Conditions("run"),
                 Cexit=Conditions("ignore", "run")),
        "C>A",
    )  # fmt: skip
    again = script(C=[Behaviour(), Behaviour(), Behaviour(result="on_false")])
    traces = list(simulate(graph, script=again))
    assert states(traces, "B").count("RUNNING") == 1
    assert states(traces, "C").count("RUNNING") == 3
    assert results(traces) == ["on_false"]


def test_a_bypass_passes_the_result_on_and_is_a_hazard() -> None:
    graph = graph_of("entry>A", "A>B", "B>C", "C>exit", AB=Conditions("run", "bypass"))
    traces = list(simulate(graph, script=script(A=[Behaviour(result="on_false")])))
    assert states(traces, "B") == []
    assert states(traces, "C") == ["INITIALIZED", "RUNNING", "FINISHED"]
    assert hazards(traces) == ["H3"]


def test_a_bypass_into_the_exit_ends_the_graph_at_once() -> None:
    graph = graph_of(
        "entry>A", "entry>B", "A>exit", "B>exit", Aexit=Conditions("run", "run", "bypass")
    )
    calls = script(A=[Behaviour(result="on_error")], B=[Behaviour(after_s=5)])
    traces = list(simulate(graph, script=calls))
    assert results(traces) == ["on_error"]
    assert hazards(traces) == ["H12"]
    assert states(traces, "B") == ["INITIALIZED", "RUNNING", "FINISHED"]
    assert graph_states(traces)[-1] == "FINISHED"


def test_a_graph_is_halted_when_everybody_ignores_and_nothing_runs() -> None:
    traces = list(simulate(graph_of("entry>A", "A>exit", Aexit=Conditions())))
    assert graph_states(traces)[-1] == "HALTED"
    assert results(traces) == []


def test_a_graph_that_nothing_can_move_any_more_is_said_to_be_stuck() -> None:
    graph = graph_of("entry>A", "A>C", "B>C", "C>exit")
    traces = list(simulate(graph))
    assert graph_states(traces)[-1] == "RUNNING"
    assert hazards(traces) == ["H8"]


def test_children_of_an_error_start_after_the_error_is_known() -> None:
    graph = graph_of("entry>A", "A>B", "B>exit", AB=Conditions("ignore", "ignore", "run"))
    traces = list(simulate(graph, script=script(A=[Behaviour(result="on_error")])))
    kinds = [(t.node, t.state) for t in traces if isinstance(t, NodeStateEvent)]
    assert kinds.index(("A_0", "ERROR")) < kinds.index(("B_0", "RUNNING"))
    assert results(traces) == ["on_true"]


# Sub-graphs


def test_a_sub_graph_runs_under_the_name_of_its_place() -> None:
    inner = msgspec.structs.replace(graph_of("entry>X", "X>exit"), name="B")
    traces = list(simulate(graph_of("entry>A", "A>B", "B>exit"), library={"B": inner}))
    assert graph_states(traces, "g__B__0") == ["UNINITIALIZED", "RUNNING", "FINISHED"]
    assert states(traces, "B") == ["RUNNING", "FINISHED"]
    assert results(traces) == ["on_true", "on_true"]


def test_the_last_action_never_ends_in_a_sub_graph_whose_pause_hangs() -> None:
    """A get that comes meanwhile waits for the pause, and holds the lock that the end would
    need."""
    inner = msgspec.structs.replace(graph_of("entry>X", "X>exit"), name="B")
    outer = graph_of("entry>B", "B>exit")
    traces = list(simulate(outer, library={"B": inner}, commands=[(500, "pause", None)]))
    assert graph_states(traces, "g__B__0")[-1] == "FINISHED"
    assert results(traces) == ["on_true"]
    assert states(traces, "X") == ["INITIALIZED", "RUNNING"]
    assert states(traces, "B") == ["RUNNING", "PAUSE_REQUESTED"]


def test_a_pause_that_hangs_deep_inside_is_shown_running_at_each_level() -> None:
    inner = msgspec.structs.replace(graph_of("entry>X", "X>Y", "Y>exit"), name="C")
    middle = msgspec.structs.replace(graph_of("entry>C", "C>exit"), name="B")
    traces = list(
        simulate(
            graph_of("entry>B", "B>exit"),
            library={"B": middle, "C": inner},
            commands=[(500, "pause", None)],
        )
    )
    assert states(traces, "X")[-1] == "FINISHED"
    assert states(traces, "Y") == ["INITIALIZED", "RUNNING"]
    assert states(traces, "C") == ["RUNNING"]
    assert states(traces, "B") == ["RUNNING", "PAUSE_REQUESTED"]
    assert results(traces) == ["on_true"]  # of the innermost graph alone


def test_scripts_reach_into_sub_graphs_and_the_closest_key_wins() -> None:
    inner = msgspec.structs.replace(graph_of("entry>X", "X>exit"), name="B")
    calls = script_from(
        {"behaviours": {"X": [{"after_s": 1}], "B/X_0": [{"after_s": 2}], "g__B__0/X_0": [{"after_s": 3}]}}
    )  # fmt: skip
    traces = list(simulate(graph_of("entry>B", "B>exit"), library={"B": inner}, script=calls))
    assert traces[-1].t_ms == 3000


def test_a_graph_that_contains_itself_is_refused() -> None:
    inner = msgspec.structs.replace(graph_of("entry>B", "B>exit"), name="B")
    traces = list(simulate(graph_of("entry>B", "B>exit"), library={"B": inner}))
    assert hazards(traces) == ["refused"]
    assert graph_states(traces) == []


# Parameters


@pytest.mark.parametrize(
    ("output", "renamed", "arrives"),
    [("text", False, True), ("other", False, False), ("other", True, True)],
)
def test_an_output_reaches_the_input_of_its_name(output: str, renamed: bool, arrives: bool) -> None:
    remap = [{"from": output, "to": "text"}] if renamed else []
    text = {"pvf_type": "string"}
    file = {
        "graph_name": "g",
        "graph_entry": [{"name": "A"}],
        "graph_exit": [{"name": "B"}],
        "actions": [
            {"name": "A", "type": "sync", "output_parameters": {output: text},
             "children": [{"name": "B", "remap": remap}]},
            {"name": "B", "type": "sync", "input_parameters": {"text": text},
             "parents": [{"name": "A"}]},
        ],
    }  # fmt: skip
    traces = list(simulate(read(json.dumps(file)).graph))
    assert (results(traces) == ["on_true"]) == arrives
    assert (hazards(traces) == ["H8"]) != arrives


def test_an_entry_without_its_input_never_starts() -> None:
    text = """{"graph_name": "g", "actions": [{"name": "A", "type": "sync",
      "input_parameters": {"p": {"pvf_type": "string"}}}]}"""
    traces = list(simulate(read(text).graph))
    assert graph_states(traces) == ["UNINITIALIZED"]
    assert hazards(traces) == ["H7"]


# Scripts


@pytest.mark.parametrize(
    ("value", "place"),
    [
        ([], "behaviours"),
        ({"behavior": {}}, "behavior"),
        ({"behaviours": {"A": {}}}, "behaviours/A"),
        ({"behaviours": {"A": []}}, "behaviours/A"),
        ({"behaviours": {"A": [{"after": 1}]}}, "behaviours/A/0"),
        ({"behaviours": {"A": [{}, {"after_s": "x"}]}}, "behaviours/A/1"),
        ({"behaviours": {"A": [{"result": "true"}]}}, "behaviours/A/0/result"),
        ({"behaviours": {"A": [{"after_s": -1}]}}, "behaviours/A/0"),
    ],
)
def test_a_wrong_script_names_the_place(value: object, place: str) -> None:
    with pytest.raises(ValueError, match=place):
        script_from(value)


def test_null_in_a_script_means_the_default() -> None:
    script = script_from({"behaviours": {"A": [{"after_s": None, "result": None, "never": True}]}})
    assert script.behaviours["A"] == (Behaviour(never=True),)


# Any graph


@given(graphs(), st.sampled_from(RESPONSES), st.booleans())
@settings(max_examples=examples(150))
def test_any_graph_gives_one_trace_that_ends(graph: Graph, response: str, error: bool) -> None:
    calls = Script({"*": (Behaviour(result="on_error" if error else "on_true"),)})
    commands = [(1500.0, "pause", None), (2500.0, "resume", None), (4000.0, "stop", None)]

    def run() -> list[Trace]:
        return list(
            simulate(graph, script=calls, commands=commands, until_ms=100_000, max_events=3_000)
        )

    traces = run()
    assert traces == run()
    times = [trace.t_ms for trace in traces]
    assert times == sorted(times)
    assert [t for t in traces if isinstance(t, HazardEvent) and t.effect == "crash"] in (
        [],
        traces[-1:],
    )


def test_a_day_of_work_is_simulated_at_the_same_pace_to_its_end() -> None:
    graph = optional(graph_of("entry>A", "A>B", "B>A", "B>exit", Bexit=Conditions()), "B>A")
    assert len(list(simulate(graph))) == 100_001  # the last one says that it was cut off

    def simulating(events: int) -> Callable[[], object]:
        return lambda: sum(1 for _ in simulate(graph, max_events=events))

    grows_with_its_size(simulating, 100_000)
