"""No shape of a graph makes reading, writing, checking or simulating it explode."""

import json
from collections.abc import Callable

import pytest

from action_assistant.umrf.check import check_reading
from action_assistant.umrf.echo import echo
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files.codec import read, write
from action_assistant.umrf.semantics import simulate
from support.growth import grows_with_its_size
from umrf.shapes import SHAPES


@pytest.mark.parametrize("shape", SHAPES)
def test_a_graph_of_any_shape_costs_no_more_than_its_size(shape: str) -> None:
    def work_on(size: int) -> Callable[[], None]:
        text = json.dumps(SHAPES[shape](size))

        def work() -> None:
            reading = read(text)
            write(reading.graph)
            check_reading(reading)
            echo(reading.graph, PINNED)
            sum(1 for _ in simulate(reading.graph, states=reading.states, max_events=10 * size))

        return work

    grows_with_its_size(work_on, 2_000)
