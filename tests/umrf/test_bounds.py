"""That no shape of a graph makes reading, writing, checking or simulating it explode."""

import json
import time

import pytest

from action_assistant.umrf.check import check_reading
from action_assistant.umrf.echo import echo
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files.codec import read, write
from action_assistant.umrf.semantics import simulate
from umrf.shapes import SHAPES


@pytest.mark.parametrize("shape", SHAPES)
def test_a_graph_of_any_shape_takes_seconds_at_most(shape: str) -> None:
    text = json.dumps(SHAPES[shape](2_000))
    started = time.process_time()
    reading = read(text)
    write(reading.graph)
    check_reading(reading)
    echo(reading.graph, PINNED)
    sum(1 for _ in simulate(reading.graph, states=reading.states, max_events=20_000))
    assert time.process_time() - started < 10  # a square would take minutes
