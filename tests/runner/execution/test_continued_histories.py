"""Random histories of led runs on robots: waits, steps, restarts, Stops and runs that continue others, in
virtual time. No action is sent twice unless a person chose *again*, and none after a Stop."""

import random
from collections import Counter
from contextlib import suppress

import anyio
import msgspec
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some

from action_assistant.errors import Refused
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.earlier import Choice, StartFrom
from action_assistant.runner.runs.events import PieceBegan, StopRequested
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest, StepRequest, WaitRequest
from runner.execution.test_conductor import Lab, led, shared
from runner.execution.test_continued_runs import asked
from runner.harness import ANN, BEN, clock_us, run_in_virtual_time, sequence, two_lines
from support.doses import examples

_PRESSES = ("wait", "go on", "step", "stop", "continue", "restart", "rest", "rest")
_CHOICES: tuple[Choice, ...] = ("again", "again", "true", "leave")


class History:
    """A run, those that continue it, and what people press, as a seed decides."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.lab = Lab({"*": [{"after_s": self.chance.choice((1, 3)), "stop_s": 0.2}]})
        for robot in (self.lab.david, self.lab.carol):
            robot.loss = self.chance.choice((0.0, 0.0, 0.2))
        graph = self.chance.choice((sequence("task", 5), two_lines("task")))
        self.start = led(shared(graph, "Scout", "Carrier"), lost="wait")
        self.runs: list[str] = []
        self.again = Counter[str]()

    async def live(self) -> None:
        """Live through all presses, then stop whatever goes on."""
        rest = [self.chance.choice(_PRESSES) for _ in range(self.chance.randint(4, 16))]
        while rest:
            async with self.lab.runner() as control:
                if not self.runs:
                    with suppress(Refused):
                        self.runs.append((await control.start(self.start, ANN)).run.id)
                    if not self.runs:
                        return
                while rest and (press := rest.pop()) != "restart":
                    await anyio.sleep(self.chance.random() * 4)
                    with suppress(Refused):
                        await self._press(control, press)
                if not rest:
                    await control.stop(self.runs[-1], BEN)
                    await anyio.sleep(60)

    async def _press(self, control: ExecutionService, press: str) -> None:
        run = self.runs[-1]
        if press == "continue":
            await self._continue(control, run)
        elif run not in control.open:
            return
        elif press == "stop":
            await control.stop(run, BEN)
            await anyio.sleep(self.chance.random() * 5)
        elif press == "wait":
            await control.wait(run, WaitRequest(), BEN)
        elif (held := control.open[run].run.held) is not None:
            if press == "go on":
                await control.go_on(run, GoOnRequest(time(held.at)), ANN)
            elif press == "step":
                await control.step(run, StepRequest(time(held.at)), BEN)

    async def _continue(self, control: ExecutionService, run: str) -> None:
        since = StartFrom(run=run)
        request = msgspec.structs.replace(
            self.start, start_from=since, request_id=f"{run} {clock_us()}"
        )
        (look, *_) = await control.look(asked(request), "ann")
        if look.earlier is None:
            return
        names = [each.action for each in look.earlier.under_way]
        choices = {name: self.chance.choice(_CHOICES) for name in names}
        since = StartFrom(run=run, choices=choices, reason="I looked.")
        request = msgspec.structs.replace(request, start_from=since)
        started = await control.start(request, ANN)
        self.runs.append(started.run.id)
        self.again.update(name for name, choice in choices.items() if choice == "again")

    def check(self) -> None:
        """Raise AssertionError if an action was sent once too often, or after a Stop."""
        sent = [*self.lab.david.starts, *self.lab.carol.starts]
        assert len({each.run for each in sent}) == len(sent)
        counts = Counter(each.graph.name.removeprefix("task--") for each in sent)
        for name, count in counts.items():
            assert count <= 1 + self.again[name], (name, count, self.runs)
        for run in self.runs:
            is_stopped = False
            for event in self.lab.harness.journal.told(run):
                is_stopped = is_stopped or isinstance(event, StopRequested)
                assert not (is_stopped and isinstance(event, PieceBegan))


@settings(max_examples=examples(6), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(some.integers(0, 10**9))
def test_no_history_sends_an_action_twice_unasked_or_after_a_stop(seed: int) -> None:
    async def main() -> None:
        history = History(seed)
        await history.live()
        history.check()

    run_in_virtual_time(main)
