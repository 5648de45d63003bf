"""Two runs are compared visit by visit, and part where they first differ."""

from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.runner.analysis.comparison import SentTree, compare
from action_assistant.runner.links.observations import NodeResult, NodeState
from action_assistant.runner.runs.events import (
    AlarmRaised,
    Author,
    Ended,
    Observed,
    Published,
    StopRequested,
)
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.run import Run
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph, Parameter
from runner.harness import sequence
from runner.runs.test_runs import REQUESTED

PLAN = sequence(actions=2)


def went(
    number: int, *course: tuple[str, str], graph: Graph = PLAN, **more: Any
) -> tuple[Run, str]:
    """A run in which these actions ended so, one second each; `-` for one that has no end."""
    umrf = codec.write(graph, codec.Stamp("g1", "v1", f"r{number}"))
    events: list[Any] = [
        msgspec.structs.replace(
            REQUESTED,
            values=more.get("values", {}),
            run=f"r{number}",
            number=number,
            graph_name=graph.name,
            digest=digest(graph),
            actions={each.full_name: each.key for each in graph.actions},
            umrf=umrf,
        ),
        Published(1_000_000, "life"),
    ]
    at = 1_000_000
    for name, result in course:
        events.append(Observed(at, (NodeState(at, graph.name, name, "RUNNING"),)))
        at += more.get(name, 1_000_000)
        if result != "-":
            said = more.get("said") if result == "error" else None
            ended = (
                NodeResult(at, graph.name, name, f"on_{result}", said),
                NodeState(at, graph.name, name, "FINISHED"),
            )
            events.append(Observed(at, ended))
    events += more.get("more", [])
    events.append(Ended(at, more.get("end", "finished"), "on_true"))
    run = replay(events)
    assert run is not None
    return run, umrf


def compared(a: tuple[Run, str], b: tuple[Run, str]) -> Any:
    return compare(a[0], b[0], SentTree(a[1]), SentTree(b[1]))


GOOD = went(1, ("Work_0", "true"), ("Work_1", "true"))


def test_runs_that_went_alike_do_not_part() -> None:
    found = compared(GOOD, went(2, ("Work_0", "true"), ("Work_1", "true")))
    assert found.parting is None
    assert found.text == "Every visit ended the same."
    assert found.same_graph


def test_runs_that_went_alike_with_other_values_are_not_called_the_same() -> None:
    course = [("Work_0", "true"), ("Work_1", "true")]
    values = {"Work_0": {"valve": "v8", "torque": 5.0}}
    found = compared(went(1, *course, values=values), went(2, *course, values=values))
    assert found.text == "Every visit ended the same."
    other = {"Work_0": {"valve": "v9", "torque": 5.0}, "Work_1": {"valve": "v9"}}
    found = compared(went(1, *course, values=values), went(2, *course, values=other))
    assert found.text == "Every visit ended the same, with 2 different values at the start."
    found = compared(went(1, *course, values=values), went(2, ("Work_0", "error"), values=other))
    assert found.parting is not None


def test_the_parting_is_the_first_visit_with_another_result_and_what_was_said() -> None:
    bad = went(2, ("Work_0", "true"), ("Work_1", "error"), said="gripper jammed")
    found = compared(GOOD, bad)
    assert found.parting is not None
    assert (found.parting.step.action, found.parting.step.visit) == ("Work_1", 1)
    assert found.parting.messages_b == ["gripper jammed"]
    assert found.text == "1 step was alike; then Work_1: true in run 1, error in run 2."


def test_an_action_that_only_one_run_reached_is_where_they_part() -> None:
    found = compared(GOOD, went(2, ("Work_0", "true")))
    assert found.parting is not None
    assert found.parting.step.relation == "only_a"
    assert "never run in run 2" in found.text


@pytest.mark.parametrize("slower", [500_000, 2_000_000])
def test_runs_with_different_actions_part_at_the_action_of_run_b(slower: int) -> None:
    """The order of their begins does not matter: only the graph of `b` is shown."""
    good = went(1, ("Work_0", "true"), ("Old_0", "true"))
    found = compared(good, went(2, ("Work_0", "true"), ("New_0", "error"), Work_0=slower))
    assert [(step.action, step.relation) for step in found.steps] == [
        ("Work_0", "same"),
        ("New_0", "only_b"),
        ("Old_0", "only_a"),
    ]
    assert found.parting.step.action == "New_0"


def test_an_action_that_was_left_out_comes_before_what_follows_in_both() -> None:
    good = went(1, ("Work_0", "true"), ("Old_0", "true"), ("Work_1", "true"), ("Late_0", "true"))
    found = compared(good, went(2, ("Work_0", "true"), ("Work_1", "true"), ("New_0", "true")))
    assert found.parting.step.action == "Old_0"


def test_a_result_that_nobody_saw_is_no_difference_yet_is_said() -> None:
    found = compared(GOOD, went(2, ("Work_0", "true"), ("Work_1", "-"), end="lost"))
    assert found.parting is None
    assert "not known" in found.text


