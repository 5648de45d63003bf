"""On the real engine no Stop is called proven before an action that was loading has run its course;
the test also counts Stops that stay unconfirmed although nothing came.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it and
test actions that take 1.5, 3 and 8 s in `onInit` and write down when their code begins and ends.
`TEST_LOADING_STOPS` is how many Stops of each kind (default 3), `TEST_LOADING_DOMAIN` the first domain,
`TEST_LOADING_AT_ONCE` how many engines. Figures are printed with `-s`.
"""

import asyncio
import json
import os
import random
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Registration
from action_assistant.runner.links.ros2.availability import ros2_reach
from action_assistant.runner.robots.registry import Robots
from action_assistant.umrf.model import ENTRY, ENTRY_CONDITIONS, Action, Graph, Parameter, Relation
from runner.harness import ANN, BEN, MemoryJournal, at_once, order, sequence

STOPS = int(os.environ.get("TEST_LOADING_STOPS", "3"))
DOMAIN = int(os.environ.get("TEST_LOADING_DOMAIN", "160"))
AT_ONCE = int(os.environ.get("TEST_LOADING_AT_ONCE", "1"))
SEED = int(os.environ.get("TEST_LOADING_SEED", "0"))
KINDS = os.environ.get("TEST_LOADING_KINDS", "first,later,beside,quick,between").split(",")
LOADS_S = {"OxSlowInit": 1.5, "OxInitThree": 3.0, "OxInitEight": 8.0}
WORKS_S = 0.4
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


def _action(like: Action, name: str, number: int) -> Action:
    """A real action that works for a while, with a number of its own."""
    inputs = [Parameter("delay", json.dumps({"pvf_type": "number", "pvf_value": WORKS_S}))]
    if name == "OxWork":
        result = json.dumps({"pvf_type": "string", "pvf_value": "on_true"})
        inputs.append(Parameter("result", result))
    return msgspec.structs.replace(
        like, name=name, instance_id=number, inputs=tuple(inputs), outputs=()
    )


def plan(chance: random.Random, kind: str, n: int) -> tuple[Graph, float]:
    """A graph of real actions, and how long after its start it is stopped."""
    slow = chance.choice(list(LOADS_S))
    match kind:
        case "first":
            names, stop = [slow, "OxWork"], chance.uniform(0.0, LOADS_S[slow])
        case "later":
            names = ["OxWork", slow, "OxWork"]
            stop = WORKS_S + chance.uniform(-0.02, 0.5 * LOADS_S[slow])
        case "beside":
            names, stop = [slow, "OxWork"], chance.uniform(0.0, WORKS_S)
        case "quick":
            names, stop = ["OxWork"] * 3, chance.uniform(0.0, 3 * WORKS_S)
        case _:
            names, stop = ["OxWork"] * 3, WORKS_S + chance.uniform(-0.02, 0.02)
    line = sequence(f"{kind}{n}", len(names))
    actions = tuple(
        _action(each, name, 10 * n + i)
        for i, (each, name) in enumerate(zip(line.actions, names, strict=True))
    )
    relations = line.relations
    if kind == "beside":
        first, second = (each.key for each in actions)
        relations = (
            *(each for each in relations if (each.parent, each.child) != (first, second)),
            Relation(parent=ENTRY, child=second, conditions=ENTRY_CONDITIONS),
        )
    return msgspec.structs.replace(line, actions=actions, relations=relations), stop


