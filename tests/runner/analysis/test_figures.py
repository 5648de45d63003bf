"""No figure is narrower than the observations, and the truth lies inside each figure."""

import csv
import io
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import anyio
import msgspec
import pytest
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from action_assistant.runner.analysis import (
    annotations,
    comparison,
    expected_runs,
    exports,
    statistics,
)
from action_assistant.runner.archives.archive_store import ArchiveStore
from action_assistant.runner.review.background_loops import SumUpLoop
from action_assistant.runner.review.stored_runs import StoredRuns
from action_assistant.runner.runs import views
from action_assistant.runner.runs.durations import DurationBounds, at_rank, duration_bounds
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.runner.runs.run import Run
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from runner.bounds import Lived, NetworkFaults, lived
from runner.harness import at_once, clock_us, run_in_virtual_time
from runner.runs.test_bounds import CALL, NETWORKS

SCRIPTS = st.dictionaries(
    st.sampled_from(["Work_0", "Work_1", "*"]), st.lists(CALL, min_size=1, max_size=1), max_size=3
)
ROUNDED = 0.0005


def holds(took: DurationBounds, us: float) -> bool:
    """Return whether so many microseconds lie between the bounds."""
    s = us / 1e6
    return took.least - ROUNDED <= s <= (s if took.most is None else took.most) + ROUNDED


def durations(told: Lived) -> dict[str, int]:
    """Return how long the code of each action that ended really took."""
    return {
        name: end - begun
        for name, real in told.real.items()
        for begun, end in real
        if end is not None
    }


def figures(told: Lived) -> statistics.Statistics:
    """Statistics of such a run, from what is kept of it."""
    journal = told.place.harness.journal

    async def found() -> statistics.Statistics:
        draft = annotations.draft(annotations.sum_of(told.run, None, 0))
        await journal.append(annotations.stream_about(told.run.id), [draft])
        rows = await journal.query(statistics.runs_of(told.run.graph_name, None, 10))
        sums = await journal.query(statistics.sums_of([row.id for row in rows]))
        return statistics.statistics(rows, sums, graph_of(told))

    return anyio.run(found)


def graph_of(told: Lived) -> Graph:
    (requested, *_) = told.place.harness.journal.told(told.run.id)
    return codec.read(getattr(requested, "umrf", "").encode()).graph


def shown_spans(run: Run) -> Iterator[tuple[str, float, float]]:
    """Return what the page shows of each visit that is over: action, least and most seconds."""
    for name, shown in views.run_view(run).actions.items():
        for visit in shown.visits:
            if visit.until is not None and visit.not_after is not None:
                least = (visit.until - visit.start).total_seconds()
                yield name, least, (visit.not_after - visit.not_before).total_seconds()


@settings(
    max_examples=int(os.environ.get("BOUNDS_HISTORIES", "10")),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    phases=[Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink],
)
@given(
    graph=st.sampled_from(["line", "join", "ends"]),
    script=SCRIPTS,
    network=NETWORKS,
    stop=st.none() | st.floats(0.1, 9.0),
)
@example(  # late feedback said that it was not over; an answer from before that seemed to agree
    graph="join",
    script={},
    network=NetworkFaults(loss=0.95, feedback_s=1.5, seed=123),
    stop=0.75,
)
def test_the_truth_lies_inside_of_every_figure(
    graph: str, script: dict[str, list[dict[str, Any]]], network: NetworkFaults, stop: float | None
) -> None:
    told = lived(graph, script, network, stop)
    run, real = told.run, durations(told)
    for row in csv.DictReader(io.StringIO(exports.intervals(run).decode())):
        if row["action"] in real and row["seconds_least"]:
            most = float(row["seconds_most"]) if row["seconds_most"] else None
            assert holds(
                DurationBounds(least=float(row["seconds_least"]), most=most), real[row["action"]]
            )
            assert (
                not row["seconds"] or abs(float(row["seconds"]) - real[row["action"]] / 1e6) < 0.002
            )
    for name, least, most in shown_spans(run):
        assert name not in real or holds(DurationBounds(least=least, most=most), real[name])
    if run.end is None:
        return
    found = figures(told)
    for action in found.actions:
        if action.timed and action.action in real:
            for span in (action.spans.p50, action.spans.p90, action.spans.longest):
                assert span is not None
                assert holds(span, real[action.action])
            assert action.p50 is None or abs(action.p50 - real[action.action] / 1e6) < 0.002
    ends = [end for each in told.real.values() for _, end in each]
    (point,) = found.runs
    if run.started_at is not None and point.span is not None and None not in ends:
        last = max((end for end in ends if end is not None), default=run.started_at)
        assert (
            point.span.least - ROUNDED <= (last - run.started_at) / 1e6 + 0.5
        )  # the engine's own end
        assert point.span.most is None or (last - run.started_at) / 1e6 <= point.span.most + ROUNDED
    for name, calls in expected_runs.recorded(run).behaviours.items():
        after = calls[0].get("after_s")
        (visit, *_) = run.actions[name].visits
        if after is not None and visit.most is not None:
            assert visit.least / 1e6 - 0.002 <= after <= visit.most / 1e6 + 0.002


