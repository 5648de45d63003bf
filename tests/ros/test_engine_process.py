"""The process of an engine on this computer is known for certain, over real DDS, or not at all."""

import signal
from pathlib import Path
from typing import Any

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Registration
from action_assistant.runner.links.ros2.availability import ros2_reach
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import Ended
from ros.robots import RobotProcess, robot
from ros.test_false_confirmations import clock_us
from runner.harness import ANN, BEN, MemoryJournal, at_once, order, sequence

STUBBORN: dict[str, Any] = {"*": [{"never": True, "ignores_stop": True}]}


async def _answering(robots: Robots, domain: int) -> None:
    await robots.register(Registration(name="David", domain=domain), ANN)
    with anyio.fail_after(20):
        while robots.robot("David").state != "answering":  # noqa: ASYNC110
            await anyio.sleep(0.05)


def test_a_run_that_did_not_obey_ends_with_the_process_of_its_engine(
    domain: int, tmp_path: Path
) -> None:
    david = RobotProcess(domain, tmp_path, STUBBORN)
    journal = MemoryJournal()

    async def live() -> None:
        reach = ros2_reach(clock_us, {"ROS_DOMAIN_ID": str(domain)})
        assert not isinstance(reach, str), reach
        robots = Robots(reach=reach)
        async with ExecutionService.opened(
            journal, robots, clock_us=clock_us, run_in_worker=at_once
        ) as control:
            await _answering(robots, domain)
            run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
            # An engine passes by an action that is still being loaded when it is stopped, and
            # calls it RUNNING for ever: it has not begun to disobey.
            with anyio.fail_after(20):
                while "Work_0" not in control.open[run].run.active:  # noqa: ASYNC110
                    await anyio.sleep(0.05)
            await control.stop(run, BEN)
            with anyio.fail_after(20):
                while not control.open[run].run.unconfirmed:  # noqa: ASYNC110
                    await anyio.sleep(0.05)
            assert control.open[run].run.process is not None
            david.signal(signal.SIGKILL)
            with anyio.fail_after(20):
                while run in control.open:  # noqa: ASYNC110
                    await anyio.sleep(0.05)
            told = journal.told(run)[-1]
            assert isinstance(told, Ended)
            assert told.at_rest is not None
            assert (told.state, told.at_rest.by) == ("error", None)
        await reach.aclose()

    try:
        anyio.run(live)
    finally:
        david.end()


def test_an_engine_that_was_not_started_by_its_name_is_of_no_known_process(domain: int) -> None:
    """One on a thread of this test: the process is right, and nothing says that it is David's."""

    async def live() -> None:
        reach = ros2_reach(clock_us, {"ROS_DOMAIN_ID": str(domain)})
        assert not isinstance(reach, str), reach
        robots = Robots(reach=reach)
        async with ExecutionService.opened(
            MemoryJournal(), robots, clock_us=clock_us, run_in_worker=at_once
        ):
            await _answering(robots, domain)
            engine = robots.link("David")
            assert engine is not None
            assert engine.standing.process is None
        await reach.aclose()

    with robot(domain):
        anyio.run(live)
