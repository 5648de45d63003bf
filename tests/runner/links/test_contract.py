"""What every link promises, whatever is behind it."""

from collections.abc import Callable
from contextlib import asynccontextmanager
from typing import Any

import anyio
import pytest

from action_assistant.runner.links.absent import AbsentLink
from action_assistant.runner.links.port import (
    EngineRefused,
    Link,
    NoAnswer,
    NotSent,
    Order,
    Report,
    Transitions,
)
from action_assistant.runner.seen import NodeState, Snapshot
from action_assistant.umrf import codec
from runner.world import engine, sequence, virtual

Make = Callable[[dict[str, Any]], Link]
LINKS: list[Make] = [engine]
ENDLESS = {"*": [{"never": True}]}


def placed(name: str = "patrol", run: str = "r1") -> Order:
    graph = sequence(name)
    return Order(run=run, graph=graph, umrf=codec.write(graph, codec.Stamp("g", "v", run)))


@asynccontextmanager
async def alive(link: Link) -> Any:
    """A link that is kept going."""
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(link.run)
        yield link
        tasks.cancel_scope.cancel()


async def shown(link: Link, name: str = "patrol") -> Snapshot | None:
    return next((each for each in (await link.get()).graphs if each.graph == name), None)


@pytest.mark.parametrize("make", LINKS)
@virtual
async def test_an_answer_shows_the_graph_under_the_identity_it_was_started_with(
    make: Make,
) -> None:
    async with alive(make(ENDLESS)) as link:
        assert await shown(link) is None
        await link.start(placed())
        await anyio.sleep(0.5)
        found = await shown(link)
        assert found is not None
        assert (found.run, found.state, found.source) == ("r1", "RUNNING", "get")
        assert found.nodes["Work_0"] == "RUNNING"
        assert found.active


@pytest.mark.parametrize("make", LINKS)
@virtual
async def test_a_graph_that_has_ended_stays_in_the_answers(make: Make) -> None:
    async with alive(make({"*": [{"after_s": 0.1}]})) as link:
        await link.start(placed())
        await anyio.sleep(2)
        found = await shown(link)
        assert found is not None
        assert (found.state, found.active) == ("FINISHED", False)


@pytest.mark.parametrize("make", LINKS)
@virtual
async def test_stop_may_be_sent_again_and_again_and_for_graphs_that_are_not_there(
    make: Make,
) -> None:
    async with alive(make(ENDLESS)) as link:
        await link.stop("nothing")
        await link.start(placed())
        await anyio.sleep(0.2)
        for _ in range(5):
            await link.stop("patrol")
            await anyio.sleep(0.01)
        await anyio.sleep(2)
        found = await shown(link)
        assert found is not None
        assert (found.state, found.active) == ("STOPPED", False)


@pytest.mark.parametrize("make", LINKS)
@virtual
async def test_the_incarnation_names_one_life_of_one_engine(make: Make) -> None:
    async with alive(make({})) as one, alive(make({})) as other:
        first, again = (await one.get()).incarnation, (await one.get()).incarnation
        assert first == again
        assert first != (await other.get()).incarnation


@pytest.mark.parametrize("make", LINKS)
@virtual
async def test_what_came_before_an_answer_is_heard_before_it(make: Make) -> None:
    heard: list[Report] = []
    async with alive(make({"*": [{"after_s": 0.1}]})) as link:
        with link.listen(heard.append):
            await link.start(placed())
            for _ in range(30):
                await anyio.sleep(0.017)
                found = await shown(link)
                assert found is not None
                states: dict[str, str] = {}
                for report in heard:
                    assert isinstance(report, Transitions)
                    for each in report.changes:
                        if isinstance(each, NodeState):
                            states[each.node] = each.state
                assert {name: states.get(name, "UNINITIALIZED") for name in found.nodes} == (
                    found.nodes
                )
        count = len(heard)
        await link.start(placed("other", "r2"))
        assert len(heard) == count


@virtual
async def test_starting_a_running_graph_again_is_refused_and_stops_it() -> None:
    async with alive(engine(ENDLESS)) as link:
        await link.start(placed())
        await anyio.sleep(0.2)
        with pytest.raises(EngineRefused, match="already active"):
            await link.start(placed(run="r2"))
        await anyio.sleep(1)
        found = await shown(link)
        assert found is not None
        assert found.state == "STOPPED"


@virtual
async def test_an_engine_that_is_switched_off_answers_nothing() -> None:
    link = engine(ENDLESS)
    await link.aclose()
    with pytest.raises(NoAnswer):
        await link.get()


@virtual
async def test_a_link_that_is_not_there_says_so_whatever_it_is_asked() -> None:
    link = AbsentLink("no link")
    with pytest.raises(NotSent, match="no link"):
        await link.stop("patrol")
    with pytest.raises(NotSent, match="no link"):
        await link.start(placed())
    with pytest.raises(NoAnswer, match="no link"):
        await link.get()
