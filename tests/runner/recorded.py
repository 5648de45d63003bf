"""A recording of a real engine node behind the port: it answers and tells what was recorded, when it
was. The history that comes of it can be held against the index of the recordings.

Format: `INDEX.md` of the recordings. The recorded graphs carry no run, so the mark of ours is put in.
"""

import ast
import json
import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Literal, NamedTuple

import anyio

from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.links.engine_text import snapshot
from action_assistant.runner.links.listeners import Listeners
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import (
    Answer,
    EngineLog,
    Feedback,
    Leaves,
    NoAnswer,
    Order,
    Report,
    Standing,
    unwatched,
)
from action_assistant.runner.runs.events import Requested
from action_assistant.runner.runs.fold import begin
from action_assistant.runner.runs.run import Run
from action_assistant.umrf.files import codec
from runner.harness import ANN, BEN, EPOCH, MemoryJournal, at_once, clock_us, run_in_virtual_time

LETTERS = {
    "U": "UNINITIALIZED", "I": "INITIALIZED", "R": "RUNNING", "Q": "PAUSE_REQUESTED", "P": "PAUSED",
    "S": "STOPPING", "F": "FINISHED", "B": "BYPASSED", "E": "ERROR",
}  # fmt: skip


class Told(NamedTuple):
    """The index's line on one graph: letters of states by node. `whole`: all nodes are named."""

    nodes: dict[str, str]
    whole: bool


class Index(NamedTuple):
    """The index of one recording. `last`: the graphs of the last get; None: no answer."""

    feedback: dict[str, Told]
    get: dict[str, Told]
    polled: bool
    last: dict[str, str] | None


def index_of(file: Path) -> Index:
    """The line of a recording in the index beside it."""
    text = (file.parent / "INDEX.md").read_text()
    (line,) = [each for each in text.splitlines() if each.startswith(f"- `{file.name}`:")]
    sections = line.partition(": ")[2].split(" | ")
    feedback, get = (
        _graphs(next(each for each in sections if each.startswith(f"{name}: ")))
        for name in ("feedback", "get")
    )
    last = re.search(r"last get: (\{.*?\}|timeout|none)", line)
    assert last is not None
    graphs = ast.literal_eval(last[1]) if last[1].startswith("{") else None
    return Index(feedback, get, "get: no poll" not in line, graphs)


def _graphs(section: str) -> dict[str, Told]:
    found: dict[str, Told] = {}
    for name, nodes in re.findall(r"`([^`]+)` [A-Z>]+ \{([^}]*)\}", section):
        pairs = re.findall(r"(\S+?_\d+|W\d+):([A-Z>]+)", nodes)
        states = {
            re.sub(r"^W(\d+)$", r"OxWork_\1", node): letters.replace(">", "")
            for node, letters in pairs
        }
        found[name] = Told(states, "more" not in nodes)
    return found


