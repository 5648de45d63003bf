"""Hardware stops that robots report: what counts as pressed, what that blocks and stops, what opens again."""

import os
import random
import sys
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from itertools import pairwise
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict, Refused
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.hardware_stop import HardwareStop, StopSignal
from action_assistant.runner.links.port import Registration
from action_assistant.runner.repeats.service import Repeats
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.events import Ended, Held, Requested, StopRequested
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest, GroupRequest
from runner.execution.test_conductor import led, shared
from runner.harness import (
    ANN,
    Harness,
    at_once,
    clock_us,
    ended,
    order,
    sequence,
    stand_still,
    until,
    virtual,
)
from runner.registered_robots import Open, RegisteredRobots
from runner.repeats.test_repeats import closed, on_david, opened
from runner.repeats.test_repeats import pressed as pressed_next

STOP = HardwareStop(topic="estop", age_s=1.0)
RULES = Rules(hardware_stop=STOP)
SLOW: dict[str, Any] = {"*": [{"after_s": 60}]}
HISTORIES = int(os.environ.get("TEST_STOP_HISTORIES", "4"))
#: In this history Stop All comes in the moment in which an action ends, so that the next one may be loading
#: (decision 95).
BETWEEN_ACTIONS = 169


class Topic(StopSignal):
    """A topic of a hardware stop: `says` is published each 0.2 s; None for nothing."""

    def __init__(self, says: bool | None) -> None:
        super().__init__()
        self.says = says
        self.wrong = ""
        self.domains: list[int] = []
        self.changed: Callable[[], None] = lambda: None

    def problem(self) -> str:
        """Return what the test says is wrong."""
        return self.wrong

    async def publish(self) -> None:
        """Publish until cancelled."""
        while True:
            if self.says is not None and self.hear(pressed=self.says, at=anyio.current_time()):
                self.changed()
            await anyio.sleep(0.2)


class Reached(RegisteredRobots):
    """Robots of which each has a topic of its hardware stop."""

    def __init__(self, topic: Topic, **robots: Any) -> None:
        super().__init__(**robots)
        self.topic = topic

    async def stop_signal(self, *given: Any) -> StopSignal:
        """Return the topic of all robots."""
        self.topic.changed = given[-1]
        self.topic.domains.append(given[0].domain)
        return self.topic


@asynccontextmanager
async def lab(topic: Topic, harness: Harness, **robots: Any) -> AsyncIterator[ExecutionService]:
    """A runner of robots whose hardware stop is listened to."""
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
            if name not in control.robots.names:
                await control.register(Registration(name=name, led=True), ANN)
            await control.rights.set_rules(name, RULES, ANN)
        tasks.start_soon(topic.publish)
        await until(lambda: all(control.robots.robot(name).heard_at for name in robots))
        await anyio.sleep(2)
        yield control
        tasks.cancel_scope.cancel()


def pressed(control: ExecutionService) -> str:
    """Return why David's hardware stop counts as pressed."""
    return control.robot_view("David").pressed


