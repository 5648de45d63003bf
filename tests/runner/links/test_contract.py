"""Every link keeps the promises of the contract."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import anyio
import pytest

from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import Stop
from action_assistant.runner.links.observations import NodeState, Snapshot
from action_assistant.runner.links.port import (
    EngineRefused,
    ForeignCommand,
    Link,
    NoAnswer,
    NotSent,
    Order,
    Report,
    Transitions,
)
from action_assistant.runner.links.unreachable import UnreachableLink
from action_assistant.umrf.files import codec
from action_assistant.umrf.semantics import script_from
from runner.fake_link import FakeLink
from runner.fake_network import FakeNetwork, now_ms
from runner.harness import engine, run_in_virtual_time, sequence, virtual
from runner.links.contract import PROMISES, Bench, Promise, keep

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


#: `endless` goes on, everything else ends soon.
SCRIPT = {
    **{f"endless/Work_{i}": [{"never": True}] for i in range(3)},
    "*": [{"after_s": 0.2}],
}


@asynccontextmanager
async def simulator() -> AsyncIterator[Link]:
    async with alive(engine(SCRIPT)) as link:
        yield link


@asynccontextmanager
async def stand_in() -> AsyncIterator[Link]:
    """A stand-in robot, over messages that take their time and with all of its quirks."""
    network = FakeNetwork()
    network.join(
        EmulatedEngine("David", script=script_from({"behaviours": SCRIPT}), born_ms=now_ms())
    )
    async with network.running(), alive(FakeLink(network, "David")) as link:
        await anyio.sleep(0.1)
        yield link


@pytest.mark.parametrize("behind", [simulator, stand_in])
@pytest.mark.parametrize("promise", PROMISES)
def test_a_link_keeps_what_every_link_promises(promise: Promise, behind: Any) -> None:
    async def main() -> None:
        async with behind() as link:
            bench = Bench(link=link, endless=sequence("endless"), quick=sequence("quick"))
            await keep(promise, bench)

    run_in_virtual_time(main)


@virtual
async def test_commands_of_others_are_reported() -> None:
    heard: list[Report] = []
    network = FakeNetwork()
    async with alive(FakeLink(network, "David")) as link, network.running():
        with link.listen(heard.append):
            await anyio.sleep(0.1)
            network.carry(Stop(graph_name="patrol", targets=("Carol",)), "terminal")
            network.carry(Stop(graph_name="patrol", targets=("David",)), "terminal")
    foreign = [each for each in heard if isinstance(each, ForeignCommand)]
    assert [(each.command, each.graph, each.sender) for each in foreign] == [
        ("stop", "patrol", "terminal")
    ]


@virtual
async def test_the_incarnation_names_one_life_of_one_engine() -> None:
    async with alive(engine({})) as one, alive(engine({})) as other:
        first, again = (await one.get()).incarnation, (await one.get()).incarnation
        assert first == again
        assert first != (await other.get()).incarnation


@virtual
async def test_reports_from_before_an_answer_are_heard_before_it() -> None:
    heard: list[Report] = []
    async with alive(engine({"*": [{"after_s": 0.1}]})) as link:
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
    link = UnreachableLink("no link")
    with pytest.raises(NotSent, match="no link"):
        await link.stop("patrol")
    with pytest.raises(NotSent, match="no link"):
        await link.start(placed())
    with pytest.raises(NoAnswer, match="no link"):
        await link.get()
