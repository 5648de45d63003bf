"""Reads hardware stops out of messages of ROS 2. The packages of these messages may be missing."""

from collections.abc import Callable
from typing import Any

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from action_assistant.runner.links.hardware_stop import TYPES, HardwareStop


def message_type(rule: HardwareStop) -> type[Any]:
    """Return the type of the messages. Raise RuntimeError if its package is not here."""
    try:
        if rule.kind == "bool":
            from std_msgs.msg import Bool

            return Bool
        from diagnostic_msgs.msg import DiagnosticArray
    except ImportError as missing:
        package = TYPES[rule.kind].partition("/")[0]
        raise RuntimeError(f"the ROS 2 package {package} is not here") from missing
    return DiagnosticArray


def pressed_in(rule: HardwareStop) -> Callable[[Any], bool | None]:
    """Return the function that says whether a message means pressed; None for one that is about something
    else."""
    if rule.kind == "bool":
        return lambda message: bool(message.data) is rule.pressed

    def read(message: Any) -> bool | None:
        levels = [
            int.from_bytes(each.level, "little") if isinstance(each.level, bytes) else each.level
            for each in message.status
            if each.name == rule.status
        ]
        return max(levels) >= rule.level if levels else None

    return read


def stop_qos() -> QoSProfile:
    """Return the quality of service that every publisher can serve."""
    return QoSProfile(
        depth=10,
        history=HistoryPolicy.KEEP_LAST,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.VOLATILE,
    )
