"""A domain of ROS 2 in virtual time: stand-in robots, messages that take time and get lost, and a
discovery that lags behind, as the links over rclpy see one."""

import asyncio
import random
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AbstractContextManager, asynccontextmanager
from contextvars import Context
from typing import Any

import anyio
from anyio.abc import TaskGroup

from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import (
    NODE,
    FeedbackMessage,
    GetResponse,
    Gone,
    LogMessage,
    Message,
    Modify,
    Pause,
    Resume,
    Start,
    Stop,
)
from action_assistant.runner.links.engine_text import name_of, snapshot
from action_assistant.runner.links.listeners import Listeners
from action_assistant.runner.links.port import Command
from action_assistant.runner.links.port import Feedback as Shown
from action_assistant.runner.links.ros2.ros_values import (
    Endpoint,
    GetResult,
    LogLine,
    OverheardCommand,
    RosValue,
)
from runner.harness import clock_us

LEASE_S = 10.0  # until discovery knows of a death that nobody announced
GRAIN_MS = 0.01  # clocks are not finer: what is due so soon is due now
GAP_S = 0.05  # between two messages on one topic
OURS = "ours"
HASH = "RIHS01_current"


def now_ms() -> float:
    """Virtual milliseconds, as robots count them."""
    return now() * 1000


def now() -> float:
    """Virtual seconds, also where no task runs: messages come in by callbacks of the loop."""
    return asyncio.get_running_loop().time()


def run_of(robot: EmulatedEngine, graph: str) -> str:
    """The run that the graph of this running name is marked with now; "" for none of ours."""
    plan = robot._view.plans.get(graph.partition("__")[0])
    marks = list(plan.attributes.values()) if plan is not None else []
    return str(marks[0].get("action_assistant", {}).get("run") or "") if marks else ""


class Node:
    """An engine node in the fake network: an emulator and what discovery knows of it."""

    def __init__(
        self,
        network: "FakeNetwork",
        robot: EmulatedEngine,
        path: str,
        lag_s: float,
        gap_s: float,
    ) -> None:
        network.born += 1
        self.network = network
        self.robot = robot
        self.path = path
        self.process = f"process{network.born}"
        self.type_hash = HASH
        self.matched_at = now() + 0.02  # hears from then on
        self.seen_at = self.matched_at + lag_s  # and is known to be there a little later
        self.serves_at = self.matched_at + gap_s  # and answers gets from then on
        self.unseen_at = float("inf")
        self.call: asyncio.TimerHandle | None = None  # when it has something to say again

    @property
    def hears(self) -> bool:
        """True when messages reach it."""
        return not self.robot.gone and now() >= self.matched_at

    @property
    def seen(self) -> bool:
        """True when discovery shows it, rightly or not."""
        return self.seen_at <= now() < self.unseen_at

    @property
    def serves(self) -> bool:
        """True when it answers gets, as far as discovery knows."""
        return self.seen and now() >= self.serves_at

    def end(self, of: str) -> Endpoint:
        """Return the endpoint of this node that is called so."""
        return Endpoint(
            gid=f"{self.process}/{of}",
            process=self.process,
            logger=NODE,
            type_hash=self.type_hash,
        )


class Outlet:
    """One command topic of ours: messages leave one by one, `GAP_S` apart."""

    def __init__(self, network: "FakeNetwork") -> None:
        self._network = network
        self._turn = anyio.Lock()

    async def send(self, make: Callable[[], Any]) -> None:
        """Publish what `make` gives when it is its turn; None is nothing."""
        async with self._turn:
            message = make()
            if message is not None:
                self._network.carry(wire(message))
                await anyio.sleep(GAP_S)


class Outlets:
    """The publishers that our commands leave by."""

    def __init__(self, network: "FakeNetwork") -> None:
        self.start, self.stop, self.pause = Outlet(network), Outlet(network), Outlet(network)
        self.resume, self.modify = Outlet(network), Outlet(network)
        self._stopping: dict[str, set[str]] = {}

    async def send_stop(self, graph: str, target: str) -> None:
        """Publish a stop; those of one graph that wait leave together."""
        self._stopping.setdefault(graph, set()).add(target)

        def gathered() -> Stop | None:
            targets = self._stopping.pop(graph, None)
            return targets and Stop(graph_name=graph, targets=tuple(sorted(targets)))

        await self.stop.send(gathered)


