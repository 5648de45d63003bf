"""Three robots, emulated or real, are led over a network that delays and loses messages, with gaps of
seconds.

`TEST_LONG` runs it, as root with /dev/net/tun; `TEST_ROUGH_S` is for how long (default 60),
`TEST_ROUGH` the delay in ms, the share of lost frames and the longest gap in seconds (default 20 0.05 4).
Real engines need ENGINE_LAB and UMRF_SHARED; the code of their actions writes down what it does.
"""

import os
import subprocess
import sys
import time
from collections import Counter
from contextlib import ExitStack
from pathlib import Path

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.errors import Refused
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import Ended, Override, PieceBegan, PieceEnded, Published
from action_assistant.runner.runs.views import time as as_text
from action_assistant.runner.start.admission import GoOnRequest
from ros.led_engines import ACCEPTED, PLAYERS, Engines, Line, as_led, watch
from ros.led_runner import is_over, led_runner
from ros.robots import RobotProcess
from ros.test_engine_led_faults import Told
from runner.harness import ANN, BEN, MemoryJournal
from support.real_engine import needs_engine

SECONDS = float(os.environ.get("TEST_ROUGH_S", "60"))
ROUGH = os.environ.get("TEST_ROUGH", "20 0.05 4").split()
ROBOTS = os.environ.get("ROUGH_NETWORK", "")  # inside: the process whose network robots enter
SCRIPT = {
    "OxWork_0": [{"never": True}],
    "OxWork_1": [{"after_s": 0.15}],
    "OxWork_2": [{"after_s": 0.15, "result": "on_false"}],
}


def belied(told: Told, lines: list[Line], count: Counter[str]) -> list[str]:
    """Return what the code of the actions belies: more begins than pieces that left, and anything that
    it did after its piece, and the whole run, was called over. `lines`: what it did since the start."""
    found: list[str] = []
    left = Counter(told.pieces[piece][1] for _, piece, _ in told.published())
    begun = Counter(line.action for line in lines if line.what == "begin")
    count["begun by the code"] += begun.total()
    found += [
        f"{node} has begun {begun[node]} times and left {left[node]} times"
        for node in begun
        if begun[node] > left[node]
    ]
    over = next(each.at for each in told.run if isinstance(each, Ended))
    found += [f"{line} after the end of the run" for line in lines if line.second * 1e6 > over]
    for at, piece, state in told.ends():
        node = told.pieces[piece][1]
        later = [each for each, other, _ in told.published() if told.pieces[other][1] == node]
        until = min((each for each in later if each > at), default=over)
        found += [
            f"{line} after its piece was {state}"
            for line in lines
            if line.action == node and at < line.second * 1e6 < until
        ]
    count["ends compared with the code"] += len(told.ends())
    return found


pytestmark = [pytest.mark.long, pytest.mark.timeout(0)]


@pytest.mark.parametrize("kind", ["emulated", pytest.param("real", marks=needs_engine)])
def test_led_runs_over_a_rough_network(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    if not ROBOTS:
        if os.geteuid() != 0 or not Path("/dev/net/tun").exists():
            pytest.skip("it needs root and /dev/net/tun")
        program = Path(__file__).with_name("rough_network.py")
        test = f"{__file__}::{request.node.name}"
        inside = [sys.executable, "-m", "pytest", "-q", "-s", "-m", "long", test]
        done = subprocess.run([sys.executable, str(program), *ROUGH, *inside], check=False)
        assert done.returncode == 0
        return
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    monkeypatch.setenv("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")
    # Engines of another network show no process, so a person says how they index.
    more = ("indexing",) if kind == "real" else ()
    accepted = Override((*ACCEPTED.codes, *more), ACCEPTED.reason)
    count: Counter[str] = Counter()
    failed: list[str] = []
    proven: list[float] = []
    enters = ("nsenter", "--target", ROBOTS, "--net")
    engines = Engines(tmp_path, 30, len(PLAYERS), enters=enters)
    names = engines.names

    async def lead(control: ExecutionService, journal: MemoryJournal, until: float) -> None:
        before = len(engines.lines())
        asked = as_led(watch("watch"), lost="wait", override=accepted)
        run = (await control.start(asked, ANN)).run.id
        count["runs"] += 1
        last = time.monotonic() + 15
        while time.monotonic() < min(last, until) and run in control.open:
            held = control.open[run].run.held
            if held is not None:
                count["held"] += 1
                try:
                    await control.go_on(run, GoOnRequest(as_text(held.at)), BEN)
                    count["went on"] += 1
                except Refused:
                    await anyio.sleep(1)
            await anyio.sleep(0.1)
        pressed = time.monotonic()
        if run in control.open:
            await control.stop(run, BEN)
        if not await is_over(control, run, 60):
            failed.append(f"{run} cannot be stopped: {control.open[run].run}")
            return
        proven.append(time.monotonic() - pressed)
        await anyio.sleep(0.5)
        told = journal.told(run)
        for each in told:
            if isinstance(each, PieceBegan):
                left = sum(isinstance(one, Published) for one in journal.told(each.piece))
                count["pieces"] += left
                if left > 1:
                    failed.append(f"{each.piece} left {left} times")
            if isinstance(each, PieceEnded) and each.outcome != "on_stopped":
                count["outcomes"] += 1
                if each.outcome != ("on_false" if each.node == "OxWork_2" else "on_true"):
                    failed.append(f"{each.node} ended {each.outcome}")
        count[f"ended {journal.history(run).state}"] += 1
        if kind == "real":
            await anyio.sleep(2)
            failed.extend(belied(Told(journal, run), engines.lines()[before:], count))

    async def main() -> None:
        async with led_runner(names) as (control, journal):
            until = time.monotonic() + SECONDS
            while time.monotonic() < until:
                try:
                    await lead(control, journal, until)
                except Refused as refused:
                    count["start refused"] += 1
                    last.append(refused.detail)
                    await anyio.sleep(1)

    last: list[str] = []
    with ExitStack() as opened:
        opened.callback(engines.end)
        for name, domain in names.items():
            if kind == "real":
                engines.start(name)
                continue
            process = RobotProcess(
                domain, tmp_path, SCRIPT, "--quirk", "loss=0", name=name, wrapper=enters
            )
            opened.callback(process.end)
        anyio.run(main)
    proven.sort()
    sys.stdout.write(f"\n{dict(count)} {last[-1:]}\n")
    assert proven, "no run was led"
    sys.stdout.write(f"Stop proven: n={len(proven)} median={proven[len(proven) // 2]:.2f} s ")
    sys.stdout.write(f"max={proven[-1]:.2f} s\n")
    assert failed == []
