"""Older files are recognised and translated."""

import json
from pathlib import Path
from typing import Any

import msgspec
import pytest

from action_assistant.umrf import semantics
from action_assistant.umrf.check import STRUCTURAL, check, check_reading
from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.files.codec import Reading, read, write
from action_assistant.umrf.model import ENTRY, EXIT
from support.recordings import CORPUS, NO_CORPUS, lines

OWN = Path(__file__).parents[1] / "examples"


#: A reply of CMake, which the engine takes for an action, since it has a name and a type.
FOREIGN = ".cmake__api__v1__reply__target-"


def reading_of(name: str) -> Reading:
    return read((OWN / name).read_bytes())


def verdicts() -> list[dict[str, Any]]:
    return [each for each in lines(CORPUS / "verdicts.jsonl") if FOREIGN not in each["file"]]


@pytest.mark.parametrize(
    ("name", "dialect"),
    [
        ("designer.umrf.graph.json", "D3-designer"),
        ("of_2023.json", "D2"),
        ("ros1.umrfg.json", "D1"),
        ("shallow.umrfg.json", "D1'"),
        ("single.umrf.json", "D0"),
    ],
)
def test_an_old_file_is_refused_as_it_stands_and_sound_afterwards(name: str, dialect: str) -> None:
    reading = reading_of(name)
    assert reading.dialect == dialect
    assert reading.notes
    assert {p.code for p in check_reading(reading)} & STRUCTURAL
    assert not {p.code for p in check(reading.graph)} & STRUCTURAL
    again = read(write(reading.graph))
    assert (again.dialect, again.notes, again.problems) == ("D3", (), ())


def test_graphs_of_ros_1_get_entry_exit_types_and_conditions() -> None:
    graph = reading_of("ros1.umrfg.json").graph
    assert [(a.full_name, a.type) for a in graph.actions] == [
        ("TaCount_0", "sync"), ("TaShow_1", "async"), ("Root_0", "sync"),
    ]  # fmt: skip
    ends = [(r.parent, r.child) for r in graph.relations if r.parent == ENTRY or r.child == EXIT]
    assert ends == [(ENTRY, "a1"), ("a3", EXIT)]
    show = next(r for r in graph.relations if (r.parent, r.child) == ("a1", "a2"))
    assert (show.conditions.on_true, show.conditions.on_error) == ("stop", "ignore")
    back = next(r for r in graph.relations if (r.parent, r.child) == ("a2", "a1"))
    assert not back.required
    assert graph.actions[0].inputs[0].text.endswith('"pvf_required":true}')
    assert dict(graph.actions[0].extra) == {"package_name": '"ta_count"'}


def test_every_action_of_a_shallow_file_stays_one() -> None:
    graph = reading_of("shallow.umrfg.json").graph
    assert [a.full_name for a in graph.actions] == ["Root_0", "go_1"]


def test_conditions_of_2023_say_what_they_meant() -> None:
    graph = reading_of("of_2023.json").graph
    told = {r.child: r.conditions for r in graph.relations if r.parent == "a1"}
    assert (told["a2"].on_true, told["a2"].on_false, told["a2"].on_error) == (
        "run",
        "ignore",
        "ignore",
    )
    assert (told["a3"].on_true, told["a3"].on_false, told["a3"].on_error) == (
        "ignore",
        "run",
        "run",
    )


def test_a_single_action_becomes_a_graph_of_itself() -> None:
    reading = reading_of("single.umrf.json")
    assert reading.graph.name == "TaMove"
    assert [(a.full_name, a.type) for a in reading.graph.actions] == [("TaMove_2", "async")]
    current = read('{"name": "A", "type": "sync"}')
    assert current.dialect == "D3-action"
    assert not current.problems


def test_an_action_that_names_neighbours_becomes_a_graph_without_ghosts() -> None:
    neighbours = {"parents": [{"name": "A", "id": 0}], "children": [{"name": "C", "id": 0}]}
    for own in ({"effect": "synchronous"}, {"type": "sync"}):
        reading = read(json.dumps({"name": "B", **own, **neighbours}))
        graph = reading.graph
        assert [(a.full_name, a.missing) for a in graph.actions] == [("B_0", False)]
        assert [(r.parent, r.child) for r in graph.relations] == [(ENTRY, "a1"), ("a1", EXIT)]
        assert not [p for p in check(graph) if p.severity == "error"]
        told = {note.where.path for note in reading.remarks}
        assert {"/parents", "/children"} <= told
        assert not any("loop" in note for note in reading.notes)


def test_a_graph_without_a_last_action_is_not_told_to_be_one_loop() -> None:
    def action(name: str, parent: str, child: str) -> dict[str, Any]:
        sides = {"parents": [{"name": parent, "id": 0}], "children": [{"name": child, "id": 0}]}
        return {"name": name, "id": 0, "effect": "synchronous"} | sides

    first = action("A", "Z", "B") | {"parents": []}
    text = json.dumps({"graph_name": "g", "umrf_actions": [first, action("B", "A", "Gone")]})
    notes = read(text).notes
    assert not any("loop" in note for note in notes)
    assert any("graph_exit" in note and "FINISHED" in note for note in notes)


@pytest.mark.parametrize("state", ["UNINITIALIZED", "RUNNING"])
def test_a_run_state_that_is_left_out_is_told_with_its_place(state: str) -> None:
    action = {"name": "A", "type": "sync", "state": state, "runtime": {"messages": []}}
    file = {"graph_name": "g", "graph_state": "INITIALIZED", "actions": [action]}
    told = {note.where.path for note in read(json.dumps(file)).remarks}
    assert told == {"/graph_state", "/actions/0/state", "/actions/0/runtime"}


