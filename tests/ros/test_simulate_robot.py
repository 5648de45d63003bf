"""`simulate-robot` as people start it: a process that can be asked, stopped and killed."""

import signal
from pathlib import Path

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.links.port import NoAnswer
from ros.robots import RobotProcess
from ros.test_contract import SCRIPT, reached
from runner.harness import sequence
from runner.links.contract import Bench, answer, moves, placed, shown


async def test_an_emulated_robot_answers_is_silent_when_frozen_and_then_reports_what_it_did(
    domain: int, tmp_path: Path
) -> None:
    robot = RobotProcess(domain, tmp_path, SCRIPT, "--quirk", "loss=0")
    try:
        assert robot.first == f"David is on domain {domain} and moves nothing. Ctrl-C ends it.\n"
        async with reached(domain, "David") as link:
            bench = Bench(link=link, endless=sequence("endless"), quick=sequence("quick"))
            await link.start(placed(bench.endless, "r1"))
            await shown(bench, bench.endless, moves)
            robot.signal(signal.SIGSTOP)
            with pytest.raises((NoAnswer, TimeoutError)), anyio.fail_after(1):
                await link.get()
            await link.stop("endless")  # waits in its queue
            robot.signal(signal.SIGCONT)
            await shown(bench, bench.endless, lambda each: each.state == "STOPPED")
            assert (
                len({each.incarnation for each in [await answer(bench), await answer(bench)]}) == 1
            )
    finally:
        assert robot.end() == 0
