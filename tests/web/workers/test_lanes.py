"""Workers are made when they are needed, and end when nothing is left to do."""

import os
import subprocess
import sys
from collections.abc import Iterator
from operator import add
from pathlib import Path
from typing import Any, Final

import anyio
import psutil
import pytest
from anyio import CapacityLimiter

from action_assistant.web.workers import lanes
from action_assistant.web.workers.lanes import Crashed, Lane, opened
from web.workers.worker_looks import slept


@pytest.fixture
def lane() -> Iterator[Lane]:
    made = Lane("try", 1, 30, 0, CapacityLimiter(4), ())
    yield made
    made.close()


async def test_a_pool_at_rest_has_no_worker_and_one_with_work_keeps_its_worker(
    lane: Lane, monkeypatch: pytest.MonkeyPatch
) -> None:
    born = 0
    child = lanes.child

    def counted(*args: Any, **more: Any) -> Any:
        nonlocal born
        born += 1
        return child(*args, **more)

    monkeypatch.setattr(lanes, "child", counted)
    async with opened(lane):
        await anyio.sleep(0.2)
        assert born == 0
        assert await lane(os.getpid) == await lane(os.getpid)
        assert born == 1


async def test_a_worker_without_work_is_ended_after_a_while_and_the_next_request_gets_another(
    lane: Lane, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lanes, "_IDLE_S", 0.1)
    async with opened(lane):
        first = await lane(os.getpid)
        with anyio.fail_after(60):
            while psutil.pid_exists(first):  # noqa: ASYNC110 - nobody tells
                await anyio.sleep(0.01)
        assert await lane(add, 2, 3) == 5
    assert lane.deaths == 0


async def test_a_worker_that_works_for_long_is_not_ended_as_one_without_work(
    lane: Lane, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lanes, "_IDLE_S", 0.05)
    async with opened(lane):
        assert await lane(slept, 0.5) == 0.5


async def test_a_worker_that_dies_before_its_first_work_counts_as_a_death(
    lane: Lane, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its number is written to it when it is made: there the one who makes it finds it gone."""

    def dying(*_: Any, **__: Any) -> Any:
        raise BrokenPipeError(32, "Broken pipe")

    with monkeypatch.context() as killed:
        killed.setattr(lanes, "child", dying)
        with pytest.raises(Crashed, match="has died; nothing came of it"):
            await lane(add, 2, 3)
    assert lane.deaths == 1
    assert await lane(add, 2, 3) == 5


#: Prints what workers find: of the fork server that was prepared, and of the next one when that died.
_SCRIPT: Final = """
import colorsys, gc, os, signal
import anyio
from action_assistant.web.workers import lanes
from web.workers import worker_looks

gc.disable()  # as the servers do until they listen
opened = os.open(colorsys.__file__, os.O_RDONLY)
if {prepared}:
    lanes.start_fork_server(())

async def main():
    lane = lanes.Lane("try", 1, 30, 0, anyio.CapacityLimiter(4), ())
    print(await lane(worker_looks.look, opened, colorsys.__file__))
    os.kill(await lane(worker_looks.parent), signal.SIGKILL)
    lane.close()
    with anyio.fail_after(60):
        while True:
            try:
                print(await lane(worker_looks.look, opened, colorsys.__file__))
                break
            except lanes.Crashed:
                await anyio.sleep(0.05)
    lane.close()

anyio.run(main)
"""


def found_by_workers(*, prepared: bool) -> list[str]:
    """Return what the worker of a new process finds in itself, and then what a worker finds that is
    made after the fork server was killed. `prepared`: the fork server was forked at once."""
    tests = str(Path(__file__).parents[2])
    return subprocess.run(
        [sys.executable, "-c", _SCRIPT.format(prepared=prepared)],
        env={**os.environ, "PYTHONPATH": tests},
        check=True,
        capture_output=True,
        text=True,
        timeout=100,
    ).stdout.splitlines()


ANEW = "imports anew, collects garbage, has nothing open"


def test_a_prepared_fork_server_has_what_was_imported_and_nothing_that_was_open() -> None:
    assert found_by_workers(prepared=True) == [ANEW.replace("anew", "shared"), ANEW]


def test_a_fork_server_that_was_not_prepared_is_a_new_interpreter() -> None:
    assert found_by_workers(prepared=False) == [ANEW, ANEW]


_OWNED: Final = """
import _thread, colorsys, os, socket, time
import anyio
from action_assistant.web.workers import lanes
from web.workers import worker_looks

held = [socket.socketpair() for _ in range(50)]
if {threads}:
    _thread.start_new_thread(time.sleep, (60,))  # `threading` does not know of it
lanes.start_fork_server(())

async def main():
    lane = lanes.Lane("try", 1, 30, 0, anyio.CapacityLimiter(4), ())
    first = await lane(os.getpid)
    if not {threads}:
        await lane(worker_looks.forget)
    print(first == await lane(os.getpid), (await lane(worker_looks.look, 0, "")).split(",")[0])
    lane.close()

anyio.run(main)
"""


@pytest.mark.parametrize("threads", [False, True], ids=["sockets", "and a thread"])
def test_what_a_process_had_open_when_it_forked_the_fork_server_harms_no_worker(
    threads: bool,
) -> None:
    """Objects of it live on in workers: they must close no descriptor that a worker was given. A
    process with threads is not forked at all."""
    done = subprocess.run(
        [sys.executable, "-c", _OWNED.format(threads=threads)],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        check=False,
        text=True,
        timeout=100,
    )
    found = f"True imports {'anew' if threads else 'shared'}\n"
    assert (done.stdout, done.returncode) == (found, 0), done.stderr
