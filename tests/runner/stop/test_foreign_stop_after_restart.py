"""A stop of somebody else's graph outlives the runner: it goes on until it is proven, and is sent to no
other life of the engine. In virtual time."""

from typing import Any

import anyio
import pytest

from action_assistant.errors import Unavailable
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Order
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.robot_events import (
    RobotEvent,
    StopAsked,
    StopUnproven,
    StopWasProven,
    stream_of_robot,
)
from action_assistant.runner.runs.events import draft_of
from runner.harness import ANN, BEN, Harness, clock_us, engine, order, sequence, until, virtual
from runner.registered_robots import NEVER, Open, fleet


async def _cleaning(robot: Open) -> None:
    """Start a graph there as a stranger."""
    await robot.engine.start(Order(run="theirs", graph=sequence("cleaning"), umrf=""))


async def _left(harness: Harness, david: Open, *, crash: bool = True) -> int:
    """A runner ends while David hears nothing of the Stop of a graph of others; how many messages it
    had sent."""
    async with harness.runner() as control:
        await _cleaning(david)
        await anyio.sleep(15)
        david.loss = 1.0
        control.stop_robot("David", BEN)
        await anyio.sleep(5)
        harness.journal.down = crash  # a crash writes nothing any more
    harness.journal.down = False
    return len(david.stops)


async def _told(control: ExecutionService) -> list[RobotEvent]:
    """Return the recorded stop events of David."""
    await until(lambda: not control.robots.robot_log.waiting)
    told = [event for _, event in await control.robots.robot_log.newest("David", 50)]
    return [each for each in told if isinstance(each, StopAsked | StopUnproven | StopWasProven)]


@pytest.mark.parametrize("crash", [True, False])
@virtual
async def test_a_foreign_stop_goes_on_after_a_restart_until_it_is_proven(crash: bool) -> None:
    david = Open(NEVER)
    harness = Harness({"David": david})
    sent = await _left(harness, david, crash=crash)
    async with harness.runner() as control:
        stops = control.foreign_stops
        assert "started anew" in (stops.trouble("David", "cleaning") or "")
        await anyio.sleep(10)
        assert len(david.stops) == sent  # nothing has shown yet that it is the same engine
        david.loss = 0.0
        await until(lambda: not stops.is_stopping("David"))
        assert len(david.stops) > sent
        assert not await david.moving("cleaning")
        asked, proven = await _told(control)
        assert isinstance(asked, StopAsked)
        assert isinstance(proven, StopWasProven)
    async with harness.runner() as control:
        assert not control.foreign_stops.is_stopping("David")


@virtual
async def test_an_engine_that_was_restarted_meanwhile_is_told_nothing() -> None:
    david = Open(NEVER)
    harness = Harness({"David": david})
    sent = await _left(harness, david)
    david.engine, david.loss = engine(NEVER), 0.0
    await _cleaning(david)
    async with harness.runner() as control:
        await until(lambda: not control.foreign_stops.is_stopping("David"))
        assert len(david.stops) == sent
        _, given_up = await _told(control)
        assert isinstance(given_up, StopUnproven)
        assert "restarted" in given_up.why
        assert await david.moving("cleaning")


@virtual
async def test_a_foreign_stop_without_a_recorded_life_is_not_sent() -> None:
    david = Open(NEVER)
    harness = Harness({"David": david})
    old = draft_of(StopAsked(at=0, graph="cleaning", author=BEN), BEN.id)
    await harness.journal.append(stream_of_robot("David"), [old])
    async with harness.runner() as control:
        await until(lambda: not control.foreign_stops.is_stopping("David"))
        assert david.stops == []
        _, given_up = await _told(control)
        assert isinstance(given_up, StopUnproven)
        assert "nobody knows" in given_up.why


