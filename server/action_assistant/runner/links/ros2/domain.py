"""One ROS 2 domain as this process sees it: a context, a node and a thread, which all links share.

The thread waits for messages, reads them and hands them to the event loop. Publishing and discovery queries
run on the event loop itself, since neither waits. Entities are destroyed after the thread has ended:
destroying one under a waiting executor breaks it.
"""

import asyncio
import logging
import secrets
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, Final, TypeAlias, TypeVar

import rclpy
from rcl_interfaces.msg import Log
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from rclpy.topic_endpoint_info import TopicEndpointInfo
from temoto_msgs.msg import (
    UmrfGraphFeedback,
    UmrfGraphModify,
    UmrfGraphPause,
    UmrfGraphResume,
    UmrfGraphStart,
    UmrfGraphStop,
)
from temoto_msgs.srv import UmrfGraphGet

from action_assistant.runner.links.engine_text import NotAGraph, name_of, snapshot
from action_assistant.runner.links.hardware_stop import TYPES, HardwareStop, StopSignal
from action_assistant.runner.links.health import HEALTH_TYPES, HealthCheck, HealthSignal
from action_assistant.runner.links.listeners import Listeners
from action_assistant.runner.links.port import Command, Feedback
from action_assistant.runner.links.ros2.message_queue import MessageQueue
from action_assistant.runner.links.ros2.outlets import Message, Outlet, Outlets, Topics, qos
from action_assistant.runner.links.ros2.report_topics import (
    health_in,
    message_type,
    pressed_in,
    report_qos,
)
from action_assistant.runner.links.ros2.ros_values import (
    EMULATED,
    Endpoint,
    GetResult,
    LogLine,
    OverheardCommand,
    RosValue,
)

log: Final = logging.getLogger(__name__)

#: Seconds after joining a domain until every participant is seen. Fast DDS announces itself every 3 s, and the
#: second of two engines was seen up to 2 s after the first (measured on a loaded computer).
DISCOVERY_S: Final = 3.5
_PROCESS: Final = 12  # bytes of a gid that all endpoints of one process share
_KIND: Final = "temoto_msgs/srv/UmrfGraphGet"
_ACTORS: Final = 64
_JOIN_S: Final = 2.0
#: Types of messages that do not say who sends them, with what several publishers make unknown.
_OF_ONE: Final = {
    TYPES["bool"]: "the newest message need not be the stop's",
    HEALTH_TYPES["battery"]: "the newest message need not be of this robot",
}

M = TypeVar("M", bound=Message)
Clock: TypeAlias = Callable[[], int]


Subscriber: TypeAlias = Callable[[RosValue], None]


