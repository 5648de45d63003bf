"""The stand-in robot by itself: each way in which it is like a real engine, and unlike one when that
is switched off."""

import json
from collections.abc import Iterable
from typing import Any

import pytest
from msgspec.structs import replace

from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import (
    EngineTraits,
    FeedbackMessage,
    GetResponse,
    Gone,
    LogMessage,
    Modify,
    Pause,
    Resume,
    Said,
    Start,
    Stop,
    index_of,
)
from action_assistant.umrf.digest import digest
from action_assistant.umrf.echo import echo
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics import script_from
from runner.harness import sequence
from umrf.semantics.traces import graph_of

WORK = json.dumps({"name": "Work", "type": "sync", "instance_id": 0})
ENDLESS = {"*": [{"never": True}]}
CALM = EngineTraits(loss=0.0)
DAVID = ("David",)


def robot(
    script: dict[str, Any] | None = None, quirks: EngineTraits = CALM, **more: Any
) -> EmulatedEngine:
    return EmulatedEngine(
        "David", script=script_from({"behaviours": script or {}}), quirks=quirks, **more
    )


def start(graph: Graph | str, targets: tuple[str, ...] = DAVID, run: str = "r1") -> Start:
    if isinstance(graph, str):
        return Start(graph_name="x", targets=targets, graph_json=graph)
    text = codec.write(graph, codec.Stamp("g", "v", run))
    return Start(graph_name=graph.name, targets=targets, graph_json=text)


def told(said: Iterable[Said]) -> list[str]:
    return [each.text for each in said if isinstance(each, LogMessage)]


def answers(said: Iterable[Said]) -> dict[int, dict[str, Any]]:
    return {
        each.ticket: {json.loads(text)["graph_name"]: json.loads(text) for text in each.running}
        for each in said
        if isinstance(each, GetResponse)
    }


def asked(david: EmulatedEngine, at: float) -> dict[str, Any]:
    david.ask(99, at)
    return answers(david.advance(at + 2))[99]


def states(graph: dict[str, Any]) -> dict[str, str]:
    return {f"{each['name']}_{each['instance_id']}": each["state"] for each in graph["actions"]}


def history(said: Iterable[Said]) -> list[tuple[str, dict[str, str]]]:
    """Every snapshot of the feedback, oldest first."""
    return [
        (json.loads(text)["graph_state"], states(json.loads(text)))
        for each in said
        if isinstance(each, FeedbackMessage)
        for text in reversed(each.history)
    ]


def test_the_newest_command_of_a_topic_wins_and_the_lost_one_leaves_no_trace() -> None:
    david = robot(ENDLESS)
    for name in ("one", "two", "three"):
        david.hear(start(sequence(name)), 0)
    david.hear(Stop(graph_name="nothing", targets=DAVID), 0)
    lines = told(david.advance(10))
    assert [line for line in lines if "start" in line] == [
        "Received request to start UMRF graph: three"
    ]
    assert david.moving == ("three",)
    assert any("Cannot stop UMRF graph 'nothing'" in line for line in lines)


def test_deeper_topics_overwrite_no_message() -> None:
    david = robot(ENDLESS, EngineTraits(loss=0.0, depth=0))
    for name in ("one", "two", "three"):
        david.hear(start(sequence(name)), 0)
    david.advance(10)
    assert david.moving == ("one", "two", "three")


def test_the_robot_is_deaf_while_an_action_does_not_stop_and_then_answers_everything_at_once() -> (
    None
):
    david = robot({"*": [{"never": True, "ignores_stop": True}]})
    david.hear(start(sequence("patrol")), 0)
    david.hear(Stop(graph_name="patrol", targets=DAVID), 100)
    for ticket in range(4):
        david.ask(ticket, 1000 + ticket * 1000)
    david.hear(start(sequence("one")), 2000)
    david.hear(start(sequence("two")), 3000)
    assert answers(david.advance(5000)) == {}
    said = david.advance(5200)
    assert david.moving == ("patrol", "two")  # ERROR is what it says of an action that goes on
    shown = answers(said)
    assert sorted(shown) == [0, 1, 2, 3]
    assert all(each["patrol"]["graph_state"] == "ERROR" for each in shown.values())
    times = [each.at_ms for each in said if isinstance(each, GetResponse)]
    assert max(times) - min(times) < 5


