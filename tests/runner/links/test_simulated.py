"""A simulated engine in a process of its own keeps what every link promises, and harms nobody."""

import os
import signal
import time
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any

import anyio
import msgspec
import psutil
import pytest

from action_assistant.runner.links.port import (
    EngineChanged,
    EngineRefused,
    GraphOutline,
    NoAnswer,
    NotSent,
    Report,
    Transitions,
)
from action_assistant.runner.links.simulated import SimulatedLink, Simulators
from action_assistant.umrf.facts import SIMULATED
from runner.harness import carousel, sequence
from runner.links.contract import PROMISES, Bench, Promise, has_ended, keep, moves, placed, shown
from runner.links.test_contract import SCRIPT

pytestmark = pytest.mark.anyio


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


@asynccontextmanager
async def simulated(script: dict[str, Any] = SCRIPT) -> AsyncIterator[SimulatedLink]:
    text = msgspec.json.encode({"behaviours": script}).decode()
    link = Simulators()(SIMULATED, text, lambda: time.time_ns() // 1000)
    try:
        yield link
    finally:
        await link.aclose()


def process_of(link: SimulatedLink) -> psutil.Process:
    return psutil.Process(link._process.pid)


@pytest.mark.parametrize("promise", PROMISES)
async def test_a_simulated_engine_keeps_the_promises_of_every_link(promise: Promise) -> None:
    async with simulated() as link:
        await keep(promise, Bench(link=link, endless=sequence("endless"), quick=sequence("quick")))


async def test_a_simulated_engine_reads_the_graph_from_the_text_that_is_sent() -> None:
    async with simulated() as link:
        order = placed(sequence("quick"), "r1")
        outline = GraphOutline("quick", {})
        await link.start(msgspec.structs.replace(order, graph=outline))
        bench = Bench(link=link, endless=sequence("endless"), quick=sequence("quick"))
        assert (await shown(bench, bench.quick, has_ended("FINISHED"))).run == "r1"


async def test_a_refusal_of_the_engine_is_told() -> None:
    async with simulated() as link:
        await link.start(placed(sequence("endless"), "r1"))
        with pytest.raises(EngineRefused, match="already active"):
            await link.start(placed(sequence("endless"), "r2"))


async def test_the_end_of_its_process_is_the_end_of_the_engine_with_the_reason(
    caplog: pytest.LogCaptureFixture,
) -> None:
    heard: list[Report] = []
    async with simulated() as link:
        with link.listen(heard.append):
            await link.start(placed(sequence("endless"), "r1"))
            process_of(link).send_signal(signal.SIGKILL)
            with anyio.fail_after(10):
                while not any(isinstance(each, EngineChanged) for each in heard):  # noqa: ASYNC110
                    await anyio.sleep(0.01)
            assert (heard[-1].state, heard[-1].why) == (link.standing.state, link.standing.why)  # type: ignore[union-attr]
            assert "has died" in link.standing.why
            with anyio.fail_after(10):
                while "has died (SIGKILL)" not in caplog.text:  # noqa: ASYNC110
                    await anyio.sleep(0.01)
            with pytest.raises(NoAnswer, match="has died"):
                await link.get()
            await link.stop("endless")
            with pytest.raises(NotSent):
                await link.start(placed(sequence("quick"), "r2"))


async def test_its_process_ends_with_the_link() -> None:
    async with simulated() as link:
        await link.start(placed(sequence("endless"), "r1"))
        process = process_of(link)
        assert process.nice() > os.nice(0) or process.nice() == 19
    process.wait(10)


async def test_a_start_that_is_given_up_meanwhile_can_be_stopped() -> None:
    async with simulated() as link:
        with anyio.CancelScope() as scope:
            scope.cancel()
            await link.start(placed(sequence("endless"), "r1"))
        bench = Bench(link=link, endless=sequence("endless"), quick=sequence("quick"))
        await shown(bench, bench.endless, moves)
        await link.stop("endless")
        await shown(bench, bench.endless, has_ended("STOPPED"))


@pytest.mark.long
async def test_a_simulation_that_says_very_much_leaves_the_loop_free() -> None:
    """Hundreds of actions that begin and end a hundred times a second."""
    reports = 0

    def hear(report: Report) -> None:
        nonlocal reports
        assert not isinstance(report, Transitions) or len(report.changes) <= 100
        reports += 1
        end = time.perf_counter() + 0.002  # what it takes to show and to store it
        while time.perf_counter() < end:
            pass

    make, script = Simulators(), '{"behaviours":{"*":[{"after_s":0.01}]}}'
    links = [make(SIMULATED, script, lambda: time.time_ns() // 1000) for _ in range(10)]
    async with AsyncExitStack() as stack:
        for i, link in enumerate(links):
            stack.push_async_callback(link.aclose)
            stack.enter_context(link.listen(hear))
            await link.start(placed(carousel(f"carousel{i}"), f"r{i}"))
        began, reports = anyio.current_time(), 0
        await anyio.sleep(2)
        share = 0.002 * reports / (anyio.current_time() - began)
        assert reports > 20
        assert share < 0.5
        await links[0].get()
