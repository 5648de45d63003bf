"""Runs on several emulated robots are led over real rclpy: outcomes, Stops, and a robot that is frozen.

`TEST_LED_GRAPHS` is how many random graphs are led (default 2), from the seed `TEST_LED_FROM` on.
"""

import os
import random
import sys
import time
from collections.abc import AsyncIterator
from contextlib import ExitStack, asynccontextmanager
from typing import Any

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.errors import Refused
from action_assistant.runner.emulator.messages import EngineTraits
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Registration
from action_assistant.runner.links.ros2.availability import ros2_reach
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import Override, PieceEnded
from ros.robots import robot
from runner.execution.test_conducted_courses import drawn
from runner.execution.test_conductor import shared
from runner.harness import ANN, BEN, MemoryJournal, at_once, order, sequence

GRAPHS = int(os.environ.get("TEST_LED_GRAPHS", "2"))
FROM = int(os.environ.get("TEST_LED_FROM", "1"))
NAMES = {"A": "Ann", "B": "Bob", "C": "Cy"}
ACCEPTED = Override(("two-at-once", "stop-across"), "They are far apart.")
LOSSLESS = EngineTraits(loss=0.0)

pytestmark = pytest.mark.timeout(0 if GRAPHS > 5 else 180)


def clock_us() -> int:
    """Microseconds UTC."""
    return time.time_ns() // 1000


@asynccontextmanager
async def led(
    domains: list[int], scripts: dict[str, Any]
) -> AsyncIterator[tuple[ExecutionService, MemoryJournal]]:
    """Open a runner that may lead three robots, each on a domain of its own."""
    with ExitStack() as robots_:
        for domain, name in zip(domains, NAMES.values(), strict=False):
            script = scripts.get(name, scripts.get("*"))
            robots_.enter_context(robot(domain, script, name=name, quirks=LOSSLESS))
        reach = ros2_reach(clock_us, {"ROS_DOMAIN_ID": str(domains[0])})
        assert not isinstance(reach, str), reach
        robots, journal = Robots(reach=reach), MemoryJournal()
        try:
            async with ExecutionService.opened(
                journal, robots, clock_us=clock_us, run_in_worker=at_once
            ) as control:
                for domain, name in zip(domains, NAMES.values(), strict=False):
                    await control.register(Registration(name=name, domain=domain, led=True), ANN)
                with anyio.fail_after(30):
                    while any(robots.robot(each).state != "answering" for each in NAMES.values()):  # noqa: ASYNC110
                        await anyio.sleep(0.05)
                yield control, journal
        finally:
            with anyio.CancelScope(shield=True):
                await reach.aclose()


async def over(control: ExecutionService, run: str, seconds: float) -> bool:
    """Wait for the end of a run; return whether it came."""
    with anyio.move_on_after(seconds):
        while run in control.open:  # noqa: ASYNC110
            await anyio.sleep(0.02)
    return run not in control.open


def test_outcomes_are_those_of_the_robots(domains: list[int]) -> None:
    counts = {"outcomes": 0, "stopped": 0, "runs": 0}

    async def lead(seed: int) -> None:
        graph, calls = drawn(seed)
        quick = {
            name: [{"after_s": each[0].after_s / 10, "result": each[0].result, "stop_s": 0.05}]
            for name, each in calls.items()
        }
        async with led(domains, {"*": quick}) as (control, journal):
            actors = {each.actor for each in graph.actions}
            request = order(
                graph,
                engine="conducted",
                robots={actor: NAMES[actor] for actor in actors},
                override=ACCEPTED,
            )
            try:
                run = (await control.start(request, ANN)).run.id
            except Refused:
                return
            counts["runs"] += 1
            if not await over(control, run, 8):
                await control.stop(run, BEN)
                counts["stopped"] += 1
                assert await over(control, run, 15), journal.history(run)
            for each in journal.told(run):
                if isinstance(each, PieceEnded) and each.outcome != "on_stopped":
                    assert each.outcome == calls[each.node][0].result, (seed, each)
                    counts["outcomes"] += 1

    for seed in range(FROM, FROM + GRAPHS):
        anyio.run(lead, seed)
    sys.stdout.write(f"\n{counts}\n")
    assert counts["outcomes"]


def test_a_robot_that_never_obeys_delays_no_other_robots_stop(domains: list[int]) -> None:
    scripts = {"Ann": {"*": [{"never": True, "ignores_stop": True}]}, "*": {"*": [{"never": True}]}}

    async def main() -> None:
        async with led(domains, scripts) as (control, journal):
            line = shared(sequence("both", 2), "A", "B")
            first, second = (each.key for each in line.actions)
            entry = next(each for each in line.relations if each.parent == "entry")
            kept = tuple(
                each for each in line.relations if (each.parent, each.child) != (first, second)
            )
            both = msgspec.structs.replace(
                line, relations=(*kept, msgspec.structs.replace(entry, child=second))
            )
            codes = ("two-at-once", "stop-across", "H12", "H14")
            request = order(
                both,
                engine="conducted",
                robots={"A": "Ann", "B": "Bob"},
                override=Override(codes, "A test."),
            )
            run = (await control.start(request, ANN)).run.id
            with anyio.fail_after(15):
                while len(control.open[run].run.active) < 2:  # noqa: ASYNC110
                    await anyio.sleep(0.02)
            began = time.monotonic()
            await control.stop(run, BEN)
            with anyio.fail_after(5):
                while "Work_1" in control.open[run].run.active:  # noqa: ASYNC110
                    await anyio.sleep(0.01)
            sys.stdout.write(f"\nthe other robot rested after {time.monotonic() - began:.2f} s\n")
            await anyio.sleep(7)
            found = control.open[run].run
            assert found.state == "stopping"  # Ann moves on, so nothing is called stopped
            assert any(alarm.code == "stop_unconfirmed" for alarm in found.alarms)
            assert journal.history(run).end is None

    random.seed(0)
    anyio.run(main)
