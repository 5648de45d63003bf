"""The log of a robot: commands of others, changes of its engine's state, Stops of foreign graphs,
files written for it, changes of its rights.

One stream per robot, `robot/NAME`. Bodies are msgspec JSON; fields are only ever added, with a
default. Commands of this runner's own runs stand in the streams of the runs. Times are microseconds UTC.
"""

from collections.abc import Iterable, Mapping
from typing import ClassVar, Final, TypeAlias

import anyio
import msgspec

from action_assistant.errors import NotFound, Unavailable
from action_assistant.journal.events import Event
from action_assistant.runner.links.port import Command, EngineState, ForeignCommand
from action_assistant.runner.robots.rights import (
    BatonPassed,
    Drilled,
    Locked,
    RightsEvent,
    RightsSet,
    Unlocked,
)
from action_assistant.runner.runs.events import Author, draft_of
from action_assistant.runner.runs.history import RunnerJournal
from action_assistant.runner.runs.recorder import StreamAppender
from action_assistant.web.auth.caller import BackgroundTasks

_STORE_S: Final = 5.0  # after which waiting for the journal ends


def stream_of_robot(name: str) -> str:
    """Return the name of the stream of a robot."""
    return f"robot/{name}"


class Commanded(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A publisher other than this runner sent a command to this robot, with this graph.

    `run` and `number`: the open run of this runner that it concerns. `sender` tells publishers
    apart.
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
    """The engine has changed its state."""

    kind: ClassVar[str] = "robot.engine_became.v1"

    at: int
    state: EngineState
    why: str = ""
    incarnation: str = ""


class StopAsked(msgspec.Struct, frozen=True, kw_only=True):
    """A person requested a Stop of a graph that others started. `life`: the incarnation of the
    engine that ran it, "" if unknown."""

    kind: ClassVar[str] = "robot.stop_asked.v1"

    at: int
    graph: str
    author: Author
    life: str = ""


class StopWasProven(msgspec.Struct, frozen=True, kw_only=True):
    """An answer to a get that was sent after the Stop showed that no action of the graph moves."""

    kind: ClassVar[str] = "robot.stop_proven.v1"

    at: int
    graph: str
    asked_at: int


class StopUnproven(msgspec.Struct, frozen=True, kw_only=True):
    """The Stop was given up without a proof."""

    kind: ClassVar[str] = "robot.stop_unproven.v1"

    at: int
    graph: str
    why: str


class AskedGraph(msgspec.Struct, frozen=True, omit_defaults=True):
    """A graph to write into a robot's index folder. `replaces`: the path of the file that it
    replaces."""

    name: str
    digest: str
    replaces: str = ""


class IndexWriteAsked(msgspec.Struct, frozen=True, kw_only=True):
    """A person wants graphs written into the folder that the robot's engine indexes. Stored before
    anything is written."""

    kind: ClassVar[str] = "robot.index_write_asked.v1"

    at: int
    author: Author
    folder: str
    graphs: tuple[AskedGraph, ...]


class GraphFile(msgspec.Struct, frozen=True, omit_defaults=True):
    """A file that was written into an index folder. `kept`: the path to which the file that it
    replaced was moved."""

    graph: str
    path: str
    digest: str
    kept: str = ""


class IndexWritten(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """Files were written into an index folder. `why`: why the other files were not, "" if all were."""

    kind: ClassVar[str] = "robot.index_written.v1"

    at: int
    author: Author
    files: tuple[GraphFile, ...]
    why: str = ""


RobotEvent: TypeAlias = (
    Commanded
    | EngineBecame
    | StopAsked
    | StopWasProven
    | StopUnproven
    | IndexWriteAsked
    | IndexWritten
    | RightsEvent
)

_KINDS: Final[Mapping[str, type[RobotEvent]]] = {
    each.kind: each
    for each in (
        Commanded,
        EngineBecame,
        StopAsked,
        StopWasProven,
        StopUnproven,
        IndexWriteAsked,
        IndexWritten,
        RightsSet,
        BatonPassed,
        Locked,
        Unlocked,
        Drilled,
    )
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
    """Return the code and text of the alarm that a command from outside of this program raises for
    a run of `graph` on `robot`: any command to that graph, and the start of another one. None for
    other commands, which do not concern the run."""
    if command.graph == graph:
        text = _ALARMS[command.command].format(graph=graph, robot=robot)
        return f"foreign_{command.command}", text
    if command.command == "start":
        return (
            "foreign_other",
            f"Somebody else started {command.graph} on {robot}, beside this run.",
        )
    return None


def event_of(stored: Event) -> RobotEvent | None:
    """Decode a stored event; None for a kind that this version does not know."""
    known = _KINDS.get(stored.kind)
    return None if known is None else msgspec.json.decode(stored.body, type=known)


def left_unproven(events: Iterable[RobotEvent]) -> list[StopAsked]:
    """Return the Stops that were neither proven nor given up, oldest first. `events` are all of one
    robot."""
    left: dict[str, StopAsked] = {}
    for event in events:
        match event:
            case StopAsked(graph=graph):
                left[graph] = event
            case StopWasProven(graph=graph) | StopUnproven(graph=graph):
                left.pop(graph, None)
            case _:
                pass
    return list(left.values())


class RobotLog:
    """Writes and reads the streams of robots."""

    def __init__(self, journal: RunnerJournal, tasks: BackgroundTasks) -> None:
        self._journal = journal
        self._tasks = tasks
        self._appenders: dict[str, StreamAppender] = {}

    def note(self, robot: str, event: RobotEvent, author: str) -> None:
        """Queue an event for storing. The call never waits."""
        self._appender(robot).add(draft_of(event, author))

    async def flushed(self, robot: str) -> None:
        """Wait until all events of a robot are stored."""
        await self._appender(robot).flushed()

    async def record(self, robot: str, event: RobotEvent, author: str) -> None:
        """Store an event and wait until it is stored. Raise Unavailable if that takes more than
        five seconds; the event may still be stored later."""
        self.note(robot, event, author)
        try:
            with anyio.fail_after(_STORE_S):
                await self._appender(robot).flushed()
        except TimeoutError as late:
            raise Unavailable("The runner's journal does not take anything in now.") from late

    def _appender(self, robot: str) -> StreamAppender:
        appender = self._appenders.get(robot)
        if appender is None:
            appender = self._appenders[robot] = StreamAppender(
                self._journal, stream_of_robot(robot), -1
            )
            self._tasks.start_soon(appender.run)
        return appender

    @property
    def waiting(self) -> int:
        """The number of events that are not stored yet."""
        return sum(each.waiting for each in self._appenders.values())

    async def newest(self, robot: str, most: int) -> list[tuple[int, RobotEvent]]:
        """Return the newest `most` events of a robot with their seqs, oldest first. Raise
        Unavailable if the journal cannot be read."""
        stream = stream_of_robot(robot)
        end = await self._journal.newest(stream)
        stored = await self._journal.read(stream, after=max(0, end - most))
        read = [(each.seq, event_of(each)) for each in stored]
        return [(seq, event) for seq, event in read if event is not None]

    async def graph(self, robot: str, seq: int) -> str:
        """Return the text of the graph in a recorded command. Raise NotFound if the event has no
        graph, Unavailable if the journal cannot be read."""
        stored = await self._journal.read(stream_of_robot(robot), after=seq - 1, limit=1)
        event = event_of(stored[0]) if stored and stored[0].seq == seq else None
        if not isinstance(event, Commanded) or not event.umrf:
            raise NotFound("No graph was recorded with this.")
        return event.umrf
