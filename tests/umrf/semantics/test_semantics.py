"""The simulated engine, rule by rule; the recordings are compared elsewhere.

See docs/umrf-and-the-engine.md 2.
"""

import json
import time

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files.codec import read
from action_assistant.umrf.model import ENTRY, EXIT, RESPONSES, Action, Conditions, Graph, Relation
from action_assistant.umrf.semantics import (
    Behaviour,
    Engine,
    GraphRefused,
    GraphResultEvent,
    GraphStateEvent,
    HazardEvent,
    NodeStateEvent,
    Script,
    Trace,
    script_from,
    simulate,
)
from strategies import graphs
from support.doses import examples

RUN = Conditions("run", "run", "run", "ignore")


def graph_of(*arrows: str, **conditions: Conditions) -> Graph:
    """`graph_of("entry>A", "A>B", "B>exit", AB=…)`: actions by their names, `RUN` on all arrows."""
    names = dict.fromkeys(n for a in arrows for n in a.split(">") if n not in (ENTRY, EXIT))
    relations = []
    for place, arrow in enumerate(arrows):
        parent, child = arrow.split(">")
        answers = conditions.get(f"{parent}{child}", RUN)
        order = float(place)
        relations.append(
            Relation(
                parent=parent,
                child=child,
                conditions=answers,
                parent_order=order,
                child_order=order,
            )
        )
    actions = tuple(Action(key=name, name=name) for name in names)
    return Graph(name="g", actions=actions, relations=tuple(relations))


def optional(graph: Graph, *arrows: str) -> Graph:
    """The same graph, where these relations are not required."""
    changed = tuple(
        msgspec.structs.replace(r, required=f"{r.parent}>{r.child}" not in arrows)
        for r in graph.relations
    )
    return msgspec.structs.replace(graph, relations=changed)


def states(traces: list[Trace], node: str) -> list[str]:
    return [t.state for t in traces if isinstance(t, NodeStateEvent) and t.node == f"{node}_0"]


def graph_states(traces: list[Trace], graph: str = "g") -> list[str]:
    return [t.state for t in traces if isinstance(t, GraphStateEvent) and t.graph == graph]


def hazards(traces: list[Trace]) -> list[str]:
    return [t.code for t in traces if isinstance(t, HazardEvent)]


def results(traces: list[Trace]) -> list[str]:
    return [t.value for t in traces if isinstance(t, GraphResultEvent)]


def script(**calls: list[Behaviour]) -> Script:
    return Script({name: tuple(behaviours) for name, behaviours in calls.items()})


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


def test_what_was_received_stays_received_in_a_loop() -> None:
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


# Commands


def test_a_stop_stops_what_runs_and_starts_nothing() -> None:
    commands = [(500.0, "stop", None)]
    traces = list(simulate(graph_of("entry>A", "A>B", "B>exit"), commands=commands))
    assert states(traces, "A") == ["INITIALIZED", "RUNNING", "STOPPING", "FINISHED"]
    assert states(traces, "B") == []
    assert graph_states(traces)[-2:] == ["STOPPING", "STOPPED"]
    assert traces[-1].t_ms == 550.0


def test_an_action_that_ignores_the_stop_is_in_error_after_five_seconds() -> None:
    calls = script(A=[Behaviour(never=True, ignores_stop=True)])
    commands = [(500.0, "stop", None)]
    traces = list(simulate(graph_of("entry>A", "A>exit"), script=calls, commands=commands))
    assert states(traces, "A")[-2:] == ["STOPPING", "ERROR"]
    assert graph_states(traces)[-1] == "ERROR"
    assert traces[-1].t_ms == pytest.approx(5500, abs=60)


def test_a_paused_action_takes_up_where_it_was() -> None:
    commands = [(400.0, "pause", None), (3000.0, "resume", None)]
    traces = list(simulate(graph_of("entry>A", "A>exit"), commands=commands))
    expected = ["INITIALIZED", "RUNNING", "PAUSE_REQUESTED", "PAUSED", "RUNNING", "FINISHED"]
    assert states(traces, "A") == expected
    assert graph_states(traces) == ["UNINITIALIZED", "RUNNING", "PAUSED", "RUNNING", "FINISHED"]
    assert traces[-1].t_ms == 3600.0


def test_a_stop_of_a_paused_action_takes_five_seconds_and_fails() -> None:
    commands = [(400.0, "pause", None), (1000.0, "stop", None)]
    traces = list(simulate(graph_of("entry>A", "A>exit"), commands=commands))
    assert states(traces, "A")[-2:] == ["STOPPING", "ERROR"]
    assert graph_states(traces)[-1] == "ERROR"
    assert hazards(traces) == ["H5"]


