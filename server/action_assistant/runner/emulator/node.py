"""The emulated engine as a node of ROS 2, with the topics, service and clock of an engine's node around it."""

import logging
import time
from collections.abc import Callable
from typing import Final, assert_never

import rclpy
from builtin_interfaces.msg import Time
from rcl_interfaces.msg import Log
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from temoto_msgs.msg import (
    UmrfGraphFeedback,
    UmrfGraphModify,
    UmrfGraphPause,
    UmrfGraphResume,
    UmrfGraphStart,
    UmrfGraphStop,
)
from temoto_msgs.srv import UmrfGraphGet

from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import (
    NODE,
    EmulatedIndex,
    FeedbackMessage,
    GetResponse,
    Gone,
    LogMessage,
    Message,
    Modify,
    Pause,
    Resume,
    Said,
    Start,
    Stop,
)
from action_assistant.runner.links.ros2.ros_values import EMULATED
from action_assistant.umrf.facts import EngineFacts

log: Final = logging.getLogger(__name__)

_INFO: Final = 20
_LONGEST_S: Final = 0.5  # between two looks at whether it shall end
_WAITING: Final = 100  # messages of one topic that wait, without the trait of a queue of one


class EmulatorNode:
    """A ROS 2 node with one emulated engine, from its start to its end. `make(epoch_ms)` returns
    that engine, at 0 ms of the node's clock. `told` is called with every message of the engine;
    `indexes`: a period in seconds and a function that reads the engine's folder. Raise RuntimeError
    if the domain cannot be joined."""

    def __init__(
        self,
        make: Callable[[int], EmulatedEngine],
        *,
        domain: int,
        facts: EngineFacts,
        namespace: str = "",
        told: Callable[[Said], None] = lambda _: None,
        indexes: tuple[float, Callable[[], EmulatedIndex]] | None = None,
    ) -> None:
        self._began = self._indexed = time.monotonic()
        self._indexes = indexes
        self._told = told
        self._tickets: dict[int, Future] = {}
        self._asked = 0
        self._ending = False
        self._context = Context()
        self._context.init(domain_id=domain, initialize_logging=False)
        self._node = rclpy.create_node(
            NODE, context=self._context, namespace=namespace, enable_rosout=False
        )
        self._logger = self._node.get_fully_qualified_name().strip("/").replace("/", ".")
        self._executor = SingleThreadedExecutor(context=self._context)
        self._feedback = self._node.create_publisher(UmrfGraphFeedback, facts.feedback_topic, 10)
        self._log = self._node.create_publisher(
            Log, "/rosout", QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        )
        self.robot = make(round(time.time() * 1000))
        if self.robot.performer is not None:
            self.robot.performer.wake = self._executor.wake
        self._node.create_publisher(Log, f"{facts.get_service}/{EMULATED}", 1)
        self._listen(facts, self.robot.quirks.depth or _WAITING)
        self._node.create_service(UmrfGraphGet, facts.get_service, self._ask)
        self._executor.add_node(self._node)

    def _listen(self, facts: EngineFacts, depth: int) -> None:
        hear, subscribe = self._hear, self._node.create_subscription

        def start(message: UmrfGraphStart) -> None:
            hear(
                Start(
                    graph_name=message.umrf_graph_name,
                    targets=tuple(message.targets),
                    graph_json=message.umrf_graph_json,
                )
            )

        def stop(message: UmrfGraphStop) -> None:
            hear(Stop(graph_name=message.umrf_graph_name, targets=tuple(message.targets)))

        def pause(message: UmrfGraphPause) -> None:
            hear(Pause(graph_name=message.umrf_graph_name, targets=tuple(message.targets)))

        def resume(message: UmrfGraphResume) -> None:
            hear(Resume(graph_name=message.umrf_graph_name, targets=tuple(message.targets)))

        def modify(message: UmrfGraphModify) -> None:
            hear(
                Modify(
                    graph_name=message.umrf_graph_name,
                    targets=tuple(message.targets),
                    modified_graph=message.modified_graph,
                    continue_from=message.continue_from,
                )
            )

        subscribe(UmrfGraphStart, facts.start_topic, start, depth)
        subscribe(UmrfGraphStop, facts.stop_topic, stop, depth)
        subscribe(UmrfGraphPause, facts.pause_topic, pause, depth)
        subscribe(UmrfGraphResume, facts.resume_topic, resume, depth)
        subscribe(UmrfGraphModify, facts.modify_topic, modify, depth)

    def spin(self) -> str:
        """Run the node, and block, until `end` is called or the engine ends by itself; return why
        it did, "" for `end`."""
        try:
            while not self._ending and not self.robot.gone:
                due = self.robot.due
                now = self._now()
                wait = _LONGEST_S if due is None else min(_LONGEST_S, max(0.0, due - now) / 1000)
                self._turn(wait)
                self._index_again()
                for said in self.robot.advance(self._now()):
                    self._say(said)
        finally:
            if self.robot.performer is not None:
                self.robot.performer.end()  # before what they wake is gone
            self._executor.shutdown()
            self._node.destroy_node()
            self._context.try_shutdown()
        return self.robot.gone

    def _turn(self, wait_s: float) -> None:
        """Handle one message, if one arrives within `wait_s`."""
        try:
            self._executor.spin_once(timeout_sec=wait_s)
        except (RuntimeError, SystemError) as error:  # the caller has left before the answer
            if not self._context.ok():
                raise
            log.warning("an answer could not be sent: %s", error.__cause__ or error)

    def _index_again(self) -> None:
        if self._indexes is None:
            return
        every_s, index = self._indexes
        if time.monotonic() - self._indexed >= every_s:
            self.robot.reindex(index())
            self._indexed = time.monotonic()

    def end(self) -> None:
        """Let `spin` return; may be called on any thread."""
        self._ending = True
        self._executor.wake()

    def _now(self) -> float:
        return (time.monotonic() - self._began) * 1000

    def _hear(self, message: Message) -> None:
        self.robot.hear(message, self._now())

    async def _ask(
        self, _: UmrfGraphGet.Request, response: UmrfGraphGet.Response
    ) -> UmrfGraphGet.Response:
        """Pass a get to the engine, wait for its answer, and return `response` filled with that."""
        self._asked += 1
        ticket, answered = self._asked, Future(executor=self._executor)
        self._tickets[ticket] = answered
        self.robot.ask(ticket, self._now())
        answer: GetResponse = await answered
        response.umrf_jsons = list(answer.umrfs)
        response.graph_jsons_indexed = list(answer.indexed)
        response.graph_jsons_running = list(answer.running)
        return response

    def _say(self, said: Said) -> None:
        match said:
            case FeedbackMessage(actor=actor, history=history):
                self._feedback.publish(UmrfGraphFeedback(actor=actor, history=list(history)))
            case GetResponse(ticket=ticket):
                self._tickets.pop(ticket).set_result(said)
            case LogMessage(text=text):
                seconds, nanoseconds = divmod(time.time_ns(), 10**9)
                at = Time(sec=seconds, nanosec=nanoseconds)
                self._log.publish(Log(stamp=at, level=_INFO, name=self._logger, msg=text))
            case Gone():
                pass
            case _:
                assert_never(said)
        self._told(said)
