"""The log of a robot: commands of others, changes of its engine's state, files written for it.

One stream per robot, `robot/NAME`. Bodies are msgspec JSON; fields are only ever added, with a
default. What our own runs sent stands in their streams.
"""

from collections.abc import Iterable, Mapping
from typing import ClassVar, Final, TypeAlias

import anyio
import msgspec

from action_assistant.errors import NotFound, Unavailable
from action_assistant.journal.events import Draft, Event
from action_assistant.runner.links.port import Command, EngineState, ForeignCommand
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.history import RunnerJournal
from action_assistant.runner.runs.recorder import StreamAppender
from action_assistant.web.auth.caller import BackgroundTasks

_PATIENCE_S: Final = 5.0  # until something that has to be stored is given up


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


class StopAsked(msgspec.Struct, frozen=True, kw_only=True):
    """Somebody here wants a graph stopped that was not started from here. `life`: the incarnation of
    the engine that ran it, "" where that was not known."""

    kind: ClassVar[str] = "robot.stop_asked.v1"

    at: int
    graph: str
    author: Author
    life: str = ""


class StopWasProven(msgspec.Struct, frozen=True, kw_only=True):
    """A get asked after that stop showed nothing of the graph moving."""

    kind: ClassVar[str] = "robot.stop_proven.v1"

    at: int
    graph: str
    asked_at: int


class StopUnproven(msgspec.Struct, frozen=True, kw_only=True):
    """That stop was given up without a proof."""

    kind: ClassVar[str] = "robot.stop_unproven.v1"

    at: int
    graph: str
    why: str


class AskedGraph(msgspec.Struct, frozen=True, omit_defaults=True):
    """A graph that shall be in a robot's index. `replaces`: the path of the file that was to go aside."""

    name: str
    digest: str
    replaces: str = ""


class IndexWriteAsked(msgspec.Struct, frozen=True, kw_only=True):
    """Somebody wants graphs written into the folder that the robot's engine indexes. Stored before
    anything is written."""

    kind: ClassVar[str] = "robot.index_write_asked.v1"

    at: int
    author: Author
    folder: str
    graphs: tuple[AskedGraph, ...]


class GraphFile(msgspec.Struct, frozen=True, omit_defaults=True):
    """A file that was written there. `kept`: where the one that it replaced is now."""

    graph: str
    path: str
    digest: str
    kept: str = ""


class IndexWritten(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """These files were written; `why` not all, "" if all were."""

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


def left_unproven(told: Iterable[RobotEvent]) -> list[StopAsked]:
    """The stops of which neither a proof nor that they were given up stands behind them, in events of
    one robot, oldest first."""
    left: dict[str, StopAsked] = {}
    for event in told:
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
        self._pens: dict[str, StreamAppender] = {}

    def note(self, robot: str, event: RobotEvent, author: str) -> None:
        """Record soon. Never waits."""
        self._appender(robot).add(draft_of(event, author))

    async def record(self, robot: str, event: RobotEvent, author: str) -> None:
        """Record, and wait until it is stored. Raises Unavailable; then it may be stored later."""
        self.note(robot, event, author)
        try:
            with anyio.fail_after(_PATIENCE_S):
                await self._appender(robot).flushed()
        except TimeoutError as late:
            raise Unavailable("The runner's journal does not take anything in now.") from late

    def _appender(self, robot: str) -> StreamAppender:
        appender = self._pens.get(robot)
        if appender is None:
            appender = self._pens[robot] = StreamAppender(self._journal, stream_of_robot(robot), -1)
            self._tasks.start_soon(appender.run)
        return appender

    @property
    def waiting(self) -> int:
        """How much is not stored."""
        return sum(each.waiting for each in self._pens.values())

    async def newest(self, robot: str, most: int) -> list[tuple[int, RobotEvent]]:
        """The newest events of a robot, oldest first, with their seqs. Raises Unavailable."""
        stream = stream_of_robot(robot)
        end = await self._journal.newest(stream)
        stored = await self._journal.read(stream, after=max(0, end - most))
        read = [(each.seq, event_of(each)) for each in stored]
        return [(seq, event) for seq, event in read if event is not None]

    async def graph(self, robot: str, seq: int) -> str:
        """The graph of a recorded command. Raises NotFound, Unavailable."""
        stored = await self._journal.read(stream_of_robot(robot), after=seq - 1, limit=1)
        event = event_of(stored[0]) if stored and stored[0].seq == seq else None
        if not isinstance(event, Commanded) or not event.umrf:
            raise NotFound("No graph was recorded with this.")
        return event.umrf
