"""An engine whose starts are of another type than ours: `old_engine.py NAME` answers on its path."""

import signal
import sys

import rclpy
from rclpy.signals import SignalHandlerOptions
from temoto_msgs.msg import UmrfGraphStop
from temoto_msgs.srv import UmrfGraphGet

rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
node = rclpy.create_node("action_engine_node", namespace=sys.argv[1])
node.create_subscription(UmrfGraphStop, "/umrf_graph_start", lambda _: None, 1)
node.create_service(UmrfGraphGet, "umrf_graph_get", lambda _, response: response)
try:
    rclpy.spin(node)
finally:
    node.destroy_node()
    rclpy.shutdown()
