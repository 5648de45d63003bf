"""Actions that still load: what the engine does with a graph that does not count them as running.

The real node ended `leaf_beside_loading` HALTED in 3 of 3 runs, and OxSlowInit then moved.
"""

from pathlib import Path

import pytest
from msgspec.structs import replace

from action_assistant.umrf.check import blocking, check
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files.codec import read
from action_assistant.umrf.model import Conditions, Graph
from action_assistant.umrf.semantics import (
    Behaviour,
    Engine,
    HazardEvent,
    NodeStateEvent,
    Script,
    script_from,
    simulate,
)
from umrf.semantics.traces import graph_of, graph_states, hazards, optional, script, states

CASE = Path(__file__).parent.parent / "cases" / "leaf_beside_loading.graph.json"
SLOW = script_from(
    {
        "behaviours": {
            "OxWork_0": [{"after_s": 0.2}],
            "OxWork_1": [{"after_s": 0.01}],
            "OxSlowInit": [{"load_s": 1.5, "after_s": 0.2}],
        }
    }
)


def leaf_beside_loading() -> Graph:
    return replace(read(CASE.read_text()).graph, name="g")


def told(graph: Graph, code: str) -> list[str]:
    return [problem.message for problem in check(graph) if problem.code == code]


def test_a_leaf_beside_a_loading_action_halts_the_graph_and_the_action_moves_then() -> None:
    traces = list(simulate(leaf_beside_loading(), script=SLOW))
    assert graph_states(traces) == ["UNINITIALIZED", "RUNNING", "HALTED"]
    assert states(traces, "OxSlowInit") == ["INITIALIZED", "RUNNING", "FINISHED"]
    assert not any(getattr(t, "node", "") == "OxWork_2" for t in traces)
    halted = next(t.t_ms for t in traces if isinstance(t, HazardEvent) and t.code == "H14")
    begun = [t.t_ms for t in traces if isinstance(t, NodeStateEvent) and t.state == "RUNNING"]
    assert (halted, begun[-1]) == (210, 1_700)


def test_an_action_that_has_loaded_when_the_leaf_ends_keeps_the_graph_running() -> None:
    quick = script_from({"behaviours": {"OxWork_1": [{"after_s": 2}], "*": [{"load_s": 0.01}]}})
    traces = list(simulate(leaf_beside_loading(), script=quick))
    assert graph_states(traces)[-1] == "FINISHED"
    assert hazards(traces) == []


def test_the_check_tells_that_a_leaf_may_halt_the_graph_beside_what_loads() -> None:
    graph = leaf_beside_loading()
    (message,) = told(graph, "H14")
    assert "OxWork_1 ends with on_true while one of OxSlowInit_0, OxWork_2 still loads" in message
    assert blocking(check(graph)) == []
    repaired = replace(PINNED, hazards=PINNED.hazards - {"H14"})
    assert "H14" not in {each.code for each in check(graph, None, repaired)}


def test_ends_that_all_lead_on_halt_nothing() -> None:
    every = Conditions("run", "run", "run")
    graph = graph_of("entry>A", "A>B", "A>C", "B>exit", "C>exit",
                     AB=every, AC=every, Bexit=every, Cexit=every)  # fmt: skip
    assert told(graph, "H14") == []


def test_a_branch_whose_errors_are_ignored_is_no_warning() -> None:
    """Nearly every fork would have one."""
    ignores = Conditions("run", "run", "ignore")
    graph = graph_of("entry>A", "A>B", "A>C", "B>D", "C>D", "D>exit",
                     AB=ignores, AC=ignores, BD=ignores, CD=ignores)  # fmt: skip
    assert told(graph, "H14") == []


