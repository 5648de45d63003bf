"""The simulated engine against recordings of the real one.

`$UMRF_TRACES` is a folder of recordings (default: `$UMRF_SHARED/umrf/traces`). A recording's runs may
differ; each sequence that the simulation shows must have been seen in one of them.
"""

import json
import os
from collections import defaultdict
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import pytest

from action_assistant.umrf.check import refused_by_parser
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph, Signature
from action_assistant.umrf.semantics import Behaviour, Engine, GraphRefused, Script, Trace

ROOT = Path(__file__).parents[2]
SHARED = Path(os.environ.get("UMRF_SHARED", ROOT.parent / "shared"))
TRACES = Path(os.environ.get("UMRF_TRACES", SHARED / "umrf" / "traces"))

#: Recordings that are not compared, and why.
EXPLAINED = {
    "cycle_fast": "a race: the number of laps until the engine blocks itself differs from run to run",
}
#: Actions that the recorded engine had, where that decides something.
INDEXED_ACTIONS = {
    "OxWork": Signature(inputs={"delay": "number", "result": "string"}),
    "OxOptional": Signature(inputs={"text": "string"}, optional=frozenset({"text"})),
}
UNRESOLVED = ("param_optional", "unknown_action", "extra_param", "fewer_params", "format_test")
#: Recorded graphs that were indexed, and so can be sub-graphs.
INDEXED = ("ta_generate_string", "semantics_test_9_infinite_loop")
LAST = {"final", "final_hang", "final_throw", "destroy"}

#: What the recorded actions did, where their parameters do not say it.
TOLD: dict[str, dict[str, list[dict[str, Any]]]] = {
    "spont_slow_child": {
        # after one stop an instance of OxWork returns at once
        "OxWork_0": [{"after_s": 1.0}, {"after_s": 0.0}],
        "TaTriggerResultMulti_0": [
            {"after_s": 0.4},
            {"after_s": 0.4, "result": "on_false"},
            {"after_s": 0.4},
            {"never": True},
        ],
    },
    "semantics_test_7": {
        "TaIngestResult_0": [{"never": True}, {"never": True}, {"after_s": 0.0}],
        "TaTriggerResultMulti_0": [{"after_s": 1.0}] * 3 + [{"never": True}],
    },
    "external_changes_test_3_a": {
        "TaTriggerResult_0": [{"after_s": 0.001, "result": "on_error"}, {"after_s": 0.001}]
    },
    # these wait in wall-clock time, also while they are paused
    "external_changes_test_1": {"TaTimer_0": [{"after_s": 0.6}]},
    # the new graph gives the paused action another result
    "ext_modify_param": {
        "OxWork_0": [{"after_s": 0.8}],
        "OxWork_1": [{"after_s": 0.1, "result": "on_false"}],
    },
    # two equal durations; in all runs the branch that ignores ended last
    "stuck_join": {"OxWork_3": [{"after_s": 0.21, "result": "on_false"}]},
    "lib_missing": {"OxWork_0": [{"no_library": True}]},
    "semantics_test_5": {"TaTimer_1": [{"never": True}]},
    "param_wrong_type_static": {"OxWork_0": [{"after_s": 0.001, "result": "on_error"}]},
}


class Seen(NamedTuple):
    """What one run shows, without times: sequences by what they belong to."""

    sequences: dict[tuple[str, ...], tuple[str, ...]]
    crashed: bool


def recordings() -> list[str]:
    if not TRACES.is_dir():
        return []
    return sorted(
        name
        for path in TRACES.glob("*.graph.json")
        if (TRACES / f"{(name := path.name.removesuffix('.graph.json'))}.trace.jsonl").exists()
    )