def test_a_pause_that_an_action_does_not_handle_locks_the_engine() -> None:
    engine = Engine(script=script(A=[Behaviour(pauses=False)]))
    engine.start(graph_of("entry>A", "A>exit"), 0)
    assert hazards(engine.pause("g", 100))[-1] == "H5"
    assert engine.locked
    assert engine.stop("g", 200) == []


def test_two_stops_over_ros_wait_for_each_other_and_two_calls_kill() -> None:
    graph = graph_of("entry>A", "A>exit")
    engine = Engine()
    engine.start(graph, 0)
    traces = engine.stop("g", 100) + engine.stop("g", 105) + engine.advance(1000)
    assert graph_states(traces) == ["STOPPING", "STOPPED"]
    commands = [(100.0, "stop", None), (105.0, "stop", None)]
    traces = list(simulate(graph, commands=commands))
    assert hazards(traces) == ["H4"]
    assert isinstance(traces[-1], HazardEvent)


def test_a_start_of_a_running_graph_is_refused_and_stops_it() -> None:
    engine = Engine()
    graph = graph_of("entry>A", "A>exit")
    engine.start(graph, 0)
    with pytest.raises(GraphRefused, match="already active"):
        engine.start(graph, 100)
    assert graph_states(engine.advance(1000))[-1] == "STOPPED"


def test_a_finished_graph_starts_again_from_scratch() -> None:
    engine = Engine()
    graph = graph_of("entry>A", "A>exit")
    engine.start(graph, 0)
    engine.advance(5000)
    traces = engine.start(graph, 6000) + engine.advance(9000)
    assert graph_states(traces)[:4] == ["CLEARING", "UNINITIALIZED", "UNINITIALIZED", "RUNNING"]
    assert states(traces, "A") == ["INITIALIZED", "RUNNING", "FINISHED"]


def test_a_halted_graph_is_stopped_before_it_starts_again() -> None:
    halts = graph_of("entry>A", "A>exit", Aexit=Conditions())
    engine = Engine()
    traces = engine.start(halts, 0) + engine.advance(2_000)
    assert graph_states(traces) == ["UNINITIALIZED", "RUNNING", "HALTED"]
    again = engine.start(halts, 2_000)
    assert graph_states(again) == ["STOPPING", "STOPPED", "CLEARING"] + ["UNINITIALIZED"] * 2 + ["RUNNING"]  # fmt: skip


def test_due_tells_when_something_happens_next() -> None:
    engine = Engine()
    engine.start(graph_of("entry>A", "A>exit"), 100)
    assert engine.due == 1100
    engine.advance(1100)
    assert engine.due is None
    assert engine.states()["g"].state == "FINISHED"
    assert engine.states()["g"].nodes == {"A_0": "FINISHED"}


# Hazards


def test_a_run_on_a_paused_action_kills_the_engine() -> None:
    graph = optional(graph_of("entry>A", "entry>B", "entry>C", "A>C", "B>C", "C>exit",
                              AC=Conditions("pause"), BC=Conditions("run")), "A>C", "B>C")  # fmt: skip
    calls = script(A=[Behaviour(after_s=0.2)], B=[Behaviour(after_s=0.5)])
    traces = list(simulate(graph, script=calls))
    assert hazards(traces) == ["H4"]
    assert traces[-1].t_ms == 500


def test_two_actions_without_duration_in_a_loop_lock_the_engine() -> None:
    graph = optional(graph_of("entry>A", "A>B", "B>A", "B>exit", Bexit=Conditions()), "B>A")
    traces = list(simulate(graph, script=Script({"*": (Behaviour(after_s=0),)})))
    assert hazards(traces) == ["H5"]


def test_a_bypass_in_circles_locks_the_engine_and_ends_the_trace() -> None:
    round_ = Conditions("run", "run", "bypass")
    graph = optional(graph_of("entry>A", "A>B", "B>A", AB=round_, BA=round_), "B>A")
    traces = list(simulate(graph, script=script(B=[Behaviour(result="on_error")])))
    assert isinstance(traces[-1], HazardEvent)
    assert (traces[-1].code, traces[-1].effect) == ("H3", "hang")


def test_an_action_that_cannot_be_loaded_in_a_loop_ends_the_trace() -> None:
    graph = optional(graph_of("entry>A", "A>B", "B>A"), "B>A")
    traces = list(simulate(graph, script=Script({"*": (Behaviour(init_error=True),)})))
    assert hazards(traces) == ["H5"]


