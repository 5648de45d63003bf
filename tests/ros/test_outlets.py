"""Stops that leave as one message, over real rclpy: none is taken for sent that was not."""

import time
from collections.abc import Iterator

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

import rclpy
from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from temoto_msgs.msg import UmrfGraphStop

from action_assistant.runner.links.ros2.outlets import Outlets, Topics


@pytest.fixture
def node(domain: int) -> Iterator[Node]:
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    made = Node("outlets", context=context)
    yield made
    made.destroy_node()
    rclpy.shutdown(context=context)


def outlets(node: Node) -> Outlets:
    names = ("start", "stop", "pause", "resume", "modify", "feedback")
    return Outlets(node, Topics(**{name: f"/{name}" for name in names}))


def targets(node: Node) -> list[list[str]]:
    """The targets of each stop that is published from now on."""
    heard: list[list[str]] = []
    node.create_subscription(UmrfGraphStop, "/stop", lambda it: heard.append(list(it.targets)), 10)
    return heard


def spin(node: Node) -> None:
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    for _ in range(20):
        executor.spin_once(timeout_sec=0.05)
    executor.shutdown()


def test_stops_that_cannot_be_published_are_sent_for_nobody(node: Node) -> None:
    found: list[str] = []

    async def main() -> None:
        out = outlets(node)
        for publisher in tuple(node.publishers):
            if publisher.topic_name == "/stop":
                node.destroy_publisher(publisher)

        async def stop(robot: str) -> None:
            try:
                await out.send_stop("patrol", robot)
            except InvalidHandle:
                found.append(robot)

        async with anyio.create_task_group() as tasks:
            for robot in ("Carol", "David"):
                tasks.start_soon(stop, robot)

    anyio.run(main)
    assert sorted(found) == ["Carol", "David"]


@pytest.mark.parametrize("jump_s", [-3600, 3600])
def test_a_message_is_our_own_also_after_a_jump_of_the_clock(
    node: Node, jump_s: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, message = outlets(node), UmrfGraphStop(umrf_graph_name="patrol")
    anyio.run(lambda: out.stop.send(lambda: message))
    stamp = out.stop._sent[0].since
    own, now_ns = time.time_ns, time.time_ns() + jump_s * 10**9
    monkeypatch.setattr(time, "time_ns", lambda: now_ns)
    assert out.stop.sent(message, stamp)
    assert not out.stop.sent(message, own())  # the same, published by somebody else


def test_a_stop_that_was_given_up_hits_no_later_run_of_that_name(node: Node) -> None:
    heard = targets(node)

    async def main() -> None:
        out = outlets(node)
        await anyio.sleep(0.5)  # until the subscription is matched
        await out.send_stop("other", "Carol")
        with anyio.move_on_after(0.001):  # its turn comes in 50 ms
            await out.send_stop("patrol", "David")
        await out.send_stop("patrol", "Carol")

    anyio.run(main)
    spin(node)
    assert heard == [["Carol"], ["Carol"]]
