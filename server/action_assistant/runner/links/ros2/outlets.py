"""The command topics of one ROS 2 domain: spaces messages out, and recognizes the echo of our own."""

import time
from collections import deque
from collections.abc import Callable, Iterable
from typing import Final, Generic, TypeAlias, TypeVar

import anyio
import msgspec
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from temoto_msgs.msg import (
    UmrfGraphModify,
    UmrfGraphPause,
    UmrfGraphResume,
    UmrfGraphStart,
    UmrfGraphStop,
)

from action_assistant.runner.links.engine_text import RECEIVED_START
from action_assistant.runner.links.observations import Snapshot

#: Seconds between two messages on one topic: an engine keeps one only, and of two that come within
#: 2 ms it loses the first (28 of 30, recorded).
GAP_S: Final = 0.05
#: Seconds at most that a start waits for a sign that its engine took the one before: an engine that
#: is busy for longer than a gap would lose it to the next one, which need not be for it.
TAKEN_S: Final = 2.0
_ECHO_S: Final = 30.0  # for which the echo of a message is recognized

Message: TypeAlias = (
    UmrfGraphStart | UmrfGraphStop | UmrfGraphPause | UmrfGraphResume | UmrfGraphModify
)
M = TypeVar("M", bound=Message)


class Topics(msgspec.Struct, frozen=True, kw_only=True):
    """The absolute names of the ROS topics on which engines receive commands and send feedback."""

    start: str
    stop: str
    pause: str
    resume: str
    modify: str
    feedback: str


def qos(depth: int) -> QoSProfile:
    """Return the quality of service that engines use: reliable, the last `depth` messages queued,
    and none stored for subscribers that join later."""
    return QoSProfile(
        depth=depth,
        history=HistoryPolicy.KEEP_LAST,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.VOLATILE,
    )


class _SentMessage:
    """A message of this process and the period in which it was published, in nanoseconds UTC.
    `sent_at`: the same in seconds of a clock that does not jump."""

    def __init__(self, message: Message) -> None:
        self.message = message
        self.sent_at = time.monotonic()
        self.since = time.time_ns()
        self.until: int | None = None


class Outlet(Generic[M]):
    """One command topic, on which messages leave one by one, `GAP_S` apart."""

    def __init__(self, publisher: "Publisher[M]") -> None:
        self._publisher = publisher
        self._sent: deque[_SentMessage] = deque(maxlen=256)
        self._turn = anyio.Lock()
        self._free_at = 0.0

    async def send(self, make: Callable[[], M | None]) -> None:
        """Wait for the turn, then publish the message that `make` returns; if it returns None,
        publish none."""
        async with self._turn:
            await anyio.sleep(max(0.0, self._free_at - time.monotonic()))
            message = make()
            if message is None:
                return
            mark = _SentMessage(message)
            self._sent.append(mark)
            try:
                self._publisher.publish(message)
            finally:
                mark.until = time.time_ns()
                self._free_at = time.monotonic() + GAP_S

    def sent(self, message: Message, stamp: int | None) -> bool:
        """Return whether a message on this topic was sent by this process: the same text, with a
        time stamp (nanoseconds UTC) from while this process was publishing it; without a stamp, not
        long ago. Called on any thread."""
        horizon = time.monotonic() - _ECHO_S
        return any(
            mark.message == message
            and (
                mark.sent_at >= horizon
                if stamp is None
                else mark.since <= stamp <= (mark.until or stamp)
            )
            for mark in tuple(self._sent)
        )


class Outlets:
    """The publishers of all command topics of one domain."""

    def __init__(self, node: Node, topics: Topics) -> None:
        publish, each = node.create_publisher, qos(10)
        self.start = Outlet(publish(UmrfGraphStart, topics.start, each))
        self.stop = Outlet(publish(UmrfGraphStop, topics.stop, each))
        self.pause = Outlet(publish(UmrfGraphPause, topics.pause, each))
        self.resume = Outlet(publish(UmrfGraphResume, topics.resume, each))
        self.modify = Outlet(publish(UmrfGraphModify, topics.modify, each))
        self._start_turn = anyio.Lock()
        self._untaken: _Untaken | None = None
        self._stopping: dict[str, _Stops] = {}

    async def send_start(
        self, robot: str, run: str, message: UmrfGraphStart, leaves: Callable[[], None]
    ) -> None:
        """Publish the start of a run on a robot once the engine of the previous start has shown
        that it received that one, or `TAKEN_S` seconds after it. `leaves` is called right before
        the message leaves; if it raises NotSent, the message is not sent."""

        def leaving() -> UmrfGraphStart:
            leaves()
            self._untaken = _Untaken(
                robot, run, f"{RECEIVED_START}{message.umrf_graph_name}".strip()
            )
            return message

        async with self._start_turn:
            if self._untaken is not None:
                with anyio.move_on_after(self._untaken.until - time.monotonic()):
                    await self._untaken.taken.wait()
            await self.start.send(leaving)

    def shown(self, graphs: Iterable[Snapshot]) -> None:
        """Take note of the graphs that engines report. If the run of the last start is among them,
        the engine has received that start, and the next start may be sent."""
        last = self._untaken
        if last is not None and any(each.run == last.run for each in graphs):
            last.taken.set()

    def said(self, robot: str, line: str) -> None:
        """Take note of a line of a robot's log: if it says that the last start was received, the
        next one may be sent."""
        last = self._untaken
        if last is not None and (last.robot, last.receipt) == (robot, line.strip()):
            last.taken.set()

    async def send_stop(self, graph: str, target: str) -> None:
        """Publish a stop of a graph for one robot (`target`) when it is its turn. Waiting stops of
        one graph are sent as one message, with every robot as a target; if it cannot be published,
        each of the calls raises the error."""
        stops = self._stopping.setdefault(graph, _Stops())
        stops.targets.append(target)

        def gathered() -> UmrfGraphStop | None:
            if stops.left:  # an earlier message has had this target, too
                return None
            self._close(graph, stops)
            return UmrfGraphStop(umrf_graph_name=graph, targets=sorted(set(stops.targets)))

        try:
            await self.stop.send(gathered)
        except anyio.get_cancelled_exc_class():
            stops.targets.remove(target)  # a late stop would hit a later run of that name
            if not stops.targets:
                self._close(graph, stops)
            raise
        except Exception as error:
            stops.failed = error
            raise
        if stops.failed is not None:
            raise stops.failed

    def _close(self, graph: str, stops: "_Stops") -> None:
        stops.left = True
        if self._stopping.get(graph) is stops:
            del self._stopping[graph]


class _Untaken:
    """A start that was sent and is not yet known to be received."""

    def __init__(self, robot: str, run: str, receipt: str) -> None:
        self.robot, self.run = robot, run
        self.receipt = receipt  # the line by which its engine would say so
        self.until = time.monotonic() + TAKEN_S
        self.taken = anyio.Event()


class _Stops:
    """The waiting stops of one graph, which are sent as one message."""

    def __init__(self) -> None:
        self.targets: list[str] = []
        self.left = False
        self.failed: Exception | None = None
