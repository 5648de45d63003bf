"""The queue as people are shown it: what waits for which robots, why, and in which order."""

from collections.abc import Callable
from datetime import datetime
from typing import Any, Literal, TypeAlias

import msgspec

from action_assistant.runner.links.port import SIMULATOR
from action_assistant.runner.queues.entry import Wait, Waiting, closing_of, named, told
from action_assistant.runner.queues.robot_queue import Entry, Look, RobotQueue
from action_assistant.runner.queues.service import Queues
from action_assistant.runner.runs.doubts import ClosedWhy
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sight import HIDDEN_NAME, Unseen, run_graphs
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.preflight import Preflight
from action_assistant.safe_text import hold_names
from action_assistant.umrf.start_values import StartValues

#: `ready`: a person may start it; `changed`: they may, and something is not as it was looked at when it
#: was put there; `waiting`: for its robots; `closed`: a queue of it is.
EntryState: TypeAlias = Literal["ready", "changed", "waiting", "closed"]


class WaitingShown(msgspec.Struct, frozen=True, kw_only=True):
    """The reason why an entry waits for one robot, in words. `run`: the id of the run that goes on there."""

    robot: str
    why: Wait
    text: str
    run: str | None = None

    def __post_init__(self) -> None:
        hold_names(self, "text")


class EntryShown(msgspec.Struct, frozen=True, kw_only=True):
    """A start that waits. `robots`: those that may move, none in the simulator; `differs`: sentences
    about what is no longer as it was when it was put there; `ready_at`: since when it may be started;
    `hidden`: the reader may not see its graph; `obstacle`: why it can only be removed, "" for all others."""

    id: str
    graph: str | None
    graph_name: str
    version: str
    digest: str
    engine: str
    robots: tuple[str, ...]
    values: StartValues
    author: Author
    entered_at: datetime
    by_itself: bool
    state: EntryState
    waits: list[WaitingShown]
    differs: tuple[str, ...]
    ready_at: datetime | None
    hidden: bool
    obstacle: str

    def __post_init__(self) -> None:
        hold_names(self, "graph_name")
        hold_names(self, "obstacle")


class QueueClosedShown(msgspec.Struct, frozen=True, kw_only=True):
    """The reason why the queue of a robot is closed, in words. `closing`: by which a person says that
    they have seen it; `by`: the person who caused it, `run`: the run that did."""

    closing: str
    why: ClosedWhy
    text: str
    at: datetime
    by: Author | None
    run: str | None

    def __post_init__(self) -> None:
        hold_names(self, "text")


class RobotQueueShown(msgspec.Struct, frozen=True, kw_only=True):
    """The queue of one robot, or of the simulator, by the ids of its entries in their order."""

    robot: str
    entries: list[str]
    closed: QueueClosedShown | None


class QueueShown(msgspec.Struct, frozen=True, kw_only=True):
    """All entries in their order, and the queues of the robots for which something waits."""

    entries: list[EntryShown]
    robots: list[RobotQueueShown]


class LookShown(msgspec.Struct, frozen=True, kw_only=True):
    """The pre-flight of an entry now. `look`: by which its start says what was looked at; `differs`: as
    of the entry; `overridden`: the codes of what it is started in spite of."""

    look: str
    looks: tuple[Preflight, ...]
    differs: tuple[str, ...]
    overridden: tuple[str, ...]


def look_view(look: Look) -> LookShown:
    """Return a look as people see it."""
    return LookShown(
        look=look.digest, looks=look.looks, differs=look.differs, overridden=look.overridden
    )


def queue_view(
    queues: Queues, run_of: Callable[[str], Run | None], unseen: Unseen | None
) -> QueueShown:
    """Return the queue. `run_of`: returns an open run; `unseen`: the graphs that the reader may not
    see."""
    robot_queues = {each.name: each for each in queues.robot_queues}
    entries = [_entry(each, robot_queues, run_of, unseen) for each in queues.entries]
    robots = [
        RobotQueueShown(
            robot=name,
            entries=[each.id for each in queues.entries if name in each.queue_names],
            closed=_closed(queue, unseen),
        )
        for name, queue in robot_queues.items()
    ]
    return QueueShown(entries=entries, robots=robots)


def _entry(
    entry: Entry,
    robot_queues: dict[str, RobotQueue],
    run_of: Callable[[str], Run | None],
    unseen: Unseen | None,
) -> EntryShown:
    entered = entry.entered
    is_hidden = unseen is not None and unseen.hides(entry.graphs)
    shown: dict[str, Any] = {
        "graph": entered.graph,
        "graph_name": entered.graph_name,
        "version": entered.version,
        "digest": entered.digest,
        "values": entered.values,
        "differs": entry.differs if entry.ready_at is not None else (),
        "obstacle": entry.obstacle,
    }
    if is_hidden:
        blank = {"graph": None, "graph_name": HIDDEN_NAME, "version": "", "digest": ""}
        obstacle = "It can only be removed." if entry.obstacle else ""
        shown = blank | {"values": {}, "differs": (), "obstacle": obstacle}
    state: EntryState = "changed" if entry.differs or entry.obstacle else "ready"
    if entry.waits:
        state = "closed" if entry.waits[0].why == "closed" else "waiting"
    return EntryShown(
        **shown,
        id=entry.id,
        engine=entered.engine,
        robots=entered.robots,
        author=entered.author,
        entered_at=time(entered.at),
        by_itself=entered.by_itself,
        state=state,
        waits=[_waiting(each, robot_queues, run_of, unseen) for each in entry.waits],
        ready_at=None if entry.ready_at is None else time(entry.ready_at),
        hidden=is_hidden,
    )


def _waiting(
    wait: Waiting,
    robot_queues: dict[str, RobotQueue],
    run_of: Callable[[str], Run | None],
    unseen: Unseen | None,
) -> WaitingShown:
    robot = wait.robot
    name = named(robot)
    match wait.why:
        case "closed":
            closed = robot_queues[robot].closed
            text = f"The queue of {name} is closed. {'' if closed is None else told(closed, whole=unseen is None)}"
        case "behind":
            others = "1 other" if wait.behind == 1 else f"{wait.behind} others"
            text = f"It is behind {others} for {name}."
        case "stop":
            text = f"Something is being stopped on {name}."
        case "run":
            run = run_of(wait.run)
            text = "A run from here goes on."
            if run is not None and robot == SIMULATOR:
                text = f"Run {run.number} from the queue goes on in the simulator."
            elif run is not None:
                text = _running(robot, run, unseen)
    return WaitingShown(robot=robot, why=wait.why, text=text.strip(), run=wait.run or None)


def _running(robot: str, run: Run, unseen: Unseen | None) -> str:
    graph = run.graph_name
    if unseen is not None and unseen.hides(run_graphs(run)):
        graph = HIDDEN_NAME
    who = run.author.name or "somebody"
    if run.lost:
        return f"Run {run.number} on {robot} was lost: {graph}, by {who}."
    if run.desired == "stopped":
        return f"{robot} is being stopped: {graph}, by {who}."
    return f"{robot} is running {graph}, by {who}."


def _closed(queue: RobotQueue, unseen: Unseen | None) -> QueueClosedShown | None:
    closed = queue.closed
    if closed is None:
        return None
    return QueueClosedShown(
        closing=closing_of(closed),
        why=closed.why,
        text=told(closed, whole=unseen is None),
        at=time(closed.at),
        by=closed.by,
        run=closed.run or None,
    )
