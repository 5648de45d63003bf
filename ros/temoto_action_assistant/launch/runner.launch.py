"""The runner in a ROS 2 workspace, on its own or beside an engine.

ros2 launch temoto_action_assistant runner.launch.py engine:=David actions:=DIR data:=DIR
"""

import shlex

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.launch_description_entity import LaunchDescriptionEntity
from launch.substitutions import LaunchConfiguration
from launch_ros.substitutions import ExecutableInPackage

ARGUMENTS = {
    "command": ("runner", "`runner`, or `serve` for the page, too"),
    "data": ("", "the data folder; without, that of the user"),
    "arguments": ("", "more arguments of the command, as in a shell: see its --help"),
    "engine": ("", "the name of an engine to start beside it (temoto_action_engine_ros2); none"),
    "actions": ("", "the folder of that engine's action packages"),
    "indexing_rate": ("0", "seconds between its readings of that folder; 0: once, at its start"),
}


def generate_launch_description() -> LaunchDescription:
    declared = [
        DeclareLaunchArgument(name, default_value=value, description=what)
        for name, (value, what) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=_processes)])


def _processes(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Plain processes: a `Node` would get --ros-args, on which the engine ends at once."""
    asked = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    command = [asked["command"], *(["--no-open"] if asked["command"] == "serve" else [])]
    if asked["data"]:
        command += ["--data", asked["data"]]
    # `serve` gives each of its processes 8 s to end; the engine drives its graph to the end first.
    runner = ExecuteProcess(
        name="runner",
        cmd=[
            ExecutableInPackage("action-assistant", "temoto_action_assistant"),
            *command,
            *shlex.split(asked["arguments"]),
        ],
        output="screen",
        sigterm_timeout="20",
        sigkill_timeout="10",
    )
    if not asked["engine"]:
        return [runner]
    return [runner, _engine(asked["engine"], asked["actions"], asked["indexing_rate"])]


def _engine(name: str, actions: str, indexing_rate: str) -> ExecuteProcess:
    """An engine that reads its folder again while it runs may die of being asked meanwhile."""
    return ExecuteProcess(
        name="engine",
        cmd=[
            ExecutableInPackage("action_engine_node", "temoto_action_engine_ros2"),
            *("--actor-name", name),
            *(["--actions-path", actions] if actions else []),
            *("--indexing-rate", indexing_rate),
        ],
        output="screen",
        sigterm_timeout="20",
        sigkill_timeout="10",
    )
