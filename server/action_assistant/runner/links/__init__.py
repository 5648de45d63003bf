"""Links between the runner and engines."""

from collections.abc import Callable

from action_assistant.runner.links.port import Reach


def ros2_reach(wall: Callable[[], int]) -> Reach | str:
    """What reaches robots over ROS 2 from this process, or why nothing does, as one sentence.

    `wall` gives microseconds UTC. rclpy is imported here and not before: an editor's computer has
    none, and the wheels of rclpy start their interpreter anew.
    """
    del wall
    return "This installation has no link to ROS 2."