def test_a_spontaneous_action_before_a_loop_kills_the_engine() -> None:
    graph = optional(graph_of("entry>A", "A>B", "B>C", "C>B", "C>exit"), "C>B")
    first = msgspec.structs.replace(graph.actions[0], type="spontaneous")
    graph = msgspec.structs.replace(graph, actions=(first, *graph.actions[1:]))
    assert hazards(list(simulate(graph))) == ["H9"]


def test_an_action_whose_file_said_it_was_finished_kills_the_engine() -> None:
    text = (
        """{"graph_name": "g", "actions": [{"name": "A", "type": "sync", "state": "FINISHED"}]}"""
    )
    reading = read(text)
    traces = list(simulate(reading.graph, states=reading.states))
    assert states(traces, "A") == ["RUNNING"]
    assert hazards(traces) == ["H1"]


@pytest.mark.parametrize(
    ("state", "shown"),
    [
        ("INITIALIZED", ["RUNNING"]), ("FINISHED", ["RUNNING"]), ("ERROR", ["RUNNING"]),
        ("BYPASSED", []), ("PAUSED", []), ("STOPPING", []), ("PAUSE_REQUESTED", []),
    ],
)  # fmt: skip
def test_an_action_whose_file_says_a_state_that_cannot_run_dies_before_it_runs(
    state: str, shown: list[str]
) -> None:
    traces = list(simulate(graph_of("entry>A", "A>B", "B>exit"), states={"B": state}))
    assert states(traces, "B") == shown
    assert (hazards(traces)[-1], traces[-1].effect) == ("H1", "crash")  # type: ignore[union-attr]


def test_a_graph_of_several_actors_is_refused_where_engines_do_not_synchronise() -> None:
    graph = graph_of("entry>A", "A>B", "B>exit")
    actions = tuple(msgspec.structs.replace(a, actor=a.name) for a in graph.actions)
    graph = msgspec.structs.replace(graph, actions=actions)
    with pytest.raises(GraphRefused, match="synchronizer"):
        Engine(facts=PINNED).start(graph, 0)
    assert hazards(list(simulate(graph))) == ["refused"]


def test_an_action_with_the_name_of_an_end_is_none() -> None:
    graph = graph_of("entry>graph_entry", "graph_entry>A", "A>exit")
    traces = list(simulate(graph))
    assert hazards(traces) == ["H6", "refused"]
    assert graph_states(traces) == ["UNINITIALIZED"]
    third = tuple(
        msgspec.structs.replace(a, instance_id=3 if a.name == "graph_entry" else 0)
        for a in graph.actions
    )
    traces = list(simulate(msgspec.structs.replace(graph, actions=third)))
    assert graph_states(traces) == ["UNINITIALIZED", "RUNNING"]
    assert [t.node for t in traces if isinstance(t, NodeStateEvent)] == []
    assert hazards(traces) == ["H8"]


# Sub-graphs


def test_a_sub_graph_runs_under_the_name_of_its_place() -> None:
    inner = msgspec.structs.replace(graph_of("entry>X", "X>exit"), name="B")
    traces = list(simulate(graph_of("entry>A", "A>B", "B>exit"), library={"B": inner}))
    assert graph_states(traces, "g__B__0") == ["UNINITIALIZED", "RUNNING", "FINISHED"]
    assert states(traces, "B") == ["RUNNING", "FINISHED"]
    assert results(traces) == ["on_true", "on_true"]


def test_in_a_sub_graph_whose_pause_hangs_the_last_action_never_ends() -> None:
    """Whoever asks the engine meanwhile waits for the pause, and holds what the end would need."""
    inner = msgspec.structs.replace(graph_of("entry>X", "X>exit"), name="B")
    outer = graph_of("entry>B", "B>exit")
    traces = list(simulate(outer, library={"B": inner}, commands=[(500, "pause", None)]))
    assert graph_states(traces, "g__B__0")[-1] == "FINISHED"
    assert results(traces) == ["on_true"]
    assert states(traces, "X") == ["INITIALIZED", "RUNNING"]
    assert states(traces, "B") == ["RUNNING", "PAUSE_REQUESTED"]


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


def test_a_day_of_work_is_simulated_in_a_moment() -> None:
    graph = optional(graph_of("entry>A", "A>B", "B>A", "B>exit", Bexit=Conditions()), "B>A")
    started = time.process_time()
    traces = list(simulate(graph))
    assert len(traces) == 100_001  # the last one says that it was cut off
    assert time.process_time() - started < 2
