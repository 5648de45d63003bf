"""Random histories of led runs in the simulator whose engine dies, and whose journal is slow or fails: no
action begins twice, none while the run waits or after a Stop, and no end is shown while one goes on. Seeds that
failed are kept as examples."""

import random
from collections import Counter
from contextlib import suppress
from functools import partial
from typing import Any

import anyio
from anyio.abc import TaskGroup
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as some

from action_assistant.errors import Refused
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.led_calls import LedCalls
from action_assistant.runner.links.port import EngineChanged, NoAnswer, NotSent
from action_assistant.runner.links.simulator import SimulatorLink, engine_of
from action_assistant.runner.runs.events import PlayBegan
from action_assistant.runner.runs.run import ENDED
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest
from action_assistant.umrf.semantics import Returned
from runner.execution.test_led_simulated import simulated
from runner.execution.test_led_simulated_histories import PRESSES, History, course, require_gate
from runner.harness import ANN, BEN, clock_us, run_in_virtual_time
from support.doses import examples

_FAULTS = ("die", "die", "slow", "down", "forget", "well")


class MortalEngine(SimulatorLink):
    """A simulated engine whose process can die. Until that is noticed nothing answers, and what is sent is
    lost."""

    def __init__(self, history: "FaultyHistory", *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._history = history
        self._is_noticed = anyio.Event()
        self._line = anyio.Lock()

    async def die(self, noticed_after: float) -> None:
        """End at once, and report that after so many seconds."""
        self._dead = "Its process has died."
        await anyio.sleep(noticed_after)
        self._is_noticed.set()
        self._subscribers.tell(EngineChanged(at=clock_us(), state="gone", why=self._dead))

    async def play(self, number: int) -> None:
        """Let the script play a call, as the gate has let it begin."""
        self._history.plays(self, number)
        async with self._line:  # messages to it come late, in their order
            await anyio.sleep(self._history.delay())
            await super().play(number)

    async def returned(self, returned: Returned) -> None:
        """Raise NotSent once it has died."""
        if self._dead is not None:
            raise NotSent(self._dead)
        await super().returned(returned)

    async def get(self) -> Any:
        """Once it has died, wait until that is noticed, and raise NoAnswer."""
        if self._dead is not None:
            await self._is_noticed.wait()
            raise NoAnswer(self._dead)
        return await super().get()

    def executing(self) -> list[str]:
        """Return the actions that go on in it."""
        if self._dead is not None:
            return []
        return [each.node for each in self._engine.executing(self._engine.now)]


class FaultyHistory(History):
    """A history in which the engine and the journal fail, too."""

    def __init__(self, seed: int, *, late: bool = False) -> None:
        super().__init__(seed)
        self.fate = random.Random(f"faults {seed}")
        self.lateness = random.Random(f"late {seed}") if late else None
        #: Two actions end so close to each other that it depends on the engine which is first.
        self.script = {"Work_0": [{"after_s": 2.001}]} if late else {}
        self.faults: list[str] = []
        self.engines: list[MortalEngine] = []
        self.played: dict[int, list[MortalEngine]] = {}  # by call, in this life of the runner
        self.begun: list[int] = []  # the calls that began, in all lives of the runner
        self.harness.simulator = self._make

    def _make(
        self,
        facts: Any,
        script: str,
        clock: Any,
        behaviours: Any = None,
        led: frozenset[str] = frozenset(),
    ) -> SimulatorLink:
        calls = LedCalls(led)
        engine = engine_of(facts, script, calls)
        self.engines.append(MortalEngine(self, engine, clock_us=clock, performer=calls))
        return self.engines[-1]

    def delay(self) -> float:
        """Return for how long a message to the engine is under way, in seconds."""
        return self.lateness.random() * 0.003 if self.lateness is not None else 0.0

    def plays(self, engine: MortalEngine, call: int) -> None:
        """Called in the moment in which an engine is let play a call."""
        before = self.played.setdefault(call, [])
        if engine in before:
            self.faults.append(f"call {call} began twice in one engine")
        if not before:
            self.begun.append(call)
            opened = self.control.open.get(self.run) if self.control is not None else None
            if opened is not None and opened.run.desired == "stopped":
                self.faults.append(f"call {call} began after a Stop")
        before.append(engine)

    def judge(self, opened: OpenRun) -> None:
        """Called at each change: a run that is over must not go on, and no action waits twice."""
        run = opened.run
        waiting = [node for node, _ in run.waits.values()]
        if len(waiting) > len(set(waiting)):
            self.faults.append(f"{waiting} wait twice")
        if run.led is not None and run.end not in {None, "lost"} and self.engines:
            going = self.engines[-1].executing()
            if going:
                self.faults.append(f"{run.end} while {going} go on")

    async def live(self) -> None:
        """Live through all presses and faults, and then mend everything and let the run end."""
        rest = [self.chance.choice(PRESSES) for _ in range(self.chance.randint(4, 14))]
        self.is_stopped = self.graph.name == "carousel" or self.chance.random() < 0.4
        while True:
            self.played.clear()
            async with self.harness.runner() as control, anyio.create_task_group() as deaths:
                self.control = control
                control.watch(self.judge)
                if not self.run:
                    order = simulated(self.graph, *self.marks(), **self.script)
                    started = await control.start(order, ANN)
                    self.run = started.run.id
                while rest and (press := rest.pop()) != "restart":
                    await anyio.sleep(self.chance.random() * 3)
                    if self.fate.random() < 0.5:
                        self._fail(deaths)
                    if self.run in control.open:
                        with suppress(Refused):
                            await self.press(control, press)
                if not rest:
                    await self._come_to_end(control)
                    deaths.cancel_scope.cancel()
                    return
                if self.fate.random() < 0.7:  # else the runner ends with what it could not store
                    self._mend()
                    await anyio.sleep(2)
                deaths.cancel_scope.cancel()
            self._mend()
            # What the simulator began and nobody could store is not known to have begun, and moves nothing.
            stored = self._stored()
            self.begun = [each for each in self.begun if each in stored]

    def _stored(self) -> dict[int, str]:
        """Return the actions of which a begin is stored, by call."""
        told = self.harness.journal.told(self.run)
        return {each.call: each.node for each in told if isinstance(each, PlayBegan)}

    def _fail(self, deaths: TaskGroup) -> None:
        journal = self.harness.journal
        match self.fate.choice(_FAULTS):
            case "die":
                deaths.start_soon(self.engines[-1].die, self.fate.choice((0.0, 0.01, 0.5, 3.0)))
            case "slow":
                journal.slow = self.fate.choice((0.05, 0.7, 4.0, 8.0))
            case "down":
                journal.down = True
            case "forget":
                journal.forgetful = True
            case _:
                self._mend()

    def _mend(self) -> None:
        journal = self.harness.journal
        journal.slow, journal.down, journal.forgetful = 0.0, False, False

    async def _come_to_end(self, control: ExecutionService) -> None:
        self._mend()
        await anyio.sleep(10)
        for second in range(300):
            opened = control.open.get(self.run)
            if opened is None:
                return
            if self.is_stopped and second == 3:
                await control.stop(self.run, BEN)
            elif opened.run.held is not None:
                with suppress(Refused):
                    await control.go_on(self.run, GoOnRequest(time(opened.run.held.at)), ANN)
            await anyio.sleep(1)
        last = control.open[self.run].run
        if not any(each.code == "led_failed" for each in last.alarms):
            self.faults.append(f"it never ends: {last.state}, {last.held}")
        await control.stop(self.run, BEN)
        await anyio.sleep(60)
        if self.run in control.open:
            self.faults.append("a Stop does not end it")

    def check(self) -> None:
        """Raise AssertionError if something was seen that must not be."""
        told = self.harness.journal.told(self.run)
        require_gate(told)
        assert self.faults == []
        assert len(self.begun) == len(set(self.begun))
        assert sorted(self._stored()) == sorted(self.begun)
        begun = Counter(self._stored().values())
        run = self.harness.journal.history(self.run)
        assert run.state in ENDED
        # A visit may be missed that began while nobody knew yet that the engine was dead.
        assert all(
            each.older + len(each.visits) <= begun[name] for name, each in run.actions.items()
        )
        if run.state == "finished":
            assert begun == course(self.graph)


@settings(max_examples=examples(8), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(some.integers(0, 10**9))
@example(11)
@example(14)
@example(154)
@example(464)
@example(603)
@example(902)
def test_no_death_of_the_engine_and_no_fault_of_the_journal_begins_a_simulated_action_twice(
    seed: int,
) -> None:
    run_in_virtual_time(partial(lived, FaultyHistory(seed)))


@settings(max_examples=examples(4), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(some.integers(0, 10**9))
@example(0)
@example(41)
@example(52)
@example(60)
def test_no_death_mixes_up_actions_of_which_an_engine_hears_late(seed: int) -> None:
    run_in_virtual_time(partial(lived, FaultyHistory(seed, late=True)))


async def lived(history: FaultyHistory) -> None:
    await history.live()
    history.check()