def test_a_sub_graph_runs_at_once_so_that_a_leaf_beside_it_halts_nothing() -> None:
    def beside(name: str) -> Graph:
        every = Conditions("run", "run", "run")
        graph = graph_of("entry>A", "A>B", "A>C", "C>exit", AB=every, AC=every, Cexit=every)
        first, second, third = graph.actions
        return replace(graph, actions=(first, second, replace(third, name=name)))

    inner = replace(graph_of("entry>A", "A>exit"), name="Inner")
    found = check(beside("Inner"), None, PINNED, {"Inner": inner})
    assert "H14" not in {problem.code for problem in found}
    assert "H14" in {problem.code for problem in check(beside("C"))}


def test_a_stop_does_not_reach_a_loading_action_and_reports_it() -> None:
    graph = graph_of("entry>A", "A>exit")
    slow = script(A=[Behaviour(load_s=3.0)])
    traces = list(simulate(graph, script=slow, commands=[(1_000, "stop", None)]))
    assert graph_states(traces)[-2:] == ["STOPPING", "STOPPED"]
    assert states(traces, "A") == ["INITIALIZED", "RUNNING", "FINISHED"]
    assert hazards(traces) == ["H14"]


def test_a_second_run_of_a_loading_action_kills_the_engine_and_the_check_reports_it() -> None:
    graph = optional(graph_of("entry>A", "entry>B", "A>C", "B>C", "C>exit"), "A>C", "B>C")
    calls = script(A=[Behaviour(after_s=0.1)], B=[Behaviour(after_s=0.5)], C=[Behaviour(load_s=1)])
    traces = list(simulate(graph, script=calls))
    assert hazards(traces) == ["H4"]
    assert traces[-1].t_ms == 500
    assert any("while it still loads" in message for message in told(graph, "H4"))
    calls = script(
        A=[Behaviour(after_s=0.1)], B=[Behaviour(after_s=0.5)], C=[Behaviour(load_s=0.2)]
    )
    assert hazards(list(simulate(graph, script=calls))) == []


def test_a_new_start_waits_until_a_loading_action_has_run() -> None:
    graph = graph_of("entry>A", "A>exit")
    engine = Engine(script=Script({"*": (Behaviour(load_s=1.0, after_s=0.5),)}))
    engine.start(graph, 0.0)
    engine.stop("g", 300.0)
    engine.start(graph, 600.0)
    assert engine.busy
    engine.advance(1_400.0)
    assert engine.states()["g"].nodes == {"A_0": "RUNNING"}
    engine.advance(1_700.0)
    assert engine.states()["g"].state == "RUNNING"


@pytest.mark.parametrize("seconds", [-1, 1e9, "1"])
def test_a_loading_time_is_seconds_that_are_not_negative(seconds: object) -> None:
    with pytest.raises(ValueError, match="behaviours/A/0"):
        script_from({"behaviours": {"A": [{"load_s": seconds}]}})


def failing_start(following: Conditions) -> Graph:
    """Return a graph in which a failing A runs B and bypasses C. D answers C with `following`."""
    graph = graph_of(
        "entry>A", "A>B", "A>C", "C>D", "B>exit", "D>exit",
        AB=Conditions("run", "run", "run"), AC=Conditions("run", "run", "bypass"), CD=following,
    )  # fmt: skip
    return optional(graph, "B>exit", "D>exit")


def test_an_error_that_starts_one_action_and_halts_the_graph_by_a_bypass_is_told() -> None:
    """The end that triggers B also halts the graph, however long B loads."""
    graph = failing_start(Conditions("run", "run"))
    calls = script(A=[Behaviour(result="on_error")], B=[Behaviour(load_s=0.01)])
    assert "H14" in hazards(list(simulate(graph, script=calls)))
    (message,) = told(graph, "H14")
    assert message.startswith("If A_0 ends with on_error, C_0 is bypassed")
    assert "while B_0 still loads" in message


def test_an_error_whose_bypass_leads_on_halts_nothing() -> None:
    graph = failing_start(Conditions("run", "run", "run"))
    calls = script(A=[Behaviour(result="on_error")], B=[Behaviour(load_s=0.01)])
    assert "H14" not in hazards(list(simulate(graph, script=calls)))
    assert told(graph, "H14") == []
