"""Graphs of the server that stand inside of others: what is known of them is what they are now."""

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.editor.app import open_services
from action_assistant.editor.catalogue.graph_checks import GraphChecks
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.catalogue.versions import VersionView
from action_assistant.editor.history.drafts.drafts import NewDraft
from action_assistant.editor.interchange import document_edits
from action_assistant.editor.log.graph_events import graph_stream
from action_assistant.editor.services import EditorServices
from action_assistant.errors import NotFound
from action_assistant.settings import EditorSettings
from action_assistant.umrf.digest import digest, tree_digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.workers.lanes import Crashed
from support.doses import examples

NAMES = ["Alpha", "Beta", "Gamma", "Delta"]


def file_of(name: str, *actions: str, exits: bool = True) -> bytes:
    """Actions that stand beside each other."""
    ends = [{"name": each, "instance_id": 0} for each in actions]
    file = {
        "graph_name": name,
        "graph_entry": ends,
        "graph_exit": ends if exits else [],
        "actions": [{"name": each, "type": "sync", "instance_id": 0} for each in actions],
    }
    return json.dumps(file).encode()


@asynccontextmanager
async def editor(folder: Path) -> AsyncIterator[EditorServices]:
    """The services of an editor without its examples."""
    settings = EditorSettings(data=folder, database=f"sqlite:///{folder / 'editor.db'}")
    async with open_services(settings) as services:
        for view in await services.catalogue.all():
            await services.catalogue.delete(view.id, "ada")
        yield services


async def made(services: EditorServices, *file: Any, **more: Any) -> str:
    view, _ = await services.catalogue.bring(file_of(*file, **more), "ada")
    return view.id


async def rewritten(services: EditorServices, graph: str, graph_file: bytes) -> None:
    """Draw something else in the graph, as a person would."""
    async with services.rooms.enter(graph_stream(graph)) as room:
        state = (await room.now()).state
        then = document_edits.first(codec.read(graph_file).graph)
        await room.submit(document_edits.restoring(state, then), "ada")


async def codes(services: EditorServices, graph: str) -> list[str]:
    sight = await services.graph_reader.now(graph)
    found = json.loads(await services.graph_checks.problems(sight))
    return sorted(each["code"] for each in found)


async def told(services: EditorServices, graph: str) -> tuple[int, int]:
    """Errors and warnings, as the list counts them."""
    views = {view.id: view for view in await services.catalogue.all()}
    counts = views[graph].problems
    assert counts is not None
    return counts.error, counts.warning


async def test_problems_of_a_graph_follow_edits_of_its_sub_graph(tmp_path: Path) -> None:
    async with editor(tmp_path) as services:
        outer = await made(services, "Outer", "Inner")
        assert (await codes(services, outer), await told(services, outer)) == ([], (0, 0))
        inner = await made(services, "Inner", "Step", exits=False)
        assert (await codes(services, outer), await told(services, outer)) == (["H8"], (1, 0))
        await rewritten(services, inner, file_of("Inner", "Step"))
        assert (await codes(services, outer), await told(services, outer)) == ([], (0, 0))
        await rewritten(services, inner, file_of("Inner", "Outer"))
        assert (await codes(services, outer), await told(services, outer)) == (
            ["recursion"],
            (1, 0),
        )
        await services.catalogue.describe(inner, "ada", name="Else", description=None)
        assert (await codes(services, outer), await told(services, outer)) == ([], (0, 0))
        await services.catalogue.describe(inner, "ada", name="Inner", description=None)
        assert await codes(services, outer) == ["recursion"]
        await services.catalogue.delete(inner, "ada")
        assert (await codes(services, outer), await told(services, outer)) == ([], (0, 0))
        await services.catalogue.recover(inner, "ada")
        assert (await codes(services, outer), await told(services, outer)) == (
            ["recursion"],
            (1, 0),
        )


