"""`check` blocks some real and recorded graphs, and the engine fails at exactly those.

`blocked.json` names every blocked graph with its codes, the engine's behaviour and the evidence.
"""

import json
from pathlib import Path
from typing import Any

import msgspec
import pytest

from action_assistant.umrf.check import blocking, check_reading, refused_by_parser
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files.codec import read
from action_assistant.umrf.model import Signature
from action_assistant.umrf.semantics import GraphStateEvent, HazardEvent, NodeStateEvent, simulate
from support.recordings import CORPUS, NO_CORPUS, engine_runs, lines, runs_of

KNOWN: dict[str, Any] = json.loads((Path(__file__).parent / "blocked.json").read_text())
#: Events of a recording that did not go well.
BAD_ENDS = {"crash", "std::terminate", "timeout", "throw", "final_hang", "final_throw"}
#: An action that begins so often in a FINISHED graph goes on for ever.
_LAPS = 100


def accepted() -> list[str]:
    """Files of current graphs in the corpus that the engine's parser accepts."""
    verdicts = lines(CORPUS / "verdicts.jsonl")
    return [v["file"] for v in verdicts if v["accepted"] and v["file"].startswith("graphs/")]


def blocked(path: Path, facts: Any = PINNED) -> list[str]:
    """Codes that forbid a start."""
    return sorted({p.code for p in blocking(check_reading(read(path.read_bytes()), None, facts))})


def behaviour(path: Path) -> str:
    """Return how the engine treats a graph, by the rules that the recordings confirm."""
    reading = read(path.read_bytes())
    states: list[str] = []
    begun = 0
    for trace in simulate(reading.graph, facts=PINNED, states=reading.states, max_events=3_000):
        match trace:
            case HazardEvent(code="refused"):
                return "refuses"
            case HazardEvent(effect="crash"):
                return "aborts"
            case HazardEvent(effect="hang"):
                return "hangs"
            case NodeStateEvent(state="RUNNING") if "FINISHED" in states:
                begun += 1
            case GraphStateEvent(graph=name, state=state) if name == reading.graph.name:
                states.append(state)
            case _:
                pass
    if begun > _LAPS:
        return "never rests"
    return "runs" if "RUNNING" in states else "never starts"


needs_corpus = pytest.mark.skipif(not accepted(), reason=NO_CORPUS)


@needs_corpus
def test_each_blocked_real_graph_is_known_with_its_reason() -> None:
    found = {file: codes for file in accepted() if (codes := blocked(CORPUS / file))}
    assert found == {file: known["codes"] for file, known in KNOWN["graphs"].items()}


@needs_corpus
@pytest.mark.parametrize("file", KNOWN["graphs"], ids=lambda file: file.rpartition("/")[2])
def test_the_engine_does_not_run_a_real_graph_that_is_blocked(file: str) -> None:
    assert behaviour(CORPUS / file) == KNOWN["graphs"][file]["engine"] != "runs"


@needs_corpus
def test_at_most_one_real_graph_in_twenty_is_blocked_although_the_engine_runs_it() -> None:
    files = accepted()
    wrong = [
        file for file in files if blocked(CORPUS / file) and behaviour(CORPUS / file) == "runs"
    ]
    assert len(wrong) <= 0.05 * len(files), wrong


@needs_corpus
def test_a_real_graph_that_is_not_blocked_runs() -> None:
    for file in accepted():
        if not blocked(CORPUS / file):
            assert behaviour(CORPUS / file) == "runs", file


@needs_corpus
def test_graphs_of_several_actors_are_blocked_only_where_engines_do_not_synchronise() -> None:
    facts = msgspec.structs.replace(PINNED, synchronises=True)
    only_actors = [file for file, known in KNOWN["graphs"].items() if known["codes"] == ["actors"]]
    assert len(only_actors) == 2
    assert [blocked(CORPUS / file, facts) for file in only_actors] == [[], []]


def went_well(folder: Path, name: str) -> bool:
    """Return whether all runs of a recording ended without a crash, a hang or a refusal."""
    return not any(
        line["kind"] in BAD_ENDS or line.get("rc") in (-6, -11)
        for run in runs_of(folder, name)
        for line in run
    )


def test_recorded_graphs_that_went_well_are_not_blocked() -> None:
    found, runs = {}, engine_runs()
    for name, folder in runs.items():
        path = folder / f"{name}.graph.json"
        if not refused_by_parser(read(path.read_bytes())) and went_well(folder, name):
            codes = blocked(path)
            found |= {name: codes} if codes else {}
    # Recordings of the engine's own graphs are not everywhere (UMRF_SHARED).
    known = {name: each["codes"] for name, each in KNOWN["recordings"].items() if name in runs}
    assert found == known


def test_an_optional_input_blocks_nothing_if_the_actions_files_are_known() -> None:
    library = {
        "OxWork": Signature(inputs={"delay": "number", "result": "string"}),
        "OxOptional": Signature(inputs={"text": "string"}, optional=frozenset({"text"})),
    }
    folder = engine_runs()["param_optional"]
    reading = read((folder / "param_optional.graph.json").read_bytes())
    assert blocking(check_reading(reading, library)) == []
