"""A run names what was behind its end, with evidence, and says nothing where nothing is proven."""

from typing import Any

import msgspec
import pytest

from action_assistant.journal.events import Draft
from action_assistant.paths import examples
from action_assistant.runner.analysis.cause_texts import cause_sentence
from action_assistant.runner.analysis.causes import Cause, causes
from action_assistant.runner.archives import examples as recorded_runs
from action_assistant.runner.links.observations import GraphState, NodeResult, NodeState
from action_assistant.runner.runs.events import (
    AlarmRaised,
    Author,
    Ended,
    ModifyRefused,
    ModifyRequested,
    Observed,
    PauseRequested,
    Proof,
    Published,
    Requested,
    ResumeRequested,
    RunEvent,
    Silent,
    StopRequested,
    decode,
)
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.run import Run
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Conditions, Graph
from runner.harness import ANN
from runner.process import RunnerProcess
from runner.record_examples import graph, line, recorded
from runner.review.test_service import eventually

EXAMPLES = {
    "wrong_parameter": 'Grip was started with speed = "fast": a number was expected.',
    "missing_action": "Search is not known to Robin, so it refused the graph.",
    "hang_in_a_join": "Ben pressed Stop while Look ran (93.4–94.6 s), as far as was seen.",
    "engine_restart": "The engine of Robin was restarted; what happened after is unknown.",
    "foreign_start": "Somebody else started inspect on Robin; this run was ended by it.",
}


def example(name: str) -> tuple[Run, Graph, list[RunEvent]]:
    first, rest = recorded_runs.read((examples() / f"{name}.run.jsonl").read_bytes())
    told: list[RunEvent] = [first, *(decode(each.kind, each.body) for each in rest)]
    run = replay(told)
    assert run is not None
    return run, codec.read(first.umrf.encode()).graph, told


def test_the_examples_are_what_the_runner_records_today() -> None:
    for name, text in recorded().items():
        assert (examples() / name).read_bytes() == text, f"{name}: see runner/record_examples.py"


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_cause_of_each_example_comes_first_and_has_its_evidence(name: str) -> None:
    run, sent, told = example(name)
    first = causes(run, sent)[0]
    assert cause_sentence(first, run) == EXAMPLES[name]
    assert run.requested_at <= first.at <= max(getattr(each, "at", 0) for each in told)
    assert first.action is None or first.action in run.actions


@pytest.mark.parametrize("name", EXAMPLES)
def test_no_cause_is_named_before_its_evidence_was_there(name: str) -> None:
    _, sent, told = example(name)
    for upto in range(1, len(told) + 1):
        run = replay(told[:upto])
        assert run is not None
        latest = max(getattr(each, "at", 0) for each in told[:upto])
        named = causes(run, sent)
        assert all(each.at <= latest for each in named)
        if upto == 1:
            assert named == ()


def begun(task: Graph) -> Requested:
    return Requested(
        at=1, run="r", number=1, request_id="q", author=ANN, graph=None, graph_name=task.name,
        version="v", digest="d", engine="Robin", simulated=False, umrf="",
        actions={each.full_name: each.key for each in task.actions},
    )  # fmt: skip


def found(task: Graph, *told: RunEvent) -> list[str]:
    run = replay([begun(task), Published(2), *told])
    assert run is not None
    return [cause_sentence(each, run) for each in causes(run, task)]


def state(at: int, node: str, name: str) -> NodeState:
    return NodeState(at, "task", node, name)


FORK = graph("task", ("entry", "A"), ("entry", "B"), ("A", "Join"), ("B", "Join"), ("Join", "exit"))
LINE = graph("task", *line("A", "B"))


def test_a_good_run_and_an_unrecorded_one_have_no_cause() -> None:
    assert found(LINE, Ended(9, "finished", "on_true")) == []
    assert found(LINE, Ended(9, "halted")) == []
    assert found(LINE) == []


def test_an_action_that_ended_in_error_is_named_with_its_own_words() -> None:
    told = Observed(4, (state(3, "A_0", "RUNNING"), NodeResult(4, "task", "A_0", "on_error", "jammed"),
                        state(4, "A_0", "ERROR"), GraphState(4, "task", "ERROR")))  # fmt: skip
    assert found(LINE, told, Ended(5, "error", "on_error")) == ["A ended in error: “jammed”"]


S = 1_000_000


