"""Emulated robots in the fake network of virtual time, each on a path of its own, and the real runner."""

import random
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import anyio

from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import EngineTraits, Start
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs import views
from action_assistant.umrf.semantics import script_from
from runner.fake_link import FakeLink
from runner.fake_network import FakeNetwork, Node, now, now_ms
from runner.harness import BEN, Harness, order, sequence

PATROL, OTHER = sequence("patrol"), sequence("other")
PATHS = {"David": "/david/umrf_graph_get", "Carol": "/carol/umrf_graph_get"}
#: `other` does not obey for five seconds, and makes the engine deaf for as long.
SCRIPT: dict[str, Any] = {
    "other/Work_0": [{"never": True, "ignores_stop": True}],
    "*": [{"never": True}],
}
#: A script in which no action obeys.
STUBBORN: dict[str, Any] = {"*": [{"never": True, "ignores_stop": True}]}
#: The words of a person who has looked.
LOOKED = RestRequest("I stand beside it; nothing moves.")


class RobotsInNetwork:
    """Robots in the fake network, each on a path of its own, and the runner."""

    def __init__(
        self,
        seed: int,
        *names: str,
        quirks: EngineTraits = EngineTraits(),  # noqa: B008 - frozen
        script: dict[str, Any] = SCRIPT,
    ) -> None:
        self.chance = random.Random(seed)
        self.network = FakeNetwork(self.chance)
        self.lines: list[tuple[float, str]] = []
        self.quirks = quirks
        self.script = script
        self.names = names or ("David",)
        links = {name: FakeLink(self.network, name, PATHS[name]) for name in self.names}
        self.harness = Harness(dict(links))
        self.nodes = {name: self.robot(name) for name in self.names}

    def robot(self, name: str, gap_s: float = 0.0) -> Node:
        """An engine comes up, and serves its get `gap_s` after it has begun to hear."""
        stand_in = EmulatedEngine(
            name,
            script=script_from({"behaviours": self.script}),
            quirks=self.quirks,
            seed=self.chance.getrandbits(32),
            born_ms=now_ms(),
        )
        return self.network.join(stand_in, PATHS[name], gap_s=gap_s)

    @asynccontextmanager
    async def played(self) -> AsyncIterator[ExecutionService]:
        """The runner, with everything alive around it."""
        with self.network.hearing(self._hear):
            async with self.network.running(), self.harness.runner() as control:
                await anyio.sleep(0.5)
                yield control

    def _hear(self, value: object) -> None:
        text = getattr(value, "text", "")
        if text:
            self.lines.append((now(), text))

    def starts(self) -> list[Start]:
        """Starts of ours that left."""
        return [each for _, each in self.network.sent if isinstance(each, Start)]


def asked(name: str = "David", **more: Any) -> Any:
    return order(PATROL, engine=name, **more)


def shown(control: ExecutionService, run: str) -> Any:
    """A run as the API and the page show it."""
    return views.run_view(control.open[run].run)


async def confirm_lost(control: ExecutionService) -> None:
    """Wait until a run is lost, or may still begin something; then somebody goes there and sees that
    nothing moves."""
    with anyio.fail_after(600):
        while not any(each.run.lost or each.run.loading for each in control.open.values()):  # noqa: ASYNC110 - by many ways
            await anyio.sleep(0.1)
    for run in tuple(control.open):
        await control.confirm_rest(run, LOOKED, BEN)


async def all_over(control: ExecutionService) -> None:
    """Wait for the end of every run."""
    with anyio.fail_after(600):
        while control.open:  # noqa: ASYNC110 - it ends by many ways
            await anyio.sleep(0.1)
