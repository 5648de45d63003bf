"""Graphs inside that a robot lacks are written into its index folder, after that was recorded; then
the start is accepted."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from action_assistant.errors import Conflict, NotFound, Unavailable
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.execution.start_checks import StartSources
from action_assistant.runner.links.port import Registration
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.robot_events import IndexWriteAsked, IndexWritten
from action_assistant.runner.start.index_writer import IndexWriter
from action_assistant.runner.start.preflight import Item
from action_assistant.umrf.digest import digest
from action_assistant.umrf.model import Graph
from runner.harness import ANN, Harness, at_once, clock_us, ended, sequence, until, virtual
from runner.index_folders.folders import add, held, wish
from runner.registered_robots import Open, RegisteredRobots, group
from runner.start.test_subgraph_starts import FAST, index_of, outer, sent, start

LEG = sequence("round", 2)


@asynccontextmanager
async def runner(
    harness: Harness, folder: Path, **robots: Open
) -> AsyncIterator[tuple[ExecutionService, IndexWriter]]:
    """A runner that knows these robots, and may write for David."""
    folders = {"David": folder}
    async with ExecutionService.opened(
        harness.journal,
        Robots(reach=RegisteredRobots(**robots)),
        clock_us=clock_us,
        run_in_worker=at_once,
        sources=StartSources(index_folders=folders),
    ) as control:
        for name in robots:
            await control.register(Registration(name=name), ANN)
        await until(lambda: all(control.robots.robot(name).heard_at for name in robots))
        yield (
            control,
            IndexWriter(
                control.robots,
                folders,
                clock_us=clock_us,
                run_in_worker=at_once,
                on_disk=at_once,
            ),
        )


async def item_of(control: ExecutionService, graph: Graph = LEG, robot: str = "David") -> Item:
    asked = group(outer(), robot, digest="", subgraphs=(sent(graph),))
    (look,) = await control.look(asked)
    (item,) = [each for each in look.items if each.code == "subgraphs"]
    return item


@virtual
async def test_the_look_says_what_can_be_written_and_afterwards_the_start_goes(
    tmp_path: Path,
) -> None:
    david, harness = Open(FAST), Harness()
    async with runner(harness, tmp_path, David=david) as (control, writer):
        item = await item_of(control)
        assert (item.verdict, item.folder and item.folder.path) == ("blocked", str(tmp_path))
        assert item.folder is not None
        assert [(each.graph, each.replaces) for each in item.folder.writable] == [("round", "")]
        answer = await writer.write("David", wish(LEG), ANN)
        assert [each.path for each in answer.written] == ["round.umrf.graph.json"]
        assert (answer.folder, answer.replaced, answer.there) == (str(tmp_path), (), ())
        waiting = (await item_of(control)).folder
        assert waiting is not None
        assert (waiting.writable, waiting.waiting) == ((), ("round",))
        index_of(david, LEG)
        passed = await item_of(control)
        assert (passed.verdict, passed.folder) == ("passed", None)
        again = await writer.write("David", wish(LEG), ANN)
        assert (again.written, again.there) == ((), ("round",))
        run = (await control.start(start(sent(LEG), engine="David"), ANN)).run
        assert await ended(control, run.id) == "finished"


@virtual
async def test_a_write_is_recorded_with_its_author_before_and_after(tmp_path: Path) -> None:
    harness = Harness()
    add(tmp_path, "mine.graph.json", sequence("round", 3))
    async with runner(harness, tmp_path, David=Open()) as (control, writer):
        answer = await writer.write("David", wish(LEG, sequence("leg"), replace=["round"]), ANN)
        assert [each.path for each in answer.replaced] == ["mine.graph.json"]
        await until(lambda: harness.journal.streams["robot/David"][-1].kind.endswith("written.v1"))
        told = [event for _, event in await control.robots.robot_log.newest("David", 9)]
        asked, done = told[-2:]
        assert isinstance(asked, IndexWriteAsked)
        assert isinstance(done, IndexWritten)
        assert (asked.author, done.author, asked.folder) == (ANN, ANN, str(tmp_path))
        assert [(each.name, each.digest, each.replaces) for each in asked.graphs] == [
            ("round", digest(LEG), "mine.graph.json"),
            ("leg", digest(sequence("leg")), ""),
        ]
        assert [(each.graph, each.path, each.kept != "") for each in done.files] == [
            ("round", "mine.graph.json", True),
            ("leg", "leg.umrf.graph.json", False),
        ]
        before = len(told)
        await writer.write("David", wish(LEG), ANN)
        assert len(await control.robots.robot_log.newest("David", 99)) == before


@virtual
async def test_a_write_that_cannot_be_recorded_does_not_happen(tmp_path: Path) -> None:
    harness = Harness()
    async with runner(harness, tmp_path, David=Open()) as (_, writer):
        harness.journal.down = True
        with pytest.raises(Unavailable, match=r"journal .* Nothing was written"):
            await writer.write("David", wish(LEG), ANN)
        assert held(tmp_path) == {}
        harness.journal.down = False


@virtual
async def test_hindrances_are_shown_before_a_write(tmp_path: Path) -> None:
    david = Open()
    async with runner(Harness(), tmp_path, David=david, Carol=Open()) as (control, writer):
        assert (await item_of(control, robot="Carol")).folder is None
        with pytest.raises(Conflict, match="--index-folder"):
            await writer.write("Carol", wish(LEG), ANN)
        with pytest.raises(NotFound):
            await writer.write("Eve", wish(LEG), ANN)
        index_of(david, sequence("round", 3))
        elsewhere = (await item_of(control)).folder
        assert elsewhere is not None
        assert "looks elsewhere" in elsewhere.hindered["round"]
        mine = add(tmp_path, "a/b/mine.graph.json", sequence("round", 3))
        differs = (await item_of(control)).folder
        assert differs is not None
        assert [each.replaces for each in differs.writable] == ["a/b/mine.graph.json"]
        add(tmp_path, "other.graph.json", sequence("round", 1))
        several = (await item_of(control)).folder
        assert several is not None
        assert (several.writable, list(several.hindered)) == ((), ["round"])
        assert mine.read_bytes() == held(tmp_path)["a/b/mine.graph.json"]


@virtual
async def test_a_write_that_fails_half_way_is_reported_and_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another program writes a file of the same name between check and write."""
    harness = Harness()
    mine = add(tmp_path, "z.graph.json", sequence("round", 3))

    async def meddled(work: Callable[..., Any], *args: Any) -> Any:
        mine.write_text("{}")
        return work(*args)

    async with runner(harness, tmp_path, David=Open()) as (control, writer):
        monkeypatch.setattr(writer, "_on_disk", meddled)
        with pytest.raises(
            Unavailable, match=r"z\.graph\.json was changed .* Written before .*leg"
        ):
            await writer.write("David", wish(sequence("leg"), LEG, replace=["round"]), ANN)
        await until(lambda: harness.journal.streams["robot/David"][-1].kind.endswith("written.v1"))
        ((_, done),) = await control.robots.robot_log.newest("David", 1)
        assert isinstance(done, IndexWritten)
        assert ([each.graph for each in done.files], "changed" in done.why) == (["leg"], True)
        assert mine.read_text() == "{}"
