"""An engine node that only does what it is told by a test: keeps what it hears, says what it is given.

Run as a program it is an engine in a process of its own, which can be killed:
`echo_engine.py DOMAIN [NAMESPACE]` holds one finished graph and prints a line when it is up.
"""

import json
import sys
import threading
import time
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import LoggingSeverity
from rclpy.qos import QoSProfile
from temoto_msgs.msg import (
    UmrfGraphFeedback,
    UmrfGraphModify,
    UmrfGraphPause,
    UmrfGraphResume,
    UmrfGraphStart,
    UmrfGraphStop,
)
from temoto_msgs.srv import UmrfGraphGet

COMMANDS = {
    "start": (UmrfGraphStart, "/umrf_graph_start"),
    "stop": (UmrfGraphStop, "/umrf_graph_stop"),
    "pause": (UmrfGraphPause, "/umrf_pause_pause"),
    "resume": (UmrfGraphResume, "/umrf_graph_resume"),
    "modify": (UmrfGraphModify, "/umrf_graph_modify"),
}


def graph_text(
    name: str = "patrol", state: str = "RUNNING", run: str | None = "r1", **nodes: str
) -> str:
    """A graph as an engine writes it; `nodes` are states by name, `run` the mark of a run."""
    marks = {"gui_attributes": {"action_assistant": {"aid": "a", "run": run}}} if run else {}
    actions = [
        {"name": node, "instance_id": 0, "type": "sync", "state": held, **marks}
        for node, held in (nodes or {"Work": "RUNNING"}).items()
    ]
    return json.dumps({"graph_name": name, "graph_state": state, "actions": actions}, indent=4)


class EchoEngine:
    """A node with an engine's names, types and depths, on a thread of its own."""

    def __init__(
        self, domain: int, *, namespace: str = "", depth: int = 1, deaf: bool = False
    ) -> None:
        self.heard: list[tuple[float, str, Any]] = []
        self.running: list[str] = []
        self.asked = 0
        self.holding = threading.Event()  # while set, gets wait
        self.is_quiet = False  # its log does not say what it receives
        self._context = Context()
        self._context.init(domain_id=domain)
        self._node = rclpy.create_node(
            "action_engine_node", context=self._context, namespace=namespace
        )
        if not deaf:
            for command, (kind, topic) in COMMANDS.items():
                self._node.create_subscription(
                    kind, topic, self._keep(command), QoSProfile(depth=depth)
                )
        self._feedback = self._node.create_publisher(UmrfGraphFeedback, "/umrf_graph_feedback", 10)
        self._node.create_service(UmrfGraphGet, "umrf_graph_get", self._answer)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._voices: dict[str, Any] = {}
        self._ended = False
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _keep(self, command: str) -> Any:
        def heard(message: Any) -> None:
            self.heard.append((time.monotonic(), command, message))
            if not self.is_quiet:
                self.log(f"Received request to {command} UMRF graph: {message.umrf_graph_name}")

        return heard

    def _answer(self, _: Any, response: Any) -> Any:
        self.asked += 1
        while self.holding.is_set() and not self._ended:
            time.sleep(0.01)
        response.umrf_jsons = ['{"name": "Work"}']
        response.graph_jsons_running = list(self.running)
        return response

    def say(self, *history: str, actor: str = "robot") -> None:
        """Publish feedback; the newest stands first."""
        self._feedback.publish(UmrfGraphFeedback(actor=actor, history=list(history)))

    def log(self, text: str) -> None:
        """A line on /rosout."""
        self._node.get_logger().info(text)

    def log_on_every_level(self, text: str) -> None:
        """A line on /rosout for each level, which begins with the level."""
        logger = self._node.get_logger()
        logger.set_level(LoggingSeverity.DEBUG)
        levels = ("debug", "info", "warn", "error", "fatal")
        debug, info, warn, error, fatal = (f"{each} {text}" for each in levels)
        logger.debug(debug)
        logger.info(info)
        logger.warning(warn)
        logger.error(error)
        logger.fatal(fatal)

    def speak(self) -> None:
        """Get ready to publish commands, as somebody else's terminal would."""
        for command, (kind, topic) in COMMANDS.items():
            self._voices[command] = self._node.create_publisher(kind, topic, 10)

    def publish(self, command: str, **fields: Any) -> None:
        """Publish a command."""
        self._voices[command].publish(COMMANDS[command][0](**fields))

    def commands(self, command: str) -> list[Any]:
        """The messages of one kind that arrived."""
        return [message for _, kind, message in tuple(self.heard) if kind == command]

    def _spin(self) -> None:
        while not self._ended:
            self._executor.spin_once(timeout_sec=0.1)

    def end(self) -> None:
        """Leave in an orderly way."""
        if self._ended:
            return
        self._ended = True
        self._executor.wake()
        self._thread.join()
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()


if __name__ == "__main__":
    engine = EchoEngine(int(sys.argv[1]), namespace="".join(sys.argv[2:3]))
    engine.running = [graph_text("old", "FINISHED", None, Work="FINISHED")]
    sys.stdout.write("up\n")
    sys.stdout.flush()
    threading.Event().wait()
