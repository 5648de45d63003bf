"""Real engines that one runner of this process leads. The code of their actions writes down what it does.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
"""

import json
import math
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from typing import NamedTuple

import anyio
import httpx
import msgspec

from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import Override, PieceEnded
from action_assistant.runner.start.admission import StartRequest
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Parameter,
    Relation,
)
from ros.led_runner import is_over, led_runner
from runner.harness import ANN, BEN, MemoryJournal, order, sequence
from support.real_engine import PROGRAM, answers
from support.waiting import until

ALWAYS = Conditions(on_true="run", on_false="run", on_error="run")
#: The robot of each actor.
PLAYERS = {"Scout": "Ann", "Carrier": "Bob", "Guard": "Cy"}
ACCEPTED = Override(("two-at-once", "stop-across", "H12", "H14"), "They are far apart.")
LATE_S = 0.25  # from a start message to the begin of the code, on a busy computer


#: Starts the engine's program so that it hears other hosts: it names this host alone by itself.
ON_SUBNET = """
import os, runpy, sys
execve = os.execve
more = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}
os.execve = lambda program, words, environ: execve(program, words, environ | more)
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
"""


class Line(NamedTuple):
    """An entry that the code of an action wrote: at `second` UTC it did `what` (begin, end, stop …), in
    the process `pid`."""

    second: float
    what: str
    action: str
    pid: int


class Engines:
    """Real engines, one for each robot, on domains from `domain` on. `rate`: their options about
    indexing; `enters`: the command that runs them in another network."""

    def __init__(
        self,
        folder: Path,
        domain: int,
        count: int = 2,
        *,
        rate: tuple[str, ...] = ("--indexing-rate", "0"),
        enters: tuple[str, ...] = (),
    ) -> None:
        self.folder = folder
        self.enters = enters
        self.rate = rate
        self.domain = domain
        self.names = {name: domain + n for n, name in enumerate([*PLAYERS.values()][:count])}
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        #: From when to when engines were frozen, in seconds UTC, by robot.
        self.frozen: dict[str, list[tuple[float, float]]] = {}

    def lines(self) -> list[Line]:
        """Return the entries of the code of all actions, oldest first."""
        found: list[Line] = []
        for name in self.names:
            path = self.folder / f"truth-{name}"
            for line in path.read_text().splitlines() if path.exists() else ():
                second, pid, what, action, _ = line.split()
                found.append(Line(float(second), what, action, int(pid)))
        return sorted(found)

    def start(self, name: str) -> None:
        """Start the engine of a robot."""
        inside = ["-c", ON_SUBNET] if self.enters else []
        command = [*self.enters, sys.executable, *inside, str(PROGRAM), name, str(self.names[name])]
        command += [*self.rate, "--truth", str(self.folder / f"truth-{name}")]
        with (self.folder / f"engine-{name}.log").open("a") as log:
            self.processes[name] = subprocess.Popen(command, stdout=log, stderr=log)

    def kill(self, name: str) -> None:
        """Kill the engine of a robot (SIGKILL)."""
        self.processes[name].kill()
        self.processes[name].wait()

    def freeze(self, name: str) -> None:
        """Freeze the engine of a robot (SIGSTOP)."""
        self.processes[name].send_signal(signal.SIGSTOP)
        self.frozen.setdefault(name, []).append((time.time(), math.inf))

    def thaw(self, name: str) -> None:
        """Let a frozen engine go on (SIGCONT)."""
        since, _ = self.frozen[name].pop()
        self.frozen[name].append((since, time.time()))
        self.processes[name].send_signal(signal.SIGCONT)

    def dead(self) -> list[str]:
        """Return the robots whose engine has ended."""
        return [name for name, each in self.processes.items() if each.poll() is not None]

    def end(self) -> None:
        """Kill all engines."""
        for name in self.processes:
            self.kill(name)

    @asynccontextmanager
    async def led(self) -> AsyncIterator[tuple[ExecutionService, MemoryJournal]]:
        """Open a runner that may lead them."""
        for name in self.names:
            self.start(name)
        try:
            async with led_runner(self.names) as opened:
                yield opened
        finally:
            self.end()


