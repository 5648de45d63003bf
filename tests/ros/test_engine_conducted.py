"""Two real engines are led through one graph: each outcome is that of the action's own code, no code
begins after a Stop was proven, and each hand-over is timed by what the code wrote down.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
`TEST_LED_OUTCOMES` is how many outcomes are read (default 24), `TEST_LED_LAPS` how often one name is
started (default 10), `TEST_LED_STOPS` how many Stops (default 3), `TEST_LED_DOMAIN` the first domain.
Figures are printed with `-s`.
"""

import itertools
import json
import os
import random
import subprocess
import sys
import time
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Registration
from action_assistant.runner.links.ros2.availability import ros2_reach
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import PieceEnded
from action_assistant.umrf.model import Conditions, Graph, Parameter, Relation
from runner.harness import ANN, BEN, MemoryJournal, at_once, order, sequence
from support.real_engine import PROGRAM, needs_engine

OUTCOMES = int(os.environ.get("TEST_LED_OUTCOMES", "24"))
LAPS = int(os.environ.get("TEST_LED_LAPS", "10"))
STOPS = int(os.environ.get("TEST_LED_STOPS", "3"))
DOMAIN = int(os.environ.get("TEST_LED_DOMAIN", "180"))
ALWAYS = Conditions(on_true="run", on_false="run", on_error="run")

pytestmark = [needs_engine, pytest.mark.timeout(0)]


def clock_us() -> int:
    """Microseconds UTC."""
    return time.time_ns() // 1000


