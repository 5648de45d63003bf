"""Rules of robots, repeats and the queue on real engines: the code of the actions writes down what has begun and what
was told to stop.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
`TEST_LED_DOMAIN` is the first domain.
"""

import os
from collections import Counter
from pathlib import Path

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)
pytest.importorskip(
    "std_msgs", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from std_msgs.msg import Bool

from action_assistant.errors import Conflict
from action_assistant.runner.links.hardware_stop import HardwareStop
from action_assistant.runner.queues.entry import QueueRequest
from action_assistant.runner.queues.service import Queues
from action_assistant.runner.repeats.repeat import RepeatRequest
from action_assistant.runner.repeats.service import Repeats
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.page_presence import PagePresence
from action_assistant.runner.runs.views import time as as_text
from action_assistant.runner.start.admission import GoOnRequest
from action_assistant.umrf.model import Graph
from ros.led_engines import Engines, as_led, over, relay, working
from ros.test_hardware_stops import publishing
from runner.harness import ANN, at_once, clock_us, order, sequence, until
from runner.queues.test_queues import put, reopened, started
from runner.repeats.test_repeats import opened, pressed
from runner.start.test_rights_registry import ANN as ANN_SIGNED_IN
from runner.start.test_rights_registry import author
from support.real_engine import needs_engine

DOMAIN = int(os.environ.get("TEST_LED_DOMAIN", "185"))

pytestmark = [needs_engine, pytest.mark.timeout(0)]


@pytest.fixture
def engines(tmp_path: Path) -> Engines:
    return Engines(tmp_path, DOMAIN)


def task(name: str, seconds: float) -> Graph:
    """Return three actions on Ann, Bob and Ann in turn, each of so many seconds."""
    return relay(name, [(seconds, "on_true")] * 3)


def count(engines: Engines, what: str) -> Counter[str]:
    """Return how often the code of each action wrote this."""
    return Counter(line.action for line in engines.lines() if line.what == what)


def test_a_hardware_stop_stops_the_code_and_its_release_begins_nothing(engines: Engines) -> None:
    async def main() -> None:
        with publishing(DOMAIN, Bool, Bool(data=False)) as topic:
            async with engines.led() as (control, journal):
                await control.rights.set_rules(
                    "Ann", Rules(hardware_stop=HardwareStop(topic="estop")), ANN
                )
                await until(lambda: control.robot_view("Ann").pressed == "", 20)
                run = (await control.start(as_led(task("estop", 30)), ANN)).run.id
                await until(lambda: count(engines, "begin") == {"OxWork_0": 1}, 20)
                topic.now(Bool(data=True))
                assert await over(control, run, 20) == "stopped"
                assert count(engines, "stop") == {"OxWork_0": 1}
                assert "hardware_stop" in {each.code for each in journal.history(run).alarms}
                with pytest.raises(Conflict, match="The hardware stop of Ann is pressed"):
                    await control.start(as_led(task("again", 1)), ANN)
                topic.now(Bool(data=False))
                await until(lambda: control.robot_view("Ann").pressed == "", 5)
                await anyio.sleep(2)
                assert count(engines, "begin") == {"OxWork_0": 1}

    anyio.run(main)


def test_no_code_begins_while_a_page_is_missing_and_its_return_begins_none(
    engines: Engines,
) -> None:
    async def main() -> None:
        async with engines.led() as (control, _), anyio.create_task_group() as tasks:
            visible = True

            async def page() -> None:
                while True:
                    if visible:
                        control.rights.see(ANN_SIGNED_IN, anyio.current_time())
                    await anyio.sleep(0.2)

            tasks.start_soon(page)
            rule = PagePresence(wait_s=2.0, stop_s=60.0)
            await control.rights.set_rules("Ann", Rules(page_presence=rule), ANN)
            by = author(ANN_SIGNED_IN)
            run = (await control.start(as_led(task("page", 5)), by, ANN_SIGNED_IN)).run.id
            await until(lambda: count(engines, "begin") == {"OxWork_0": 1}, 20)
            visible = False
            await until(lambda: control.open[run].run.held is not None, 10)
            await until(lambda: count(engines, "end") == {"OxWork_0": 1}, 20)
            visible = True
            await anyio.sleep(3)
            assert count(engines, "begin") == {"OxWork_0": 1}
            held = control.open[run].run.held
            assert held is not None
            await control.go_on(run, GoOnRequest(as_text(held.at)), by, ANN_SIGNED_IN)
            assert await over(control, run, 40) == "finished"
            assert count(engines, "begin") == {f"OxWork_{n}": 1 for n in range(3)}
            tasks.cancel_scope.cancel()

    anyio.run(main)


def test_a_page_that_stays_away_stops_the_code_of_a_whole_run(engines: Engines) -> None:
    async def main() -> None:
        async with engines.led() as (control, _):
            rule = PagePresence(wait_s=1.0, stop_s=3.0)
            await control.rights.set_rules("Ann", Rules(page_presence=rule), ANN)
            line = sequence("whole", 1)
            graph = msgspec.structs.replace(line, actions=(working(line.actions[0], "", 30),))
            start = order(graph, engine="Ann", graph=None)
            run = (await control.start(start, author(ANN_SIGNED_IN), ANN_SIGNED_IN)).run.id
            assert await over(control, run, 30) == "stopped"
            assert (count(engines, "begin"), count(engines, "stop")) == (
                {"OxWork_0": 1},
                {"OxWork_0": 1},
            )

    anyio.run(main)


def test_the_code_of_a_repeat_begins_once_for_each_press_and_not_after_a_stop(
    engines: Engines,
) -> None:
    async def main() -> None:
        async with (
            engines.led() as (control, journal),
            Repeats.opened(control, journal, clock_us=clock_us, run_in_worker=at_once) as repeats,
        ):
            request = RepeatRequest(start=as_led(task("repeat", 0.2)), times=3)
            repeat = await opened(repeats, request)
            await anyio.sleep(2)
            assert count(engines, "begin") == {}
            for cell in (1, 2):
                run = await pressed(repeats, repeat, cell)
                assert await pressed(repeats, repeat, cell) == run  # the same press again
                assert await over(control, run, 30) == "finished"
                await anyio.sleep(1)
                assert count(engines, "begin") == {f"OxWork_{n}": cell for n in range(3)}
            control.stop_robot("Ann", ANN)
            with pytest.raises(Conflict, match="This repeat is closed"):
                await pressed(repeats, repeat, 3)
            await anyio.sleep(1)
            assert count(engines, "begin") == {f"OxWork_{n}": 2 for n in range(3)}

    anyio.run(main)


def test_what_waits_begins_by_a_press_alone_once_and_not_after_a_stop(engines: Engines) -> None:
    async def main() -> None:
        async with (
            engines.led() as (control, journal),
            Queues.opened(control, journal, clock_us=clock_us, run_in_worker=at_once) as queues,
        ):
            run = (await control.start(as_led(task("first", 0.5)), ANN)).run.id
            waiting = [
                await put(queues, QueueRequest(start=as_led(task(f"wait {n}", 0.5))))
                for n in range(3)
            ]
            with pytest.raises(Conflict, match="is not free"):
                await started(queues, waiting[0])
            assert await over(control, run, 30) == "finished"
            await until(lambda: waiting[0].ready_at is not None, 10)
            await anyio.sleep(2)
            assert count(engines, "begin") == {f"OxWork_{n}": 1 for n in range(3)}
            with pytest.raises(Conflict, match="1 before it wait"):
                await started(queues, waiting[1])
            run = await started(queues, waiting[0])
            assert await over(control, run, 30) == "finished"
            assert count(engines, "begin") == {f"OxWork_{n}": 2 for n in range(3)}
            control.stop_robot("Ann", ANN)
            with pytest.raises(Conflict, match="The queue of Ann is closed"):
                await started(queues, waiting[1])
            await anyio.sleep(2)
            assert count(engines, "begin") == {f"OxWork_{n}": 2 for n in range(3)}
            await reopened(queues, "Ann")
            await anyio.sleep(1)
            assert count(engines, "begin") == {f"OxWork_{n}": 2 for n in range(3)}
            run = await started(queues, waiting[1])
            assert await over(control, run, 30) == "finished"
            assert count(engines, "begin") == {f"OxWork_{n}": 3 for n in range(3)}
            assert queues.entries == (waiting[2],)

    anyio.run(main)
