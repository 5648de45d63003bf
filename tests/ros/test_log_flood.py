"""Commands of others are heard although nodes flood the log, over real rclpy."""

import time

import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.links.port import EngineLog, ForeignCommand, Report
from ros.echo_engine import EchoEngine
from ros.test_ros2_link import answering, engine, robot
from support.waiting import wait_until

_HEARD_S = 0.3  # in which what was published has come


def flood(node: EchoEngine, other: EchoEngine) -> None:
    """Two commands with many lines between them, while the event loop takes nothing in: it is held up
    by the sleeps, in which the thread of the domain hears what was published."""
    other.publish("stop", umrf_graph_name="first", targets=["robot"])
    time.sleep(_HEARD_S)
    for number in range(1_500):
        node.log(f"The line {number}.")
        time.sleep(0.0005)  # faster, and the middleware's own queue would lose them
    time.sleep(_HEARD_S)
    other.publish("stop", umrf_graph_name="last", targets=["robot"])
    time.sleep(_HEARD_S)


def places(heard: list[Report], kind: type[Report]) -> list[int]:
    """Return the positions of the reports of one kind."""
    return [at for at, each in enumerate(heard) if isinstance(each, kind)]


async def test_a_flood_of_log_lines_hides_no_command_of_others(domain: int) -> None:
    heard: list[Report] = []
    with engine(domain) as node, engine(domain, namespace="laptop") as other:
        async with robot(domain, get_service="/umrf_graph_get") as link:
            with link.listen(heard.append):
                await answering(link)
                other.speak()
                await wait_until(lambda: link.standing.others == 1)
                flood(node, other)
                await wait_until(lambda: len(places(heard, ForeignCommand)) == 2, 5)
            first, last = places(heard, ForeignCommand)
            commands = [each for each in heard if isinstance(each, ForeignCommand)]
            assert [each.graph for each in commands] == ["first", "last"]
            lines = places(heard, EngineLog)
            between = [at for at in lines if first < at < last]
            assert len(lines) < 1_500  # of these the oldest went
            assert len(between) > 200
