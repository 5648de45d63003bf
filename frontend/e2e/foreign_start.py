"""Somebody else on the domain: publishes the graph of its input as one start for a robot.

`foreign_start.py ROBOT LISTENERS`: it waits until so many listen, the runner among them.
"""

import json
import signal
import sys
import time

import rclpy
from rclpy.signals import SignalHandlerOptions
from temoto_msgs.msg import UmrfGraphStart

text = sys.stdin.read()
rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
node = rclpy.create_node("somebody_else")
publisher = node.create_publisher(UmrfGraphStart, "/umrf_graph_start", 10)
try:
    while publisher.get_subscription_count() < int(sys.argv[2]):
        time.sleep(0.02)
    time.sleep(1.0)
    name = json.loads(text)["graph_name"]
    publisher.publish(
        UmrfGraphStart(umrf_graph_name=name, umrf_graph_json=text, targets=[sys.argv[1]])
    )
    time.sleep(600)
finally:
    node.destroy_node()
    rclpy.shutdown()
