# The part of rclpy (Jazzy) that this project uses; rclpy itself is not fully typed.
from collections.abc import Sequence

from rclpy.context import Context as Context
from rclpy.node import Node

def create_node(
    node_name: str,
    *,
    context: Context | None = None,
    namespace: str | None = None,
    enable_rosout: bool = True,
    start_parameter_services: bool = True,
    cli_args: Sequence[str] | None = None,
) -> Node: ...
def get_rmw_implementation_identifier() -> str: ...
