"""What closes the gate of a led run by itself, so that only a person lets it go on."""

import asyncio

import anyio
import pytest

from action_assistant.runner.execution.conducted_steps import StallWatch
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest
from runner.execution.test_conductor import Lab
from runner.harness import BEN, VirtualLoop, clock_us, ended, virtual


@virtual
async def test_nothing_begins_because_the_journal_came_back() -> None:
    lab = Lab({"*": [{"after_s": 3}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        lab.harness.journal.down = True
        await anyio.sleep(30)
        held = control.open[run].run.held
        assert held is not None
        assert "Nothing could be stored" in held.why
        lab.harness.journal.down = False
        await anyio.sleep(30)
        assert lab.carol.starts == []
        await control.go_on(run, GoOnRequest(time(held.at)), BEN)
        assert await ended(control, run) == "finished"


@pytest.mark.parametrize(("jump_s", "why"), [(3600, "jumped"), (-3600, "jumped"), (1, "")])
@virtual
async def test_a_clock_that_jumps_holds_the_run(jump_s: int, why: str) -> None:
    jump_us = 0
    told: list[str] = []
    watch = StallWatch(lambda: clock_us() + jump_us)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(watch.run, told.append)
        await anyio.sleep(5)
        assert told == []
        jump_us = jump_s * 1_000_000
        await anyio.sleep(5)
        tasks.cancel_scope.cancel()
    assert [why in each for each in told] == ([True] if why else [])


@virtual
async def test_a_process_that_stood_still_holds_the_run_and_lets_nothing_leave() -> None:
    told: list[str] = []
    watch = StallWatch(clock_us)
    loop = asyncio.get_running_loop()
    assert isinstance(loop, VirtualLoop)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(watch.run, told.append)
        await anyio.sleep(1)
        assert not watch.stands_still
        loop._jumping.now += 10
        assert watch.stands_still
        await anyio.sleep(1)
        tasks.cancel_scope.cancel()
    assert len(told) == 1
    assert told[0].startswith("The runner stood still for")
