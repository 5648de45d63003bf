"""Graphs that kill or block the simulated engine, or that it refuses."""

import msgspec
import pytest

from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files.codec import read
from action_assistant.umrf.model import Conditions
from action_assistant.umrf.semantics import (
    Behaviour,
    Engine,
    GraphRefused,
    HazardEvent,
    NodeStateEvent,
    Script,
    simulate,
)
from umrf.semantics.traces import graph_of, graph_states, hazards, optional, script, states


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
    assert hazards(list(simulate(graph, facts=PINNED))) == ["refused"]
    assert graph_states(list(simulate(graph)))[-1] == "FINISHED"


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
