"""A runner in virtual time: a loop whose clock jumps, a journal in memory, robots that lose things."""

import asyncio
import functools
import inspect
import itertools
import random
import selectors
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager, suppress
from typing import Any

import anyio
import anyio.lowlevel
import msgspec
from anyio.abc import TaskGroup
from sqlalchemy import Row, Select, StaticPool, create_engine, insert

from action_assistant.errors import Conflict, Unavailable
from action_assistant.journal.events import BareEvent, Draft, Event, StreamSnapshot, bare
from action_assistant.runner import projection
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.execution.start_checks import NO_SOURCES, StartSources
from action_assistant.runner.links.listeners import Listeners
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import (
    Answer,
    EngineRefused,
    Feedback,
    Leaves,
    Link,
    NoAnswer,
    Order,
    Report,
    Standing,
    unwatched,
)
from action_assistant.runner.links.simulator import Simulator, SimulatorLink, in_this_process
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import Author, RunEvent, decode
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.run import Run
from action_assistant.runner.start.admission import StartRequest
from action_assistant.runner.start.rights_registry import IdentityNow, unchanged
from action_assistant.schema.runner_tables import RUNNER, runner_event
from action_assistant.umrf.digest import digest
from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Relation,
)
from action_assistant.umrf.semantics import Engine, Script, script_from
from support.waiting import wait_until

ANN = Author("ann", "Ann")
BEN = Author("ben", "Ben")
EPOCH = 1_800_000_000_000_000
GO_ON = Conditions(on_true="run", on_false="run", on_error="run")


class _Jumping(selectors.SelectSelector):
    """Does not wait: time jumps to when something is due."""

    def __init__(self) -> None:
        super().__init__()
        self.now = 0.0

    def select(self, timeout: float | None = None) -> Any:
        """Return what is ready now; without anything, advance the clock."""
        found = super().select(0)
        if not found:
            if timeout is None:
                raise RuntimeError("nothing will ever happen again")
            self.now += max(timeout, 0)
        return found


class VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop that lives through an hour in no time."""

    def __init__(self) -> None:
        self._jumping = _Jumping()
        super().__init__(self._jumping)

    def time(self) -> float:
        """Return virtual seconds."""
        return self._jumping.now


def stand_still(seconds: float) -> None:
    """Freeze this process for so long, as SIGSTOP does. Messages of others that come meanwhile are read
    only after what has become due."""
    loop = asyncio.get_running_loop()
    assert isinstance(loop, VirtualLoop)
    loop._jumping.now += seconds


async def arrives_after(seconds: float) -> None:
    """Wait for a message that is under way. Where the process stood still meanwhile, whatever was due is
    done before the message is read."""
    began = anyio.current_time()
    await anyio.sleep(seconds)
    if anyio.current_time() > began + seconds + 1:
        await anyio.sleep(0.001)


def run_in_virtual_time(main: Callable[[], Awaitable[Any]]) -> Any:
    """Run a coroutine function in virtual time."""
    return anyio.run(main, backend_options={"loop_factory": VirtualLoop})


def virtual(test: Callable[..., Awaitable[None]]) -> Callable[..., None]:
    """Live through a test in virtual time."""

    def lived(*args: Any, **kwargs: Any) -> None:
        run_in_virtual_time(functools.partial(test, *args, **kwargs))

    lived.__name__, lived.__doc__ = test.__name__, test.__doc__
    vars(lived)["__signature__"] = inspect.signature(test)
    return lived


def clock_us() -> int:
    """Return virtual microseconds UTC."""
    return EPOCH + round(asyncio.get_running_loop().time() * 1e6)


async def at_once(work: Callable[..., Any], *args: Any) -> Any:
    """Threads know nothing of virtual time."""
    return work(*args)


class MemoryJournal:
    """A journal in memory, with the real tables. `down` makes it fail, `slow` makes it late;
    `forgetful` makes it commit and then say that it failed."""

    def __init__(self) -> None:
        self.streams: dict[str, list[Event]] = {}
        self.down = False
        self.forgetful = False
        self.slow = 0.0
        self.position = 0
        self.snapshots: dict[str, StreamSnapshot] = {}
        self._engine = create_engine("sqlite://", poolclass=StaticPool)
        RUNNER.create_all(self._engine)

    async def append(
        self, stream: str, drafts: Sequence[Draft], *, expected: int | None = None
    ) -> int:
        """Append as `Journal.append`, unless it is down."""
        await anyio.sleep(self.slow)
        if self.down:
            raise Unavailable("no space left on device")
        events = self.streams.setdefault(stream, [])
        if expected is not None and expected != len(events):
            raise Conflict(f"{stream} has gone on")
        with self._engine.begin() as connection:
            for draft in drafts:
                self.position += 1
                event = Event(
                    stream,
                    len(events) + 1,
                    draft.kind,
                    draft.author,
                    clock_us(),
                    draft.body,
                    self.position,
                )
                row = {**msgspec.structs.asdict(event), "chain": b""}
                connection.execute(insert(runner_event).prefix_with("OR REPLACE").values(row))
                for statement in projection.fold(event):
                    connection.execute(statement)
                events.append(event)
        if self.forgetful:
            raise Unavailable("the answer got lost")
        return len(events)

    async def read(
        self, stream: str, *, after: int = 0, upto: int | None = None, limit: int | None = None
    ) -> list[Event]:
        """Read as `Journal.read`, unless it is down."""
        events = self.streams.get(stream, [])[after:upto]
        return events if limit is None else events[:limit]

    async def bare(self, stream: str, usual: str, *, after: int, upto: int) -> list[BareEvent]:
        """Read as `Journal.bare`, unless it is down."""
        return bare(self.streams.get(stream, [])[after:upto], usual)

    async def newest(self, stream: str) -> int:
        """Return the last seq as `Journal.newest`, unless it is down."""
        return len(self.streams.get(stream, []))

    async def query(self, statement: Select[Any]) -> list[Row[Any]]:
        """Query the real tables, unless it is down."""
        await anyio.lowlevel.checkpoint()
        with self._engine.connect() as connection:
            return list(connection.execute(statement).all())

    async def snapshot(self, stream: str) -> StreamSnapshot | None:
        """Return the stored snapshot of a stream."""
        return self.snapshots.get(stream)

    async def keep_snapshot(self, stream: str, seq: int, state: bytes) -> None:
        """Store the snapshot of a stream."""
        self.snapshots[stream] = StreamSnapshot(stream, seq, state)

    def told(self, run: str) -> list[RunEvent]:
        """The events of a run."""
        return [decode(each.kind, each.body) for each in self.streams[f"run/{run}"]]

    def history(self, run: str) -> Run:
        """The run as its stored events tell it."""
        found = replay(self.told(run))
        assert found is not None
        return found


class Robot:
    """An engine that outlives the runner, behind a link that loses, delays and drops things.

    As with real ones, a graph is shown RUNNING before its first action is (`blind` seconds), answers
    may be old when they come, and a start may arrive late.
    """

    simulated = False
    pauses = False

    def __init__(self, engine: SimulatorLink, chance: random.Random | None = None) -> None:
        self.engine = engine
        self.chance = chance or random.Random(0)
        self.loss = 0.0
        self.start_loss = 0.0
        self.start_delay = 0.0
        self.blind = 0.0
        self.old = 0.01
        self.silent = False
        self.indexes: bool | None = False
        self.known_graphs: tuple[str, ...] = ()  # that it has indexed, as text
        self.tasks: TaskGroup | None = None  # for messages under way
        self.starts: list[Order] = []
        self.stops: list[tuple[float, str]] = []
        self.delivered = 0
        self._began: dict[str, float] = {}
        self.subscribers = Listeners[Report]()

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """One message, which arrives, unless it gets lost."""
        leaves()
        self.starts.append(order)
        if self.chance.random() < self.start_loss:
            return
        if self.start_delay and self.tasks is not None:
            self.tasks.start_soon(self._late, order, self.engine)
        else:
            await self._begin(order)

    async def _begin(self, order: Order) -> None:
        self._began[order.run] = anyio.current_time()
        await self.engine.start(order)

    async def _late(self, order: Order, engine: SimulatorLink) -> None:
        await anyio.sleep(self.start_delay)
        if engine is self.engine:  # the message dies with the engine it went to
            with suppress(EngineRefused, NoAnswer):
                await self._begin(order)

    async def stop(self, graph_name: str) -> None:
        """One message, which may be lost."""
        self.stops.append((anyio.current_time(), graph_name))
        if self.chance.random() >= self.loss:
            self.delivered += 1
            await self.engine.stop(graph_name)
            await self._feed()

    async def _feed(self) -> None:
        """Send the feedback of a real engine that begins to stop: its actions are STOPPING."""
        answer = await self.engine.get()
        seen = tuple(
            msgspec.structs.replace(each, source="feedback", asked_at=None)
            for each in answer.graphs
            if each.state == "STOPPING"
        )
        if seen:
            self.subscribers.tell(Feedback(actor="", snapshots=seen))

    async def pause(self, graph_name: str) -> None:
        """Let a pause message arrive."""
        await self.engine.pause(graph_name)

    @property
    def standing(self) -> Standing:
        """The standing of the simulated engine."""
        return msgspec.structs.replace(self.engine.standing, indexes=self.indexes)

    async def modify(
        self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Let the engine obey a change."""
        await self.engine.modify(order, continue_from, leaves)

    async def resume(
        self, graph_name: str, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Let a resume message arrive."""
        await self.engine.resume(graph_name, continue_from, leaves)

    async def get(self) -> Answer:
        """May be lost, like any message; may be old when it comes."""
        if self.silent or self.chance.random() < self.loss:
            await anyio.sleep_forever()
        answer = await self.engine.get()
        graphs = self.engine._engine.graphs  # now: another one may have taken its place later
        texts = {each.graph: codec.write(graphs[each.graph].graph) for each in answer.graphs}
        await arrives_after(self.chance.random() * self.old)
        shown = tuple(self._blinded(each, answer) for each in answer.graphs)
        known = self.known_graphs
        return msgspec.structs.replace(answer, graphs=shown, texts=texts, known_graphs=known)

    def _blinded(self, shown: Snapshot, answer: Answer) -> Snapshot:
        began = self._began.get(shown.run or "", -1e9)
        if (answer.at - EPOCH) / 1e6 >= began + self.blind:
            return shown
        nodes = dict.fromkeys(shown.nodes, "UNINITIALIZED")
        return msgspec.structs.replace(shown, nodes=nodes)

    async def run(self) -> None:
        """The engine lives by itself."""
        await anyio.sleep_forever()

    def listen(self, hear: Callable[[Report], None]) -> Any:
        """Little comes by itself: most has to be asked for."""
        return self.subscribers.listening(hear)

    async def aclose(self) -> None:
        """Do nothing: the engine goes on."""

    async def moving(self, graph: str) -> bool:
        """The truth: whether the code of one of its actions goes on, whatever the engine says."""
        answer = await self.engine.get()
        inside = self.engine._engine
        going = any(each.graph == graph for each in inside.executing(inside.now))
        return going or any(each.graph == graph and each.active for each in answer.graphs)


def engine(script: dict[str, Any] | None = None) -> SimulatorLink:
    """Return a simulated engine that follows a script."""
    chosen = script_from({"behaviours": script}) if script else Script()
    return SimulatorLink(Engine(facts=SIMULATED, script=chosen), clock_us=clock_us)


class Harness:
    """One place with a journal and robots, in which runners come and go."""

    def __init__(self, robots: dict[str, Link] | None = None) -> None:
        self.journal = MemoryJournal()
        self.links = robots or {}
        self.simulator: Simulator = in_this_process
        self.sources: StartSources = NO_SOURCES
        self.shown: list[tuple[float, Run]] = []

    @asynccontextmanager
    async def runner(self, now: IdentityNow = unchanged) -> AsyncIterator[ExecutionService]:
        """A runner, up to its end. `now`: who was ended."""
        async with ExecutionService.opened(
            self.journal,
            Robots(self.links),
            clock_us=clock_us,
            run_in_worker=at_once,
            simulator=self.simulator,
            sources=self.sources,
            identity_now=now,
        ) as control:
            control.watch(self._saw)
            yield control

    def _saw(self, opened: OpenRun) -> None:
        self.shown.append((asyncio.get_running_loop().time(), opened.run))


def order(graph: Graph, /, **changes: Any) -> StartRequest:
    """A start of a graph."""
    text = codec.write(graph, codec.Stamp("g1", "v1", None))
    fields: dict[str, Any] = {
        "version": "v1",
        "digest": digest(graph),
        "umrf": msgspec.Raw(text.encode()),
        "engine": "simulator",
        "request_id": f"r{random.getrandbits(60)}",
        "graph": "g1",
    }
    script = changes.pop("script", None)
    if script is not None:
        fields["script"] = msgspec.Raw(msgspec.json.encode({"behaviours": script}))
    return StartRequest(**(fields | changes))


def sequence(name: str = "patrol", actions: int = 3) -> Graph:
    """A, then B, then C …: `Work_0`, `Work_1` …"""
    nodes = tuple(
        Action(key=f"aid{i:09d}", name="Work", instance_id=i, position=(0.0, 80.0 * i))
        for i in range(actions)
    )
    keys = [ENTRY, *(node.key for node in nodes), EXIT]
    relations = tuple(
        Relation(
            parent=parent, child=child, conditions=ENTRY_CONDITIONS if parent == ENTRY else GO_ON
        )
        for parent, child in itertools.pairwise(keys)
    )
    return Graph(name=name, actions=nodes, relations=relations)


def carousel(name: str = "carousel") -> Graph:
    """`Work_0` and `Work_1` take turns, for ever."""
    line = sequence(name, 2)
    first, second = (action.key for action in line.actions)
    back = Relation(parent=second, child=first, conditions=GO_ON, required=False)
    kept = tuple(each for each in line.relations if each.child != EXIT)
    return msgspec.structs.replace(line, relations=(*kept, back))


def two_ends(name: str = "two_ends") -> Graph:
    """`Work_0` ends the graph while `Work_1` may still run (H12)."""
    line = sequence(name, 2)
    first, second = (action.key for action in line.actions)
    entries = tuple(
        Relation(parent=ENTRY, child=child, conditions=ENTRY_CONDITIONS)
        for child in (first, second)
    )
    bypass = Conditions(on_true="bypass", on_false="bypass", on_error="bypass")
    exits = tuple(
        Relation(parent=parent, child=EXIT, conditions=bypass) for parent in (first, second)
    )
    return msgspec.structs.replace(line, relations=(*entries, *exits))


def two_lines(name: str = "two_lines") -> Graph:
    """Two actions side by side, `Work_0` and `Work_1`, each with one after it, `Work_2` and `Work_3`."""
    line = sequence(name, 4)
    keys = [each.key for each in line.actions]
    relations = tuple(
        Relation(
            parent=parent, child=child, conditions=ENTRY_CONDITIONS if parent == ENTRY else GO_ON
        )
        for number in (0, 1)
        for parent, child in itertools.pairwise((ENTRY, keys[number], keys[number + 2], EXIT))
    )
    return msgspec.structs.replace(line, relations=relations)


async def until(true: Callable[[], bool], patience: float = 60.0) -> None:
    """Wait for something that must happen, for `patience` seconds, most often virtual ones."""
    await wait_until(true, patience)


async def ended(control: ExecutionService, run: str) -> str:
    """Wait for the end of a run and return its state. Times are virtual."""
    await until(lambda: run not in control.open, 3600)
    return (await control.find(run)).state