def test_a_changed_parameter_is_named() -> None:
    value = '{"pvf_type": "number", "pvf_value": %s}'
    plans = [
        msgspec.structs.replace(
            PLAN,
            actions=(
                msgspec.structs.replace(
                    PLAN.actions[0], inputs=(Parameter("speed", value % speed),)
                ),
                PLAN.actions[1],
            ),
        )
        for speed in ("0.2", "0.9")
    ]
    found = compared(
        went(1, ("Work_0", "true"), graph=plans[0]), went(2, ("Work_0", "true"), graph=plans[1])
    )
    assert not found.same_graph
    (change,) = found.parameters
    assert change.name == "Work_0"
    assert [field.field for field in change.fields] == ["in/speed"]


def test_a_renamed_action_is_compared_with_itself() -> None:
    renamed = msgspec.structs.replace(
        PLAN,
        actions=(msgspec.structs.replace(PLAN.actions[0], name="Job"), PLAN.actions[1]),
    )
    found = compared(GOOD, went(2, ("Job_0", "true"), ("Work_1", "true"), graph=renamed))
    assert found.parting is None
    assert not found.same_graph


def test_the_slower_run_of_a_step_is_named() -> None:
    slow = went(2, ("Work_0", "true"), ("Work_1", "true"), Work_0=4_000_000)
    found = compared(GOOD, slow)
    assert [step.slower for step in found.steps] == ["b", None]


def test_comparing_is_total_for_graphs_of_different_names() -> None:
    other = sequence("cleaning", 1)
    found = compared(GOOD, went(2, ("Work_0", "false"), graph=other))
    assert found.parting is not None
    assert not found.same_graph


def rounds(number: int, *course: tuple[str, str, str]) -> tuple[Run, str]:
    """A run whose first action is a graph each time: how that ended, what was inside, and how the second
    action ended after it."""
    run, umrf = went(number)
    events: list[Any] = [
        msgspec.structs.replace(
            REQUESTED,
            run=f"r{number}",
            number=number,
            graph_name=PLAN.name,
            digest=run.digest,
            actions={each.full_name: each.key for each in PLAN.actions},
            umrf=umrf,
        ),
        Published(1_000_000, "life"),
    ]
    at, below = 1_000_000, f"{PLAN.name}__Work__0"
    for around, inside, after in course:
        facts: list[NodeState | NodeResult] = [NodeState(at, PLAN.name, "Work_0", "RUNNING")]
        for graph, name, result in (
            (below, "Grip_0", inside),
            (PLAN.name, "Work_0", around),
            (PLAN.name, "Work_1", after),
        ):
            if name != "Work_0":
                facts.append(NodeState(at, graph, name, "RUNNING"))
            at += 1_000_000
            facts += [
                NodeResult(at, graph, name, f"on_{result}"),
                NodeState(at, graph, name, "FINISHED"),
            ]
        events.append(Observed(at, tuple(facts)))
    events.append(Ended(at, "finished", "on_true"))
    found = replay(events)
    assert found is not None
    return found, umrf


def test_an_action_waits_for_what_parted_in_its_own_visit_only() -> None:
    alike = ("true", "true", "true")
    good = rounds(1, alike, alike, alike)
    inner = compared(good, rounds(2, ("false", "false", "true"), alike, alike))
    assert inner.parting is not None
    assert inner.parting.step.name == "Grip_0"
    own = rounds(
        3, ("false", "true", "true"), ("true", "true", "false"), ("false", "false", "true")
    )
    parting = compared(good, own).parting
    assert parting is not None
    assert (parting.step.action, parting.step.visit) == ("Work_0", 1)


STOPPED = StopRequested(2_700_000, Author("ada", "Ada"))


def test_a_run_that_somebody_stopped_parts_because_of_that_before_anything_else() -> None:
    stopped = went(2, ("Work_0", "true"), ("Work_1", "-"), end="stopped", more=[STOPPED])
    good = went(1, ("Work_0", "true"), ("Work_1", "true"), ("Late_0", "true"))
    because = compared(good, stopped).because
    assert (because.kind, because.run) == ("operator_stop", 2)
    assert because.text == "in run 2 Ada pressed Stop while Work 1 ran (0.7 s), as far as was seen"
    swapped = compared(stopped, good).because
    assert (swapped.kind, swapped.run) == ("operator_stop", 2)


def test_runs_that_part_nowhere_and_ended_otherwise_tell_who_stopped_one() -> None:
    stopped = went(2, ("Work_0", "true"), ("Work_1", "-"), end="stopped", more=[STOPPED])
    found = compared(GOOD, stopped)
    assert found.parting is None
    assert found.because.text.startswith("in run 2 Ada pressed Stop")
    assert compared(GOOD, GOOD).because is None


def test_a_stop_after_they_had_parted_is_not_named_as_the_cause() -> None:
    late = went(2, ("Work_0", "error"), ("Work_1", "-"), end="stopped", more=[STOPPED])
    assert compared(GOOD, late).because is None


CHAIN = sequence(actions=3)


