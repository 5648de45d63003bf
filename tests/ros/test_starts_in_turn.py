"""Starts of several robots on one domain, over real rclpy: none takes the place of another.

An engine keeps one message of a topic that all robots of a domain share. While it is busy, whatever
comes next takes the place of what it has not taken in yet, for whomever that is.
"""

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.links.port import Link, Registration
from action_assistant.runner.links.ros2 import outlets
from action_assistant.umrf.facts import PINNED
from ros.echo_engine import EchoEngine, graph_text
from ros.test_ros2_link import answering, engine, placed, reach
from support.waiting import wait_until


@asynccontextmanager
async def links(domain: int) -> AsyncIterator[tuple[Link, Link]]:
    """Links to David and Eve, each in a namespace of its own."""
    async with reach() as ros2, anyio.create_task_group() as tasks:
        made = [
            ros2.link(
                Registration(name=name, domain=domain, get_service=f"/{name}/umrf_graph_get"),
                PINNED,
            )
            for name in ("david", "eve")
        ]
        for link in made:
            tasks.start_soon(link.run)
        for link in made:
            await answering(link)
        await anyio.sleep(1)  # what is seen for the first time is given time to see us
        yield made[0], made[1]
        tasks.cancel_scope.cancel()


def runs(node: EchoEngine) -> list[str]:
    """The robots whose starts it took in."""
    return [target for each in node.commands("start") for target in each.targets]


async def test_a_busy_engine_takes_its_start_in_before_that_of_another_leaves(domain: int) -> None:
    with engine(domain, namespace="/david") as david, engine(domain, namespace="/eve") as eve:
        async with links(domain) as (to_david, to_eve), anyio.create_task_group() as tasks:
            asked = david.asked
            david.holding.set()
            tasks.start_soon(to_david.get)
            await wait_until(lambda: david.asked > asked)
            await to_david.start(placed(run="r1"))
            tasks.start_soon(to_eve.start, placed(run="r2"))
            await anyio.sleep(0.5)
            assert (runs(david), runs(eve)) == ([], ["david"])
            david.holding.clear()
            await wait_until(lambda: runs(eve) == runs(david) == ["david", "eve"])


async def test_a_report_of_the_run_lets_the_next_start_leave(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outlets, "TAKEN_S", 3600)
    with engine(domain, namespace="/david") as david, engine(domain, namespace="/eve") as eve:
        async with links(domain) as (to_david, to_eve):
            david.is_quiet = eve.is_quiet = True
            await to_david.start(placed(run="r1"))
            david.say(graph_text(run="r1"), actor="david")
            await to_eve.start(placed(run="r2"))
            eve.running = [graph_text(run="r2")]
            await to_eve.get()
            await to_david.start(placed(run="r3"))
            await wait_until(lambda: runs(eve) == runs(david) == ["david", "eve", "david"])


async def test_an_engine_that_shows_nothing_holds_up_no_other_for_long(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outlets, "TAKEN_S", 0.5)
    with engine(domain, namespace="/david") as david, engine(domain, namespace="/eve") as eve:
        async with links(domain) as (to_david, to_eve):
            david.is_quiet = eve.is_quiet = True
            await to_david.start(placed(run="r1"))
            began = time.monotonic()
            await to_eve.start(placed(run="r2"))
            assert time.monotonic() - began >= 0.4
            await wait_until(lambda: runs(eve) == runs(david) == ["david", "eve"])


async def test_a_start_that_is_given_up_before_its_turn_has_certainly_not_left(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outlets, "TAKEN_S", 1.0)
    with engine(domain, namespace="/david") as david, engine(domain, namespace="/eve") as eve:
        async with links(domain) as (to_david, to_eve):
            david.is_quiet = eve.is_quiet = True
            left: list[str] = []
            await to_david.start(placed(run="r1"), lambda: left.append("r1"))
            with anyio.move_on_after(0.3) as given_up:
                await to_eve.start(placed(run="r2"), lambda: left.append("r2"))
            assert given_up.cancelled_caught
            await anyio.sleep(1.2)
            assert (left, runs(eve)) == (["r1"], ["david"])
