"""The health that robots report: what is shown, what blocks a start, and that it stops nothing."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from itertools import pairwise
from math import inf, nan
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.health import (
    HealthCheck,
    HealthNow,
    HealthSignal,
    battery_reading,
    health_now,
    status_reading,
)
from action_assistant.runner.links.port import Registration
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.events import Requested
from action_assistant.runner.runs.page_presence import PagePresence
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest, GroupRequest, WaitRequest
from runner.execution.test_conductor import led, shared
from runner.harness import ANN, Harness, at_once, clock_us, ended, order, sequence, until, virtual
from runner.registered_robots import Open, RegisteredRobots

BATTERY = HealthCheck(topic="battery", poor="block", unknown="block", age_s=5.0)
MOTORS = HealthCheck(topic="/diagnostics", kind="diagnostics", status="motors", level=1)
SLOW: dict[str, Any] = {"*": [{"after_s": 3}]}


class Topic(HealthSignal):
    """A topic of a battery that publishes `says` each second; None for nothing."""

    def __init__(self, says: float | None) -> None:
        super().__init__()
        self.says = says
        self.wrong = ""

    def problem(self) -> str:
        """Return what the test says is wrong."""
        return self.wrong

    async def publish(self) -> None:
        """Publish until cancelled."""
        while True:
            if self.says is not None:
                self.newest = battery_reading(self.says), anyio.current_time()
            await anyio.sleep(1)


class Reached(RegisteredRobots):
    """Robots of which each reports one battery."""

    def __init__(self, topic: Topic, **robots: Any) -> None:
        super().__init__(**robots)
        self.topic = topic

    async def health_signal(self, *_: Any) -> HealthSignal:
        """Return the topic of all robots."""
        return self.topic


@asynccontextmanager
async def lab(
    topic: Topic, harness: Harness, check: HealthCheck = BATTERY, **more: Any
) -> AsyncIterator[ExecutionService]:
    """A runner of David and Carol, whose health is checked."""
    robots = {"David": Open(SLOW), "Carol": Open(SLOW)}
    async with (
        ExecutionService.opened(
            harness.journal,
            Robots(reach=Reached(topic, **robots)),
            clock_us=clock_us,
            run_in_worker=at_once,
        ) as control,
        anyio.create_task_group() as tasks,
    ):
        for name in robots:
            await control.register(Registration(name=name, led=True), ANN)
        await control.rights.set_rules("David", Rules(health=(check,), **more), ANN)
        tasks.start_soon(topic.publish)
        await until(lambda: all(control.robots.robot(name).heard_at for name in robots))
        await anyio.sleep(2)
        yield control
        tasks.cancel_scope.cancel()


def shown(control: ExecutionService) -> tuple[str, str]:
    """Return the state and the words of David's battery."""
    (found,) = control.robot_view("David").health
    return found.state, found.text


async def looked_at(control: ExecutionService) -> list[tuple[str, str]]:
    """Return verdict and text of the items about health in a look."""
    group = GroupRequest(umrf=order(sequence()).umrf, engines=("David",))
    (look,) = await control.look(group, ANN.id)
    return [(each.verdict, each.text) for each in look.items if each.code == "health"]


@virtual
async def test_a_low_battery_blocks_a_start_and_stops_no_run() -> None:
    topic, harness = Topic(0.84), Harness()
    async with lab(topic, harness) as control:
        ((verdict, text),) = await looked_at(control)
        assert (verdict, text.partition(" (")[0]) == ("passed", "The battery of David is at 84 %")
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        topic.says = 0.29
        await until(lambda: shown(control)[0] == "poor")
        assert await ended(control, run) == "finished"
        ((verdict, text),) = await looked_at(control)
        assert verdict == "blocked"
        assert text.startswith("The battery of David is at 29 %, below 30 % (/battery, ")
        with pytest.raises(Conflict, match="at 29 %, below 30 %") as refused:
            await control.start(order(sequence(), engine="David"), ANN)
        assert (refused.value.where or {})["item"] == "health"
        topic.says = 0.3
        await anyio.sleep(2)
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        assert await ended(control, run) == "finished"


@virtual
async def test_a_led_run_goes_on_with_a_low_battery_and_is_let_go_on() -> None:
    topic, harness = Topic(0.84), Harness()
    async with lab(topic, harness) as control:
        graph = shared(sequence("task", 4), "Scout", "Carrier")
        run = (await control.start(led(graph), ANN)).run.id
        topic.says = 0.1
        await anyio.sleep(4)
        await control.wait(run, WaitRequest(), ANN)
        await anyio.sleep(10)
        held = control.open[run].run.held
        assert held is not None
        await control.go_on(run, GoOnRequest(time(held.at)), ANN)
        assert await ended(control, run) == "finished"
        with pytest.raises(Conflict, match="below 30 %"):
            await control.start(led(graph), ANN)