def test_a_robot_that_tells_no_results_has_neither_failed_nor_passed_arrows_by() -> None:
    told = lived("line", {"*": [{"after_s": 1.0}]}, NetworkFaults(), None)
    assert told.run.end == "finished"
    found = figures(told)
    assert (found.judged, found.succeeded, found.unknown) == (0, 0, 1)
    assert found.never_taken == []
    assert found.untold == 1  # into the exit; of the others the child has run
    assert [each.unknown for each in found.actions] == [1, 1, 1, 1]


def test_a_run_took_as_long_as_it_moved_and_not_until_that_was_proven() -> None:
    told = lived("line", {"*": [{"after_s": 1.0}]}, NetworkFaults(get_loss=0.0), None)
    (point,) = figures(told).runs
    assert point.took is None
    assert point.span is not None
    assert point.span.most is not None
    assert point.span.least <= 4.014 <= point.span.most
    assert told.run.over_at is not None
    assert told.run.ended_at is not None
    assert told.run.over_at <= told.run.ended_at


def test_an_unseen_end_and_an_open_visit_differ() -> None:
    done = lived("line", {"*": [{"after_s": 1.0}]}, NetworkFaults(), None)
    other = lived("line", {"*": [{"never": True, "ignores_stop": True}]}, NetworkFaults(), None)
    texts = [
        getattr(each.place.harness.journal.told(each.run.id)[0], "umrf", "")
        for each in (done, other)
    ]
    found = comparison.compare(done.run, other.run, *map(comparison.SentTree, texts))
    first = next(step for step in found.steps if step.action == "Work_0")
    assert first.relation == "end"
    twice = comparison.compare(done.run, done.run, *[comparison.SentTree(texts[0])] * 2)
    assert {step.relation for step in twice.steps} == {"unknown"}
    assert "not known" in twice.text


def test_a_script_says_between_which_bounds_it_had_to_choose() -> None:
    told = lived("line", {"*": [{"after_s": 3.0}]}, NetworkFaults(), None)
    found = expected_runs.recorded(told.run)
    assert 2.0 <= found.behaviours["Work_0"][0]["after_s"] <= 4.0
    assert any("between" in doubt.text for doubt in found.doubts)


def test_visits_stand_in_mcap_between_their_bounds() -> None:
    told = lived("line", {"*": [{"after_s": 3.0}]}, NetworkFaults(), None)
    events = told.place.harness.journal.streams[stream_of(told.run.id)]
    read = make_reader(io.BytesIO(exports.mcap(events)))
    visits = {
        channel.topic: msgspec.json.decode(message.data)
        for _, channel, message in read.iter_messages()
        if channel.topic.startswith("/visits/")
    }
    assert set(visits) == {f"/visits/Work_{i}" for i in range(4)}
    for body in visits.values():
        assert body["took"]["least"] <= 3.0 <= body["took"]["most"]


@pytest.mark.parametrize("share", [0.5, 0.9, 0.99, 1])
@given(
    spans=st.lists(
        st.tuples(st.integers(0, 9_000), st.integers(0, 3_000), st.floats(0, 1)), min_size=1
    )
)
def test_a_percentile_of_ranges_holds_that_of_what_was_true(
    share: float, spans: list[tuple[int, int, float]]
) -> None:
    true = sorted(least + more * part for least, more, part in spans)
    took = [duration_bounds(1000 * least, 1000 * (least + more)) for least, more, _ in spans]
    found = at_rank(took, share)
    exact = at_rank([DurationBounds(least=each, most=each) for each in true], share)
    assert found is not None
    assert exact is not None
    assert found.most is not None
    assert found.least * 1000 - 1e-6 <= exact.least <= found.most * 1000 + 1e-6


def test_runs_that_an_older_version_has_summed_up_are_summed_up_again(tmp_path: Path) -> None:
    told = lived("line", {"*": [{"after_s": 2.0}]}, NetworkFaults(), None)
    journal = told.place.harness.journal
    old = {
        "Work_0": annotations.ActionSum(visits=1, took=(0,)),
        "Work_1": annotations.ActionSum(visits=1),
    }

    async def again_() -> list[Any]:
        stream = annotations.stream_about(told.run.id)
        journal.streams.pop(stream, None)
        await journal.append(stream, [annotations.draft(annotations.SummedUp(1, old))])
        before = await journal.query(statistics.sums_of([told.run.id]))
        assert [row.took for row in before if row.took] == [[[0, None]]]  # at least: it is no value
        async with told.place.harness.runner() as control, anyio.create_task_group() as tasks:
            archive_store = ArchiveStore(journal, tmp_path, at_once)
            summed = StoredRuns(archive_store).summed
            sums = SumUpLoop(archive_store, clock_us, summed)
            control.watch(lambda opened: sums.run_changed(opened.run, opened.recorder))
            tasks.start_soon(sums.run)
            await anyio.sleep(5)
            tasks.cancel_scope.cancel()
        assert len(journal.streams[stream]) == 2  # once, and no more
        return await journal.query(statistics.sums_of([told.run.id]))

    rows = run_in_virtual_time(again_)
    assert {row.action for row in rows} == {f"Work_{i}" for i in range(4)}
    for row in rows:
        ((least, most),) = row.took
        assert least <= 2.0 <= most
