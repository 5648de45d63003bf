"""Stop drills on a real engine: their time to proof is that of the code of its actions, and a Stop that is
not proven makes a failed drill.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
`TEST_DRILLS_DOMAIN` is its domain, `TEST_DRILLS` how many drills pass (default 2). Figures are printed
with `-s`.
"""

import json
import os
import sys
from pathlib import Path

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.errors import Conflict
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.start.drills import DrillRequest
from action_assistant.umrf.model import Graph, Parameter
from ros.led_engines import Engines
from runner.harness import ANN, BEN, order, sequence, until
from runner.start.test_rights_registry import OLGA
from support.real_engine import needs_engine

DOMAIN = int(os.environ.get("TEST_DRILLS_DOMAIN", "196"))
DRILLS = int(os.environ.get("TEST_DRILLS", "2"))

pytestmark = [needs_engine, pytest.mark.timeout(0)]


def working(name: str, action: str) -> Graph:
    """Return a graph of one action that takes 20 seconds."""
    line = sequence(name, 1)
    inputs = (Parameter("delay", json.dumps({"pvf_type": "number", "pvf_value": 20})),)
    if action == "OxWork":
        result = json.dumps({"pvf_type": "string", "pvf_value": "on_true"})
        inputs += (Parameter("result", result),)
    one = msgspec.structs.replace(line.actions[0], name=action, inputs=inputs, outputs=())
    return msgspec.structs.replace(line, actions=(one,))


def test_a_drill_measures_the_code_of_the_action_and_an_unproven_stop_fails_it(
    tmp_path: Path,
) -> None:
    engines = Engines(tmp_path, DOMAIN, 1)
    figures: list[str] = []

    async def main() -> None:
        async with engines.led() as (control, _):
            await control.rights.set_rules("Ann", Rules(drill_days=1), OLGA)
            words = {"saw_it_stop": True, "hardware_stop": True}

            async def stopped(name: str, action: str, *, is_drill: bool) -> str:
                """Start a run, stop it while the code of its action runs, and return its id."""
                before = len(engines.lines())
                asked = order(working(name, action), engine="Ann", drill=is_drill)
                run = (await control.start(asked, ANN)).run.id
                await until(lambda: bool(control.open[run].run.active), 20)
                await until(lambda: len(engines.lines()) > before, 20)
                await anyio.sleep(0.5)
                await control.stop(run, BEN)
                return run

            with pytest.raises(Conflict, match="No Stop drill of Ann has been made"):
                await control.start(order(working("plain", "OxWork"), engine="Ann"), ANN)
            assert engines.lines() == []
            for number in range(DRILLS):
                run = await stopped(f"drill{number}", "OxWork", is_drill=number == 0)
                await until(lambda run=run: run not in control.open, 20)
                await control.record_drill("Ann", DrillRequest(run, **words), BEN)
                told = control.rights.of("Ann").drills[-1]
                assert told.failure == ""
                assert told.proof_us is not None
                ended = [each.second for each in engines.lines() if each.what == "end"][-1]
                code_s, proof_s = ended - told.stopped_at / 1e6, told.proof_us / 1e6
                figures.append(f"code ended {code_s:.3f} s, proof {proof_s:.3f} s after Stop")
                assert 0 < code_s <= proof_s < 3
            run = await stopped("stubborn", "OxStubborn", is_drill=False)
            await until(lambda: bool(control.open[run].run.unconfirmed), 40)
            await control.record_drill("Ann", DrillRequest(run, **words), BEN)
            told = control.rights.of("Ann").drills[-1]
            assert (told.proof_us, told.failure) == (None, "its Stop was not proven")
            assert engines.lines()[-1].what != "end"  # and rightly: its code still runs
            await until(lambda: engines.lines()[-1].what == "end", 40)
            await control.confirm_rest(run, RestRequest("I watched it until it stood."), BEN)
            await until(lambda: run not in control.open, 20)
            with pytest.raises(Conflict, match="failed: its Stop was not proven"):
                await control.start(order(working("after", "OxWork"), engine="Ann"), ANN)

    anyio.run(main)
    sys.stdout.write("\n" + "\n".join(figures) + "\n")
