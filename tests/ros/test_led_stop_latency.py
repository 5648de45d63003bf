"""A Stop of a led run reaches three robots soon after the click, also while one of them is frozen.

Real processes: the runner, and robots over rclpy, which are emulated ones or, where ENGINE_LAB and
UMRF_SHARED name a built engine, real ones whose code writes down when it is told to stop.
`TEST_STOP_CLICKS` is how many (default 1), `TEST_STOP_VALUES` a folder in which the values of several runs
are collected, `TEST_LED_DOMAIN` the first domain of real engines. With `-s` the figures are printed.
"""

import itertools
import json
import os
import signal
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.emulator.messages import LogMessage, Said
from action_assistant.umrf.model import ENTRY, ENTRY_CONDITIONS, Graph, Relation
from ros.led_engines import ACCEPTED, PLAYERS, Engines, as_led, register, working
from ros.robots import LOSSLESS, RobotProcess, robot
from runner.harness import sequence
from runner.process import RunnerProcess, over, started
from support.real_engine import IS_HERE
from support.waiting import until

CLICKS = int(os.environ.get("TEST_STOP_CLICKS", "1"))
VALUES = os.environ.get("TEST_STOP_VALUES", "")
DOMAIN = int(os.environ.get("TEST_LED_DOMAIN", "224"))
ENDLESS = {"*": [{"never": True}]}
FROZEN = "Cy"

pytestmark = pytest.mark.timeout(0 if CLICKS > 1 else 180)


def at_once(number: int) -> Graph:
    """Three actions that begin at once, one for each robot."""
    line = sequence(f"together{number}", 3)
    actions = tuple(
        working(each, actor, 600) for each, actor in zip(line.actions, PLAYERS, strict=True)
    )
    relations = (
        *(Relation(parent=ENTRY, child=each.key, conditions=ENTRY_CONDITIONS) for each in actions),
        line.relations[-1],
    )
    return msgspec.structs.replace(line, actions=actions, relations=relations)


class Heard:
    """Records when robots hear a stop, in seconds UTC by robot."""

    def __init__(self) -> None:
        self.at: dict[str, list[float]] = defaultdict(list)
        self.engines: Engines | None = None
        self.freeze: Callable[[], None] = lambda: None
        self.thaw: Callable[[], None] = lambda: None

    def by(self, name: str) -> Callable[[Said], None]:
        """Return a listener that notes the stops in the log of an emulated robot."""

        def told(said: Said) -> None:
            if isinstance(said, LogMessage) and said.text.startswith("Received request to stop"):
                self.at[name].append(time.time())

        return told

    def after(self, name: str, clicked: float) -> float | None:
        """Return the time from the click until this robot has heard a stop, in ms; None if it has not."""
        if self.engines is not None:
            robot = list(PLAYERS.values()).index(name)
            times = [
                line.second
                for line in self.engines.lines()
                if line.what == "stop" and line.action == f"OxWork_{robot}"
            ]
        else:
            times = self.at[name]
        later = [each for each in times if each > clicked]
        return 1000 * (min(later) - clicked) if later else None


@contextmanager
def three_robots(kind: str, domains: list[int], folder: Path, *, freezes: bool) -> Iterator[Any]:
    """Open three robots; yield the record of the stops that they hear, and their domains by name."""
    heard = Heard()
    with ExitStack() as opened:
        if kind == "real":
            engines = heard.engines = Engines(folder, DOMAIN, 3)
            opened.callback(engines.end)
            for name in engines.names:
                engines.start(name)
            heard.freeze, heard.thaw = (
                lambda: engines.freeze(FROZEN),
                lambda: engines.thaw(FROZEN),
            )
            yield heard, engines.names
            return
        names = dict(zip(PLAYERS.values(), domains, strict=False))
        for name, domain in names.items():
            if freezes and name == FROZEN:
                process = RobotProcess(domain, folder, ENDLESS, "--quirk", "loss=0", name=name)
                opened.callback(process.end)
                heard.freeze, heard.thaw = (
                    lambda process=process: process.signal(signal.SIGSTOP),
                    lambda process=process: process.signal(signal.SIGCONT),
                )
            else:
                told = heard.by(name)
                opened.enter_context(robot(domain, ENDLESS, name=name, quirks=LOSSLESS, told=told))
        yield heard, names


