"""A run is what its events tell, wherever they stop."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.runner.links.observations import (
    GraphResult,
    GraphState,
    Hazard,
    NodeResult,
    NodeState,
    Seen,
    Snapshot,
)
from action_assistant.runner.runs.events import (
    AlarmRaised,
    Answered,
    Author,
    Ended,
    Observed,
    PauseRequested,
    Proof,
    Published,
    Requested,
    ResumeRequested,
    RunEvent,
    Silent,
    StopRequested,
    StopSent,
    Unknown,
    decode,
    draft_of,
)
from action_assistant.runner.runs.fold import begin, follow, replay
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import KEPT, MOMENT_US
from action_assistant.umrf.laps import Laps

ANN = Author("ann", "Ann")
REQUESTED = Requested(
    at=1_000,
    run="r1",
    number=1,
    request_id="q1",
    author=ANN,
    graph="g1",
    graph_name="patrol",
    version="v1",
    digest="d1",
    engine="simulator",
    simulated=True,
    actions={"Go_0": "a0", "Grip_0": "a1"},
    umrf="{}",
)
STARTED: tuple[RunEvent, ...] = (REQUESTED, Published(1_100, "life"))


def run_of(*seen: Seen, after: tuple[RunEvent, ...] = STARTED) -> Run:
    """A started run of which this was seen."""
    run = replay([*after, *(Observed(item.at, (item,)) for item in seen)])
    assert run is not None
    return run


def node(at: int, state: str, name: str = "Go_0") -> NodeState:
    return NodeState(at, "patrol", name, state)


def graph(at: int, state: str) -> GraphState:
    return GraphState(at, "patrol", state)


def snapshot(at: int, state: str, **nodes: str) -> Snapshot:
    return Snapshot(at=at, graph="patrol", state=state, nodes=nodes, run="r1", since=at - 100)


def test_an_action_that_runs_twice_has_two_visits_with_their_own_results() -> None:
    run = run_of(
        node(10, "RUNNING"),
        NodeResult(20, "patrol", "Go_0", "on_true"),
        node(20, "FINISHED"),
        node(30, "RUNNING"),
        NodeResult(50, "patrol", "Go_0", "on_false", "no way through"),
        node(50, "FINISHED"),
    )
    first, second = run.actions["Go_0"].visits
    assert (first.start, first.until, first.result, first.how) == (10, 20, "true", "observed")
    assert (second.start, second.until, second.result) == (30, 50, "false")
    assert [each.text for each in run.actions["Go_0"].messages] == ["no way through"]


def test_exact_visits_have_no_room_for_doubt() -> None:
    (visit,) = run_of(node(10, "RUNNING"), node(20, "FINISHED")).actions["Go_0"].visits
    assert visit.not_before == visit.start
    assert visit.not_after == visit.until


def test_a_visit_that_no_snapshot_showed_running_is_inferred_and_has_no_result() -> None:
    run = run_of(snapshot(2_000, "RUNNING", Go_0="UNINITIALIZED"))
    run = follow(run, Observed(3_000, (snapshot(3_000, "RUNNING", Go_0="FINISHED"),)))
    (visit,) = run.actions["Go_0"].visits
    assert (visit.how, visit.result) == ("inferred", None)
    assert (visit.not_before, visit.not_after) == (1_000, 3_000)  # not before it was asked for
    assert (visit.until, visit.start) == (1_000, 3_000)  # no moment is known at which it went on


S = 1_000_000
ONCE = msgspec.structs.replace(REQUESTED, laps=Laps(once=("Go_0", "Grip_0")))


def answer(at: int, state: str, **nodes: str) -> Snapshot:
    """Asked a tenth of a second before; the one before that a second earlier."""
    return Snapshot(
        at=at,
        graph="patrol",
        state=state,
        nodes=nodes,
        run="r1",
        asked_at=at - S // 10,
        since=at - S,
        since_asked=at - S - S // 10,
    )


def feedback(at: int, state: str, **nodes: str) -> Snapshot:
    """Return a snapshot of feedback that came at `at`, of unknown age."""
    return Snapshot(
        at=at, graph="patrol", state=state, nodes=nodes, run="r1", source="feedback", since_asked=0
    )


def test_answers_bound_a_visit_by_when_they_were_asked_for() -> None:
    seen = (
        answer(10 * S, "RUNNING", Go_0="UNINITIALIZED"),
        answer(11 * S, "RUNNING", Go_0="RUNNING"),
        answer(14 * S, "RUNNING", Go_0="FINISHED"),
    )
    (visit,) = run_of(*seen, after=(ONCE,)).actions["Go_0"].visits
    assert visit.not_before == 10 * S - S // 10
    assert visit.start == 11 * S + MOMENT_US
    assert visit.until == 14 * S - S - S // 10 - MOMENT_US
    assert visit.not_after == 14 * S
    assert visit.result is None


def test_visits_in_one_message_of_feedback_have_no_bound_at_its_arrival() -> None:
    run = run_of(
        answer(10 * S, "RUNNING", Go_0="UNINITIALIZED", Grip_0="UNINITIALIZED"),
        feedback(12 * S, "RUNNING", Go_0="RUNNING", Grip_0="UNINITIALIZED"),
        feedback(12 * S, "RUNNING", Go_0="FINISHED", Grip_0="RUNNING"),
        feedback(12 * S, "FINISHED", Go_0="FINISHED", Grip_0="FINISHED"),
        after=(ONCE,),
    )
    for action in run.actions.values():
        (visit,) = action.visits
        assert (visit.not_before, visit.not_after) == (10 * S - S // 10, 12 * S)
        assert (visit.start, visit.until) == (12 * S, visit.not_before)
        assert (visit.least, visit.most) == (0, 2 * S + S // 10)


def test_two_sights_of_an_action_that_may_run_again_are_not_one_long_visit() -> None:
    seen = (
        answer(10 * S, "RUNNING", Go_0="UNINITIALIZED"),
        answer(11 * S, "RUNNING", Go_0="RUNNING"),
        answer(19 * S, "RUNNING", Go_0="FINISHED"),
    )
    (visit,) = run_of(*seen).actions["Go_0"].visits
    assert visit.least == 0
    (visit,) = run_of(*seen, after=(ONCE,)).actions["Go_0"].visits
    assert visit.least > 6 * S


def test_a_visit_is_only_known_to_have_run_until_a_pause() -> None:
    paused_ = PauseRequested(12 * S, ANN)
    seen = [
        Observed(11 * S, (answer(11 * S, "RUNNING", Go_0="RUNNING"),)),
        paused_,
        Observed(15 * S, (answer(15 * S, "PAUSED", Go_0="PAUSED"),)),
        Observed(20 * S, (answer(20 * S, "FINISHED", Go_0="FINISHED"),)),
    ]
    run = replay([ONCE, *seen])
    assert run is not None
    (visit,) = run.actions["Go_0"].visits
    assert visit.until is not None
    assert visit.until <= 12 * S


def test_an_error_long_after_a_stop_is_no_end_of_the_code() -> None:
    told = [
        Observed(11 * S, (answer(11 * S, "RUNNING", Go_0="RUNNING"),)),
        StopRequested(12 * S, ANN),
        Observed(18 * S, (answer(18 * S, "ERROR", Go_0="ERROR"),)),
    ]
    run = replay([ONCE, *told])
    assert run is not None
    (visit,) = run.actions["Go_0"].visits
    assert visit.until is not None
    assert visit.not_after is None
    assert visit.most is None


def test_error_in_a_snapshot_is_an_inferred_error() -> None:
    run = run_of(snapshot(2_000, "RUNNING", Go_0="RUNNING"), snapshot(3_000, "ERROR", Go_0="ERROR"))
    (visit,) = run.actions["Go_0"].visits
    assert (visit.result, visit.how) == ("error", "inferred")


def test_a_repeated_snapshot_changes_no_visit() -> None:
    shown = snapshot(2_000, "RUNNING", Go_0="RUNNING")
    assert run_of(shown, shown).actions == run_of(shown).actions


def test_messages_of_snapshots_are_told_once() -> None:
    first = msgspec.structs.replace(
        snapshot(2_000, "RUNNING", Go_0="RUNNING"), messages={"Go_0": ("one",)}
    )
    second = msgspec.structs.replace(first, at=3_000, messages={"Go_0": ("one", "two")})
    assert [each.text for each in run_of(first, first, second).actions["Go_0"].messages] == [
        "one",
        "two",
    ]


def test_a_finished_graph_with_a_running_action_is_running() -> None:
    run = run_of(graph(5, "RUNNING"), node(10, "RUNNING"), graph(20, "FINISHED"))
    assert run.state == "running"
    assert run.apparent_end is None
    run = follow(run, Observed(30, (node(30, "FINISHED"),)))
    assert run.apparent_end == "finished"
    assert run.state == "running"  # until somebody has asked


@pytest.mark.parametrize(
    ("events", "state"),
    [
        ((REQUESTED,), "requested"),
        (STARTED, "published"),
        ((*STARTED, Observed(5, (graph(5, "RUNNING"),))), "running"),
        ((*STARTED, Observed(5, (graph(5, "PAUSED"),))), "paused"),
        ((*STARTED, StopRequested(6, ANN)), "stopping"),
        ((*STARTED, StopRequested(6, ANN), Silent(7, 4)), "unknown"),
        ((*STARTED, Silent(7, 4), Answered(8)), "published"),
        ((*STARTED, Ended(9, "lost")), "lost"),
    ],
)
def test_the_state_follows_from_the_events(events: tuple[RunEvent, ...], state: str) -> None:
    run = replay(events)
    assert run is not None
    assert run.state == state


def test_a_stop_is_never_taken_back() -> None:
    run = replay([*STARTED, StopRequested(6, ANN), ResumeRequested(7, ANN), PauseRequested(8, ANN)])
    assert run is not None
    assert run.desired == "stopped"
    assert run.stopped_by == ANN


def test_an_end_is_for_ever() -> None:
    run = replay([*STARTED, Ended(9, "lost"), Ended(10, "finished"), Proof(11, 11, "")])
    assert run is not None
    assert (run.state, run.ended_at, run.proof_at) == ("lost", 9, None)


def test_a_loop_of_a_thousand_laps_keeps_the_newest_visits_and_counts_the_others() -> None:
    laps = [
        Observed(i, (node(i * 10, "RUNNING"), node(i * 10 + 5, "FINISHED"))) for i in range(1_000)
    ]
    run = replay([*STARTED, *laps])
    assert run is not None
    action = run.actions["Go_0"]
    assert (len(action.visits), action.older) == (KEPT, 1_000 - KEPT)
    assert action.visits[-1].start == 9_990


def test_a_node_of_a_sub_graph_stands_beside_ours_of_the_same_name() -> None:
    run = run_of(node(5, "RUNNING"), NodeState(6, "patrol__Sub__0", "Go_0", "RUNNING"))
    assert run.active == ("Go_0", "patrol__Sub__0/Go_0")


def test_events_of_a_later_version_are_passed_over() -> None:
    assert decode("run.teleported.v9", b"{}") == Unknown()
    assert replay([*STARTED, Unknown()]) == replay(STARTED)


NAMES = st.sampled_from(["Go_0", "Grip_0", "Other_1"])
STATES = st.sampled_from(
    [
        "UNINITIALIZED",
        "INITIALIZED",
        "RUNNING",
        "FINISHED",
        "STOPPING",
        "ERROR",
        "PAUSE_REQUESTED",
        "PAUSED",
    ]
)
GRAPHS = st.sampled_from(["patrol", "patrol__Sub__0"])
GRAPH_STATES = st.sampled_from(
    [
        "UNINITIALIZED",
        "RUNNING",
        "PAUSED",
        "STOPPING",
        "STOPPED",
        "FINISHED",
        "HALTED",
        "ERROR",
        "CLEARING",
    ]
)
TIMES = st.integers(0, 10_000)
SEEN = st.one_of(
    st.builds(NodeState, TIMES, GRAPHS, NAMES, STATES),
    st.builds(NodeResult, TIMES, GRAPHS, NAMES, st.sampled_from(["on_true", "on_error", "odd"])),
    st.builds(GraphState, TIMES, GRAPHS, GRAPH_STATES),
    st.builds(GraphResult, TIMES, GRAPHS, st.just("on_true")),
    st.builds(Hazard, TIMES, GRAPHS, st.just("H4"), st.just("crash")),
    st.builds(
        Snapshot,
        at=TIMES,
        graph=GRAPHS,
        state=GRAPH_STATES,
        nodes=st.dictionaries(NAMES, STATES),
        since=st.none() | TIMES,
        messages=st.dictionaries(NAMES, st.lists(st.text(max_size=3), max_size=3).map(tuple)),
    ),
)
EVENTS = st.one_of(
    st.just(REQUESTED),
    st.builds(Published, TIMES, st.text(max_size=3)),
    st.builds(Observed, TIMES, st.lists(SEEN, max_size=5).map(tuple)),
    st.builds(PauseRequested, TIMES, st.just(ANN)),
    st.builds(ResumeRequested, TIMES, st.just(ANN)),
    st.builds(StopRequested, TIMES, st.just(ANN)),
    st.builds(StopSent, TIMES, st.integers(1, 9), st.sampled_from(["", "no listener"])),
    st.builds(Proof, TIMES, TIMES, st.just("00")),
    st.builds(Silent, TIMES, TIMES),
    st.builds(Answered, TIMES),
    st.builds(AlarmRaised, TIMES, st.just("x"), st.just("y")),
    st.builds(Ended, TIMES, st.sampled_from(["finished", "lost", "stopped"])),
    st.just(Unknown()),
)


@given(st.lists(EVENTS, max_size=30))
def test_any_history_folds_and_so_does_every_beginning_of_it(events: list[RunEvent]) -> None:
    run = begin(REQUESTED)
    for count, event in enumerate(events, 1):
        before, run = run, follow(run, event)
        assert run == replay([REQUESTED, *events[:count]])
        if before.end is not None:
            assert (run.end, run.actions) == (before.end, before.actions)
        if before.desired == "stopped":
            assert run.desired == "stopped"


def states_of(path: str, events: list[RunEvent]) -> set[str]:
    """Return all states that were reported of an action; its path names its sub-graph."""
    graph, _, action = path.rpartition("/")
    seen = [
        fact
        for event in events
        if isinstance(event, Observed)
        for fact in event.seen
        if isinstance(fact, Snapshot | NodeState) and fact.graph == (graph or "patrol")
    ]
    told = [each.nodes.get(action) for each in seen if isinstance(each, Snapshot)]
    told += [each.state for each in seen if isinstance(each, NodeState) and each.node == action]
    return {state for state in told if state is not None}


@given(st.lists(EVENTS, max_size=20))
def test_visits_never_overlap_and_never_claim_more_than_their_bounds(
    events: list[RunEvent],
) -> None:
    run = replay([REQUESTED, *events])
    assert run is not None
    for name, action in run.actions.items():
        for visit in action.visits[:-1]:
            assert visit.until is not None
        for visit in action.visits:
            assert visit.not_before <= visit.start
            if visit.until is None:
                assert visit.not_after is None
            elif visit.not_after is None:  # given up by the engine: its code may go on
                assert "ERROR" in states_of(name, events)


@given(EVENTS)
def test_events_are_read_as_they_were_written(event: RunEvent) -> None:
    assert decode(event.kind, draft_of(event).body) == event
