"""A replay shows at every moment exactly what was known then."""

from collections.abc import Sequence
from typing import Any

import anyio
import msgspec
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.runner.analysis.keyframes import APART, KeyframeStore, author_and_text
from action_assistant.runner.analysis.replay import ReplayFrame, RunReplay, run_replay
from action_assistant.runner.links.observations import NodeResult, NodeState, Seen, Snapshot
from action_assistant.runner.runs import views
from action_assistant.runner.runs.events import (
    Author,
    BreakpointsSet,
    Ended,
    HandedOver,
    Held,
    Observed,
    Released,
    RunEvent,
    StopRequested,
    draft_of,
)
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.question_events import QuestionAsked
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.questions import Question
from runner.harness import MemoryJournal, virtual
from runner.runs.test_runs import STARTED
from support.doses import examples

STATES = ("UNINITIALIZED", "RUNNING", "STOPPING", "FINISHED", "ERROR", "PAUSED")
NODES = ("Go_0", "Grip_0", "Sub__Go__0")

node_states = st.builds(
    lambda node, state: lambda at: NodeState(at, "patrol", node, state),
    st.sampled_from(NODES),
    st.sampled_from(STATES),
)
results = st.builds(
    lambda node, result, said: lambda at: NodeResult(at, "patrol", node, result, said),
    st.sampled_from(NODES),
    st.sampled_from(["on_true", "on_false", "on_error"]),
    st.sampled_from([None, "jammed", "no way"]),
)
snapshots = st.builds(
    lambda nodes: (
        lambda at: Snapshot(
            at=at, graph="patrol", state="RUNNING", nodes=nodes, run="r1", since=at - 50
        )
    ),
    st.dictionaries(st.sampled_from(NODES), st.sampled_from(STATES), max_size=3),
)
batches = st.lists(st.lists(st.one_of(node_states, results, snapshots), max_size=4), max_size=30)


def told(drawn: Sequence[Sequence[Any]]) -> list[RunEvent]:
    """A run of which this was seen, one batch a millisecond."""
    events = list(STARTED)
    for i, batch in enumerate(drawn):
        at = 2_000 + i * 1_000
        seen: tuple[Seen, ...] = tuple(make(at) for make in batch)
        events.append(Observed(at, seen))
    end = 3_000 + len(drawn) * 1_000
    return [*events, StopRequested(end, Author("b", "Ben")), Ended(end + 1, "stopped", None, "so")]


async def stored(events: Sequence[RunEvent]) -> MemoryJournal:
    journal = MemoryJournal()
    drafts = [draft_of(each, "x") for each in events]
    await journal.append("run/r1", drafts)
    return journal


def played(run_replay: RunReplay, upto: int) -> dict[str, Any]:
    """The run as the page draws it after the event `upto`: base, then frames."""
    shown: dict[str, Any] = {"head": {}, "actions": {}}
    if run_replay.base is not None:
        built = msgspec.to_builtins(run_replay.base)
        shown["head"] = built
        shown["actions"] = {
            name: {"state": action["state"], "older": action["older"], "visits": action["visits"]}
            for name, action in built["actions"].items()
        }
    for frame in run_replay.frames:
        if frame.seq <= upto:
            _apply(shown, frame)
    return shown


def _apply(shown: dict[str, Any], frame: ReplayFrame) -> None:
    built = msgspec.to_builtins(frame)
    shown["head"] |= built.get("head", {})
    for name, change in built.get("actions", {}).items():
        action = shown["actions"].setdefault(name, {"state": "", "older": 0, "visits": []})
        action["state"] = change["state"]
        del action["visits"][change["first"] - action["older"] :]
        action["visits"] += change.get("visits", [])


@settings(deadline=None, max_examples=examples(60))
@given(batches)
def test_replay_at_any_event_equals_the_fold_of_the_events_up_to_it(drawn: Any) -> None:
    events = told(drawn)

    async def main() -> None:
        keyframe_store = KeyframeStore(await stored(events))
        keyframes = await run_replay(keyframe_store, "r1", after=0)
        assert [frame.seq for frame in keyframes.frames] == list(range(1, len(events) + 1))
        for upto in range(1, len(events) + 1):
            run = replay(events[:upto])
            assert run is not None
            whole = msgspec.to_builtins(views.run_view(run))
            shown = played(keyframes, upto)
            assert shown["head"]["state"] == whole["state"]
            assert shown["head"].get("unknown_since") == whole["unknown_since"]
            assert shown["head"].get("ended_at") == whole["ended_at"]
            for name, action in whole["actions"].items():
                assert shown["actions"][name]["state"] == action["state"]
                assert shown["actions"][name]["visits"][-20:] == action["visits"][-20:]

    anyio.run(main)


def long_run(events: int) -> list[RunEvent]:
    states = ("RUNNING", "FINISHED")
    ticks = [
        Observed(2_000 + i, (NodeState(2_000 + i, "patrol", "Go_0", states[i % 2]),))
        for i in range(events)
    ]
    return [*STARTED, *ticks, Ended(9_000_000, "finished", "on_true")]


