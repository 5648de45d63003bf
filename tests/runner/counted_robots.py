"""Robots whose actions count themselves, and whose messages are judged in the moment in which they leave."""

import random
from collections import Counter
from collections.abc import Callable
from typing import Any

import anyio

from action_assistant.runner.links.port import Order, unwatched
from action_assistant.runner.links.simulator import SimulatorLink
from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.semantics import Engine, script_from
from runner.harness import Robot, clock_us


class Begins:
    """The count that actions keep themselves: how often each has begun in each run of any robot, and when."""

    def __init__(self) -> None:
        self.times: dict[tuple[str, str], list[float]] = {}

    @property
    def counts(self) -> Counter[tuple[str, str]]:
        """The number of begins by run and full name of the action."""
        return Counter({key: len(times) for key, times in self.times.items()})

    def note(self, run: str, action: str) -> None:
        """Count a begin that happens now."""
        self.times.setdefault((run, action), []).append(anyio.current_time())


class CountingEngine(Engine):
    """Counts how often each of its actions begins, in each run. `runs`: those of its graphs by name."""

    def __init__(self, begins: Begins, runs: dict[str, str], script: dict[str, Any]) -> None:
        super().__init__(facts=SIMULATED, script=script_from({"behaviours": script}))
        self.begins = begins
        self.runs = runs

    def _begin(self, graph: Any, node: Any) -> None:
        self.begins.note(self.runs[graph.name], node.full_name)
        super()._begin(graph, node)


class CountedRobot(Robot):
    """A robot whose engine counts, and that calls `leaves` with its name and the run of each start message
    as that leaves."""

    def __init__(
        self,
        name: str,
        begins: Begins,
        script: dict[str, Any],
        leaves: Callable[[str, str], None],
    ) -> None:
        self.name, self.begins, self.script, self.leaves = name, begins, script, leaves
        self.runs: dict[str, str] = {}
        super().__init__(self.new_engine(), random.Random(name))

    def new_engine(self) -> SimulatorLink:
        """Return an engine that has nothing, as one has after `kill -9`."""
        counting = CountingEngine(self.begins, self.runs, self.script)
        return SimulatorLink(counting, clock_us=clock_us)

    async def start(self, order: Order, leaves: Any = unwatched) -> None:
        """Send one message, and judge it as it leaves."""

        def leaving() -> None:
            leaves()
            self.runs[order.graph.name] = order.run
            self.leaves(self.name, order.run)

        await super().start(order, leaving)
