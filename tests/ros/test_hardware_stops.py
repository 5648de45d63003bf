"""Hardware stops and health over real rclpy: what a robot publishes, and what the runner makes of it."""

import sys
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from typing import Any

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)
pytest.importorskip(
    "diagnostic_msgs", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)
pytest.importorskip(
    "sensor_msgs", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.context import Context
from rclpy.node import Node
from sensor_msgs.msg import BatteryState
from std_msgs.msg import Bool

from action_assistant.errors import Refused
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.hardware_stop import HardwareStop
from action_assistant.runner.links.health import HealthCheck
from action_assistant.runner.robots.rights import Rules
from ros.led_runner import led_runner
from ros.robots import LOSSLESS, robot
from runner.harness import ANN, MemoryJournal, order, sequence, until

TOPIC = "/estop"
SLOW: dict[str, Any] = {"*": [{"after_s": 60}]}


class Publisher:
    """Publishes what `says` returns, each 0.1 s; None for nothing."""

    def __init__(self, node: Node, kind: type[Any], topic: str, says: Callable[[], Any]) -> None:
        self._publisher = node.create_publisher(kind, topic, 10)
        self.says = says
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._is_over.wait(0.1):
            if (message := self.says()) is not None:
                self._publisher.publish(message)

    def now(self, message: Any) -> float:
        """Publish this from now on; return when, in monotonic seconds."""
        self.says = lambda: message
        at = time.monotonic()
        self._publisher.publish(message)
        return at

    def end(self) -> None:
        """End the thread."""
        self._is_over.set()
        self._thread.join()


@contextmanager
def publishing(domain: int, kind: type[Any], first: Any, topic: str = TOPIC) -> Iterator[Publisher]:
    """Return a publisher of a topic in a context of its own."""
    context = Context()
    context.init(domain_id=domain, initialize_logging=False)
    node = rclpy.create_node("stop_reporter", context=context, enable_rosout=False)
    publisher = Publisher(node, kind, topic, lambda: first)
    try:
        yield publisher
    finally:
        publisher.end()
        node.destroy_node()
        context.try_shutdown()


@asynccontextmanager
async def running(
    domain: int, rule: HardwareStop
) -> AsyncIterator[tuple[ExecutionService, MemoryJournal]]:
    """A runner that listens to David's hardware stop."""
    async with led_runner({"David": domain}) as (control, journal):
        await control.rights.set_rules("David", Rules(hardware_stop=rule), ANN)
        yield control, journal


def pressed(control: ExecutionService) -> str:
    return control.robot_view("David").pressed


async def moving(control: ExecutionService) -> str:
    """Start a run, and wait until it moves."""
    await until(lambda: pressed(control) == "", 20)
    run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
    await until(lambda: control.open[run].run.state == "running", 10)
    return run


def test_a_bool_blocks_stops_and_opens_nothing(domain: int) -> None:
    async def main() -> None:
        with publishing(domain, Bool, Bool(data=False)) as topic:
            async with running(domain, HardwareStop(topic="estop")) as (control, journal):
                run = await moving(control)
                at = topic.now(Bool(data=True))
                await until(lambda: control.open[run].run.desired == "stopped", 5)
                sys.stdout.write(f"\npress to Stop: {1000 * (time.monotonic() - at):.0f} ms\n")
                await until(lambda: run not in control.open, 20)
                assert journal.history(run).state == "stopped"
                with pytest.raises(Refused, match="The hardware stop of David is pressed"):
                    await control.start(order(sequence(), engine="David"), ANN)
                topic.now(Bool(data=False))
                with publishing(domain, Bool, Bool(data=False)):
                    await until(lambda: "2 programs publish it" in pressed(control), 10)
                run = await moving(control)
                topic.says = lambda: None  # nothing more comes
                began = time.monotonic()
                await until(lambda: control.open[run].run.desired == "stopped", 5)
                sys.stdout.write(f"silence to Stop: {1000 * (time.monotonic() - began):.0f} ms\n")
                assert "older than 1 s" in pressed(control)
                await until(lambda: run not in control.open, 20)

    with robot(domain, SLOW, quirks=LOSSLESS):
        anyio.run(main)


def test_diagnostics_nobody_and_another_type(domain: int) -> None:
    def levels(estop: int, other: int = 0) -> DiagnosticArray:
        return DiagnosticArray(
            status=[
                DiagnosticStatus(name="estop", level=bytes([estop])),
                DiagnosticStatus(name="battery", level=bytes([other])),
            ]
        )

    rule = HardwareStop(topic=TOPIC, kind="diagnostics", status="estop")

    async def main() -> None:
        async with running(domain, rule) as (control, _):
            await until(lambda: "nobody publishes it" in pressed(control), 10)
            with pytest.raises(Refused, match="nobody publishes it"):
                await control.start(order(sequence(), engine="David"), ANN)
            with publishing(domain, DiagnosticArray, levels(1, other=2)) as topic:
                run = await moving(control)
                topic.now(levels(2))
                await until(lambda: control.open[run].run.desired == "stopped", 5)
                await until(lambda: run not in control.open, 20)
                topic.now(levels(0))
                await until(lambda: pressed(control) == "", 5)
                with publishing(domain, Bool, Bool()):
                    await until(lambda: "std_msgs/msg/Bool" in pressed(control), 10)

    with robot(domain, SLOW, quirks=LOSSLESS):
        anyio.run(main)


def test_battery_and_diagnostics_are_heard_and_block_a_start_only(domain: int) -> None:
    checks = (
        HealthCheck(topic="estop", poor="block", unknown="block", age_s=2.0),
        HealthCheck(topic="/diagnostics", kind="diagnostics", status="motors"),
    )

    async def main() -> None:
        async with led_runner({"David": domain}) as (control, _):
            await control.rights.set_rules("David", Rules(health=checks), ANN)

            def states() -> list[tuple[str, str]]:
                return [(each.state, each.text) for each in control.robot_view("David").health]

            await until(lambda: "nobody publishes it" in states()[0][1], 10)
            with pytest.raises(Refused, match="nobody publishes it"):
                await control.start(order(sequence(), engine="David"), ANN)
            motors = DiagnosticStatus(name="motors", level=b"\2", message="hot")
            with (
                publishing(domain, BatteryState, BatteryState(percentage=0.7)) as battery,
                publishing(
                    domain, DiagnosticArray, DiagnosticArray(status=[motors]), "/diagnostics"
                ),
            ):
                await until(lambda: "unknown" not in dict(states()), 10)
                assert states() == [
                    ("fine", "The battery of David is at 70 %"),
                    ("poor", "“motors” of David is at ERROR, “hot”"),
                ]
                run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
                await until(lambda: control.open[run].run.state == "running", 10)
                battery.now(BatteryState(percentage=0.1))
                await until(lambda: states()[0][0] == "poor", 5)
                battery.now(BatteryState(percentage=float("nan")))
                await until(lambda: states()[0][0] == "unknown", 5)
                assert control.open[run].run.desired == "running"
                with publishing(domain, BatteryState, BatteryState(percentage=0.7)):
                    await until(lambda: "2 programs publish it" in states()[0][1], 10)
            with publishing(domain, Bool, Bool()):
                await until(lambda: "std_msgs/msg/Bool" in states()[0][1], 20)
            await control.stop(run, ANN)
            await until(lambda: run not in control.open, 20)

    with robot(domain, SLOW, quirks=LOSSLESS):
        anyio.run(main)
