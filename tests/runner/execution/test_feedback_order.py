"""Feedback that an answer has overtaken tells no visits that never were."""

import itertools

from hypothesis import given
from hypothesis import strategies as st

from action_assistant.runner.execution.evidence import newer_than_answers
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.runs.events import Author, Observed, Published, Requested
from action_assistant.runner.runs.fold import begin, follow
from action_assistant.runner.runs.run import Run

NODES = ("A_0", "B_0", "C_0")


def begun() -> Run:
    asked = Requested(
        at=0,
        run="r",
        number=1,
        request_id="q",
        author=Author("ann", "Ann"),
        graph=None,
        graph_name="g",
        version="v",
        digest="d",
        engine="David",
        simulated=False,
        actions=dict.fromkeys(NODES, "aid"),
        umrf="",
    )
    return follow(begin(asked), Published(1, "life"))


def history() -> list[Snapshot]:
    """A sequence of three actions, state by state."""
    states = [
        ("RUNNING", "UNINITIALIZED", "UNINITIALIZED"),
        ("FINISHED", "UNINITIALIZED", "UNINITIALIZED"),
        ("FINISHED", "RUNNING", "UNINITIALIZED"),
        ("FINISHED", "FINISHED", "UNINITIALIZED"),
        ("FINISHED", "FINISHED", "RUNNING"),
        ("FINISHED", "FINISHED", "FINISHED"),
    ]
    return [
        Snapshot(
            at=10 + i,
            graph="g",
            state="RUNNING",
            nodes=dict(zip(NODES, each, strict=True)),
            source="feedback",
            run="r",
        )
        for i, each in enumerate(states)
    ]


@given(
    asked=st.integers(0, 5),
    kept=st.sets(st.integers(0, 5)),
    cuts=st.lists(st.integers(0, 6), max_size=3),
)
def test_however_batches_and_an_answer_cross_every_action_has_one_visit(
    asked: int, kept: set[int], cuts: list[int]
) -> None:
    told, run = history(), begun()
    run = follow(run, Observed(5, (told[asked],)))
    edges = sorted({0, *cuts, 6})
    for start, end in itertools.pairwise(edges):
        batch = [told[i] for i in range(start, end) if i in kept]
        run = follow(run, Observed(20 + start, newer_than_answers(run, batch)))
    furthest = told[max([asked, *kept])]
    assert {name: action.state for name, action in run.actions.items()} == furthest.nodes
    assert all(len(action.visits) <= 1 for action in run.actions.values())


def test_feedback_of_later_changes_than_the_answer_counts() -> None:
    told, run = history(), begun()
    run = follow(run, Observed(5, (told[2],)))
    assert newer_than_answers(run, told[:4]) == (told[3],)
