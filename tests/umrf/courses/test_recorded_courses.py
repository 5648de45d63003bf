"""The fast rules of the checks lead each recorded course to where the real engine went.

A recording says which action ended when, and with which outcome; `Instant` says what follows from each end.
`$UMRF_RECORDINGS` names the recordings, see `support/recordings.py`.
"""

from typing import Any, Final, NamedTuple

import pytest

from action_assistant.umrf.check import refused_by_parser
from action_assistant.umrf.courses.instants import Instant, State
from action_assistant.umrf.courses.network import Network
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import PRECONDITIONS, Graph, Precondition
from action_assistant.umrf.semantics.parts import ENTRY_NODE
from action_assistant.umrf.semantics.transitions import (
    GIVING_UP,
    IDLE,
    PAUSED,
    RUNS,
    STOPS,
    THREAD_LEFT,
)
from support.recordings import engine_runs, facts, runs_of

FACTS: Final = facts("engine")
RECORDED: Final = engine_runs()
LAST: Final = {"final", "final_hang", "final_throw", "destroy"}
#: States of the engine by what the fast rules call them.
ACTIVITIES: Final = {
    "RUNNING": RUNS,
    "STOPPING": STOPS,
    "PAUSED": PAUSED,
    "PAUSE_REQUESTED": PAUSED,
}
OUTCOMES: Final[dict[str, Precondition]] = {each: each for each in PRECONDITIONS}


class Recorded(NamedTuple):
    """One recorded course. `ends`: full names of actions with their outcome, in the order in which they ended;
    `states` and `end`: the states when the graph ended, and how; "" where it still ran at last."""

    ends: list[tuple[str, Precondition]]
    states: dict[str, str]
    end: str


def recorded(lines: list[dict[str, Any]]) -> Recorded:
    """Read the ends of actions out of a trace: the engine asks the children of one that ended."""
    ends: list[tuple[str, Precondition]] = []
    states: dict[str, str] = {}
    reported = {ENTRY_NODE}  # who has reported an end since it last began
    bypassed: set[str] = set()

    def report(node: str, result: str) -> None:
        if node not in reported and node not in bypassed:
            reported.add(node)
            ends.append((node, OUTCOMES[result]))

    def over(end: str) -> Recorded:
        """An action without children that are asked shows its end after that of the graph, or never."""
        running = [node for node, state in states.items() if state == "RUNNING"]
        if len(running) == 1:
            report(running[0], "on_true")
        return Recorded(ends, states, end)

    for line in lines:
        match line.get("kind"):
            case kind if kind in LAST:
                break
            case "dispatch" if line["response"] == "run":
                if ACTIVITIES.get(states.get(line["node"], "")) is None:
                    states[line["node"]] = "RUNNING"  # it loads, which no state shows
                    reported.discard(line["node"])
            case "edge":
                parent, _, child = line["edge"].partition(" => ")
                result, _, response = line["eval"].partition(" -> ")
                report(parent, result)
                if response == "bypass":
                    bypassed.add(child)
            case "node_state":
                node, state = line["node"], line["state"]
                if state == "RUNNING":
                    reported.discard(node)
                elif state in ("FINISHED", "ERROR") and node in states:
                    report(node, "on_error" if state == "ERROR" else "on_true")
                states[node] = state
            case "graph_state" if line["state"] in ("FINISHED", "HALTED"):
                return over(line["state"].lower())
            case "crash" | "std::terminate":
                return over("crashed")
            case "exit" if line.get("rc", 0) in (-6, -11):
                return over("crashed")
            case _:
                pass
    return Recorded(ends, states, "")


def followed(graph: Graph, course: Recorded) -> tuple[str, dict[str, int]]:
    """Follow the same ends by the fast rules: how the graph ends, and what its actions do then."""
    net = Network(graph)
    states = [State(has=has) for has in net.has]
    instant = Instant(net, states.__getitem__, 0.0, 0, 0)
    instant.begin()
    for name, result in course.ends:
        if instant.end is not None:
            break
        for place, state in instant.states.items():
            states[place] = state
        instant = Instant(net, states.__getitem__, 0.0, instant.running, instant.active)
        instant.ends(net.index[name], result)
    for place, state in instant.states.items():
        states[place] = state
    does = {name: states[net.index[name]].does for name in net.names}
    return instant.end or "", does


def is_plain(name: str, graph: Graph, lines: list[dict[str, Any]]) -> bool:
    """Return whether the course follows from the graph alone: one start and no other command, no sub-graphs, no
    spontaneous actions, and a start that the engine did not refuse."""
    calls = [line["op"].split()[0] for line in lines if line.get("kind") == "call"]
    inside = {line["graph"] for line in lines if line.get("kind") == "graph_state"} - {graph.name}
    runs = any(line.get("kind") == "edge" for line in lines)
    spontaneous = any(action.type == "spontaneous" for action in graph.actions)
    started = [call for call in calls if call.startswith("start")]
    commands = {"stopGraph", "pauseGraph", "resumeGraph", "modifyGraph"}
    return (
        runs
        and not inside
        and not spontaneous
        and len(started) == 1
        and commands.isdisjoint(calls)
        and name not in FACTS["not_compared"]
    )


def courses() -> list[Any]:
    """Every run of every recording whose course follows from its graph alone."""
    found = []
    for name, folder in RECORDED.items():
        reading = codec.read((folder / f"{name}.graph.json").read_bytes())
        if reading.states or refused_by_parser(reading):
            continue
        for number, lines in enumerate(runs_of(folder, name), 1):
            if is_plain(name, reading.graph, lines):
                found.append(pytest.param(reading.graph, lines, id=f"{name}-{number}"))
    return found


@pytest.mark.parametrize(("graph", "lines"), courses())
def test_the_fast_rules_follow_a_recorded_course(graph: Graph, lines: list[dict[str, Any]]) -> None:
    course = recorded(lines)
    end, does = followed(graph, course)
    assert end == course.end
    last = course.ends[-1][0] if course.ends else ""
    shown = {GIVING_UP: STOPS, THREAD_LEFT: IDLE}
    for name, activity in does.items():
        if (
            name != last or not end
        ):  # the engine shows the end of the last one after that of the graph
            state = course.states.get(name, "UNINITIALIZED")
            assert shown.get(activity, activity) == ACTIVITIES.get(state, IDLE), name


def test_many_recorded_courses_are_followed() -> None:
    assert len(courses()) > 150
