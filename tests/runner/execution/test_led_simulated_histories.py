"""Random histories of led runs in the simulator: waits, steps, breakpoints, restarts and Stops, in virtual
time. Seeds that failed are kept as examples."""

import random
from collections import Counter
from contextlib import suppress

import anyio
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as some

from action_assistant.errors import Refused
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import (
    Held,
    PlayBegan,
    Released,
    RunEvent,
    StopRequested,
)
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import (
    BreakpointsRequest,
    GoOnRequest,
    StepRequest,
    WaitRequest,
)
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics import Script, simulate
from action_assistant.umrf.semantics.trace import NodeResultEvent
from runner.execution.test_led_simulated import simulated
from runner.harness import (
    ANN,
    BEN,
    Harness,
    carousel,
    ended,
    run_in_virtual_time,
    sequence,
    two_lines,
)
from support.doses import examples

PRESSES = ("wait", "go on", "step", "until", "marks", "restart", "rest", "rest")


class History:
    """One led run in the simulator, and what people press, as a seed decides."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.harness = Harness()
        self.graph: Graph = self.chance.choice((sequence("task", 5), two_lines(), carousel()))
        self.run = ""
        self.is_stopped = False

    async def live(self) -> None:
        """Live through all presses, and then let the run go on until it has ended, or stop it."""
        rest = [self.chance.choice(PRESSES) for _ in range(self.chance.randint(3, 14))]
        while True:
            async with self.harness.runner() as control:
                if not self.run:
                    started = await control.start(simulated(self.graph, *self.marks()), ANN)
                    self.run = started.run.id
                while rest and (press := rest.pop()) != "restart":
                    await anyio.sleep(self.chance.random() * 3)
                    if self.run in control.open:
                        with suppress(Refused):
                            await self.press(control, press)
                if not rest:
                    await self._end(control)
                    return
                if self.run not in control.open:
                    return

    def marks(self) -> tuple[Breakpoint, ...]:
        """Return breakpoints at up to two actions."""
        names = [each.full_name for each in self.graph.actions]
        chosen = self.chance.sample(names, self.chance.randint(0, 2))
        return tuple(
            Breakpoint(
                action=name,
                visit=self.chance.choice((0, 0, 1, 3)),
                outcomes=self.chance.choice(((), (), ("true",), ("false", "error"))),
            )
            for name in chosen
        )

    async def press(self, control: ExecutionService, press: str) -> None:
        """Do what a press does now, if anything."""
        now = control.open[self.run].run
        since = time(now.held.at) if now.held is not None else None
        nodes = [each.full_name for each in self.graph.actions]
        if press == "wait":
            await control.wait(self.run, WaitRequest(), BEN)
        elif press == "marks":
            await control.set_breakpoints(
                self.run, BreakpointsRequest(self.marks(), now.breakpoints), ANN
            )
        elif since is not None and press == "go on":
            await control.go_on(self.run, GoOnRequest(since), ANN)
        elif since is not None and press == "step":
            await control.step(self.run, StepRequest(since), BEN)
        elif since is not None and press == "until":
            await control.step(self.run, StepRequest(since, until=self.chance.choice(nodes)), BEN)

    async def _end(self, control: ExecutionService) -> None:
        if self.graph.name == "carousel" or self.chance.random() < 0.4:
            self.is_stopped = bool(await control.stop(self.run, BEN))
        for _ in range(200):
            if self.run not in control.open or control.open[self.run].run.end is not None:
                break
            held = control.open[self.run].run.held
            if held is not None:
                with suppress(Refused):
                    await control.go_on(self.run, GoOnRequest(time(held.at)), ANN)
            await anyio.sleep(1)
        assert await ended(control, self.run) == ("stopped" if self.is_stopped else "finished")

    def check(self) -> None:
        """Raise AssertionError if an action began twice, while the run waited, or after a Stop, or if
        the run went another way than in the plain simulator."""
        told = self.harness.journal.told(self.run)
        require_gate(told)
        begun = Counter(each.node for each in told if isinstance(each, PlayBegan))
        actions = self.harness.journal.history(self.run).actions
        seen = {name: each.older + len(each.visits) for name, each in actions.items()}
        assert all(seen[name] <= begun[name] for name in seen)
        if not self.is_stopped:
            assert seen == course(self.graph)


def course(graph: Graph) -> dict[str, int]:
    """Return how many times each action ends when the simulator plays the whole graph."""
    ends = Counter(
        each.node
        for each in simulate(graph, script=Script({}), until_ms=1e6)
        if isinstance(each, NodeResultEvent)
    )
    return {each.full_name: ends[each.full_name] for each in graph.actions}


def require_gate(told: list[RunEvent]) -> None:
    calls: set[int] = set()
    is_held, is_stopped, only = False, False, ""
    for event in told:
        match event:
            case Held():
                is_held = True
            case Released(step=step):
                is_held, only = False, step
            case StopRequested():
                is_stopped = True
            case PlayBegan(call=call, node=node):
                assert not is_held
                assert not is_stopped
                assert call not in calls
                assert only in {"", node}
                calls.add(call)
            case _:
                pass


@settings(max_examples=examples(10), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(some.integers(0, 10**9))
@example(93)
@example(100)
@example(800)
def test_no_history_lets_a_simulated_action_begin_twice_while_it_waits_or_after_a_stop(
    seed: int,
) -> None:
    async def main() -> None:
        history = History(seed)
        await history.live()
        history.check()

    run_in_virtual_time(main)
