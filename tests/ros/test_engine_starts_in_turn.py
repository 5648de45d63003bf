"""Two real engines on one domain: a start reaches an engine that was busy when it left.

Both hear all starts and keep one. David is busy as long as an action takes to obey the stop of somebody
else. What counts is what the code of the actions did.
"""

import json
from pathlib import Path

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

import rclpy
from rclpy.context import Context
from temoto_msgs.msg import UmrfGraphStart, UmrfGraphStop

from action_assistant.runner.links.port import GraphOutline, Order, Registration
from action_assistant.umrf.facts import PINNED
from ros.test_ros2_link import reach
from support.real_engine import needs_engine, real_engine
from support.waiting import wait_until

pytestmark = [needs_engine, pytest.mark.timeout(120)]


def umrf(name: str, action: str, run: str = "", **inputs: object) -> str:
    """One action, as engines read it, with the mark of a run."""
    parameters = {
        key: {"pvf_type": "string" if isinstance(value, str) else "number", "pvf_value": value}
        for key, value in inputs.items()
    }
    node = {"name": action, "type": "sync", "input_parameters": parameters}
    node["gui_attributes"] = {"action_assistant": {"run": run}} if run else {}
    ends = [{"name": action}]
    return json.dumps(
        {"graph_name": name, "graph_entry": ends, "graph_exit": ends, "actions": [node]}
    )


def order(run: str) -> Order:
    text = umrf("pair", "OxWork", run, delay=60, result="on_true")
    return Order(run=run, graph=GraphOutline("pair", {}), umrf=text)


async def test_both_graphs_begin_although_one_engine_was_busy_with_a_stop(
    domain: int, tmp_path: Path
) -> None:
    context = Context()
    context.init(domain_id=domain, initialize_logging=False)
    somebody = rclpy.create_node("somebody", context=context, enable_rosout=False)
    starts = somebody.create_publisher(UmrfGraphStart, "/umrf_graph_start", 10)
    stops = somebody.create_publisher(UmrfGraphStop, "/umrf_graph_stop", 10)
    with (
        real_engine(tmp_path, domain, "David") as davids,
        real_engine(tmp_path, domain, "Eve") as eves,
    ):
        async with reach() as ros2, anyio.create_task_group() as tasks:
            david, eve = (
                ros2.link(Registration(name=name, domain=domain), PINNED)
                for name in ("David", "Eve")
            )
            tasks.start_soon(david.run)
            tasks.start_soon(eve.run)
            await wait_until(lambda: david.standing.servers == eve.standing.servers == 2)
            await wait_until(lambda: starts.get_subscription_count() >= 3)
            await anyio.sleep(1)  # who is seen may not have seen us yet
            slow = umrf("slow", "OxSlowStop", delay=60, stop_time=1.0)
            starts.publish(
                UmrfGraphStart(umrf_graph_name="slow", umrf_graph_json=slow, targets=["David"])
            )
            await wait_until(lambda: davids() == ["begin"])
            stops.publish(UmrfGraphStop(umrf_graph_name="slow", targets=["David"]))
            await wait_until(lambda: davids() == ["begin", "stop"])
            await david.start(order("r1"))
            await eve.start(order("r2"))
            await wait_until(lambda: davids() == ["begin", "stop", "end", "begin"])
            await wait_until(lambda: eves() == ["begin"])
            tasks.cancel_scope.cancel()
    somebody.destroy_node()
    context.try_shutdown()