@virtual
async def test_a_press_stops_the_run_and_a_release_starts_nothing() -> None:
    topic, harness, david = Topic(says=False), Harness(), Open(SLOW)
    async with lab(topic, harness, David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        await until(lambda: control.open[run].run.state == "running")
        topic.says = True
        assert await ended(control, run) == "stopped"
        told = harness.journal.told(run)
        (asked,) = (each for each in told if isinstance(each, StopRequested))
        assert (asked.author.id, asked.author.name) == ("runner", "the hardware stop of David")
        found = harness.journal.history(run)
        assert [(each.code, each.text) for each in found.alarms] == [
            ("hardware_stop", "The hardware stop of David is pressed (/estop).")
        ]
        with pytest.raises(Conflict, match="The hardware stop of David is pressed") as refused:
            await control.start(order(sequence(), engine="David"), ANN)
        assert (refused.value.where or {})["item"] == "pressed"
        asked = GroupRequest(umrf=order(sequence()).umrf, engines=("David",))
        (look,) = await control.look(asked, ANN.id)
        (item,) = (each for each in look.items if each.code == "pressed")
        assert item.text.endswith("What others start there meanwhile is not stopped from here.")
        topic.says = False
        await anyio.sleep(30)
        assert (pressed(control), len(david.starts), control.open) == ("", 1, {})
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        await control.stop(run, ANN)
        await until(lambda: not control.open)


@virtual
async def test_a_press_too_short_to_be_seen_stops_the_run() -> None:
    topic, harness = Topic(says=False), Harness()
    async with lab(topic, harness, David=Open(SLOW)) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        await until(lambda: control.open[run].run.state == "running")
        for says in (True, False):  # in one step of the loop
            topic.hear(pressed=says, at=anyio.current_time())
        topic.changed()
        assert await ended(control, run) == "stopped"
        found = harness.journal.history(run)
        assert [each.text for each in found.alarms] == [
            "The hardware stop of David was pressed for a moment."
        ]


@virtual
async def test_a_press_between_two_runs_closes_a_repeat_which_a_release_does_not_open() -> None:
    topic, harness = Topic(says=False), Harness()
    async with (
        lab(topic, harness, David=Open({})) as control,
        Repeats.opened(
            control, harness.journal, clock_us=clock_us, run_in_worker=at_once
        ) as repeats,
    ):
        repeat = await opened(repeats, on_david())
        topic.says = True
        assert await closed(repeats, repeat) == "stop"
        found = await repeats.find(repeat.id)
        assert found.closed is not None
        assert found.closed.text == "David was stopped by the hardware stop of David."
        topic.says = False
        await anyio.sleep(5)
        with pytest.raises(Conflict, match="This repeat is closed"):
            await pressed_next(repeats, repeat, 1)
        assert control.open == {}


@virtual
async def test_a_robot_in_another_domain_is_listened_to_there() -> None:
    topic = Topic(says=False)
    async with lab(topic, Harness(), David=Open(SLOW)) as control:
        assert pressed(control) == ""
        asked = len(topic.domains)
        await control.register(Registration(name="David", led=True, domain=5), ANN)
        assert "it is not listened to yet" in pressed(control)
        await until(lambda: pressed(control) == "")
        assert topic.domains[asked:] == [5]
        await control.remove("David", ANN)
        await control.register(Registration(name="David", led=True, domain=7), ANN)
        await until(lambda: pressed(control) == "")
        assert topic.domains[-1] == 7


@virtual
async def test_a_runner_that_begins_while_the_stop_is_pressed_stops_what_it_takes_over() -> None:
    topic, harness, david = Topic(says=False), Harness(), Open(SLOW)
    async with lab(topic, harness, David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        await until(lambda: control.open[run].run.state == "running")
    async with lab(Topic(says=True), harness, David=david) as control:
        await until(lambda: run not in control.open)
        assert harness.journal.history(run).state == "stopped"


@pytest.mark.parametrize(
    ("fault", "why"),
    [
        ("silent", "the last message on /estop is older than 1 s"),
        ("wrong", "it is published as std_msgs/msg/String"),
    ],
)
def test_what_nobody_hears_counts_as_pressed(fault: str, why: str) -> None:
    @virtual
    async def lives() -> None:
        topic, harness = Topic(says=False), Harness()
        async with lab(topic, harness, David=Open(SLOW)) as control:
            run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
            await until(lambda: control.open[run].run.state == "running")
            began = anyio.current_time()
            if fault == "silent":
                topic.says = None
            else:
                topic.wrong = "it is published as std_msgs/msg/String"
            await until(lambda: control.open[run].run.desired == "stopped")
            assert anyio.current_time() - began < 1.6
            assert why in pressed(control)
            assert await ended(control, run) == "stopped"

    lives()


@virtual
async def test_a_topic_without_any_message_blocks_starts() -> None:
    async with lab(Topic(says=None), Harness(), David=Open(SLOW)) as control:
        with pytest.raises(Refused, match="no message has come on /estop"):
            await control.start(order(sequence(), engine="David"), ANN)
        await control.rights.set_rules("David", Rules(), ANN)
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        await control.stop(run, ANN)
        await until(lambda: not control.open)


@virtual
async def test_a_runner_that_begins_to_listen_stops_nothing_before_it_could_hear() -> None:
    topic, harness = Topic(says=False), Harness()
    david = Open(SLOW)
    async with lab(topic, harness, David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        await until(lambda: control.open[run].run.state == "running")
    topic = Topic(says=None)  # the runner is begun again, and its topic is late by four seconds
    async with lab(topic, harness, David=david) as control:
        await anyio.sleep(2)
        topic.says = False
        await anyio.sleep(10)
        assert control.open[run].run.desired == "running"
        topic.says = True
        assert await ended(control, run) == "stopped"


@virtual
async def test_a_runner_that_stood_still_looks_again_before_it_stops_for_old_messages() -> None:
    topic = Topic(says=False)
    async with lab(topic, Harness(), David=Open(SLOW)) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        await until(lambda: control.open[run].run.state == "running")
        stand_still(2.5)
        await anyio.sleep(5)
        assert control.open[run].run.desired == "running"
        await control.stop(run, ANN)
        await until(lambda: not control.open)


@virtual
async def test_a_press_closes_the_gate_of_a_led_run_and_stops_all_of_its_robots() -> None:
    topic, harness = Topic(says=False), Harness()
    script = {"*": [{"after_s": 3}]}
    david, carol = Open(script), Open(script)
    async with lab(topic, harness, David=david, Carol=carol) as control:
        await control.rights.set_rules("Carol", Rules(), ANN)
        run = (
            await control.start(led(shared(sequence("task", 4), "Scout", "Carrier")), ANN)
        ).run.id
        await until(lambda: len(carol.starts) == 1)
        topic.says = True
        assert await ended(control, run) == "stopped"
        told = harness.journal.told(run)
        kinds = [type(each) for each in told if isinstance(each, Held | StopRequested)]
        assert kinds[0] is Held
        assert StopRequested in kinds
        assert (len(david.starts), len(carol.starts)) == (1, 1)
        assert any(each.code == "hardware_stop" for each in harness.journal.history(run).alarms)


def test_a_topic_of_diagnostics_needs_the_name_of_the_status() -> None:
    rule = HardwareStop(topic="/diagnostics", kind="diagnostics")
    assert "Name the status" in rule.fault
    assert msgspec.structs.replace(rule, status="estop").fault == ""


class Heard(Topic):
    """A topic that notes its messages: when each came, in microseconds, and whether it meant pressed."""

    def __init__(self) -> None:
        super().__init__(says=False)
        self.messages: list[tuple[int, bool]] = []

    def hear(self, *, pressed: bool, at: float) -> bool:
        """Note a message."""
        self.messages.append((clock_us(), pressed))
        return super().hear(pressed=pressed, at=at)

    def before(self, at: int) -> tuple[int, bool]:
        """Return the newest message before a time."""
        return max(each for each in self.messages if each[0] < at)

    def presses_at(self) -> list[int]:
        """Return when the topic began to say *pressed*."""
        pairs = pairwise(self.messages)
        return [at for (_, before), (at, pressed) in pairs if pressed and not before]


class Left(list[Any]):
    """The messages that a robot got, with their times in microseconds."""

    def __init__(self, times: list[int]) -> None:
        super().__init__()
        self._times = times

    def append(self, sent: Any) -> None:
        """Note a message, and when it left."""
        self._times.append(clock_us())
        super().append(sent)


class Met(Open):
    """A robot that notes its starts, and the runs of which a Stop has met an action."""

    def __init__(self, left: list[int]) -> None:
        super().__init__({"*": [{"after_s": 2}]})
        self.starts = Left(left)
        self.met: set[str] = set()

    async def stop(self, graph_name: str) -> None:
        """Take a Stop, and note whether something of the graph has to stop."""
        await super().stop(graph_name)
        if await self.moving(graph_name):
            runs = [each.run for each in self.starts if each.graph.name == graph_name]
            self.met.add(runs[-1])

    async def is_still(self) -> bool:
        """Return whether nothing moves, whatever the runner believes."""
        shown = (await self.engine.get()).graphs
        return not any([await self.moving(each.graph) for each in shown])


async def come_to_rest(control: ExecutionService, **robots: Met) -> int:
    """Wait until each run is over, or its Stop is unconfirmed because it came between two actions. Check
    that such a Stop is repeated, until a person has seen that nothing moves. Return how many there were.
    """
    await until(lambda: all(each.run.loading for each in control.open.values()))
    began, kept = anyio.current_time(), tuple(control.open.values())
    await anyio.sleep(5)
    for robot in robots.values():
        assert await robot.is_still()
    for each in kept:
        run, robot = each.run, robots[each.run.engine]
        assert (run.state, run.end) == ("stopping", None)
        assert run.id not in robot.met
        assert any(alarm.text.startswith("STOP UNCONFIRMED") for alarm in run.alarms)
        assert sum(at > began and graph == run.graph_name for at, graph in robot.stops) >= 4
        await control.confirm_rest(run.id, RestRequest("I stand beside it."), ANN)
    await until(lambda: not control.open)
    return len(kept)


async def live(control: ExecutionService, topic: Heard, pick: random.Random) -> None:
    """Start, let go on, press and release by chance for half a minute."""
    for _ in range(150):
        if pick.random() < 0.06:
            topic.says = pick.choice([True, False, False, None])
        chance = pick.random()
        with suppress(Refused):
            if chance < 0.1:
                await control.start(order(sequence(), engine="David"), ANN)
            elif chance < 0.2:
                await control.start(led(shared(sequence("task", 4), "Scout", "Carrier")), ANN)
            elif chance < 0.4:
                for run, opened in tuple(control.open.items()):
                    held = opened.run.held
                    if held is not None:
                        await control.go_on(run, GoOnRequest(time(held.at)), ANN)
        await anyio.sleep(0.2)


async def history(seed: int) -> Counter[str]:
    """Live through one random history, check it, and return the counts of its runs and messages."""
    counts, left = Counter[str](), list[int]()
    topic, harness, pick = Heard(), Harness(), random.Random(seed)
    david, carol = Met(left), Met(left)
    async with lab(topic, harness, David=david, Carol=carol) as control:
        await live(control, topic, pick)
        control.stop_all(ANN)
        topic.says = False
        counts["unconfirmed"] += await come_to_rest(control, David=david, Carol=carol)
    for at in left:
        heard, pressed = topic.before(at)
        assert not pressed
        assert at - heard <= 1_000_000
    runs = [
        each.removeprefix("run/") for each in harness.journal.streams if each.startswith("run/")
    ]
    for run in runs:
        told = harness.journal.told(run)
        if not told or not isinstance(told[0], Requested):
            continue
        counts["runs"] += 1
        ends = [each.at for each in told if isinstance(each, Ended)]
        stops = [each.at for each in told if isinstance(each, StopRequested)]
        for at in topic.presses_at():
            if told[0].at < at and not any(each < at for each in (*ends, *stops)):
                counts["stopped"] += 1
                near = [each for each in (*stops, *ends) if at <= each <= at + 300_000]
                assert near, run
        if told[0].led is not None and stops:
            first = next(each for each in told if isinstance(each, Held | StopRequested))
            counts["gate first"] += isinstance(first, Held)
    counts["left"] += len(left)
    return counts


@virtual
async def test_in_random_histories_nothing_leaves_while_the_stop_counts_and_all_is_stopped() -> (
    None
):
    counts = Counter[str]()
    for seed in (BETWEEN_ACTIONS, *range(HISTORIES)):
        try:
            counts += await history(seed)
        except Exception as fault:
            fault.add_note(f"in history {seed}")
            raise
    sys.stdout.write(f"\n{HISTORIES} histories and one more: {dict(counts)}\n")
    assert counts["stopped"] >= HISTORIES // 2, counts
    assert counts["gate first"], counts
    assert counts["unconfirmed"], counts
