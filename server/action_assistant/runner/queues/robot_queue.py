"""The queue of each robot in memory, and the entries that wait in it."""

import anyio
import msgspec

from action_assistant.kit.lru_cache import LruCache
from action_assistant.runner.execution.doubts import Closable
from action_assistant.runner.links.port import SIMULATOR
from action_assistant.runner.queues.entry import QueueClosed, QueueEntered, Waiting, queue_names_of
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sight import RunGraphs
from action_assistant.runner.start.orders import InQueue
from action_assistant.runner.start.preflight import Preflight
from action_assistant.web.auth.identity import Identity


class RobotQueue(Closable):
    """The queue of one robot, or of the simulator, while something waits in it. `robots_of`: the robots
    of known runs, "simulator" for those that came from its queue; `closed`: why it is closed, None while
    it is open; `entering`: how many starts are being put into it."""

    def __init__(self, name: str, robots_of: LruCache[str, frozenset[str]]) -> None:
        super().__init__(() if name == SIMULATOR else (name,))
        self.name = name
        self.closed: QueueClosed | None = None
        self.entering = 0
        self._robots_of = robots_of

    def owns(self, run: str) -> bool:
        """Return whether a run, or a group, is on the robot."""
        return self.name in (self._robots_of.get(run) or ())


class Entry:
    """A start in the queue. `by`: in whose name it may start by itself; `waits`: why it waits, empty when
    its turn has come; `ready_at`: since when that is so, µs UTC; `differs`: what is no longer as its
    person saw it, by the look of the runner; `turn`: one start, or removal, at a time; `became`: the first
    run of a start on several robots, which leaves the queue when all of them have been tried; `obstacle`:
    why it can only be removed, "" for all others. Such an entry is in no queue, and keeps nobody waiting."""

    def __init__(self, entered: QueueEntered, obstacle: str = "") -> None:
        self.entered = entered
        self.obstacle = obstacle
        self.by: tuple[Author, Identity] | None = None
        self.waits: tuple[Waiting, ...] = ()
        self.ready_at: int | None = None
        self.differs: tuple[str, ...] = ()
        self.turn = anyio.Lock()
        self.became: Run | None = None

    @property
    def id(self) -> str:
        """The id of the entry."""
        return self.entered.entry

    @property
    def queue_names(self) -> tuple[str, ...]:
        """The names of the queues in which it waits."""
        return () if self.obstacle else queue_names_of(self.entered.robots)

    @property
    def often(self) -> InQueue | None:
        """The words of how often for a second person: once at this turn; None before its turn."""
        return None if self.ready_at is None else InQueue(self.id, self.ready_at)

    @property
    def graphs(self) -> RunGraphs:
        """The facts that decide who may see it, as of its run."""
        entered = self.entered
        graphs = dict.fromkeys([entered.graph, *entered.inside])
        return RunGraphs(
            entered.author.id, tuple(each for each in graphs if each), entered.unsighted
        )


class Look(msgspec.Struct, frozen=True):
    """A pre-flight of an entry. `differs`: what is no longer as its person saw it; `digest`: by which a
    person says that they have looked at it; `overridden`: the codes of what it overrides."""

    looks: tuple[Preflight, ...]
    differs: tuple[str, ...]
    digest: str
    overridden: tuple[str, ...] = ()
