"""The flight recorder: what others told a robot, and when its engine came, went or was another one.

One stream per robot, `robot/NAME`. Bodies are msgspec JSON; fields are only ever added, with a
default. What our own runs sent stands in their streams.
"""

from collections.abc import Mapping
from typing import ClassVar, Final, TypeAlias

import msgspec

from action_assistant.journal.events import Draft, Event
from action_assistant.runner.links.port import Command, EngineState, ForeignCommand


def stream_of_robot(name: str) -> str:
    """The stream of a robot."""
    return f"robot/{name}"


class Commanded(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """Somebody else published a command to this robot, with this graph.

    `run` and `number`: the open run of ours that it concerns. `sender` tells publishers apart.
    """

    kind: ClassVar[str] = "robot.commanded.v1"

    at: int
    command: Command
    graph: str
    umrf: str = ""
    targets: tuple[str, ...] = ()
    sender: str = ""
    run: str | None = None
    number: int | None = None


class EngineBecame(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The engine is in another state than before."""

    kind: ClassVar[str] = "robot.engine_became.v1"

    at: int
    state: EngineState
    why: str = ""
    incarnation: str = ""


RobotEvent: TypeAlias = Commanded | EngineBecame

_KINDS: Final[Mapping[str, type[RobotEvent]]] = {
    each.kind: each for each in (Commanded, EngineBecame)
}


_ALARMS: Final[Mapping[Command, str]] = {
    "start": "Somebody else started a graph called {graph} on {robot}, too: the engine refuses that "
    "one and stops this run.",
    "stop": "Somebody else told {robot} to stop this run.",
    "pause": "Somebody else told {robot} to pause this run.",
    "resume": "Somebody else told {robot} to go on with this run.",
    "modify": "Somebody else changed the graph on {robot}: what runs is not what was started.",
}


def alarm_of(command: ForeignCommand, robot: str, graph: str) -> tuple[str, str] | None:
    """What a command of somebody else means for a run of `graph` there: a code and a sentence."""
    if command.graph == graph:
        text = _ALARMS[command.command].format(graph=graph, robot=robot)
        return f"foreign_{command.command}", text
    if command.command == "start":
        return (
            "foreign_other",
            f"Somebody else started {command.graph} on {robot}, beside this run.",
        )
    return None


def draft_of(event: RobotEvent, author: str) -> Draft:
    """An event as it is stored."""
    return Draft(event.kind, author, msgspec.json.encode(event))


def event_of(stored: Event) -> RobotEvent | None:
    """What a stored event says; None for kinds that this version does not know."""
    known = _KINDS.get(stored.kind)
    return None if known is None else msgspec.json.decode(stored.body, type=known)