async def test_the_oldest_of_several_graphs_of_one_name_counts_with_a_warning(
    tmp_path: Path,
) -> None:
    async with editor(tmp_path) as services:
        oldest = await made(services, "Inner", "Step", exits=False)
        await made(services, "Inner", "Step")
        outer = await made(services, "Outer", "Inner")
        assert await codes(services, outer) == ["H8", "subgraph-ambiguous"]
        await services.catalogue.delete(oldest, "ada")
        assert await codes(services, outer) == []
        await services.catalogue.recover(oldest, "ada")
        assert await codes(services, outer) == ["H8", "subgraph-ambiguous"]


async def test_drafts_and_actions_of_the_library_are_no_sub_graphs(tmp_path: Path) -> None:
    async with editor(tmp_path) as services:
        inner = await made(services, "Inner", "Step", exits=False)
        outer = await made(services, "Outer", "Inner")
        draft = await services.drafts.make(inner, "ada", NewDraft(name="try"))
        await services.catalogue.delete(inner, "ada")
        assert draft.id
        assert await codes(services, outer) == []
        await services.catalogue.recover(inner, "ada")
        assert await codes(services, outer) == ["H8"]
        action, _ = await services.library_edits.create(b'{"name": "Inner"}', "ada")
        assert await codes(services, outer) == ["subgraph-hidden"]
        await services.catalogue.delete(action.id, "ada")
        assert await codes(services, outer) == ["H8"]


async def test_an_action_with_the_name_of_its_own_graph_is_an_action(tmp_path: Path) -> None:
    async with editor(tmp_path) as services:
        dock = await made(services, "Dock", "Dock")
        assert (await codes(services, dock), await told(services, dock)) == ([], (0, 0))
        await services.library_edits.create(b'{"name": "Dock"}', "ada")
        assert await codes(services, dock) == []


async def test_an_edit_costs_what_it_touches(tmp_path: Path) -> None:
    async with editor(tmp_path) as services:
        inner = await made(services, "Inner", "Step")
        outer = await made(services, "Outer", "Inner")
        for number in range(20):
            await made(services, f"Other{number}", "Step")
        await services.catalogue.all()
        asked: list[str] = []
        ask = services.graph_reader._run_in_worker

        async def counting(work: Callable[..., Any], /, *values: Any) -> Any:
            asked.append(values[0].graph)
            return await ask(work, *values)

        services.graph_reader._run_in_worker = counting
        async with services.rooms.enter(graph_stream(inner)):
            await rewritten(services, inner, file_of("Inner", "Step", "Stop"))
            await codes(services, outer)
            await services.catalogue.all()
            await services.catalogue.all()
        assert set(asked) == {inner, outer}
        assert len(asked) <= 6


async def test_there_is_a_bound_on_what_is_looked_at_inside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from action_assistant.editor.catalogue import graph_checks

    monkeypatch.setattr(graph_checks, "_INSIDE", 2)
    async with editor(tmp_path) as services:
        for name, inside in zip(NAMES, [*NAMES[1:], "Step"], strict=True):
            await made(services, name, inside)
        outer = await made(services, "Outer", "Alpha")
        assert await codes(services, outer) == ["not-tried"]


def pinned(version: VersionView) -> Any:
    """Return the parts of a version that never change, proven by its own digests."""
    inside = version.subgraphs or ()
    for each in inside:
        assert digest(codec.read(bytes(each.umrf)).graph) == each.digest
    pairs = [(each.name, each.digest) for each in inside]
    assert version.tree_digest == tree_digest(version.digest, pairs)
    return pairs, version.digest, bytes(version.umrf or b"")