def lines_of(name: str) -> Iterator[list[dict[str, Any]]]:
    """The runs of a recording; of an engine with the bypass repaired where there are such."""
    fixed = sorted((TRACES / "bypass_fixed").glob(f"{name}.trace*.jsonl"))
    for path in fixed or sorted(TRACES.glob(f"{name}.trace*.jsonl")):
        yield [json.loads(line) for line in path.read_text().splitlines() if line]


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
    """What the recorded actions do, by their parameters."""
    behaviours: dict[str, tuple[Behaviour, ...]] = {}
    for graph in graphs:
        for action in graph.actions:
            values = {p.path: msgspec.json.decode(p.text).get("pvf_value") for p in action.inputs}
            key = f"{graph.name}/{action.full_name}"
            behaviours.setdefault(key, tuple(behaviours_of(action.name, values)))
    told = TOLD.get(name, {})
    for node, calls in told.items():
        behaviours[f"{graphs[0].name}/{node}"] = tuple(Behaviour(**call) for call in calls)
    return Script(behaviours)


def behaviours_of(name: str, values: dict[str, Any]) -> Iterator[Behaviour]:
    delay = values.get("delay")
    delay = float(delay) if isinstance(delay, int | float) else 0.1
    match name:
        case "OxWork":
            yield Behaviour(after_s=delay, result=values.get("result") or "on_true", stop_s=0.01)
        case "OxStubborn":
            yield Behaviour(after_s=delay, ignores_stop=True)
        case "OxNoPause":
            yield Behaviour(after_s=delay, pauses=False)
        case "OxCountdown":
            for _ in range(int(values["times"]) - 1):
                yield Behaviour(after_s=delay)
            yield Behaviour(after_s=delay, result="on_false")
        case "OxInitError":
            yield Behaviour(init_error=True)
        case "OxEcho":
            text = values.get("text")
            yield Behaviour(after_s=0.1, outputs={"text": text} if text else None)
        case "TaTimer":
            yield Behaviour(after_s=float(values["count_until"]) + 0.003, stop_s=0.02)
        case "TaTriggerResult":
            yield Behaviour(after_s=0.001, result=values.get("result") or "on_true")
        case "TaTriggerResultMulti":
            for result in values["results"]:
                yield Behaviour(after_s=delay, result=result)
        case _:
            yield Behaviour(after_s=0.01)


def driven(name: str, lines: list[dict[str, Any]], script: Script, until_ms: float) -> list[Trace]:
    """The trace of a simulated engine that gets the calls of a recording."""
    engine = Engine(
        facts=PINNED,
        script=script,
        library=library(),
        actor="ae_oracle",
        signatures=INDEXED_ACTIONS if name in UNRESOLVED else None,
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
                    reading = reading_of(names[0] if ".json" in names[0] else name)
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
                    traces += engine.modify(reading_of(names[0]).graph, line["t_ms"], continue_from)
    return traces + engine.advance(until_ms)


def library() -> dict[str, Graph]:
    paths = [*(TRACES / "subgraphs").glob("*.json")]
    paths += [TRACES / f"{name}.graph.json" for name in INDEXED]
    graphs = [codec.read(path.read_bytes()).graph for path in paths]
    return {graph.name: graph for graph in graphs}


def reading_of(file: str) -> codec.Reading:
    return codec.read((TRACES / (file if ".json" in file else f"{file}.graph.json")).read_bytes())


def end_of(lines: list[dict[str, Any]]) -> float:
    times = [line["t_ms"] for line in lines if line.get("kind") in LAST]
    return float(min(times)) if times else 20_000.0


@pytest.mark.skipif(not TRACES.is_dir(), reason=f"there are no recordings in {TRACES}")
@pytest.mark.parametrize("name", recordings())
def test_a_recorded_graph_runs_as_in_the_real_engine(name: str) -> None:
    if name in EXPLAINED:
        pytest.skip(EXPLAINED[name])
    runs = list(lines_of(name))
    used = [word for line in runs[0] for word in str(line.get("op")).split() if ".json" in word]
    files = dict.fromkeys([f"{name}.graph.json", *used])
    graphs = [*(reading_of(file).graph for file in files), *library().values()]
    traces = driven(name, runs[0], script_of(name, graphs), max(map(end_of, runs)))
    shown = seen_in([json.loads(msgspec.json.encode(trace)) for trace in traces])
    recorded = [seen_in(lines) for lines in runs]
    assert shown.crashed in {run.crashed for run in recorded}
    keys = set(shown.sequences).union(*(run.sequences for run in recorded))
    for key in sorted(keys):
        seen = {run.sequences.get(key, ()) for run in recorded}
        assert shown.sequences.get(key, ()) in seen, key
