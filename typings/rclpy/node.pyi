from collections.abc import Awaitable, Callable
from typing import TypeVar

from rclpy.client import Client
from rclpy.logging import Logger
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from rclpy.topic_endpoint_info import TopicEndpointInfo

M = TypeVar("M")
Q = TypeVar("Q")
A = TypeVar("A")

class Node:
    def create_publisher(
        self, msg_type: type[M], topic: str, qos_profile: QoSProfile | int
    ) -> Publisher[M]: ...
    # The callback may also take what the middleware says about the message as a second argument.
    def create_subscription(
        self,
        msg_type: type[M],
        topic: str,
        callback: Callable[[M], None] | Callable[[M, dict[str, int | None]], None],
        qos_profile: QoSProfile | int,
    ) -> Subscription[M]: ...
    def create_client(self, srv_type: type, srv_name: str) -> Client: ...
    def create_service(
        self, srv_type: type, srv_name: str, callback: Callable[[Q, A], A | Awaitable[A]]
    ) -> Service: ...
    def create_timer(self, timer_period_sec: float, callback: Callable[[], None]) -> Timer: ...
    def destroy_node(self) -> None: ...
    def get_logger(self) -> Logger: ...
    def get_fully_qualified_name(self) -> str: ...
    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]: ...
    def get_publishers_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]: ...
    def get_subscriptions_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]: ...