@virtual
async def test_what_is_unknown_blocks_or_warns_as_its_owner_chose() -> None:
    topic, harness = Topic(None), Harness()
    async with lab(topic, harness) as control:
        why = "The battery of David is unknown: "
        assert shown(control) == ("unknown", why + "no message about it has come")
        topic.wrong = "nobody publishes it"
        await anyio.sleep(2)
        assert shown(control) == ("unknown", why + "nobody publishes it")
        with pytest.raises(Conflict, match="nobody publishes it"):
            await control.start(order(sequence(), engine="David"), ANN)
        topic.wrong, topic.says = "", 0.9
        await anyio.sleep(2)
        assert shown(control)[0] == "fine"
        topic.says = None
        await anyio.sleep(6)
        assert shown(control) == ("unknown", why + "the newest message is older than 5 s")
        with pytest.raises(Conflict, match="older than 5 s"):
            await control.start(order(sequence(), engine="David"), ANN)
        warns = msgspec.structs.replace(BATTERY, unknown="warn")
        await control.rights.set_rules("David", Rules(health=(warns,)), ANN)
        ((verdict, text),) = await looked_at(control)
        assert (verdict, "older than 5 s" in text) == ("warned", True)
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        assert await ended(control, run) == "finished"


@virtual
async def test_the_first_event_of_a_run_has_the_health_and_the_rule_about_pages() -> None:
    topic, harness = Topic(0.2), Harness()
    check = msgspec.structs.replace(BATTERY, poor="warn")
    page = PagePresence(wait_s=5.0, stop_s=500.0)
    async with lab(topic, harness, check, page_presence=page) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        assert await ended(control, run) == "finished"
        first = next(each for each in harness.journal.told(run) if isinstance(each, Requested))
        (seen,) = first.health["David"]
        assert (seen.state, seen.value, seen.check) == ("poor", 20.0, check)
        assert first.pages == {"David": page}
        simulated = (await control.start(order(sequence()), ANN)).run
        assert (simulated.health, simulated.pages) == ({}, {})


@virtual
async def test_the_age_that_people_see_is_a_few_seconds_behind_at_most() -> None:
    topic, harness = Topic(0.84), Harness()
    async with lab(topic, harness) as control:
        told = list[float]()
        control.watch_robots(lambda: told.append(anyio.current_time()))
        await anyio.sleep(60)
        gaps = [after - before for before, after in pairwise(told)]
        assert max(gaps) <= 7
        assert len(told) <= 20  # and not each message is sent to every page


def of_battery(share: float) -> HealthNow:
    return health_now("David", BATTERY, (battery_reading(share), 10.0), "", 10.5)


def test_a_share_that_is_none_is_unknown() -> None:
    for share in (nan, inf, -inf, -0.01, 1.01, 85.0):
        found = of_battery(share)
        assert (found.state, found.value, found.consequence) == ("unknown", None, "block")
        assert "no share of charge" in found.sentence()
    states = {share: of_battery(share).state for share in (0.0, 0.2999, 0.3, 0.30000001192, 1.0)}
    assert states == {0.0: "poor", 0.2999: "poor", 0.3: "fine", 0.30000001192: "fine", 1.0: "fine"}
    charged = msgspec.structs.replace(BATTERY, below=70.0)
    single = battery_reading(0.699999988079071)  # 70 % as a message has it
    assert health_now("David", charged, (single, 0.0), "", 0.0).state == "fine"


def test_levels_of_diagnostics_are_told_apart_and_stale_is_unknown() -> None:
    def of(level: int, text: str = "") -> HealthNow:
        return health_now("David", MOTORS, (status_reading(level, text), 0.0), "", 0.0)

    states = [of(level).state for level in (0, 1, 2, 3, 4, 255, -1)]
    assert states == ["fine", "poor", "poor", "unknown", "unknown", "unknown", "unknown"]
    said = of(1, "too\nwarm\x1b[31m \u202egnp" + "x" * 100_000).sentence()
    assert said.startswith("“motors” of David is at WARN, “too warm\\u001b[31m ")
    assert len(said) < 300
    assert not {"\n", "\x1b", "\u202e"} & set(said)


@pytest.mark.parametrize(
    ("check", "why"),
    [
        (HealthCheck(topic="a b"), "no name of a ROS 2 topic"),
        (HealthCheck(topic="a", age_s=nan), "0.1 to 3600 s"),
        (HealthCheck(topic="a", below=nan), "more than 0 %"),
        (HealthCheck(topic="a", below=0), "more than 0 %"),
        (HealthCheck(topic="a", below=101), "100 % at most"),
        (HealthCheck(topic="a", kind="diagnostics"), "Name the status"),
    ],
)
def test_what_cannot_be_checked_is_refused(check: HealthCheck, why: str) -> None:
    assert why in check.fault
    assert BATTERY.fault == MOTORS.fault == ""
