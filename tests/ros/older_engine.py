"""An engine of early 2025: `older_engine.py DOMAIN` answers gets and prints the starts it gets."""

import sys

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from temoto_msgs.msg import UmrfGraphStart
from temoto_msgs.srv import UmrfGraphGet


def say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


context = Context()
context.init(domain_id=int(sys.argv[1]))
node = rclpy.create_node("action_engine_node", context=context)
node.create_subscription(UmrfGraphStart, "/umrf_graph_start", lambda _: say("started"), 1)
node.create_service(UmrfGraphGet, "umrf_graph_get", lambda _, response: response)
executor = SingleThreadedExecutor(context=context)
executor.add_node(node)
say(" ".join(UmrfGraphStart.get_fields_and_field_types()))
executor.spin()
