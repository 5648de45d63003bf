"""On the real engine the code of every action ran within the bounds of its visits.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it
and test actions that write down when their code begins and ends. `TEST_BOUNDS_RUNS` is how many runs
(default 6), `TEST_BOUNDS_DOMAIN` the first domain, `TEST_BOUNDS_AT_ONCE` how many engines.
"""

import asyncio
import json
import os
import random
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.errors import Refused
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Registration
from action_assistant.runner.links.ros2.availability import ros2_reach
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import Override
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import Visit
from action_assistant.umrf.model import Action, Graph, Parameter
from runner.bounds import GRAPHS, Real, fits
from runner.harness import ANN, BEN, MemoryJournal, at_once, order

RUNS = int(os.environ.get("TEST_BOUNDS_RUNS", "6"))
DOMAIN = int(os.environ.get("TEST_BOUNDS_DOMAIN", "150"))
AT_ONCE = int(os.environ.get("TEST_BOUNDS_AT_ONCE", "1"))
SEED = int(os.environ.get("TEST_BOUNDS_SEED", "0"))
LONGEST_S = 10.0  # what the code of an action may take
PROGRAM = Path(os.environ.get("UMRF_SHARED", "/nonexistent")) / "engine-lab" / "engine"

pytestmark = [
    pytest.mark.skipif(
        not os.environ.get("ENGINE_LAB") or not PROGRAM.exists(),
        reason="the real engine is not here (ENGINE_LAB, UMRF_SHARED)",
    ),
    pytest.mark.timeout(0),
]


def clock_us() -> int:
    """Microseconds UTC."""
    return time.time_ns() // 1000


def number(name: str, value: float) -> Parameter:
    return Parameter(name, json.dumps({"pvf_type": "number", "pvf_value": value}))


def plan(chance: random.Random, n: int) -> tuple[Graph, float | None]:
    """A graph of real actions, each with a number of its own, and when to stop it."""
    kind = chance.choice(["line", "sub", "join", "loop", "ends", "sub"])
    graph = GRAPHS[kind]()
    shortest = 0.15 if kind == "loop" else 0.02
    actions = tuple(
        _action(chance, each, 10 * n + i, shortest) for i, each in enumerate(graph.actions)
    )
    stop = chance.uniform(3, 8) if kind == "loop" else chance.choice([None, chance.uniform(0.2, 5)])
    return msgspec.structs.replace(graph, name=f"{kind}{n}", actions=actions), stop


#: Graphs that the engine has indexed; their actions have the same names in every run.
INDEXED = ("SubSeq", "SubFalse", "SubLong", "SubHalt")


def _action(chance: random.Random, like: Action, number_: int, shortest: float) -> Action:
    if like.name == "Sub":
        return msgspec.structs.replace(
            like, name=chance.choice(INDEXED), instance_id=number_, inputs=(), outputs=()
        )
    delay = chance.choice([shortest, 0.2, 0.5, 1.0, chance.uniform(0.3, 4.0)])
    name, inputs = "OxWork", [number("delay", delay)]
    if chance.random() < 0.08:
        name, inputs = "OxStubborn", [number("delay", chance.choice([1.0, 9.0]))]
    else:
        result = chance.choices(["on_true", "on_false", "on_error"], [8, 2, 1])[0]
        inputs.append(Parameter("result", json.dumps({"pvf_type": "string", "pvf_value": result})))
    return msgspec.structs.replace(
        like, name=name, instance_id=number_, inputs=tuple(inputs), outputs=()
    )


OVERRIDE = Override(
    codes=("quiet", "others", "actions", "actors", "H5", "H8", "unknown-action", "subgraphs"),
    reason="the engine has indexed what is inside",
)


