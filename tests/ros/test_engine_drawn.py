"""A real engine plays the graphs that the page's gestures draw: each ends when every action ends true.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
`TEST_DRAWN` is how many of the graphs are played (default 12), `TEST_DRAWN_DOMAIN` the domain.
"""

import os
import sys
import time
from pathlib import Path

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.runs.events import Override
from action_assistant.umrf.model import Graph
from ros.led_engines import Engines, over, working
from runner.harness import ANN, order
from support.real_engine import needs_engine
from umrf.test_drawn_graphs import DRAWN, graph_of

GRAPHS = int(os.environ.get("TEST_DRAWN", "12"))
DOMAIN = int(os.environ.get("TEST_DRAWN_DOMAIN", "192"))
#: What the check says of some: they may run things side by side, load beside an end, or go back.
ACCEPTED = Override(("H8", "H12", "H14", "H5", "H4"), "Nothing of this moves anything.")

pytestmark = [needs_engine, pytest.mark.timeout(0)]


def at_work(graph: Graph, number: int) -> Graph:
    """Return the graph with `OxWork`, which takes 0.3 s and ends true, as each action."""
    actions = tuple(
        msgspec.structs.replace(working(each, "", 0.3), instance_id=int(each.name[1:]))
        for each in graph.actions
    )
    return msgspec.structs.replace(graph, name=f"drawn{number}", actions=actions)


def test_what_gestures_draw_ends_on_the_engine(tmp_path: Path) -> None:
    engines = Engines(tmp_path, DOMAIN, 1)
    (robot,) = engines.names
    ends: list[str] = []

    async def main() -> None:
        async with engines.led() as (control, _):
            for number, arrows in enumerate(DRAWN[:GRAPHS]):
                graph = at_work(graph_of(arrows), number)
                run = (await control.start(order(graph, engine=robot, override=ACCEPTED), ANN)).run
                state = await over(control, run.id, 60)
                ended = time.time()
                await anyio.sleep(0.5)
                late = [each for each in engines.lines() if each.second > ended]
                ends.append(f"{state}, {len(late)} late")

    anyio.run(main)
    sys.stdout.write(f"\n{len(ends)} graphs: {sorted(set(ends))}\n")
    assert set(ends) == {"finished, 0 late"}
