"""Commands to the simulated engine: stop, pause, resume, and starts of a graph that it already
has."""

import pytest

from action_assistant.umrf.model import Conditions
from action_assistant.umrf.semantics import (
    Behaviour,
    Engine,
    GraphRefused,
    HazardEvent,
    simulate,
)
from umrf.semantics.traces import graph_of, graph_states, hazards, script, states


def test_a_stop_stops_running_actions_and_starts_none() -> None:
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