class Steps:
    """Random edits, renames, deletions and recoveries of a few graphs."""

    def __init__(self, services: EditorServices, seed: int) -> None:
        self.services = services
        self.random = Random(seed)
        self.graphs: list[str] = []
        self.deleted: list[str] = []
        self.published: list[VersionView] = []

    def file(self) -> bytes:
        uses = self.random.sample([*NAMES, "Step"], self.random.randint(1, 3))
        return file_of(self.random.choice(NAMES), *uses, exits=self.random.random() < 0.7)

    async def step(self) -> None:
        catalogue, random = self.services.catalogue, self.random
        ways: list[Callable[[], Awaitable[Any]]] = [self.make]
        if self.graphs:
            graph = random.choice(self.graphs)
            ways += [
                lambda: rewritten(self.services, graph, self.file()),
                lambda: rewritten(self.services, graph, self.file()),
                lambda: catalogue.describe(
                    graph, "ada", name=random.choice(NAMES), description=None
                ),
                lambda: self.delete(graph),
                lambda: self.publish(graph),
                lambda: self.services.graph_checks.names.refresh(),
                catalogue.all,
            ]
        if self.deleted:
            ways.append(self.recover)
        with suppress(NotFound):  # somebody else has deleted it meanwhile
            await random.choice(ways)()

    async def make(self) -> None:
        view, _ = await self.services.catalogue.bring(self.file(), "ada")
        self.graphs.append(view.id)

    async def delete(self, graph: str) -> None:
        if graph not in self.graphs:
            return
        self.graphs.remove(graph)
        self.deleted.append(graph)
        await self.services.catalogue.delete(graph, "ada")

    async def publish(self, graph: str) -> None:
        version, _ = await self.services.versions.publish(graph, PersonRef("ada", "Ada"))
        self.published.append(version)

    async def recover(self) -> None:
        graph = self.deleted.pop()
        self.graphs.append(graph)
        await self.services.catalogue.recover(graph, "ada")

    async def compare(self) -> None:
        """Check that cached results equal those of a service that has cached nothing."""
        journal, rooms = self.services.journal, self.services.rooms
        fresh = GraphChecks(journal, rooms, GraphReader(journal, rooms))
        await fresh.names.refresh()
        await self.services.graph_checks.names.refresh()
        for graph in self.graphs:
            sight = await self.services.graph_reader.now(graph)
            mine = await self.services.graph_checks.problems(sight)
            assert msgspec.json.decode(mine) == msgspec.json.decode(await fresh.problems(sight))
            now = await self.services.graph_checks.summary(graph, sight.seq)
            assert now == await fresh.summary(graph, sight.seq)
        for version in self.published:
            assert pinned(await self.services.versions.get(version.id)) == pinned(version)


async def raced(seed: int) -> None:
    with TemporaryDirectory() as folder:
        async with editor(Path(folder)) as services:
            steps = Steps(services, seed)
            for _ in range(3):
                await steps.make()
            for _ in range(4):
                several = [steps.step() for _ in range(steps.random.randint(1, 3))]
                watching = services.catalogue.all()
                await asyncio.gather(watching, *several)
                await steps.compare()


@settings(max_examples=examples(20), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.integers(0, 10_000))
def test_cached_checks_are_right_after_any_steps(seed: int) -> None:
    asyncio.run(raced(seed))


async def test_a_name_that_cannot_be_read_now_is_read_the_next_time(tmp_path: Path) -> None:
    async with editor(tmp_path) as services:
        outer = await made(services, "Outer", "Inner")
        inner = await made(services, "Inner", "Step", exits=False)
        fresh = GraphChecks(services.journal, services.rooms, services.graph_reader)
        ask, dies = services.graph_reader._run_in_worker, [inner]

        async def asked(work: Callable[..., Any], /, *values: Any) -> Any:
            if dies and getattr(values[0], "graph", "") == inner:
                dies.pop()
                raise Crashed("It has died.")
            return await ask(work, *values)

        services.graph_reader._run_in_worker = asked
        sight = await services.graph_reader.now(outer)
        found = [json.loads(await fresh.problems(sight)) for _ in range(2)]
        assert [[each["code"] for each in problems] for problems in found] == [[], ["H8"]]


async def test_a_cancelled_refresh_of_names_takes_nothing_from_others(tmp_path: Path) -> None:
    async with editor(tmp_path) as services:
        outer = await made(services, "Outer", "Inner")
        await made(services, "Inner", "Step", exits=False)
        names = services.graph_checks.names
        leaving = asyncio.create_task(names.refresh())
        await asyncio.sleep(0)
        leaving.cancel()
        assert await codes(services, outer) == ["H8"]


def test_names_are_those_of_actions_that_are_there() -> None:
    from action_assistant.editor.documents.contents import uses_of

    graph: Graph = codec.read(file_of("g", "B", "A")).graph
    assert uses_of(graph) == ("A", "B")
