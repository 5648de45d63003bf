"""An engine that indexes while it runs is asked rarely, and not while it reads what was just written (H15)."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import anyio

from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.execution.start_checks import StartSources
from action_assistant.runner.links.port import Answer, Registration
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.start.index_writer import IndexWriter
from runner.harness import ANN, Harness, at_once, clock_us, sequence, until, virtual
from runner.index_folders.folders import wish
from runner.registered_robots import Open, RegisteredRobots, group
from runner.start.test_subgraph_starts import FAST, index_of, outer, sent, start

LEG = sequence("round", 2)


class Counted(Open):
    """A robot that knows when it was asked."""

    def __init__(self) -> None:
        super().__init__(FAST)
        self.asked: list[float] = []

    async def get(self) -> Answer:
        self.asked.append(anyio.current_time())
        return await super().get()

    def between(self, begin: float, end: float) -> int:
        return sum(begin <= at < end for at in self.asked)


@asynccontextmanager
async def runner(folder: Path | None, david: Counted) -> AsyncIterator[ExecutionService]:
    folders = {} if folder is None else {"David": folder}
    async with ExecutionService.opened(
        Harness().journal,
        Robots(reach=RegisteredRobots(David=david), indexing=folders),
        clock_us=clock_us,
        run_in_worker=at_once,
        sources=StartSources(index_folders=folders),
    ) as control:
        await control.register(Registration(name="David"), ANN)
        await until(lambda: bool(control.robots.robot("David").heard_at))
        yield control


@virtual
async def test_an_idle_engine_that_indexes_is_asked_rarely(tmp_path: Path) -> None:
    asked = []
    for folder in (None, tmp_path):
        david = Counted()
        async with runner(folder, david):
            begin = anyio.current_time()
            await anyio.sleep(600)
            asked.append(david.between(begin, begin + 600))
    usual, indexing = asked
    assert indexing <= usual / 5
    assert indexing > 0


@virtual
async def test_no_get_is_sent_while_an_engine_reads_new_files(tmp_path: Path) -> None:
    david = Counted()
    async with runner(tmp_path, david) as control:
        folders = {"David": tmp_path}
        writer = IndexWriter(
            control.robots, folders, clock_us=clock_us, run_in_worker=at_once, on_disk=at_once
        )
        await writer.write("David", wish(LEG), ANN)
        written = anyio.current_time()
        index_of(david, LEG)
        asked = group(outer(), "David", digest="", subgraphs=(sent(LEG),))
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(control.look, asked)
            await anyio.sleep(4.9)
            assert david.between(written, anyio.current_time()) == 0
        assert david.between(written, written + 6) > 0
        began = anyio.current_time()
        await control.start(start(sent(LEG), engine="David"), ANN)
        assert anyio.current_time() - began < 2


@virtual
async def test_a_run_and_its_stop_are_watched_as_ever_while_it_indexes(tmp_path: Path) -> None:
    david = Counted()
    async with runner(tmp_path, david) as control:
        index_of(david, LEG)
        run = (await control.start(start(sent(LEG), engine="David"), ANN)).run
        engine = control.robots.link("David")
        assert engine is not None
        engine.let_index()
        pressed = anyio.current_time()
        await control.stop(run.id, ANN)
        await anyio.sleep(4)
        assert david.between(pressed, pressed + 4) > 1