@virtual
async def test_the_pages_of_a_long_film_join_without_a_gap() -> None:
    events = long_run(2 * APART + 10)
    keyframe_store = KeyframeStore(await stored(events))
    first = await run_replay(keyframe_store, "r1", after=0)
    second = await run_replay(keyframe_store, "r1", after=APART + 5)
    third = await run_replay(keyframe_store, "r1", after=2 * APART)
    assert [chapter.after for chapter in first.chapters] == [0, APART, 2 * APART]
    assert (first.after, second.after, third.after) == (0, APART, 2 * APART)
    seqs = [frame.seq for page in (first, second, third) for frame in page.frames]
    assert seqs == list(range(1, len(events) + 1))
    run = replay(events[:APART])
    assert run is not None
    assert second.base == views.run_view(run)


@virtual
async def test_keyframes_are_a_cache_that_may_vanish_or_be_of_another_fold() -> None:
    events = long_run(APART + 700)
    journal = await stored(events)
    whole = await KeyframeStore(journal).keyframes("r1")
    assert whole.keys[-1].run == replay(events)
    assert journal.snapshots
    again = await KeyframeStore(journal).keyframes("r1")  # from the cache
    assert again == whole
    other = msgspec.structs.replace(whole, fold=-1)
    await journal.keep_snapshot("run/r1", whole.keys[-1].seq, msgspec.msgpack.encode(other))
    assert await KeyframeStore(journal).keyframes("r1") == whole
    await journal.keep_snapshot("run/r1", whole.keys[-1].seq, b"nonsense")
    assert await KeyframeStore(journal).keyframes("r1") == whole


@virtual
async def test_keyframes_of_an_open_run_are_stored_at_each_multiple_and_continued() -> None:
    events = long_run(3 * APART)
    journal = await stored(events[: APART - 1])
    followed = KeyframeStore(journal)
    await followed.keyframes("r1")
    assert not journal.snapshots  # nothing worth it yet
    for upto, kept in ((APART + 5, APART + 5), (2 * APART - 1, APART + 5), (2 * APART, 2 * APART)):
        there = await journal.newest("run/r1")
        rest = [draft_of(each, "x") for each in events[there:upto]]
        await journal.append("run/r1", rest)
        await followed.keyframes("r1")
        assert journal.snapshots["run/r1"].seq == kept
        again = await KeyframeStore(journal).keyframes("r1")  # by who begins there
        whole = KeyframeStore(await stored(events[:upto]))
        assert again == await whole.keyframes("r1")


@virtual
async def test_keyframes_stand_at_whole_multiples_however_many_events_are_read_at_once() -> None:
    events = long_run(6 * APART)
    journal = await stored(events[:700])
    keyframe_store = KeyframeStore(journal)
    await keyframe_store.keyframes("r1")
    rest = [draft_of(each, "x") for each in events[700:]]
    await journal.append("run/r1", rest)
    keys = (await keyframe_store.keyframes("r1")).keys
    assert [key.seq for key in keys] == [*range(APART, len(events), APART), len(events)]
    for key in keys:
        assert key.run == replay(events[: key.seq])


@virtual
async def test_keyframes_that_were_made_early_go_on_with_the_run() -> None:
    events = long_run(APART + 50)
    journal = await stored(events[: APART // 2])
    keyframe_store = KeyframeStore(journal)
    early = await keyframe_store.keyframes("r1")
    assert early.keys[-1].seq == APART // 2
    rest = [draft_of(each, "x") for each in events[APART // 2 :]]
    await journal.append("run/r1", rest)
    late = await keyframe_store.keyframes("r1")
    assert late.keys[-1].run == replay(events)
    run = replay(events[:1234])
    assert await keyframe_store.at("r1", 1234) == run


def test_marks_say_what_held_a_led_run_and_who_let_it_go_on() -> None:
    ann, ben = Author("ann", "Ann"), Author("ben", "Ben")
    point = Breakpoint(action="Grip_0", visit=7)
    asks = Question(kind="confirm", text="Is it free?")
    asked = QuestionAsked(at=1, call=1, node="Ask_0", visit=1, question="q", asks=asks)
    told: list[tuple[RunEvent, tuple[str, str]]] = [
        (Held(at=1, why="Ann made it wait.", by=ann, how="wait"), ("Ann", "Ann made it wait.")),
        (Held(at=1, why="A robot was lost."), ("", "A robot was lost.")),
        (Released(at=1, author=ben), ("Ben", "")),
        (Released(at=1, author=ben, step="Grip_0"), ("Ben", "one step, Grip_0")),
        (Released(at=1, author=ben, over=("Pick", "Turn")), ("Ben", "over Pick › Turn")),
        (HandedOver(at=1, author=ann, to=ben), ("Ann", "Ben")),
        (
            BreakpointsSet(at=1, author=ann, breakpoints=(point,)),
            ("Ann", "before Grip_0, visit 7"),
        ),
        (asked, ("", "Is it free?")),
    ]
    assert [author_and_text(event) for event, _ in told] == [text for _, text in told]
