"""Reads hardware stops and health out of messages of ROS 2. The packages of these messages may be
missing."""

from collections.abc import Callable, Iterator
from typing import Any, assert_never

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from action_assistant.runner.links.hardware_stop import HardwareStop, SignalKind
from action_assistant.runner.links.health import (
    HealthCheck,
    HealthKind,
    Reading,
    battery_reading,
    status_reading,
)


def message_type(kind: SignalKind | HealthKind) -> type[Any]:
    """Return the type of the messages. Raise RuntimeError if its package is not here."""
    try:
        match kind:
            case "bool":
                from std_msgs.msg import Bool

                return Bool
            case "diagnostics":
                from diagnostic_msgs.msg import DiagnosticArray

                return DiagnosticArray
            case "battery":
                from sensor_msgs.msg import BatteryState

                return BatteryState
            case never:
                assert_never(never)
    except ImportError as missing:
        package = str(missing.name).partition(".")[0]
        raise RuntimeError(f"the ROS 2 package {package} is not here") from missing


def pressed_in(rule: HardwareStop) -> Callable[[Any], bool | None]:
    """Return the function that says whether a message means pressed; None for one that is about something
    else."""
    if rule.kind == "bool":
        return lambda message: bool(message.data) is rule.pressed

    def read(message: Any) -> bool | None:
        levels = [level for level, _ in _statuses(message, rule.status)]
        return max(levels) >= rule.level if levels else None

    return read


def health_in(check: HealthCheck) -> Callable[[Any], Reading | None]:
    """Return the function that reads the health in a message; None for one that is about something
    else."""
    if check.kind == "battery":
        return lambda message: battery_reading(float(message.percentage))

    def read(message: Any) -> Reading | None:
        found = list(_statuses(message, check.status))
        return status_reading(*max(found)) if found else None

    return read


def _statuses(message: Any, name: str) -> Iterator[tuple[int, str]]:
    """Yield level and text of each status with this name in a message of diagnostics."""
    for each in message.status:
        if each.name == name:
            level = each.level
            yield (
                int.from_bytes(level, "little") if isinstance(level, bytes) else level,
                each.message,
            )


def report_qos() -> QoSProfile:
    """Return the quality of service that every publisher can serve."""
    return QoSProfile(
        depth=10,
        history=HistoryPolicy.KEEP_LAST,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.VOLATILE,
    )