def test_a_start_of_a_running_graph_stops_it_and_only_the_log_says_so() -> None:
    david = robot(ENDLESS)
    david.hear(start(sequence("patrol")), 0)
    david.hear(start(sequence("patrol"), run="r2"), 1000)
    lines = told(david.advance(2000))
    assert any("because it's already active (RUNNING)" in line for line in lines)
    assert david.moving == ()
    assert asked(david, 2100)["patrol"]["graph_state"] == "STOPPED"


def test_without_that_it_is_only_refused() -> None:
    david = robot(ENDLESS, EngineTraits(loss=0.0, restart_stops=False))
    david.hear(start(sequence("patrol")), 0)
    david.hear(start(sequence("patrol")), 1000)
    assert any("already active" in line for line in told(david.advance(2000)))
    assert david.moving == ("patrol",)


def test_feedback_comes_twice_a_second_newest_first_and_only_when_there_is_any() -> None:
    david = robot({"*": [{"after_s": 0.3}]}, born_ms=0)
    david.hear(start(sequence("patrol", 2)), 1210)
    batches = [each for each in david.advance(10_000) if isinstance(each, FeedbackMessage)]
    assert [each.at_ms for each in batches] == [1500, 2000]
    assert history(batches[:1]) == [("RUNNING", {"Work_0": "RUNNING", "Work_1": "UNINITIALIZED"})]
    assert history(batches[1:]) == [
        ("RUNNING", {"Work_0": "FINISHED", "Work_1": "UNINITIALIZED"}),
        ("RUNNING", {"Work_0": "FINISHED", "Work_1": "RUNNING"}),
        ("FINISHED", {"Work_0": "FINISHED", "Work_1": "FINISHED"}),
    ]
    assert batches[0].actor == "David"


def test_the_ring_keeps_the_newest_snapshots() -> None:
    david = robot({"*": [{"after_s": 0.01}]}, EngineTraits(loss=0.0, ring=3, loading_ms=0.1))
    david.hear(start(sequence("patrol", 20)), 0)
    (batch,) = [each for each in david.advance(600) if isinstance(each, FeedbackMessage)]
    assert len(batch.history) == 3
    assert json.loads(batch.history[0])["graph_state"] == "FINISHED"


@pytest.mark.parametrize("seed", range(5))
def test_snapshots_get_lost_at_random_but_the_same_way_for_the_same_seed(seed: int) -> None:
    def lived() -> list[tuple[str, dict[str, str]]]:
        david = robot({"*": [{"after_s": 0.1}]}, EngineTraits(loss=0.5), seed=seed)
        david.hear(start(sequence("patrol", 30)), 0)
        return history(david.advance(20_000))

    first = lived()
    assert first == lived()
    assert 10 < len(first) < 50


def test_the_end_is_not_in_the_feedback_when_an_error_leads_to_the_exit() -> None:
    david = robot({"*": [{"after_s": 0.1, "result": "on_error"}]})
    david.hear(start(sequence("patrol", 1)), 0)
    assert all(state == "RUNNING" for state, _ in history(david.advance(5000)))
    assert asked(david, 5000)["patrol"]["graph_state"] == "FINISHED"


def test_pausing_and_resuming_bring_no_feedback() -> None:
    david = robot(ENDLESS)
    david.hear(start(sequence("patrol")), 0)
    david.advance(900)
    david.hear(Pause(graph_name="patrol", targets=DAVID), 1000)
    assert history(david.advance(2000)) == []
    assert asked(david, 2000)["patrol"]["graph_state"] == "PAUSED"
    david.hear(Resume(graph_name="patrol", targets=DAVID), 2100)
    assert history(david.advance(3000)) == []
    assert asked(david, 3000)["patrol"]["graph_state"] == "RUNNING"


