"""An emulated robot whose actions are Python behaviours: told over ROS 2, and never out of hand."""

from pathlib import Path

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from ros.robots import RobotProcess
from ros.test_contract import reached
from runner.links.behaviours.written import DEAF, WAITS, chain, processes, until, write
from runner.links.contract import Bench, answer, placed, shown

QUICK = {"*": [{"after_s": 0.02}]}
_LOUD = ("--quirk", "loss=0")


async def test_its_actions_do_what_their_behaviours_do_and_the_others_what_the_script_says(
    domain: int, tmp_path: Path
) -> None:
    folder = write(
        tmp_path / "behaviours",
        greets="def run(action):\n    action.message('good morning')\n    return action.sleep(0.1)\n",
        waits=WAITS,
    )
    robot = RobotProcess(domain, tmp_path, QUICK, "--behaviours", str(folder), *_LOUD)
    try:
        async with reached(domain, "David") as link:
            graph = chain("Greets", "Scripted", "Waits", name="round")
            bench = Bench(link=link, endless=graph, quick=graph)
            await link.start(placed(graph, "r1"))
            seen = await shown(bench, graph, lambda each: each.nodes.get("Waits_0") == "RUNNING")
            assert seen.nodes["Greets_0"] == seen.nodes["Scripted_0"] == "FINISHED"
            assert seen.messages["Greets_0"] == ("good morning",)
            await link.stop(graph.name)
            await shown(bench, graph, lambda each: each.state == "STOPPED")
            assert not processes()
    finally:
        assert robot.end() == 0


async def test_a_behaviour_that_ignores_its_stop_is_an_error_as_on_an_engine_and_is_killed(
    domain: int, tmp_path: Path
) -> None:
    folder = write(tmp_path / "behaviours", deaf=DEAF)
    robot = RobotProcess(domain, tmp_path, QUICK, "--behaviours", str(folder), *_LOUD)
    try:
        async with reached(domain, "David") as link:
            graph = chain("Deaf", name="deaf")
            bench = Bench(link=link, endless=graph, quick=graph)
            await link.start(placed(graph, "r1"))
            await shown(bench, graph, lambda each: each.nodes.get("Deaf_0") == "RUNNING")
            until(lambda: len(processes()) == 2)
            await link.stop(graph.name)
            seen = await shown(bench, graph, lambda each: each.state == "ERROR")
            assert seen.nodes["Deaf_0"] == "ERROR"
            with anyio.fail_after(5):
                while processes():  # noqa: ASYNC110 - nobody tells of the end of a process
                    await anyio.sleep(0.05)
            assert (await answer(bench)).graphs  # it lives, and can be asked
    finally:
        assert robot.end() == 0


async def test_its_end_is_the_end_of_its_behaviours(domain: int, tmp_path: Path) -> None:
    folder = write(tmp_path / "behaviours", deaf=DEAF)
    robot = RobotProcess(domain, tmp_path, QUICK, "--behaviours", str(folder), *_LOUD)
    try:
        async with reached(domain, "David") as link:
            graph = chain("Deaf", name="deaf")
            bench = Bench(link=link, endless=graph, quick=graph)
            await link.start(placed(graph, "r1"))
            await shown(bench, graph, lambda each: each.nodes.get("Deaf_0") == "RUNNING")
            until(lambda: len(processes()) == 2)
    finally:
        assert robot.end() == 0
    until(lambda: not processes())