class Domain:
    """The participation of this process in one ROS domain: its node, publishers, subscriptions, and
    the thread that receives messages."""

    def __init__(
        self, number: int, topics: Topics, loop: asyncio.AbstractEventLoop, clock_us: Clock
    ) -> None:
        """Join the domain `number` with these topics. `loop`: the event loop to which messages are
        passed; `clock_us`: returns microseconds UTC. This blocks for up to some seconds, so call it
        in a thread. Raise RuntimeError if the middleware does not show this process to itself."""
        self.number = number
        self.topics = topics
        self.actors: set[str] = set()  # names in feedback so far
        self.settled_at = time.monotonic() + DISCOVERY_S
        self._loop = loop
        self._clock_us = clock_us
        self._subscribers = Listeners[RosValue]()
        self._report_listeners: dict[tuple[str, str], tuple[Callable[[Any], None], ...]] = {}
        self._waiting = MessageQueue()
        self._handing: set[asyncio.Task[None]] = set()
        self._leaving = False
        self._clients: dict[str, Client] = {}
        self._context = Context()
        self._context.init(domain_id=number, initialize_logging=False)
        self._node = rclpy.create_node(
            f"action_assistant_{secrets.token_hex(4)}",
            context=self._context,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self.outlets = Outlets(self._node, topics)
        self._listen()
        own = self._know_ourselves()
        self.process, self.own_hash = own[0].process, own[0].type_hash
        #: The ids of this process's own endpoints do not share a part, so no process can be told by it.
        self.ids_unknown = len({each.process for each in own}) > 1
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, name=f"ros2-{number}", daemon=True)
        self._thread.start()

    def leave(self) -> None:
        """End the thread, then destroy the node. Blocks until both have ended, so call it in a
        thread."""
        self._leaving = True
        self._executor.create_task(
            lambda: None
        )  # `wake` alone is lost while the executor is not waiting
        self._thread.join()
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()
        self._context.destroy()

    @property
    def settled(self) -> bool:
        """True once discovery has had the time to show every participant."""
        return time.monotonic() >= self.settled_at

    # --- the one question ---------------------------------------------------------------------

    async def ask(self, path: str) -> GetResult:
        """Call the get service of the name `path`, wait for the server's answer and return it. The
        call has no timeout of its own. If the caller cancels it, an answer that comes later is
        dropped. Raise NotAGraph if a graph in the answer cannot be read, RuntimeError if the call
        fails."""
        loop = asyncio.get_running_loop()
        answered: asyncio.Future[GetResult] = loop.create_future()
        client, asked_at = self.client(path), self._clock_us()

        def hand_over(got: GetResult | Exception) -> None:
            if answered.done():
                return
            if isinstance(got, Exception):
                answered.set_exception(got)
            else:
                answered.set_result(got)

        def read(future: Future) -> None:
            """Decode the answer in a completed future, on the thread of this domain, so that
            megabytes do not block the event loop, and hand it to the caller there."""
            if future.cancelled():
                return
            try:
                got: GetResult | Exception = _read(future.result(), asked_at, self._clock_us())
            except (NotAGraph, RuntimeError) as error:
                got = error
            self._to_loop(lambda: hand_over(got))

        pending = client.call_async(UmrfGraphGet.Request())
        pending.add_done_callback(read)
        try:
            return await answered
        finally:
            client.remove_pending_request(pending)

    def client(self, path: str) -> Client:
        """Return the client of a path. The first call creates it, early, because discovery needs time before an
        answer can reach it."""
        if path not in self._clients:
            self._clients[path] = self._node.create_client(UmrfGraphGet, path)
        return self._clients[path]

    # --- who is there -------------------------------------------------------------------------

    def servers(self, path: str) -> tuple[Endpoint, ...]:
        """Return the servers of the get service on a path; those of this process are not included."""
        raw = self._node.get_subscriptions_info_by_topic(f"rq{_absolute(path)}Request", True)
        return self._others(raw)

    def listeners(self, topic: str) -> tuple[Endpoint, ...]:
        """Return the subscriptions to a topic; those of this process are not included."""
        return self._others(self._node.get_subscriptions_info_by_topic(topic))

    def publishers(self, topic: str) -> tuple[Endpoint, ...]:
        """Return the publishers on a topic; those of this process are not included."""
        return self._others(self._node.get_publishers_info_by_topic(topic))

    def is_emulated(self, path: str, server: Endpoint) -> bool:
        """Return whether the server of a path says that it is an emulated engine."""
        marks = self.publishers(f"{_absolute(path)}/{EMULATED}")
        return any(each.process == server.process for each in marks)

    def paths(self) -> tuple[str, ...]:
        """Return the names (paths) of all services that have the type of an engine's get service."""
        found = self._node.get_service_names_and_types()
        return tuple(name for name, kinds in found if _KIND in kinds and self.servers(name))

    def bystanders(self, path: str) -> frozenset[str]:
        """Return the processes that do what no engine of a path does while it starts up: serve
        another path, publish starts, or receive feedback."""
        own = _absolute(path)
        ends = [*self.publishers(self.topics.start), *self.listeners(self.topics.feedback)]
        for each in self.paths():
            if each != own:
                ends += self.servers(each)
        return frozenset(each.process for each in ends)

    def _others(self, found: list[TopicEndpointInfo]) -> tuple[Endpoint, ...]:
        ends = (_endpoint(info) for info in found)
        return tuple(each for each in ends if each.process != self.process)

    def _know_ourselves(self) -> tuple[Endpoint, ...]:
        """Return this process's publisher of starts and its subscriptions to starts and feedback, as
        others see them. Raise RuntimeError if the middleware does not show them in time."""
        node, topics = self._node, self.topics
        name, deadline = node.get_fully_qualified_name().lstrip("/"), time.monotonic() + _JOIN_S
        while time.monotonic() < deadline:
            shown = (
                node.get_publishers_info_by_topic(topics.start),
                node.get_subscriptions_info_by_topic(topics.start),
                node.get_subscriptions_info_by_topic(topics.feedback),
            )
            own = [_endpoint(info) for ends in shown for info in ends if info.node_name == name]
            if len(own) == len(shown):
                return tuple(own)
            time.sleep(0.01)
        raise RuntimeError("the middleware does not show this process to itself")

    def stop_signal(self, rule: HardwareStop, changed: Callable[[], None]) -> StopSignal:
        """Listen to a hardware stop from now on. `changed` is called on the event loop after a message
        that says another thing than the one before it. Raise RuntimeError if that is not possible."""
        read, topic = pressed_in(rule), rule.full_topic

        def heard(message: Message) -> None:
            pressed = read(message)
            if pressed is not None and signal.hear(pressed=pressed, at=time.monotonic()):
                self._to_loop(changed)

        place = topic, TYPES[rule.kind]
        signal = _StopTopic(self._node, *place, lambda: self._leave_report(place, heard))
        self._listen_to_report(place, message_type(rule.kind), heard)
        return signal

    def health_signal(self, check: HealthCheck) -> HealthSignal:
        """Listen to something of a robot's health from now on. Raise RuntimeError if that is not
        possible."""
        read, topic = health_in(check), check.full_topic

        def heard(message: Message) -> None:
            reading = read(message)
            if reading is not None:
                signal.newest = reading, time.monotonic()

        place = topic, HEALTH_TYPES[check.kind]
        signal = _HealthTopic(self._node, *place, lambda: self._leave_report(place, heard))
        self._listen_to_report(place, message_type(check.kind), heard)
        return signal

    def _listen_to_report(
        self, place: tuple[str, str], kind: type[Any], heard: Callable[[Any], None]
    ) -> None:
        """Call `heard` with each message on a topic, of a type (`place`)."""

        def share(message: Message) -> None:
            for listener in self._report_listeners.get(place, ()):
                listener(message)

        if place not in self._report_listeners:
            self._node.create_subscription(kind, place[0], share, report_qos())
        self._report_listeners[place] = (*self._report_listeners.get(place, ()), heard)

    def _leave_report(self, place: tuple[str, str], heard: Callable[[Any], None]) -> None:
        self._report_listeners[place] = tuple(
            each for each in self._report_listeners[place] if each is not heard
        )

    # --- what comes by itself -----------------------------------------------------------------

    def hearing(self, subscriber: Subscriber) -> AbstractContextManager[None]:
        """Return a context during which `subscriber` is called with every message that this process
        receives, on the event loop."""
        return self._subscribers.listening(subscriber)

    def _listen(self) -> None:
        topics, node, out = self.topics, self._node, self.outlets
        node.create_subscription(UmrfGraphFeedback, topics.feedback, self._feedback, qos(100))
        node.create_subscription(Log, "/rosout", self._log_line, qos(100))
        self._overhear("start", UmrfGraphStart, topics.start, out.start)
        self._overhear("stop", UmrfGraphStop, topics.stop, out.stop)
        self._overhear("pause", UmrfGraphPause, topics.pause, out.pause)
        self._overhear("resume", UmrfGraphResume, topics.resume, out.resume)
        self._overhear("modify", UmrfGraphModify, topics.modify, out.modify)

    def _overhear(self, command: Command, kind: type[M], topic: str, ours: Outlet[M]) -> None:
        def heard(message: M, info: dict[str, int | None]) -> None:
            """Report a command that another program has published. `info`: what the
            middleware says of the message, with the time of sending."""
            if ours.sent(message, info.get("source_timestamp")):
                return
            graph, umrf = _named(message)
            value = OverheardCommand(
                command=command,
                graph=graph,
                umrf=umrf,
                targets=tuple(message.targets),
                sender=self._sender(topic),
            )
            self._tell(value)

        self._node.create_subscription(kind, topic, heard, qos(50))

    def _sender(self, topic: str) -> str:
        """Return the logger name of the only publisher on a topic; "" if there are several, since
        the middleware does not identify the sender."""
        loggers = {each.logger for each in self.publishers(topic)}
        return loggers.pop() if len(loggers) == 1 else ""

    def _feedback(self, message: UmrfGraphFeedback) -> None:
        at, seen = self._clock_us(), []
        for text in reversed(message.history):  # the newest stands first
            try:
                seen.append(snapshot(text, at=at, source="feedback"))
            except NotAGraph as error:
                log.warning("feedback of %r cannot be read: %s", message.actor, error)
        if len(self.actors) < _ACTORS:
            self.actors.add(message.actor)
        self._tell(Feedback(actor=message.actor, snapshots=tuple(seen)))

    def _log_line(self, message: Log) -> None:
        self._tell(LogLine(message.name, message.msg, message.level))

    def _tell(self, value: RosValue) -> None:
        """Queue a value for the event loop; called on the thread of this domain."""
        if self._waiting.add(value):
            self._to_loop(self._begin_to_hand_over)

    def _begin_to_hand_over(self) -> None:
        """Begin a task that passes the queued values on; called on the event loop. Outside of a task
        `anyio.current_time`, for one, would raise in a subscriber."""
        task = self._loop.create_task(self._hand_over())
        self._handing.add(task)
        task.add_done_callback(self._handing.discard)

    async def _hand_over(self) -> None:
        """Pass the queued values to the subscribers, in order."""
        taken = self._waiting.take()
        if taken.dropped:
            log.warning("domain %d: %d messages came too fast", self.number, taken.dropped)
        if taken.dropped_commands:
            count = taken.dropped_commands
            log.error("domain %d: %d commands of others came too fast", self.number, count)
        for value in taken.values:
            try:
                self._subscribers.tell(value)
            except Exception:  # a subscriber that fails at one value must get the others
                log.exception("domain %d: a message could not be told", self.number)

    def _to_loop(self, work: Callable[[], None]) -> None:
        try:
            self._loop.call_soon_threadsafe(work)
        except RuntimeError:  # the loop is closed
            if not self._leaving:
                log.warning("domain %d goes on without an event loop", self.number)

    def _spin(self) -> None:
        while not self._leaving and self._context.ok():
            try:
                self._executor.spin_once()
            except Exception:
                log.exception("domain %d: a message could not be taken in", self.number)