def test_graphs_that_have_ended_are_listed_unless_that_is_switched_off() -> None:
    for keeps in (True, False):
        david = robot({"*": [{"after_s": 0.1}]}, EngineTraits(loss=0.0, keeps_ended=keeps))
        david.hear(start(sequence("patrol")), 0)
        david.advance(2000)
        assert ("patrol" in asked(david, 2000)) == keeps


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (start("{no"), "syntax errors"),
        (start("{}"), "syntax errors"),
        (start('{"graph_name": "old", "umrf_actions": []}'), "must be an array"),
        (Start(graph_name="unheard", targets=DAVID), "doesn't exist"),
        (start(sequence("patrol"), targets=("Carol",)), "was not targeted"),
        (start(sequence("patrol"), targets=()), "was not targeted"),
        (start(sequence("patrol")), "Could not resolve graph 'patrol'"),
    ],
)
def test_refusals_are_known_to_the_log_only(message: Start, words: str) -> None:
    index = index_of([WORK.replace("Work", "Other")], [])
    for narrates in (True, False):
        david = robot(ENDLESS, EngineTraits(loss=0.0, narrates=narrates), index=index)
        david.hear(message, 0)
        said = david.advance(3000)
        assert not [each for each in said if not isinstance(each, LogMessage)]
        assert any(words in line for line in told(said)) == narrates
        assert asked(david, 3000) == {}


def test_the_shown_graph_is_the_echo_of_the_engine_and_carries_the_identity_of_the_run() -> None:
    sent = sequence("patrol")
    for drops in (True, False):
        david = robot(
            ENDLESS, EngineTraits(loss=0.0, drops_fields=drops), index=index_of([WORK], [])
        )
        david.hear(start(sent), 0)
        shown = asked(david, 100)["patrol"]
        back = codec.read(json.dumps(shown)).graph
        assert digest(echo(back, PINNED)) == digest(echo(sent, PINNED))
        marks = [each["gui_attributes"]["action_assistant"]["run"] for each in shown["actions"]]
        assert marks == ["r1"] * 3
        assert ("conditions" in shown["graph_exit"][0]) != drops


def test_sub_graphs_come_from_its_index_and_are_named_after_their_node() -> None:
    inner = codec.write(sequence("Inner", 1))
    outer = sequence("outer", 1)
    text = codec.write(outer).replace('"Work"', '"Inner"')
    david = robot({"*": [{"after_s": 0.5}]}, index=index_of([WORK], [inner]))
    david.hear(start(text), 0)
    david.advance(100)
    assert asked(david, 100).keys() == {"outer", "outer__Inner__0"}
    david.hear(start(inner), 200)
    assert any("graph name not unique" in line for line in told(david.advance(300)))


def test_the_robot_answers_to_its_wake_words_and_the_first_extra_one_becomes_its_name() -> None:
    for quirk, actor in ((True, "all"), (False, "David")):
        quirks = EngineTraits(loss=0.0, extra_is_actor=quirk)
        david = robot(ENDLESS, quirks, extra_wake_words=("all", "kitchen"))
        david.hear(start(sequence("patrol"), targets=("kitchen",)), 0)
        (batch, *_) = [each for each in david.advance(600) if isinstance(each, FeedbackMessage)]
        assert batch.actor == actor


def test_a_stop_passes_by_an_action_that_is_just_being_loaded() -> None:
    david = robot(ENDLESS, EngineTraits(loss=0.0, loading_ms=400))
    david.hear(start(sequence("patrol")), 0)
    david.hear(Stop(graph_name="patrol", targets=DAVID), 100)
    david.advance(200)
    shown = asked(david, 200)["patrol"]
    assert (shown["graph_state"], states(shown)["Work_0"]) == ("STOPPED", "UNINITIALIZED")
    shown = asked(david, 600)["patrol"]
    assert (shown["graph_state"], states(shown)["Work_0"]) == ("STOPPED", "RUNNING")


