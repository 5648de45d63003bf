"""A real engine plays sub-graphs as pieces of a led run: each outcome is that of the code inside, each
visit has a name of its own, and no code inside begins after a Stop was proven.

Needs ENGINE_LAB and UMRF_SHARED, as `test_engine_conducted.py`. `TEST_LED_OUTCOMES` is how many
outcomes are read (default 12), `TEST_LED_STOPS` how many Stops (default 2), `TEST_LED_DOMAIN` the first
domain. Figures are printed with `-s`.
"""

import itertools
import os
import random
import shutil
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

from action_assistant.runner.runs.sent_graphs import SentSubgraph
from action_assistant.runner.runs.views import time as time_of
from action_assistant.runner.start.admission import GoOnRequest, StartRequest, StepRequest
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Action, Graph
from ros.led_engines import Engines, as_led, ends_of, over, relay
from runner.harness import ANN, BEN, until
from support.real_engine import needs_engine

OUTCOMES = int(os.environ.get("TEST_LED_OUTCOMES", "12"))
STOPS = int(os.environ.get("TEST_LED_STOPS", "2"))
DOMAIN = int(os.environ.get("TEST_LED_DOMAIN", "190"))

pytestmark = [needs_engine, pytest.mark.timeout(0)]


def works(name: str, *delays: tuple[float, str]) -> Graph:
    """A graph of `OxWork` in a row without an actor, each with its delay in seconds and its result,
    which goes on after any outcome."""
    row = relay(name, [*delays], 1)
    actions = tuple(msgspec.structs.replace(each, actor="") for each in row.actions)
    return msgspec.structs.replace(row, actions=actions)


#: By outcome: two actions, of which the last one ends so; the first one ends with an error.
SUBS = {
    result: works(f"Sub{result.removeprefix('on_').title()}", (0.03, "on_error"), (0.05, result))
    for result in ("on_true", "on_false", "on_error")
}
LONG = works("SubLong2", (2.0, "on_true"), (2.0, "on_true"))


@pytest.fixture
def engines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Engines:
    """Two engines that have indexed these graphs."""
    lab, mine = Path(os.environ["ENGINE_LAB"]).resolve(), tmp_path / "lab"
    mine.mkdir()
    for name in ("wheels", "prefix"):
        (mine / name).symlink_to(lab / name)
    shutil.copytree(lab / "actions", mine / "actions")
    for each in (*SUBS.values(), LONG):
        (mine / "actions" / "subgraphs" / f"{each.name}.graph.json").write_text(codec.write(each))
    monkeypatch.setenv("ENGINE_LAB", str(mine))
    return Engines(tmp_path, DOMAIN)


def task(name: str, *subs: Graph) -> StartRequest:
    """Return the start of a graph with these sub-graphs on Scout and Carrier in turn."""
    graph = relay(name, [(0.0, "on_true")] * len(subs))
    actions = tuple(
        Action(key=each.key, name=sub.name, actor=each.actor)
        for each, sub in zip(graph.actions, subs, strict=True)
    )
    inside = {each.name: each for each in subs}
    sent = tuple(
        SentSubgraph(name=name, digest=digest(each), umrf=msgspec.Raw(codec.write(each).encode()))
        for name, each in inside.items()
    )
    return as_led(msgspec.structs.replace(graph, actions=actions), subgraphs=sent)


def test_each_outcome_of_a_sub_graph_is_that_of_the_code(engines: Engines) -> None:
    wrong: list[str] = []
    count: Counter[str] = Counter()
    orders = list(itertools.permutations(SUBS))

    async def main() -> None:
        async with engines.led() as (control, journal):
            for n in range(-(-OUTCOMES // len(SUBS))):
                results = orders[n % len(orders)]
                request = task(f"nested{n}", *(SUBS[each] for each in results))
                run = (await control.start(request, ANN)).run.id
                count[await over(control, run, 25)] += 1
                ends = ends_of(journal, run)
                for each, result in zip(ends, results, strict=False):
                    count[result] += 1
                    if (each.outcome, each.how) != (result, "shape"):
                        wrong.append(f"{each.node} of {run}: {each.outcome}, not {result}")
                if len(ends) != len(results):
                    wrong.append(f"{len(ends)} of {len(results)} in {run}")

    anyio.run(main)
    sys.stdout.write(f"\n{dict(count)}, wrong: {len(wrong)}\n")
    assert wrong == []


def test_a_step_goes_into_an_opened_sub_graph_and_over_it_on_two_engines(engines: Engines) -> None:
    async def main() -> None:
        def begun() -> int:
            return sum(line.what == "begin" for line in engines.lines())

        async with engines.led() as (control, _):
            start = msgspec.structs.replace(
                task("opened", LONG, SUBS["on_true"]),
                levels="opened",
                lost="wait",
                breakpoints=(Breakpoint(action="SubLong2_0"),),
            )
            run = (await control.start(start, ANN)).run.id

            async def held(begins: int) -> StepRequest:
                await until(lambda: begun() == begins, 30)
                await until(lambda: control.open[run].run.held is not None, 30)
                await until(lambda: bool(control.open[run].run.waits), 30)
                await anyio.sleep(1)
                found = control.open[run].run.held
                assert found is not None
                assert begun() == begins
                return StepRequest(time_of(found.at))

            await control.step(run, await held(0), ANN)
            over_it = msgspec.structs.replace(await held(1), over=("SubLong2_0",))
            await control.step(run, over_it, ANN)
            last = await held(2)
            await control.go_on(run, GoOnRequest(last.since), ANN)
            assert await over(control, run, 30) == "finished"
            assert begun() == 4

    anyio.run(main)


def test_no_code_inside_runs_after_a_stop_was_proven(engines: Engines) -> None:
    took: list[float] = []
    late: list[str] = []

    async def main() -> None:
        async with engines.led() as (control, _):
            for n in range(STOPS):
                run = (await control.start(task(f"halt{n}", LONG, SUBS["on_true"]), ANN)).run.id
                await anyio.sleep(random.Random(n).uniform(0.3, 3))
                pressed = time.time()
                await control.stop(run, BEN)
                state = await over(control, run, 30)
                ended = time.time()
                took.append(ended - pressed)
                assert state == "stopped"
                await anyio.sleep(1)
                late.extend(
                    f"{each.what} of {each.action} {each.second - ended:.3f} s later"
                    for each in engines.lines()
                    if each.second > ended
                )

    anyio.run(main)
    sys.stdout.write(f"\nproven after {max(took):.2f} s at most\n")
    assert late == []
