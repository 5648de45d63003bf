"""Two real engines led with breakpoints, steps and start values: what began is what the code wrote down.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
`TEST_LEADING` is how often each is done (default 2), `TEST_LED_DOMAIN` the first domain.
"""

import os
import sys
from pathlib import Path

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.errors import Refused
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.views import run_view
from action_assistant.runner.start.admission import GoOnRequest, StepRequest
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.model import Graph, Parameter
from ros.led_engines import Engines, as_led, over, relay
from runner.harness import ANN, BEN
from support.real_engine import needs_engine

TIMES = int(os.environ.get("TEST_LEADING", "2"))
DOMAIN = int(os.environ.get("TEST_LED_DOMAIN", "184"))
#: Seconds in which nothing may begin: a start message takes 0.25 s at most.
QUIET_S = 2.0

pytestmark = [needs_engine, pytest.mark.timeout(0)]


def begun(engines: Engines) -> list[str]:
    """Return the actions whose code has begun, oldest first."""
    return [line.action for line in engines.lines() if line.what == "begin"]


async def held(control: ExecutionService, run: str, why: str) -> GoOnRequest:
    """Wait until a run is held for a reason that contains `why`; return what lets it go on."""
    with anyio.fail_after(30):
        while True:
            now = run_view(control.open[run].run).held
            if now is not None and why in now.why:
                return GoOnRequest(since=now.since)
            await anyio.sleep(0.05)


def test_no_code_begins_at_a_breakpoint_and_a_step_begins_one_action(tmp_path: Path) -> None:
    engines = Engines(tmp_path, DOMAIN)
    line = relay("halt", [(0.3, "on_true")] * 5)
    names = [each.full_name for each in line.actions]

    async def lead(control: ExecutionService) -> None:
        before = len(begun(engines))
        asked = as_led(line, breakpoints=(Breakpoint(action=names[2]),))
        run = (await control.start(asked, ANN)).run.id
        await held(control, run, f"Breakpoint before {names[2]}")
        await anyio.sleep(QUIET_S)
        assert begun(engines)[before:] == names[:2]
        seen = await held(control, run, "Breakpoint")
        await control.step(run, StepRequest(seen.since), ANN)
        await anyio.sleep(1 + QUIET_S)
        assert begun(engines)[before:] == names[:3]
        await control.go_on(run, await held(control, run, ""), ANN)
        assert await over(control, run, 25) == "finished"
        assert begun(engines)[before:] == names

    async def main() -> None:
        async with engines.led() as (control, _):
            for _ in range(TIMES):
                await lead(control)

    anyio.run(main)
    sys.stdout.write(f"\nwhat the code began: {', '.join(begun(engines))}\n")


def test_a_stop_at_a_breakpoint_is_proven_and_nothing_begins_after_it(tmp_path: Path) -> None:
    engines = Engines(tmp_path, DOMAIN + 2)
    line = relay("halted", [(0.3, "on_true")] * 4)
    names = [each.full_name for each in line.actions]

    async def lead(control: ExecutionService) -> None:
        before = len(begun(engines))
        asked = as_led(line, breakpoints=(Breakpoint(action=names[1]),))
        run = (await control.start(asked, ANN)).run.id
        seen = await held(control, run, "Breakpoint")
        await control.stop(run, BEN)
        assert await over(control, run, 20) == "stopped"
        with pytest.raises(Refused):
            await control.go_on(run, seen, ANN)
        await anyio.sleep(QUIET_S)
        assert begun(engines)[before:] == names[:1]

    async def main() -> None:
        async with engines.led() as (control, _):
            for _ in range(TIMES):
                await lead(control)

    anyio.run(main)


def open_delay(graph: Graph) -> Graph:
    """Return the graph with a first action whose delay is left open."""
    first, *others = graph.actions
    inputs = (Parameter("delay", '{"pvf_type": "number"}'), *first.inputs[1:])
    return msgspec.structs.replace(
        graph, actions=(msgspec.structs.replace(first, inputs=inputs), *others)
    )


def test_the_code_gets_the_value_that_a_person_gave_at_the_start(tmp_path: Path) -> None:
    engines = Engines(tmp_path, DOMAIN + 4)
    graph = open_delay(relay("asks", [(0.1, "on_true")] * 2))
    first = graph.actions[0].full_name
    given = [0.25 + n / 8 for n in range(TIMES)]

    async def main() -> None:
        async with engines.led() as (control, _):
            with pytest.raises(Refused, match="delay"):
                await control.start(as_led(graph), ANN)
            await anyio.sleep(QUIET_S)
            assert begun(engines) == []
            for delay in given:
                asked = as_led(graph, values={first: {"delay": delay}})
                run = (await control.start(asked, ANN)).run.id
                assert await over(control, run, 25) == "finished"

    anyio.run(main)
    texts = [path.read_text() for path in tmp_path.glob("truth-*")]
    words = [line.split() for text in texts for line in text.splitlines()]
    got = [float(delay) for _, _, what, name, delay in words if (what, name) == ("begin", first)]
    sys.stdout.write(f"\ngiven {given}, in the code {got}\n")
    assert got == given