def test_a_stop_is_explained_by_who_pressed_it_and_what_ran_then() -> None:
    told = Observed(4, (state(3, "A_0", "RUNNING"),))
    halted = Observed(7 * S, (state(7 * S, "A_0", "STOPPING"), state(7 * S + 1, "A_0", "FINISHED")))
    for who, said in ((Author("ben", "Ben"), "Ben"), (Author("owner", ""), "Somebody")):
        stop = StopRequested(7 * S // 10, who)
        assert found(LINE, told, stop, halted, Ended(8 * S, "stopped")) == [
            f"{said} pressed Stop while A ran (0.7 s)."
        ]


def test_an_action_only_seen_running_before_a_stop_is_not_certain_to_have_run_then() -> None:
    told = Observed(4, (state(3, "A_0", "RUNNING"),))
    assert found(LINE, told, StopRequested(2 * S, ANN)) == [
        "Ann pressed Stop while A ran (2.0 s), as far as was seen."
    ]


def test_a_stop_before_anything_ran_says_so() -> None:
    stop = StopRequested(1, ANN)
    run = replay(
        [begun(LINE), stop, Ended(2, "stopped", None, "Stopped before anything was sent.")]
    )
    assert run is not None
    assert cause_sentence(causes(run, LINE)[0], run) == "Ann pressed Stop before anything was sent."
    assert found(LINE, stop, Ended(3, "stopped")) == [
        "Ann pressed Stop before any action was seen to run."
    ]


def test_a_stop_during_a_silence_or_after_a_restart_says_so() -> None:
    ran = Observed(4, (state(3, "A_0", "RUNNING"),))
    stop = StopRequested(9 * S, ANN)
    silent = found(LINE, ran, Silent(8 * S, 5 * S, "it does not answer"), stop)
    assert silent[0] == (
        "Ann pressed Stop while Robin gave no answer: before that A ran (9.0 s), as far as was seen."
    )
    restarted = AlarmRaised(8 * S, "engine_restarted", "The engine was restarted.")
    assert found(LINE, ran, restarted, stop)[0] == (
        "Ann pressed Stop after the engine of Robin had been restarted."
    )


def test_a_pause_or_a_change_by_a_person_is_named_before_anything_else() -> None:
    ran = Observed(4, (state(3, "A_0", "RUNNING"),))
    paused = Observed(6, (state(6, "A_0", "PAUSED"), GraphState(6, "task", "PAUSED")))
    restarted = AlarmRaised(8 * S, "engine_restarted", "The engine was restarted.")
    told = (ran, PauseRequested(5, ANN), paused, restarted, Ended(9 * S, "lost", None, "gone"))
    assert found(LINE, *told)[0] == "Ann paused the run while A ran (0.0 s), as far as was seen."
    resumed = (*told[:3], ResumeRequested(7, ANN), *told[3:])
    assert not any("pause" in each for each in found(LINE, *resumed))
    changed = ModifyRequested(
        at=7, author=ANN, version="w", digest="e", actions={"A_0": "A"}, umrf=""
    )
    assert found(LINE, ran, changed, restarted)[0] == (
        "Ann gave the run another version of its graph while it went on."
    )
    undone = ModifyRefused(at=8, version="v", digest="d", actions={"A_0": "A"}, why="no")
    assert "Ann" not in found(LINE, ran, changed, undone, restarted)[0]


def test_a_join_is_said_to_have_waited_after_the_stop_and_only_when_another_parent_reported() -> (
    None
):
    both = (state(3, "A_0", "RUNNING"), state(3, "B_0", "RUNNING"))
    stop, end = StopRequested(9, ANN), Ended(10, "stopped")
    assert not any("waited" in each for each in found(FORK, Observed(3, both), stop, end))
    done = (NodeResult(4, "task", "A_0", "on_true"), state(4, "A_0", "FINISHED"))
    assert found(FORK, Observed(4, (*both, *done)), stop, end) == [
        "Ann pressed Stop while B ran (0.0 s), as far as was seen.",
        "Join waited for B, which had not been seen to end by then.",
    ]


def test_an_arrow_that_passes_the_outcome_over_is_named() -> None:
    told = (
        state(3, "A_0", "RUNNING"), state(3, "B_0", "RUNNING"),
        NodeResult(4, "task", "A_0", "on_true"), state(4, "A_0", "FINISHED"),
        NodeResult(5, "task", "B_0", "on_false"), state(5, "B_0", "FINISHED"),
    )  # fmt: skip
    assert found(FORK, Observed(5, told), StopRequested(9, ANN), Ended(10, "stopped")) == [
        "Ann pressed Stop while no action was seen running.",
        "Join waited for B, which ended false: its arrow passes that over.",
    ]


def test_a_halted_graph_names_the_last_end_that_nothing_follows() -> None:
    a, b = (state(3, "A_0", "RUNNING"), *_ended(4, "A_0", "true")), state(4, "B_0", "RUNNING")
    halted = [Observed(5, (*a, b, *_ended(5, "B_0", "false"))), Ended(6, "halted", "on_halted")]
    sentence = "B ended false, and nothing follows that: the exit was not reached."
    assert found(LINE, *halted) == [sentence]
    unseen = [Observed(4, (*a, b)), Ended(6, "halted", "on_halted")]
    assert found(LINE, *unseen) == [], "how B ended was not seen"
    true = [Observed(5, (*a, b, *_ended(5, "B_0", "true"))), Ended(6, "halted", "on_halted")]
    assert found(LINE, *true) == [], "an arrow follows that, so it was something else"
    both = (state(3, "A_0", "RUNNING"), state(3, "B_0", "RUNNING"))
    first = [Observed(5, (*both, *_ended(5, "A_0", "false")))]
    named = found(FORK, *first, Ended(6, "halted", "on_halted"))
    assert not any("nothing follows" in each for each in named), "how B ended was not seen"
    alone = graph("task", ("entry", "A"))
    untold = Observed(4, (state(3, "A_0", "RUNNING"), state(4, "A_0", "FINISHED")))
    assert found(alone, untold, Ended(6, "halted", "on_halted")) == [
        "A ended, and nothing follows that: the exit was not reached."
    ]
    fork = [Observed(5, (*both, *_ended(4, "A_0", "true"), *_ended(5, "B_0", "false")))]
    assert found(FORK, *fork, Ended(6, "halted", "on_halted"))[-1] == sentence


def test_a_ready_made_action_is_called_as_people_call_it() -> None:
    ask = graph("task", *line("A", "AaConfirm"))
    told = (
        state(3, "A_0", "RUNNING"),
        *_ended(4, "A_0", "true"),
        state(4, "AaConfirm_0", "RUNNING"),
    )
    halted = (
        Observed(5, (*told, *_ended(5, "AaConfirm_0", "false"))),
        Ended(6, "halted", "on_halted"),
    )
    sentence = "Confirm ended false, and nothing follows that: the exit was not reached."
    assert found(ask, *halted) == [sentence]


def _ended(at: int, name: str, result: str) -> tuple[Any, ...]:
    end = "ERROR" if result == "error" else "FINISHED"
    return NodeResult(at, "task", name, f"on_{result}"), state(at, name, end)


@pytest.mark.parametrize("others", [(), _ended(6, "B_0", "true")])
def test_an_ignored_outcome_before_the_last_report_keeps_nobody_waiting(others: Any) -> None:
    """Engines run a join whose last parent says so, whatever the others had ended with."""
    told = (state(3, "A_0", "RUNNING"), *_ended(4, "A_0", "false"), state(4, "B_0", "RUNNING"))
    stop, end = StopRequested(9, ANN), Ended(10, "stopped")
    found_causes = found(FORK, Observed(4, told), Observed(6, others), stop, end)
    assert not any("passes that over" in each for each in found_causes)
    assert others or "Join waited for B, which had not been seen to end by then." in found_causes


@pytest.mark.parametrize(
    ("outcome", "cause"), [("false", "B ended false."), ("error", "B ended in error.")]
)
def test_an_error_from_which_an_arrow_recovered_is_no_cause_of_what_came_later(
    outcome: str, cause: str
) -> None:
    error = Conditions(on_error="run")
    plan = graph("task", *line("A", "Again", "B"))
    keys = {each.name: each.key for each in plan.actions}
    relations = tuple(
        msgspec.structs.replace(each, conditions=error) if each.child == keys["Again"] else each
        for each in plan.relations
    )
    plan = msgspec.structs.replace(plan, relations=relations)
    slipped = (state(3, "A_0", "RUNNING"), *_ended(4, "A_0", "error"))
    again = (state(4, "Again_0", "RUNNING"), *_ended(5, "Again_0", "true"))
    last = (state(5, "B_0", "RUNNING"), *_ended(6, "B_0", outcome))
    told = [Observed(4, slipped), Observed(5, again)]
    assert found(plan, *told, Observed(6, last), Ended(7, "finished", f"on_{outcome}")) == [cause]
    stopped = [Observed(6, last[:1]), StopRequested(7, ANN), Ended(8, "stopped")]
    assert not any("error" in each for each in found(plan, *told, *stopped))
    assert "A ended in error." in found(plan, *told, Ended(7, "halted"))


def test_a_run_is_not_ended_by_a_stranger_when_it_was_over_before() -> None:
    over = Observed(
        4, (state(3, "A_0", "RUNNING"), state(4, "A_0", "ERROR"), GraphState(4, "task", "ERROR"))
    )
    alarm = AlarmRaised(5, "foreign_stop", "Somebody else …")
    told = found(LINE, over, alarm, Ended(7, "error", "on_error"))
    assert told[0] == "Somebody else told Robin to stop this run."
    restarted = AlarmRaised(6, "engine_restarted", "The engine was restarted.")
    told = found(
        LINE, AlarmRaised(5, "foreign_start", "…"), restarted, Ended(7, "lost", None, "gone")
    )
    assert not any("ended by it" in each for each in told)


def test_an_alarm_that_later_events_contradict_is_no_cause() -> None:
    ran = Observed(9, (state(9, "A_0", "RUNNING"), state(10, "A_0", "ERROR")))
    stalled = AlarmRaised(5, "stalled", "NOTHING MOVES: it will not go on")
    assert found(LINE, stalled, ran, Ended(11, "error", "on_error")) == ["A ended in error."]
    lost = AlarmRaised(5, "stop_unconfirmed", "STOP UNCONFIRMED: the engine does not hold it")
    told = (StopRequested(4, ANN), lost, Proof(6, 6, "h"), Ended(7, "stopped"))
    assert not any("UNCONFIRMED" in each for each in found(LINE, *told))


def test_a_start_that_was_never_sent_was_not_refused_by_the_robot() -> None:
    run = replay([begun(LINE), Ended(3, "refused", None, "Its turn did not come.")])
    assert run is not None
    assert [cause_sentence(each, run) for each in causes(run, LINE)] == [
        "Nothing was started: Its turn did not come."
    ]


def test_a_foreign_start_ends_a_run_only_where_nobody_here_pressed_stop() -> None:
    alarm = AlarmRaised(5, "foreign_start", "Somebody else …")
    assert "ended by it" in found(LINE, alarm, Ended(7, "stopped"))[0]
    assert "ended by it" not in found(LINE, alarm, StopRequested(6, ANN), Ended(7, "stopped"))[0]
    assert "ended by it" not in found(LINE, alarm)[0]


def test_silence_is_said_to_be_unknown() -> None:
    assert found(LINE, Silent(9, 6, "it does not answer")) == [
        "What happened after this moment is unknown."
    ]


def test_examples_are_taken_in_once_marked_and_tell_their_cause(
    process: RunnerProcess,
) -> None:
    def listed() -> list[dict[str, Any]]:
        answer: list[dict[str, Any]] = client.get("/api/runs", params={"label": "example"}).json()
        return answer

    with process.client() as client:
        first = client.post("/api/examples").json()
        assert client.post("/api/examples").json() == first
        eventually(lambda: len(listed()) == 5 and all(each["cause"] for each in listed()))
        assert {each["cause"] for each in listed()} == set(EXAMPLES.values())
        assert all(each["simulated"] for each in listed())
        assert {each["id"] for each in listed()} == set(first)
        for each in listed():
            named = client.get(f"/api/runs/{each['id']}/causes").json()
            assert named[0]["text"] == each["cause"]
            assert named[0]["seq"] > 0
            by = "Ben" if each["cause"].startswith("Ben ") else None
            assert by == (named[0]["author"] or {}).get("name")
        wrong = client.get("/api/runs/example-wrong-parameter").json()
        assert wrong["override"]["reason"] == "The new gripper takes words, too."
        assert [each["code"] for each in wrong["despite"]] == ["parameter-type"]
        assert client.get("/api/runs/nowhere/causes").status_code == 404


def test_a_file_that_is_no_recorded_run_is_refused() -> None:
    for text in (b"", b"{}\n", b'{"kind":"run.ended.v1","author":"","at":1,"body":{}}\n'):
        with pytest.raises(Exception, match="no recorded run"):
            recorded_runs.read(text)
    first, _ = recorded_runs.read((examples() / "foreign_start.run.jsonl").read_bytes())
    draft = recorded_runs.numbered(first, 77)
    assert isinstance(draft, Draft)
    assert msgspec.json.decode(draft.body)["number"] == 77


def test_causes_are_different_values() -> None:
    run, sent, _ = example("hang_in_a_join")
    named: tuple[Cause, ...] = causes(run, sent)
    assert len(set(named)) == len(named)


def test_a_robot_that_tells_no_result_still_shows_what_was_thrown() -> None:
    thrown = Observed(4, (state(3, "A_0", "RUNNING"), state(4, "A_0", "ERROR")))
    assert found(LINE, thrown, Ended(9, "finished")) == ["A ended in error."]
    done = Observed(4, (state(3, "A_0", "RUNNING"), state(4, "A_0", "FINISHED")))
    assert found(LINE, done, Ended(9, "finished")) == []


def part(at: int, graph: str, node: str, name: str) -> NodeState:
    return NodeState(at, graph, node, name)


def inside(at: int, graph: str, node: str, result: str, said: str | None = None) -> tuple[Any, ...]:
    """An action of a graph inside, from a moment on to the next."""
    end = "ERROR" if result == "error" else "FINISHED"
    return (
        part(at, graph, node, "RUNNING"),
        NodeResult(at + 1, graph, node, f"on_{result}", said),
        part(at + 1, graph, node, end),
    )


def test_a_failure_inside_is_named_with_the_actions_around_it() -> None:
    told = (
        state(3, "A_0", "RUNNING"),
        part(3, "task__A__0", "Pick_1", "RUNNING"),
        part(3, "task__A__0", "Pick_2", "RUNNING"),
        *inside(4, "task__A__0__Pick__2", "Grip_0", "error", "jammed"),
        NodeResult(5, "task__A__0", "Pick_2", "on_error"),
        part(5, "task__A__0", "Pick_2", "FINISHED"),
        NodeResult(5, "task", "A_0", "on_error"),
        state(5, "A_0", "FINISHED"),
    )
    assert found(LINE, Observed(5, told), Ended(6, "finished", "on_error")) == [
        "A › Pick 2 › Grip ended in error: “jammed”"
    ]


def test_a_run_that_ended_false_goes_back_to_the_last_that_ended_false_inside() -> None:
    told = (
        state(3, "A_0", "RUNNING"),
        *inside(4, "task__A__0", "Look_0", "false"),
        *inside(6, "task__A__0", "Look_1", "false"),
        NodeResult(7, "task", "A_0", "on_false"),
        state(7, "A_0", "FINISHED"),
    )
    assert found(LINE, Observed(7, told), Ended(8, "finished", "on_false")) == [
        "A › Look 1 ended false."
    ]


def test_the_first_of_two_actions_alike_is_called_as_on_its_card() -> None:
    told = (
        state(3, "A_0", "RUNNING"),
        *inside(4, "task__A__0", "Look_1", "false"),
        *inside(6, "task__A__0", "Look_0", "false"),
        NodeResult(7, "task", "A_0", "on_false"),
        state(7, "A_0", "FINISHED"),
    )
    assert found(LINE, Observed(7, told), Ended(8, "finished", "on_false")) == [
        "A › Look ended false."
    ]


def test_an_error_that_was_recovered_inside_is_not_the_cause_of_a_later_failure() -> None:
    told = (
        state(3, "A_0", "RUNNING"),
        *inside(4, "task__A__0", "Grip_0", "error", "slipped"),
        *inside(5, "task__A__0", "Again_0", "true"),
        NodeResult(6, "task", "A_0", "on_true"),
        state(6, "A_0", "FINISHED"),
        state(6, "B_0", "RUNNING"),
        NodeResult(7, "task", "B_0", "on_error", "jammed"),
        state(7, "B_0", "ERROR"),
    )
    assert found(LINE, Observed(7, told), Ended(8, "finished", "on_error")) == [
        "B ended in error: “jammed”"
    ]


def test_the_cause_of_a_stop_names_the_innermost_actions() -> None:
    told = (state(3, "A_0", "RUNNING"), part(3, "task__A__0", "Grip_0", "RUNNING"))
    assert found(LINE, Observed(4, told), StopRequested(6, ANN), Ended(7, "stopped")) == [
        "Ann pressed Stop while A › Grip ran (0.0 s), as far as was seen."
    ]


def test_a_false_end_is_not_put_down_to_an_error_that_was_made_good_before() -> None:
    told = (
        state(3, "A_0", "RUNNING"),
        *inside(4, "task__A__0", "Grip_0", "error", "slipped"),
        NodeResult(6, "task", "A_0", "on_true"),
        state(6, "A_0", "FINISHED"),
        state(6, "B_0", "RUNNING"),
        NodeResult(7, "task", "B_0", "on_false"),
        state(7, "B_0", "FINISHED"),
    )
    assert found(LINE, Observed(7, told), Ended(8, "finished", "on_false")) == ["B ended false."]
