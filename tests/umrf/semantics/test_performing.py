"""Actions of a performer: the engine calls it, and hears the results."""

from collections.abc import Mapping
from typing import Any

import msgspec

from action_assistant.umrf.facts import PINNED, SIMULATED, EngineFacts
from action_assistant.umrf.model import Action, Parameter, Precondition
from action_assistant.umrf.semantics import (
    Call,
    Engine,
    GraphStateEvent,
    NodeResultEvent,
    Returned,
    Script,
    Trace,
    script_from,
)
from runner.harness import carousel, sequence, two_ends


class Performing:
    """Writes down what it is told, and does nothing."""

    takes_graphs = False

    def __init__(self, *names: str) -> None:
        self.names = names
        self.told: list[tuple[str, int]] = []
        self.calls: list[Call] = []

    def performs(self, action: Action, *, inside: bool) -> bool:
        return action.name in self.names

    def begin(self, call: Call) -> None:
        self.calls.append(call)

    def stop(self, number: int) -> None:
        self.told.append(("stop", number))

    def pause(self, number: int) -> None:
        self.told.append(("pause", number))

    def resume(self, number: int) -> None:
        self.told.append(("resume", number))

    def give_up(self, number: int) -> str | None:
        self.told.append(("give_up", number))
        return "it was killed"

    def ended(self, number: int, result: Precondition, outputs: Mapping[str, Any]) -> None: ...


def made(
    performer: Performing, facts: EngineFacts = SIMULATED, script: Script | None = None
) -> Engine:
    return Engine(facts=facts, script=script, performer=performer)


def states(engine: Engine, graph: str) -> tuple[str, dict[str, str]]:
    now = engine.states()[graph]
    return now.state, now.nodes


def returned(number: int, result: str = "on_true", **more: Any) -> Returned:
    return Returned(number=number, result=result, **more)


def test_a_performed_action_runs_until_the_performer_reports_its_end() -> None:
    performer = Performing("Work")
    engine = made(performer)
    engine.start(sequence("line", 2), 0)
    assert engine.advance(1e9) == []
    assert engine.due is None
    assert [call.node for call in performer.calls] == ["Work_0"]
    traces = engine.returned(returned(1, "on_false", message="slipped"), 2e9)
    (ended,) = [each for each in traces if isinstance(each, NodeResultEvent)]
    assert (ended.result, ended.message, ended.t_ms) == ("on_false", "slipped", 2e9)
    engine.returned(returned(2), 3e9)
    assert states(engine, "line") == ("FINISHED", {"Work_0": "FINISHED", "Work_1": "FINISHED"})


def test_actions_that_are_not_performed_follow_the_script() -> None:
    performer = Performing("Other")
    script = script_from({"behaviours": {"Work": [{"after_s": 2, "result": "on_error"}]}})
    engine = made(performer, script=script)
    engine.start(sequence("line", 1), 0)
    engine.advance(5000)
    assert performer.calls == []
    assert states(engine, "line")[1] == {"Work_0": "ERROR"}


def test_a_stopped_call_is_given_up_after_five_seconds() -> None:
    performer = Performing("Work")
    engine = made(performer)
    engine.start(sequence("line", 1), 0)
    engine.stop("line", 1000)
    assert performer.told == [("stop", 1)]
    engine.advance(5999)
    assert states(engine, "line") == ("STOPPING", {"Work_0": "STOPPING"})
    traces = engine.advance(6200)
    assert performer.told == [("stop", 1), ("give_up", 1)]
    assert states(engine, "line") == ("ERROR", {"Work_0": "ERROR"})
    assert "it was killed" in [each.message for each in traces if isinstance(each, NodeResultEvent)]
    assert [each.node for each in engine.executing(6200)] == [
        "Work_0"
    ]  # until it is known to be over
    engine.returned(returned(1, "on_error"), 6300)
    assert engine.executing(6300) == []
    engine.start(sequence("line", 1), 6400)  # nothing of the last run is left to wait for
    assert states(engine, "line") == ("RUNNING", {"Work_0": "RUNNING"})


def test_a_call_that_obeys_its_stop_ends_stopped_whatever_it_returns() -> None:
    performer = Performing("Work")
    engine = made(performer)
    engine.start(sequence("line", 1), 0)
    engine.stop("line", 1000)
    engine.returned(returned(1, "on_true"), 1500)
    traces = engine.advance(20_000)
    assert states(engine, "line") == ("STOPPED", {"Work_0": "FINISHED"})
    assert ("give_up", 1) not in performer.told
    assert [each.state for each in traces if isinstance(each, GraphStateEvent)] == ["STOPPED"]