class _ReportTopic:
    """A topic on which a robot reports something, and who publishes there."""

    def __init__(self, node: Node, topic: str, kind: str, leave: Callable[[], None]) -> None:
        super().__init__()
        self._node, self._topic, self._kind = node, topic, kind
        self._leave = leave

    def close(self) -> None:
        """Receive no more messages of this topic."""
        self._leave()

    def problem(self) -> str:
        """Return what is wrong with who publishes, as part of a sentence; "" if nothing is."""
        ends = self._node.get_publishers_info_by_topic(self._topic)
        if not ends:
            return "nobody publishes it"
        others = {each.topic_type for each in ends} - {self._kind}
        if others:
            return f"it is published as {others.pop()}, not as {self._kind}"
        if self._kind in _OF_ONE and len(ends) > 1:
            return f"{len(ends)} programs publish it, and {_OF_ONE[self._kind]}"
        return ""


class _StopTopic(_ReportTopic, StopSignal):
    """The newest message on a topic of a hardware stop, and who publishes there."""


class _HealthTopic(_ReportTopic, HealthSignal):
    """The newest message on a topic about a robot's health, and who publishes there."""


def _absolute(path: str) -> str:
    return path if path.startswith("/") else f"/{path}"


def _endpoint(info: TopicEndpointInfo) -> Endpoint:
    gid = bytes(info.endpoint_gid)
    logger = f"{info.node_namespace}/{info.node_name}".strip("/").replace("/", ".")
    return Endpoint(
        gid=gid.hex(),
        process=gid[:_PROCESS].hex(),
        logger=logger,
        type_hash=str(info.topic_type_hash),
    )


def _named(message: Message) -> tuple[str, str]:
    """Return the name of the graph that a command message concerns, as engines see it, and the text
    of the graph, "" if it carries none. A name inside the text overrides the name beside it."""
    match message:
        case UmrfGraphStart(umrf_graph_json=text) | UmrfGraphModify(modified_graph=text):
            return (
                name_of(text) or message.umrf_graph_name
            ) if text else message.umrf_graph_name, text
        case _:
            return message.umrf_graph_name, ""


def _read(response: UmrfGraphGet.Response, asked_at: int, at: int) -> GetResult:
    """Decode the answer to a get, requested at `asked_at` and received at `at` (µs UTC). Raise
    NotAGraph if any graph in it cannot be read, since an answer that is not completely understood
    proves nothing."""
    texts, graphs = {}, []
    for text in response.graph_jsons_running:
        shown = snapshot(text, at=at, source="get", asked_at=asked_at)
        graphs.append(shown)
        texts[shown.graph] = text
    return GetResult(
        graphs=tuple(graphs),
        texts=texts,
        known_actions=tuple(response.umrf_jsons),
        known_graphs=tuple(response.graph_jsons_indexed),
    )
