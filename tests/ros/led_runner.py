"""A runner of this process that leads robots over rclpy, emulated or real ones."""

import time
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress

import anyio

from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Registration
from action_assistant.runner.links.ros2.availability import ros2_reach
from action_assistant.runner.links.simulator import Simulator, in_this_process
from action_assistant.runner.robots.registry import Robots
from runner.harness import ANN, MemoryJournal, at_once, until


def clock_us() -> int:
    """Microseconds UTC."""
    return time.time_ns() // 1000


@asynccontextmanager
async def led_runner(
    domains: Mapping[str, int], simulator: Simulator = in_this_process
) -> AsyncIterator[tuple[ExecutionService, MemoryJournal]]:
    """Open a runner that may lead these robots, and wait until all of them answer. `domains`: by the
    name of the robot."""
    reach = ros2_reach(clock_us, {"ROS_DOMAIN_ID": str(min(domains.values()))})
    assert not isinstance(reach, str), reach
    robots, journal = Robots(reach=reach), MemoryJournal()
    try:
        async with ExecutionService.opened(
            journal, robots, clock_us=clock_us, run_in_worker=at_once, simulator=simulator
        ) as control:
            for name, domain in domains.items():
                await control.register(Registration(name=name, domain=domain, led=True), ANN)
            await until(lambda: all(robots.robot(each).state == "answering" for each in domains))
            yield control, journal
    finally:
        with anyio.CancelScope(shield=True):
            await reach.aclose()


async def is_over(control: ExecutionService, run: str, seconds: float) -> bool:
    """Wait so long for the end of a run; return whether it came."""
    with suppress(TimeoutError):
        await until(lambda: run not in control.open, seconds)
    return run not in control.open