# What stops an action in files of ROS 1


def stopping(required: bool | None, shape: str) -> str:
    """A timer that stops a worker, in the words of 2021."""
    stop: dict[str, Any] = {"name": "Timer", "id": 0, "stop_when_received": True}
    if required is not None:
        stop["required"] = required

    def action(name: str, parents: list[Any], *children: str, **more: Any) -> dict[str, Any]:
        named = [{"name": child, "id": 0} for child in children]
        sides = {"parents": parents, "children": named}
        return {"name": name, "id": 0, "effect": "synchronous", **sides, **more}

    start = {"name": "Start", "id": 0, "required": True}
    shapes = {
        "worker": [
            action("Start", [], "Timer", "Work"),
            action("Timer", [start], "Work"),
            action("Work", [start, stop]),
        ],
        "root": [action("Timer", [], "Work"), action("Work", [stop], execute_first=True)],
        "and then": [
            action("Start", [], "Timer", "Work"),
            action("Timer", [start], "Work", "Next"),
            action("Work", [start, stop]),
            action("Next", [{"name": "Timer", "id": 0}]),
        ],
        "loop": [
            action("Timer", [], "Work", "Rest"),
            action(
                "Work", [{"name": "Rest", "id": 0, "required": False}, stop], "Rest",
                execute_first=True,
            ),
            action("Rest", [{"name": "Work", "id": 0}, stop], "Work"),
        ],
    }  # fmt: skip
    return json.dumps({"graph_name": "g", "umrf_actions": shapes[shape]})


def ends(text: str, work_s: float) -> str:
    """The last state of the graph after a simulated hour; the timer takes 10 s."""
    graph = read(write(read(text).graph)).graph
    times = {"Timer": 10.0, "Work": work_s, "Rest": 3.0}
    behaviours = {name: [{"after_s": after}] for name, after in times.items()}
    script = semantics.script_from({"behaviours": behaviours})
    trace = semantics.simulate(graph, script=script, facts=SIMULATED, until_ms=3_600_000)
    return [event.state for event in trace if isinstance(event, semantics.GraphStateEvent)][-1]


@pytest.mark.parametrize(
    ("shape", "work_s", "last"),
    [
        ("worker", 3.0, "FINISHED"),
        ("worker", 100.0, "HALTED"),
        ("root", 3.0, "FINISHED"),
        ("root", 100.0, "HALTED"),
        ("and then", 100.0, "FINISHED"),
        ("loop", 4.0, "HALTED"),
    ],
)
@pytest.mark.parametrize("required", [None, False])
def test_a_graph_in_which_one_action_stops_another_ends(
    shape: str, work_s: float, last: str, required: bool | None
) -> None:
    assert ends(stopping(required, shape), work_s) == last


def test_a_stopping_parent_is_not_required_and_its_failure_starts_nothing() -> None:
    graph = read(stopping(None, "worker")).graph
    stop = next(r for r in graph.relations if (r.parent, r.child) == ("a2", "a3"))
    assert not stop.required
    assert msgspec.structs.astuple(stop.conditions) == ("stop", "stop", "ignore", "ignore")


def test_an_action_that_waits_for_its_stopping_parent_is_reported_with_its_place() -> None:
    reading = read(stopping(True, "worker"))
    (waits,) = [p for p in reading.problems if p.code == "stop-awaited"]
    assert waits.where.path == "/umrf_actions/2/parents/1"
    assert waits.where.line == 1


def test_fields_that_the_engine_does_not_know_do_not_make_a_file_older() -> None:
    actions = [
        {"name": "A", "type": "sync", "id": 3, "effect": "synchronous",
         "children": [{"name": "B", "condition": "always -> run"}]},
        {"name": "B", "type": "sync", "parents": [{"name": "A"}]},
    ]  # fmt: skip
    file = {
        "graph_name": "g", "graph_entry": [{"name": "A"}], "graph_exit": [{"name": "B"}],
        "actions": actions,
    }  # fmt: skip
    reading = read(json.dumps(file))
    assert (reading.dialect, reading.notes) == ("D3", ())
    assert dict(reading.graph.actions[0].extra) == {"id": "3", "effect": '"synchronous"'}


@pytest.mark.skipif(not verdicts(), reason=NO_CORPUS)
def test_we_are_never_laxer_than_the_engines_parser() -> None:
    for verdict in verdicts():
        reading = read((CORPUS / verdict["file"]).read_bytes())
        refused = {p.code for p in check_reading(reading) if p.severity == "error"} & STRUCTURAL
        assert bool(refused) != verdict["accepted"], (verdict["file"], refused)


@pytest.mark.skipif(not verdicts(), reason=NO_CORPUS)
def test_a_translated_file_is_a_current_one() -> None:
    for verdict in verdicts():
        again = read(write(read((CORPUS / verdict["file"]).read_bytes()).graph))
        assert (again.dialect, again.notes, again.problems) == ("D3", (), ()), verdict["file"]


def test_a_file_written_from_an_old_one_is_current_even_with_an_untranslated_field() -> None:
    parent = {"name": "A", "condition": ["what is this"]}
    actions = [
        {"name": "A", "type": "sync", "children": [{"name": "B"}]},
        {"name": "B", "type": "sync", "parents": [parent]},
    ]
    ends = {"graph_entry": [{"name": "A"}], "graph_exit": [{"name": "B"}]}
    first = read(json.dumps({"graph_name": "g", "actions": actions} | ends))
    text = write(first.graph)
    assert first.dialect == "D2"
    assert "what is this" in text
    assert read(text).dialect == "D3"
