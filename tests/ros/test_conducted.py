"""Runs on several emulated robots are led over real rclpy: courses, outcomes and Stops.

`TEST_LED_GRAPHS` is how many random graphs are led (default 2), from the seed `TEST_LED_FROM` on.
"""

import json
import os
import random
import sys
import time
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import ExitStack, asynccontextmanager
from itertools import pairwise
from typing import Any, NamedTuple

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.errors import Refused
from action_assistant.runner.emulator.node import EmulatorNode
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import Override
from action_assistant.runner.runs.run import Run
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics import Behaviour, GraphRefused
from ros.led_engines import ends_of
from ros.led_runner import is_over, led_runner
from ros.robots import LOSSLESS, robot, started_by_others
from runner.execution.test_conducted_courses import (
    Seen,
    as_long_as_seen,
    as_seen,
    course_of,
    drawn,
    is_near,
    played,
)
from runner.execution.test_conductor import shared
from runner.harness import ANN, BEN, MemoryJournal, order, sequence, until

GRAPHS = int(os.environ.get("TEST_LED_GRAPHS", "2"))
FROM = int(os.environ.get("TEST_LED_FROM", "1"))
NAMES = {"A": "Ann", "B": "Bob", "C": "Cy"}
ACCEPTED = Override(("two-at-once", "stop-across"), "They are far apart.")
_CLOSE_MS = 3.0  # between two ends whose order only the robots know

pytestmark = pytest.mark.timeout(0 if GRAPHS > 5 else 180)


class Led(NamedTuple):
    """A runner that may lead some robots. `seen` records the course of the run that is started next."""

    control: ExecutionService
    journal: MemoryJournal
    robots: tuple[EmulatorNode, ...]
    seen: Seen


@asynccontextmanager
async def led(domains: list[int], scripts: dict[str, Any]) -> AsyncIterator[Led]:
    """Open a runner that may lead three robots, each on a domain of its own."""
    seen = Seen()
    with ExitStack() as opened, seen.listening:
        nodes = tuple(
            opened.enter_context(
                robot(domain, scripts.get(name, scripts.get("*")), name=name, quirks=LOSSLESS)
            )
            for domain, name in zip(domains, NAMES.values(), strict=False)
        )
        by_name = dict(zip(NAMES.values(), domains, strict=False))
        async with led_runner(by_name, seen.made) as (control, journal):
            yield Led(control, journal, nodes, seen)


async def led_through(scene: Led, seed: int, count: Counter[str]) -> None:
    """Lead a random graph, compare its course with that of the whole graph on one engine, and count."""
    graph, drawn_calls = drawn(seed)
    calls = {
        name: [Behaviour(after_s=each[0].after_s / 10, result=each[0].result, stop_s=0.05)] * 6
        for name, each in drawn_calls.items()
    }
    try:
        _, engine = played(graph, calls)
    except GraphRefused:
        count["refused"] += 1
        return
    if engine.crashed or engine.locked:
        count["an engine would abort"] += 1
        return
    for node in scene.robots:  # what the code of their actions does from now on
        node.robot._engine.script.behaviours.update((k, tuple(v)) for k, v in calls.items())
    control, seen = scene.control, scene.seen
    seen.course.clear()
    seen.results.clear()
    robots = {each.actor: NAMES[each.actor] for each in graph.actions}
    asked = order(graph, engine="conducted", robots=robots, lost="wait", override=ACCEPTED)
    try:
        run = (await control.start(asked, ANN)).run.id
    except Refused as refused:
        count[f"not offered: {refused.detail}"] += 1
        return
    count[f"led on {len(set(robots.values()))} robots"] += 1
    has_ended = await is_over(control, run, 8)
    held = scene.journal.history(run).held
    if not has_ended:
        await control.stop(run, BEN)
        assert await is_over(control, run, 20), (seed, scene.journal.history(run))
    for each in ends_of(scene.journal, run):
        if each.outcome != "on_stopped":
            assert each.outcome == calls[each.node][0].result, (seed, each)
            count["outcomes"] += 1
    assert held is None, (seed, held)
    count[compared(seed, graph, calls, seen) if has_ended else "stopped, as it had no end"] += 1


