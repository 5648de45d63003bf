"""A start that an engine refuses, over real rclpy: its words arrive, and the run is over."""

import time

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Registration
from action_assistant.runner.links.ros2.availability import ros2_reach
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import Override
from ros.robots import robot
from runner.harness import ANN, MemoryJournal, at_once, order, sequence


def clock_us() -> int:
    return time.time_ns() // 1000


async def refused(domain: int) -> MemoryJournal:
    reach = ros2_reach(clock_us, {"ROS_DOMAIN_ID": str(domain)})
    assert not isinstance(reach, str), reach
    journal, robots = MemoryJournal(), Robots(reach=reach)
    graph = sequence()
    carols = msgspec.structs.replace(graph.actions[0], actor="Carol")
    graph = msgspec.structs.replace(graph, actions=(carols, *graph.actions[1:]))
    override = Override(codes=("actors", "others", "actions"), reason="it is a test")
    try:
        async with ExecutionService.opened(
            journal, robots, clock_us=clock_us, run_in_worker=at_once
        ) as control:
            await robots.register(Registration(name="David", domain=domain), ANN)
            with anyio.fail_after(30):
                while robots.robot("David").state != "answering":  # noqa: ASYNC110
                    await anyio.sleep(0.05)
                await control.start(order(graph, engine="David", override=override), ANN)
                while control.open:  # noqa: ASYNC110
                    await anyio.sleep(0.05)
    finally:
        with anyio.CancelScope(shield=True):
            await reach.aclose()
    return journal


def test_the_words_of_a_refusal_reach_the_run_and_end_it(domain: int) -> None:
    with robot(domain):
        journal = anyio.run(refused, domain)
    (stream,) = [each for each in journal.streams if each.startswith("run/")]
    run = journal.history(stream.removeprefix("run/"))
    assert run.end == "refused"
    assert "actor synchronizer not initialized" in run.detail
    assert [each.code for each in run.alarms] == ["start_refused"]