def wire(message: Any) -> Message:
    """A message as stand-ins take it, also when it is one of ROS."""
    if isinstance(message, Message):
        return message
    kind = {
        "UmrfGraphStart": Start, "UmrfGraphPause": Pause, "UmrfGraphResume": Resume,
        "UmrfGraphModify": Modify,
    }[type(message).__name__]  # fmt: skip
    fields = {
        "graph_name": message.umrf_graph_name,
        "targets": tuple(message.targets),
    }
    if kind is Start:
        fields["graph_json"] = message.umrf_graph_json
    if kind is Modify:
        fields["modified_graph"] = message.modified_graph
        fields["continue_from"] = message.continue_from
    return kind(**fields)


class FakeNetwork:
    """One domain. `loss` is the chance that a message of that topic, or `get`, gets lost on its way
    to one node; `late_s` how long starts take. Answers and feedback take up to `old_s` and
    `feedback_s`."""

    def __init__(self, chance: random.Random | None = None) -> None:
        self.number = 7
        self.own_hash = HASH
        self.joined_at = now()
        self.actors: set[str] = set()
        self.outlets = Outlets(self)
        self.chance = chance or random.Random(0)
        self.loss: dict[str, float] = {}
        self.late_s = 0.0
        self.old_s = 0.0
        self.feedback_s = 0.0
        self._shown_at = 0.0
        self.strangers = 0
        self.ids_unknown = False
        self.born = 0
        self.nodes: list[Node] = []
        self.sent: list[tuple[float, Message]] = []
        self.delivered: list[tuple[float, Message]] = []
        self._subscribers = Listeners[RosValue]()
        self._asked: dict[int, tuple[anyio.Event, list[GetResponse]]] = {}
        self._tickets = 0
        self._handles: set[asyncio.TimerHandle] = set()

    # --- nodes --------------------------------------------------------------------------------

    def join(
        self,
        robot: EmulatedEngine,
        path: str = "/umrf_graph_get",
        lag_s: float = 0.0,
        gap_s: float = 0.0,
    ) -> Node:
        """A node comes up; it hears starts and does not serve its get for `gap_s`."""
        node = Node(self, robot, path, lag_s, gap_s)
        self.nodes.append(node)
        self.stir(node)
        return node

    def kill(self, node: Node) -> None:
        """Kill a node; discovery learns that much later."""
        node.robot.kill()
        node.unseen_at = min(node.unseen_at, now() + LEASE_S)

    @asynccontextmanager
    async def running(self) -> AsyncIterator[TaskGroup]:
        """Messages travel; those that are under way at the end never arrive. What is started in the
        task group ends with it."""
        async with anyio.create_task_group() as tasks:
            try:
                yield tasks
            finally:
                for handle in self._handles:
                    handle.cancel()
                tasks.cancel_scope.cancel()

    def stir(self, node: Node) -> None:
        """Hear what a node says by now, and come back when it has more to say."""
        if node.call is not None:
            node.call.cancel()
            self._handles.discard(node.call)
        for said in node.robot.advance(now_ms() + GRAIN_MS):
            self._hear(node, said)
        due = node.robot.due
        node.call = None if due is None else self._at(max(due / 1000, now()), self.stir, node)

    def _at(self, when: float, work: Callable[..., Any], *given: Any) -> asyncio.TimerHandle:
        def done() -> None:
            self._handles.discard(handle)
            work(*given)

        # A thread of ROS hands over in no task, and in no context of one.
        handle = asyncio.get_running_loop().call_at(when, done, context=Context())
        self._handles.add(handle)
        return handle

    def _hear(self, node: Node, said: object) -> None:
        match said:
            case GetResponse(ticket=ticket):
                if ticket in self._asked:
                    event, got = self._asked[ticket]
                    self._later(self.chance.random() * self.old_s, lambda: _put(event, got, said))
            case FeedbackMessage(actor=actor, history=history):
                late = self.chance.random() * self.feedback_s
                # One after the other: the loop keeps no order among equal times.
                self._shown_at = max(self._shown_at + 1e-6, now() + late)
                if late:
                    self._at(self._shown_at, self.show, actor, history)
                else:
                    self.show(actor, history)
            case LogMessage(text=text):
                self.tell(LogLine(NODE, text))
            case Gone():
                node.unseen_at = min(node.unseen_at, now())

    # --- messages -----------------------------------------------------------------------------

    def carry(self, message: Message, stranger: str = "") -> None:
        """A command on its way to every node; the one of a stranger is overheard by us."""
        self.sent.append((now(), message))
        late = self.late_s if isinstance(message, Start) and not stranger else 0.0
        for node in self.nodes:
            if self.chance.random() >= self.loss.get(message.topic, 0.0):
                takes = late + 0.001 * (1 + self.chance.random())
                self._later(takes, lambda node=node: self._deliver(node, message))
        if stranger:
            self._overhear(message, stranger)

    def _ask(self, node: Node, ticket: int) -> None:
        if node.hears and now() >= node.serves_at:
            node.robot.ask(ticket, now_ms())
            self.stir(node)

    def _deliver(self, node: Node, message: Message) -> None:
        if node.hears:
            self.delivered.append((now(), message))
            node.robot.hear(message, now_ms())
            self.stir(node)

    def _overhear(self, message: Message, sender: str) -> None:
        command: Command = message.topic  # type: ignore[assignment]
        text = getattr(message, "graph_json", "") or getattr(message, "modified_graph", "")
        self.tell(
            OverheardCommand(
                command=command,
                graph=name_of(text) or message.graph_name,
                umrf=text,
                targets=message.targets,
                sender=sender,
            )
        )

    def show(self, actor: str, history: Sequence[str]) -> None:
        """Feedback, of a node or of somebody who only says so."""
        at = clock_us()
        self.actors.add(actor)
        seen = tuple(snapshot(text, at=at, source="feedback") for text in reversed(history))
        self.tell(Shown(actor=actor, snapshots=seen))

    def tell(self, value: RosValue) -> None:
        """Hand a value to all listeners."""
        self._subscribers.tell(value)

    def _later(self, wait_s: float, work: Callable[[], None]) -> None:
        self._at(now() + wait_s, work)

    # --- what a link asks of a domain ---------------------------------------------------------

    async def ask(self, path: str) -> GetResult:
        """The first answer of whoever serves a path."""
        asked_at = clock_us()
        self._tickets += 1
        ticket, event, got = self._tickets, anyio.Event(), list[GetResponse]()
        self._asked[ticket] = event, got
        for node in self.nodes:
            if node.path == path and self.chance.random() >= self.loss.get("get", 0.0):
                takes = 0.0005 * (1 + self.chance.random())
                self._later(takes, lambda node=node: self._ask(node, ticket))
        try:
            await event.wait()
        finally:
            del self._asked[ticket]
        at, texts, graphs = clock_us(), {}, []
        for text in got[0].running:
            shown = snapshot(text, at=at, source="get", asked_at=asked_at)
            graphs.append(shown)
            texts[shown.graph] = text
        return GetResult(
            graphs=tuple(graphs),
            texts=texts,
            known_actions=got[0].umrfs,
            known_graphs=got[0].indexed,
        )

    def client(self, path: str) -> None:
        """Do nothing: this network needs no clients."""

    def servers(self, path: str) -> tuple[Endpoint, ...]:
        """Return the nodes that answer on a path, as far as discovery knows."""
        return tuple(each.end("get") for each in self.nodes if each.serves and each.path == path)

    def listeners(self, topic: str) -> tuple[Endpoint, ...]:
        """Return the nodes that listen, as far as discovery knows."""
        return tuple(each.end(topic) for each in self.nodes if each.seen)

    def bystanders(self, path: str) -> frozenset[str]:
        """Return the nodes that serve another path, or publish starts."""
        others = [each.end("get") for each in self.nodes if each.serves and each.path != path]
        return frozenset(each.process for each in (*others, *self.publishers("start")))

    def publishers(self, topic: str) -> tuple[Endpoint, ...]:
        """Return the nodes that publish feedback, or commands besides ours."""
        if topic.endswith("feedback"):
            return tuple(each.end(topic) for each in self.nodes if each.seen)
        return tuple(Endpoint(f"s{i}", f"s{i}", "cli", HASH) for i in range(self.strangers))

    def paths(self) -> tuple[str, ...]:
        """Every path that somebody serves."""
        return tuple(sorted({each.path for each in self.nodes if each.serves}))

    def hearing(self, subscriber: Callable[[RosValue], None]) -> AbstractContextManager[None]:
        """Be told what comes by itself."""
        return self._subscribers.listening(subscriber)


def _put(event: anyio.Event, got: list[GetResponse], answer: GetResponse) -> None:
    got.append(answer)
    event.set()
