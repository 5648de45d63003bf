"""A Stop reaches the robot soon after the click, over real rclpy and real processes.

`TEST_STOP_CLICKS` is how many for each way and condition; by default each condition is
tried once, by one way. With `-s` the figures are printed. Each takes some seconds: a start, a stop,
and its proof.
"""

import os
import statistics
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import Any

import httpx
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from websockets.sync.client import connect

from action_assistant.runner.emulator.messages import EngineTraits, LogMessage, Said
from ros.robots import robot
from runner.harness import order, sequence
from runner.process import body
from support.product import TOKEN, Product, running
from test_stop_latency import a_frozen_editor, a_large_update, both_cores_busy, quiet

CLICKS = int(os.environ.get("TEST_STOP_CLICKS", "1"))
ENDLESS = {"*": [{"never": True}]}
#: Every snapshot arrives. Without the one of an action that obeys, it may have ended by itself and started
#: the next one, so its Stop would stay unconfirmed.
LOSSLESS = EngineTraits(loss=0.0)
Condition = Callable[[Product], AbstractContextManager[None]]


class Robot:
    """David, and when he heard a stop."""

    def __init__(self) -> None:
        self.heard: list[int] = []

    def told(self, said: Said) -> None:
        """Note the time at which the robot logs a stop."""
        if isinstance(said, LogMessage) and said.text.startswith("Received request to stop"):
            self.heard.append(time.time_ns())


@pytest.fixture
def scene(
    domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Product, Robot]]:
    monkeypatch.setenv("ACTION_ASSISTANT_LIMITS", "off")
    david = Robot()
    david_robot = robot(domain, ENDLESS, quirks=LOSSLESS, told=david.told)
    with david_robot, running(tmp_path / "data") as product:
        with product.runner() as client:
            asked = {"name": "David", "domain": domain}
            client.post("/api/robots", json=asked).raise_for_status()
            deadline = time.monotonic() + 20
            while _david(client)["state"] != "answering":
                assert time.monotonic() < deadline, _david(client)
                time.sleep(0.1)
        yield product, david


def _david(client: httpx.Client) -> dict[str, object]:
    robots: list[dict[str, object]] = client.get("/api/robots").json()
    return next(each for each in robots if each["name"] == "David")


@pytest.mark.timeout(0 if CLICKS > 5 else 180)
def test_a_robot_hears_a_stop_at_once(scene: tuple[Product, Robot]) -> None:
    product, david = scene
    conditions: list[Condition] = [quiet, both_cores_busy, a_large_update, a_frozen_editor]
    with ExitStack() as stack:
        client = stack.enter_context(product.runner())
        live = stack.enter_context(
            connect(
                f"{product.runner_url.replace('http', 'ws', 1)}/api/live",
                additional_headers={"authorization": f"Bearer {TOKEN}"},
                proxy=None,
                max_size=None,
            )
        )
        threading.Thread(target=lambda: [None for _ in live], daemon=True).start()
        ways: dict[str, Callable[[str], object]] = {
            "POST": lambda run: client.post(f"/api/runs/{run}/stop").raise_for_status(),
            "live socket": lambda run: live.send(
                msgspec.json.encode({"type": "stop", "run": run, "stop_id": run}).decode()
            ),
        }
        for turn, condition in enumerate(conditions):
            tried = list(ways.items())
            with condition(product):
                for way, press in tried if CLICKS > 1 else [tried[turn % 2]]:
                    took = sorted(_clicked(client, press, david) for _ in range(CLICKS))
                    last = took[min(len(took) - 1, CLICKS * 99 // 100)]
                    sys.stdout.write(
                        f"\n{condition.__name__:16} {way:12} n={CLICKS} "
                        f"p50={statistics.median(took):.1f} ms p99={last:.1f} ms "
                        f"max={took[-1]:.1f} ms\n"
                    )


def _clicked(client: httpx.Client, press: Callable[[str], object], david: Robot) -> float:
    """Milliseconds from a click on Stop until the robot has heard it."""
    started = client.post("/api/runs", content=body(order(sequence("patrol"), engine="David")))
    assert started.status_code == 201, started.text
    run = started.json()["id"]
    _until(client, run, lambda found: _first_action(found) == "RUNNING")
    david.heard.clear()
    clicked = time.time_ns()
    press(run)
    _until(client, run, lambda found: found["state"] == "stopped")
    return (david.heard[0] - clicked) / 1e6


def _first_action(run: dict[str, Any]) -> object:
    """Return the state in which the first action of a run was seen last."""
    return run["actions"].get("Work_0", {}).get("state")


def _until(client: httpx.Client, run: str, is_reached: Callable[[dict[str, Any]], bool]) -> None:
    """Wait until a run, as the runner tells it, meets a condition."""
    deadline = time.monotonic() + 30
    while not is_reached(found := client.get(f"/api/runs/{run}").json()):
        assert time.monotonic() < deadline, found
        time.sleep(0.02)
