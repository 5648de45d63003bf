"""Hostile and odd UMRF files: kept failures, hypothesis, and extremes of size and nesting."""

import json
import os
import random
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.umrf.files.codec import read, write
from action_assistant.umrf.model import Graph
from fuzz.umrf_mutations import VALUES, WORDS, mutated
from fuzz.umrf_target import examine
from strategies import graphs, normal

FOLDER = Path(__file__).parent
ROOT = FOLDER.parents[1]
SEEDS = [
    *sorted((ROOT / "server" / "action_assistant" / "examples").glob("*.json")),
    *sorted((ROOT / "tests" / "umrf" / "examples").glob("*.json")),
]
#: `FUZZ_EXAMPLES=20000 pytest tests/fuzz` looks longer.
EXAMPLES = int(os.environ.get("FUZZ_EXAMPLES", "40"))
THOROUGH = settings(max_examples=EXAMPLES, suppress_health_check=list(HealthCheck))

scalars = st.sampled_from(VALUES) | st.integers() | st.floats() | st.text(max_size=8)
values = st.recursive(
    scalars,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(WORDS) | st.text(max_size=4), inner, max_size=6)
    ),
    max_leaves=40,
)


@pytest.mark.parametrize(
    "path", sorted((FOLDER / "kept").glob("*.json")), ids=lambda path: path.name
)
def test_an_input_that_failed_once_does_not_fail_again(path: Path) -> None:
    examine(path.read_bytes())


@given(st.binary(max_size=200))
@THOROUGH
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    examine(data)


@given(values)
@THOROUGH
def test_any_json_is_read_or_refused(value: Any) -> None:
    examine(json.dumps(value).encode(errors="surrogatepass"))


@given(st.sampled_from(SEEDS), st.integers(0, 2**32), st.integers(1, 6))
@THOROUGH
def test_any_change_of_a_real_file_is_read_or_refused(path: Path, seed: int, rounds: int) -> None:
    value = json.loads(path.read_text())
    chance = random.Random(seed)
    for _ in range(rounds):
        value = mutated(value, chance)
    examine(json.dumps(value).encode(errors="surrogatepass"))


@given(graphs())
@THOROUGH
def test_any_graph_survives_writing(graph: Graph) -> None:
    text = write(graph)
    reading = read(text)
    assert normal(reading.graph) == normal(graph)
    assert (reading.dialect, reading.notes, reading.problems) == ("D3", (), ())
    examine(text.encode())


@pytest.mark.turns
@pytest.mark.parametrize(
    "data",
    [
        b"[" * 5_000_000,
        b'{"a":' * 1_000_000,
        b'{"graph_name": "g", "actions": ' + b"[" * 100_000 + b"]" * 100_000 + b"}",
        b'"' + b"\\" * 9_000_000,
        b"[" + b"1," * 2_000_000 + b"1]",
        b'{"graph_name": "g", "actions": [], "x": 1' + b"0" * 5_000_000 + b"}",
        b'{"graph_name": "g", "actions": [], "x": 1e' + b"9" * 50 + b"}",
        b'{"graph_name": "' + b"\xc3\xa4" * 4_000_000 + b'", "actions": []}',
        pytest.param(
            b'{"graph_name": "g", "actions": [' + b"{}," * 40_000 + b"{}]}", marks=pytest.mark.long
        ),
        b'{"graph_name": "g", "actions": [' + b"{}," * 2_000 + b"{}]}",  # each as a sub-graph too
        b'{"graph_name": "g", "actions": [' + b"0," * 400_000 + b"0]}",
        b" " * 10_000_000,
        b"\xff\xfe",
        b"\xef\xbb\xbf{}",
    ],
    ids=range(14),
)
def test_extremes_cost_no_more_than_their_size(data: bytes) -> None:
    examine(data)