@virtual
async def test_after_a_minute_without_an_answer_it_is_given_up() -> None:
    david = Open(NEVER)
    harness = Harness({"David": david})
    sent = await _left(harness, david)
    async with harness.runner() as control:
        await anyio.sleep(55)
        assert control.foreign_stops.is_stopping("David")
        await anyio.sleep(10)
        assert not control.foreign_stops.is_stopping("David")
        assert len(david.stops) == sent
        assert isinstance((await _told(control))[-1], StopUnproven)


@virtual
async def test_without_a_link_it_is_given_up_and_says_so() -> None:
    david, harness = Open(NEVER), Harness()
    async with fleet(harness, David=david) as control:
        await _cleaning(david)
        await anyio.sleep(15)
        david.loss = 1.0
        control.stop_robot("David", BEN)
        await anyio.sleep(1)
    async with ExecutionService.opened(
        harness.journal, Robots(reach="rclpy is not here."), clock_us=clock_us
    ) as control:
        assert control.foreign_stops.graphs() == {"David": ["cleaning"]}
        await until(lambda: not control.foreign_stops.is_stopping("David"), patience=70)
        given_up = (await _told(control))[-1]
        assert isinstance(given_up, StopUnproven)
        assert given_up.why == "there is no link to this robot"


@virtual
async def test_a_log_that_cannot_be_read_holds_up_no_stop(caplog: pytest.LogCaptureFixture) -> None:
    """Neither that of a run, which goes before, nor that of a graph on another robot."""
    david, eve, farah = Open(NEVER), Open(NEVER), Open(NEVER)
    harness = Harness({"David": david, "Eve": eve, "Farah": farah})
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), engine="Eve"), ANN)).run.id
        await _cleaning(david)
        await _cleaning(farah)
        await anyio.sleep(15)
        for each in (david, eve, farah):
            each.loss = 1.0
        control.stop_all(BEN)
        await anyio.sleep(5)
        harness.journal.down = True
    harness.journal.down = False
    read, began, sent = harness.journal.read, anyio.current_time(), len(eve.stops)

    async def failing(stream: str, **more: Any) -> Any:
        if stream == stream_of_robot("David"):
            await anyio.sleep(3)
            raise Unavailable("a disk fails")
        return await read(stream, **more)

    harness.journal.read = failing  # type: ignore[method-assign]
    async with harness.runner() as control:
        assert eve.stops[sent][0] - began < 0.1
        assert control.open[run].run.desired == "stopped"
        assert not control.foreign_stops.is_stopping("David")
        assert control.foreign_stops.trouble("Farah", "cleaning")
        assert "on David cannot be read" in caplog.text
        eve.loss = farah.loss = 0.0
        await until(lambda: not control.open)
        await until(lambda: not control.foreign_stops.is_stopping("Farah"))


@virtual
async def test_a_foreign_stop_is_kept_although_the_runner_ends_at_once() -> None:
    david = Open(NEVER)
    harness = Harness({"David": david})
    async with harness.runner() as control:
        await _cleaning(david)
        await anyio.sleep(15)
        david.loss = 1.0
        harness.journal.slow = 0.5
        control.stop_robot("David", BEN)
        await anyio.sleep(0.1)
    async with harness.runner() as control:
        assert control.foreign_stops.is_stopping("David")
        david.loss = 0.0
        await until(lambda: not control.foreign_stops.is_stopping("David"))
        assert not await david.moving("cleaning")


@virtual
async def test_a_stop_of_a_run_is_kept_although_the_runner_ends_at_once() -> None:
    david = Open(NEVER)
    harness = Harness({"David": david})
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        await until(lambda: control.open[run].run.state == "running")
        await until(lambda: control.open[run].recorder.idle)
        david.loss = 1.0
        harness.journal.slow = 0.5
        control.open[run].alarm("any", "This is being stored, and the Stop waits behind it.")
        await anyio.sleep(0.1)
        await control.stop(run, BEN)
        await anyio.sleep(0.1)
    assert harness.journal.history(run).desired == "stopped"
    async with harness.runner() as control:
        assert control.open[run].run.desired == "stopped"
        david.loss = 0.0
        await until(lambda: not control.open)