class Driven:
    """An engine of our own, and the Stops that were tried on it."""

    def __init__(self, domain: int, folder: Path, seed: int) -> None:
        self.chance = random.Random(seed)
        self.domain = domain
        self.truth = folder / f"truth{domain}"
        self.log = (folder / f"engine{domain}.log").open("w")
        self.count: Counter[str] = Counter()
        self.false: list[str] = []
        self.failures: list[str] = []
        self.took: list[float] = []
        self.unconfirmed: list[str] = []
        self.ended: dict[int, tuple[float, str]] = {}  # when it was called over

    def drive(self, kinds: list[str]) -> None:
        command = [sys.executable, str(PROGRAM), "David", str(self.domain)]
        more = ["--truth", str(self.truth), "--indexing-rate", "0"]
        engine = subprocess.Popen([*command, *more], stdout=self.log, stderr=self.log)
        try:
            asyncio.run(self._drive(kinds))
        except (Exception, ExceptionGroup) as error:  # noqa: BLE001 - of any kind
            self.failures.append(repr(error))
        finally:
            engine.kill()
            engine.wait()
            self.log.close()

    async def _drive(self, kinds: list[str]) -> None:
        reach = ros2_reach(clock_us, {"ROS_DOMAIN_ID": str(self.domain)})
        assert not isinstance(reach, str), reach
        robots = Robots(reach=reach)
        try:
            async with ExecutionService.opened(
                MemoryJournal(), robots, clock_us=clock_us, run_in_worker=at_once
            ) as control:
                await robots.register(Registration(name="David", domain=self.domain), ANN)
                with anyio.fail_after(60):
                    while robots.robot("David").state != "answering":  # noqa: ASYNC110
                        await anyio.sleep(0.05)
                for n, kind in enumerate(kinds):
                    await self._stop(control, kind, n)
                await anyio.sleep(max(LOADS_S.values()) + WORKS_S)  # what comes late has come
        finally:
            with anyio.CancelScope(shield=True):
                await reach.aclose()

    async def _stop(self, control: ExecutionService, kind: str, n: int) -> None:
        graph, wait_s = plan(self.chance, kind, n)
        run = (await control.start(order(graph, engine="David", graph=None), ANN)).run.id
        await anyio.sleep(wait_s)
        began = time.time()
        await control.stop(run, BEN)
        is_slow = kind in {"first", "later", "beside"}
        with anyio.move_on_after(15 if is_slow else 10):
            while (opened := control.open.get(run)) and (is_slow or not opened.run.loading):  # noqa: ASYNC110
                await anyio.sleep(0.02)
            await anyio.sleep(0 if is_slow else 1.0)  # the evidence may be on its way
        told = control.open[run].run if run in control.open else await control.find(run)
        if told.end is not None:
            self.count[f"{kind}: proven"] += 1
            if not is_slow and told.ended_at is not None:
                self.took.append(told.ended_at / 1e6 - began)
        elif self._open_in_truth(n):
            self.false.append(f"{graph.name}: it still runs after 15 s")
        else:
            self.count[f"{kind}: unconfirmed although nothing came"] += 1
            states = {name: action.state for name, action in told.actions.items()}
            self.unconfirmed.append(f"{kind}, stopped after {wait_s:.3f} s: {states}")
            await control.confirm_rest(run, RestRequest(how="the file of its truth says so"), BEN)
        if told.end is not None and told.ended_at is not None:
            self.ended[n] = told.ended_at / 1e6, graph.name

    def _lines(self, n: int) -> list[tuple[float, str]]:
        """Return the begins and ends of the code of one graph's actions."""
        found: list[tuple[float, str]] = []
        text = self.truth.read_text() if self.truth.exists() else ""
        for line in text.splitlines():
            second, _, what, name, _ = line.split()
            if int(name.rpartition("_")[2]) // 10 == n:
                found.append((float(second), what))
        return found

    def _open_in_truth(self, n: int) -> bool:
        count = Counter(what for _, what in self._lines(n))
        return count["init"] > count["begin"] or count["begin"] > count["end"]

    def judge(self) -> None:
        """Check that no code began or ended after its graph was called ended; late lines have
        come by now."""
        for n, (ended, graph) in self.ended.items():
            late = [f"{what} {at - ended:.3f} s later" for at, what in self._lines(n) if at > ended]
            self.false += [f"{graph}: {each}" for each in late]


def test_no_stop_is_proven_while_an_action_loads(tmp_path: Path) -> None:
    driven = [Driven(DOMAIN + i, tmp_path, 1000 * SEED + i) for i in range(AT_ONCE)]
    share = -(-STOPS // AT_ONCE)
    threads = [threading.Thread(target=each.drive, args=[KINDS * share]) for each in driven]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    count: Counter[str] = Counter()
    for each in driven:
        each.judge()
        count += each.count
    took = sorted(second for each in driven for second in each.took) or [0.0]
    sys.stdout.write("".join(f"\n{each}" for one in driven for each in one.unconfirmed))
    sys.stdout.write("".join(f"\n{what}: {n}" for what, n in sorted(count.items())))
    sys.stdout.write(
        f"\nquick ones proven after: median {took[len(took) // 2]:.2f} s, longest {took[-1]:.2f} s\n"
    )
    assert [fault for each in driven for fault in each.failures] == []
    assert [fault for each in driven for fault in each.false] == []
    assert sum(count.values()) >= STOPS * len(KINDS)
