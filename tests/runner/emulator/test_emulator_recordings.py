"""An emulated robot sends what a real engine node sent for the same messages.

The recordings (`node/`, see `support/recordings.py`) hold commands, gets and signals with their times;
the same are given to the stand-in in virtual time. Held against each other is what does not depend on
how threads happened to run: every line of the log in order, what each get showed, which snapshots
came, in which order and with what in them, and on what clock. A real node loses snapshots at random,
so the recorded ones have to be a selection of those that the stand-in sends when it loses none.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import (
    EmulatedIndex,
    EngineTraits,
    FeedbackMessage,
    GetResponse,
    LogMessage,
    Message,
    Modify,
    Pause,
    Resume,
    Said,
    Start,
    Stop,
    index_of,
)
from action_assistant.umrf.semantics import Script, script_from
from support.recordings import calls_of, facts, family, lines

FACTS = facts("node")
#: Recordings of one engine whose graphs are stored whole.
NAMES = FACTS.get("replayed", ())
#: The largest difference in time: a machine with two cores was recorded.
SLACK_MS = 120.0
#: Lines closer than this may have come in any order.
RACE_MS = 15.0
#: The stop that wakes this engine came after the next action was loaded in one run, and before in
#: the other, where the action then ran to its end in a graph that was STOPPED.
LOADING_MS = FACTS.get("loading_ms", {})
KINDS: dict[str, type[Stop | Pause | Resume]] = {"stop": Stop, "pause": Pause, "resume": Resume}


@pytest.fixture(scope="module")
def recordings() -> Path:
    return family("node")


@pytest.fixture(scope="module")
def index(recordings: Path) -> EmulatedIndex:
    """Return the index of the recorded engine; only some recordings have the texts."""
    for told in lines(recordings / FACTS["index"]):
        if told["kind"] == "ready":
            texts = [json.dumps(each) for each in told["graph_jsons_indexed"]]
            return index_of([json.dumps(each) for each in told["umrf_jsons"]], texts)
    raise AssertionError(f"{FACTS['index']} has no index")


def behaviours(graph: dict[str, Any]) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Return the behaviours of the recorded actions, which follow from their parameters."""
    for action in graph["actions"]:
        inputs = {
            name: leaf.get("pvf_value") for name, leaf in action.get("input_parameters", {}).items()
        }
        full_name = f"{action['name']}_{action.get('instance_id', 0)}"
        yield f"{graph['graph_name']}/{full_name}", calls_of("node", action["name"], inputs)


class Replay:
    """One recording, and the stand-in that was given the same."""

    def __init__(self, file: Path, index: EmulatedIndex) -> None:
        self.lines = lines(file)
        self.folder, self.name = file.parent, file.name.removesuffix(".jsonl")
        self.index = index
        self.said: list[Said] = []
        self.asked: dict[int, float] = {}
        self.changes: list[tuple[float, tuple[str, ...]]] = []
        graphs = [json.loads(text) for text in self._texts()]
        graphs += [_graph_of(name, index) for name in index.graphs]
        self.script: Script = script_from(
            {"behaviours": {k: v for graph in graphs for k, v in behaviours(graph)}}
        )
        self.robot = self._robot(-720.0)
        self._live()

    def _robot(self, born_ms: float) -> EmulatedEngine:
        shown = (each for each in self.lines if each["kind"] == "feedback")
        # its feedback keeps time from its start on, which shows in the first message after it
        phase = next((each["t_ms"] for each in shown if each["t_ms"] > born_ms), born_ms)
        robot = EmulatedEngine(
            "David",
            index=self.index,
            script=self.script,
            quirks=EngineTraits(loss=0.0, loading_ms=LOADING_MS.get(self.name, 3.0)),
            born_ms=born_ms,
        )
        robot._tick = phase % 500 - 1000
        return robot

    def races(self, at: float) -> bool:
        """Return whether a command or signal came at the same moment, so that their order is not
        known."""
        others = (each for each in self.lines if each["kind"] in {"sent", "engine"})
        return any(abs(each["t_ms"] - at) < RACE_MS for each in others)

    def _texts(self) -> Iterator[str]:
        for line in self.lines:
            for field in ("umrf_graph_json", "modified_graph"):
                told = line.get(field)
                if isinstance(told, dict) and "graph_file" in told:
                    yield (self.folder / told["graph_file"]).read_text()

    def _text(self, told: Any) -> str:
        if not isinstance(told, dict):
            return ""
        return told["text"] if "text" in told else (self.folder / told["graph_file"]).read_text()

    def _live(self) -> None:
        for line in self.lines:
            at = float(line["t_ms"]) if "t_ms" in line else 0.0
            match line["kind"]:
                case "end":
                    break
                case "sent":
                    self._to(at)
                    self.robot.hear(self._message(line), at)
                case "get":
                    self._to(at)
                    self.asked[line["seq"]] = at
                    self.robot.ask(line["seq"], at)
                case "engine":
                    self._to(at)
                    self._signal(line, at)
        self._to(max(line.get("t_ms", 0.0) for line in self.lines))

    def _signal(self, line: dict[str, Any], at: float) -> None:
        match line.get("signal") or line["event"]:
            case "SIGSTOP":
                self.robot.freeze(at)
            case "SIGCONT":
                self.robot.thaw(at)
            case "SIGINT" | "SIGTERM":
                self.robot.quit(at)
            case "SIGKILL":
                self.robot.kill()
            case "spawn" if at > 0:
                self.robot = self._robot(at)

    def _message(self, line: dict[str, Any]) -> Message:
        name, targets = line["umrf_graph_name"], tuple(line["targets"])
        match line["op"]:
            case "start":
                text = self._text(line["umrf_graph_json"])
                return Start(graph_name=name, targets=targets, graph_json=text)
            case "modify":
                text = self._text(line["modified_graph"])
                return Modify(
                    graph_name=name,
                    targets=targets,
                    modified_graph=text,
                    continue_from=line["continue_from"],
                )
            case kind:
                return KINDS[kind](graph_name=name, targets=targets)

    def _to(self, at: float) -> None:
        while (due := self.robot.due) is not None and due <= at:
            self.said += self.robot.advance(due)
            now = self.robot._view.running()
            if not self.changes or self.changes[-1][1] != now:
                self.changes.append((due, now))
        self.said += self.robot.advance(at)