def shown(client: httpx.Client, run: str) -> dict[str, Any]:
    """Return a run or piece as the runner shows it."""
    found: dict[str, Any] = client.get(f"/api/runs/{run}").json()
    return found


def all_move(run: dict[str, Any]) -> bool:
    """Return whether all three actions of a run are shown as running."""
    states = [each["state"] for each in run["actions"].values()]
    return states == ["RUNNING"] * 3


def of_events(client: httpx.Client, run: str, kind: str) -> list[float]:
    """Return when the events of this kind of a run or piece happened, in seconds UTC."""
    told = client.get(f"/api/runs/{run}/events").text.split("\n\n")
    found = []
    for each in told:
        if f"event: {kind}" in each:
            data = next(line for line in each.splitlines() if line.startswith("data: "))
            stored = json.loads(data.removeprefix("data: "))
            found.append(stored.get("body", stored)["at"] / 1e6)
    return found


def figures(what: str, values: list[float]) -> str:
    """Return n, p50, p99 and maximum of times in ms."""
    took = sorted(values)
    last = took[min(len(took) - 1, len(took) * 99 // 100)]
    middle = statistics.median(took)
    return f"{what:9} n={len(took)} p50={middle:.1f} p99={last:.1f} max={took[-1]:.1f} ms\n"


@pytest.mark.parametrize("freezes", [False, True], ids=["all answer", "one is frozen"])
@pytest.mark.parametrize("kind", ["emulated", "real"])
def test_a_stop_reaches_every_robot_at_once(
    kind: str, freezes: bool, domains: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if kind == "real" and not IS_HERE:
        pytest.skip("the real engine is not here (ENGINE_LAB, UMRF_SHARED)")
    monkeypatch.setenv("ACTION_ASSISTANT_LIMITS", "off")
    times: dict[str, list[float]] = {"left": [], "heard": [], "proven": []}
    file = Path(VALUES or tempfile.gettempdir()) / f"{kind}-{'frozen' if freezes else 'all'}.json"
    if VALUES and file.exists():
        times = json.loads(file.read_text())
    listening = [each for each in PLAYERS.values() if not (freezes and each == FROZEN)]
    runner = RunnerProcess(tmp_path / "runner").start()
    with three_robots(kind, domains, tmp_path, freezes=freezes) as (heard, names):
        try:
            with runner.client() as client:
                register(client, names)
                for number in range(CLICKS):
                    _click(client, number, heard, listening, times, freezes=freezes)
        finally:
            heard.thaw()
            runner.end()
    if VALUES:
        file.write_text(json.dumps(times))
    load = "/".join(f"{each:.1f}" for each in os.getloadavg())
    sys.stdout.write(f"\n{kind}, {'one frozen' if freezes else 'all answer'}, load {load}\n")
    sys.stdout.write("".join(itertools.starmap(figures, times.items())))


def _click(
    client: httpx.Client,
    number: int,
    heard: Heard,
    listening: list[str],
    times: dict[str, list[float]],
    *,
    freezes: bool,
) -> None:
    """Start a run, stop it once all robots move, and add its times in ms after the click."""
    run = started(client, as_led(at_once(number), override=ACCEPTED))["id"]
    show = partial(shown, client, run)
    until("not all robots move", lambda: all_move(show()), shown=show)
    actions = show()["actions"].values()
    pieces = {each["robot"]: each["piece"] for each in actions}
    if freezes:
        heard.freeze()
    clicked = time.time()
    client.post(f"/api/runs/{run}/stop").raise_for_status()
    for name in listening:
        over(client, pieces[name])
    if freezes:
        assert show()["ended_at"] is None, "a frozen robot is proven"
        heard.thaw()
    assert over(client, run)["state"] == "stopped"
    for name in listening:
        after = heard.after(name, clicked)
        assert after is not None, name
        times["heard"].append(after)
        times["left"].append(
            1000 * (of_events(client, pieces[name], "run.stop_sent.v1")[0] - clicked)
        )
        times["proven"].append(
            1000 * (of_events(client, pieces[name], "run.ended.v1")[0] - clicked)
        )