def test_a_call_that_returns_while_paused_continues_with_the_graph() -> None:
    performer = Performing("Work")
    engine = made(performer)
    engine.start(sequence("line", 2), 0)
    engine.pause("line", 1000)
    engine.returned(returned(1), 1500)
    engine.advance(5000)
    assert states(engine, "line")[1] == {"Work_0": "PAUSED", "Work_1": "UNINITIALIZED"}
    engine.resume("line", 6000)
    assert states(engine, "line")[1] == {"Work_0": "FINISHED", "Work_1": "RUNNING"}
    engine.pause("line", 7000)
    engine.advance(8000)
    engine.resume("line", 9000)
    assert performer.told == [("pause", 1), ("pause", 2), ("resume", 2)]
    engine.returned(returned(2), 9500)
    assert states(engine, "line")[0] == "FINISHED"


def test_each_visit_of_a_loop_is_a_call_of_its_own() -> None:
    performer = Performing("Work")
    engine = made(performer)
    engine.start(carousel(), 0)
    for number in range(1, 8):
        engine.returned(returned(number), 100.0 * number)
    assert [call.number for call in performer.calls] == list(range(1, 9))
    assert [call.node for call in performer.calls[:3]] == ["Work_0", "Work_1", "Work_0"]


def test_a_stop_of_a_paused_call_fails_on_an_engine_that_cannot_do_it() -> None:
    """Its thread waits to be resumed for ever, whether its code has returned or was killed (H5)."""
    performer = Performing("Work")
    engine = made(performer, PINNED)
    engine.start(sequence("line", 1), 0)
    engine.pause("line", 1000)
    engine.advance(2000)
    engine.stop("line", 3000)
    engine.returned(returned(1), 3500)
    engine.advance(9000)
    assert states(engine, "line")[1] == {"Work_0": "ERROR"}
    engine.start(sequence("line", 1), 10_000)
    assert engine.locked


def test_a_late_or_repeated_return_changes_nothing() -> None:
    performer = Performing("Work")
    engine = made(performer)
    engine.start(two_ends(), 0)
    engine.returned(returned(1), 100)  # the exit: the other one goes on in a graph that has ended
    assert states(engine, "two_ends")[0] == "FINISHED"
    before = states(engine, "two_ends")
    assert engine.returned(returned(1), 200) == []
    assert engine.returned(returned(99), 200) == []
    assert states(engine, "two_ends") == before
    assert [each.node for each in engine.executing(200)] == ["Work_1"]
    engine.returned(returned(2), 300)
    assert engine.executing(300) == []


def test_outputs_of_a_call_reach_its_children() -> None:
    from runner.links.behaviours.written import action, chain, parameter

    performer = Performing("Gives", "Takes")
    engine = made(performer)
    first = action("Gives", [parameter("start", "number", 2)], [parameter("count", "number")])
    engine.start(chain(first, action("Takes", [parameter("count", "number")])), 0)
    assert performer.calls[0].inputs == {"start": 2.0}
    assert performer.calls[0].outputs == {"count": "number"}
    traces: list[Trace] = engine.returned(returned(1, outputs={"count": 7.5}), 100)
    assert traces
    assert performer.calls[1].inputs == {"count": 7.5}


def test_an_action_that_fails_hands_on_nothing_that_it_gave_before() -> None:
    from runner.links.behaviours.written import action, parameter

    optional = '{"pvf_type": "number", "pvf_required": false}'
    loop = carousel()
    first, second = loop.actions
    gives = msgspec.structs.replace(
        action("Gives", [], [parameter("count", "number")]), key=first.key
    )
    takes = msgspec.structs.replace(action("Takes", [Parameter("count", optional)]), key=second.key)
    performer = Performing("Gives", "Takes")
    engine = made(performer)
    engine.start(msgspec.structs.replace(loop, actions=(gives, takes)), 0)
    engine.returned(returned(1, outputs={"count": 7.5}), 100)
    engine.returned(returned(2), 200)
    engine.returned(returned(3, "on_error"), 300)
    assert [(each.name, each.inputs) for each in performer.calls] == [
        ("Gives", {}),
        ("Takes", {"count": 7.5}),
        ("Gives", {}),
        ("Takes", {}),
    ]
