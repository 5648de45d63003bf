"""Finds out whether this process can reach robots over ROS 2, and why not."""

import importlib
import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from typing import Final

from action_assistant import ros_workspace
from action_assistant.runner.links.port import Reach

#: The fields of a start, in the order engines read them.
FIELDS: Final = ("umrf_graph_name", "umrf_graph_json", "targets", "name_match_required")
_MAKE: Final = "`make ros` in a checkout, or `source` the ROS 2 workspace before starting"


def ros2_reach(
    clock_us: Callable[[], int], environ: Mapping[str, str] = os.environ
) -> "Reach | str":
    """Return the object that makes links to robots over ROS 2, or a sentence that says why this
    process cannot have one. `clock_us`: returns microseconds UTC; `environ`: the environment
    variables, such as ROS_DOMAIN_ID."""
    missing = why_not(environ)
    if missing:
        return missing
    home = environ.get("ROS_DOMAIN_ID", "0")
    if not home.isascii() or not home.isdigit() or int(home) > 232:
        return f"ROS_DOMAIN_ID is {home!r}; it must be a number from 0 to 232."
    from action_assistant.runner.links.ros2.reach import Ros2

    return Ros2(clock_us, int(home))


def why_not(environ: Mapping[str, str] = os.environ) -> str:
    """Return the sentence why this interpreter cannot use ROS 2 with the environment variables
    `environ`; "" if it can."""
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    ros_workspace.offer(environ)
    if importlib.util.find_spec("rclpy") is None:
        return (
            ros_workspace.Workspace.of(environ).other_python()
            or f"rclpy is not there for this Python ({version}, {sys.executable}): {_MAKE}."
        )
    rmw = environ.get("RMW_IMPLEMENTATION", "")
    if rmw and not _survives(rmw, environ):
        return (
            f"RMW_IMPLEMENTATION is {rmw!r}, which rclpy does not find here. Install it, or unset "
            "the variable."
        )
    try:
        importlib.import_module("rclpy")
    except ImportError as error:
        return (
            f"rclpy is there, but not for this Python ({version}, {sys.executable}): {error}. "
            "Use the Python that ROS 2 was built for."
        )
    try:
        messages = importlib.import_module("temoto_msgs.msg")
        importlib.import_module("temoto_msgs.srv")
    except ImportError as error:
        return f"rclpy is there, but temoto_msgs is not: {error}. Build ros/temoto_msgs: {_MAKE}."
    fields = list(messages.UmrfGraphStart.get_fields_and_field_types())
    if fields != list(FIELDS):
        place = getattr(messages, "__file__", "") or "the workspace"
        return (
            f"The temoto_msgs in {place} are of another generation (a start has the fields "
            f"{', '.join(fields)}), so engines of today would misread what is sent. Build "
            "temoto_msgs of March 2025 or later, or ros/temoto_msgs."
        )
    return ""


def _survives(rmw: str, environ: Mapping[str, str]) -> bool:
    """Return whether rclpy can be imported with the middleware `rmw`. That is tried in another
    process, for which the call waits: an unknown middleware ends its process with code 102."""
    asked = {**environ, "RMW_IMPLEMENTATION": rmw}
    command = [
        *(sys.executable, "-c"),
        "from action_assistant import ros_workspace; ros_workspace.offer(); import rclpy",
    ]
    return subprocess.run(command, env=asked, capture_output=True, check=False).returncode != 102
