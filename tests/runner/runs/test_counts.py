"""Counts of visits are lower bounds where visits may have been missed, and arrows force some of
them."""

from action_assistant.runner.analysis import annotations, exports
from action_assistant.runner.analysis.comparison import SentTree, compare
from action_assistant.runner.links.observations import NodeState, Snapshot
from action_assistant.runner.runs import views
from action_assistant.runner.runs.counts import VisitCount, visit_counts
from action_assistant.runner.runs.events import Ended, Observed, Published, Requested, RunEvent
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.run import Run
from action_assistant.umrf.files import codec
from action_assistant.umrf.laps import laps
from action_assistant.umrf.model import Graph
from runner.harness import ANN, carousel, sequence

S = 1_000_000
LOOP = carousel("loop")


def requested(graph: Graph, *inside: Graph, number: int = 1) -> Requested:
    return Requested(
        at=1, run=f"r{number}", number=number, request_id="q", author=ANN, graph=None,
        graph_name=graph.name, version="v", digest="d", engine="Robin", simulated=False,
        actions={each.full_name: each.key for each in graph.actions}, umrf=codec.write(graph),
        laps=laps(graph), inner_laps={each.name: laps(each, inside=True) for each in inside},
    )  # fmt: skip


def look(at: int, graph: str, **nodes: str) -> Observed:
    """An answer a tenth of a second after it was asked for."""
    shown = Snapshot(
        at=at * S,
        graph=graph,
        state="RUNNING",
        nodes=nodes,
        run="r1",
        asked_at=at * S - S // 10,
        since_asked=(at - 1) * S - S // 10,
    )
    return Observed(at * S, (shown,))


def lived(first: Requested, *told: RunEvent) -> Run:
    run = replay([first, Published(2), *told])
    assert run is not None
    return run


def seen_in_a_loop(laps_seen: int, number: int = 1) -> Run:
    """`Work_1` was seen so many times, `Work_0` never while it ran, and once at rest before."""
    told: list[RunEvent] = [look(1, "loop", Work_0="FINISHED", Work_1="UNINITIALIZED")]
    for lap in range(laps_seen):
        told += [
            look(2 * lap + 2, "loop", Work_1="RUNNING"),
            look(2 * lap + 3, "loop", Work_1="FINISHED"),
        ]
    return lived(requested(LOOP, number=number), *told, Ended(99 * S, "stopped"))


def test_a_child_in_a_loop_did_not_run_again_without_its_parent() -> None:
    counts = visit_counts(seen_in_a_loop(5))
    assert counts["Work_1"] == VisitCount(least=5, at_least=True, seen=5)
    assert counts["Work_0"] == VisitCount(least=5, at_least=True, seen=1)


def test_visits_by_transitions_and_of_actions_that_run_once_are_counted_exactly() -> None:
    told = [
        Observed(at, (NodeState(at, "loop", "Work_0", state),))
        for at, state in ((3, "RUNNING"), (4, "FINISHED"), (5, "RUNNING"), (6, "FINISHED"))
    ]
    assert visit_counts(lived(requested(LOOP), *told))["Work_0"] == VisitCount(2, False, 2)
    line = sequence("line", 2)
    shown = look(2, "line", Work_0="FINISHED", Work_1="UNINITIALIZED")
    counts = visit_counts(lived(requested(line), shown))
    assert [counts[name] for name in ("Work_0", "Work_1")] == [
        VisitCount(1, False, 1),
        VisitCount(0, False, 0),
    ]


def test_a_graph_inside_of_what_runs_once_is_counted_exactly_and_of_a_loop_at_least() -> None:
    inner = sequence("Sub", 2)
    shown = (
        look(2, "line__Work__0", Work_0="FINISHED", Work_1="RUNNING"),
        look(3, "line__Work__0", Work_0="FINISHED", Work_1="FINISHED"),
    )
    line = sequence("line", 1)
    part = inner.__class__(name="Work", actions=inner.actions, relations=inner.relations)
    run = lived(requested(line, part), look(1, "line", Work_0="RUNNING"), *shown)
    assert visit_counts(run)["line__Work__0/Work_1"] == VisitCount(1, False, 1)
    untold = lived(requested(line), look(1, "line", Work_0="RUNNING"), *shown)
    assert visit_counts(untold)["line__Work__0/Work_1"] == VisitCount(1, True, 1)


def test_statistics_pages_and_exports_say_at_least() -> None:
    run = seen_in_a_loop(5)
    summed = annotations.sum_of(run, None, 1).actions["Work_0"]
    assert (summed.visits, summed.at_least, summed.inferred) == (5, True, 5)
    shown = views.run_view(run).actions["Work_0"]
    assert (shown.count, shown.at_least) == (5, True)
    lines = exports.intervals(run).decode().splitlines()
    assert lines[0].endswith(",missed")
    assert [line.rpartition(",")[2] for line in lines if line.startswith("Work_0")] == ["4 or more"]


def test_a_visit_that_may_have_been_missed_is_no_difference_between_two_runs() -> None:
    sent = SentTree(codec.write(LOOP))
    found = compare(seen_in_a_loop(5), seen_in_a_loop(3, number=2), sent, sent)
    assert found.parting is None
    assert {step.relation for step in found.steps} <= {"same", "unknown"}
    assert "may have been missed" in found.text
