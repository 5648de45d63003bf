"""Work in another process never blocks this one, and leaves nothing behind."""

import os
import signal
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import anyio
import anyio.lowlevel
import psutil
import pytest

from action_assistant.errors import BadInput, Conflict, TooLarge, TooMany, Unavailable
from action_assistant.runner.workers import Crashed, Lane, RunnerWorkers
from action_assistant.web.auth import caller
from action_assistant.web.auth.caller import BackgroundTasks, Caller, detach_from_request
from runner.worker_tasks import devour, die, pid, refuse, spin, standing, stumble, write_and_die


@pytest.fixture(scope="module")
def anyio_backend() -> str:
    return "asyncio"


@asynccontextmanager
async def lane() -> AsyncIterator[Lane]:
    async with RunnerWorkers.opened() as workers:
        yield workers.looks


@asynccontextmanager
async def asked_by(person: str, receive: Callable[[], Any] | None = None) -> AsyncIterator[None]:
    caller.set_caller(Caller(person, receive))
    try:
        yield
    finally:
        detach_from_request()


pytestmark = pytest.mark.anyio


async def test_work_is_done_elsewhere_and_its_outcome_comes_back() -> None:
    async with lane() as run_in_worker:
        assert await run_in_worker(max, 3, 4) == 4
        assert await run_in_worker(pid) == await run_in_worker(pid) != os.getpid()


async def test_a_worker_gives_way_and_is_the_first_to_go() -> None:
    async with lane() as run_in_worker:
        nice, score, ros = await run_in_worker(standing)
        assert nice >= min(19, os.nice(0) + 1)
        assert score == 1000
        assert ros == []


async def test_errors_come_back_as_they_are() -> None:
    async with lane() as run_in_worker:
        with pytest.raises(Conflict, match="It cannot be") as told:
            await run_in_worker(refuse)
        assert told.value.where == {"path": "/umrf"}
        with pytest.raises(RuntimeError, match="cannot travel"):
            await run_in_worker(stumble)
        assert await run_in_worker(max, 1, 2) == 2


async def test_a_worker_that_dies_is_told_and_the_next_one_works() -> None:
    async with lane() as run_in_worker:
        for _ in range(3):
            with pytest.raises(Crashed, match="died"):
                await run_in_worker(die)
            assert await run_in_worker(max, 1, 2) == 2


async def test_a_worker_that_was_killed_while_it_waited_is_replaced_before_anybody_notices() -> (
    None
):
    async with lane() as run_in_worker:
        for _ in range(10):
            killed = await run_in_worker(pid)
            os.kill(killed, signal.SIGKILL)
            assert await run_in_worker(pid) != killed


async def test_work_that_kills_its_worker_is_done_once(tmp_path: Path) -> None:
    async with lane() as run_in_worker:
        with pytest.raises(Crashed, match="died"):
            await run_in_worker(write_and_die, str(tmp_path / "lines"))
        assert (tmp_path / "lines").read_text() == "once\n"


async def test_memory_is_bounded() -> None:
    async with lane() as run_in_worker:
        with pytest.raises(TooLarge):
            await run_in_worker(devour, 4_000)
        assert await run_in_worker(max, 1, 2) == 2


async def test_work_that_takes_too_long_is_cancelled() -> None:
    async with lane() as run_in_worker:
        await run_in_worker(pid)
        run_in_worker._patience = 0.2
        with pytest.raises(Unavailable, match="given up"):
            await run_in_worker(spin, 60.0)
        run_in_worker._patience = 60.0
        assert await run_in_worker(max, 1, 2) == 2


async def test_a_frozen_worker_takes_nobody_along() -> None:
    async with lane() as run_in_worker:
        worker = await run_in_worker(pid)
        os.kill(worker, signal.SIGSTOP)
        run_in_worker._patience = 0.3
        with pytest.raises(Unavailable):
            await run_in_worker(pid)
        run_in_worker._patience = 60.0
        assert await run_in_worker(pid) != worker


async def test_work_that_nobody_waits_for_is_cancelled() -> None:
    async with lane() as run_in_worker:
        worker = psutil.Process(await run_in_worker(pid))
        with anyio.move_on_after(0.2):
            await run_in_worker(spin, 60.0)
        worker.wait(10)
        gone = anyio.Event()

        async def receive() -> dict[str, str]:
            await gone.wait()
            return {"type": "http.disconnect"}

        async with asked_by("ann", receive):
            worker = psutil.Process(await run_in_worker(pid))
            async with anyio.create_task_group() as tasks:

                async def leave() -> None:
                    await anyio.sleep(0.2)
                    gone.set()

                tasks.start_soon(leave)
                with pytest.raises(Unavailable, match="gone"):
                    await run_in_worker(spin, 60.0)
        worker.wait(10)


@pytest.mark.parametrize("ending", [{"type": "http.disconnect"}, BadInput("It ended early.")])
async def test_a_background_task_outlives_the_request_in_which_it_began(
    ending: dict[str, str] | BadInput,
) -> None:
    async def receive() -> dict[str, str]:
        if isinstance(ending, BadInput):
            raise ending
        return ending

    async with lane() as run_in_worker, anyio.create_task_group() as tasks:
        answers: list[int] = []
        answered = anyio.Event()

        async def work() -> None:
            answers.append(await run_in_worker(max, 3, 4))
            answered.set()

        async with asked_by("ann", receive):
            BackgroundTasks(tasks).start_soon(work)
            with pytest.raises(Unavailable, match="gone"):
                await run_in_worker(spin, 60.0)
        with anyio.fail_after(10):
            await answered.wait()
        assert answers == [4]


async def test_many_requests_of_one_person_do_not_delay_others() -> None:
    async with lane() as run_in_worker:
        done: list[str] = []

        async def ask(person: str, seconds: float) -> None:
            async with asked_by(person):
                await run_in_worker(spin, seconds)
                done.append(person)

        async with anyio.create_task_group() as tasks:
            for _ in range(8):
                tasks.start_soon(ask, "greedy", 0.3)
            await anyio.sleep(0.1)
            await ask("modest", 0.0)
            assert done.count("greedy") < 8
            assert "modest" in done


async def test_waiting_requests_of_one_person_are_bounded() -> None:
    async with lane() as run_in_worker:
        refused = 0

        async def ask() -> None:
            nonlocal refused
            async with asked_by("greedy"):
                try:
                    await run_in_worker(spin, 0.001)
                except TooMany:
                    refused += 1

        async with anyio.create_task_group() as tasks:
            for _ in range(100):
                tasks.start_soon(ask)
        assert 0 < refused < 100


async def test_the_loop_goes_on_meanwhile() -> None:
    """Beside threads that hold the interpreter lock it would not."""
    async with lane() as run_in_worker:
        turns = 0
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(run_in_worker, spin, 1.0)
            end = anyio.current_time() + 1.0
            while anyio.current_time() < end:
                await anyio.lowlevel.checkpoint()
                turns += 1
        assert turns > 1_000


async def test_workers_end_with_whoever_has_them() -> None:
    async with lane() as run_in_worker:
        worker = psutil.Process(await run_in_worker(pid))
    worker.wait(10)
