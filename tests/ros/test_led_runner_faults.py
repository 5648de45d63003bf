"""The runner's process is frozen, killed or its clock is moved in the middle of a run that it leads: the run
is held, nothing begins until a person lets it go on, and Stop works after that.

The runner is a process; the robots are emulated ones over rclpy or, where ENGINE_LAB and UMRF_SHARED name a
built engine, real ones as well, whose code says what it did. `TEST_LED_FAULTS` is how often each fault is
tried (default 1), from the seed `TEST_LED_FROM` on; `TEST_LED_DOMAIN` the first domain of real engines. A
clock is moved by libfaketime.
"""

import os
import random
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.emulator.messages import LogMessage, Said
from ros.led_engines import ACCEPTED, PLAYERS, Engines, as_led, register, watch
from ros.robots import LOSSLESS, robot
from runner.process import RunnerProcess, over, started
from support.real_engine import IS_HERE
from support.waiting import until

FAULTS = int(os.environ.get("TEST_LED_FAULTS", "1"))
FROM = int(os.environ.get("TEST_LED_FROM", "0"))
DOMAIN = int(os.environ.get("TEST_LED_DOMAIN", "220"))
HEARD_S = 1.0  # within which robots note a start that had left, also on a busy computer
FAKETIME = next(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1"), None)
SCRIPT: dict[str, Any] = {
    "OxWork_0": [{"never": True}],
    "OxWork_1": [{"after_s": 0.15}],
    "OxWork_2": [{"after_s": 0.15, "result": "on_false"}],
}

pytestmark = pytest.mark.timeout(0 if FAULTS > 1 else 300)


class Begun:
    """Records when actions begin: emulated robots hear that, and the code of real ones writes it down."""

    def __init__(self) -> None:
        self.engines: Engines | None = None
        self._heard: list[float] = []

    def told(self, said: Said) -> None:
        """Note that an emulated robot hears a start."""
        if isinstance(said, LogMessage) and said.text.startswith("Received request to start"):
            self._heard.append(time.time())

    def times(self) -> list[float]:
        """Return the times at which actions have begun, in seconds UTC, oldest first."""
        if self.engines is None:
            return list(self._heard)
        return [line.second for line in self.engines.lines() if line.what == "begin"]

    def since(self, second: float) -> list[float]:
        """Return the time from `second` to the begin of each later action, in seconds."""
        return [round(each - second, 3) for each in self.times() if each > second]


@contextmanager
def robots_of(
    kind: str, domains: list[int], folder: Path
) -> Iterator[tuple[Begun, dict[str, int]]]:
    """Open three robots; yield the record of what begins on them, and their domains by name."""
    begun = Begun()
    if kind == "real":
        engines = begun.engines = Engines(folder, DOMAIN, 3)
        try:
            for name in engines.names:
                engines.start(name)
            yield begun, engines.names
        finally:
            engines.end()
        return
    names = dict(zip(PLAYERS.values(), domains, strict=False))
    with ExitStack() as opened:
        for name, domain in names.items():
            opened.enter_context(robot(domain, SCRIPT, name=name, quirks=LOSSLESS, told=begun.told))
        yield begun, names


def frozen(runner: RunnerProcess, chance: random.Random, _: Path) -> None:
    """Freeze the process of the runner for more than 3 s."""
    os.kill(runner.pid, signal.SIGSTOP)
    time.sleep(chance.uniform(3.6, 6))
    os.kill(runner.pid, signal.SIGCONT)


def killed(runner: RunnerProcess, chance: random.Random, _: Path) -> None:
    """Kill the runner, and start it again."""
    runner.kill()
    time.sleep(chance.uniform(0, 2))
    runner.start()


def moved(runner: RunnerProcess, chance: random.Random, offset: Path) -> None:
    """Move the clock of the runner's process by an hour."""
    offset.write_text(f"{chance.choice([-3600, 3600]):+d}")


def clock_at(offset: Path) -> tuple[str, ...]:
    """Return the wrapper of a process whose clock can be moved by writing to a file."""
    offset.write_text("+0")
    return (
        "env",
        f"LD_PRELOAD={FAKETIME}",
        f"FAKETIME_TIMESTAMP_FILE={offset}",
        "FAKETIME_NO_CACHE=1",
        "DONT_FAKE_MONOTONIC=1",
        "FAKETIME_DONT_FAKE_MONOTONIC=1",
    )


Fault = Callable[[RunnerProcess, random.Random, Path], None]


class Scene:
    """One led run, as a client of the runner that leads it."""

    def __init__(self, client: httpx.Client, begun: Begun, domains: dict[str, int]) -> None:
        self.client = client
        self.begun = begun
        register(client, domains)
        # On a busy computer a robot may be silent for seconds. That is not what is tried here, and stops nothing.
        asked = as_led(watch("watch"), override=ACCEPTED, lost="wait")
        self.run = started(client, asked)["id"]
        until("no turns are taken", self._takes_turns, 60, self.shown)

    def _takes_turns(self) -> bool:
        if len(self.begun.times()) > 4:
            return True
        self._press_go_on()
        return False

    def _press_go_on(self) -> bool:
        """Let it go on if it is held; return whether that was taken."""
        held = self.shown()["held"]
        way, since = f"/api/runs/{self.run}/go_on", {"since": held and held["since"]}
        return held is not None and self.client.post(way, json=since).is_success

    def shown(self) -> dict[str, Any]:
        """Return the run as the runner shows it."""
        found: dict[str, Any] = self.client.get(f"/api/runs/{self.run}").json()
        return found

    def wait_until_held(self) -> None:
        """Wait until the runner shows that nothing further begins."""
        until("it is not held", lambda: self.shown()["held"] is not None, shown=self.shown)

    def go_on(self) -> None:
        """Let it go on, and see that robots take turns again."""
        at = time.time()
        until("it may not go on", self._press_go_on, shown=self.shown)
        until("nothing goes on", lambda: self._goes_on(at), 60, self.shown)

    def _goes_on(self, at: float) -> bool:
        if len(self.begun.since(at)) > 3:
            return True
        self._press_go_on()
        return False

    def stop(self) -> str:
        """Stop it; return its state once it has ended. Nothing may begin after that."""
        self.client.post(f"/api/runs/{self.run}/stop").raise_for_status()
        return str(over(self.client, self.run, 60)["state"])


@pytest.mark.parametrize(
    "fault",
    [frozen, pytest.param(killed, marks=pytest.mark.long), moved],
    ids=lambda each: each.__name__,
)
@pytest.mark.parametrize("kind", ["emulated", "real"])
def test_a_led_run_is_held_and_begins_nothing(
    kind: str, fault: Fault, domains: list[int], tmp_path: Path
) -> None:
    if kind == "real" and not IS_HERE:
        pytest.skip("the real engine is not here (ENGINE_LAB, UMRF_SHARED)")
    if fault is moved and FAKETIME is None:
        pytest.skip("libfaketime is not here")
    held_s: list[float] = []
    for seed in range(FROM, FROM + FAULTS):
        chance = random.Random(f"{seed} {kind} {fault.__name__}")
        folder = tmp_path / str(seed)
        folder.mkdir()
        offset = folder / "offset"
        runner = RunnerProcess(folder / "runner")
        with robots_of(kind, domains, folder) as (begun, names):
            try:
                runner.start(*(clock_at(offset) if fault is moved else ()))
                with runner.client() as client:
                    scene = Scene(client, begun, names)
                    time.sleep(chance.uniform(0, 0.5))
                    fault(runner, chance, offset)
                    over_at = time.time()
                    scene.wait_until_held()
                    held_at = time.time()
                    held_s.append(held_at - over_at)
                    time.sleep(2.5)
                    assert scene.shown()["state"] in {"running", "unknown"}, scene.shown()
                    assert begun.since(held_at + HEARD_S) == [], seed
                    if chance.random() < 0.6:
                        scene.go_on()
                    assert scene.stop() == "stopped", (seed, scene.shown())
                    ended = time.time()
                    time.sleep(1)
                    assert begun.since(ended) == [], seed
            finally:
                runner.end()
    sys.stdout.write(
        f"\n{kind} robots, {fault.__name__}: {len(held_s)} of {FAULTS} held, "
        f"at most {max(held_s):.1f} s after\n"
    )


def test_a_stop_that_was_pressed_while_the_runner_stood_still_works(
    domains: list[int], tmp_path: Path
) -> None:
    runner = RunnerProcess(tmp_path / "runner").start()
    with robots_of("emulated", domains, tmp_path) as (begun, names):
        try:
            with runner.client() as client:
                scene = Scene(client, begun, names)
                os.kill(runner.pid, signal.SIGSTOP)
                answered: list[int] = []
                way = f"/api/runs/{scene.run}/stop"
                pressed = threading.Thread(
                    target=lambda: answered.append(client.post(way).status_code)
                )
                pressed.start()
                time.sleep(4)
                os.kill(runner.pid, signal.SIGCONT)
                thawed = time.time()
                pressed.join()
                assert answered == [202]
                until(
                    "it is not stopped",
                    lambda: scene.shown()["state"] == "stopped",
                    shown=scene.shown,
                )
                time.sleep(0.5)
                assert begun.since(thawed + HEARD_S) == []
        finally:
            runner.end()


def test_a_run_that_waits_survives_a_kill_of_the_runner_and_makes_one_step(
    domains: list[int], tmp_path: Path
) -> None:
    runner = RunnerProcess(tmp_path / "runner").start()
    with robots_of("emulated", domains, tmp_path) as (begun, names):
        try:
            with runner.client() as client:
                scene = Scene(client, begun, names)
                way = f"/api/runs/{scene.run}/wait"
                client.post(way, json={"reason": "Look."}).raise_for_status()
                waits_from = time.time() + HEARD_S
                runner.kill()
                runner.start()
            with runner.client() as client:
                scene.client = client
                scene.wait_until_held()
                assert "made it wait: Look." in scene.shown()["held"]["why"]
                until("nothing is ready", lambda: scene.shown()["held"].get("next"), 15)
                assert begun.since(waits_from) == []
                at, since = time.time(), {"since": scene.shown()["held"]["since"]}
                post, way = client.post, f"/api/runs/{scene.run}/step"
                until("no step is made", lambda: post(way, json=since).is_success, 15, scene.shown)
                until("nothing begins", lambda: begun.since(at), 15, scene.shown)
                scene.wait_until_held()
                time.sleep(2.5)
                assert len(begun.since(at)) == 1
                assert scene.stop() == "stopped"
                ended = time.time()
                time.sleep(1)
                assert begun.since(ended) == []
        finally:
            runner.end()
