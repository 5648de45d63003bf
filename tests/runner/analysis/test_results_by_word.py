"""Results of led actions: those that an answer showed are observed, those of a person's word are not."""

import csv
import io
from types import SimpleNamespace
from typing import Any

import msgspec

from action_assistant.runner.analysis import annotations, expected_runs, exports
from action_assistant.runner.analysis.comparison import SentTree, compare
from action_assistant.runner.analysis.statistics import statistics
from action_assistant.runner.runs import views
from action_assistant.runner.runs.events import Author, Ended, Led, PieceEnded, PieceSeen, Published
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import Visit
from action_assistant.umrf.files import codec
from runner.harness import sequence
from runner.runs.test_runs import REQUESTED

BEN = Author("ben", "=Ben")
GRAPH = sequence("task", 2)


def led(*ends: PieceEnded, more: tuple[Any, ...] = ()) -> Run:
    """Return a led run of which each end is one call of an action, shorter than the pace of gets."""
    players = {"Work_0": "David", "Work_1": "Carol"}
    asked = msgspec.structs.replace(
        REQUESTED,
        graph_name="task",
        actions={each.full_name: each.key for each in GRAPH.actions},
        engine="conducted",
        simulated=False,
        led=Led(robots={}, players=players),
        umrf=codec.write(GRAPH),
    )
    events: list[Any] = [asked, Published(1_000, "life")]
    for end in ends:
        visit = Visit(start=2_000, not_before=1_500, until=2_000, not_after=2_500, how="inferred")
        seen = PieceSeen(at=2_500, call=end.call, node=end.node, state="FINISHED", visit=visit)
        events += [seen, end]
    found = replay([*events, *more, Ended(9_000, "finished", "on_true")])
    assert found is not None
    return found


def end(call: int, node: str, how: Any, outcome: Any = "on_true") -> PieceEnded:
    """Return the end of a call. `how`: "shape" or "word"."""
    word = {"by": BEN, "reason": "I look."} if how == "word" else {}
    return PieceEnded(at=3_000, call=call, node=node, outcome=outcome, how=how, **word)


def test_a_result_by_shape_is_observed_however_short_the_action_was() -> None:
    run = led(end(1, "Work_0", "shape", "on_false"))
    (visit,) = run.actions["Work_0"].visits
    assert (visit.result, visit.how) == ("false", "observed")
    summed = annotations.sum_of(run, None, 0).actions["Work_0"]
    assert (summed.results, summed.said, summed.inferred) == ({"false": 1}, {}, 0)


def test_a_result_by_word_is_counted_apart_and_said_everywhere() -> None:
    run = led(end(1, "Work_0", "shape"), end(2, "Work_1", "word"), end(3, "Work_1", "shape"))
    sums = annotations.sum_of(run, None, 0).actions
    assert (sums["Work_1"].results, sums["Work_1"].said) == ({"true": 1}, {"true": 1})
    assert sums["Work_1"].inferred == 1
    rows = list(csv.DictReader(io.StringIO(exports.intervals(run).decode())))
    assert [(row["action"], row["how"], row["said_by"]) for row in rows] == [
        ("Work_0", "observed", ""),
        ("Work_1", "inferred", "'=Ben"),
        ("Work_1", "observed", ""),
    ]
    doubts = [each.text for each in expected_runs.recorded(run).doubts]
    assert any("is the word of =Ben; nothing showed it" in each for each in doubts)


def test_statistics_count_a_result_by_word_in_no_other_figure() -> None:
    run = led(end(1, "Work_0", "word", "on_false"), end(2, "Work_0", "shape"))
    row = SimpleNamespace(
        id="r", number=1, graph_name="task", state="finished", result="on_true", summary={}
    )
    sums = [
        SimpleNamespace(
            run="r",
            action=name,
            aid=each.aid,
            visits=each.visits,
            results=each.results | ({annotations.SAID: each.said} if each.said else {}),
            inferred=each.inferred,
            took=[],
        )
        for name, each in annotations.sum_of(run, None, 0).actions.items()
    ]
    found = statistics([row], sums, None).actions[0]  # type: ignore[list-item, arg-type]
    assert (found.visits, found.results, found.said, found.unknown) == (
        2,
        {"true": 1},
        {"false": 1},
        0,
    )


def test_a_comparison_says_whose_word_a_result_is() -> None:
    one, other = led(end(1, "Work_0", "shape")), led(end(1, "Work_0", "word", "on_false"))
    tree = SentTree(codec.write(GRAPH), {}, "")
    parting = compare(one, other, tree, tree).parting
    assert parting is not None
    assert "false in run 1, by the word of =Ben" in parting.text


def test_a_late_message_of_an_action_takes_nothing_back() -> None:
    visit = Visit(start=2_000, not_before=1_500, until=2_000, not_after=2_500)
    late = PieceSeen(
        at=4_000, call=1, node="Work_0", state="FINISHED", visit=visit, messages=("done",)
    )
    run = led(end(1, "Work_0", "shape"), more=(late,))
    assert run.actions["Work_0"].visits[-1].result == "true"
    again = msgspec.structs.replace(
        late, state="RUNNING", visit=msgspec.structs.replace(visit, until=None, not_after=None)
    )
    run = led(end(1, "Work_0", "shape"), more=(again,))
    assert run.actions["Work_0"].visits[-1].result is None


def test_a_word_for_a_call_that_was_never_seen_is_not_put_on_another_visit() -> None:
    unseen = end(2, "Work_0", "word", "on_false")
    run = led(end(1, "Work_0", "shape"), more=(unseen,))
    (shown,) = views.run_view(run).actions["Work_0"].visits
    assert (shown.result, shown.how) == ("true", "observed")
    assert shown.said is msgspec.UNSET