class Driven:
    """An engine of our own, and the runs that were tried on it."""

    def __init__(self, domain: int, folder: Path, seed: int) -> None:
        self.chance = random.Random(seed)
        self.domain = domain
        self.truth = folder / f"truth{domain}"
        self.runs: list[Run] = []
        self.ids: list[str] = []
        self.log = (folder / f"engine{domain}.log").open("w")

    def drive(self, runs: int) -> None:
        command = [sys.executable, str(PROGRAM), "David", str(self.domain), "--indexing-rate", "0"]
        engine = subprocess.Popen(
            [*command, "--truth", str(self.truth)], stdout=self.log, stderr=self.log
        )
        try:
            self.journal = MemoryJournal()  # SQLite stays on the thread that it was made on
            asyncio.run(self._drive(runs))
            self.runs = [self.journal.history(each) for each in self.ids]
        finally:
            engine.kill()
            engine.wait()
            self.log.close()

    async def _drive(self, runs: int) -> None:
        reach = ros2_reach(clock_us, {"ROS_DOMAIN_ID": str(self.domain)})
        assert not isinstance(reach, str), reach
        robots = Robots(reach=reach)
        try:
            async with ExecutionService.opened(
                self.journal, robots, clock_us=clock_us, run_in_worker=at_once
            ) as control:
                await robots.register(Registration(name="David", domain=self.domain), ANN)
                for n in range(runs):
                    with anyio.fail_after(60):
                        while robots.robot("David").state != "answering":  # noqa: ASYNC110
                            await anyio.sleep(0.05)
                    await self._run(control, n)
        finally:
            with anyio.CancelScope(shield=True):
                await reach.aclose()

    async def _run(self, control: ExecutionService, n: int) -> None:
        graph, stop = plan(self.chance, n)
        if stop is None and any(each.name == "SubHalt" for each in graph.actions):
            stop = self.chance.uniform(1, 5)  # else its parent runs for ever
        try:
            asked = order(graph, engine="David", graph=None, override=OVERRIDE)
            started = await control.start(asked, ANN)
        except Refused:  # what an action of the run before still does may stand in its way
            return
        self.ids.append(started.run.id)
        with anyio.move_on_after(25):
            if stop is not None:
                await anyio.sleep(stop)
                await control.stop(started.run.id, BEN)
            while (opened := control.open.get(started.run.id)) and not opened.run.unconfirmed:  # noqa: ASYNC110
                await anyio.sleep(0.05)
        if started.run.id in control.open:  # until somebody confirms rest, nothing starts beside it
            await anyio.sleep(LONGEST_S)
            seen = RestRequest(how="no code of these actions takes that long")
            await control.confirm_rest(started.run.id, seen, BEN)
        await anyio.sleep(self.chance.uniform(0, 0.5))

    def real(self) -> dict[str, list[Real]]:
        """Return the begins and ends of each action's code, by full name."""
        found: dict[str, list[Real]] = {}
        for line in self.truth.read_text().splitlines():
            second, _, what, name, _ = line.split()
            at, done = round(float(second) * 1e6), found.setdefault(name, [])
            if what == "begin":
                done.append((at, None))
            elif what == "end":
                done[-1] = (done[-1][0], at)
        return found


def widths(visits: list[Visit]) -> str:
    """Return a line with the widths of bounds, for people."""
    spans = sorted(
        (visit.most - visit.least) / 1e6 for visit in visits if visit.most is not None
    ) or [0.0]
    return f"most - least: median {spans[len(spans) // 2]:.2f} s, longest {spans[-1]:.2f} s"


def test_the_code_of_every_action_ran_inside_of_the_bounds(tmp_path: Path) -> None:
    driven = [Driven(DOMAIN + i, tmp_path, 1000 * SEED + i) for i in range(AT_ONCE)]
    share = -(-RUNS // AT_ONCE)
    threads = [threading.Thread(target=each.drive, args=[share]) for each in driven]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    outside: list[Any] = []
    visits: list[Visit] = []
    executions = inside = 0
    for each in driven:
        real = each.real()
        for run in each.runs:
            for full, action in run.actions.items():
                name = full.rpartition("/")[2]
                executions += len(real.get(name, [])) if name == full else 0
                if name == full and name.startswith("Sub"):
                    continue  # what is inside of it writes down what it does
                visits += action.visits
                inside += len(action.visits) if name != full else 0
                outside += [
                    (run.graph_name, name, visit, real.get(name, []))
                    for visit in action.visits
                    if not any(fits(visit, one) for one in real.get(name, []))
                ]
    runs = sum(len(each.runs) for each in driven)
    sys.stdout.write(
        f"{runs} runs, {executions} executions, {len(visits)} visits ({inside} in sub-graphs), "
        f"{len(outside)} outside; "
        f"{widths(visits)}\n"
    )
    assert runs >= RUNS // 2
    assert visits
    assert outside == []
