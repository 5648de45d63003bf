"""Every link keeps its promises over real rclpy: with an emulated robot, and with a real engine.

    make contract DOMAIN=7 NAME=David [RMW=rmw_cyclonedds_cpp] [ACTION=OxWork]

asks the engine of that name. ACTION is one of its own whose numbers mean seconds; without it, the
first that has an input of type number is taken, and named before it moves. Nothing else may run on
that robot.
"""

import json
import os
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from time import time_ns
from typing import Any

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.links.port import Link, Registration
from action_assistant.runner.links.ros2.availability import ros2_reach
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.model import Action, Graph, Parameter
from ros.robots import robot
from runner.harness import sequence
from runner.links.contract import PROMISES, Bench, answer, keep

SCRIPT = {
    **{f"endless/Work_{i}": [{"never": True}] for i in range(3)},
    "*": [{"after_s": 0.2}],
}


@asynccontextmanager
async def reached(domain: int, name: str, **more: Any) -> AsyncIterator[Link]:
    """A link over ROS 2 that answers."""
    reach = ros2_reach(lambda: time_ns() // 1000, {"ROS_DOMAIN_ID": str(domain)})
    assert not isinstance(reach, str), reach
    registration = Registration(name=name, domain=domain, **more)
    link = reach.link(registration, PINNED)
    try:
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(link.run)
            with anyio.fail_after(20):
                while link.standing.state != "answering":  # noqa: ASYNC110 - discovery takes time
                    await anyio.sleep(0.05)
            yield link
            tasks.cancel_scope.cancel()
    finally:
        await reach.aclose()


async def all_kept(bench: Bench) -> None:
    """Every promise, one after the other on one robot, as it is used."""
    for promise in PROMISES:
        try:
            await keep(promise, bench)
        except (Exception, ExceptionGroup) as broken:
            broken.add_note(f"promise: {promise.__name__}")
            raise


async def test_the_link_over_ros_keeps_its_promises_with_a_stand_in(domain: int) -> None:
    with robot(domain, SCRIPT):
        async with reached(domain, "David") as link:
            plain = Bench(link=link, endless=sequence("endless"), quick=sequence("quick"))
            await all_kept(plain)


ENGINE = os.environ.get("TEST_ENGINE_NAME", "")


@pytest.mark.skipif(not ENGINE, reason="no engine was named; see the head of this file")
async def test_the_link_over_ros_keeps_its_promises_with_a_real_engine(
    capsys: pytest.CaptureFixture[str],
) -> None:
    async with reached(int(os.environ.get("TEST_ENGINE_DOMAIN", "0")), ENGINE) as link:
        plain = Bench(link=link, endless=sequence("endless"), quick=sequence("quick"))
        known = [json.loads(text) for text in (await answer(plain)).known_actions]
        action, why = _chosen(known, os.environ.get("TEST_ENGINE_ACTION", ""))
        with capsys.disabled():
            sys.stdout.write(f"\n{ENGINE} runs {why}\n")
        make = partial(_of, action)
        await all_kept(Bench(link=link, endless=make("endless", 15), quick=make("quick", 0.3)))


def _chosen(known: list[dict[str, Any]], wanted: str) -> tuple[dict[str, Any], str]:
    """The action that is run, and which one that is and why, for people."""
    timed = [each for each in known if _numbers(each) and wanted in {"", each["name"]}]
    if not timed:
        names = ", ".join(sorted(each["name"] for each in known)) or "none"
        pytest.fail(
            f"ACTION={wanted} is no action of {ENGINE} with an input of type number; it has: {names}"
            if wanted
            else f"{ENGINE} has no action with an input of type number; it has: {names}"
        )
    action = timed[0]
    others = ", ".join(each["name"] for each in timed[1:])
    why = f"{action['name']}, with {' and '.join(_numbers(action))} in seconds"
    if not wanted:
        why += "; ACTION was not given, so it is the first with a number"
        why += f", before {others}" if others else ""
    return action, f"{why}."


def test_the_contract_says_which_action_it_takes_where_none_was_named() -> None:
    known: list[dict[str, Any]] = [
        {"name": "Greet", "input_parameters": {"name": {"pvf_type": "string"}}},
        {"name": "Wait", "input_parameters": {"delay": {"pvf_type": "number"}}},
        {"name": "Turn", "input_parameters": {"angle": {"pvf_type": "number"}}},
    ]
    action, why = _chosen(known, "")
    assert action["name"] == "Wait"
    assert why == (
        "Wait, with delay in seconds; ACTION was not given, so it is the first with a "
        "number, before Turn."
    )
    assert _chosen(known, "Turn")[1] == "Turn, with angle in seconds."
    with pytest.raises(
        pytest.fail.Exception, match=r"ACTION=Greet is no action .* Greet, Turn, Wait"
    ):
        _chosen(known, "Greet")


def _numbers(action: dict[str, Any]) -> list[str]:
    inputs = action.get("input_parameters", {})
    return [name for name, leaf in inputs.items() if leaf.get("pvf_type") == "number"]


def _of(action: dict[str, Any], name: str, seconds: float) -> Graph:
    """A sequence of an action that an engine has, with values for all that it takes."""
    values: dict[str, Any] = {"number": seconds, "string": "on_true", "bool": True}
    inputs = tuple(
        Parameter(path, json.dumps({**leaf, "pvf_value": values[leaf["pvf_type"]]}))
        for path, leaf in action.get("input_parameters", {}).items()
    )
    outputs = tuple(
        Parameter(path, json.dumps(leaf))
        for path, leaf in action.get("output_parameters", {}).items()
    )
    line = sequence(name)
    nodes = tuple(
        Action(
            key=each.key,
            name=action["name"],
            instance_id=each.instance_id,
            inputs=inputs,
            outputs=outputs,
        )
        for each in line.actions
    )
    return Graph(name=name, actions=nodes, relations=line.relations)