def _without(graph: Graph, number: int) -> Graph:
    """The chain without one action; the ones beside it are joined."""
    before, gone, after = (graph.actions[each].key for each in (number - 1, number, number + 1))
    relations = tuple(
        msgspec.structs.replace(each, parent=before) if each.parent == gone else each
        for each in graph.relations
        if each.child != gone
    )
    assert any((each.parent, each.child) == (before, after) for each in relations)
    actions = tuple(each for each in graph.actions if each.key != gone)
    return msgspec.structs.replace(graph, actions=actions, relations=relations)


@pytest.mark.parametrize("bypassed", [False, True])
def test_a_stop_is_no_cause_of_a_visit_to_which_only_the_other_graph_led(bypassed: bool) -> None:
    shorter = _without(CHAIN, 1)
    if bypassed:  # the action is there, and no arrow leads to it
        kept = tuple(each for each in CHAIN.relations if each.parent == CHAIN.actions[1].key)
        shorter = msgspec.structs.replace(
            CHAIN, relations=(*(each for each in shorter.relations if each not in kept), *kept)
        )
    done = [(each.full_name, "true") for each in CHAIN.actions]
    good = went(1, *done, graph=CHAIN)
    stop = StopRequested(2_700_000, Author("ada", "Ada"))
    stopped = went(2, done[0], (done[2][0], "-"), graph=shorter, end="stopped", more=[stop])
    for one, other in ((good, stopped), (stopped, good)):
        found = compared(one, other)
        assert found.parting.step.action == done[1][0]
        assert found.because is None


def test_a_stop_in_the_run_that_has_a_visit_does_not_explain_that_the_other_lacks_it() -> None:
    stopped = went(2, ("Work_0", "true"), ("Work_1", "stopped"), end="stopped", more=[STOPPED])
    assert compared(went(1, ("Work_0", "true")), stopped).because is None


def test_a_script_does_not_explain_a_visit_that_one_run_lacks() -> None:
    script = '{"behaviours": {"Work_1": [{"after_s": 1}]}}'
    short = went(2, ("Work_0", "true"))
    found = compare(GOOD[0], short[0], SentTree(GOOD[1], {}, script), SentTree(short[1]))
    assert found.because is None


def test_an_alarm_of_one_run_is_named_before_any_difference_of_the_graphs() -> None:
    alarm = AlarmRaised(1_900_000, "engine_restarted", "The engine was restarted.")
    lost = went(2, ("Work_0", "true"), end="lost", more=[alarm])
    because = compared(GOOD, lost).because
    assert because.kind == "engine_restarted"
    assert because.text.startswith("in run 2 the engine of simulator was restarted")


def test_a_fault_that_the_simulator_was_told_is_named() -> None:
    bad = went(2, ("Work_0", "true"), ("Work_1", "error"))
    script = '{"behaviours": {"Work_1": [{"result": "on_error"}]}}'
    found = compare(GOOD[0], bad[0], SentTree(GOOD[1]), SentTree(bad[1], {}, script))
    assert found.because is not None
    assert found.because.text == "in run 2 the script of the simulator says what Work_1 did"


@given(st.permutations(range(3)), st.booleans())
def test_an_arrow_that_was_there_is_not_said_to_be_added_when_identities_changed(
    order: list[int], renamed: bool
) -> None:
    plan = sequence(actions=3)
    keys = {each.key: f"other{number:07d}" for number, each in enumerate(plan.actions)}
    actions = [msgspec.structs.replace(each, key=keys[each.key]) for each in plan.actions]
    again = msgspec.structs.replace(
        plan,
        actions=tuple(actions[place] for place in order),
        relations=tuple(
            msgspec.structs.replace(
                each,
                parent=keys.get(each.parent, each.parent),
                child=keys.get(each.child, each.child),
            )
            for each in plan.relations
        ),
    )
    one = went(1, ("Work_0", "true"), ("Work_1", "true"), graph=plan)
    found = compared(one, went(2, ("Work_0", "true"), graph=again))
    assert (found.graph.actions, found.graph.relations) == ((), ())
    assert [step.relation for step in found.steps] == ["same", "only_a"]


def test_an_action_with_another_number_is_found_by_what_it_is() -> None:
    value = '{"pvf_type": "number", "pvf_value": %s}'
    first, second = (
        msgspec.structs.replace(each, inputs=(Parameter("speed", value % speed),))
        for each, speed in zip(PLAN.actions, ("0.2", "0.9"), strict=True)
    )
    plan = msgspec.structs.replace(PLAN, actions=(first, second))
    moved = msgspec.structs.replace(second, key="another00000", instance_id=7)
    again = msgspec.structs.replace(
        plan,
        actions=(first, moved),
        relations=tuple(
            msgspec.structs.replace(
                each,
                parent="another00000" if each.parent == second.key else each.parent,
                child="another00000" if each.child == second.key else each.child,
            )
            for each in plan.relations
        ),
    )
    found = compared(went(1, graph=plan), went(2, graph=again))
    assert found.graph.relations == ()
    assert [(each.change, each.aid) for each in found.graph.actions] == [
        ("changed", "another00000")
    ]