def _graph_of(name: str, index: EmulatedIndex) -> dict[str, Any]:
    graph = index.graphs[name].graph
    return {
        "graph_name": name,
        "actions": [
            {
                "name": each.name,
                "instance_id": each.instance_id,
                "input_parameters": {p.path: json.loads(p.text) for p in each.inputs},
            }
            for each in graph.actions
        ],
    }


def bare(graph: dict[str, Any]) -> str:
    """A printed graph without the times of its messages."""
    for action in graph["actions"]:
        for message in action.get("runtime", {}).get("messages", ()):
            message["timestamp"] = 0
    return json.dumps(graph, sort_keys=True)


def log_lines(lines: Iterator[tuple[float, str]]) -> list[tuple[str, float]]:
    """Return the log lines with their times, from the first command on, sorted by text: two
    threads may write at one moment. The words of the JSON library are left out."""
    return sorted((text.partition("syntax errors: ")[0], at) for at, text in lines if at > -100)


@pytest.fixture(params=[f"{name}{run}" for name in NAMES for run in ("", ".2")])
def replay(request: pytest.FixtureRequest, recordings: Path, index: EmulatedIndex) -> Replay:
    return Replay(recordings / f"{request.param}.jsonl", index)


def test_the_log_says_the_same_lines_at_the_same_times(replay: Replay) -> None:
    recorded = log_lines(
        (line["t_ms"], line["msg"]) for line in replay.lines if line["kind"] == "rosout"
    )
    said = log_lines(
        (each.at_ms, each.text) for each in replay.said if isinstance(each, LogMessage)
    )
    assert [text for text, _ in said] == [text for text, _ in recorded]
    for (text, at), (_, at_there) in zip(said, recorded, strict=True):
        assert abs(at - at_there) < SLACK_MS, text


def test_each_get_shows_what_the_real_one_showed_or_is_not_answered_either(replay: Replay) -> None:
    answers = {each.ticket: each for each in replay.said if isinstance(each, GetResponse)}
    shown: list[str] = []
    for line in replay.lines:
        if line["kind"] not in {"get", "get_extra_reply"}:
            continue
        if "running" in line:
            shown = sorted(bare(each) for each in line["running"])
        if line["kind"] == "get_extra_reply" or replay.races(line["t_ms"]):
            continue
        at, answer = line["t_ms"], answers.get(line["seq"])
        if line.get("timeout"):
            assert answer is None or answer.at_ms > at + 1000 - SLACK_MS, line
            continue
        assert answer is not None, line
        assert abs(answer.at_ms - at - line["latency_ms"]) < 2 * SLACK_MS, line
        possible = [sorted(map(_bare, answer.running))]
        ends = [start for start, _ in replay.changes[1:]] + [1e9]
        possible += [
            sorted(map(_bare, texts))
            for (start, texts), end in zip(replay.changes, ends, strict=True)
            if end > at - SLACK_MS and start < at + line["latency_ms"] + SLACK_MS
        ]
        assert shown in possible, line


def _bare(text: str) -> str:
    return bare(json.loads(text))


def test_the_snapshots_that_came_are_among_those_that_the_stand_in_sends_in_the_same_order(
    replay: Replay,
) -> None:
    recorded, said = (
        [(graph["graph_name"], bare(graph)) for batch in batches for graph in reversed(batch)]
        for batches in (
            [line["history"] for line in replay.lines if line["kind"] == "feedback"],
            [
                [json.loads(text) for text in each.history]
                for each in replay.said
                if isinstance(each, FeedbackMessage)
            ],
        )
    )
    for graph in {name for name, _ in recorded}:
        left = iter([text for name, text in said if name == graph])
        for name, text in recorded:
            if name == graph:
                assert any(text == sent for sent in left), json.loads(text)


def test_feedback_keeps_its_own_time(replay: Replay) -> None:
    recorded = [line["t_ms"] for line in replay.lines if line["kind"] == "feedback"]
    ticks = [each.at_ms for each in replay.said if isinstance(each, FeedbackMessage)]
    for at in recorded:
        assert any(abs((at - tick + 250) % 500 - 250) < 40 for tick in ticks), (at, ticks)