def compared(seed: int, graph: Graph, calls: dict[str, list[Behaviour]], seen: Seen) -> str:
    """Compare a course with that of the whole graph on one engine; return what was found."""
    course = as_seen(seen.course)
    again, _ = played(graph, calls | as_long_as_seen(course, calls))
    whole, results = course_of(again)
    if any(visit[2] == "on_stopped" for visits in course.values() for visit in visits):
        return "stopped by an arrow"
    ends = sorted(end for visits in course.values() for _, end, _ in visits if end is not None)
    if any(later - end < _CLOSE_MS for end, later in pairwise(ends)):
        return "two ends at one moment"
    assert is_near(whole, course), (seed, whole, course)
    assert results == seen.results, (seed, results, seen.results)
    return "same course"


def test_a_led_graph_takes_the_course_of_the_whole_graph(domains: list[int]) -> None:
    count: Counter[str] = Counter()
    failed: list[str] = []

    async def main() -> None:
        async with led(domains, {}) as scene:
            for seed in range(FROM, FROM + GRAPHS):
                try:
                    await led_through(scene, seed, count)
                except AssertionError as fault:
                    failed.append(f"seed {seed}: {fault}")

    anyio.run(main)
    sys.stdout.write(f"\nseeds {FROM} to {FROM + GRAPHS - 1}: {dict(count)}\n")
    assert failed == []
    assert count["outcomes"]


def test_a_start_of_others_stops_every_robot_of_a_run(domains: list[int]) -> None:
    scripts = {"*": {"*": [{"never": True}]}}

    async def main() -> None:
        async with led(domains, scripts) as (control, journal, _, _):
            task = shared(sequence("task", 2), "A", "B")
            robots = {"A": "Ann", "B": "Bob"}
            asked = order(task, engine="conducted", robots=robots, lost="stop", override=ACCEPTED)
            run = (await control.start(asked, ANN)).run.id
            await until(lambda: bool(control.open[run].run.active))
            theirs = json.loads(codec.write(sequence("theirs", 1)))
            with started_by_others(domains[0], theirs, "Ann"):
                assert await is_over(control, run, 20), journal.history(run)
            assert (await control.find(run)).state == "stopped"

    anyio.run(main)


def has_doubt(run: Run) -> bool:
    """Return whether a run has told that a Stop of it is not confirmed in time."""
    return any(each.code == "stop_unconfirmed" for each in run.alarms)


def test_a_robot_that_never_obeys_delays_no_other_robots_stop(domains: list[int]) -> None:
    scripts = {"Ann": {"*": [{"never": True, "ignores_stop": True}]}, "*": {"*": [{"never": True}]}}

    async def main() -> None:
        async with led(domains, scripts) as (control, journal, _, _):
            line = shared(sequence("both", 2), "A", "B")
            first, second = (each.key for each in line.actions)
            entry = next(each for each in line.relations if each.parent == "entry")
            kept = tuple(
                each for each in line.relations if (each.parent, each.child) != (first, second)
            )
            both = msgspec.structs.replace(
                line, relations=(*kept, msgspec.structs.replace(entry, child=second))
            )
            codes = ("two-at-once", "stop-across", "H12", "H14")
            request = order(
                both,
                engine="conducted",
                robots={"A": "Ann", "B": "Bob"},
                override=Override(codes, "A test."),
            )
            run = (await control.start(request, ANN)).run.id
            await until(lambda: len(control.open[run].run.active) == 2)
            began = time.monotonic()
            await control.stop(run, BEN)
            await until(lambda: "Work_1" not in control.open[run].run.active)
            sys.stdout.write(f"\nthe other robot rested after {time.monotonic() - began:.2f} s\n")
            assert not has_doubt(control.open[run].run)  # Bob has not waited for Ann
            await until(lambda: has_doubt(control.open[run].run))
            assert (
                control.open[run].run.state == "stopping"
            )  # Ann moves on: nothing is called stopped
            assert journal.history(run).end is None

    random.seed(0)
    anyio.run(main)
