"""The simulated engine against recordings of the real one.

A recording's runs may differ; each sequence that the simulation shows must have been seen in one of
them. `$UMRF_RECORDINGS` names the recordings, see `support/recordings.py`.
"""

import json
from collections import defaultdict
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import pytest

from action_assistant.umrf.check import refused_by_parser
from action_assistant.umrf.facts import facts_for
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph, Signature
from action_assistant.umrf.semantics import Behaviour, Engine, GraphRefused, Script, Trace
from support.recordings import calls_of, engine_runs, facts, runs_of

FACTS = facts("engine")
RECORDED = engine_runs()
#: Actions that the recorded engine had indexed.
INDEXED_ACTIONS = msgspec.convert(FACTS.get("signatures", {}), dict[str, Signature])
LAST = {"final", "final_hang", "final_throw", "destroy"}


class Seen(NamedTuple):
    """The events of one run without times: sequences by the thing to which they belong."""

    sequences: dict[tuple[str, ...], tuple[str, ...]]
    crashed: bool


def seen_in(lines: list[dict[str, Any]]) -> Seen:
    found: dict[tuple[str, ...], list[str]] = defaultdict(list)
    crashed = False
    top = next((line["graph"] for line in lines if line.get("kind") == "graph_state"), "")
    for line in lines:
        graph = line.get("graph", "")
        match line.get("kind"):
            case kind if kind in LAST:
                break
            case "node_state":
                # nodes that a modify brought do not know their graph
                found["node", line["node"], graph or top].append(line["state"])
            case "graph_state":
                found["graph", graph].append(line["state"])
            case "edge":
                found["edge", graph, line["edge"].split(" => ")[0]].append(
                    f"{line['edge']}: {line['eval']}"
                )
            case "dispatch":
                found["dispatch", graph, line["node"]].append(line["response"])
            case "not_ready":
                found["not_ready", graph, line["node"]].append(line["why"])
            case "graph_result":
                found["result", graph].append(line["value"])
            case "crash" | "std::terminate":
                crashed = True
            case "hazard":
                crashed = crashed or line["effect"] == "crash"
            case "exit":
                crashed = crashed or line.get("rc", 0) in (-6, -11)
            case _:
                pass
    return Seen({key: tuple(value) for key, value in found.items()}, crashed)


def script_of(name: str, graphs: list[Graph]) -> Script:
    """Return the behaviours of the recorded actions, by their parameters."""
    behaviours: dict[str, tuple[Behaviour, ...]] = {}
    for graph in graphs:
        for action in graph.actions:
            values = {p.path: msgspec.json.decode(p.text).get("pvf_value") for p in action.inputs}
            key = f"{graph.name}/{action.full_name}"
            calls = calls_of("engine", action.name, values)
            behaviours.setdefault(key, tuple(Behaviour(**call) for call in calls))
    for node, calls in FACTS["behaviours"].get(name, {"actions": {}})["actions"].items():
        behaviours[f"{graphs[0].name}/{node}"] = tuple(Behaviour(**call) for call in calls)
    return Script(behaviours)


def driven(name: str, lines: list[dict[str, Any]], script: Script, until_ms: float) -> list[Trace]:
    """The trace of a simulated engine that gets the calls of a recording."""
    folder = RECORDED[name]
    engine = Engine(
        facts=facts_for(FACTS["engine"]),
        script=script,
        library=library(folder),
        actor=FACTS["actor"],
        signatures=INDEXED_ACTIONS if name in FACTS["resolved"] else None,
        serial=False,
    )
    traces: list[Trace] = []
    for line in lines:
        if line.get("kind") in LAST:
            break
        if line.get("kind") != "call":
            continue
        verb, *names = line["op"].split()
        traces += engine.advance(line["t_ms"])
        with suppress(GraphRefused):
            match verb:
                case "startGraphA" | "startGraph":
                    reading = reading_of(folder, names[0] if ".json" in names[0] else name)
                    if refused_by_parser(reading):
                        continue
                    traces += engine.start(reading.graph, line["t_ms"], reading.states)
                case "stopGraph":
                    traces += engine.stop(names[0], line["t_ms"])
                case "pauseGraph":
                    traces += engine.pause(names[0], line["t_ms"])
                case "resumeGraph":
                    traces += engine.resume(names[0], line["t_ms"])
                case "modifyGraph":
                    continue_from = names[1].removeprefix("continue_from=")
                    graph = reading_of(folder, names[0]).graph
                    traces += engine.modify(graph, line["t_ms"], continue_from)
    return traces + engine.advance(until_ms)


def library(folder: Path) -> dict[str, Graph]:
    """Graphs that the recorded engine had indexed, and that so can be sub-graphs."""
    paths = [*(folder / "subgraphs").glob("*.json")]
    paths += [folder / f"{name}.graph.json" for name in FACTS["sub_graphs"]]
    graphs = [codec.read(path.read_bytes()).graph for path in paths if path.exists()]
    return {graph.name: graph for graph in graphs}


def reading_of(folder: Path, file: str) -> codec.Reading:
    return codec.read((folder / (file if ".json" in file else f"{file}.graph.json")).read_bytes())


def end_of(lines: list[dict[str, Any]]) -> float:
    times = [line["t_ms"] for line in lines if line.get("kind") in LAST]
    return float(min(times)) if times else 20_000.0


@pytest.mark.parametrize("name", sorted({*RECORDED, *FACTS.get("elsewhere", ())}))
def test_a_recorded_graph_runs_as_in_the_real_engine(name: str) -> None:
    if name in FACTS["not_compared"]:
        pytest.skip(FACTS["not_compared"][name])
    if name not in RECORDED:
        pytest.skip("runs of graphs of other repositories are not here (UMRF_SHARED)")
    folder = RECORDED[name]
    runs = runs_of(folder, name)
    used = [word for line in runs[0] for word in str(line.get("op")).split() if ".json" in word]
    files = dict.fromkeys([f"{name}.graph.json", *used])
    graphs = [*(reading_of(folder, file).graph for file in files), *library(folder).values()]
    traces = driven(name, runs[0], script_of(name, graphs), max(map(end_of, runs)))
    shown = seen_in([json.loads(msgspec.json.encode(trace)) for trace in traces])
    recorded = [seen_in(lines) for lines in runs]
    assert shown.crashed in {run.crashed for run in recorded}
    keys = set(shown.sequences).union(*(run.sequences for run in recorded))
    for key in sorted(keys):
        seen = {run.sequences.get(key, ()) for run in recorded}
        assert shown.sequences.get(key, ()) in seen, key