class Engines:
    """Two real engines, and what the code of their actions wrote down."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.names = {"Ann": DOMAIN, "Bob": DOMAIN + 1}

    def lines(self) -> list[tuple[float, str, str]]:
        """Return when which code did what: (seconds UTC, begin or end …, action), oldest first."""
        found: list[tuple[float, str, str]] = []
        for name in self.names:
            path = self.folder / f"truth-{name}"
            for line in path.read_text().splitlines() if path.exists() else ():
                second, _, what, action, _ = line.split()
                found.append((float(second), what, action))
        return sorted(found)

    @asynccontextmanager
    async def led(self) -> AsyncIterator[tuple[ExecutionService, MemoryJournal]]:
        """Open a runner that may lead both."""
        engines = []
        for name, domain in self.names.items():
            command = [sys.executable, str(PROGRAM), name, str(domain), "--indexing-rate", "0"]
            command += ["--truth", str(self.folder / f"truth-{name}")]
            with (self.folder / f"engine-{name}.log").open("w") as log:
                engines.append(subprocess.Popen(command, stdout=log, stderr=log))  # noqa: ASYNC220
        reach = ros2_reach(clock_us, {"ROS_DOMAIN_ID": str(DOMAIN)})
        assert not isinstance(reach, str), reach
        robots, journal = Robots(reach=reach), MemoryJournal()
        try:
            async with ExecutionService.opened(
                journal, robots, clock_us=clock_us, run_in_worker=at_once
            ) as control:
                for name, domain in self.names.items():
                    await control.register(Registration(name=name, domain=domain, led=True), ANN)
                with anyio.fail_after(60):
                    while any(robots.robot(name).state != "answering" for name in self.names):  # noqa: ASYNC110
                        await anyio.sleep(0.05)
                yield control, journal
        finally:
            with anyio.CancelScope(shield=True):
                await reach.aclose()
            for engine in engines:
                engine.kill()
                engine.wait()


def relay(name: str, works: list[tuple[float, str]]) -> Graph:
    """`OxWork` on Scout and Carrier in turn, each with its delay in seconds and its result."""
    line = sequence(name, len(works))
    actions = tuple(
        msgspec.structs.replace(
            each,
            name="OxWork",
            actor=("Scout", "Carrier")[number % 2],
            inputs=(
                Parameter("delay", json.dumps({"pvf_type": "number", "pvf_value": delay})),
                Parameter("result", json.dumps({"pvf_type": "string", "pvf_value": result})),
            ),
        )
        for number, (each, (delay, result)) in enumerate(zip(line.actions, works, strict=True))
    )
    relations = tuple(
        each if each.parent == "entry" else msgspec.structs.replace(each, conditions=ALWAYS)
        for each in line.relations
    )
    return msgspec.structs.replace(line, actions=actions, relations=relations)


def led(graph: Graph, **more: object) -> object:
    """A start in which Scout is Ann and Carrier is Bob."""
    robots = {"Scout": "Ann", "Carrier": "Bob"}
    return order(graph, engine="conducted", graph=None, robots=robots, **more)


async def over(control: ExecutionService, run: str, seconds: float) -> str:
    """Wait for the end of a run."""
    with anyio.move_on_after(seconds):
        while run in control.open:  # noqa: ASYNC110
            await anyio.sleep(0.02)
    assert run not in control.open, "\n".join(
        f"{o.run.id} {o.run.state} {o.run.graph_state} {o.watch.trouble} {o.run.alarms} {[(a.state, a.visits) for a in o.run.actions.values()]}"
        for o in control.open.values()
    )
    return (await control.find(run)).state


def test_each_outcome_is_that_of_the_code(tmp_path: Path) -> None:
    engines = Engines(tmp_path)
    kinds = list(itertools.product((0.0, 0.004, 0.03, 0.25), ("on_true", "on_false", "on_error")))
    wrong: list[str] = []
    handed: list[float] = []
    count: Counter[str] = Counter()

    async def main() -> None:
        async with engines.led() as (control, journal):
            for n in range(-(-OUTCOMES // len(kinds))):
                works = random.Random(n).sample(kinds, len(kinds))
                run = (await control.start(led(relay(f"relay{n}", works)), ANN)).run.id
                state = await over(control, run, 25)
                ends = [e for e in journal.told(run) if isinstance(e, PieceEnded)]
                count[state] += 1
                for each, (delay, result) in zip(ends, works, strict=False):
                    count[result] += 1
                    if each.outcome != result:
                        wrong.append(f"{each.node}: {each.outcome}, not {result} after {delay} s")
                if len(ends) != len(works):
                    wrong.append(f"{len(ends)} of {len(works)} in {run}: {state}")

    anyio.run(main)
    lines = engines.lines()
    ends = [line for line in lines if line[1] == "end"]
    for second, _, _ in ends:
        begun = next((line[0] for line in lines if line[1] == "begin" and line[0] > second), None)
        if begun is not None and begun - second < 1.5:  # else the next run
            handed.append(1000 * (begun - second))
    handed.sort()
    sys.stdout.write(f"\n{dict(count)}, wrong: {len(wrong)}\n")
    sys.stdout.write(
        f"end of code to begin of the next on the other robot, ms: n={len(handed)} "
        f"p50={handed[len(handed) // 2]:.0f} p90={handed[len(handed) * 9 // 10]:.0f} "
        f"max={handed[-1]:.0f}\n"
    )
    assert wrong == []


def test_one_name_is_started_again_and_again(tmp_path: Path) -> None:
    engines = Engines(tmp_path)
    graph = relay("carousel", [(0.02, "on_true"), (0.02, "on_false")])
    first, second = (each.key for each in graph.actions)
    back = Relation(parent=second, child=first, conditions=ALWAYS, required=False)
    kept = tuple(each for each in graph.relations if each.child != "exit")
    loop = msgspec.structs.replace(graph, relations=(*kept, back))

    async def main() -> None:
        async with engines.led() as (control, journal):
            run = (await control.start(led(loop), ANN)).run.id
            with anyio.fail_after(10 + 3 * LAPS):
                while sum(isinstance(e, PieceEnded) for e in journal.told(run)) < 2 * LAPS:
                    assert run in control.open, journal.history(run)
                    await anyio.sleep(0.2)
            await control.stop(run, BEN)
            assert await over(control, run, 20) == "stopped"
            ended = time.time()
            await anyio.sleep(1)
            assert [line for line in engines.lines() if line[0] > ended] == []
            outcomes = Counter(
                (e.node, e.outcome) for e in journal.told(run) if isinstance(e, PieceEnded)
            )
            sys.stdout.write(f"\n{dict(outcomes)}\n")
            assert set(outcomes) <= {
                ("OxWork_0", "on_true"),
                ("OxWork_1", "on_false"),
                ("OxWork_0", "on_stopped"),
                ("OxWork_1", "on_stopped"),
            }

    anyio.run(main)


def test_no_code_runs_after_a_stop_was_proven(tmp_path: Path) -> None:
    engines = Engines(tmp_path)
    took: list[float] = []
    late: list[str] = []

    async def main() -> None:
        async with engines.led() as (control, _):
            for n in range(STOPS):
                chance = random.Random(n)
                works = [(chance.uniform(0.1, 0.6), "on_true") for _ in range(6)]
                run = (await control.start(led(relay(f"halt{n}", works)), ANN)).run.id
                await anyio.sleep(chance.uniform(0.0, 1.5))
                pressed = time.time()
                await control.stop(run, BEN)
                state = await over(control, run, 30)
                ended = time.time()
                took.append(ended - pressed)
                await anyio.sleep(0.8)
                late.extend(
                    f"{run} {state}: {what} of {action} {second - ended:.3f} s later"
                    for second, what, action in engines.lines()
                    if second > ended
                )

    anyio.run(main)
    took.sort()
    sys.stdout.write(f"\nproven after: median {took[len(took) // 2]:.2f} s, max {took[-1]:.2f} s\n")
    assert late == []
