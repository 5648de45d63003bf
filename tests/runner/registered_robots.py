"""Robots in virtual time that also tell what they hear and know, for tests of the registry."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import msgspec

from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.hardware_stop import StopSignal
from action_assistant.runner.links.health import HealthSignal
from action_assistant.runner.links.port import (
    Answer,
    Candidate,
    Command,
    EngineChanged,
    EngineLog,
    EngineState,
    ForeignCommand,
    Link,
    Registration,
    Report,
    Sighting,
    Standing,
)
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.start.admission import GroupRequest
from action_assistant.runner.start.preflight import Preflight
from action_assistant.runner.start.rights_registry import IdentityNow, unchanged
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Action, Graph, Parameter
from runner.harness import ANN, Harness, Robot, at_once, clock_us, engine, order, until

WORK = codec.write_action(Action(key="work", name="Work"))
NEVER = {"*": [{"never": True}]}


class Open(Robot):
    """A robot that says more: its index, its texts, who else is there."""

    def __init__(self, script: dict[str, Any] | None = None) -> None:
        super().__init__(engine(script))
        self.others = 0
        self.servers = 1
        self.known_actions: tuple[str, ...] = (WORK,)
        self.known_graphs: tuple[str, ...] = ()
        self.texts: dict[str, str] = {}

    @property
    def standing(self) -> Standing:
        """The standing of the engine, with the others that are there."""
        return msgspec.structs.replace(
            self.engine.standing, others=self.others, servers=self.servers
        )

    async def get(self) -> Answer:
        """Return an answer with the index and the texts."""
        answer = await super().get()
        return msgspec.structs.replace(
            answer,
            texts=answer.texts | self.texts,
            known_actions=self.known_actions,
            known_graphs=self.known_graphs,
        )

    def tell(self, report: Report) -> None:
        """Report a value to all listeners."""
        self.subscribers.tell(report)

    def command(self, command: Command, graph: str, umrf: str = "") -> None:
        """Report a command that somebody else published."""
        self.tell(
            ForeignCommand(at=clock_us(), command=command, graph=graph, umrf=umrf, sender="them")
        )

    def become(self, state: EngineState, why: str) -> None:
        """Discovery says that the engine is otherwise."""
        self.tell(EngineChanged(at=clock_us(), state=state, why=why))

    def log(self, text: str, graph: str | None = None) -> None:
        """The engine logs a line."""
        self.tell(EngineLog(at=clock_us(), text=text, graph=graph))


class RegisteredRobots:
    """A reach whose robots are there already, by name."""

    rmw = "rmw_test"

    def __init__(self, **robots: Link) -> None:
        self.robots = robots
        self.facts: dict[str, EngineFacts] = {}
        self.sight: tuple[Candidate, ...] = ()
        self.left_s = 0.0

    def link(self, registration: Registration, facts: EngineFacts) -> Link:
        """The robot of that name."""
        self.facts[registration.name] = facts
        return self.robots[registration.name]

    async def stop_signal(self, *_: object) -> StopSignal:
        """Return a signal that nobody writes."""
        return StopSignal()

    async def health_signal(self, *_: object) -> HealthSignal:
        """Return a signal that nobody writes."""
        return HealthSignal()

    async def sighting(self) -> Sighting:
        """Return the engines in sight."""
        return Sighting(self.sight, self.left_s)

    async def candidates(self) -> tuple[Candidate, ...]:
        """Return the engines in sight."""
        return self.sight

    async def aclose(self) -> None:
        """Do nothing: robots share no resources."""


def given(graph: Graph, name: str) -> Graph:
    """The graph, each action with a required input that nobody has described."""
    extra = Parameter(path=name, text='{"pvf_type":"string","pvf_value":"x"}')
    actions = tuple(
        msgspec.structs.replace(action, inputs=(*action.inputs, extra)) for action in graph.actions
    )
    return msgspec.structs.replace(graph, actions=actions)


@asynccontextmanager
async def fleet(
    harness: Harness, now: IdentityNow = unchanged, **robots: Open
) -> AsyncIterator[ExecutionService]:
    """A runner that knows these robots, after they have answered for the first time. `now`: who was
    ended."""
    reach = Robots(reach=RegisteredRobots(**robots))
    async with ExecutionService.opened(
        harness.journal, reach, clock_us=clock_us, run_in_worker=at_once, identity_now=now
    ) as control:
        for name in robots:
            await control.register(Registration(name=name), ANN)
        await until(lambda: all(control.robots.robot(name).heard_at for name in robots))
        yield control


def group(graph: Graph, *engines: str, **fields: object) -> GroupRequest:
    asked = order(graph)
    request = GroupRequest(
        version="v1", digest=asked.digest, umrf=asked.umrf, engines=engines, request_id="g"
    )
    return msgspec.structs.replace(request, **fields)


def verdicts(look: Preflight) -> dict[str, str]:
    return {item.code: item.verdict for item in look.items}


def change(graph: Graph) -> bytes:
    asked = order(graph)
    return msgspec.json.encode({"version": "v2", "digest": asked.digest, "umrf": asked.umrf})