class Recording:
    """One recording as a link to an engine."""

    simulated = False
    pauses = False

    def __init__(self, file: Path) -> None:
        lines = [json.loads(text) for text in file.read_text().splitlines()]
        self.lines = [each for each in lines if "t_ms" in each and _is_first(each)]
        _spell_out(self.lines)
        self.sent = [each for each in self.lines if each["kind"] == "sent"]
        start = next(each for each in self.sent if each["op"] == "start")
        told = start["umrf_graph_json"]
        self.text = told.get("text") or (file.parent / told["graph_file"]).read_text()
        self.graph = codec.read(self.text).graph
        self._again = [
            each["t_ms"] for each in self.sent if each["op"] == "start" and each is not start
        ]
        self._gets = list(self._answers())
        self._subscribers = Listeners[Report]()

    def _answers(self) -> Iterator[tuple[float, float, list[Any] | None]]:
        """Asked and answered at (ms), and the graphs; None for no answer."""
        running: list[Any] = []
        for line in self.lines:
            if line["kind"] == "get":
                running = line.get("running", running)
                known = None if line.get("timeout") else running
                yield line["t_ms"], line["t_ms"] + line.get("latency_ms", 1_000), known

    def _snapshot(self, graph: Any, source: Literal["get", "feedback"]) -> Snapshot:
        full, order, states = graph.get("spelt", (graph.get("actions"), (), ""))
        if order:
            named = dict(zip(order, states, strict=True))
            full = [
                each | {"state": LETTERS[named[f"{each['name']}_{each['instance_id']}"]]}
                for each in full
            ]
        mark = {"action_assistant": {"run": "r1"}} if self._ours() else {}
        actions = [each | {"gui_attributes": mark} for each in full]
        told = {"graph_name": graph["graph_name"], "graph_state": graph["graph_state"]}
        text = json.dumps(told | {"actions": actions})
        return snapshot(text, at=clock_us(), source=source, asked_at=clock_us())

    def _ours(self) -> bool:
        """True while what is shown was started by us: another client may have started it again."""
        return not self._again or self.now_ms() < self._again[0]

    def now_ms(self) -> float:
        """Return the present time of the recording, in ms."""
        return (clock_us() - EPOCH) / 1_000

    @property
    def _incarnation(self) -> str:
        born = [
            each["incarnation"]
            for each in self.lines
            if each["kind"] == "engine" and each["event"] == "spawn"
            if each["t_ms"] <= self.now_ms()
        ]
        return f"life {born[-1] if born else 0}"

    @property
    def standing(self) -> Standing:
        """One engine on its path."""
        return Standing(state="answering", incarnation=self._incarnation, servers=1)

    async def get(self) -> Answer:
        """Return the answer to the next recorded get."""
        for asked, answered, running in self._gets:
            if asked >= self.now_ms() - 0.001:
                await anyio.sleep(max(0.0, answered - self.now_ms()) / 1_000)
                if running is None:
                    break
                at = clock_us()
                graphs = tuple(self._snapshot(each, "get") for each in running)
                return Answer(
                    asked_at=EPOCH + round(asked * 1_000),
                    at=at,
                    incarnation=self._incarnation,
                    graphs=graphs,
                )
        await anyio.sleep(0.2)
        raise NoAnswer("nobody answers in the recording")

    async def run(self) -> None:
        """Tell what came by itself."""
        for line in self.lines:
            if line["t_ms"] < 0 or line["kind"] not in {"feedback", "rosout"}:
                continue
            await anyio.sleep(max(0.0, line["t_ms"] - self.now_ms()) / 1_000)
            if line["kind"] == "rosout":
                self._subscribers.tell(EngineLog(at=clock_us(), text=str(line.get("msg", ""))))
                continue
            shown = tuple(self._snapshot(each, "feedback") for each in reversed(line["history"]))
            self._subscribers.tell(Feedback(actor=line["actor"], snapshots=shown))

    def listen(self, hear: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Call `hear` with every recorded report."""
        return self._subscribers.listening(hear)

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """Do nothing: the start was recorded."""

    async def stop(self, graph_name: str) -> None:
        """Do nothing: the stop was recorded at its time."""

    async def pause(self, graph_name: str) -> None:
        """Do nothing: recordings have no pause."""

    async def resume(
        self, graph_name: str, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Do nothing: recordings have no resume."""

    async def modify(
        self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Do nothing: recordings have no modify."""

    async def aclose(self) -> None:
        """The engine is no more."""


def _is_first(line: dict[str, Any]) -> bool:
    """Return whether a line is of the client without a name: of several clients that heard the
    same, we are that one."""
    return "who" not in line


def _spell_out(lines: list[dict[str, Any]]) -> None:
    """Large graphs are recorded as letters, in the order that was last told for the graph."""
    fulls: dict[str, list[dict[str, Any]]] = {}
    orders: dict[str, list[str]] = {}
    for line in lines:
        for graph in [*line.get("history", ()), *line.get("running", ())]:
            if "actions" in graph:
                continue
            name = graph["graph_name"]
            if "full" in graph:
                fulls[name] = graph["full"]["actions"]
            orders[name] = graph.get("order", orders.get(name, []))
            graph["spelt"] = fulls[name], orders[name], graph["states"]


def history(file: Path) -> Run:
    """The run as the runner tells it that sees what was recorded."""

    async def main() -> Run:
        link = Recording(file)
        graph = link.graph
        asked = Requested(
            at=clock_us(),
            run="r1",
            number=1,
            request_id="q1",
            author=ANN,
            graph=None,
            graph_name=graph.name,
            version="v1",
            digest="",
            engine="David",
            simulated=False,
            actions={each.full_name: each.key for each in graph.actions},
            umrf=link.text,
        )
        opened = OpenRun(
            begin(asked),
            link=link,
            owns_link=False,
            store=MemoryJournal(),
            seq=0,
            clock_us=clock_us,
            run_in_worker=at_once,
            changed=lambda _: None,
        )
        ends = max(each["t_ms"] for each in link.lines) / 1_000
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(link.run)
            for each in link.sent:
                if each["op"] == "stop" and each["umrf_graph_name"] == graph.name:
                    tasks.start_soon(_stop, opened, each["t_ms"] / 1_000)
            with anyio.move_on_after(ends):
                await opened.drive(Order(run="r1", graph=graph, umrf=link.text), "life 0")
            tasks.cancel_scope.cancel()
        return opened.run

    run: Run = run_in_virtual_time(main)
    return run


async def _stop(opened: OpenRun, at: float) -> None:
    await anyio.sleep(at)
    opened.stop(BEN, "")