def working(like: Action, actor: str, delay: float, result: str = "on_true") -> Action:
    """Return `OxWork` that takes `delay` seconds and ends in this outcome."""
    return msgspec.structs.replace(
        like,
        name="OxWork",
        actor=actor,
        inputs=(
            Parameter("delay", json.dumps({"pvf_type": "number", "pvf_value": delay})),
            Parameter("result", json.dumps({"pvf_type": "string", "pvf_value": result})),
        ),
    )


def relay(name: str, works: list[tuple[float, str]], count: int = 2) -> Graph:
    """`OxWork` on the robots in turn, each with its delay in seconds and its result."""
    line = sequence(name, len(works))
    actors = [*PLAYERS]
    actions = tuple(
        working(each, actors[number % count], *work)
        for number, (each, work) in enumerate(zip(line.actions, works, strict=True))
    )
    relations = tuple(
        each if each.parent == "entry" else msgspec.structs.replace(each, conditions=ALWAYS)
        for each in line.relations
    )
    return msgspec.structs.replace(line, actions=actions, relations=relations)


def watch(name: str) -> Graph:
    """Scout works for a minute, while Carrier and Guard take turns of 0.15 s for ever."""
    line = sequence(name, 3)
    long, one, other = line.actions
    actions = (
        working(long, "Scout", 60),
        working(one, "Carrier", 0.15),
        working(other, "Guard", 0.15, "on_false"),
    )
    relations = (
        *(each for each in line.relations if each.parent == ENTRY),
        Relation(parent=ENTRY, child=one.key, conditions=ENTRY_CONDITIONS),
        Relation(parent=one.key, child=other.key, conditions=ALWAYS, required=False),
        Relation(parent=other.key, child=one.key, conditions=ALWAYS, required=False),
        msgspec.structs.replace(line.relations[-1], parent=long.key),
    )
    return msgspec.structs.replace(line, actions=actions, relations=relations)


def as_led(graph: Graph, **more: object) -> StartRequest:
    """A start in which the runner leads the robots of the graph's actors."""
    robots = {actor: PLAYERS[actor] for actor in sorted({each.actor for each in graph.actions})}
    return order(graph, engine="conducted", graph=None, robots=robots, **more)


def going_round(graph: Graph) -> Graph:
    """Return the graph with an arrow from its second action back to its first instead of an exit."""
    first, second = (each.key for each in graph.actions)
    back = Relation(parent=second, child=first, conditions=ALWAYS, required=False)
    kept = tuple(each for each in graph.relations if each.child != EXIT)
    return msgspec.structs.replace(graph, relations=(*kept, back))


async def led_round(
    control: ExecutionService, journal: MemoryJournal, graph: Graph, laps: int
) -> list[PieceEnded]:
    """Lead two actions that go round until each has ended so many times, and stop them; return all
    ends."""
    run = (await control.start(as_led(graph), ANN)).run.id
    with anyio.fail_after(20 + 4 * laps):
        while len(ends_of(journal, run)) < 2 * laps:
            assert run in control.open, journal.history(run)
            await anyio.sleep(0.1)
    await control.stop(run, BEN)
    assert await over(control, run, 20) == "stopped"
    return ends_of(journal, run)


def ends_of(journal: MemoryJournal, run: str) -> list[PieceEnded]:
    """Return the ends of the pieces of a run."""
    return [each for each in journal.told(run) if isinstance(each, PieceEnded)]


async def over(control: ExecutionService, run: str, seconds: float) -> str:
    """Wait for the end of a run, and return its state."""
    assert await is_over(control, run, seconds), "\n".join(
        f"{each.run.id} {each.run.state} {each.run.graph_state} {each.watch.trouble} "
        f"{each.run.alarms} {[(a.state, a.visits) for a in each.run.actions.values()]}"
        for each in control.open.values()
    )
    return (await control.find(run)).state


def register(client: httpx.Client, domains: Mapping[str, int]) -> None:
    """Register robots that may be led at a runner, and wait until they answer. `domains`: by name."""
    for name, domain in domains.items():
        asked = {"name": name, "domain": domain, "led": True}
        client.post("/api/robots", json=asked).raise_for_status()
    until("not all robots answer", lambda: all(answers(client, name) for name in domains))
