"""Stand-in robots over real rclpy: on a thread of the test, or in a process that can be killed."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import EngineTraits, Said
from action_assistant.runner.emulator.node import EmulatorNode
from action_assistant.umrf.facts import PINNED, EngineFacts
from action_assistant.umrf.semantics import script_from

#: Every snapshot of such a robot arrives.
LOSSLESS = EngineTraits(loss=0.0)
_FOREIGN_START = Path(__file__).parents[2] / "frontend" / "e2e" / "foreign_start.py"


@contextmanager
def started_by_others(domain: int, graph: dict[str, Any], robot: str = "David") -> Iterator[None]:
    """Start a graph on a robot from another process of that domain, which listens as the runner
    does."""
    other = subprocess.Popen(
        [sys.executable, str(_FOREIGN_START), robot, "2"],
        stdin=subprocess.PIPE,
        env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
        text=True,
    )
    assert other.stdin is not None
    other.stdin.write(json.dumps(graph))
    other.stdin.close()
    try:
        yield
    finally:
        other.terminate()
        other.wait(10)


class LateToServe(EmulatorNode):
    """An engine that hears commands for `gap_s` before it serves its get. Between the two it takes
    nothing in."""

    def __init__(self, *given: Any, gap_s: float, **more: Any) -> None:
        self._gap_s = gap_s
        super().__init__(*given, **more)

    def _listen(self, facts: EngineFacts, depth: int) -> None:
        super()._listen(facts, depth)
        time.sleep(self._gap_s)


@contextmanager
def robot(
    domain: int,
    script: dict[str, Any] | None = None,
    *,
    name: str = "David",
    namespace: str = "",
    quirks: EngineTraits = EngineTraits(),  # noqa: B008 - frozen
    seed: int = 0,
    told: Callable[[Said], None] = lambda _: None,
    gap_s: float = 0.0,
) -> Iterator[EmulatorNode]:
    """A robot on a thread."""
    node = LateToServe(
        lambda epoch_ms: EmulatedEngine(
            name,
            script=script_from({"behaviours": script or {}}),
            quirks=quirks,
            seed=seed,
            epoch_ms=epoch_ms,
        ),
        domain=domain,
        facts=PINNED,
        namespace=namespace,
        told=told,
        gap_s=gap_s,
    )
    thread = threading.Thread(target=node.spin, daemon=True)
    thread.start()
    try:
        yield node
    finally:
        node.end()
        thread.join(10)


class RobotProcess:
    """A robot as people start one: `simulate-robot`."""

    def __init__(
        self,
        domain: int,
        folder: Path,
        script: dict[str, Any],
        *more: str,
        name: str = "David",
        wrapper: tuple[str, ...] = (),
    ) -> None:
        file = folder / "script.json"
        file.write_bytes(msgspec.json.encode({"behaviours": script}))
        command = [*wrapper, sys.executable, "-m", "action_assistant", "simulate-robot", name]
        self._process = subprocess.Popen(
            [*command, "--domain", str(domain), "--script", str(file), *more],
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ,
        )
        assert self._process.stdout is not None
        self.first = self._process.stdout.readline()

    def signal(self, number: int) -> None:
        """Send a signal."""
        self._process.send_signal(number)

    def end(self) -> int:
        """End it, dead or alive; its exit code."""
        self._process.send_signal(signal.SIGCONT)
        self._process.terminate()
        try:
            return self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()
        finally:
            assert self._process.stdout is not None
            self._process.stdout.close()
