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
import sys
import time
from collections import Counter
from pathlib import Path

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.errors import Refused
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import Override
from action_assistant.umrf.model import Parameter
from ros.led_engines import Engines, as_led, ends_of, going_round, led_round, over, relay
from runner.harness import ANN, BEN, MemoryJournal
from support.real_engine import needs_engine

OUTCOMES = int(os.environ.get("TEST_LED_OUTCOMES", "24"))
LAPS = int(os.environ.get("TEST_LED_LAPS", "10"))
STOPS = int(os.environ.get("TEST_LED_STOPS", "3"))
DOMAIN = int(os.environ.get("TEST_LED_DOMAIN", "180"))

pytestmark = [needs_engine, pytest.mark.timeout(0)]


def test_each_outcome_is_that_of_the_code(tmp_path: Path) -> None:
    engines = Engines(tmp_path, DOMAIN)
    kinds = list(itertools.product((0.0, 0.004, 0.03, 0.25), ("on_true", "on_false", "on_error")))
    wrong: list[str] = []
    handed: list[float] = []
    count: Counter[str] = Counter()

    async def lead(control: ExecutionService, journal: MemoryJournal, n: int) -> None:
        works = random.Random(n).sample(kinds, len(kinds))
        run = (await control.start(as_led(relay(f"relay{n}", works)), ANN)).run.id
        state = await over(control, run, 25)
        ended = [e for e in ends_of(journal, run) if e.how == "shape" and e.outcome != "on_stopped"]
        count[state] += 1
        for each, (delay, result) in zip(ended, works, strict=False):
            count[result] += 1
            if each.outcome != result:
                wrong.append(f"{each.node}: {each.outcome}, not {result} after {delay} s")
        if engines.dead():  # H4: a fault of the engine, right after an action that takes no time
            count["an engine aborted"] += 1
            assert state in {"lost", "stopped", "error"}, state
        elif len(ended) != len(works):
            wrong.append(f"{len(ended)} of {len(works)} in {run}: {state}")

    async def main() -> None:
        series = iter(range(-(-OUTCOMES // len(kinds))))
        for first in series:  # each time with new engines
            async with engines.led() as (control, journal):
                await lead(control, journal, first)
                while not engines.dead() and (n := next(series, None)) is not None:
                    await lead(control, journal, n)

    anyio.run(main)
    lines = engines.lines()
    begins = [line.second for line in lines if line.what == "begin"]
    for second in [line.second for line in lines if line.what == "end"]:
        begun = next((each for each in begins if each > second), None)
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


@pytest.mark.skipif(
    not (Path(os.environ.get("ENGINE_LAB", "")) / "actions" / "ox_unset").exists(),
    reason="the real engine is not here with OxUnset, an action that never sets its output",
)
def test_an_output_that_is_never_set_keeps_no_run_open(tmp_path: Path) -> None:
    engines = Engines(tmp_path, DOMAIN)
    line = relay("unset", [(0.05, "on_true"), (0.05, "on_false"), (0.05, "on_true")])
    text = Parameter("text", json.dumps({"pvf_type": "string", "pvf_value": "hello"}))
    output = Parameter("text", json.dumps({"pvf_type": "string"}))
    unset = msgspec.structs.replace(
        line.actions[0], name="OxUnset", inputs=(text,), outputs=(output,)
    )
    graph = msgspec.structs.replace(line, actions=(unset, *line.actions[1:]))
    found: Counter[tuple[str, str]] = Counter()

    async def main() -> None:
        async with engines.led() as (control, journal):
            for _ in range(max(1, OUTCOMES // 30)):
                run = (await control.start(as_led(graph), ANN)).run.id
                assert await over(control, run, 25) == "finished"
                found.update((e.node, e.outcome) for e in ends_of(journal, run))

    anyio.run(main)
    sys.stdout.write(f"\n{dict(found)}\n")
    assert set(found) == {
        ("OxUnset_0", "on_true"),
        ("OxWork_1", "on_false"),
        ("OxWork_2", "on_true"),
    }


def test_one_name_is_started_again_and_again(tmp_path: Path) -> None:
    engines = Engines(tmp_path, DOMAIN)
    loop = going_round(relay("carousel", [(0.02, "on_true"), (0.02, "on_false")]))

    async def main() -> None:
        async with engines.led() as (control, journal):
            ends = await led_round(control, journal, loop, LAPS)
            ended = time.time()
            await anyio.sleep(1)
            assert [line for line in engines.lines() if line.second > ended] == []
            outcomes = Counter((each.node, each.outcome) for each in ends)
            sys.stdout.write(f"\n{dict(outcomes)}\n")
            assert set(outcomes) <= {
                ("OxWork_0", "on_true"),
                ("OxWork_1", "on_false"),
                ("OxWork_0", "on_stopped"),
                ("OxWork_1", "on_stopped"),
            }

    anyio.run(main)


def test_no_code_runs_after_a_stop_was_proven(tmp_path: Path) -> None:
    engines = Engines(tmp_path, DOMAIN)
    took: list[float] = []
    late: list[str] = []

    async def main() -> None:
        async with engines.led() as (control, _):
            for n in range(STOPS):
                chance = random.Random(n)
                works = [(chance.uniform(0.1, 0.6), "on_true") for _ in range(6)]
                run = (await control.start(as_led(relay(f"halt{n}", works)), ANN)).run.id
                await anyio.sleep(chance.uniform(0.0, 1.5))
                pressed = time.time()
                await control.stop(run, BEN)
                state = await over(control, run, 30)
                ended = time.time()
                took.append(ended - pressed)
                await anyio.sleep(0.8)
                late.extend(
                    f"{run} {state}: {what} of {action} {second - ended:.3f} s later"
                    for second, what, action, _ in engines.lines()
                    if second > ended
                )

    anyio.run(main)
    took.sort()
    sys.stdout.write(f"\nproven after: median {took[len(took) // 2]:.2f} s, max {took[-1]:.2f} s\n")
    assert late == []


@pytest.mark.parametrize("rate", [(), ("--indexing-rate", "1")])
def test_an_engine_that_indexes_while_it_runs_is_not_led(
    tmp_path: Path, rate: tuple[str, ...]
) -> None:
    engines = Engines(tmp_path, DOMAIN, rate=rate)

    async def main() -> None:
        async with engines.led() as (control, _):
            request = as_led(
                relay("refused", [(0.1, "on_true"), (0.1, "on_true")]),
                override=Override(("indexing",), "I say that it does not."),
            )
            with pytest.raises(Refused) as why:
                await control.start(request, ANN)
            assert "The engine of Ann indexes again and again" in why.value.detail
            assert "The engine of Bob indexes again and again" in why.value.detail

    anyio.run(main)
    assert engines.lines() == []
