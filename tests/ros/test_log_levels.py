"""Lines of a real node's log on /rosout keep the levels with which they were logged."""

import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.links.port import EngineLog, Report
from ros.test_ros2_link import answering, engine, robot
from support.waiting import wait_until

TEXT = "Received request to start UMRF graph: patrol"
LEVELS = ("debug", "info", "warn", "error", "fatal")


async def test_a_line_comes_with_the_level_with_which_its_node_logged_it(domain: int) -> None:
    heard: list[Report] = []

    def lines() -> dict[str, str]:
        return {each.text: each.level for each in heard if isinstance(each, EngineLog)}

    with engine(domain) as node:
        async with robot(domain, get_service="/umrf_graph_get") as link:
            with link.listen(heard.append):
                await answering(link)
                node.log_on_every_level(TEXT)
                await wait_until(lambda: len(lines()) >= len(LEVELS), 5)
    assert lines() == {f"{level} {TEXT}": level for level in LEVELS}
