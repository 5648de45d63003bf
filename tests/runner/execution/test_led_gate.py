"""What closes the gate of a led run by itself, so that only a person lets it go on."""

import asyncio

import anyio
import pytest

from action_assistant.runner.execution.conducted_steps import RestNews, StallWatch
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest
from runner.execution.test_conductor import Lab, forked
from runner.harness import BEN, VirtualLoop, clock_us, ended, engine, until, virtual


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


@virtual
async def test_a_fault_at_one_robot_keeps_no_stop_from_the_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lab = Lab({"*": [{"after_s": 60, "stop_s": 1}]})
    show = RestNews.show

    def failing(news: RestNews, piece: Run, *, asks: bool = False) -> None:
        if piece.engine == "David" and piece.state == "stopping":
            monkeypatch.undo()
            raise RuntimeError("a fault of the runner")
        show(news, piece, asks=asks)

    async with lab.runner() as control:
        run = await forked(lab, control)
        await until(lambda: bool(lab.david.starts and lab.carol.starts))
        await anyio.sleep(1)
        monkeypatch.setattr(RestNews, "show", failing)
        with pytest.raises(RuntimeError):
            await control.stop(run, BEN)
        assert control.open[run].run.state == "stopping"
        assert await ended(control, run) == "stopped"
        assert lab.david.stops
        assert lab.carol.stops
        for robot in (lab.david, lab.carol):
            assert not await robot.moving(robot.starts[0].graph.name)


@pytest.mark.parametrize("is_stored", [True, False])
@pytest.mark.parametrize("names_piece", [True, False])
@virtual
async def test_a_piece_that_moves_after_the_end_of_its_run_can_be_stopped(
    is_stored: bool, names_piece: bool
) -> None:
    lab = Lab({"*": [{"after_s": 10, "stop_s": 1}]})
    async with lab.runner() as control:
        run = await lab.led_run(control)
        piece = f"{run}.1"
        await anyio.sleep(15)
        assert lab.carol.starts
        lab.harness.journal.down = not is_stored
        await until(lambda: run not in control.open or control.open[run].run.end == "finished")
        await anyio.sleep(5)
        assert (run in control.open) is not is_stored
        await lab.david.engine.start(lab.david.starts[0])
        await until(lambda: piece in control.open and control.open[piece].run.end is None)
        assert await control.stop(piece if names_piece else run, BEN) == [piece]
        await until(lambda: piece not in control.open or control.open[piece].run.end is not None)
        assert lab.david.stops
        assert not await lab.david.moving(lab.david.starts[0].graph.name)
        lab.harness.journal.down = False


@virtual
async def test_each_press_of_stop_reaches_a_robot_that_holds_its_piece_no_more_once() -> None:
    lab = Lab({"*": [{"after_s": 60}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        lab.david.engine = engine({"*": [{"after_s": 60}]})
        await until(lambda: bool(control.open[f"{run}.1"].run.lost))
        for presses in (1, 2):
            await control.stop(run, BEN, f"press {presses}")
            await anyio.sleep(20)
            assert len(lab.david.stops) == presses
        assert control.open[run].run.end is None
