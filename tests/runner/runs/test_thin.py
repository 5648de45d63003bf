"""Observations that repeat what is known are not stored again, and no other is left out."""

from functools import partial
from typing import Any

import msgspec
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.runner.links.observations import NodeState, Seen, Snapshot
from action_assistant.runner.runs import views
from action_assistant.runner.runs.events import Observed, draft_of
from action_assistant.runner.runs.fold import follow, replay, thin
from action_assistant.runner.runs.run import Run
from runner.runs.test_runs import REQUESTED, STARTED, run_of

STATES = ("UNINITIALIZED", "RUNNING", "STOPPING", "FINISHED", "ERROR", "PAUSED")
PLACES = {"patrol": ("Go_0", "Grip_0"), "patrol__Sub__0": ("Go_0",)}


@st.composite
def shown(draw: st.DrawFn) -> Any:
    """A snapshot without its time. Now and then a node is missing in it."""
    graph = draw(st.sampled_from([*PLACES, "patrol"]))
    nodes = {
        name: draw(st.sampled_from(STATES))
        for name in PLACES[graph]
        if draw(st.integers(0, 20)) < 20
    }
    said = {
        name: tuple(f"ran {n}" for n in range(draw(st.integers(0, 3)), draw(st.integers(3, 12))))
        for name in nodes
    }
    return {
        "graph": graph,
        "state": draw(st.sampled_from(["RUNNING", "FINISHED"])),
        "nodes": nodes,
        "messages": {name: texts[-10:] for name, texts in said.items()},
        "inputs": {name: {"speed": str(draw(st.integers(0, 2)))} for name in nodes},
        "polled": draw(st.booleans()),
    }


def snapshot(at: int, polled: bool, **fields: Any) -> Snapshot:
    """Feedback does not say when the engine was last seen before."""
    shown = partial(Snapshot, at=at, run="r1", **fields)
    return shown(since=at - 300, source="get") if polled else shown(source="feedback")


@given(st.lists(st.one_of(shown(), st.sampled_from(STATES)), max_size=25), st.integers(1, 3))
def test_a_thinned_history_is_the_same_history(items: list[Any], together: int) -> None:
    seen: list[Seen] = []
    for i, item in enumerate(items):
        at = 2_000 + 500 * i
        if isinstance(item, str):
            seen.append(NodeState(at, "patrol", "Go_0", item))
        else:
            seen.append(snapshot(at, **item))
    full = thinned = replay(STARTED)
    assert full is not None
    assert thinned is not None
    for first in range(0, len(seen), together):
        some = tuple(seen[first : first + together])
        thinned = follow(thinned, Observed(0, thin(thinned, some)))
        full = follow(full, Observed(0, some))
        assert views.run_view(thinned) == views.run_view(full)


def test_the_stored_size_of_a_run_grows_with_its_events_not_its_graph() -> None:
    def stored(actions: int) -> int:
        names = [f"Work_{i}" for i in range(actions)]
        asked = msgspec.structs.replace(REQUESTED, actions={name: name for name in names})
        run = replay([asked, *STARTED[1:]])
        assert run is not None
        states, total = dict.fromkeys(names, "UNINITIALIZED"), 0
        for i, name in enumerate(names):
            for j, state in enumerate(("RUNNING", "FINISHED")):
                states = states | {name: state}
                at = 2_000 + 10 * (2 * i + j)
                whole = Snapshot(at=at, graph="patrol", state="RUNNING", nodes=states, run="r1")
                event = Observed(at, thin(run, (whole,)))
                run, total = follow(run, event), total + len(draft_of(event).body)
        return total

    assert stored(200) < 2.5 * stored(100)


def inputs_of(run: Run) -> list[Any]:
    return [visit.inputs for visit in run.actions["Go_0"].visits]


def test_a_visit_keeps_the_values_it_was_seen_with_and_no_others() -> None:
    def at(moment: int, state: str, **inputs: dict[str, str]) -> Snapshot:
        nodes = {"Go_0": state, "Grip_0": "UNINITIALIZED"}
        return Snapshot(at=moment, graph="patrol", state="RUNNING", nodes=nodes, inputs=inputs)

    run = run_of(
        at(2_000, "RUNNING", Go_0={"to": '"dock"'}),
        at(3_000, "FINISHED"),
        at(4_000, "RUNNING", Go_0={"to": '"shelf"'}),
        at(5_000, "STOPPING", Go_0={}),
        at(6_000, "FINISHED"),
    )
    assert inputs_of(run) == [{"to": '"dock"'}, {"to": '"shelf"'}]
    assert inputs_of(run_of(at(2_000, "UNINITIALIZED"), at(3_000, "FINISHED"))) == [None]
    exact = NodeState(10, "patrol", "Go_0", "RUNNING", {"to": "1"})
    assert inputs_of(run_of(exact)) == [{"to": "1"}]


def test_messages_go_on_where_the_engine_keeps_only_the_last_ten() -> None:
    def said(at: int, first: int) -> Snapshot:
        texts = tuple(f"lap {n}" for n in range(first, first + 10))
        nodes = {"Go_0": "RUNNING"}
        return Snapshot(
            at=at, graph="patrol", state="RUNNING", nodes=nodes, messages={"Go_0": texts}
        )

    run = run_of(said(2_000, 1), said(3_000, 3), said(4_000, 3), said(5_000, 30))
    laps = [*range(1, 13), *range(30, 40)]
    assert [each.text for each in run.actions["Go_0"].messages] == [f"lap {n}" for n in laps]
