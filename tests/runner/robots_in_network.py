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
from runner.harness import Harness, order, sequence

PATROL, OTHER = sequence("patrol"), sequence("other")
PATHS = {"David": "/david/umrf_graph_get", "Carol": "/carol/umrf_graph_get"}
#: `other` does not obey for five seconds, and makes the engine deaf for as long.
SCRIPT: dict[str, Any] = {
    "other/Work_0": [{"never": True, "ignores_stop": True}],
    "*": [{"never": True}],
}
#: Nothing ever obeys.
STUBBORN: dict[str, Any] = {"*": [{"never": True, "ignores_stop": True}]}
#: What somebody says who has looked.
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

    def robot(self, name: str) -> Node:
        """An engine comes up."""
        stand_in = EmulatedEngine(
            name,
            script=script_from({"behaviours": self.script}),
            quirks=self.quirks,
            seed=self.chance.getrandbits(32),
            born_ms=now_ms(),
        )
        return self.network.join(stand_in, PATHS[name])

    @asynccontextmanager
    async def played(self) -> AsyncIterator[ExecutionService]:
        """The runner, with everything alive around it."""
        with self.network.hearing(self._hear):
            async with anyio.create_task_group() as wind:
                wind.start_soon(self.network.blow)
                async with self.harness.runner() as control:
                    await anyio.sleep(0.5)
                    yield control
                wind.cancel_scope.cancel()

    def _hear(self, sound: object) -> None:
        text = getattr(sound, "text", "")
        if text:
            self.lines.append((now(), text))

    def starts(self) -> list[Start]:
        """Starts of ours that left."""
        return [each for _, each in self.network.sent if isinstance(each, Start)]


def asked(name: str = "David", **more: Any) -> Any:
    return order(PATROL, engine=name, **more)


def shown(control: ExecutionService, run: str) -> Any:
    """A run as the API and the page show it."""
    return views.shown(control.open[run].run)