def test_a_behaviour_says_how_long_its_action_loads() -> None:
    """The loading action moves in a graph that a leaf has halted, and no feedback told of it before."""
    slow = {"B": [{"after_s": 0.01}], "C": [{"load_s": 1.5, "never": True}]}
    patrol = replace(graph_of("entry>A", "A>B", "A>C", "C>exit"), name="patrol")
    david = robot({"*": [{"after_s": 0.2}], **slow}, EngineTraits(loss=0.0, loading_ms=3.0))
    david.hear(start(patrol), 0)
    david.advance(1_000)
    shown = asked(david, 1_000)["patrol"]
    assert (shown["graph_state"], states(shown)["C_0"]) == ("HALTED", "UNINITIALIZED")
    shown = asked(david, 2_000)["patrol"]
    assert (shown["graph_state"], states(shown)["C_0"]) == ("HALTED", "RUNNING")
    david.hear(Stop(graph_name="patrol", targets=DAVID), 2_100)
    david.advance(2_600)
    shown = asked(david, 2_600)["patrol"]
    assert (shown["graph_state"], states(shown)["C_0"]) == ("STOPPED", "FINISHED")


def test_a_modify_is_done_or_refused_and_a_refused_one_leaves_the_graph_paused() -> None:
    david = robot(ENDLESS)
    david.hear(start(sequence("patrol", 2)), 0)
    longer, shorter = codec.write(sequence("patrol", 3)), codec.write(sequence("patrol", 0))

    def modify(text: str) -> Modify:
        return Modify(graph_name="patrol", targets=DAVID, modified_graph=text)

    david.hear(modify(longer), 1000)
    assert "UMRF graph 'patrol' modified." in told(david.advance(1500))
    assert len(asked(david, 1500)["patrol"]["actions"]) == 3
    david.hear(modify(shorter.replace('"graph_entry": []', '"graph_entry": []')), 2000)
    assert any("cannot be deleted" in line for line in told(david.advance(2500)))
    assert asked(david, 2500)["patrol"]["graph_state"] == "PAUSED"


def test_told_to_end_it_is_deaf_and_mute_and_drives_its_graph_to_the_end() -> None:
    david = robot({"*": [{"after_s": 1}]})
    david.hear(start(sequence("patrol", 2)), 0)
    david.advance(500)
    david.quit(500)
    david.hear(Stop(graph_name="patrol", targets=DAVID), 600)
    david.ask(1, 600)
    assert david.advance(1500) == []
    assert david.moving == ("patrol",)
    said = david.advance(10_000)
    assert [type(each) for each in said] == [Gone]
    assert david.moving == ()


def test_killed_it_never_says_anything_again() -> None:
    david = robot({"*": [{"after_s": 1}]})
    david.hear(start(sequence("patrol")), 0)
    david.advance(100)
    david.kill()
    david.ask(1, 200)
    assert david.advance(10_000) == []
    assert (david.due, david.moving) == (None, ())


def test_a_pause_that_an_action_does_not_handle_locks_it_for_ever() -> None:
    david = robot({"*": [{"never": True, "pauses": False}]})
    david.hear(start(sequence("patrol")), 0)
    david.hear(Pause(graph_name="patrol", targets=DAVID), 1000)
    david.advance(2000)
    david.hear(Stop(graph_name="patrol", targets=DAVID), 2000)
    david.ask(1, 2000)
    assert answers(david.advance(60_000)) == {}
    assert david.moving == ("patrol",)


def test_a_graph_indexed_later_can_be_inside_of_a_graph_started_later() -> None:
    whole = json.loads(codec.write(sequence("tour", 1)))
    text = json.dumps(whole).replace("Work", "leg")
    david = robot(index=index_of([WORK], []))
    david.hear(start(text), 1)
    assert "Could not resolve graph" in told(david.advance(100))[-1]
    david.reindex(index_of([WORK], [codec.write(sequence("leg", 2))]))
    david.ask(1, 200)
    (answer,) = [each for each in david.advance(210) if isinstance(each, GetResponse)]
    assert [json.loads(each)["graph_name"] for each in answer.indexed] == ["leg"]
    david.hear(start(text), 300)
    david.ask(2, 10_000)
    held = answers(david.advance(10_010))[2]
    assert {name: each["graph_state"] for name, each in held.items()} == {
        "tour": "FINISHED",
        "tour__leg__0": "FINISHED",
    }
