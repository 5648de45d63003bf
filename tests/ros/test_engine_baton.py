"""A baton changes hands in the middle of a run that two real engines are led through: what begins is what
the code of the actions wrote down.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
`TEST_BATON_DOMAIN` is the first domain, `TEST_BATON_TURNS` how often each kind of change is tried
(default 1). Figures are printed with `-s`.
"""

import itertools
import os
import random
import sys
import time
from pathlib import Path

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.views import time as moment
from action_assistant.runner.start.admission import GoOnRequest
from ros.led_engines import LATE_S, Engines, Line, as_led, over, relay
from runner.harness import until
from runner.start.test_rights_registry import BATON, BEN, CARL, OLGA, author
from support.real_engine import needs_engine

DOMAIN = int(os.environ.get("TEST_BATON_DOMAIN", "186"))
TURNS = int(os.environ.get("TEST_BATON_TURNS", "1"))
ACTIONS = 8
ROBOTS = ("Ann", "Bob")

pytestmark = [needs_engine, pytest.mark.timeout(0)]


async def begin(control: ExecutionService, engines: Engines, name: str) -> tuple[str, int]:
    """Let Carl take both batons and start a run, and wait until two of its actions have begun."""
    for robot in ROBOTS:
        await control.rights.set_rules(robot, BATON, OLGA)
        await control.rights.take(robot, CARL, author(CARL), "I lead now.")
    before = len(begins(engines))
    graph = relay(name, [(0.4, "on_true")] * ACTIONS)
    run = (await control.start(as_led(graph), author(CARL), CARL)).run.id
    await until(lambda: len(begins(engines)) >= before + 2, 20)
    await anyio.sleep(random.Random(name).uniform(0, 0.4))
    return run, before


def begins(engines: Engines) -> list[Line]:
    return [each for each in engines.lines() if each.what == "begin"]


def test_nothing_begins_after_a_baton_went_until_its_new_holder_lets_it_go_on(
    tmp_path: Path,
) -> None:
    engines = Engines(tmp_path, DOMAIN)
    late: list[float] = []

    async def main() -> None:
        async with engines.led() as (control, _):
            for turn in range(TURNS):
                run, before = await begin(control, engines, f"taken{turn}")
                await control.rights.take("Bob", BEN, author(BEN), "Carl is away.")
                went = time.time()
                await anyio.sleep(2.5)
                found = begins(engines)
                late.extend(each.second - went for each in found if each.second > went)
                held = control.open[run].run.held
                assert held is not None
                assert "Carl may not start on Bob: Ben has its baton" in held.why
                assert control.open[run].run.desired == "running"
                ended = [each for each in engines.lines() if each.what == "end"]
                assert len(ended) == len(found)  # what had begun was not stopped by it
                await control.rights.take("Ann", BEN, author(BEN), "Carl is away.")
                held = control.open[run].run.held  # for one more reason
                assert held is not None
                assert "Carl may not start on Ann: Ben has its baton" in held.why
                request = GoOnRequest(since=moment(held.at))
                await control.go_on(run, request, author(BEN), BEN)
                assert await over(control, run, 30) == "finished"
                assert len(begins(engines)) == before + ACTIONS  # each once

    anyio.run(main)
    sys.stdout.write(f"\nbegan after the baton went, s: {late}\n")
    assert all(each < LATE_S for each in late)  # their messages had left before


def test_a_run_that_is_handed_over_whole_goes_on(tmp_path: Path) -> None:
    engines = Engines(tmp_path, DOMAIN)

    async def main() -> None:
        async with engines.led() as (control, _):
            for turn in range(TURNS):
                run, before = await begin(control, engines, f"handed{turn}")
                with control.rights.here(BEN):
                    await control.hand_over(run, "ben", author(CARL), CARL)
                assert await over(control, run, 30) == "finished"
                found = begins(engines)[before:]
                assert len(found) == ACTIONS
                gaps = [b.second - a.second for a, b in itertools.pairwise(found)]
                sys.stdout.write(f"\nlongest time between two begins: {max(gaps):.2f} s\n")

    anyio.run(main)


def test_anybody_stops_a_run_that_waits_for_a_baton(tmp_path: Path) -> None:
    engines = Engines(tmp_path, DOMAIN)

    async def main() -> None:
        async with engines.led() as (control, _):
            run, _ = await begin(control, engines, "stopped")
            await control.rights.drop("Bob", CARL, author(CARL))
            await control.rights.lock("Ann", BEN, author(BEN), "It leaks oil.")
            assert await control.stop(run, OLGA) == [run]
            assert await over(control, run, 30) == "stopped"
            ended = time.time()
            await anyio.sleep(1)
            assert [each for each in engines.lines() if each.second > ended] == []

    anyio.run(main)
